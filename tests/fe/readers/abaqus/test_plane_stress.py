"""Plane stress elements as shells: in their plane as the theory of elasticity and CalculiX have them."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from calculix import needs_ccx
from fe.abaqus_decks import NU, RHO, STEEL, E

import modalprep as mp
from modalprep.errors import InputError

PATCH = [(0, 0), (0.24, 0), (0.24, 0.12), (0, 0.12), (0.04, 0.02), (0.18, 0.03), (0.16, 0.08), (0.08, 0.08)]
QUADS = [(1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8), (5, 6, 7, 8)]  # MacNeal and Harder
TRIANGLES = [half for a, b, c, d in QUADS for half in ((a, b, c), (a, c, d))]
THICK = 0.02


def deck(kind, points, cells, *, more=""):
    """A deck of plane stress elements; those of second order get their middle nodes."""
    points = [tuple(point) for point in points]
    edges: dict[frozenset, int] = {}
    rows = []
    for cell in cells:
        row = list(cell)
        if int(kind[3]) > len(cell):
            for a, b in zip(cell, (*cell[1:], cell[0]), strict=True):
                if frozenset((a, b)) not in edges:
                    points.append(tuple(np.mean([points[a - 1], points[b - 1]], axis=0)))
                    edges[frozenset((a, b))] = len(points)
                row.append(edges[frozenset((a, b))])
        rows.append(row)
    text = "*NODE\n" + "".join(f"{k}, {x:.12g}, {y:.12g}\n" for k, (x, y) in enumerate(points, 1))
    text += f"*ELEMENT, TYPE={kind}, ELSET=p\n"
    text += "".join(f"{k}, {', '.join(map(str, row))}\n" for k, row in enumerate(rows, 1))
    return f"{text}{STEEL}*SOLID SECTION, ELSET=p, MATERIAL=steel\n{THICK}\n{more}"


@pytest.mark.parametrize(
    ("kind", "cells"), [("CPS3", TRIANGLES), ("CPS4", QUADS), ("CPS4R", QUADS), ("CPS6", TRIANGLES), ("CPS8", QUADS)]
)
@pytest.mark.parametrize("distorted", [False, True])
def test_patch(read, kind, cells, distorted):
    """Constant strains give the exact energy: ``eps^T D eps A t / 2`` of plane stress."""
    points = np.array(PATCH)
    if not distorted:
        points[4:] = [(0.08, 0.04), (0.16, 0.04), (0.16, 0.08), (0.08, 0.08)]
    mesh = read(deck(kind, points, cells))
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    D = E / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]])
    for strain in np.eye(3):
        xx, yy, xy = 1e-3 * strain
        u = np.zeros(model.n_dof)
        at = mesh.points[:, :2]
        u[model.dof[:, 0]] = xx * at[:, 0] + xy / 2 * at[:, 1]
        u[model.dof[:, 1]] = xy / 2 * at[:, 0] + yy * at[:, 1]
        exact = 1e-6 * strain @ D @ strain * 0.24 * 0.12 * THICK
        assert u @ model.K @ u == pytest.approx(exact, rel=1e-9)


def strip(kind, n):
    """A cantilever of 1 m by 0.2 m, and the support that clamps it."""
    x, y = np.meshgrid(np.linspace(0, 1, 5 * n + 1), np.linspace(0, 0.2, n + 1), indexing="ij")
    number = np.arange(x.size).reshape(x.shape) + 1
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    text = deck(kind, np.stack([x.ravel(), y.ravel()], axis=1), quads.tolist())
    nodes = np.array(re.findall(r"^(\d+), (\S+), (\S+)$", text.partition("*ELEMENT")[0], re.MULTILINE), dtype=float)
    held = "".join(f"{int(label)},\n" for label, x, _ in nodes if x == 0)
    return f"{text}*NSET, NSET=fix\n{held}*BOUNDARY\nfix, 1, 2\n"


def in_plane(mesh, count):
    """Frequencies of a plane body on its own supports, kept in its plane."""
    held = {"own": mp.Support(set="boundary"), "flat": mp.Support(set="plane")}
    model = mp.assemble(mesh, {}, {"root": mp.Interface(kind="support")}, supports=held)
    return mp.craig_bampton(model, modes=count, truncation=[]).frequency[:count]


@needs_ccx
@pytest.mark.parametrize(("kind", "n", "tolerance"), [("CPS8", 2, 5e-3), ("CPS4", 6, 1.5e-2)])
def test_modes_of_calculix(read, tmp_path, kind, n, tolerance):
    """CalculiX' CPS8R of a fine mesh is the reference, to the error of the meshes here."""
    if shutil.which("ccx") is None:
        pytest.skip("no ccx")
    (tmp_path / "job.inp").write_text(strip("CPS8", 4) + "*STEP\n*FREQUENCY\n4\n*END STEP\n")
    subprocess.run(["ccx", "job"], cwd=tmp_path, check=True, capture_output=True)
    printed = (tmp_path / "job.dat").read_text().partition("P A R T I C I P A T I O N")[0]
    found = np.array(re.findall(r"^\s+\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", printed, re.MULTILINE)[:4], dtype=float)
    np.testing.assert_allclose(in_plane(read(strip(kind, n)), 4), found, rtol=tolerance)


def test_it_bends_out_of_its_plane_as_the_plate_that_it_is(read):
    """The strip clamped at its end: ``1.875^2 sqrt(E I / rho A) / (2 pi L^2)`` of a beam, a plate to 3 %."""
    held = {"own": mp.Support(plane=((0, 0, 0), (1, 0, 0)))}
    model = mp.assemble(read(strip("CPS8", 2)), {}, {"root": mp.Interface(kind="support")}, supports=held)
    first = mp.craig_bampton(model, modes=1, truncation=[]).frequency[0]
    beam = 1.8751**2 * np.sqrt(E * THICK**2 / (12 * RHO)) / (2 * np.pi)
    assert first == pytest.approx(beam, rel=0.03)


@pytest.mark.parametrize(
    ("kind", "said"),
    [("CPE4", "plane strain, which no body in space has"), ("CAX4", "mesh the whole body"), ("Z7", "read its .mtx")],
)
def test_what_has_no_counterpart_says_what_to_do(read, kind, said):
    with pytest.raises(InputError, match=said):
        read(deck("CPS4", PATCH, QUADS).replace("CPS4", kind))


def test_surfaces_without_a_section_stay_groups(read):
    mesh = read("*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n*ELEMENT, TYPE=CPS4, ELSET=s\n1,1,2,3,4\n")
    assert mesh.properties == {}
    assert mesh.supports == {}
