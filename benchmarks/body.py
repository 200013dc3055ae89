"""What do the modal integrals and all geometric stiffness matrices cost?

    python benchmarks/body.py [--quick]

A box of quadratic tetrahedra with five rigid interfaces. `flexible_body` projects twelve vectors, six mass matrices
and 12 + 24 geometric stiffness matrices on the modes; its share is of the eigen solve (`lowest_modes`, factor
excluded). Exudyn, where it is installed, computes its own integrals (no geometric stiffness) of the same mass matrix
and modes; ours are then those alone. `--quick`: 30 000 DOFs and 40 modes; else 100 000 and 60. The last line is JSON:
`share_of_eigen_solve` and `integrals_vs_exudyn` (its time over ours; null without Exudyn).
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable

import numpy as np
from assembly import STEEL, tet_mesh
from craig_bampton import clocked, interfaces

import modalprep as mp

ROUNDS = 3


def seconds(call: Callable) -> float:
    """Of one call."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def integrals(model: mp.fe.FEModel, Phi: np.ndarray) -> None:
    """Every integral of the modal body but the geometric stiffness."""
    _ = model.g.T @ Phi
    np.einsum("dab,dn->abn", model.h, Phi, optimize=True)
    model.M_ab.project(Phi)


def exudyn(model: mp.fe.FEModel, Phi: np.ndarray) -> Callable | None:
    """Exudyn's integrals of the same model and modes."""
    try:
        from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
    except ImportError:
        return None
    rows = model.dof[: len(model.points), :3].ravel()
    fem = FEMinterface()
    fem.nodes = {"Position": model.points}
    fem.massMatrix = model.M[rows][:, rows].tocsr()
    fem.stiffnessMatrix = model.K[rows][:, rows].tocsr()
    fem.modeBasis = {"matrix": Phi[rows], "type": "NormalModes"}
    return lambda: ObjectFFRFreducedOrderInterface(fem)


def main() -> None:
    """Reduce once, then project in turns."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="30 000 DOFs and 40 modes")
    quick = parser.parse_args().quick
    sizes, count = ((10, 10, 10), 40) if quick else ((16, 16, 16), 60)
    spent: dict[str, float] = {}
    model = mp.assemble(tet_mesh(sizes), {"body": mp.Solid(material=STEEL)}, interfaces())
    reduction = mp.craig_bampton(model, modes=count, truncation=(), algebra=clocked(spent))
    Phi = reduction.basis[:, :count]
    inertial = reduction.inertial[:, :count]
    small = reduction.with_(basis=Phi, frequency=reduction.frequency[:count], inertial=inertial)
    mp.flexible_body(model, small, name="box")
    body = statistics.median(seconds(lambda: mp.flexible_body(model, small, name="box")) for _ in range(ROUNDS))
    peer = exudyn(model, Phi)
    pairs = [(seconds(lambda: integrals(model, Phi)), seconds(peer)) for _ in range(ROUNDS)] if peer else []
    line = {
        "share_of_eigen_solve": round(body / spent["eigen"], 3),
        "integrals_vs_exudyn": round(statistics.median(b / a for a, b in pairs), 1) if pairs else None,
    }
    print(f"{model.n_dof} DOFs, {count} modes, {len(Phi.T)} columns projected")
    print(json.dumps(line))


if __name__ == "__main__":
    main()
