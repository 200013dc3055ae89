"""Harmonic responses of second-order bricks against CalculiX' steady-state dynamics on the same decks, by ten modes.

The decks are dloadlin20f and shellf of ISCPC/CalculiX-ccx-test, test; ccx is that of Debian's calculix-ccx.
"""

import re
import shutil
import subprocess

import numpy as np
import pytest
import shared_data
from structured import box

import modalprep as mp
from modalprep.fe.links.mean_points import MeanPoints, cells_of
from modalprep.response import harmonic_response

DATA = shared_data.DATA / "calculix"
needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
needs_decks = pytest.mark.skipif(not DATA.is_dir(), reason=f"the decks are not in {DATA} (set MODALPREP_DATA)")
MODES, RATIO = 10, 0.02
STEPS = """*STEP
*FREQUENCY,STORAGE=YES
10
*END STEP
*STEP
*STEADY STATE DYNAMICS
{low},{high},6
*CLOAD
{loads}
*MODAL DAMPING
1,10,0.02
*NODE PRINT,NSET=SHOWN
U
*END STEP
"""


def expanded_shell():
    """Deck of shellf as the bricks that CalculiX makes of its shells: of unit area, .01, .03 and .02 thick along x."""
    points, cells = box("hexahedron20", (2, 2, 1))
    points[:, 2] = (points[:, 2] - 0.5) * np.interp(points[:, 0], [0, 0.5, 1], [0.01, 0.03, 0.02])
    held = 1 + np.flatnonzero(np.isclose(points[:, 0], 0))
    lines = ["*NODE, NSET=Nall", *(f"{k}, {x:.12g}, {y:.12g}, {z:.12g}" for k, (x, y, z) in enumerate(points, start=1))]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=Eall")
    for k, cell in enumerate(cells + 1, start=1):
        lines += [f"{k}, " + ", ".join(map(str, cell[:15])) + ",", ", ".join(map(str, cell[15:]))]
    lines += ["*NSET, NSET=left", *(f"{k}," for k in held)]
    lines += ["*MATERIAL, NAME=EL", "*ELASTIC", "210000, .3", "*DENSITY", "7.8E-9"]
    return "\n".join([*lines, "*SOLID SECTION, ELSET=Eall, MATERIAL=EL", "*BOUNDARY", "left, 1, 3", ""])


def plate():
    deck = (DATA / "dloadlin20f.inp").read_text()
    return deck[: deck.index("*step")]


def theirs(folder, shown, loaded, shares, low, high):
    """Frequencies (Hz) and complex accelerations (nf, 3) of a node under a unit force along z, shared by nodes."""
    loads = "\n".join(f"{label},3,{share:.15g}" for label, share in zip(loaded, shares, strict=True))
    deck = (folder / "plate.inp").read_text()
    text = f"{deck}*NSET,NSET=SHOWN\n{shown}\n{STEPS.format(low=low, high=high, loads=loads)}"
    (folder / "job.inp").write_text(text)
    subprocess.run(["ccx", "job"], cwd=folder, check=True, capture_output=True)
    text = (folder / "job.dat").read_text()
    printed = text[text.index("F O R   F R E Q U E N C Y") :]
    f = np.array(re.findall(r"F R E Q U E N C Y\s+(\S+)", printed), dtype=float)
    rows = re.findall(rf"^\s+{shown}((?:\s+-?\d\.\d+E[+-]\d+){{3}})\s*$", printed, re.MULTILINE)
    u = np.array([row.split() for row in rows], dtype=float).reshape(len(f), 2, 3)
    return f, -((2 * np.pi * f[:, None]) ** 2) * (u[:, 0] + 1j * u[:, 1])


def ours(model, mesh, where, f):
    """The same by ten modes of the body that is clamped at its root, its end an interface that follows the mean."""
    reduction = mp.craig_bampton(model, modes=MODES, truncation=())
    shown = {"shown": mp.fe.Recover(kind="acceleration", near=tuple(where))}
    recovery = mp.fe.model_recovery(model, mesh, shown)
    body = mp.flexible_body(model, reduction, name="plate", recovery=recovery)
    found = harmonic_response(body, {"tip.z": 1.0}, f, damping=RATIO, refine=False)
    return np.stack([found[name] for name in found.names if name.startswith("shown.")], axis=1)


@needs_ccx
@pytest.mark.parametrize(
    ("deck", "low", "high", "digits"),
    [
        # The first two eigenvalues of the other program err by 3e-8 of the third (test_abaqus_answers.py): 1e-5.
        pytest.param(plate, 5.0, 200.0, 1e-5, marks=needs_decks, id="dloadlin20f"),
        pytest.param(expanded_shell, 1e4, 1e5, 5e-7, id="shellf"),
    ],
)
def test_force_at_the_end_of_a_plate(deck, low, high, digits, tmp_path):
    """Ten modes and 2 % of damping, from below the first resonance to above others; seven digits are printed.

    A relative error e of a frequency f_k changes its mode's share by ``2 e / |1 - (f/f_k)^2 + 2 i z f/f_k|``.
    """
    (tmp_path / "plate.inp").write_text(deck())
    mesh = mp.read_mesh(tmp_path / "plate.inp")
    x = mesh.points[:, 0]
    far = np.flatnonzero(np.isclose(x, x.max()))
    ends = np.array([mesh.points[far].min(axis=0), mesh.points[far].max(axis=0)]) + 1e-3 * np.array([[-1], [1]])
    tip = mp.Interface(box=ends.tolist(), kind="rbe3", boundary="free")
    model = mp.assemble(mesh, {}, {"root": mp.Interface(group="left"), "tip": tip})
    shares = MeanPoints.over(mesh.points, far, cells_of(mesh, tip, far)[0]).nodal  # those of a uniform traction
    f, expected = theirs(tmp_path, mesh.labels[far[0]], mesh.labels[far], shares, low, high)
    found = ours(model, mesh, mesh.points[far[0]], f)
    r = f[:, None] / mp.craig_bampton(model, modes=2, truncation=()).table.frequency[:2]
    bound = 1e-6 + 2 * digits * np.sum(1 / np.abs(1 - r**2 + 2j * RATIO * r), axis=1)
    assert len(f) > 10
    assert np.all(np.abs(found - expected).max(axis=1) < bound * np.abs(expected).max(axis=1))
    assert np.abs(found).max() > 10 * np.abs(found[0]).max()  # a resonance is among them
