"""What the catalogue of bad input (tests/bad) does not hold: good neighbours of bad input, other doors, every cut."""

import codecs
import os
import subprocess
import sys
import time
import zipfile

import h5py
import numpy as np
import pytest
from bad.good import (
    BEAM,
    CORNERS,
    HINGE,
    SOLID,
    TET,
    uniform_beam,
    write_good,
    write_lines,
    write_matrices,
    write_tets,
)

import modalprep as mp
from modalprep import atomic
from modalprep.cli import main
from modalprep.fe.external.files import read_matrices
from modalprep.multibody.model.functions.safe_expression import FUNCTIONS
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.pipeline.schema.load import load_pipeline


@pytest.fixture
def folder(tmp_path, project):
    for name in ("beam.msh", "bracket.msh"):
        (tmp_path / name).write_bytes((project / "meshes" / name).read_bytes())
    return tmp_path


def message(capsys) -> str:
    """The one line on standard error."""
    error = capsys.readouterr().err
    assert error.startswith("modalprep: ")
    assert error.count("\n") == 1
    return error


def job(folder, text: str) -> str:
    (folder / "job.toml").write_text(text)
    return str(folder / "job.toml")


def test_the_job_itself_is_good(folder):
    assert main(["run", job(folder, BEAM + HINGE), "--json"]) == 0


def test_the_tetrahedron_itself_is_good(folder):
    write_tets(folder, CORNERS, [(0, 1, 2, 3)])
    assert main(["run", job(folder, TET), "--json"]) == 0


def test_element_listed_twice_counts_once(folder):
    write_lines(folder, [[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1], [1, 2], [1, 0]])
    mesh = mp.read_mesh(folder / "beam.msh")
    assert len(mesh.cells["line"]) == 2
    assert len(mesh.groups["beam"]["line"]) == 2


def test_two_nodes_of_a_solid_cannot_hold_it(folder):
    mesh = mp.read_mesh(folder / "bracket.msh", "mm")
    pair = mesh.nodes("bolt_a")[:2]
    cells = {**mesh.cells, "vertex": pair[:, None]}
    loose = mesh.with_(cells=cells, groups={**mesh.groups, "pair": {"vertex": np.array([0, 1])}})
    solid = {"body": mp.Solid(material=mp.Material(E=7e10, nu=0.33, rho=2700.0))}
    with pytest.raises(mp.InputError, match="the 2 nodes of group 'pair' lie on one line"):
        mp.assemble(loose, solid, {"pair": mp.Interface(group="pair")})


def test_wrong_unit_of_length_is_warned_of(folder, capsys):
    assert main(["run", job(folder, SOLID.replace('"mm"', '"km"')), "--no-report", "--no-pictures"]) == 0
    assert "its mass is implausible" in capsys.readouterr().out


@pytest.mark.parametrize("name", [n for n in FUNCTIONS.split(", ") if n != "pi"])
def test_every_function_the_message_lists_works(name):
    angle, rate, _ = TimeFunction(f"{name}(t)")(0.5)
    step = (TimeFunction(f"{name}(t)")(0.5 + 1e-6)[0] - angle) / 1e-6
    assert rate == pytest.approx(step, rel=1e-5)  # a forward difference of step 1e-6


@pytest.mark.parametrize(("name", "text"), [("beam.msh", BEAM), ("bracket.msh", SOLID)])
def test_mesh_cut_after_a_section(folder, capsys, name, text):
    lines = (folder / name).read_text().splitlines(keepends=True)
    for end in [k for k, line in enumerate(lines) if line.startswith("$End")][:-1]:
        (folder / name).write_text("".join(lines[: end + 1]))
        assert main(["run", job(folder, text)]) == 2
        assert name in message(capsys)
        assert not (folder / "output").exists()


def test_mesh_cut_at_any_byte(folder):
    """Beam mesh: whole, or refused; nothing in between."""
    content = (folder / "beam.msh").read_bytes().rstrip()
    for size in range(len(content)):
        (folder / "beam.msh").write_bytes(content[:size])
        with pytest.raises(mp.InputError):
            mp.read_mesh(folder / "beam.msh")


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
        assert "mode" in message(capsys)


def test_simulation_into_a_csv_file_keeps_the_result(folder):
    """The CSV goes beside the result: it must not replace it."""
    assert main(["simulate", job(folder, BEAM + HINGE), "-o", str(folder / "out.csv")]) == 0
    assert mp.read_result(folder / "out.csv").status == "done"


def test_output_that_cannot_be_written(folder, capsys):
    (folder / "taken").write_text("")
    file = job(folder, BEAM + HINGE)
    for command in (["run", file, "--output"], ["modes", file, "--output"], ["simulate", file, "--output"]):
        assert main([*command, str(folder / "taken")]) == 2
        assert "cannot write" in message(capsys)
    assert main(["simulate", file, "-o", str(folder / "taken" / "a.h5")]) == 2
    assert "cannot write" in message(capsys)
    (folder / "output" / "job" / "job.html").mkdir(parents=True)
    assert main(["run", file]) == 2
    assert "job.html: Is a directory" in message(capsys)
    assert not [path for path in folder.rglob("*") if ".part" in path.name]


def test_a_damaged_body_of_an_earlier_run_is_built_again(folder):
    earlier = folder / "output" / "job" / "job.h5"
    earlier.parent.mkdir(parents=True)
    earlier.write_bytes(b"damaged")
    assert main(["simulate", job(folder, BEAM + HINGE), "--json"]) == 0
    assert mp.read_body(earlier).m == pytest.approx(12.0)  # rho A L = 3000 * 4e-4 * 10


class TestResults:
    """Read from Python alone."""

    @pytest.fixture
    def file(self, tmp_path):
        run = mp.Result(time=np.arange(3.0), channels={"a.angle": np.ones(3)}, status="done", message="")
        return mp.write_result(run, tmp_path / "run.h5")

    @pytest.mark.parametrize("value", [np.ones(2), np.array([b"a"] * 3), np.ones((3, 1, 1)), 1.0])
    def test_channel(self, file, value):
        with h5py.File(file, "a") as h5:
            del h5["channels/a.angle"]
            h5["channels/a.angle"] = value
        with pytest.raises(mp.InputError, match=r"run.h5.*simulate again"):
            mp.read_result(file)

    @pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.99])
    def test_cut(self, file, share):
        content = file.read_bytes()
        file.write_bytes(content[: int(share * len(content))])
        with pytest.raises(mp.InputError, match=r"run.h5 is damaged or not a result file.*simulate again"):
            mp.read_result(file)

    def test_link(self, file):
        with h5py.File(file, "a") as h5:
            h5["channels/b"] = h5py.ExternalLink("/dev/zero", "x")
        with pytest.raises(mp.InputError, match="b is an external link"):
            mp.read_result(file)

    def test_modal_file(self, tmp_path):
        with pytest.raises(mp.InputError, match="not a result file"):
            mp.read_result(mp.write_body(uniform_beam(modes=2), tmp_path / "body.h5"))

    @pytest.mark.parametrize("text", ["", "time\n1,2\n", "a,b\n1,2\n", "time\nx\n", "time\n\x001\n", "\xff"])
    def test_table(self, tmp_path, text):
        (tmp_path / "run.csv").write_text(text, encoding="latin-1")
        with pytest.raises(mp.InputError, match=r"run.csv is not a table of a result.*write it again"):
            mp.formats.read_csv(tmp_path / "run.csv")


class TestLeftOver:
    """Temporary files of a run that was killed."""

    @pytest.mark.parametrize(("age", "stays"), [(7200, False), (60, True)])
    def test_they_go_with_the_next_run(self, tmp_path, age, stays):
        left = tmp_path / ".body.4711.part.h5"
        left.write_text("half")
        os.utime(left, (time.time() - age,) * 2)
        mp.write_body(uniform_beam(modes=2), tmp_path / "body.h5")
        assert left.exists() == stays  # a young one may belong to a run that goes on

    def test_those_of_ended_processes_go_at_once(self, tmp_path):
        """In the folder of any file that is written; those of a living process stay, and those of another machine."""
        with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
            here = atomic._here()
            names = {
                "living": f".run.{here}-{other.pid}.part.h5", "own": f".x.{here}-{os.getpid()}.part",
                "elsewhere": f".run.00000000-{2**22 + 1}.part.h5", "unlike": f"run.{here}-{2**22 + 1}.part.h5",
                "dead": f".other name.v2.{here}-{2**22 + 1}.part.csv",
            }  # fmt: skip
            for name in names.values():
                (tmp_path / name).write_text("half")
            mp.write_body(uniform_beam(modes=2), tmp_path / "body.h5")
            assert [key for key, name in names.items() if not (tmp_path / name).exists()] == ["dead"]
            other.communicate(b"\n")
        atomic._swept.clear()  # after a minute
        mp.write_body(uniform_beam(modes=2), tmp_path / "body.h5")
        assert [key for key, name in names.items() if (tmp_path / name).exists()] == ["own", "elsewhere", "unlike"]

    def test_a_killed_run_leaves_nothing_to_the_next(self, tmp_path):
        """A process is killed while it writes; the next one that writes another file there removes what it left."""
        code = (
            "import sys, time; from modalprep.atomic import atomic_path\n"
            "with atomic_path(sys.argv[1]) as file:\n"
            "    file.write_bytes(bytes(10**6))\n    print(flush=True)\n    time.sleep(99)"
        )
        with subprocess.Popen([sys.executable, "-c", code, tmp_path / "run.h5"], stdout=subprocess.PIPE) as process:
            process.stdout.readline()
            process.kill()
        assert list(tmp_path.glob(".run.*.part.h5"))
        mp.write_body(uniform_beam(modes=2), tmp_path / "body.h5")
        assert [path.name for path in tmp_path.iterdir()] == ["body.h5"]


class TestMark:
    """Editors of Windows put a mark before the text of a file (UTF-8 with BOM)."""

    @pytest.mark.parametrize("name", ["job", "plate", "deck", "matrices"])
    def test_every_file_of_a_pipeline(self, tmp_path, name):
        write_good(tmp_path)
        assert main(["modes", str(tmp_path / f"{name}.toml")]) == 0
        plain = mp.read_body(tmp_path / "output" / name / f"{name}.h5")
        for file in tmp_path.iterdir():
            if file.suffix in (".toml", ".inp", ".bdf", ".mtx", ".csv"):
                file.write_bytes(codecs.BOM_UTF8 + file.read_bytes())
        assert main(["modes", str(tmp_path / f"{name}.toml")]) == 0
        marked = mp.read_body(tmp_path / "output" / name / f"{name}.h5")
        assert (marked.m, marked.frequency.tolist()) == (plain.m, plain.frequency.tolist())

    def test_table_of_a_result(self, tmp_path):
        (tmp_path / "run.csv").write_text("time,a\n0,1\n1,2\n", encoding="utf-8-sig")
        assert mp.formats.read_csv(tmp_path / "run.csv")["a"].tolist() == [1.0, 2.0]


class TestUnits:
    """Constants of materials may be text with their unit; numbers are SI."""

    @pytest.mark.parametrize("text", ["70 GPa", "7e4MPa", "70000 N/mm^2", "7e7 kPa", "7e10 Pa"])
    def test_stress(self, folder, text):
        file = job(folder, BEAM.replace("E = 7e10", f'E = "{text}"'))
        assert load_pipeline(file).materials["alloy"].E == 7e10

    @pytest.mark.parametrize("text", ["3 g/cm^3", "3 kg/dm3", "3 t/m^3", "3e-9 t/mm^3", "3000 kg/m^3"])
    def test_density(self, folder, text):
        file = job(folder, BEAM.replace("rho = 3000.0", f'rho = "{text}"'))
        assert load_pipeline(file).materials["alloy"].rho == pytest.approx(3000.0)  # 3e-9 is not exact in binary

    @pytest.mark.parametrize(
        ("old", "new", "words"),
        [
            ("E = 7e10", 'E = "70"', "'70' is no number with a unit of Pa; write for example '210 GPa' or 2.1e11"),
            ("E = 7e10", 'E = "70 kg/m"', "'70 kg/m' has another dimension than Pa; write for example '210 GPa'"),
            ("rho = 3000.0", 'rho = "heavy"', "write for example '7.85 g/cm^3' or 7850"),
            ("A = 4e-4", 'A = "4 cm3"', "[properties.beam.A]: '4 cm3' has another dimension than m^2"),
            ("modes = 3", 'modes = "3"', "'3' is text; write the number without quotes"),
        ],
    )
    def test_what_is_none(self, folder, capsys, old, new, words):
        assert main(["modes", job(folder, BEAM.replace(old, new))]) == 2
        assert words in message(capsys)


class TestMemory:
    """What a file takes while it is read counts, copies included."""

    @pytest.fixture
    def room(self, monkeypatch):
        return lambda size: monkeypatch.setenv("MODALPREP_MEMORY", str(size / 2**30))

    def test_archive_of_matrices(self, tmp_path, room):
        write_matrices(tmp_path)
        with zipfile.ZipFile(tmp_path / "model.npz") as archive:
            size = sum(info.file_size for info in archive.infolist())
        room(4 * size)
        assert len(read_matrices(file=tmp_path / "model.npz").points) == 5
        room(2 * size)
        with pytest.raises(mp.InputError, match="more than the memory that is free"):
            read_matrices(file=tmp_path / "model.npz")

    def test_modal_file(self, tmp_path, room):
        file = mp.write_body(uniform_beam(modes=2), tmp_path / "body.h5")
        with h5py.File(file) as h5:
            sizes = []
            h5.visititems(lambda name, data: sizes.append(data.nbytes if isinstance(data, h5py.Dataset) else 0))
        room(3 * sum(sizes))
        assert mp.read_body(file).n == 2
        room(1.5 * sum(sizes))
        with pytest.raises(mp.InputError, match="more than the memory that is free"):
            mp.read_body(file)


class TestTerminal:
    """What the console script prints, in a process of its own."""

    def script(self, tmp_path, code, **environment):
        command = [sys.executable, "-c", f"import sys, modalprep.cli\n{code}\nmodalprep.cli.entry()"]
        return subprocess.run(command, capture_output=True, cwd=tmp_path, env=os.environ | environment)

    def test_without_accents(self, tmp_path):
        """A terminal of ASCII shows m2 and not a traceback."""
        mp.write_body(uniform_beam(modes=2), tmp_path / "body.h5")
        done = self.script(tmp_path, "sys.argv = ['modalprep', 'modes', 'body.h5']", PYTHONIOENCODING="ascii")
        assert (done.returncode, done.stderr) == (0, b"")
        assert b"kg m2" in done.stdout

    def test_without_warnings_of_numpy(self, tmp_path):
        code = "import numpy\nmodalprep.cli.main = lambda: int(numpy.isfinite(numpy.float64(1e308) * 10))"
        done = self.script(tmp_path, code)
        assert (done.returncode, done.stderr) == (0, b"")
