"""Files that pipeline files name: the schema marks their keys, and from grids and `--set` they stay the same files."""

import json
import tomllib
from itertools import pairwise
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import pytest
import tomli_w
from batches import Inline
from pydantic import BaseModel

from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.pipeline.batch import grid
from modalprep.pipeline.batch.grid import find_jobs, plan_jobs
from modalprep.pipeline.batch.manifest import input_digests
from modalprep.pipeline.batch.settings import with_settings
from modalprep.pipeline.building.sources import needed_files, source_files
from modalprep.pipeline.schema.base import DeckName, FileName, named_files
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.schema.pipeline import Pipeline

SYSTEM = "[simulation]\nt_end = 1.0\n[bodies.a]\nmass = 1.0\n"
RESPONSE = '[mesh]\nfile = "m.msh"\n[response.one]\n'
SPRING = 'between = ["a.root", "ground"]'
CHAIN = (
    SYSTEM + "[chains.one]\ncount = 2\nsegment = { mass = 1.0, interfaces = { root = [0, 0, 0], tip = [1, 0, 0] } }\n"
)
BEAM = "length = 1.0\nsegments = 2\nmass_per_length = 1.0\n"
AROUND = {  # what a key of this beginning needs around it; the longest beginning counts
    "forces": SYSTEM + '[forces.one]\nat = "a.root"\nforce = [0, 0, 0]\ntorque = [0, 0, 0]',
    "forces.one.factor": SYSTEM + '[forces.one]\nbody = "a"',
    "springs": SYSTEM + "[springs.one]\n" + SPRING,
    "rotational_springs": SYSTEM + "[rotational_springs.one]\n" + SPRING,
    "conductors": SYSTEM + '[conductors.one]\nthrough = ["a.root", "a.root"]',
    "fmu": SYSTEM + '[fmu.one]\nat = "a.root"\nforce = ["fx", 0, 0]',
    "mesh": "",
    "simulation": SYSTEM,
    "matrices": "",
    "matrices.stiffness": '[matrices]\nmass = "m.mtx"',
    "matrices.mass": '[matrices]\nstiffness = "k.mtx"',
    "matrices.nodes": '[matrices]\nfile = "k.npz"',
    "matrices.dof": '[matrices]\nfile = "k.npz"',
    "body": "",
    "body.nodes": '[body]\nfile = "b.mtx"',
    "response": RESPONSE + "lowest = 1.0\nhighest = 2.0",
    "response.sweep": RESPONSE + 'lowest = 1.0\nhighest = 2.0\nrate = "2 oct/min"',
    "response.transient": RESPONSE,
    "response.one.notch": RESPONSE + 'lowest = 1.0\nhighest = 2.0\nbase = { x = 1.0 }\nnotch = [{ channel = "tip" }]',
    "bodies": SYSTEM,
    "bodies.one.surfaces": SYSTEM + "[bodies.one]\nmass = 1.0",
    "chains.one.segment.surfaces": CHAIN + 'joint = { type = "revolute" }',
    "robot": "[simulation]\nt_end = 1.0",
    "joints": SYSTEM + '[joints.one]\ntype = "revolute"\nchild = "a.root"',
    "chains.one.segment": SYSTEM + '[chains.one]\ncount = 2\njoint = { type = "revolute" }',
    "chains.one.joint": CHAIN + 'joint = { type = "revolute" }',
    "chains.one.joint.0": CHAIN + 'joint = [{ type = "revolute" }]',
    "chains.one.first": CHAIN + 'joint = { type = "revolute" }',
    "beams": SYSTEM + "[beams.one]\nEI = 1.0\n" + BEAM,
    "deployments": "[simulation]\nt_end = 1.0\n[deployments.one]\n" + BEAM,
    "closures": SYSTEM + '[closures.one]\ntype = "distance"\na = "a.root"',
    "closures.one.path": SYSTEM + '[closures.one]\ntype = "position"\na = "a.root"\npath = [0, 0, 0]',
    "couplers": SYSTEM + "[couplers.one]\nfactors = { x = 1.0 }",
    "depletions.one.empty": SYSTEM + '[depletions.one]\nbody = "a"\nrate = 1.0',
    "depletions.one.intermediate": SYSTEM
    + '[depletions.one]\nbody = "a"\nrate = 1.0\nempty = { density_factor = 0.1 }\nintermediate = [{}]',
    "depletions.one.mass": SYSTEM + '[depletions.one]\nbody = "a"\nempty = { density_factor = 0.1 }',
    "analysis": SYSTEM + "[analysis.inverse]\nt_end = 1.0",
}


ROBOT = (
    '<robot><link name="base"/><link name="arm"><inertial><mass value="1"/></inertial></link>'
    '<joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>\n'
)


def places(kind, keys=(), kinds=()):
    """Yield the keys of all files of a type, and the keys with one possible value on the way."""
    origin, inside = get_origin(kind), get_args(kind)
    if isinstance(kind, type) and issubclass(kind, FileName):
        yield keys, kinds
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        fields = {name: field.annotation for name, field in kind.model_fields.items()}
        fixed = {name: get_args(each) for name, each in fields.items() if get_origin(each) is Literal}
        kinds += tuple(((*keys, name), words[0]) for name, words in fixed.items() if len(words) == 1)
        for name, each in fields.items():
            assert "file" not in name or list(places(each)), f"{(*keys, name)} is no FileName"
            yield from places(each, (*keys, name), kinds)
    elif origin in (list, dict):
        yield from places(inside[-1], (*keys, 0 if origin is list else "one"), kinds)
    elif origin in (Annotated, Union, UnionType):
        for each in inside[: 1 if origin is Annotated else None]:
            yield from places(each, keys, kinds)
    else:
        assert kind is not Any or keys[0] == "grid", f"{keys} may hide files"


PLACES = list(dict.fromkeys(places(Pipeline)))


def put(data, keys, value):
    """Put a value where keys lead, making the tables and lists on the way."""
    for key, after in pairwise(keys):
        empty = [None] if after == 0 else {}
        if isinstance(data, list):
            data[key] = data[key] if isinstance(data[key], dict) else empty
        data = data[key] if isinstance(data, list) else data.setdefault(key, empty)
    data[keys[-1]] = value


def around(keys, kinds):
    """Return the tables that a key needs around it."""
    name = ".".join(map(str, keys))
    names = [name, *(f"response.{kind}" for _, kind in kinds)]
    data = tomllib.loads(AROUND[max((start for start in AROUND if any(n.startswith(start) for n in names)), key=len)])
    for where, kind in kinds:
        put(data, where, kind)
    return data


@pytest.fixture
def folders(tmp_path):
    for name in ("data", "pipelines"):
        (tmp_path / name).mkdir()
    for name in ("own", "other"):  # a pipeline file, where one is asked for; the others are not read
        (tmp_path / "data" / f"{name}.toml").write_text('[mesh]\nfile = "m.msh"\n')
    return tmp_path


def read_by(file):
    source = load(file)
    return {path.resolve() for path in (*source_files(source), *source.body_files)}


@pytest.mark.parametrize(("keys", "kinds"), PLACES, ids=lambda value: ".".join(str(each) for each in value))
def test_every_file_is_found_from_a_grid(folders, keys, kinds):
    """Whether beside the grid or chosen by it; a change of the file is one of the job's inputs."""
    own, other, file = (folders / name for name in ("data/own.toml", "data/other.toml", "pipelines/job.toml"))
    beside, chosen = around(keys, kinds), around(keys, kinds)
    for each in (own, other) if keys[0] == "robot" else ():
        each.write_text(ROBOT)
    put(beside, keys, "../data/own.toml")
    assert (keys, "../data/own.toml") in list(named_files(Pipeline.model_validate(beside)))
    file.write_text(tomli_w.dumps(beside))
    changed, _ = with_settings(file, ["name=c"], folders / "far" / "set")
    file.write_text(tomli_w.dumps(beside | {"grid": {"name": ["a"]}}))
    jobs = [job.file for job in find_jobs([str(file)], folders / "far" / "out")]
    if 0 not in keys:
        grid = {".".join(keys): ["../data/own.toml", "../data/other.toml"]}
        file.write_text(tomli_w.dumps(chosen | {"grid": grid}))
        jobs += [job.file for job in find_jobs([str(file)], folders / "far" / "out")]
    for job in (changed, *jobs[:2]):
        assert own in read_by(job)
        before = input_digests(load(job))
        own.write_text(own.read_text() + ("<!-- another -->\n" if keys[0] == "robot" else "# another\n"))
        assert input_digests(load(job)) != before
    assert all(other in read_by(job) and own not in read_by(job) for job in jobs[2:])


GRID = """
[bodies.block]
mass = 1.0
[joints.slide]
type = "prismatic"
child = "block.root"
axis = [1, 0, 0]
stiffness = 50.0
[forces.push]
at = "block.root"
force = [{ file = "t.csv" }, 0, 0]
[simulation]
t_end = 0.1
[grid]
"bodies.block.mass" = [1.0, 2.0]
"forces.push.torque" = [[{ file = "t.csv" }, 0, 0], [0, { file = "t.csv" }, 0]]
"""


def test_a_grid_with_tables_in_its_values_runs(monkeypatch, tmp_path, capsys):
    """Values of the grid that hold tables with files serve several combinations; only a changed file is read again."""
    monkeypatch.setattr("modalprep.pipeline.batch.dispatch.Processes", Inline)
    (tmp_path / "g.toml").write_text(GRID)
    for text, runs in (("0,0\n1,1\n", True), ("0,0\n1,1\n", False), ("0,0\n1,2\n", True)):
        (tmp_path / "t.csv").write_text(text)
        assert main(["batch", str(tmp_path / "g.toml"), "--no-cache", "--json"]) == 0
        assert [row["ran"] for row in json.loads(capsys.readouterr().out)["jobs"]] == [runs] * 4


def test_pipelines_of_bodies_keep_their_own_files(folders):
    """The mesh of a body's pipeline is beside that, wherever the job of the system lies."""
    file, own = folders / "pipelines" / "job.toml", folders / "data" / "own.toml"
    file.write_text(SYSTEM + '[bodies.b]\npipeline = "../data/own.toml"\n[grid]\nname = ["a"]\n')
    (job,) = find_jobs([str(file)], folders / "far" / "out")
    needed = [path.resolve() for path in needed_files(load(job.file))]
    assert needed == [job.file, own, folders / "data" / "m.msh"]


def test_what_jobs_need_is_known_when_they_are_planned(folders, monkeypatch):
    """Each combination is validated once, and no written file is read again; equal needs are kept once."""
    file, validated = folders / "pipelines" / "job.toml", []
    tables = '[mesh]\nfile = "a.msh"\n[reduction]\nmodes = 3\n[bodies.b]\npipeline = "../data/own.toml"\n'
    file.write_text(tables + '[simulation]\nt_end = 1.0\n[grid]\n"simulation.rtol" = [1e-5, 1e-6, 2.0]\n')
    monkeypatch.setattr(grid, "validated", lambda *data, real=grid.validated: validated.append(data) or real(*data))
    planned = plan_jobs([str(file)], folders / "out")
    assert len(validated) <= len(planned) + 1
    named = [(path.resolve(),) for path in (folders / "data" / "own.toml", folders / "pipelines" / "a.msh")]
    assert [needs for _, needs in planned] == [(3, *named), (3, *named), (0, (), ())]
    assert planned[0][1] is planned[1][1]
    for job, needs in planned[:2]:
        assert {*needs.pipelines, *needs.files} == read_by(job.file)
    assert plan_jobs([str(planned[0][0].file)], None)[0][1] == planned[0][1]


def test_absolute_names_stay_and_links_keep_their_names(folders):
    """An absolute name needs no other; a link may have the suffix that its target lacks."""
    (folders / "data" / "0815").write_text("")
    (folders / "pipelines" / "link.msh").symlink_to(folders / "data" / "0815")
    file, absolute = folders / "pipelines" / "job.toml", str(folders / "data" / "a.msh")
    file.write_text(f'[mesh]\nfile = "link.msh"\n[grid]\n"mesh.file" = ["link.msh", "{absolute}"]\n')
    names = [load(job.file).pipeline.mesh.file for job in find_jobs([str(file)], folders / "out")]
    assert names == ["../../pipelines/link.msh", absolute]


def test_combinations_that_are_invalid_fail_alone(folders):
    """What is no pipeline file is written as it is said, for its message."""
    file = folders / "pipelines" / "job.toml"
    file.write_text('[mesh]\nfile = "a.msh"\n[grid]\n"reduction.modes" = [2, -1]\n')
    good, bad = find_jobs([str(file)], folders / "out")
    assert tomllib.loads(good.file.read_text())["mesh"]["file"] == "../../pipelines/a.msh"
    with pytest.raises(InputError, match="greater than or equal to 0"):
        load(bad.file)


def test_names_are_text_for_whatever_takes_them():
    """In JSON and among the options by which a body is known, a name is what the file says."""
    pipeline = Pipeline.model_validate({"mesh": {"file": "a.msh"}})
    assert isinstance(pipeline.mesh.file, DeckName)
    assert json.loads(json.dumps(pipeline.model_dump()))["mesh"]["file"] == "a.msh"
    assert Pipeline.model_json_schema()["$defs"]["MeshTable"]["properties"]["file"]["type"] == "string"
