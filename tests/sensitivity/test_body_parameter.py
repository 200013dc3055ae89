"""Derivatives by numbers of the finite-element model of a body."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.body.followed import with_signs
from modalprep.correlation import sensitivities
from modalprep.errors import InputError
from modalprep.fe.mesh.mesh import Mesh
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.sensitivity import body_parameter, last
from modalprep.sensitivity.differences import neighbours

E, IZ, MODES, ELEMENTS = 7e10, 2e-7, 3, 6


def model(modulus, outer=IZ):
    """Return a beam of two halves, the outer one of its own Iz."""
    x = np.linspace(0.0, 10.0, ELEMENTS + 1)
    lines = np.stack([np.arange(ELEMENTS), np.arange(1, ELEMENTS + 1)], axis=1)
    halves = np.split(np.arange(ELEMENTS), 2)
    mesh = Mesh(
        points=np.column_stack([x, 0 * x, 0 * x]),
        cells={"line": lines, "vertex": np.array([[0], [ELEMENTS]])},
        groups={
            "inner": {"line": halves[0]},
            "outer": {"line": halves[1]},
            "root": {"vertex": np.array([0])},
            "tip": {"vertex": np.array([1])},
        },
    )
    sections = {
        name: mp.Beam(material=mp.Material(E=modulus, nu=0.4, rho=3000.0), A=4e-4, Iy=8e-7, Iz=own, J=5e-7)
        for name, own in (("inner", IZ), ("outer", outer))
    }
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    return mp.assemble(mesh, sections, ends)


def reduced(found):
    return mp.flexible_body(found, mp.craig_bampton(found, modes=MODES, truncation=()), name="beam")


def hanging(body):
    spring = HingeElement(stiffness=2000.0, damping=20.0)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=spring)
    return mp.System(bodies={"arm": body}, joints=(hinge,), gravity=(0, -9.81, 0))


def test_a_modulus_acts_by_the_stiffness_of_the_modes():
    """``E dJ/dE = sum_k K_k dJ/dK_k`` where the whole body has it: modes and all else stay, whatever their signs."""

    def again(modulus):
        body = reduced(model(modulus))
        return with_signs(body, np.array([-1.0, 1.0, -1.0])) if modulus > E else body

    system = hanging(again(E))
    names = [f"arm.mode_stiffness.{k + 1}" for k in range(MODES)]
    modulus = body_parameter("modulus", E, "arm", again)
    found = mp.gradient(system, last("arm.tip.position.y"), [modulus, *names], duration=0.02, step=1e-3)
    expected = sum(k * found.derivatives[name] for k, name in zip(system.bodies["arm"].K, names, strict=True))
    assert E * found.derivatives["modulus"] == pytest.approx(expected, rel=1e-7)  # differences of the fourth order


def test_frequencies_follow_as_the_exact_derivative_of_the_model_says():
    """Of a half of the beam, whose section changes the shapes of the modes too."""
    section = body_parameter("Iz of outer", IZ, "arm", lambda value: reduced(model(E, value)))
    beside = neighbours(hanging(reduced(model(E))), section)
    found = beside.derivative([each.bodies["arm"].K for each in beside.systems])
    exact = sensitivities(model(E), modes=MODES, kinds=["Iz"])
    column = [p.name for p in exact.parameters].index("Iz of outer")
    K = (2 * np.pi * exact.frequency) ** 2
    assert IZ * found / K == pytest.approx(2 * exact.relative[:, column], rel=1e-8, abs=1e-8)


def test_modes_that_are_not_those_of_before_are_refused():
    start = hanging(reduced(model(E)))
    for other, sentence in ((model(E, IZ / 100), "of body 'beam' is not the one"), (None, "has 2 modes")):

        def again(value, other=other):
            if other is not None:
                return reduced(other)
            found = model(E)
            return mp.flexible_body(found, mp.craig_bampton(found, modes=2, truncation=()), name="beam")

        with pytest.raises(InputError, match=sentence):
            body_parameter("modulus", E, "arm", again).change(start, E)
