"""Bad meshes of every family: exit code 2, one message that says what, where and what to do, nothing written."""

import meshio
import numpy as np
import pytest

from modalprep.cli import main

pytestmark = pytest.mark.usefixtures("rough_edges")  # pictures are not looked at here

TOML = """
[mesh]
file = "plate.msh"

[materials.steel]
E = 2.1e11
nu = 0.3
rho = 7800.0

[properties.plate]
type = "shell"
material = "steel"
thickness = 0.01

[interfaces.edge]
plane = { point = [0, 0, 0], normal = [1, 0, 0] }
"""
BEAM = 'type = "beam"\nmaterial = "steel"\nsection = { shape = "tube", diameter = 0.1, thickness = 0.01 }\n'


def plate():
    """4 x 2 quads on 2 m x 1 m, and a line along its upper edge."""
    x, y = np.meshgrid(np.linspace(0, 2, 5), np.linspace(0, 1, 3), indexing="ij")
    n = np.arange(15).reshape(5, 3)
    quads = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 4)
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    return points, quads, np.stack([n[:-1, 2], n[1:, 2]], axis=1)


def write(folder, points, quads, lines=None):
    cells = [("quad", quads)] + ([("line", lines)] if lines is not None else [])
    physical = [np.full(len(c), k + 1) for k, (_, c) in enumerate(cells)]
    mesh = meshio.Mesh(points, cells, cell_data={"gmsh:physical": physical, "gmsh:geometrical": physical},
                       field_data={"plate": np.array([1, 2]), "stringer": np.array([2, 1])})  # fmt: skip
    meshio.write(folder / "plate.msh", mesh, file_format="gmsh22", binary=False)


def crossed(points, quads, lines):
    quads[3] = quads[3][[0, 2, 1, 3]]
    return points, quads, None, TOML, ["group 'plate'", "crossed", "near (0.75, 0.75, 0) m", "repair the mesh"]


def collapsed(points, quads, lines):
    quads[2, 1] = quads[2, 0]
    return points, quads, None, TOML, ["1 of 8 shell elements have no area", "repair the mesh"]


def not_a_number(points, quads, lines):
    points[4, 1] = np.nan
    return points, quads, None, TOML, ["coordinates that are not numbers", "node 5"]


def torn(points, quads, lines):
    points = np.concatenate([points, points + np.array([5.0, 0, 0])])
    return points, np.concatenate([quads, quads + 15]), None, TOML, ["2 disconnected parts", "merge coincident nodes"]


def unknown_group(points, quads, lines):
    text = TOML + '[properties.again]\ntype = "shell"\nmaterial = "steel"\nthickness = 0.01\n'
    return points, quads, None, text, ["no group 'again'", "plate"]


def no_length(points, quads, lines):
    lines[1, 1] = lines[1, 0]
    text = TOML + "[properties.stringer]\n" + BEAM
    return points, quads, lines, text, ["group 'stringer'", "nodes 6 and 6", "no length"]


def upright(points, quads, lines):
    text = TOML + "[properties.stringer]\n" + BEAM + "up = [1, 0, 0]\n"
    return points, quads, lines, text, ["group 'stringer'", "parallel to the beam", "choose another direction"]


def wrong_family(points, quads, lines):
    text = TOML.replace('type = "shell"', 'type = "solid"').replace("thickness = 0.01\n", "")
    return points, quads, None, text, ["group 'plate' has quad cells", "'solid' needs tetra"]


def zero_density(points, quads, lines):
    return points, quads, None, TOML.replace("7800.0", "0.0"), ["the model has no mass", "give rho of [materials]"]


def zero_thickness(points, quads, lines):
    return points, quads, None, TOML.replace("thickness = 0.01", "thickness = 0.0"), ["thickness = 0", "positive"]


def normal_axis(points, quads, lines):
    text = TOML.replace("thickness = 0.01", "thickness = 0.01\naxis = [0, 0, 1]")
    return points, quads, None, text, ["material axis", "normal to 8 shell elements"]


def elsewhere(points, quads, lines):
    text = TOML.replace("point = [0, 0, 0]", "point = [7, 0, 0]")
    return points, quads, None, text, ["no node lies at plane ((7, 0, 0)", "(0, 0, 0) to (2, 1, 0) m"]


def orthotropic_beam(points, quads, lines):
    text = TOML + "[properties.stringer]\n" + BEAM.replace('"steel"', '"cfrp"')
    text += '[materials.cfrp]\ntype = "orthotropic"\nE1 = 1e11\nE2 = 1e10\nnu12 = 0.3\nG12 = 5e9\nG13 = 5e9\nG23 = 4e9\nrho = 1600\n'  # noqa: E501
    return points, quads, lines, text, ["[properties.stringer]", "'cfrp' is orthotropic", "only shells and plies"]


def anisotropic_sheet(points, quads, lines):
    text = TOML.replace("E = ", 'type = "anisotropic"\nC = [' + "1e9, " * 20 + "1e9]\n#", 1).replace("nu = ", "#", 1)
    return points, quads, None, text, ["[materials.steel]", "some strain has no positive energy"]


def two_sheets(points, quads, lines):
    text = TOML.replace("thickness = 0.01", 'thickness = 0.01\nplies = [{ material = "steel", thickness = 0.01 }]')
    return points, quads, None, text, ["[properties.plate]", "'material' has no effect beside 'plies'"]


def two_ways(points, quads, lines):
    text = TOML + 'group = "plate"\n'
    return points, quads, None, text, ["[interfaces.edge]", "exactly one of group, node, near", "group and plane"]


def odd_section(points, quads, lines):
    text = TOML + "[properties.stringer]\n" + BEAM.replace("diameter = 0.1", "width = 0.1")
    return points, quads, lines, text, ["[properties.stringer]", "'tube' needs diameter, thickness"]


def loose_mass(points, quads, lines):
    text = TOML + '[connections.tank]\nnear = [2, 1, 0]\n[properties.tank]\ntype = "mass"\nmass = 3\n'
    return points, quads, None, text, ["rbe3 at node", "lie on one line", "add nodes"]


def taken_name(points, quads, lines):
    text = TOML + '[connections.plate]\nkind = "rbe2"\nnear = [2, 1, 0]\n'
    return points, quads, None, text, ["connection 'plate'", "name of a mesh group", "choose another"]


KINDS = [crossed, collapsed, not_a_number, torn, unknown_group, no_length, upright, wrong_family, zero_density,
         zero_thickness, normal_axis, elsewhere, orthotropic_beam,
         anisotropic_sheet, two_sheets, two_ways, odd_section, loose_mass,
         taken_name]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_bad_mesh_gets_one_message(kind, tmp_path, capsys):
    points, quads, lines, text, words = kind(*plate())
    write(tmp_path, points, quads, lines)
    (tmp_path / "job.toml").write_text(text)
    assert main(["run", str(tmp_path / "job.toml")]) == 2
    error = capsys.readouterr().err
    assert len(error.strip().splitlines()) == 1
    assert error.startswith("modalprep: ")
    assert "job.toml" in error or "plate.msh" in error
    for word in words:
        assert word in error
    assert not list(tmp_path.rglob("*.h5"))


def test_the_good_one_runs(tmp_path):
    """The mesh all of them start from, with its stringer, goes the whole road."""
    points, quads, lines = plate()
    write(tmp_path, points, quads, lines)
    stringer = "[properties.stringer]\n" + BEAM + "offset = [0.0, -0.05]\n"
    (tmp_path / "job.toml").write_text(TOML + stringer + "[reduction]\nmodes = 4\n[output]\npictures = 0\n")
    assert main(["run", str(tmp_path / "job.toml"), "--no-report"]) == 0
    assert list(tmp_path.rglob("job.h5"))


def test_left_out_lines_are_noted(tmp_path, capsys):
    points, quads, lines = plate()
    write(tmp_path, points, quads, lines)
    (tmp_path / "job.toml").write_text(TOML + "[reduction]\nmodes = 2\n[output]\npictures = 0\n")
    assert main(["run", str(tmp_path / "job.toml"), "--no-report"]) == 0
    assert "4 of 4 line cells have no property (group 'stringer') and are left out" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'file = "plate.msh"',
            'file = "plate.msh"\nlength_unit = "km"',
            "its mass is implausible for a body of 2e+03 m",
        ),
        ("rho = 7800.0", "rho = 7.8e-6", "its mass is implausible"),  # kg/mm^3
        ("E = 2.1e11", "E = 2.1e-1", "first frequency"),
        ("E = 2.1e11", "E = 2.1e5", "the modulus of 'plate', 2.1e+05 Pa, is implausible"),  # MPa
        ("E = 2.1e11", "E = 2.1e17", "the modulus of 'plate', 2.1e+17 Pa, is implausible"),  # MPa, scaled twice
        ("rho = 7800.0", "rho = 7.8", "the density of 'plate', 7.8 kg/m^3, is implausible"),  # g/cm^3
        ("thickness = 0.01", "thickness = 3", "the thickness of 'plate', 3 m, is implausible"),  # mm
        ('file = "plate.msh"', 'file = "plate.msh"\nlength_unit = "km"', "its size is implausible"),
        ('file = "plate.msh"', 'file = "plate.msh"\nlength_unit = "km"', "first frequency"),
    ],
)
def test_wrong_units_are_noticed(old, new, words, tmp_path, capsys):
    points, quads, _ = plate()
    write(tmp_path, points, quads)
    text = TOML.replace(old, new) + "[reduction]\nmodes = 2\ntruncation_vectors = []\n[output]\npictures = 0\n"
    (tmp_path / "job.toml").write_text(text)
    assert main(["run", str(tmp_path / "job.toml"), "--no-report"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert words in out
    assert "check length_unit" in out or "did you mean" in out


def test_right_units_are_not_doubted(tmp_path, capsys):
    points, quads, _ = plate()
    write(tmp_path, points, quads)
    (tmp_path / "job.toml").write_text(TOML + "[reduction]\nmodes = 2\n[output]\npictures = 0\n")
    assert main(["run", str(tmp_path / "job.toml"), "--no-report"]) == 0
    assert "implausible" not in capsys.readouterr().out
