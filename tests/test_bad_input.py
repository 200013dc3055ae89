"""Bad input: one sentence on standard error, exit code 2, nothing left behind."""

import shutil
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam

BEAM = """
[mesh]
file = "beam.msh"

[materials.alloy]
E = 7e10
nu = 0.4
rho = 3000.0

[properties.beam]
type = "beam"
material = "alloy"
A = 4e-4
Iy = 8e-7
Iz = 2e-7
J = 5e-7

[interfaces.root]
group = "root"
kind = "node"

[reduction]
modes = 3

[output]
pictures = "none"
"""
SOLID = """
[mesh]
file = "bracket.msh"
length_unit = "mm"

[materials.alloy]
E = 7e10
nu = 0.33
rho = 2700.0

[properties.body]
type = "solid"
material = "alloy"

[interfaces.bolt]
group = "bolt_a"

[reduction]
modes = 2

[output]
pictures = "none"
"""
HINGE = """
[joints.hinge]
type = "revolute"
child = "job.root"

[simulation]
t_end = 0.01
"""


@pytest.fixture
def folder(tmp_path, project):
    for name in ("beam.msh", "bracket.msh"):
        shutil.copy(project / "meshes" / name, tmp_path)
    return tmp_path


def refused(folder: Path, capsys, *words: str, text: str | None = None, command=("run",)) -> None:
    """Run the command and check the promise."""
    if text is not None:
        (folder / "job.toml").write_text(text)
    before = set(folder.rglob("*"))
    arguments = [*command, str(folder / "job.toml")] if len(command) == 1 else list(command)
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("modalprep: ")
    assert len(error.strip().splitlines()) == 1
    for word in words:
        assert word in error
    made = {path for path in set(folder.rglob("*")) - before if path.is_file()}
    assert made == set()


def test_the_jobs_themselves_are_good(folder):
    (folder / "job.toml").write_text(BEAM + HINGE)
    assert main(["run", str(folder / "job.toml"), "--json"]) == 0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("modes = 3", "mods = 3"), ["line 23", "[reduction]", "unknown key 'mods'", "did you mean 'modes'?"]),
        (("[reduction]", "[reductions]"), ["unknown key 'reductions'", "did you mean 'reduction'?"]),
        (("modes = 3", 'modes = "many"'), ["line 23", "[reduction.modes]", "valid integer"]),
        (("modes = 3", "modes = -1"), ["greater than or equal to 0"]),
        (("modes = 3", "modes = "), ["is not valid TOML", "line 23"]),
        (('type = "beam"', 'type = "beem"'), ["beem", "'beam', 'solid'"]),
        (("J = 5e-7", ""), ["[properties.beam.J]", "field required"]),
        (("rho = 3000.0", "rho = nan"), ["finite number"]),
        (('file = "beam.msh"', 'file = "bean.msh"'), ["bean.msh does not exist"]),
        (
            ('file = "beam.msh"', 'file = "beam.msh"\nlength_unit = "mn"'),
            ["unknown length_unit 'mn'", "did you mean 'm"],
        ),
        (("[properties.beam]", "[properties.beams]"), ["no group 'beams'", "did you mean 'beam'?"]),
        (('group = "root"', 'group = "rot"'), ["no group 'rot'", "did you mean 'root'?"]),
        (('group = "root"', 'group = "beam"'), ["'root' is of kind 'node'", "41 nodes", "rbe2"]),
        (('material = "alloy"', 'material = "aloy"'), ["'aloy', which is not there", "did you mean 'alloy'?"]),
        (("rho = 3000.0", "rho = 0.0"), ["rho = 0 must be positive", "SI units"]),
        (("E = 7e10", "E = -1"), ["E = -1 must be positive"]),
        (("nu = 0.4", "nu = 0.5"), ["nu = 0.5 must lie between"]),
        (("A = 4e-4", "A = 0"), ["A = 0 must be positive"]),
        (("J = 5e-7", "J = 5e-7\nup = [1, 0, 0]"), ["parallel to the beam"]),
        (("modes = 3", 'modes = 3\nroot = "tip"'), ["root 'tip' is not an interface", "known are root"]),
        (
            ("modes = 3", 'modes = 3\nkeep = "frequency <"'),
            ["keep = 'frequency <' cannot be read", "write for example"],
        ),
        (("modes = 3", "modes = 3\nkeep = \"__import__('os')\""), ["is not a comparison"]),
        (
            ("[properties.beam]", "[properties.root]"),
            ["group 'root' has vertex cells, but type 'beam' needs line cells"],
        ),
    ],
)
def test_one_thing_wrong(folder, capsys, change, words):
    assert change[0] in BEAM
    refused(folder, capsys, *words, text=BEAM.replace(*change))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('child = "job.root"', 'child = "jib.root"'), ["body 'jib' does not exist", "did you mean 'job'?"]),
        (('child = "job.root"', 'child = "job.tip"'), ["is not the root interface", "use job.root"]),
        (('child = "job.root"', 'child = "job.root"\nparent = "job.end"'), ["names no interface"]),
        (('child = "job.root"', 'child = "job.root"\nparent = "job.root"'), ["in a loop"]),
        (('child = "job.root"', 'child = "job.root"\nmotion = "open(t)"'), ["unknown name open"]),
        (('child = "job.root"', 'child = "job.root"\nmotion = "sin("'), ["is not an expression of t"]),
        (('child = "job.root"', 'child = "job.root"\naxis = [0, 0, 0]'), ["axis [0.0, 0.0, 0.0] has no direction"]),
        (('type = "revolute"', 'type = "hinge"'), ["[joints.hinge.type]", "'weld', 'revolute' or 'free'"]),
        (("t_end = 0.01", "t_end = -1"), ["[simulation.t_end]", "greater than 0"]),
        (("t_end = 0.01", 't_end = 1e9\noutput = ["hinge.angel"]'), ["no channel 'hinge.angel'", "hinge.angle"]),
        (('[joints.hinge]\ntype = "revolute"\nchild = "job.root"', ""), ["is the child of 0 joints"]),
    ],
)
def test_one_thing_wrong_in_a_system(folder, capsys, change, words):
    assert change[0] in HINGE
    (folder / "job.toml").write_text(BEAM + HINGE.replace(*change))
    assert main(["run", str(folder / "job.toml")]) == 2
    error = capsys.readouterr().err
    assert len(error.strip().splitlines()) == 1
    for word in words:
        assert word in error
    assert not list(folder.rglob("*-run.*"))


@pytest.mark.parametrize("name", ["beam.msh", "bracket.msh"])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.999])
def test_truncated_mesh(folder, capsys, name, share):
    content = (folder / name).read_bytes()
    (folder / name).write_bytes(content[: int(share * len(content))])
    text = BEAM if name == "beam.msh" else SOLID
    refused(folder, capsys, f"{name} is damaged or cut short", "export it again", text=text)


def test_garbage_mesh(folder, capsys):
    (folder / "beam.msh").write_bytes(np.random.default_rng(0).bytes(5000))
    refused(folder, capsys, "damaged", text=BEAM)


def test_coordinates_that_are_not_numbers(folder, capsys):
    content = (folder / "beam.msh").read_text()
    (folder / "beam.msh").write_text(content.replace("\n5 0 0\n", "\nnan 0 0\n").replace("\n10 0 0\n", "\nnan 0 0\n"))
    refused(folder, capsys, "coordinates that are not numbers", "the first is node", text=BEAM)


def write_lines(folder, points, lines):
    """Write beam.msh in format 2.2 (cell data, no cell sets): groups root (first node) and beam (all lines)."""
    cells = [("vertex", np.array([[0]])), ("line", np.array(lines))]
    numbers = [np.array([1]), np.full(len(lines), 2)]
    mesh = meshio.Mesh(
        np.array(points, dtype=float),
        cells,
        cell_data={"gmsh:physical": numbers, "gmsh:geometrical": numbers},
        field_data={"root": np.array([1, 0]), "beam": np.array([2, 1])},
    )
    meshio.gmsh.write(folder / "beam.msh", mesh, fmt_version="2.2", binary=False)


def test_disconnected_part(folder, capsys):
    write_lines(folder, [[0, 0, 0], [1, 0, 0], [5, 0, 0], [6, 0, 0]], [[0, 1], [2, 3]])
    refused(folder, capsys, "2 disconnected parts", "around (", "merge coincident nodes", text=BEAM)


def test_element_without_length(folder, capsys):
    write_lines(folder, [[0, 0, 0], [1, 0, 0], [1, 0, 0]], [[0, 1], [1, 2]])
    refused(folder, capsys, "between nodes 2 and 3 has no length", text=BEAM)


def test_element_listed_twice_counts_once(folder):
    write_lines(folder, [[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1], [1, 2], [1, 0]])
    mesh = mp.read_mesh(folder / "beam.msh")
    assert len(mesh.cells["line"]) == 2
    assert len(mesh.groups["beam"]["line"]) == 2


def test_cells_without_a_property(folder, capsys):
    write_lines(folder, [[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1], [1, 2]])
    lines = (folder / "beam.msh").read_text().splitlines()
    names, last = lines.index("$PhysicalNames"), lines.index("$EndElements") - 1
    number, kind, tags, _, *rest = lines[last].split()
    lines[last] = " ".join([number, kind, tags, "3", *rest])
    lines[names + 1 : names + 2] = ["3", '1 3 "strut"']
    (folder / "beam.msh").write_text("\n".join(lines) + "\n")
    refused(folder, capsys, "1 of 2 line cells have no property (group 'strut')", "[properties]", text=BEAM)


def test_solid_held_at_one_line_is_refused(folder, capsys):
    refused(folder, capsys, "no group 'edge'", text=SOLID.replace('"bolt_a"', '"edge"'))


def test_unconstrained_mechanism(bracket_model):
    """A solid held at its root by rotations it does not have: two nodes cannot hold it."""
    mesh = mp.read_mesh(Path(__file__).parent.parent / "meshes" / "bracket.msh", "mm")
    pair = mesh.nodes("bolt_a")[:2]
    cells = {**mesh.cells, "vertex": pair[:, None]}
    loose = mesh.with_(cells=cells, groups={**mesh.groups, "pair": {"vertex": np.array([0, 1])}})
    solid = {"body": mp.Solid(material=mp.Material(E=7e10, nu=0.33, rho=2700.0))}
    with pytest.raises(mp.InputError, match="the 2 nodes of group 'pair' lie on one line"):
        mp.assemble(loose, solid, {"pair": mp.Interface(group="pair")})


def test_output_folder_that_is_a_file(folder, capsys):
    (folder / "taken").write_text("")
    (folder / "job.toml").write_text(BEAM)
    assert main(["run", str(folder / "job.toml"), "--output", str(folder / "taken")]) == 2
    error = capsys.readouterr().err.strip()
    assert "cannot write" in error
    assert len(error.splitlines()) == 1


class TestModalFile:
    @pytest.fixture
    def file(self, tmp_path):
        return mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")

    def check(self, file, capsys, *words):
        assert main(["check", str(file)]) == 2
        error = capsys.readouterr().err.strip()
        assert len(error.splitlines()) == 1
        for word in words:
            assert word in error

    def test_missing(self, tmp_path, capsys):
        self.check(tmp_path / "no.h5", capsys, "no.h5 does not exist")

    @pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.99])
    def test_truncated(self, file, capsys, share):
        content = file.read_bytes()
        file.write_bytes(content[: int(share * len(content))])
        self.check(file, capsys, "beam.h5 is damaged or not a modal file")

    def test_foreign(self, tmp_path, capsys):
        with h5py.File(tmp_path / "other.h5", "w") as h5:
            h5["a"] = 1
        self.check(tmp_path / "other.h5", capsys, "has no attribute format = 'modalprep'")

    def test_wrong_shape(self, file, capsys):
        with h5py.File(file, "a") as h5:
            del h5["S"]
            h5["S"] = np.zeros((3, 5))
        self.check(file, capsys, "S has shape (3, 5) instead of (3, 2)")

    def test_not_a_number(self, file, capsys):
        with h5py.File(file, "a") as h5:
            h5["Kg_A"][0, 0, 0] = np.nan
        self.check(file, capsys, "Kg_A holds values that are not numbers")

    def test_missing_dataset(self, file, capsys):
        with h5py.File(file, "a") as h5:
            del h5["phi"]
        self.check(file, capsys, "damaged or not a modal file")

    def test_mode_out_of_range(self, file, capsys):
        assert main(["render", str(file), "--mode", "9"]) == 2
        assert "no mode 9; its modes are 1 to 2" in capsys.readouterr().err
