"""What the viewer gets: the surface in place, shapes to scale, nothing larger than the limits; and the MAC."""

import base64

import numpy as np
import pytest

import modalprep as mp
from modalprep.report.mac import SHOWN, auto_mac, mac_chart
from modalprep.report.scene.motion import largest_displacement, unseen_modes
from modalprep.report.viewer.still import FULL, drawable, scene_data


def decoded(text, kind):
    return np.frombuffer(base64.b64decode(text), dtype=kind)


@pytest.mark.parametrize("name", ["cantilever", "block", "frame"])
def test_points_and_shapes_can_be_read_back(name, request):
    body = request.getfixturevalue(name)
    data = scene_data(body)
    size = np.linalg.norm(np.ptp(body.points, axis=0))
    points = decoded(data["points"], "<f4").reshape(-1, 3)
    used = np.unique(np.concatenate([nodes.ravel() for kind, nodes in body.cells.items() if kind != "vertex"]))
    if name != "block":  # its inner nodes are not on the surface
        middle = (body.points.max(axis=0) + body.points.min(axis=0)) / 2
        expected = np.concatenate([body.points[used], body.interface_position])
        np.testing.assert_allclose(points * size + middle, expected, atol=1e-6 * size)
    for k, mode in enumerate(data["modes"]):
        shape = decoded(mode["shape"], "<i2").reshape(-1, 3) / FULL
        assert np.linalg.norm(shape, axis=1).max() == pytest.approx(1.0, abs=1e-4)
        largest = largest_displacement(body.shape)[k]
        np.testing.assert_allclose(shape[-len(body.interface_name) :] * largest, body.phi[:, :, k], atol=1e-4 * largest)
    for part, sides in (("triangles", 3), ("edges", 2), ("outline", 2), ("lines", 2)):
        rows = decoded(data[part], "<u4").reshape(-1, sides)
        assert rows.size == 0 or rows.max() < len(points) - len(body.interface_name)


def test_large_bodies_stay_small_and_are_reported(block):
    data = scene_data(block, triangles=100, shape_bytes=1)
    assert 0 < data["counts"][0] <= 100
    whole = scene_data(block)["counts"][0]
    assert f"drawn with {data['counts'][0]} of its {whole} triangles" in data["notes"][0]
    assert "holds modes 1 to 1 of 2" in data["notes"][1]
    assert len(data["modes"]) == 1
    corners = scene_data(block, triangles=whole - 1)  # the corner nodes are enough of a saving
    assert corners["counts"][0] == whole / 4
    assert scene_data(block)["notes"] == []


def test_noise_of_a_mode_with_rotations_only_is_not_enlarged(cantilever):
    shape = cantilever.shape.copy()
    shape[:, :, 2] *= 1e-12
    body = cantilever.with_(shape=shape)
    assert unseen_modes(shape) == [3]
    assert not decoded(scene_data(body)["modes"][2]["shape"], "<i2").any()
    assert auto_mac(shape)[2].tolist() == [0] * 5
    assert auto_mac(shape)[0, 0] == pytest.approx(1)


def test_body_that_cannot_be_drawn_has_a_reason(cantilever):
    assert drawable(cantilever.with_(cells={"polygon": np.array([[0, 1, 2]])}))[0] is None
    none = np.zeros(0)
    rigid = cantilever.with_(K=none, D=none, frequency=none, shape=np.zeros((21, 3, 0)))
    assert drawable(rigid) == (None, "")


def test_mac_is_that_of_the_definition():
    rng = np.random.default_rng(1)
    shape, mass = rng.normal(size=(7, 3, 4)), rng.uniform(1, 2, 7)
    for weight in (None, mass):
        w = np.ones(7) if weight is None else weight
        a, b = shape[:, :, 1], shape[:, :, 3]
        dot = lambda u, v: (w[:, None] * u * v).sum()  # noqa: E731, B023
        mac = auto_mac(shape, weight)
        assert mac[1, 3] == pytest.approx(dot(a, b) ** 2 / dot(a, a) / dot(b, b))
        np.testing.assert_allclose(np.diag(mac), 1)
        np.testing.assert_allclose(mac, mac.T)


@pytest.mark.parametrize("mass", [np.ones(3), -np.ones(7)])
def test_wrong_masses_are_refused(mass):
    with pytest.raises(mp.InputError, match="one mass >= 0 for each of the 7 nodes"):
        auto_mac(np.ones((7, 3, 2)), mass)


def test_chart_of_many_modes_is_cut_and_names_the_largest_mac(cantilever):
    rng = np.random.default_rng(2)
    shape = rng.normal(size=(21, 3, 70))
    shape[:, :, 8] = shape[:, :, 4] + 0.1 * shape[:, :, 8]
    body = cantilever.with_(shape=shape, K=np.ones(70), frequency=np.ones(70))
    chart = mac_chart(body)
    assert (chart["count"], chart["of"]) == (SHOWN, 70)
    assert chart["largest"][0][:2] == (5, 9)
    assert mac_chart(cantilever.with_(shape=shape[:, :, :1], K=np.ones(1), frequency=np.ones(1))) is None
