"""Does a solid of a million DOFs go through on a workstation?

    python benchmarks/million.py [--quick]

A cube of quadratic tetrahedra, the worst shape for a direct solver, held on one face: mesh, assembly, 20 modes,
truncation vectors, geometric stiffness, modal body. `--quick`: 30 000 DOFs, in memory that double precision would
not fit into either, so that the same road is taken. The last line is JSON: `dofs`, `minutes` by stage,
`peak_gib` of the process, `worst_residual` of the modes.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import time

import numpy as np
from assembly import STEEL, tet_mesh

import modalprep as mp
from modalprep.linalg.memory import BUDGET

MODES = 20


def main() -> None:
    """Run the road once."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="30 000 DOFs, in a fraction of a gibibyte")
    quick = parser.parse_args().quick
    if quick:
        os.environ[BUDGET] = "0.12"
    marks, clock = [], time.perf_counter
    marks.append(clock())
    model = mp.assemble(tet_mesh((10,) * 3 if quick else (34,) * 3), {"body": mp.Solid(material=STEEL)},
                        {"root": mp.Interface(group="root")})  # fmt: skip
    marks.append(clock())
    print(f"{model.n_dof} DOFs assembled", flush=True)
    reduction = mp.craig_bampton(model, modes=MODES)
    marks.append(clock())
    print(f"reduced: {reduction}", flush=True)
    mp.flexible_body(model, reduction, name="cube")
    marks.append(clock())
    phi = reduction.basis[:, :10]
    inertial = (model.M @ phi) * (2 * np.pi * reduction.frequency[:10]) ** 2
    interior = np.setdiff1d(model.free, model.interfaces[0].dofs)
    lost = np.linalg.norm((model.K @ phi - inertial)[interior], axis=0)
    stages = dict(zip(("assembly", "reduction", "body"), np.diff(marks) / 60, strict=True))
    line = {
        "dofs": model.n_dof,
        "minutes": {name: round(spent, 2) for name, spent in stages.items()},
        "peak_gib": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 2),
        "worst_residual": float((lost / np.linalg.norm(inertial[interior], axis=0)).max()),
    }
    print(json.dumps(line))


if __name__ == "__main__":
    main()
