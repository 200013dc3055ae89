"""Modes against those of a test: criteria, pairs, files, sensors, expansion, and modes followed through a study."""

import numpy as np
import pytest
import pyuff
from size import cases

import modalprep as mp
from modalprep.cli import main
from modalprep.correlation import (
    body_modes,
    choose_sensors,
    comac,
    correlate,
    cross_orthogonality,
    expand,
    mac,
    read_test_modes,
    synthetic_test,
    track_modes,
)
from modalprep.examples import uniform_beam
from modalprep.formats.uff import write_uff

NORMAL_MODE, COMPLEX_MODE, SINGLE, SINGLE_COMPLEX = 2, 3, 2, 5  # codes of dataset 2414
DIGITS = 5e-6  # half a unit of the last of six digits, as a universal file has them


def random_shapes(d, n, seed=1):
    random = np.random.default_rng(seed)
    return random.standard_normal((d, n)) + 1j * random.standard_normal((d, n))


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=6)


@pytest.mark.filterwarnings("ignore:Casting complex values")  # in pyEMA
def test_mac_is_that_of_another_program():
    MAC = pytest.importorskip("pyEMA.tools").MAC
    a, b = random_shapes(12, 5), random_shapes(12, 4, seed=2)
    np.testing.assert_allclose(mac(a, b), MAC(a, b), atol=1e-13)
    np.testing.assert_allclose(mac(a.real, b.real), MAC(a.real, b.real), atol=1e-13)


def test_mac_of_a_mode_at_rest_is_zero():
    assert mac(np.zeros((3, 1)), np.ones((3, 1)))[0, 0] == 0


def test_cross_orthogonality_gives_the_coefficients_of_mixed_modes():
    """Test modes made of analysis modes, ``T = A C``: the columns of C, brought to unit length."""
    A, C = random_shapes(20, 4).real, random_shapes(4, 4, seed=3).real
    expected = (C / np.linalg.norm(C, axis=0)).T
    np.testing.assert_allclose(cross_orthogonality(A @ C, A), expected, atol=1e-12)


def test_cross_orthogonality_is_that_of_the_mass_matrix():
    """With all components measured and modes in the span, the reduced mass is as good as that of the model."""
    random = np.random.default_rng(5)
    M = random.standard_normal((9, 9))
    M = M @ M.T + np.eye(9)
    A = np.linalg.solve(np.linalg.cholesky(M).T, np.linalg.qr(random.standard_normal((9, 4)))[0])
    T = A @ random.standard_normal((4, 3))
    T = T / np.sqrt(np.diag(T.T @ M @ T))
    np.testing.assert_allclose(cross_orthogonality(T, A), T.T @ M @ A, atol=1e-10)  # condition of M about 100


def test_too_few_sensors_are_refused():
    with pytest.raises(mp.InputError, match="3 measured components cannot tell 4 modes apart"):
        cross_orthogonality(np.ones((3, 4)), np.ones((3, 4)))


def test_comac_finds_the_wrong_component():
    a = random_shapes(8, 5).real
    b = -3 * a
    b[2] = -b[2] * np.array([1, -1, 1, -1, 1])
    found = comac(a, b)
    assert found.argmin() == 2
    # |sum |a b||^2 is blind to signs: a sign that is wrong in all modes is no disagreement of COMAC
    np.testing.assert_allclose(comac(a, -3 * a), 1.0, rtol=1e-12)


@pytest.fixture(scope="module")
def files(beam, tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare")
    return mp.write_body(beam, folder / "beam.h5"), write_uff(beam, folder / "test.uff")


def test_a_body_agrees_with_its_own_universal_file(beam, files):
    found = correlate(read_test_modes(files[1]), body_modes(beam))
    np.testing.assert_array_equal(found.pairs, np.repeat(np.arange(6)[:, None], 2, axis=1))
    np.testing.assert_allclose(found.pair_mac, 1.0, rtol=DIGITS)
    np.testing.assert_allclose(np.abs(found.cross_orthogonality), np.eye(6), atol=10 * DIGITS)
    np.testing.assert_allclose(found.frequency_difference, 0.0, atol=DIGITS)
    assert np.nanmin(found.comac) > 1 - DIGITS


def test_the_file_is_read_in_its_unit_of_length(beam, files, tmp_path):
    sets = pyuff.UFF(str(files[1])).read_sets()
    millimetres = [
        s | {"x": 1e3 * s["x"], "y": 1e3 * s["y"], "z": 1e3 * s["z"]} if s["type"] == 2411 else s for s in sets
    ]
    millimetres = [s | {"length": 1e3} if s["type"] == 164 else s for s in millimetres if s["type"] != 2412]
    pyuff.UFF(str(tmp_path / "mm.uff")).write_sets(millimetres, "overwrite")
    np.testing.assert_allclose(read_test_modes(tmp_path / "mm.uff").points, beam.points[1:], atol=1e-12)
    np.testing.assert_allclose(
        read_test_modes(tmp_path / "mm.uff", length=1.0).points, 1e3 * beam.points[1:], atol=1e-9
    )


def test_complex_modes(beam, tmp_path):
    """Shapes turned by a phase, with poles of 2 % damping: the same modes, and their damping."""
    modes = body_modes(beam)
    write_complex(tmp_path / "complex.uff", modes, phase=0.7, damping=0.02)
    test = read_test_modes(tmp_path / "complex.uff")
    assert np.iscomplexobj(test.shape)
    np.testing.assert_allclose(test.damping, 0.02, rtol=DIGITS)
    np.testing.assert_allclose(test.frequency, modes.frequency, rtol=DIGITS)
    found = correlate(test, modes)
    np.testing.assert_allclose(found.pair_mac, 1.0, rtol=DIGITS)
    assert any("complex" in note for note in found.notes)


def write_2414(path, modes, pole=None):
    """Modes as NX and Permas write them: dataset 2414 by its published records; complex ones with their poles."""
    kind, data = (NORMAL_MODE, SINGLE) if pole is None else (COMPLEX_MODE, SINGLE_COMPLEX)
    numbers = lambda values: "".join(f"{v:13.5E}" for v in values)  # noqa: E731
    lines = ["    -1", "  2411"]
    for label, x in zip(modes.labels, modes.points, strict=True):
        lines += [f"{label:10d}{1:10d}{1:10d}{1:10d}", "".join(f"{v:25.16E}" for v in x).replace("E", "D")]
    lines += ["    -1"]
    for k in range(modes.n):
        f = modes.frequency[k]
        s = [0.0, 0.0] if pole is None else [2 * np.pi * f * pole.real, 2 * np.pi * f * pole.imag]
        lines += ["    -1", "  2414", f"{k + 1:10d}", f"mode {k + 1}", f"{1:10d}", *["NONE"] * 5]
        lines += ["".join(f"{v:10d}" for v in (1, kind, 2, 8, data, 3))]
        lines += [f"{1:10d}" * 8, f"{0:10d}" * 2, numbers([0.0, f, 0.0, 1.0, 0.01, 0.0]), numbers([*s, 0, 0, 0, 0])]
        for label, u in zip(modes.labels, modes.shape[:, :, k], strict=True):
            turned = u if pole is None else np.array([u * np.cos(0.7), u * np.sin(0.7)]).T.ravel()
            lines += [f"{label:10d}", numbers(turned)]
        lines += ["    -1"]
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize(("pole", "damping"), [(None, 0.01), (-0.02 + 1j * np.sqrt(1 - 0.02**2), 0.02)])
def test_modes_of_dataset_2414(beam, tmp_path, pole, damping):
    modes = body_modes(beam)
    write_2414(tmp_path / "modes.unv", modes, pole)
    test = read_test_modes(tmp_path / "modes.unv")
    np.testing.assert_allclose(test.frequency, modes.frequency, rtol=DIGITS)
    np.testing.assert_allclose(test.damping, damping, rtol=DIGITS)
    np.testing.assert_allclose(correlate(test, modes).pair_mac, 1.0, rtol=DIGITS)


def test_stresses_of_dataset_2414_are_no_modes(beam, tmp_path):
    write_2414(tmp_path / "modes.unv", body_modes(beam))
    mode, tensor = (f"{1:10d}{2:10d}{c:10d}" for c in (2, 4))
    (tmp_path / "modes.unv").write_text((tmp_path / "modes.unv").read_text().replace(mode, tensor))
    with pytest.raises(mp.InputError, match="no mode shapes .dataset 55 or 2414"):
        read_test_modes(tmp_path / "modes.unv")


def write_complex(path, modes, phase, damping):
    labels = modes.labels
    nodes = pyuff.prepare_15(
        node_nums=labels.tolist(), def_cs=[0] * len(labels), disp_cs=[0] * len(labels), color=[0] * len(labels),
        x=modes.points[:, 0], y=modes.points[:, 1], z=modes.points[:, 2],
    )  # fmt: skip
    sets = [nodes]
    for k in range(modes.n):
        u = modes.shape[:, :, k] * np.exp(1j * phase)
        omega = 2 * np.pi * modes.frequency[k]
        pole = omega * (-damping + 1j * np.sqrt(1 - damping**2))
        sets.append({
            "type": 55, "id1": "", "id2": "", "id3": "", "id4": "", "id5": "", "model_type": 1, "analysis_type": 3,
            "data_ch": 2, "spec_data_type": 8, "data_type": 5, "n_data_per_node": 3, "load_case": 1, "mode_n": k + 1,
            "eig": pole, "modal_a": 1.0 + 0j, "modal_b": 1.0 + 0j, "node_nums": labels,
            "r1": u[:, 0], "r2": u[:, 1], "r3": u[:, 2],
        })  # fmt: skip
    pyuff.UFF(str(path)).write_sets(sets, "overwrite")


def test_a_test_of_some_modes(beam):
    """Noise of 1 % at three sensors for each mode: the paired modes alone make the mass at the sensors."""
    modes = body_modes(beam)
    sensors = choose_sensors(modes.select(np.arange(3)), 9)
    found = correlate(synthetic_test(modes.select(np.array([2, 0, 1])), sensors, noise=0.01), modes)
    np.testing.assert_array_equal(found.pairs, [[0, 2], [1, 0], [2, 1]])
    cross = np.abs(found.cross_orthogonality)
    np.testing.assert_allclose(cross[:, :3], np.eye(3)[[2, 0, 1]], atol=0.05)
    assert np.isnan(cross[:, 3:]).all()


def test_sensors_in_other_axes_of_the_place(beam):
    modes = body_modes(beam)
    moved = modes.with_(points=modes.points + np.array([5.0, 0, 0]))
    with pytest.raises(mp.InputError, match=r"sensor 41 of beam lies 5 m from the nearest point of beam"):
        correlate(moved, modes)
    assert correlate(moved, modes, origin=(5, 0, 0)).distance.max() < 1e-12


def test_free_modes_are_those_of_the_floating_beam():
    """Free-free bending, (4.7300 / L)^2 sqrt(EI / m'), against the clamped beam's (1.8751 / L)^2: shear left out."""
    beam = uniform_beam(modes=24)
    ratio = body_modes(beam, "free").frequency[0] / body_modes(beam).frequency[0]
    assert ratio == pytest.approx((4.730041 / 1.875104) ** 2, rel=2e-3)  # 24 clamped modes span the free ones


def test_effective_independence_is_its_definition():
    """Each step with a new pseudo-inverse, as Kammer states it."""
    shape = random_shapes(30, 4).real.reshape(10, 3, 4)
    modes = body_modes(uniform_beam(modes=4))
    modes = modes.with_(points=np.zeros((10, 3)), labels=np.arange(10), shape=shape)
    left, rows = np.arange(30), shape.reshape(30, 4)
    while len(left) > 7:
        worth = np.einsum("ij,ji->i", rows[left], np.linalg.pinv(rows[left]))
        left = np.delete(left, np.argmin(worth))
    np.testing.assert_array_equal(np.flatnonzero(choose_sensors(modes, 7)), left)


def test_expansion_removes_noise(beam):
    """Noise of the sensors is projected on the modes: what remains is less by about sqrt(modes / sensors)."""
    modes = body_modes(beam)
    sensors = choose_sensors(modes, 40)
    test = synthetic_test(modes, sensors, noise=0.05, seed=4)
    found = correlate(test, modes)
    whole = expand(found.test, found.node, modes)
    assert whole.points.shape == modes.points.shape
    pure = expand(synthetic_test(modes, sensors), found.node, modes)
    known = sensors[found.node]
    before = np.linalg.norm((test.shape - pure.shape[found.node])[known])
    after = np.linalg.norm((whole.shape - pure.shape)[found.node][known])
    assert after < 0.55 * before  # sqrt(6 / 40) = 0.39


def test_modes_keep_their_number_through_a_crossing():
    """Bending in y and z of a rectangular section: frequencies in proportion to the height and to the width."""
    widths, heights = [0.08, 0.1, 0.12, 0.14], [0.09, 0.11, 0.13]
    grid, families = {}, {}
    for i, b in enumerate(widths):
        for j, h in enumerate(heights):
            modes, family = rectangular_beam(b, h)
            grid[i, j], families[i, j] = modes, family
    found = track_modes(grid)
    name = dict(zip(found.number[0, 0].tolist(), families[0, 0], strict=True))
    for place, numbers in found.number.items():
        assert [name[k] for k in numbers.tolist()] == families[place]
        assert found.certainty[place].min() > 0.99
    assert not found.conflicts
    assert families[0, 0] != families[3, 0]  # there is a crossing to pass


def test_a_mode_that_leaves_the_list_is_followed_and_another_one_begins():
    """Of the four lowest modes of a flat section that becomes a square, the third of one plane leaves the list."""
    grid = {(k,): rectangular_beam(b, 0.1)[0].select(np.arange(4)) for k, b in enumerate([0.03, 0.045, 0.07, 0.1])}
    families = [rectangular_beam(b, 0.1)[1][:4] for b in (0.03, 0.045, 0.07, 0.1)]
    found = track_modes(grid)
    name: dict[int, tuple] = {}
    for k, family in enumerate(families):
        for number, own in zip(found.number[k,].tolist(), family, strict=True):
            assert name.setdefault(number, own) == own
    assert found.count == len(name) == 5
    assert not found.low_mac


def test_modes_that_depend_on_the_way_are_conflicts():
    """Two shapes that turn by half a right angle from case to case around a square: a full turn exchanges them."""
    points = np.zeros((1, 3))

    def turned(angle):
        shape = np.zeros((1, 3, 2))
        shape[0, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        return mp.correlation.ModeSet(
            name="pair", points=points, shape=shape, frequency=np.ones(2), damping=np.zeros(2), labels=np.arange(1),
            lines=np.zeros((0, 2), dtype=int),
        )  # fmt: skip

    ring = {(0, 0): 0.0, (1, 0): 30.0, (1, 1): 60.0, (0, 1): 90.0}
    found = track_modes({place: turned(np.radians(angle)) for place, angle in ring.items()})
    assert len(found.conflicts) == 2
    assert not found.low_mac  # cos^2 30 = 0.75
    assert len(track_modes({(0,): turned(0.0), (1,): turned(0.75)}).low_mac) == 2


def rectangular_beam(b, h):
    """Return exact bending modes of a cantilever, and the plane and the order of each, sorted by frequency."""
    x = np.linspace(0, 1, 41)
    found = []
    for order, beta in enumerate([1.875104, 4.694091, 7.854757]):
        sigma = (np.cosh(beta) + np.cos(beta)) / (np.sinh(beta) + np.sin(beta))
        w = np.cosh(beta * x) - np.cos(beta * x) - sigma * (np.sinh(beta * x) - np.sin(beta * x))
        found += [(beta**2 * h, ("y", order), w), (beta**2 * b, ("z", order), w)]
    found.sort(key=lambda mode: mode[0])
    shape = np.zeros((41, 3, 6))
    for k, (_, (plane, _), w) in enumerate(found):
        shape[:, " yz".index(plane), k] = w
    points = np.stack([x, 0 * x, 0 * x], axis=1)
    modes = mp.correlation.ModeSet(
        name="beam", points=points, shape=shape, frequency=np.array([f for f, _, _ in found]), damping=np.zeros(6),
        labels=np.arange(41), lines=np.zeros((0, 2), dtype=int),
    )  # fmt: skip
    return modes, [family for _, family, _ in found]


def test_compare_prints_pairs_and_writes_a_picture_and_a_table(files, tmp_path, capsys):
    assert main(["compare", str(files[0]), str(files[1]), "-o", str(tmp_path / "mac.png")]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["1", "1", "0.6044", "0.6044", "-0.00", "1.000", "1.000", ".", "0.00"] in [
        [cell.replace("+0.00", "-0.00") for cell in row] for row in rows
    ]
    assert (tmp_path / "mac.png").stat().st_size > 10_000
    assert len((tmp_path / "mac.csv").read_text().splitlines()) == 7


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--modes", "9"], "--modes 9: the body of"),
        (["--origin", "1,2"], "--origin '1,2' is not X,Y,Z"),
        (["--boundary", "held"], "boundary = 'held' is neither 'clamped' nor 'free'"),
        (["--length-unit", "parsec"], "parsec"),
        (["--length-unit", "km"], "from the nearest point of beam"),
    ],
)
def test_wrong_options(files, arguments, said, capsys):
    assert main(["compare", *map(str, files), *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1


def test_damaged_files_are_refused_in_one_sentence(files, tmp_path, capsys):
    whole = files[1].read_text()
    random = np.random.default_rng(2)
    for cut in random.integers(0, len(whole), cases(25)).tolist():
        (tmp_path / "cut.uff").write_text(whole[:cut])
        code = main(["compare", str(files[0]), str(tmp_path / "cut.uff"), "-o", str(tmp_path / "a.png")])
        error = capsys.readouterr().err
        assert code in (0, 2)  # a file that ends between two modes is whole
        assert len(error.splitlines()) == (code == 2)
        assert code == 2 or cut > len(whole) // 4
