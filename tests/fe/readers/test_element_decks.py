"""Every element type of every program in decks of its own: a patch, a distorted patch, and a mode in closed form.

Node orders are those of the manuals, written here and not taken from the readers.
"""

import numpy as np
import pytest
from calculix import deck, frequencies, needs_ccx
from fe.ansys_decks import eblock, nblock
from structured import box, macneal_harder, surface

import modalprep as mp

E, NU, RHO = 2e11, 0.3, 7800.0
THICK, SIDE = 0.01, 0.1  # of shells; of the square section of beams and bars
LINE = "line"

# ---- orders of the nodes of meshio's cells in the lines of the programs

TET, WEDGE, BRICK = [*range(10)], [*range(15)], [*range(20)]
NASTRAN = {
    "tetra10": TET,
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],  # the upright edges before those of the top
    "hexahedron20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
}
ANSYS = {
    "tetra": [0, 1, 2, 2, 3, 3, 3, 3],
    "pyramid": [0, 1, 2, 3, 4, 4, 4, 4],
    "wedge": [0, 1, 2, 2, 3, 4, 5, 5],
    "wedge15": [0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 2, 8, 9, 10, 5, 11, 12, 13, 14, 14],
    "triangle": [0, 1, 2, 2],
}
ANSYS |= {
    "tetra10 as a brick": [0, 1, 2, 2, 3, 3, 3, 3, 4, 5, 2, 6, 3, 3, 3, 3, 7, 8, 9, 9],
    "triangle6": [0, 1, 2, 2, 3, 4, 2, 5],
}


def nastran(kind, name, points, cells):
    """Bulk data in free field."""
    order = NASTRAN.get(kind, range(cells.shape[1]))
    lines = [f"GRID,{k},,{x:.13g},{y:.13g},{z:.13g}" for k, (x, y, z) in enumerate(points, 1)]
    for number, cell in enumerate(cells, 1):
        entries = [str(number), "5", *(str(cell[k] + 1) for k in order)]
        entries += ["0.", "1.", "0."] * (name in ("CBAR", "CBEAM"))
        lines += [",".join([name if k == 0 else "", *entries[k : k + 8]]) for k in range(0, len(entries), 8)]
    area, inertia = SIDE**2, SIDE**4 / 12
    section = {
        "CBAR": f"PBAR,5,7,{area:.9g},{inertia:.9g},{inertia:.9g},{2 * inertia:.9g}",
        "CBEAM": f"PBEAM,5,7,{area:.9g},{inertia:.9g},{inertia:.9g},,{2 * inertia:.9g}",
        "CROD": f"PROD,5,7,{area:.9g},{2 * inertia:.9g}",
        "CTUBE": f"PTUBE,5,7,{2 * SIDE / np.pi**0.5:.12g}",
    }
    solid = "PSOLID,5,7" if np.ptp(points[:, 2]) else f"PSHELL,5,7,{THICK},7,,7"
    return [*lines, section.get(name, solid), f"MAT1,7,{E:.3E},,{NU},{RHO}".replace("E+", "+"), "ENDDATA"]


def abaqus(kind, name, points, cells):
    """Keywords, the entries of an element in lines of fifteen."""
    order = [0, 2, 1] if kind == "line3" else range(cells.shape[1])
    lines = ["*NODE", *(f"{k}, {x:.13g}, {y:.13g}, {z:.13g}" for k, (x, y, z) in enumerate(points, 1))]
    lines.append(f"*ELEMENT, TYPE={name}, ELSET=E")
    for number, cell in enumerate(cells, 1):
        entries = [str(number), *(str(cell[k] + 1) for k in order)]
        groups = [", ".join(entries[k : k + 15]) for k in range(0, len(entries), 15)]
        lines += [group + "," * (group is not groups[-1]) for group in groups]
    lines += ["*MATERIAL, NAME=m", "*ELASTIC", f"{E}, {NU}", "*DENSITY", f"{RHO}"]
    if name[0] in "BP":
        shape = "PIPE" if name[0] == "P" else "RECT"
        sizes = f"{SIDE}, {SIDE / 5}" if name[0] == "P" else f"{SIDE}, {SIDE}"
        return [*lines, f"*BEAM SECTION, ELSET=E, MATERIAL=m, SECTION={shape}", sizes, "0, 0, 1"]
    if name[0] == "S":
        return [*lines, "*SHELL SECTION, ELSET=E, MATERIAL=m", f"{THICK}"]
    return [*lines, "*SOLID SECTION, ELSET=E, MATERIAL=m", f"{SIDE**2}" * (name[0] == "T")]


def ansys(kind, name, points, cells):
    """Blocks as CDWRITE writes them."""
    number = name.rpartition(" ")[2] if " " in name else name
    order = ANSYS.get(f"{kind} as a brick" if number in ("186", "95") and kind == "tetra10" else kind)
    rows = [cell if order is None or number in ("187", "92", "285") else cell[order] for cell in cells + 1]
    area, inertia = SIDE**2, SIDE**4 / 12
    section = ["SECTYPE,1,SHELL", f"SECDATA,{THICK}"]
    if number in ("188", "189"):
        section = ["SECTYPE,1,BEAM,RECT", f"SECDATA,{SIDE},{SIDE}"]
    if number in ("288", "289"):
        section = ["SECTYPE,1,PIPE", f"SECDATA,{SIDE},{SIDE / 5}"]
    if number in ("180", "8"):
        section = [f"R,1,{area:.9g}"]
    if number == "4":
        section = [f"R,1,{area:.9g},{inertia:.9g},{inertia:.9g}"]
    if number == "63":
        section = [f"R,1,{THICK}"]
    material = [f"MP,EX,1,{E}", f"MP,PRXY,1,{NU}", f"MP,DENS,1,{RHO}"]
    return ["/PREP7", f"ET,1,{number}", *material, *section, *nblock(points), *eblock(*rows)]


WRITERS = {"bdf": nastran, "inp": abaqus, "cdb": ansys}
SOLIDS = [
    *[("bdf", name, kind) for name, kinds in {
        "CTETRA": ("tetra", "tetra10"), "CPYRAM": ("pyramid", "pyramid13"), "CPENTA": ("wedge", "wedge15"),
        "CHEXA": ("hexahedron", "hexahedron20")}.items() for kind in kinds],
    *[("inp", name, kind) for name, kind in {
        "C3D4": "tetra", "C3D5": "pyramid", "C3D6": "wedge", "C3D8": "hexahedron", "C3D8I": "hexahedron",
        "C3D8R": "hexahedron", "C3D10": "tetra10", "C3D15": "wedge15", "C3D20": "hexahedron20",
        "C3D20R": "hexahedron20"}.items()],
    *[("cdb", name, kind) for name, kinds in {
        "185": ("tetra", "pyramid", "wedge", "hexahedron"), "45": ("tetra", "wedge", "hexahedron"),
        "186": ("tetra10", "pyramid13", "wedge15", "hexahedron20"), "95": ("wedge15", "hexahedron20"),
        "187": ("tetra10",), "92": ("tetra10",), "285": ("tetra",)}.items() for kind in kinds],
]  # fmt: skip
SHELLS = [
    ("bdf", "CTRIA3", "triangle"), ("bdf", "CQUAD4", "quad"), ("bdf", "CTRIA6", "triangle6"),
    ("bdf", "CQUAD8", "quad8"),
    ("inp", "S3", "triangle"), ("inp", "S3R", "triangle"), ("inp", "S4", "quad"), ("inp", "S4R", "quad"),
    ("inp", "S6", "triangle6"), ("inp", "S8R", "quad8"), ("inp", "S9R5", "quad9"),
    ("cdb", "181", "triangle"), ("cdb", "181", "quad"), ("cdb", "63", "triangle"), ("cdb", "63", "quad"),
    ("cdb", "281", "triangle6"), ("cdb", "281", "quad8"),
]  # fmt: skip
LINES = [
    ("bdf", "CBAR", LINE), ("bdf", "CBEAM", LINE), ("bdf", "CROD", LINE), ("bdf", "CTUBE", LINE),
    ("inp", "B31", LINE), ("inp", "B32", "line3"), ("inp", "B33", LINE), ("inp", "PIPE31", LINE), ("inp", "T3D2", LINE),
    ("inp", "T3D3", "line3"),
    ("cdb", "188", LINE), ("cdb", "189", "line3"), ("cdb", "4", LINE), ("cdb", "288", LINE), ("cdb", "180", LINE),
    ("cdb", "8", LINE),
]  # fmt: skip
ANSYS["pyramid13"] = [0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8, 4, 4, 4, 4, 9, 10, 11, 12]
NAMES = {"ids": lambda value: str(value)}


def read(folder, ending, name, kind, points, cells):
    path = folder / f"deck.{ending}"
    path.write_text("\n".join(WRITERS[ending](kind, name, points, cells)) + "\n")
    return mp.read_mesh(path)


def assembled(mesh, **supports):
    """The model on a frame that its supports hold."""
    held = supports or {"one": mp.Support(plane=((0, 0, 0), (1, 0, 0)))}
    return mp.assemble(mesh, {}, {"root": mp.Interface(kind="support")}, supports=held)


def stress(strain):
    """Isotropic, engineering shear strains."""
    lame, G = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    direct = lame * strain[:3].sum() + 2 * G * strain[:3]
    return np.concatenate([direct, G * strain[3:]])


@pytest.mark.parametrize("distort", [0.0, 0.2], ids=["regular", "distorted"])
@pytest.mark.parametrize(("ending", "name", "kind"), SOLIDS)
def test_solids_pass_the_patch_test(tmp_path, ending, name, kind, distort):
    """Six constant strains: the exact energy, and no force on nodes inside."""
    size = np.array([1.0, 0.8, 0.6])
    points, cells = box(kind, (2, 2, 2), size, distort=distort, seed=4)
    mesh = read(tmp_path, ending, name, kind, points, cells)
    model = assembled(mesh)
    inside = np.flatnonzero(((points > 1e-9) & (points < size - 1e-9)).all(axis=1))
    for k, strain in enumerate(1e-3 * np.eye(6)):
        xx, yy, zz, yz, xz, xy = strain
        gradient = np.array([[xx, xy / 2, xz / 2], [xy / 2, yy, yz / 2], [xz / 2, yz / 2, zz]])
        u = np.zeros(model.n_dof)
        u[model.dof[: len(points), :3]] = points @ gradient
        force = model.K @ u
        assert u @ force == pytest.approx(strain @ stress(strain) * size.prod(), rel=1e-9), k
        assert np.abs(force[model.dof[inside, :3]]).max() <= 1e-9 * np.abs(force).max()


@pytest.mark.parametrize("distorted", [False, True], ids=["regular", "distorted"])
@pytest.mark.parametrize(("ending", "name", "kind"), SHELLS)
def test_shells_pass_the_patch_test(tmp_path, ending, name, kind, distorted):
    """Three membrane strains and three curvatures on the patch of MacNeal and Harder: the exact energies."""
    points, cells = macneal_harder(kind) if distorted else surface(2, 2, kind, lambda s, t: (0.24 * s, 0.12 * t, 0 * s))
    mesh = read(tmp_path, ending, name, kind, points, cells)
    model = assembled(mesh)
    x, y, _ = points.T
    D = E / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]])
    dof = model.dof[: len(points)]
    for xx, yy, xy in 1e-3 * np.eye(3):
        membrane, bending = np.zeros((2, model.n_dof))
        membrane[dof[:, 0]] = xx * x + xy / 2 * y
        membrane[dof[:, 1]] = xy / 2 * x + yy * y
        bending[dof[:, 2]] = (xx * x**2 + yy * y**2 + xy * x * y) / 2
        bending[dof[:, 3]] = yy * y + xy / 2 * x
        bending[dof[:, 4]] = -xx * x - xy / 2 * y
        strain = np.array([xx, yy, xy])
        exact = strain @ D @ strain * 0.24 * 0.12
        assert membrane @ model.K @ membrane == pytest.approx(exact * THICK, rel=1e-8)
        assert bending @ model.K @ bending == pytest.approx(exact * THICK**3 / 12, rel=1e-8)


@pytest.mark.parametrize("bent", [False, True], ids=["straight", "in space"])
@pytest.mark.parametrize(("ending", "name", "kind"), LINES)
def test_bars_and_beams_stretch_and_turn_as_a_whole(tmp_path, ending, name, kind, bent):
    """Energy of a stretch in a line anywhere in space, and none of a rigid motion."""
    direction = np.array([0.6, 0.48, 0.64]) if bent else np.array([1.0, 0, 0])
    at = np.linspace(0, 2, 5)
    points = at[:, None] * direction
    cells = np.array([[0, 2, 1], [2, 4, 3]]) if kind == "line3" else np.stack([np.arange(4), np.arange(1, 5)], axis=1)
    mesh = read(tmp_path, ending, name, kind, points, cells)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(kind="support")}, supports={"end": mp.Support(node=1)})
    dof = model.dof[:5]
    u = np.zeros(model.n_dof)
    u[dof[:, :3]] = 1e-3 * at[:, None] * direction
    area = np.pi * (SIDE**2 - 0.6**2 * SIDE**2) / 4 if name in ("PIPE31", "288") else SIDE**2
    if name == "PIPE31":
        area = np.pi * SIDE**2 * (1 - 0.8**2)  # a radius in Abaqus
    assert u @ model.K @ u == pytest.approx(E * area * 2 * 1e-6, rel=1e-6)  # printed digits
    turn = np.array([0.3, -0.5, 0.2])
    rigid = np.zeros(model.n_dof)
    rigid[dof[:, :3]] = np.cross(turn, points)
    turning = dof[:, 3] >= 0
    rigid[dof[turning, 3:]] = turn
    assert np.abs(model.K @ rigid).max() <= 1e-8 * np.abs(model.K.diagonal()).max()


def bar(kind):
    """Eight elements of a kind, or cells of bricks divided, in a bar along x of 1 m with a width of 0.1 m."""
    if kind in (LINE, "line3"):
        points = np.linspace(0, 1, 9)[:, None] * np.eye(3)[0]
        steps = np.arange(0, 8, 1 + (kind == "line3"))
        ends = [steps, steps + 1] if kind == LINE else [steps, steps + 2, steps + 1]
        return points, np.stack(ends, axis=1)
    if kind.startswith(("tri", "quad")):
        return surface(8, 1, kind, lambda s, t: (s, 0.1 * t, 0 * s))
    return box(kind, (8, 1, 1), (1.0, 0.1, 0.1))


@pytest.mark.parametrize(("ending", "name", "kind"), [*SOLIDS, *SHELLS, *LINES])
def test_the_first_mode_along_a_bar(tmp_path, ending, name, kind):
    """Clamped at one end and guided along x: ``sqrt(E / rho) / 4 L``, of which eight elements miss 0.2 %."""
    points, cells = bar(kind)
    model = assembled(
        read(tmp_path, ending, name, kind, points, cells),
        clamp=mp.Support(plane=((0, 0, 0), (1, 0, 0))),
        guide=mp.Support(box=((0, -1, -1), (1, 1, 1)), components="23456"),
    )
    guided = E * (1 if kind in (LINE, "line3") else (1 - NU) / ((1 + NU) * (1 - 2 * NU)))
    if kind.startswith(("tri", "quad")):
        guided = E / (1 - NU**2)  # no strain across
    first = mp.craig_bampton(model, modes=1, truncation=[]).frequency[0]
    assert first == pytest.approx(np.sqrt(guided / RHO) / 4, rel=2.5e-3)


AGAINST_CALCULIX = {  # kind, and the difference allowed: printed digits where both integrate alike
    "C3D4": ("tetra", 5e-2),  # its mass has one point
    "C3D10": ("tetra10", 5e-3),  # its mass has four points
    "C3D15": ("wedge15", 1e-6),
    "C3D20": ("hexahedron20", 1e-6),
    "C3D20R": ("hexahedron20", 1e-6),
    "C3D8I": ("hexahedron", 6e-2),  # other incompatible modes
}


@needs_ccx
@pytest.mark.parametrize("name", AGAINST_CALCULIX)
def test_modes_of_a_distorted_block_in_calculix(tmp_path, name):
    kind, tolerance = AGAINST_CALCULIX[name]
    points, cells = box(kind, (4, 2, 2), (1.0, 0.3, 0.2), distort=0.15, seed=2)
    text = deck(points, np.flatnonzero(points[:, 0] == 0), **{name: cells})
    path = tmp_path / "block.inp"
    path.write_text(text)
    mesh = mp.read_mesh(path, dialect="calculix")
    model = assembled(mesh, own=mp.Support(set="boundary"))
    ours = mp.craig_bampton(model, modes=5, truncation=[]).frequency[:5]
    np.testing.assert_allclose(ours, frequencies(text, 5, tmp_path), rtol=tolerance)


BARS = {  # kind; differences allowed in the first mode along a guided bar, and in the first that bends the free one
    "C3D6": ("wedge", 2e-3, None),  # its mass has two points
    "C3D8": ("hexahedron", 1e-6, None),  # it bends as a sheared block: +32 %
    "C3D8R": ("hexahedron", 2e-3, None),  # one point: -78 %
    "S3": ("triangle", 2e-3, None),  # C3D6, which bends as a sheared block
    "S4": ("quad", 6e-3, 3e-2),  # C3D8I
    "S4R": ("quad", 2e-3, None),  # C3D8R
    "S6": ("triangle6", 1e-5, 3e-2),
    "S8": ("quad8", 1e-5, 3e-2),
    "S8R": ("quad8", 1e-5, 3e-2),
    "B31": (LINE, 1e-2, 1e-2),  # C3D8I; from here on with free contraction across, which inertia takes part in
    "B31R": (LINE, 2e-3, None),
    "B32": ("line3", 2e-3, 3e-2),
    "B32R": ("line3", 2e-3, 3e-2),
    "T3D2": (LINE, 1e-2, None),  # elements of T3D3 share the mean motion of their faces alone in CalculiX: not compared
}


@needs_ccx
@pytest.mark.parametrize("name", BARS)
def test_bars_of_every_element_in_calculix(tmp_path, name):
    """The first mode of a clamped bar that is guided along x, and of a free one; solids stand for shells and beams."""
    kind, along, bending = BARS[name]
    points, cells = bar(kind)
    turning = name[0] not in "CT"
    clamped = np.flatnonzero(points[:, 0] < 1e-9) + 1
    others = np.flatnonzero(points[:, 0] > 1e-9) + 1
    lines = [*abaqus(kind, name, points, cells), "*BOUNDARY", *(f"{k}, 1, {6 if turning else 3}" for k in clamped)]
    guides = [f"{k}, {first}" for k in others for first in ("2, 3", "4, 6")[: 1 + turning]]
    for more, tolerance in ((guides, along), ([], bending)):
        if tolerance is None:
            continue
        text = "\n".join([*lines, *more, ""])
        (tmp_path / "bar.inp").write_text(text)
        model = assembled(mp.read_mesh(tmp_path / "bar.inp", dialect="calculix"), own=mp.Support(set="boundary"))
        ours = mp.craig_bampton(model, modes=1, truncation=[]).frequency[0]
        assert ours == pytest.approx(frequencies(text, 1, tmp_path)[0], rel=tolerance)
