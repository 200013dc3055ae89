"""Sensors in other axes, units and places than the nodes of the model: read, mapped, or refused with advice."""

import numpy as np
import pytest
import pyuff
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.cli import main
from modalprep.correlation import ModeSet, body_modes, choose_sensors, correlate, expand, read_test_modes
from modalprep.examples import uniform_beam

DIGITS = 5e-6  # half a unit of the last of six digits, as a universal file has them
TURN = Rotation.from_rotvec([0.3, -0.7, 0.4]).as_matrix()


@pytest.fixture(scope="module")
def modes():
    """The beam's modes with a shape that is not the same in y and z, at points around the axis."""
    modes = body_modes(uniform_beam(modes=5))
    modes = modes.with_(points=modes.points[1:], shape=modes.shape[1:], labels=modes.labels[1:])  # the root is at rest
    angle = np.linspace(0, 5, len(modes.points))
    around = 0.3 * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    return modes.with_(points=modes.points + around, shape=modes.shape @ np.triu(np.ones((5, 5))))


def written(path, modes, axes, numbers, systems, kind=15, defined=None):
    """Write modes whose components are along axes (p, 3, 3) of systems with these numbers at the nodes."""
    labels = 100 + np.arange(len(modes.points))
    prepare = pyuff.prepare_15 if kind == 15 else pyuff.prepare_2411
    nodes = prepare(
        node_nums=labels.tolist() if kind == 15 else labels, def_cs=np.full(len(labels), defined or 0).tolist(),
        disp_cs=np.asarray(numbers).tolist(), color=[1] * len(labels),
        **dict(zip("xyz", modes.points.T, strict=True)),
    ) if kind == 15 else {
        "type": 2411, "node_nums": labels, "def_cs": np.zeros(len(labels), int), "disp_cs": np.asarray(numbers),
        "color": np.ones(len(labels), int), **dict(zip("xyz", modes.points.T, strict=True)),
    }  # fmt: skip
    sets = [nodes]
    if systems:
        sets.append({
            "type": 2420, "Part_UID": 1, "Part_Name": "part", "CS_sys_labels": [s[0] for s in systems],
            "CS_types": [s[1] for s in systems], "CS_colors": [8] * len(systems),
            "CS_names": [f"CS{s[0]}" for s in systems], "CS_matrices": [s[2] for s in systems],
        })  # fmt: skip
    local = np.einsum("pab,pbn->pan", axes, modes.shape)
    for k in range(modes.n):
        shape = pyuff.prepare_55(
            model_type=1, id1="", id2="", id3="", id4="", id5="", analysis_type=2, data_ch=2, spec_data_type=8,
            data_type=2, r1=local[:, 0, k], r2=local[:, 1, k], r3=local[:, 2, k], n_data_per_node=3,
            node_nums=labels, load_case=1, mode_n=k + 1, modal_m=0, freq=modes.frequency[k], modal_damp_vis=0.0,
            modal_damp_his=0.0,
        )  # fmt: skip
        sets.append({key: value for key, value in shape.items() if value is not None})
    pyuff.UFF(str(path)).write_sets(sets, "overwrite")
    return path


def cylinder(points):
    """Directions (p, 3, 3) of r, theta, z at points, of a cylinder about the x axis: its z is x, its x is y."""
    e = points[:, 1:] / np.linalg.norm(points[:, 1:], axis=1, keepdims=True)
    zero = np.zeros(len(points))
    radial, tangent = np.stack([zero, *e.T], axis=1), np.stack([zero, -e[:, 1], e[:, 0]], axis=1)
    return np.stack([radial, tangent, np.tile([1.0, 0, 0], (len(points), 1))], axis=1)


ABOUT_X = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 0, 0]])
TILTED = np.concatenate([TURN, np.zeros((1, 3))])


@pytest.mark.parametrize("kind", [15, 2411])
def test_components_along_axes_of_their_own(modes, tmp_path, kind):
    """A third of the nodes in a tilted Cartesian system, a third in a cylindrical one, the rest in that of the file."""
    number = np.array([0, 7, 8])[np.arange(len(modes.points)) % 3]
    axes = np.where((number == 7)[:, None, None], TURN, np.eye(3))
    axes = np.where((number == 8)[:, None, None], cylinder(modes.points), axes)
    path = written(tmp_path / "test.uff", modes, axes, number, [(7, 0, TILTED), (8, 1, ABOUT_X)], kind)
    found = correlate(read_test_modes(path), modes)
    np.testing.assert_allclose(found.pair_mac, 1.0, rtol=DIGITS)
    np.testing.assert_allclose(
        np.nan_to_num(found.test.vectors), modes.shape, atol=10 * DIGITS * np.abs(modes.shape).max()
    )
    assert any("sensors measure along axes" in note for note in found.notes)
    assert correlate(read_test_modes(path).with_(axes=None), modes).pair_mac.min() < 0.99  # the axes matter


def test_single_components_along_axes_of_their_own(modes, tmp_path):
    """The radial component alone, whose direction changes along the beam: enough for the whole shapes."""
    axes, eyes = cylinder(modes.points), np.tile(np.eye(3), (len(modes.points), 1, 1))
    along = np.where([[[1], [0], [0]]], np.einsum("pab,pbn->pan", axes, modes.shape), 0.0)
    systems = [(8, 1, ABOUT_X)]
    path = written(tmp_path / "test.uff", modes.with_(shape=along), eyes, np.full(len(modes.points), 8), systems)
    test = read_test_modes(path)
    np.testing.assert_array_equal(test.measured, [[True, False, False]] * len(test.points))
    found = correlate(test, modes)
    np.testing.assert_allclose(found.pair_mac, 1.0, rtol=DIGITS)
    whole = expand(found.test, found.node, modes)
    np.testing.assert_allclose(whole.shape, modes.shape, atol=1e-3 * np.abs(modes.shape).max())  # of six digits


def test_nodes_of_dataset_15_in_a_system_of_their_own(modes, tmp_path):
    placed = modes.with_(points=(modes.points - [1.0, 2, 3]) @ TURN.T)
    axes = np.tile(np.eye(3), (len(modes.points), 1, 1))
    system = np.concatenate([TURN, [[1.0, 2, 3]]])
    path = written(tmp_path / "test.uff", placed, axes, np.zeros(len(modes.points), int), [(4, 0, system)], defined=4)
    np.testing.assert_allclose(read_test_modes(path).points, modes.points, atol=1e-4)  # of five digits


@pytest.mark.parametrize(
    ("number", "systems", "said"),
    [
        (9, [], "node 100 are those of coordinate system 9, which the file does not define"),
        (7, [(7, 2, TILTED)], "node 100 are those of the spherical system 7"),
        (7, [(7, 0, 2 * TILTED)], r"coordinate system 7 (dataset 2420) is no rotation"),
    ],
)
def test_systems_that_cannot_be_read_are_refused(modes, tmp_path, capsys, number, systems, said):
    axes = np.tile(np.eye(3), (len(modes.points), 1, 1))
    path = written(tmp_path / "test.uff", modes, axes, np.full(len(modes.points), number), systems)
    body = mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")
    assert main(["compare", str(body), str(path)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1


def test_a_turned_test_is_compared_in_the_axes_of_the_body(modes):
    turned = modes.with_(points=modes.points @ TURN + [1.0, 0, 2], shape=np.einsum("ba,pbn->pan", TURN, modes.shape))
    found = correlate(turned, modes, origin=(1.0, 0, 2), rotation=TURN)
    assert found.distance.max() < 1e-12
    np.testing.assert_allclose(found.pair_mac, 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.test.vectors, modes.shape, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda x: 1e3 * x, "lengths in mm would fit; give the unit of length"),
        (lambda x: 1e-3 * x - [0, 0, 4.0], "give the unit of length, or the origin or the axes"),
        (
            lambda x: x @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
            "the axes of the body would fit as y,-x,z of the test",
        ),
    ],
)
def test_what_would_fit_is_said(modes, change, said):
    with pytest.raises(mp.InputError, match=said):
        correlate(modes.with_(points=change(modes.points)), modes)


def test_the_axes_that_are_advised_fit(modes, tmp_path, capsys):
    """The command with the axes of the message."""
    R = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    beam = uniform_beam(modes=3)
    own = body_modes(beam)
    turned = own.with_(points=own.points @ R, shape=np.einsum("ba,pbn->pan", R, own.shape))
    axes = np.tile(np.eye(3), (len(own.points), 1, 1))
    path = written(tmp_path / "test.uff", turned, axes, np.zeros(len(own.points), int), [])
    body = mp.write_body(beam, tmp_path / "beam.h5")
    assert main(["compare", str(body), str(path), "--axes", "y,-x,z", "-o", str(tmp_path / "a.png")]) == 0
    assert "1.000" in capsys.readouterr().out
    for axes, said in (("y,x,z", "left-handed"), ("x,x,z", "are not three of x, y, z"), ("a,b,c", "are not three")):
        assert main(["compare", str(body), str(path), "--axes", axes]) == 2
        assert said in capsys.readouterr().err
    assert main(["compare", str(body), str(path), "--axes", "y,-x,z", "--tolerance", "-1"]) == 2
    assert "tolerance = -1 m must be a length" in capsys.readouterr().err


def test_sensors_beside_their_points_are_named(modes):
    """Within the tolerance; two sensors on one point are said."""
    sensors = modes.with_(points=modes.points + np.array([0.02, 0, 0])).with_(
        labels=np.arange(500, 500 + len(modes.points))
    )
    found = correlate(sensors, modes, tolerance=0.05)
    assert "the largest distance of a sensor from its point is 0.02 m" in found.notes
    with pytest.raises(mp.InputError, match="lies 0.02 m from the nearest point"):
        correlate(sensors, modes, tolerance=0.01)
    pair = ModeSet(
        name="pair", points=modes.points[[3, 3, 9]], shape=modes.shape[[3, 3, 9]], frequency=modes.frequency,
        damping=modes.damping, labels=np.array([11, 12, 13]), lines=np.zeros((0, 2), dtype=int),
    )  # fmt: skip
    assert "sensors 11 and 12 have the same nearest point" in correlate(pair, modes).notes
    assert choose_sensors(modes, 6).sum() == 6


def test_a_written_test_is_read_again(modes, tmp_path):
    """Axes of their own, missing components, trace lines and damping go through the file."""
    axes = np.where((np.arange(len(modes.points)) % 2 == 0)[:, None, None], TURN, np.eye(3))
    known = choose_sensors(modes, 30)
    shape = np.where(known[:, :, None], np.einsum("pab,pbn->pan", axes, modes.shape), np.nan)
    some = known.any(axis=1)
    test = modes.with_(
        points=modes.points[some], shape=shape[some], labels=10 + np.flatnonzero(some), axes=axes[some],
        damping=np.full(5, 0.013), lines=np.array([[0, 1], [1, 3]]),
    )  # fmt: skip
    found = read_test_modes(mp.correlation.write_test_modes(test, tmp_path / "test.uff"))
    np.testing.assert_array_equal(found.measured, test.measured)
    np.testing.assert_array_equal(found.labels, test.labels)
    np.testing.assert_array_equal(found.lines, test.lines)
    np.testing.assert_allclose(found.axes, test.axes, atol=1e-12)
    np.testing.assert_allclose(found.shape, test.shape, atol=DIGITS * np.nanmax(np.abs(test.shape)))
    np.testing.assert_allclose(found.damping, 0.013, rtol=DIGITS)
    with pytest.raises(mp.InputError, match="two sensors have one number"):
        mp.correlation.write_test_modes(test.with_(labels=np.ones_like(test.labels)), tmp_path / "b.uff")
    with pytest.raises(mp.InputError, match="complex modes are not written"):
        mp.correlation.write_test_modes(test.with_(shape=1j * test.shape), tmp_path / "b.uff")


def test_synthetic_test_of_the_command(tmp_path, capsys):
    """Twelve sensors with noise of 1 %: read back and compared by the commands, all pairs are found."""
    body = mp.write_body(uniform_beam(modes=4), tmp_path / "beam.h5")
    target = tmp_path / "test.uff"
    assert main(["export", str(body), "--to", "uff", "--sensors", "12", "--noise", "0.01", "-o", str(target)]) == 0
    assert "sensors (node of the file" in capsys.readouterr().out
    found = correlate(read_test_modes(target), body_modes(uniform_beam(modes=4)))
    assert found.test.measured.sum() == 12
    assert found.pair_mac.min() > 0.99
    for options, said in (
        (["--to", "vtu", "--sensors", "9"], "with --to uff"),
        (["--to", "uff", "--noise", "0.1"], "give --sensors with it"),
        (["--to", "uff", "--sensors", "2"], "2 sensors: give from 4"),
        (["--to", "uff", "--sensors", "9", "--noise", "-1"], "must not be negative"),
    ):
        assert main(["export", str(body), *options, "-o", str(tmp_path / "other.uff")]) == 2
        assert said in capsys.readouterr().err
    assert not (tmp_path / "other.uff").exists()
