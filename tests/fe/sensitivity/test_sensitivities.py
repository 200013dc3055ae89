"""Derivatives of frequencies: closed forms, and differences of models that are assembled again."""

import csv
import json

import numpy as np
import pytest
from size import some
from structured import box, random_surface, surface

import modalprep as mp
from modalprep.cli import main
from modalprep.correlation import sensitivities
from modalprep.fe.sensitivity.parameters import scaled
from modalprep.pipeline.building.build import build_body
from modalprep.pipeline.console import Reporter

ALUMINIUM, STEEL = mp.Material(E=70e9, nu=0.33, rho=2700.0), mp.Material(E=210e9, nu=0.3, rho=7800.0)
CARBON = mp.fe.Orthotropic(E1=140e9, E2=10e9, nu12=0.3, G12=5e9, G13=5e9, G23=3.5e9, rho=1600.0)
LAMINATE = mp.Shell(
    plies=(
        mp.fe.Ply(material=CARBON, thickness=0.012, angle=0.4),
        mp.fe.Ply(material=ALUMINIUM, thickness=0.03),
        mp.fe.Ply(material=CARBON, thickness=0.008, angle=-0.9),
    ),
    offset=0.01, nsm=3.0,
)  # fmt: skip
SHEET = mp.Shell(material=ALUMINIUM, thickness=0.05, shear_material=STEEL, bending_ratio=1.3, nsm=2.0)
CLOSE = dict(rtol=3e-7, atol=1e-8)  # of the extrapolated differences: (3e-3)^4, and round-off over 1.5e-3


def mesh_of(points, kinds, root=(0,)):
    """Return a mesh whose groups are called like the kinds of their cells; the root is at the first node."""
    cells = {kind: np.asarray(cells) for kind, cells in kinds.items()}
    groups = {kind: {kind: np.arange(len(rows))} for kind, rows in cells.items()}
    vertex = np.concatenate([np.reshape(root, (-1, 1)), cells.get("vertex", np.zeros((0, 1), dtype=int))])
    groups["root"] = {"vertex": np.arange(len(root))}
    if "vertex" in cells:
        groups["vertex"] = {"vertex": np.arange(len(root), len(vertex))}
    return mp.fe.Mesh(points=np.asarray(points, dtype=float), cells=cells | {"vertex": vertex}, groups=groups)


def assembled(mesh, sections, **options):
    kind = "node" if len(mesh.groups["root"]["vertex"]) == 1 else "rbe2"
    return mp.assemble(mesh, sections, {"root": mp.Interface(group="root", kind=kind)}, **options)


def frequencies(mesh, sections, modes, options):
    return sensitivities(assembled(mesh, sections, **options), modes=modes, kinds=["density"]).frequency


def differences(mesh, sections, parameter, modes, options, step):
    def at(factor):
        own = {
            group: scaled(section, parameter, factor) if parameter.belongs_to(group, section) else section
            for group, section in sections.items()
        }
        return np.log(frequencies(mesh, own, modes, options))

    return (at(1 + step) - at(1 - step)) / (2 * step)


def check(mesh, sections, modes=5, **options):
    """Compare every derivative with differences of models assembled again; return the derivatives."""
    found = sensitivities(assembled(mesh, sections, **options), modes=modes)
    assert not found.repeated
    for j, parameter in enumerate(found.parameters):
        coarse, fine = (differences(mesh, sections, parameter, modes, options, step) for step in (3e-3, 1.5e-3))
        np.testing.assert_allclose(found.relative[:, j], (4 * fine - coarse) / 3, **CLOSE, err_msg=parameter.name)
    return found


SHELLS = [
    pytest.param(kind, section, id=f"{kind}-{name}")
    for kind in ("triangle", "quad", "triangle6", "quad8", "quad9")
    for name, section in (("laminate", LAMINATE), ("sheet", SHEET))
]


@pytest.mark.parametrize(("kind", "section"), some(SHELLS, 5))
def test_shells(kind, section):
    points, cells = random_surface(kind, n=2)
    check(mesh_of(points, {kind: cells}, root=range(3)), {kind: section})  # one side is clamped


def frame_mesh():
    """A bent line of beams of every kind with a strut, a spring to the ground and a mass."""
    points = [[0, 0, 0], [0.5, 0.1, 0], [1, 0, 0.2], [1.5, 0, 0.3], [2, 0.4, 0.3], [1, 1, 0]]
    cells = {"line3": [[0, 2, 1], [2, 4, 3]], "line": [[2, 5], [5, 4]], "vertex": [[4]]}
    return mesh_of(points, cells)


@pytest.mark.parametrize("mass", ["coupled", "lumped"])
def test_beams_springs_masses(mass):
    mesh = frame_mesh()
    taper = ((0.0, 4e-4, 6e-8, 3e-8, 5e-8, 0.1), (1.0, 2e-4, 2e-8, 1e-8, 2e-8, 0.0))
    sections = {
        "line3": mp.Beam(material=ALUMINIUM, A=8e-4, Iy=9e-7, Iz=3e-7, J=6e-7, offset=(0.02, 0.01), up=(0, 1, 1)),
        "line": mp.Beam(material=STEEL, A=4e-4, Iy=6e-8, Iz=3e-8, J=5e-8, taper=taper, shear_centre=(0.01, 0.0)),
        "vertex": mp.PointMass(mass=0.7, inertia=(1e-3, 2e-3, 2e-3, 0, 0, 0), offset=(0.0, 0.0, 0.05)),
    }
    check(mesh, sections, mass=mass)


def test_solids_with_sheets_and_bars():
    points, bricks = box("hexahedron", (2, 1, 1), (2.0, 0.5, 0.4))
    cells = {"hexahedron": bricks, "quad": bricks[:, [4, 5, 6, 7]], "line": bricks[:, [0, 6]], "vertex": [[5]]}
    sections = {
        "hexahedron": mp.Solid(material=ALUMINIUM),
        "quad": mp.Shell(material=STEEL, thickness=0.02),
        "line": mp.Truss(material=STEEL, A=1e-3, nsm=0.4),
        "vertex": mp.Spring(translation=(1e8, 2e8, 3e8)),
    }
    check(mesh_of(points, cells, root=np.flatnonzero(points[:, 0] == 0)), sections)


def beam_of_squares(n, side=0.02, length=1.0):
    points = np.zeros((n + 1, 3))
    points[:, 0] = np.linspace(0, length, n + 1)
    cells = np.stack([np.arange(n), np.arange(1, n + 1)], axis=1)
    inertia = side**4 / 12
    section = mp.Beam(material=STEEL, A=side**2, Iy=inertia, Iz=inertia, J=1.7 * inertia, theory="euler-bernoulli")
    return assembled(mesh_of(points, {"line": cells}), {"line": section})


def test_repeated_frequencies_split_into_their_branches():
    """A square section bends in two planes alike: its height changes one of them, ``f ~ sqrt(Iy)``, not the other.

    Rotary inertia ``rho Iy`` takes off ``(pi r / 2 L)^2``, about 1e-4 of it.
    """
    found = sensitivities(beam_of_squares(8), modes=4, kinds=["Iy", "modulus", "density"])
    assert found.repeated == ((0, 1), (2, 3))
    np.testing.assert_allclose(found.relative[:, 0], [0, 0.5, 0, 0.5], atol=2e-3)
    # f ~ sqrt(E / rho) is exact, for each of the branches
    np.testing.assert_allclose(found.relative[:, 1:], np.tile([0.5, -0.5], (4, 1)), rtol=1e-9)
    assert "modes 1, 2 have one frequency" in found.notes[0]


def test_frequency_of_a_thin_plate_is_proportional_to_its_thickness():
    """Kirchhoff: ``f ~ t sqrt(E / rho)``; shear and rotary inertia are of the order ``(t / L)^2 = 1e-6``."""
    points, cells = surface(6, 6, "quad", distort=0.2)
    mesh = mesh_of(points, {"quad": cells}, root=range(7))
    found = sensitivities(assembled(mesh, {"quad": mp.Shell(material=STEEL, thickness=1e-3)}), modes=5)
    assert [p.kind for p in found.parameters] == ["thickness", "modulus", "density"]
    np.testing.assert_allclose(found.relative, np.tile([1, 0.5, -0.5], (5, 1)), rtol=1e-4)
    np.testing.assert_allclose(found.derivative[:, 0], found.frequency / 1e-3, rtol=1e-4)


def test_derivatives_by_all_moduli_and_by_all_masses_are_halves():
    """Euler's theorem: ``f`` is homogeneous of degree 1/2 in all stiffnesses, and of -1/2 in all masses."""
    points, cells = random_surface("quad", n=2)
    mesh = mesh_of(points, {"quad": cells, "line": cells[:, :2], "vertex": [[5]]}, root=range(3))
    sections = {"quad": LAMINATE, "line": mp.Truss(material=STEEL, A=1e-3), "vertex": mp.PointMass(mass=3.0)}
    sections["quad"] = mp.Shell(plies=LAMINATE.plies)
    for boundary in ("clamped", "free"):
        found = sensitivities(assembled(mesh, sections), modes=6, boundary=boundary)
        kind = np.array([p.kind for p in found.parameters])
        assert set(kind) == {"thickness", "A", "mass", "modulus", "density"}
        np.testing.assert_allclose(found.relative[:, kind == "modulus"].sum(axis=1), 0.5, rtol=1e-8)
        masses = (kind == "density") | (kind == "mass")
        np.testing.assert_allclose(found.relative[:, masses].sum(axis=1), -0.5, rtol=1e-8)


def test_thickness_that_the_mesh_prescribes():
    """Sheets whose thickness the mesh has: all in proportion."""
    points, cells = surface(2, 2, "quad", distort=0.2)
    mesh = mesh_of(points, {"quad": cells}, root=range(3))
    section = mp.Shell(material=STEEL, thickness=0.02)
    own = np.linspace(0.02, 0.05, 16).reshape(4, 4)

    def logarithms(factor):
        thick = mesh.with_(data={"thickness": {"quad": factor * own}})
        return np.log(frequencies(thick, {"quad": section}, 4, {}))

    found = sensitivities(
        assembled(mesh.with_(data={"thickness": {"quad": own}}), {"quad": section}), modes=4, kinds=["thickness"]
    )
    coarse, fine = ((logarithms(1 + h) - logarithms(1 - h)) / (2 * h) for h in (3e-3, 1.5e-3))
    np.testing.assert_allclose(found.relative[:, 0], (4 * fine - coarse) / 3, **CLOSE)


def test_released_ends_and_matrices_are_said():
    mesh = mesh_of([[0, 0, 0], [1, 0, 0], [2, 0.5, 0]], {"line": [[0, 1], [1, 2], [0, 2]]})
    pins = np.zeros((3, 12))
    pins[1, 5] = 1.0
    beam = mp.Beam(material=STEEL, A=4e-4, Iy=1e-8, Iz=2e-8, J=2e-8)
    model = assembled(mesh.with_(data={"pins": {"line": pins}}), {"line": beam})
    found = sensitivities(model, modes=2)
    assert [p.kind for p in found.parameters] == ["modulus", "density"]
    assert "beams with released ends have no derivative by the size of a section" in found.notes[0]
    for options, said in (
        ({"kinds": ["A"]}, "A of line: beams with released ends"),
        ({"kinds": ["thickness"]}, "the model has no thickness to derive by"),
        ({"kinds": ["width"]}, "width"),
        ({"modes": 0}, "at least one mode"),
        ({"boundary": "held"}, "neither 'clamped' nor 'free'"),
    ):
        with pytest.raises(mp.InputError, match=said):
            sensitivities(model, **options)
    with pytest.raises(mp.InputError, match="comes from matrices"):
        sensitivities(model.with_(elements=None))


PLATE = """
[mesh]
file = "{mesh}"

[materials.alloy]
E = 7e10
nu = 0.3
rho = 3000.0

[properties.plate]
type = "shell"
material = "alloy"
thickness = {thickness}

[interfaces.root]
group = "root"
kind = "rbe2"

[reduction]
modes = 4
truncation_vectors = []

[output]
pictures = "none"

[sensitivities]
modes = 4
by = ["thickness", "density"]
"""


def test_differences_of_the_whole_pipeline_converge_with_the_square_of_the_step(project, tmp_path, capsys):
    """The thickness of the plate's file, of 0.2 m so that shear and rotary inertia make it nonlinear."""

    def file(thickness):
        path = tmp_path / f"plate{thickness:.6g}.toml"
        path.write_text(PLATE.format(mesh=project / "meshes" / "plate.msh", thickness=thickness))
        return path

    def frequency(thickness):
        return build_body(file(thickness), tmp_path / "out", Reporter(quiet=True)).body.frequency

    assert main(["run", str(file(0.2)), "--output", str(tmp_path / "out"), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    rows = [row for row in printed["sensitivities"] if row["kind"] == "thickness"]
    exact = np.array([row["Hz_per_unit"] for row in rows])
    np.testing.assert_allclose([row["frequency_Hz"] for row in rows], printed["frequency_Hz"], rtol=1e-9)
    error = [np.abs((frequency(0.2 + h) - frequency(0.2 - h)) / (2 * h) - exact) for h in (0.02, 0.01)]
    bends = exact > 0.1 * np.array(printed["frequency_Hz"]) / 0.2
    assert bends.tolist() == [True, True, False, True]  # the third mode lies in the plane, which no thickness changes
    np.testing.assert_allclose(np.log2(error[0] / error[1])[bends], 2.0, atol=0.05)
    assert (error[1] < 2e-3 * exact.max()).all()
    folder = tmp_path / "out" / "plate0.2"
    with (folder / "plate0.2-sensitivities.csv").open() as table:
        assert [row["parameter"] for row in csv.DictReader(table)][:2] == ["thickness of plate", "density of alloy"]
    assert "Sensitivity of the frequencies" in (folder / "plate0.2.html").read_text()


def test_a_file_without_elements_has_no_sensitivities(tmp_path, capsys):
    file = tmp_path / "job.toml"
    file.write_text('[body]\nfile = "a.h5"\n[sensitivities]\n')
    assert main(["run", str(file)]) == 2
    assert "[sensitivities] needs the elements of a [mesh]" in capsys.readouterr().err
