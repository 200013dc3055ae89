"""Responses of second-order bricks and of CalculiX' expanded shell against its own steady-state dynamics.

The decks are those of ISCPC/CalculiX-ccx-test, test; ccx of Debian's calculix-ccx solves them with a shaken support.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from structured import box, solid_model

import modalprep as mp
from modalprep.response import harmonic_response

DATA = Path(os.environ.get("MODALPREP_DATA", Path(__file__).parents[3] / "shared" / "data")) / "calculix"
pytestmark = [
    pytest.mark.skipif(not DATA.is_dir(), reason=f"the decks are not in {DATA} (set MODALPREP_DATA)"),
    pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed"),
]
MODES = 10
STEP = """
*STEP
*FREQUENCY,STORAGE=YES
10
*END STEP
*STEP
*STEADY STATE DYNAMICS
{low},{high},5
*BASE MOTION,DOF=3,AMPLITUDE=ONE
*MODAL DAMPING
1,10,0.02
*NODE PRINT,NSET=SHOWN
U
*END STEP
"""


def shaken(name, folder, node, low, high):
    """Frequencies (Hz) and complex displacements (nf, 3) of a node while the support accelerates by one along z."""
    deck = (DATA / f"{name}.inp").read_text()
    deck = deck[: re.search(r"^\*step", deck, re.IGNORECASE | re.MULTILINE).start()]
    text = f"*AMPLITUDE,NAME=ONE\n0.,1.,1e9,1.\n{deck}*NSET,NSET=SHOWN\n{node}\n{STEP.format(low=low, high=high).lstrip()}"
    (folder / "job.inp").write_text(text)
    subprocess.run(["ccx", "job"], cwd=folder, check=True, capture_output=True)
    text = (folder / "job.dat").read_text()
    printed = text[text.index("F O R   F R E Q U E N C Y") :]
    f = np.array(re.findall(r"F R E Q U E N C Y\s+(\S+)", printed), dtype=float)
    rows = np.array(re.findall(rf"^\s+{node}((?:\s+-?\d\.\d+E[+-]\d+){{3}})\s*$", printed, re.MULTILINE))
    u = np.array([row.split() for row in rows], dtype=float).reshape(len(f), 2, 3)
    return f, u[:, 0] + 1j * u[:, 1]


def own(model, mesh, where, f):
    """The same by ten modes of the body that is clamped at its root."""
    wanted = {"shown": mp.fe.Recover(kind="acceleration", near=tuple(where))}
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    reduction = mp.craig_bampton(model, modes=MODES, truncation_vectors=[])
    body = mp.flexible_body(model, reduction, name="plate", recovery=recovery)
    found = harmonic_response(body, {"base.z": 1.0}, f, damping=0.02, refine=False)
    names = [name for name in found.names if name.startswith("shown.")]
    return np.stack([found[name] for name in names], axis=1)
