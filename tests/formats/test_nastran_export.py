"""Nastran superelement: identities, the finite-element model, MSC Nastran's own matrices, and pyYeti as the reader."""

import numpy as np
import pytest
from scipy.linalg import eigh
from shared_data import DATA

import modalprep as mp
from modalprep.body.checks import rigid_mass_matrix
from modalprep.body.frames import at_centre_of_mass, in_mean_axes
from modalprep.examples import cantilever_model, uniform_beam
from modalprep.formats.nastran import superelement, write_dmig, write_output4
from modalprep.reduction.clamped import clamp
from modalprep.vectors import skew


def frequencies(K, M):
    return np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0)) / (2 * np.pi)


@pytest.fixture(scope="module")
def fixed_beam():
    """Beam of 10 elements, both ends kept, no truncation vectors: a plain Craig-Bampton body."""
    model = cantilever_model(tip="fixed")
    return mp.flexible_body(model, mp.craig_bampton(model, modes=6, truncation=()), name="beam", damping=0.02)


@pytest.fixture(scope="module")
def loose_beam():
    """Its tip is no fixed interface, but twelve modes and the answers to tip loads move it every way."""
    return uniform_beam(modes=12, truncation=("interfaces",))


@pytest.fixture(scope="module")
def bodies(fixed_beam, loose_beam, bracket_body):
    """Whose tip is a grid point, and one with three modes, whose tip cannot be one."""
    return {"fixed": fixed_beam, "loose": loose_beam, "bracket": bracket_body, "three modes": uniform_beam(modes=3)}


ALL = ["fixed", "loose", "bracket", "three modes"]


def rigid_motion(body, whole):
    """Coordinates y (k, 6) of the six rigid motions."""
    R = np.zeros((len(whole.K), 6))
    for row, k in enumerate(whole.physical):
        R[6 * row : 6 * row + 3] = np.hstack([np.eye(3), -skew(body.interface_position[k])])
        R[6 * row + 3 : 6 * row + 6, 3:] = np.eye(3)
    return R


@pytest.mark.parametrize("name", ALL)
def test_rigid_motion(bodies, name):
    """No strain force, rigid mass, and every node moves with the root."""
    body = bodies[name]
    whole = superelement(body)
    R = rigid_motion(body, whole)
    assert np.all(np.abs(whole.K @ R) <= 1e-9 * (np.abs(whole.K) @ np.abs(R)).max())  # round-off of G and Z
    mass = rigid_mass_matrix(body.m, body.s0, body.E0)
    np.testing.assert_allclose(R.T @ whole.M @ R, mass, atol=1e-9 * np.abs(mass).max())
    moved = (whole.recovery @ R)[6 * len(body.interface_name) :].reshape(-1, 3, 6)
    np.testing.assert_allclose(moved[:, :, :3], np.broadcast_to(np.eye(3), (len(moved), 3, 3)), atol=1e-9)
    np.testing.assert_allclose(moved[:, :, 3:], -skew(body.points), atol=1e-9 * max(1, np.abs(body.points).max()))


@pytest.mark.parametrize("name", ALL)
def test_clamped_and_free_frequencies_are_those_of_the_body(bodies, name):
    """A change of coordinates: the root held as in the modal file, free as in mean axes (another route)."""
    body = bodies[name]
    whole = superelement(body)
    rtol = 1e-6  # squared frequencies to round-off of the highest, 1e-16 * (1e4 to 1e5)^2
    np.testing.assert_allclose(frequencies(whole.K[6:, 6:], whole.M[6:, 6:]), body.frequency, rtol=rtol)
    free = frequencies(whole.K, whole.M)
    elastic = in_mean_axes(body).frequency
    np.testing.assert_allclose(free[6:], elastic, rtol=rtol)
    assert free[5] < 1e-4 * elastic[0]


def test_free_beam_is_the_closed_form(loose_beam):
    whole = superelement(loose_beam)
    exact = 4.730041**2 / (2 * np.pi) * np.sqrt(1.4e4 / (1.2 * 10.0**4))  # Bernoulli, free-free
    assert frequencies(whole.K, whole.M)[6] == pytest.approx(exact, rel=3e-3)  # shear and rotary inertia


def test_generalised_coordinates_are_the_fixed_interface_modes(fixed_beam):
    """The frequencies that the reduction found on the finite elements with both ends held."""
    whole = superelement(fixed_beam)
    assert whole.physical == (0, 1)
    np.testing.assert_allclose(whole.frequency, fixed_beam.modes.frequency[:6], rtol=1e-8)
    np.testing.assert_allclose(whole.M[12:, 12:], np.eye(6), atol=1e-10)
    stiffness = (2 * np.pi * whole.frequency) ** 2
    np.testing.assert_allclose(whole.K[12:, 12:], np.diag(stiffness), atol=1e-9 * stiffness.max())
    assert np.abs(whole.K[:12, 12:]).max() < 1e-9 * np.abs(whole.K).max()
    np.testing.assert_allclose(whole.recovery[:12], np.eye(12, 18), atol=1e-9)


def test_interface_stiffness_is_the_static_one_of_the_elements(bracket_model, bracket_body):
    """Guyan on the finite elements: Schur complement of all other DOFs, 16 thousand of them."""
    held = clamp(bracket_model)
    T = np.zeros((held.K.shape[0], 12))
    T[held.b], T[held.i] = np.eye(12), held.Psi
    exact = T.T @ (held.K @ T)
    size = np.sqrt(np.diag(exact))
    found = superelement(bracket_body).K[:12, :12]
    assert np.abs((found - exact) / np.outer(size, size)).max() < 1e-7


def test_free_interface_keeps_the_static_answer_to_its_loads(loose_beam):
    """Tip stiffness with the root held: E A / L, and the inverse of L^3 / 3 E I + L / G A."""
    K = superelement(loose_beam).K
    flexibility = np.linalg.inv(K[6:12, 6:12])
    assert flexibility[0, 0] == pytest.approx(10 / 2.8e7, rel=1e-6)
    assert flexibility[1, 1] == pytest.approx(10**3 / (3 * 1.4e4) + 10 / 1e7, rel=1e-6)


def test_too_few_modes_leave_an_interface_to_recovery(tmp_path):
    body = uniform_beam(modes=3)
    whole = superelement(body)
    assert whole.physical == (0,)
    np.testing.assert_array_equal(whole.frequency, body.frequency)
    np.testing.assert_allclose(whole.recovery[6:9, 6:], body.phi[1], rtol=1e-12)
    np.testing.assert_allclose(whole.recovery[9:12, 6:], body.psi[1], rtol=1e-12)
    text = write_dmig(body, tmp_path / "b.dmig").read_text()
    assert "$ interface tip is not a grid point: the modes do not span its six motions" in text


def test_a_mechanism_stays_one(fixed_beam):
    """A modal stiffness of zero: a seventh motion without strain."""
    K = np.array(fixed_beam.K)
    K[0] = 0.0
    whole = superelement(fixed_beam.with_(K=K))
    free = frequencies(whole.K, whole.M)
    assert free[6] < 1e-4 * free[7] < np.inf


def test_damping_follows(fixed_beam):
    whole = superelement(fixed_beam)
    decay = np.linalg.inv(whole.M[6:, 6:]) @ whole.D[6:, 6:]  # similar to diag(2 zeta w)
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(decay).real), np.sort(fixed_beam.D), rtol=1e-6)
    assert np.abs(whole.D @ rigid_motion(fixed_beam, whole)).max() < 1e-9 * np.abs(whole.D).max()


@pytest.mark.skipif(not DATA.is_dir(), reason=f"the deck is not in {DATA} (set MODALPREP_DATA)")
def test_msc_nastran_makes_the_same_superelement(tmp_path):
    """Its kxx and mxx of a frame with four boundary grids and three modes, one grid in axes of its own."""
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    nastran = op4.read(str(DATA / "nastran_cb" / "inboard.op4"))
    mesh = mp.read_mesh(DATA / "nastran_cb" / "inboard.dat", "m", "kg")  # in the deck's own numbers
    ends = {f"grid_{n}": mp.Interface(node=n, kind="node") for n in (3, 11, 19, 27)}
    model = mp.assemble(mesh, {}, ends)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=3, truncation=()), name="frame")
    ours = op4.read(str(write_output4(body, tmp_path / "frame.op4")))
    turn = np.eye(27)
    turn[6:12, 6:12] = np.kron(np.eye(2), [[0, 1, 0], [0, 0, 1], [1, 0, 0]])  # CORD2R 10
    K, M = (turn @ ours[name] @ turn.T for name in ("kaax", "maax"))
    b = slice(0, 24)
    # single precision of the card numbers; consistent mass against COUPMASS (tests/reduction/test_nastran_cb.py)
    assert np.abs(K[b, b] - nastran["kxx"][b, b]).max() < 1e-8 * np.abs(nastran["kxx"]).max()  # seen 2e-10
    assert np.abs(M[b, b] - nastran["mxx"][b, b]).max() < 1e-4 * np.abs(nastran["mxx"]).max()
    np.testing.assert_allclose(np.sqrt(K.diagonal()[24:]), np.sqrt(nastran["kxx"].diagonal()[24:27]), rtol=2e-4)
    coupling = np.abs(M[b, 24:]), np.abs(nastran["mxx"][b, 24:27])
    np.testing.assert_allclose(*coupling, atol=2e-4 * coupling[1].max())  # seen 3e-5


# --- the files ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_output4_in_pyyeti(bodies, name, tmp_path):
    op4 = pytest.importorskip("pyyeti.nastran.op4")
    body = bodies[name]
    whole = superelement(body)
    file = str(write_output4(body, tmp_path / "body.op4"))
    found = op4.read(file)
    expected = {"kaax": whole.K, "maax": whole.M, "baax": whole.D, "phi": whole.recovery}
    if not np.any(body.D):
        del expected["baax"]
    assert list(found) == list(expected)
    for key, matrix in expected.items():
        assert np.array_equal(found[key], matrix), key
    names, _, forms, types = op4.dir(file, verbose=False)
    assert [form for key, form in zip(names, forms, strict=True) if key != "phi"] == [6] * (len(names) - 1)
    assert set(types) == {2}


@pytest.mark.parametrize("name", ALL)
def test_dmig_in_pyyeti(bodies, name, tmp_path):
    bulk = pytest.importorskip("pyyeti.nastran.bulk")
    body = bodies[name]
    whole = superelement(body)
    file = str(write_dmig(body, tmp_path / "body.dmig", first_grid=501))
    grids, spoints, found = bulk.rdgrids(file), bulk.rdspoints(file), bulk.rddmig(file, expanded=True)
    assert grids[:, 0].tolist() == [501 + k for k in range(len(whole.physical))]
    np.testing.assert_allclose(grids[:, 2:5], body.interface_position[list(whole.physical)], rtol=1e-9, atol=1e-15)
    assert np.ravel(spoints).tolist() == [1001 + k for k in range(len(whole.frequency))]
    labels = [(int(g), c) for g in grids[:, 0] for c in range(1, 7)] + [(int(s), 0) for s in np.ravel(spoints)]
    read = {}
    for key, matrix in {"kaax": whole.K, "maax": whole.M}.items():
        read[key] = found[key].reindex(index=labels, columns=labels).fillna(0.0).to_numpy()
        np.testing.assert_allclose(read[key], matrix, rtol=1e-9)  # ten digits
    assert ("baax" in found) == bool(np.any(body.D))
    free = frequencies(read["kaax"], read["maax"])
    np.testing.assert_allclose(free[6:], frequencies(whole.K, whole.M)[6:], rtol=1e-3)
    assert free[5] < 1e-5 * free[-1]


def test_scalar_points_may_come_first(fixed_beam, tmp_path):
    """Nastran sorts by number; the lower triangle must be the lower one of that order."""
    bulk = pytest.importorskip("pyyeti.nastran.bulk")
    file = str(write_dmig(fixed_beam, tmp_path / "b.dmig", first_grid=2001, first_spoint=11))
    kaax = bulk.rddmig(file, expanded=True)["kaax"]
    assert kaax.index[0] == (11, 0)
    np.testing.assert_allclose(kaax.to_numpy(), kaax.to_numpy().T)
    np.testing.assert_allclose(kaax.loc[2001, 2001], superelement(fixed_beam).K[:6, :6], rtol=1e-9)


def test_cards_are_of_nastrans_fields(fixed_beam, tmp_path):
    lines = write_dmig(fixed_beam, tmp_path / "b.dmig").read_text().splitlines()
    assert "DMIG    KAAX           0       6       2       0                      18" in lines
    assert "SPOINT      1001    THRU    1006" in lines
    assert max(len(line) for line in lines if not line.startswith("$")) <= 72
    assert any(line.startswith("$ Case control: K2GG = KAAX, M2GG = MAAX, B2GG = BAAX") for line in lines)
    assert any(line.startswith("$ GRID 2: interface tip") for line in lines)


@pytest.mark.parametrize("write", [write_output4, write_dmig])
def test_refusals(write, fixed_beam, tmp_path):
    rigid = mp.rigid_body("rod", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    with pytest.raises(mp.InputError, match="body 'rod' has no modes to write for Nastran; make it a CONM2"):
        write(rigid, tmp_path / "rod")
    with pytest.raises(mp.InputError, match="has its origin at the centre of mass.*needs reroot"):
        write(at_centre_of_mass(fixed_beam), tmp_path / "beam")
    with pytest.raises(mp.InputError, match="cannot write"):
        write(fixed_beam, "/proc/no/beam")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        (dict(first_grid=1000), "grid points 1000 to 1001 and scalar points 1001 to 1006 overlap; choose another"),
        (dict(first_grid=0), "numbers are 1 to 99999999, not 0 to 1006"),
        (dict(first_spoint=99_999_999), "not 1 to 100000004"),
    ],
)
def test_numbers_are_checked(numbers, message, fixed_beam, tmp_path):
    with pytest.raises(mp.InputError, match=message):
        write_dmig(fixed_beam, tmp_path / "b.dmig", **numbers)
    assert list(tmp_path.iterdir()) == []
