"""Values of another type than a call needs: one sentence that says what it needs, and how to make one."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section, uniform_beam


@pytest.fixture(scope="module")
def things():
    mesh = beam_mesh(2)
    model = mp.assemble(mesh, {"beam": spinup_section()}, {"root": mp.Interface(group="root", kind="node")})
    body = uniform_beam(modes=1)
    system = mp.System(bodies={"a": body}, joints=(mp.Joint(name="j", type="revolute", parent="ground", child="a"),))
    run = mp.Result(time=np.zeros(1), channels={"a.tip": np.zeros((1, 3))}, status="done", message="")
    return {
        "mesh": mesh, "model": model, "body": body, "system": system, "run": run, "joint": system.joints[0],
        "reduction": mp.guyan(model), "path": "bracket.msh",
    }  # fmt: skip


CALLS = {
    "assemble: the mesh must be of type Mesh, not str; read one with read_mesh": (
        lambda o: mp.assemble(o["path"], {}, {})
    ),
    "check_mesh: the mesh must be of type Mesh, not FEModel": lambda o: mp.check_mesh(o["model"]),
    "craig_bampton: the model must be of type FEModel, not Mesh; make one with assemble": (
        lambda o: mp.craig_bampton(o["mesh"], modes=2)
    ),
    "guyan: the model must be of type FEModel, not str": lambda o: mp.guyan(o["path"]),
    "free_interface: the model must be of type FEModel": lambda o: mp.reduction.free_interface(o["mesh"], modes=1),
    "improved_guyan: the model must be of type FEModel": lambda o: mp.reduction.improved_guyan(o["mesh"]),
    "buckling: the model must be of type FEModel": lambda o: mp.reduction.buckling(o["mesh"], None),
    "prestressed_modes: the model must be of type FEModel": lambda o: mp.reduction.prestressed_modes(o["mesh"], None),
    "interface_load: the model must be of type FEModel": lambda o: mp.reduction.interface_load(o["mesh"], "root"),
    "acceleration_load: the model must": lambda o: mp.reduction.acceleration_load(o["mesh"], np.ones(3)),
    "nodal_load: the model must be of type FEModel": (
        lambda o: mp.reduction.nodal_load(o["mesh"], o["mesh"], "push", None)
    ),
    "reduction_error: the reduction must be of type Reduction, not FlexibleBody; make one with craig_bampton": (
        lambda o: mp.reduction.reduction_error(o["model"], o["body"], up_to=1.0)
    ),
    "flexible_body: the model must be of type FEModel, not Reduction": (
        lambda o: mp.flexible_body(o["reduction"], o["model"], name="b")
    ),
    "flexible_body: the reduction must be of type Reduction, not str": (
        lambda o: mp.flexible_body(o["model"], "beam", name="b")
    ),
    "check_body: the body must be of type FlexibleBody, not str; make one with flexible_body": (
        lambda o: mp.check_body(o["path"])
    ),
    "check_model: the model must be of type FEModel": lambda o: mp.body.check_model(o["mesh"]),
    "check_buckling: the body must be": lambda o: mp.body.check_buckling(o["model"], o["reduction"]),
    "check_projection: the reduction must be": (
        lambda o: mp.body.check_projection(o["model"], o["body"], o["reduction"])
    ),
    "reroot: the body must be of type FlexibleBody, not System": lambda o: mp.body.reroot(o["system"], "tip"),
    "in_mean_axes: the body must be of type FlexibleBody": lambda o: mp.body.in_mean_axes(o["path"]),
    "write_body: the body must be of type FlexibleBody, not str": lambda o: mp.write_body(o["path"], o["body"]),
    "write_result: the result must be of type Result, not str": lambda o: mp.write_result(o["path"], o["run"]),
    "write_csv: the result must be of type Result, not System": lambda o: mp.formats.write_csv(o["system"], o["path"]),
    "write_state_space: the linear system must be": lambda o: mp.formats.write_state_space(o["system"], o["path"]),
    "System: bodies must be of type Mapping, not list": lambda o: mp.System(bodies=[o["body"]], joints=()),
    "System: body 'a' must be of type FlexibleBody, not Reduction": (
        lambda o: mp.System(bodies={"a": o["reduction"]}, joints=(o["joint"],))
    ),
    "System: joints must be a list or tuple, not Joint": (
        lambda o: mp.System(bodies={"a": o["body"]}, joints=o["joint"])
    ),
    "System: a joint must be of type Joint, not str": lambda o: mp.System(bodies={"a": o["body"]}, joints=("j",)),
    "simulate: the system must be of type System, not FlexibleBody": lambda o: mp.simulate(o["body"], 1.0),
    "simulation t_end = 1 s must be a positive number": lambda o: mp.simulate(o["system"], "1 s"),
    "static_equilibrium: the system must be of type System": lambda o: mp.static_equilibrium(o["body"]),
    "linearise: the system must be of type System": lambda o: mp.linearise(o["run"]),
    "system_modes: the system must be of type System": lambda o: mp.system_modes(o["body"]),
    "inverse_dynamics: the system must be": lambda o: mp.multibody.inverse_dynamics(o["body"], {}, np.arange(2)),
    "spin_modes: the body must be of type FlexibleBody": lambda o: mp.multibody.spin_modes(o["system"], np.ones(3)),
    "impact: the system must be of type System": lambda o: mp.multibody.impact(o["body"], closures=["floor"]),
    "coordinates: the system must be of type System": lambda o: mp.multibody.coordinates(o["body"], np.zeros(2)),
    "Result: the name of a channel must be of type str, not int": lambda o: o["run"][0],
}


@pytest.mark.parametrize("sentence", CALLS)
def test_another_type_gets_a_sentence(sentence, things):
    with pytest.raises(mp.InputError) as caught:
        CALLS[sentence](things)
    assert str(caught.value).startswith(sentence)
    assert "\n" not in str(caught.value)


def test_results_say_which_channels_they_have(things):
    run = things["run"]
    assert "a.tip" in run
    assert "a.tip.x" in run
    assert "a.tip.w" not in run
    assert "b" not in run
    assert 0 not in run
    assert list(run) == ["a.tip"]


def test_what_is_missing_is_named(things):
    with pytest.raises(TypeError, match="flexible_body.. missing 1 required positional argument: 'reduction'"):
        mp.flexible_body(things["model"])
