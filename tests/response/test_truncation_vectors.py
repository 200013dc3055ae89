"""Truncation vectors in responses: they have the static response of dropped modes, and no resonance of their own."""

import functools

import numpy as np
import pytest
import scipy
from response.beams import BETA, ELEMENTS, LENGTH, WANTED

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section
from modalprep.reduction.damping import Rayleigh
from modalprep.reduction.table import DIRECTIONS
from modalprep.response import (
    History,
    harmonic_response,
    modal_equations,
    random_response,
    sweep_response,
    transient_response,
)

STIFF = {"damping": Rayleigh(alpha=0.0, beta=BETA), "refine": False}
KEPT = [0, 1, 2, 5]  # of the modes; the next two, a pair in bending at 10.6 Hz, are dropped
BASE, TIP = np.array([0.0, 2.0, 3.0, 0.0, 0.2, 0.1]), np.array([0.0, -4.0, 3.0, 0.0, 1.0, -1.0])
LOADS = {"base": BASE, "tip": TIP}
INPUTS = {f"{at}.{d}": x for at, load in LOADS.items() for d, x in zip(DIRECTIONS, load, strict=True) if x}
VECTORS = {"base.force": "xyz", "base.moment": "xyz", "tip.acceleration": "xyz", "tip.displacement": "xyz",
           "wall.root": ("Fx", "Fy", "Fz", "Mx", "My", "Mz")}  # fmt: skip


@functools.cache
def beam(keep="all", modes=12, tip="free", truncation=("interfaces", "inertia")):
    """The spin-up beam of six elements with some of its modes, and truncation vectors."""
    mesh = beam_mesh(ELEMENTS, LENGTH)
    faces = {name: mp.Interface(group=name, kind="node", boundary=b) for name, b in (("root", "fixed"), ("tip", tip))}
    model = mp.assemble(mesh, {"beam": spinup_section()}, faces)
    recovery = mp.fe.model_recovery(model, mesh, WANTED)
    reduction = mp.craig_bampton(
        model, modes=modes, keep=list(keep) if isinstance(keep, tuple) else keep, truncation=truncation
    )
    return model, mp.flexible_body(model, reduction, name="beam", recovery=recovery)


def massless(model, f):
    """The channels of the full model in which all modes but KEPT have no inertia: no basis is reduced."""
    w, K, M, R = 2 * np.pi * f, model.K.toarray(), model.M.toarray(), model.rigid_body()
    i = np.setdiff1d(np.arange(len(K)), model.dof[0])
    inside, force = np.ix_(i, i), np.zeros(len(K))
    force[model.dof[ELEMENTS]] = TIP
    w2, Phi = (x[..., KEPT] for x in scipy.linalg.eigh(K[inside], M[inside]))
    P, load = M[inside] @ Phi, (force - M @ R @ BASE)[i]
    x, a = np.zeros((2, len(K)), dtype=complex)
    x[i] = np.linalg.solve(K[inside] + (1j * w * BETA * w2 - w**2) * P @ P.T, load)
    a[i] = -(w**2) * Phi @ (P.T @ x[i])
    a += R @ BASE
    reaction, tip = R.T @ (M @ a - force), model.dof[ELEMENTS]
    found = {"base.force": reaction[:3], "base.moment": reaction[3:], "tip.acceleration": a[tip[:3]]}
    return found | {"tip.displacement": x[tip[:3]], "wall.root": (K @ x + M @ a)[model.dof[0]]}


@pytest.fixture(scope="module")
def few():
    return beam(keep=tuple(k + 1 for k in KEPT))


@pytest.fixture(scope="module")
def mixed():
    """Two modes, and a truncation vector for each load on the tip: each mixes all dropped modes of its direction."""
    return beam(keep=(1, 2), truncation=("interfaces",))


def shares(body):
    return body.truncation > 0.5


def test_they_act_as_dropped_modes_without_inertia(few):
    """All channels are those of the full model without the mass of the dropped modes; 1e-8 is round-off of its K."""
    model, body = few
    assert np.sort(body.truncation).round(6).tolist() == [0.0] * len(KEPT) + [1.0] * (body.n - len(KEPT))
    found = harmonic_response(body, INPUTS, [0.05, 0.6, 3.0, 9.0, 12.0, 5000.0], **STIFF)
    for k, f in enumerate(found.axis[:-1]):
        for name, expected in massless(model, f).items():
            values = np.array([found[f"{name}.{axis}"][k] for axis in VECTORS[name]])
            assert values == pytest.approx(expected, rel=1e-8, abs=1e-8 * np.abs(expected).max()), (f, name)


def maxima(body, top):
    """Frequencies of the local maxima of the base force under a force on the tip."""
    f = np.geomspace(0.3, top, 20_000)
    curve = np.abs(harmonic_response(body, {"tip.y": 1.0}, f, damping=1e-3, refine=False)["base.force.y"])
    return f[1:-1][(curve[1:-1] > curve[:-2]) & (curve[1:-1] > curve[2:])]


def test_no_response_resonates_where_the_structure_does_not(mixed):
    """All maxima of a lightly damped response are at frequencies of the full model, to the step of 2.5e-4."""
    model, body = mixed
    i = np.setdiff1d(np.arange(model.n_dof), model.dof[0])
    w2 = scipy.linalg.eigvalsh(model.K.toarray()[np.ix_(i, i)], model.M.toarray()[np.ix_(i, i)])
    true = np.sqrt(w2) / (2 * np.pi)

    def off(f):
        return np.abs(f[:, None] / true - 1).min(axis=1).max()

    assert off(maxima(body, 60.0)) < 1e-3
    assert off(maxima(body.with_(truncation=None), 60.0)) > 0.01  # 3.95 Hz: they would resonate
    assert not np.any(np.abs(modal_equations(body, ["tip.y"], 0.01, 60.0).resonances[0] - 3.95) < 0.1)


def test_the_warning_names_the_dropped_modes(mixed):
    _, body = mixed
    found = harmonic_response(body, {"tip.y": 1.0}, [0.1, 12.0], damping=0.01)
    assert found.warnings[0].startswith("the body drops 3 modes in the band (3.788, 7.569, 10.62 Hz)")
    assert "the 2 truncation vectors that mix them act statically" in found.warnings[0]
    assert set(found.warnings) <= set(found.notes)
    assert harmonic_response(body, {"tip.y": 0.1}, [0.1, 1.2], damping=0.01).warnings == ()


def test_a_mode_that_the_base_does_not_excite_is_not_missed(mixed):
    """A motion of the base along the beam excites no bending; of the modes below 12 Hz none moves mass along it."""
    assert harmonic_response(mixed[1], {"base.x": 1.0}, [0.1, 1.2], damping=0.01).warnings == ()
    said = harmonic_response(mixed[1], {"base.x": 1.0}, [0.1, 12.0], damping=0.01).warnings
    assert not any("drops" in text for text in said)


def test_attachment_modes_are_warned_of():
    """They mix dropped modes too, and cannot act statically: the modes with the root held need them."""
    model, _ = beam()
    reduction = mp.reduction.free_interface(model, modes=8, keep="mode > 2")
    body = mp.flexible_body(model, reduction, name="beam")
    said = harmonic_response(body, {"tip.y": 1.0}, [0.1, 12.0], damping=0.01).warnings
    assert "attachment modes, which mix them, resonate elsewhere" in said[0]
    assert said[0].startswith("the body drops 2 modes in the band (")


def test_below_all_dropped_modes_their_inertia_counts():
    """Mode by mode up to 2.5 Hz: with inertia the error of acceleration at the tip is of fourth order in frequency."""
    body = beam(modes=4, truncation=("interfaces",))[1]
    whole = harmonic_response(beam(modes=36)[1], {"tip.y": 1.0}, [0.3, 2.4], damping=0.01, refine=False)
    found = harmonic_response(body, {"tip.y": 1.0}, [0.3, 2.4], damping=0.01, refine=False)
    assert body.modes.complete_below == pytest.approx(7.569, abs=1e-3)
    off = np.abs(found["tip.acceleration.y"] / whole["tip.acceleration.y"] - 1)
    assert off.max() < 1e-4
    assert found.warnings == ()


def test_mass_above_the_band_may_move_as_if_it_were_rigid():
    """The bound of its effect, in the note, against the force of all modes; without damping of what is left out.

    Seven of ten candidates are kept; the rest of the mass across is above 35 Hz. At 30 Hz the bound is too large.
    """
    whole, few = beam(modes=36)[1], beam(modes=10, keep=(1, 2, 3, 4, 5, 6, 7), truncation=())[1]
    f = np.array([0.02, 5.0, 15.0])
    exact, found = (harmonic_response(x, {"base.y": 1.0}, f, damping=1e-4, refine=False) for x in (whole, few))
    said = [note for note in found.notes if "which changes the force there by" in note]
    assert len(said) == 1
    bound = float(said[0].split(" by ")[1].split(" %")[0]) / 100
    off = np.abs(found["base.force.y"] - exact["base.force.y"]).max() / few.m
    assert off < bound + 5e-4  # of its last digit
    assert bound < 3 * off  # modes beyond the candidates count as if they were at the highest of these: 2.4 measured
    near = harmonic_response(few, {"base.y": 1.0}, [0.02, 30.0], damping=1e-4, refine=False)
    assert any(note.endswith("the rest moves with the base as if it were rigid") for note in near.notes)


def pulse(duration):
    t = np.linspace(0, duration, 33)
    return History(time=t, value=np.sin(np.pi * t / duration))


def history(body, inputs, duration):
    options = {"duration": 1.0, "step": duration / 160, "damping": 0.01, "channels": ["base.force", "wall"]}
    return transient_response(body, {inputs: pulse(duration)}, **options)


def test_after_a_pulse_only_modes_ring():
    """Then the history is that of the body without truncation vectors; to round-off of the largest value."""
    body, bare = beam(keep="frequency < 12 Hz")[1], beam(keep="frequency < 12 Hz", truncation=())[1]
    found, rings, expected = (history(x, "base.y", 0.1) for x in (body, body.with_(truncation=None), bare))
    late = found.axis > 0.1 + 1e-9
    size = np.abs(expected["base.force.y"]).max()
    assert found["base.force.y"][late] == pytest.approx(expected["base.force.y"][late], abs=1e-9 * size)
    assert np.abs(rings["base.force.y"] - expected["base.force.y"])[late].max() > 0.01 * size


@pytest.mark.parametrize("inputs", ["base.y", "tip.y"])
@pytest.mark.parametrize("duration", [0.02, 0.1, 0.2])
@pytest.mark.parametrize("keep", ["frequency < 5 Hz", "frequency < 30 Hz"])
def test_a_history_without_a_warning_is_right(keep, duration, inputs):
    """Against all 36 modes: within 3 % of the largest value, or warned; no warning where it is within 0.3 %."""
    body = beam(keep=keep)[1]
    exact, found = history(beam(modes=36)[1], inputs, duration), history(body, inputs, duration)
    off = max(np.abs(found[x] - exact[x]).max() / np.abs(exact[x]).max() for x in ("base.force.y", "wall.root.Mz"))
    assert bool(found.warnings) or off < 0.03
    assert not found.warnings or off > 0.003


def test_a_slow_sweep_reaches_its_steady_state(few):
    """The march against the harmonic response; 5 %: the start at rest, and extremes of intervals."""
    found = sweep_response(few[1], {"tip.y": 1.0}, 3.0, 14.0, (2.0, "oct/min"), damping=0.2)
    k = found.names.index("tip.displacement.y")
    assert found.values[20:, k] == pytest.approx(found.steady[20:, k], rel=0.05)


def test_the_random_response_is_the_integral_of_the_harmonic_one(few):
    S = random_response(few[1], {"tip.y": 2.0}, band=(0.1, 14.0), damping=0.02)
    H = harmonic_response(few[1], {"tip.y": 1.0}, S.axis, damping=0.02, refine=False)
    assert S["base.force.y"] == pytest.approx(2.0 * np.abs(H["base.force.y"]) ** 2, rel=1e-12)


def test_coupled_damping_does_not_reach_them(few):
    """A damping matrix in the coordinates of the body, diagonal but for one entry of a kept pair."""
    body = few[1]
    kept = np.flatnonzero(~shares(body))
    D = np.diag(0.04 * np.sqrt(body.K))
    plain = harmonic_response(body, {"tip.y": 1.0}, [0.5, 9.0], damping=D, refine=False)
    D[kept[0], kept[1]] = D[kept[1], kept[0]] = 1e-9 * D.max()
    coupled = harmonic_response(body, {"tip.y": 1.0}, [0.5, 9.0], damping=D, refine=False)
    assert modal_equations(body, ["tip.y"], D, 9.0).coupled
    assert coupled["tip.displacement.y"] == pytest.approx(plain["tip.displacement.y"], rel=1e-6)


def test_mixed_interfaces_another_root_and_a_file_keep_their_shares(tmp_path):
    """With constraint modes of a second fixed interface the shares add up to the number of vectors."""
    _, body = beam(keep=(1, 2), tip="fixed", truncation=("inertia",))
    count = body.modes.kind.count("truncation")
    assert body.truncation.sum() == pytest.approx(count)
    assert shares(body).sum() == count
    again = mp.read_body(mp.write_body(body, tmp_path / "beam.h5"))
    assert again.truncation == pytest.approx(body.truncation)
    moved = mp.body.reroot(body, "tip")
    assert moved.truncation.sum() == pytest.approx(count, rel=0.05)  # its modes are not orthogonal to the former ones
