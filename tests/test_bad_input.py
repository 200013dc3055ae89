"""Bad input: one sentence on standard error, exit code 2, nothing left behind."""

import json
import shutil
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.multibody.timefunction import FUNCTIONS, TimeFunction

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
        (('type = "beam"', 'type = "beem"'), ["beem", "'beam', 'truss', 'shell', 'solid'"]),
        (("J = 5e-7", ""), ["[properties.beam]", "a beam needs J"]),
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
        (('type = "revolute"', 'type = "hinge"'), ["[joints.hinge.type]", "'weld', 'revolute', 'prismatic'"]),
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


# Sentences that must name their place, their file and their remedy.


def sentence(capsys) -> str:
    """The one line on standard error."""
    error = capsys.readouterr().err
    assert error.startswith("modalprep: ")
    assert error.count("\n") == 1
    assert "Traceback" not in error
    return error


def job(folder: Path, text: str) -> str:
    (folder / "job.toml").write_text(text)
    return str(folder / "job.toml")


@pytest.mark.parametrize(
    "change",
    [
        ('file = "beam.msh"', 'file = "beam.msh"\nlength_unit = "mn"'),
        ('group = "root"', 'group = "rot"'),
        ('group = "root"', 'group = "beam"'),
        ("E = 7e10", "E = -1"),
        ("A = 4e-4", "A = 0"),
        ("J = 5e-7", "J = 5e-7\nup = [1, 0, 0]"),
        ("modes = 3", 'modes = 3\nroot = "tip"'),
        ("modes = 3", 'modes = 3\nkeep = "frequency <"'),
        ("[properties.beam]", "[properties.root]"),
    ],
)
def test_the_sentence_names_the_file(folder, capsys, change):
    assert change[0] in BEAM
    refused(folder, capsys, "job.toml", text=BEAM.replace(*change))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('motion = "open(t)"', ["'hinge'", "unknown name open"]),
        ("motion = []", ["'hinge'", "motion"]),
        ('motion = [{ until = 1, value = "t" }]', ["'hinge'", "the last piece must have no 'until'"]),
        ("axis = [0, 0, 0]", ["'hinge'", "has no direction"]),
    ],
)
def test_the_sentence_names_the_file_and_the_joint(folder, capsys, line, words):
    assert main(["simulate", job(folder, BEAM + HINGE.replace("[simulation]", f"{line}\n[simulation]"))]) == 2
    error = sentence(capsys)
    for word in ["job.toml", *words]:
        assert word in error


def test_missing_pipeline_file(tmp_path, capsys):
    for command in ("run", "modes", "simulate"):
        assert main([command, str(tmp_path / "no.toml")]) == 2
        assert "no.toml does not exist" in sentence(capsys)


@pytest.mark.parametrize("content", [b"", b"name = '\xff'", b"mesh = 3", b"[[joints]]\nx = 1\n"])
def test_pipeline_file_of_another_kind(folder, capsys, content):
    (folder / "job.toml").write_bytes(content)
    refused(folder, capsys, "job.toml")


def test_names_with_line_breaks_stay_on_one_line(folder, capsys):
    text = BEAM.replace("[properties.beam]", '[properties."two\\nlines"]').replace('type = "beam"', 'type = "b"')
    refused(folder, capsys, "two", text=text)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("J = 5e-7", "J = 5e-7\nup = [0, 0, 0]"), ["up", "[0"]),
        (('pictures = "none"', "pictures = -1"), ["[output.pictures]"]),
        (("modes = 3", "modes = 3\ndamping = -1"), ["[reduction.damping]"]),
        (("modes = 3", 'modes = 3\ntruncation_vectors = ["all"]'), ["[reduction]", "names load 'all'", "inertia"]),
        (("modes = 3", 'modes = 0\nkeep = "rubbish"'), ["rubbish", "write for example"]),
    ],
)
def test_one_more_thing_wrong(folder, capsys, change, words):
    assert change[0] in BEAM
    refused(folder, capsys, *words, text=BEAM.replace(*change))


@pytest.mark.parametrize(
    "keep",
    [
        "__import__('os').system('touch stolen')",
        "(lambda: 0)() < 1",
        "frequency.__class__ < 1",
        "[m for m in (1, 2)]",
        "mode < mode",
        "1 < frequency < mode",
        "mode < 1%%",
        "frequency < 500or mode < 2",
        "",
        "\x00",
        "frequency < " + "9" * 400,  # no such float
        "not " * 3000 + "mode < 2",  # deeper than Python's parser goes
    ],
    ids=lambda keep: repr(keep[:30]),
)
def test_keep_is_no_program(folder, capsys, monkeypatch, keep):
    monkeypatch.chdir(folder)
    refused(folder, capsys, "keep", text=BEAM.replace("modes = 3", f"modes = 3\nkeep = {json.dumps(keep)}"))
    assert not (folder / "stolen").exists()


@pytest.mark.parametrize(
    "motion",
    [
        *("__import__('os').system('touch stolen')", "t.x", "[1, 2]", "sin(t", "x", "t < 1", "True"),
        *("1/0", "nan", "oo", "I*t", "gamma(t)", "floor(t)"),
        *("log(t)", "sqrt(t)"),  # no rate at t = 0
    ],
)
def test_motion_is_no_program(folder, capsys, monkeypatch, motion):
    monkeypatch.chdir(folder)
    text = HINGE.replace('"job.root"', f'"job.root"\nmotion = "{motion}"')
    assert main(["simulate", job(folder, BEAM + text)]) == 2
    error = sentence(capsys)
    assert f"function of time {motion!r}" in error
    assert "'hinge': motion" in error
    assert not (folder / "stolen").exists()
    assert not list(folder.rglob("*-run.*"))


@pytest.mark.parametrize("name", [n for n in FUNCTIONS.split(", ") if n != "pi"])
def test_every_function_the_sentence_offers_works(name):
    angle, rate, _ = TimeFunction(f"{name}(t)")(0.5)
    step = (TimeFunction(f"{name}(t)")(0.5 + 1e-6)[0] - angle) / 1e-6
    assert rate == pytest.approx(step, rel=1e-5)  # a forward difference of step 1e-6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"job.root"', '"job.root"\nrotation = { axis = [0, 0, 0], angle = 1.0 }'), ["hinge", "no direction"]),
        (('"job.root"', '"job.root"\nparent = "ground.x"'), ["hinge", "ground"]),
        (('type = "revolute"', 'type = "weld"\nmotion = "t"'), ["hinge", "only a revolute"]),
        (('type = "revolute"', 'type = "free"\nparent = "job.root"'), ["bodies job", "in a loop"]),
        (('"job.root"', '"job.root"\n[joints.b]\ntype = "weld"\nchild = "job.root"'), ["child of 2 joints"]),
        (('"job.root"', '"job.root"\nstart = { angle = "ninety deg" }'), ["[joints.hinge.start.angle]", "90 deg"]),
        (('"job.root"', '"job.root"\n[bodies.job]\npipeline = "job.toml"'), ["body 'job'"]),
        (('"job.root"', '"job.root"\n[bodies.b]\nfile = "b.h5"\npipeline = "b.toml"'), ["[bodies.b]", "either"]),
        (('"job.root"', '"job.root"\n[bodies.b]\nfile = "b.h5"'), ["b.h5 does not exist"]),
        (('"job.root"', '"job.root"\n[bodies.b]\npipeline = "b.toml"'), ["b.toml does not exist"]),
        (("t_end = 0.01", "t_end = 0.01\nrtol = 1e-30"), ["rtol"]),
        (("t_end = 0.01", "t_end = 0.01\noutput_step = 1e-16"), ["output_step"]),
        (("t_end = 0.01", "t_end = 1e300"), ["t_end"]),
        (("t_end = 0.01", 't_end = 1e9\noutput = ["job.modal.99"]'), ["job.modal.99", "job.modal"]),
        (("t_end = 0.01", 't_end = 1e9\n[[plots]]\ny = "hinge.angel"'), ["hinge.angel", "hinge.angle"]),
        (
            (
                "t_end = 0.01",
                't_end = 0.01\n[[plots]]\ny = "hinge.angle"\n[[plots.reference]]\nlabel = "a"\nt = [0, 1]\ny = [0]',
            ),
            ["plots", "reference"],
        ),
    ],
)
def test_one_more_thing_wrong_in_a_system(folder, capsys, change, words):
    assert change[0] in HINGE
    assert main(["simulate", job(folder, BEAM + HINGE.replace(*change))]) == 2
    error = sentence(capsys)
    for word in words:
        assert word in error
    assert not list(folder.rglob("*-run.*"))


def test_simulation_of_nothing(folder, capsys):
    refused(folder, capsys, "job.toml", "bod", text="[simulation]\nt_end = 1.0\n")


def test_simulate_without_simulation(folder, capsys):
    refused(folder, capsys, "job.toml has no [simulation]", "t_end", text=BEAM, command=("simulate",))


def test_loop_of_joints(folder, capsys):
    loop = '\nparent = "b.root"\n[joints.b]\ntype = "weld"\nparent = "job.root"\nchild = "b.root"\n'
    loop += '[bodies.b]\npipeline = "job.toml"'
    assert main(["simulate", job(folder, BEAM + HINGE.replace('"job.root"', '"job.root"' + loop))]) == 2
    error = sentence(capsys)
    for word in ("job.toml", "job", "b", "in a loop", "joint to the ground"):
        assert word in error


@pytest.mark.parametrize("name", ["beam.msh", "bracket.msh"])
def test_mesh_cut_after_a_section(folder, capsys, name):
    lines = (folder / name).read_text().splitlines(keepends=True)
    for end in [k for k, line in enumerate(lines) if line.startswith("$End")][:-1]:
        (folder / name).write_text("".join(lines[: end + 1]))
        refused(folder, capsys, name, text=BEAM if name == "beam.msh" else SOLID)


def test_mesh_cut_at_any_byte(folder):
    """Beam mesh: whole, or refused; nothing in between."""
    content = (folder / "beam.msh").read_bytes().rstrip()
    for size in range(len(content)):
        (folder / "beam.msh").write_bytes(content[:size])
        with pytest.raises(mp.InputError):
            mp.read_mesh(folder / "beam.msh")


@pytest.mark.parametrize("missing", ["0 1 0 1\n", "\n23\n", "\n5.9999999999", "\n30 29 30 \n"])
def test_mesh_that_lost_a_line(folder, capsys, missing):
    """A count or a node number: what follows would silently belong to another node."""
    content = (folder / "beam.msh").read_text()
    start = content.index(missing) + missing.startswith("\n")
    (folder / "beam.msh").write_text(content[:start] + content[content.index("\n", start) + 1 :])
    refused(folder, capsys, "beam.msh", text=BEAM)


@pytest.mark.parametrize("node", ["0", "-3", "99", "x"])
def test_element_on_a_node_that_is_not_there(folder, capsys, node):
    content = (folder / "beam.msh").read_text()
    assert "\n42 41 2 \n" in content
    (folder / "beam.msh").write_text(content.replace("\n42 41 2 \n", f"\n42 41 {node} \n"))
    refused(folder, capsys, "beam.msh", text=BEAM)


def test_mesh_without_content(folder, capsys):
    for content in ("", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"):
        (folder / "beam.msh").write_text(content)
        refused(folder, capsys, "beam.msh", "export it again", text=BEAM)


# Tetrahedra written by hand.

CORNERS = [(1, 1, 1), (2, 1, 1), (1, 2, 1), (1, 1, 2)]
TET = SOLID.replace("bracket.msh", "tet.msh").replace('length_unit = "mm"\n', "")


def write_tets(folder, corners, elements, held=(0, 1, 2), rod=()):
    """Write tet.msh: straight tetra10 (group body), held corners (bolt_a), a line from a corner (rod)."""
    points, middle, conn = [tuple(p) for p in corners], {}, []
    for e in elements:
        for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)):
            if frozenset((e[a], e[b])) not in middle:
                middle[frozenset((e[a], e[b]))] = len(points)
                points.append(tuple(np.mean([corners[e[a]], corners[e[b]]], axis=0)))
        edges = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
        conn.append([*e, *(middle[frozenset((e[a], e[b]))] for a, b in edges)])
    cells = [("tetra10", np.array(conn)), ("vertex", np.array(held)[:, None])]
    numbers = [np.full(len(conn), 1), np.full(len(held), 2)]
    if rod:
        cells.append(("line", np.array([[rod[0], len(points)]])))
        numbers.append(np.array([3]))
        points.append(rod[1])
    names = {"body": np.array([1, 3]), "bolt_a": np.array([2, 0]), "rod": np.array([3, 1])}
    data = {"gmsh:physical": numbers, "gmsh:geometrical": numbers}
    mesh = meshio.Mesh(np.array(points, dtype=float), cells, cell_data=data, field_data=names)
    meshio.gmsh.write(folder / "tet.msh", mesh, fmt_version="2.2", binary=False)


def test_the_tetrahedron_itself_is_good(folder):
    write_tets(folder, CORNERS, [(0, 1, 2, 3)])
    assert main(["run", job(folder, TET), "--json"]) == 0


def test_inverted_tetrahedron_is_found_where_it_is(folder, capsys):
    write_tets(folder, CORNERS, [(0, 2, 1, 3)])
    refused(folder, capsys, "inverted", "near (1.25, 1.25, 1.25) m", "repair the mesh", text=TET)


@pytest.mark.parametrize("top", [(2, 2, 1), (1, 1, 1), (1.5, 1, 1)])
def test_flat_tetrahedron(folder, capsys, top):
    write_tets(folder, [*CORNERS[:3], top], [(0, 1, 2, 3)])
    at = ", ".join(f"{x:.4g}" for x in np.mean([*CORNERS[:3], top], axis=0))
    refused(folder, capsys, "flat", f"near ({at}) m", "repair the mesh", text=TET)


@pytest.mark.parametrize("held", [(0,), (0, 1)])
def test_interface_too_small_to_hold(folder, capsys, held):
    write_tets(folder, CORNERS, [(0, 1, 2, 3)], held=held)
    refused(folder, capsys, "'bolt'", "group 'bolt_a'", "on one line", "add nodes", text=TET)


def test_node_interface_on_a_solid(folder, capsys):
    write_tets(folder, CORNERS, [(0, 1, 2, 3)], held=(0,))
    text = TET.replace('group = "bolt_a"', 'group = "bolt_a"\nkind = "node"')
    refused(folder, capsys, "'bolt'", "no rotations", "rbe2", text=text)


@pytest.mark.parametrize("shared", ["edge", "corner"])
def test_mechanism_of_two_solids(folder, capsys, shared):
    """Two tetrahedra that share an edge are hinged on it; on one corner, a ball joint."""
    far = {"edge": [(1, 0, 0), (2, 0, 1)], "corner": [(1, 0, 0), (2, 0, 0), (1, 0, -1)]}[shared]
    second = {"edge": (0, 1, 5, 4), "corner": (0, 4, 5, 6)}[shared]
    corners = [*CORNERS, *far]
    edges = np.subtract([corners[k] for k in second[1:]], corners[second[0]])
    if np.linalg.det(edges) < 0:
        second = (*second[:2], second[3], second[2])
    write_tets(folder, corners, [(0, 1, 2, 3), second], held=(1, 2, 3))
    refused(folder, capsys, "mechanism", "near (", "without strain", "connect that part", text=TET)


def test_mechanism_of_a_rod_on_a_solid(folder, capsys):
    """A beam on a corner of a solid, whose nodes have no rotations, hangs on a ball joint."""
    write_tets(folder, CORNERS, [(0, 1, 2, 3)], held=(0, 2, 3), rod=(1, (4, 1, 1)))
    rod = BEAM[BEAM.index("[properties.beam]") : BEAM.index("[interfaces")].replace("beam]", "rod]")
    refused(folder, capsys, "mechanism", "node", ", 1, 1) m", "without strain", text=TET + rod)


def test_property_of_the_wrong_type(folder, capsys):
    section = BEAM[BEAM.index("[properties.beam]") : BEAM.index("[interfaces")]
    solid = '[properties.beam]\ntype = "solid"\nmaterial = "alloy"\n'
    refused(folder, capsys, "'beam' has line cells", "tetra10", text=BEAM.replace(section, solid))


def test_cells_with_two_properties(folder, capsys):
    section = BEAM[BEAM.index("[properties.beam]") : BEAM.index("[interfaces")]
    cells = [("vertex", np.array([[0]])), ("line", np.array([[0, 1], [1, 2]])), ("line", np.array([[0, 1]]))]
    numbers = [np.array([1]), np.array([2, 2]), np.array([3])]
    names = {"root": np.array([1, 0]), "beam": np.array([2, 1]), "strut": np.array([3, 1])}
    data = {"gmsh:physical": numbers, "gmsh:geometrical": numbers}
    mesh = meshio.Mesh(np.eye(3) * [1.0, 2.0, 3.0], cells, cell_data=data, field_data=names)
    meshio.gmsh.write(folder / "beam.msh", mesh, fmt_version="2.2", binary=False)
    text = BEAM.replace(section, section + section.replace("beam]", "strut]"))
    refused(folder, capsys, "1 line cells have two properties", "its own cells", text=text)


@pytest.mark.parametrize("kind", ["node", "rbe2"])
def test_two_interfaces_on_one_node(folder, capsys, kind):
    second = f'[interfaces.second]\ngroup = "root"\nkind = "{kind}"\n\n[reduction]'
    refused(folder, capsys, "'root'", "'second'", text=BEAM.replace("[reduction]", second))


@pytest.mark.parametrize(
    "change",
    [
        ("modes = 3", 'method = "guyan"'),
        ("modes = 3", "modes = 0\ntruncation_vectors = []"),
        ("modes = 3", 'modes = 3\nkeep = "mode < 1"\ntruncation_vectors = []'),
        ('group = "root"\nkind = "node"', 'group = "beam"\nkind = "rbe2"'),
    ],
    ids=["guyan", "no candidates", "none kept", "all nodes tied"],
)
def test_body_without_modes_is_rigid_or_refused(folder, capsys, change):
    assert change[0] in BEAM
    if main(["run", job(folder, BEAM.replace(*change))]) != 0:
        assert "mode" in sentence(capsys)


def test_simulation_into_a_csv_file_keeps_the_result(folder):
    """The CSV goes beside the result: it must not replace it."""
    if main(["simulate", job(folder, BEAM + HINGE), "-o", str(folder / "out.csv")]) == 0:
        assert mp.read_result(folder / "out.csv").status == "done"


def test_output_that_cannot_be_written(folder, capsys):
    (folder / "taken").write_text("")
    file = job(folder, BEAM + HINGE)
    for command in (["run", file, "--output"], ["modes", file, "--output"], ["simulate", file, "--output"]):
        assert main([*command, str(folder / "taken")]) == 2
        assert "cannot write" in sentence(capsys)
    assert main(["simulate", file, "-o", str(folder / "taken" / "a.h5")]) == 2
    assert "cannot write" in sentence(capsys)
    (folder / "output" / "job" / "job.html").mkdir(parents=True)
    assert main(["run", file]) == 2
    assert "job.html: Is a directory" in sentence(capsys)
    assert not [path for path in folder.rglob("*") if ".part" in path.name]


class TestModalFileOfAnotherMaking:
    """A file whose single datasets are sound but do not fit each other."""

    @pytest.fixture
    def file(self, tmp_path):
        return mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")

    def replace(self, file, name, value):
        with h5py.File(file, "a") as h5:
            if name in h5:
                del h5[name]
            h5[name] = value

    def check(self, file, capsys, *words):
        assert main(["check", str(file)]) == 2
        error = sentence(capsys)
        for word in ["beam.h5", *words]:
            assert word in error

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("format_version", 2),
            ("format_version", "new"),
            ("inputs", "{"),
            ("inputs", "[1]"),
        ],
    )
    def test_attribute(self, file, capsys, name, value):
        with h5py.File(file, "a") as h5:
            h5.attrs[name] = value
        self.check(file, capsys, *(["version 2", "update modalprep"] if value == 2 else ["write it again"]))

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("K", np.array([b"a", b"b"])),
            ("K", 3.0),
            ("E0", 1j * np.ones((3, 3))),
            ("modes", np.zeros(3)),
            ("interface_name", np.array([1, 2])),
            ("interface_name", np.array(["root", "root"], dtype=object)),
            ("cells/line", np.array([[0, 999]])),
            ("cells/line", np.zeros(3)),
            ("cells/riddle", np.array([[0, 1]])),
            ("points", np.zeros((0, 3))),
        ],
        ids=lambda value: value if isinstance(value, str) else "",
    )
    def test_dataset(self, file, capsys, name, value):
        self.replace(file, name, value)
        self.check(file, capsys, "write it again")

    def test_totals(self, file, capsys):
        for total in (np.zeros(2), np.full(6, np.nan)):
            with h5py.File(file, "a") as h5:
                h5["modes"].attrs["total"] = total
            self.check(file, capsys, "total")

    @pytest.mark.parametrize("command", ["modes", "render", "simulate"])
    def test_every_reader_refuses_a_cut_file(self, file, capsys, command):
        file.write_bytes(file.read_bytes()[:-100])
        target = file.parent / "job.toml"
        target.write_text(
            '[bodies.job]\nfile = "beam.h5"\n[joints.hinge]\ntype = "revolute"\nchild = "job.root"\n'
            "[simulation]\nt_end = 0.01\n"
        )
        before = set(file.parent.rglob("*"))
        assert main([command, str(target if command == "simulate" else file)]) == 2
        assert "beam.h5 is damaged" in sentence(capsys)
        assert set(file.parent.rglob("*")) == before

    def test_a_damaged_body_of_an_earlier_run_is_built_again(self, folder):
        earlier = folder / "output" / "job" / "job.h5"
        earlier.parent.mkdir(parents=True)
        earlier.write_bytes(b"damaged")
        assert main(["simulate", job(folder, BEAM + HINGE), "--json"]) == 0
        assert mp.read_body(earlier).m == pytest.approx(12.0)  # rho A L = 3000 * 4e-4 * 10
