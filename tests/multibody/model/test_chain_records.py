"""Chains and beams of segments as records: the same system as from a file, and closed forms."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.multibody import Chain, SegmentedBeam
from modalprep.multibody.model.chain import AXES
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system

G = 9.81


def rod(length, mass):
    ends = {"root": np.zeros(3), "tip": np.array([length, 0, 0])}
    across = mass * length**2 / 12
    return mp.rigid_body(
        "rod", mass=mass, centre=ends["tip"] / 2, inertia=np.diag([0, across, across]), interfaces=ends
    )


def hanging(length, mass, count, *axes):
    """A chain that hangs along x."""
    hinges = tuple(mp.Joint(name="", type="revolute", parent="", child="", axis=axis) for axis in axes)
    chain = Chain(name="link", segment=rod(length, mass), count=count, joint=hinges)
    return mp.System(bodies=chain.bodies, joints=chain.joints, gravity=np.array([G, 0, 0]))


def frequencies(system):
    return np.sort(mp.system_modes(system).frequency)


def test_alternating_axes_make_two_plane_chains():
    """About z every second joint turns: pairs of rods move as rods of twice the length; about y the same, one later.

    The first rod then stands, and the last one is single: a chain whose last rod is half as long.
    """
    pairs = frequencies(hanging(0.4, 0.2, 3, AXES[0]))
    double, single = rod(0.4, 0.2), rod(0.2, 0.1)
    chain = Chain(name="link", segment=double, count=2, joint=mp.Joint(name="", type="revolute", parent="", child=""))
    last = mp.Joint(name="last", type="revolute", parent="link2.tip", child="last")
    bodies = chain.bodies | {"last": single}
    shifted = frequencies(mp.System(bodies=bodies, joints=(*chain.joints, last), gravity=np.array([G, 0, 0])))
    found = frequencies(hanging(0.2, 0.1, 6, AXES[0], AXES[1]))
    np.testing.assert_allclose(found, np.sort(np.concatenate([pairs, shifted])), rtol=1e-8)


def test_the_first_joint_may_be_another():
    hinge = mp.Joint(name="", type="revolute", parent="", child="")
    weld = mp.Joint(name="x", type="weld", parent="y", child="z")
    chain = Chain(
        name="c", segment=rod(1.0, 1.0), count=3, joint=hinge, first=weld, parent="ship.winch", through="root"
    )
    assert [joint.type for joint in chain.joints] == ["weld", "revolute", "revolute"]
    assert [(joint.name, joint.parent, joint.child) for joint in chain.joints] == [
        ("c1", "ship.winch", "c1"), ("c2", "c1.root", "c2"), ("c3", "c2.root", "c3"),
    ]  # fmt: skip


def test_a_chain_needs_links():
    hinge = mp.Joint(name="", type="revolute", parent="", child="")
    with pytest.raises(mp.InputError, match="chain 'c' needs at least one segment"):
        Chain(name="c", segment=rod(1.0, 1.0), count=0, joint=hinge)


def test_cantilever_frequencies_converge_with_order_two():
    """First bending frequency of a clamped beam: 1.8751^2 sqrt(EI / m L^4)."""
    exact = 1.8751040687119611**2 * np.sqrt(140.0 / 1.2 / 10.0**4) / (2 * np.pi)
    error = []
    for n in (10, 20):
        beam = SegmentedBeam(name="beam", length=10.0, segments=n, mass_per_length=1.2, EI=140.0)
        error.append(abs(frequencies(mp.System(bodies=beam.bodies, joints=beam.joints))[0] / exact - 1))
    assert error[1] < 2e-3
    assert error[0] / error[1] == pytest.approx(4, rel=0.1)  # order two


BEAMS = {
    "plane": "EI = 140.0\ncurvature = 0.1\ndamping = 0.01",
    "space": "EI = [140.0, 90.0]\nrotary_inertia = [0.1, 0.2, 0.3]",
    "twist": "EI = [140.0, 90.0]\nGJ = 30.0\ncurvature = 0.2",
    "stretch": "EI = 140.0\nEA = 1e4\nGA = 2e4",
}


@pytest.mark.parametrize("kind", BEAMS)
def test_the_record_is_the_table(kind, tmp_path):
    """A file and Python give the same bodies and joints."""
    import tomllib

    text = f"length = 3.0\nsegments = 4\nmass_per_length = 1.5\n{BEAMS[kind]}\n"
    path = tmp_path / "beam.toml"
    path.write_text(f"[beams.spar]\n{text}[simulation]\nt_end = 1.0\n")
    read = read_system(load(path), None, Reporter(quiet=True))
    beam = SegmentedBeam(name="spar", **tomllib.loads(text))
    assert list(read.bodies) == list(beam.bodies)
    for name, body in beam.bodies.items():
        for key in ("m", "s0", "E0", "interface_position"):
            np.testing.assert_allclose(getattr(read.bodies[name], key), getattr(body, key), rtol=1e-14, err_msg=key)
    for ours, theirs in zip(beam.joints, read.joints, strict=True):
        assert (ours.name, ours.type, ours.parent, ours.child) == (
            theirs.name,
            theirs.type,
            theirs.parent,
            theirs.child,
        )
        assert np.array_equal(ours.axis, theirs.axis)
        assert np.array_equal(ours.angle, theirs.angle)
        assert repr(ours.elements) == repr(theirs.elements)


def test_files_take_joints_in_turn(tmp_path):
    path = tmp_path / "chain.toml"
    path.write_text(
        "[chains.rope]\ncount = 5\nsegment = { mass = 1.0, interfaces = { root = [0, 0, 0], tip = [1, 0, 0] } }\n"
        'joint = [{ type = "revolute" }, { type = "revolute", axis = [0, 1, 0] }]\n[simulation]\nt_end = 1.0\n'
    )
    system = read_system(load(path), None, Reporter(quiet=True))
    assert [joint.axis.tolist() for joint in system.joints] == [AXES[k % 2].tolist() for k in range(5)]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"GJ": 1.0}, "GJ twists the beam out of its plane"),
        ({"EA": 1.0}, "EA and GA go together"),
        ({"EI": (1.0, 2.0), "EA": 1.0, "GA": 1.0}, "EA and GA go together"),
        ({"EI": -1.0}, "must be positive"),
        ({"length": 0.0}, "must be positive"),
        ({"EI": (1.0, 2.0, 3.0)}, "must be positive"),
    ],
)
def test_beams_that_cannot_be(changes, said):
    given = {"name": "spar", "length": 1.0, "segments": 2, "mass_per_length": 1.0, "EI": 1.0} | changes
    with pytest.raises(mp.InputError, match=f"beam 'spar': .*{said}"):
        SegmentedBeam(**given)
