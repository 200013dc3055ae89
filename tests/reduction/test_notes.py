"""What a reduction says of itself: no mode missed, mixed interfaces, pseudo-resonances, modes dropped in a band."""

import re

import numpy as np
import pytest
from scipy.linalg import eigh

import modalprep as mp
from modalprep.examples import beam_mesh, cantilever_model, spinup_section
from modalprep.reduction.clamped import clamp
from modalprep.reduction.free_interface_basis import free_interface
from modalprep.reduction.notes import _hertz, dropped_in_band
from modalprep.reduction.selection import select
from modalprep.verdicts.notes import kind_of

FOUND = re.compile(r"all (\d+) (.+) modes below ([\d.]+) Hz were found \((.+)\)")


def claim(reduction):
    (said,) = [found for note in reduction.notes if (found := FOUND.fullmatch(note))]
    return int(said[1]), said[2], float(said[3]), said[4]


def frequencies(K, M):
    return np.sqrt(np.abs(eigh(K.toarray(), M.toarray(), eigvals_only=True))) / (2 * np.pi)


@pytest.mark.parametrize(("elements", "how"), [(10, "dense"), (120, "counted by the inertia")])
def test_every_run_says_that_no_mode_is_missing(elements, how):
    """The number agrees with LAPACK's; a tube has its modes in pairs, so that the highest may be cut in half."""
    mesh, ends = beam_mesh(elements), {"root": mp.Interface(group="root", kind="node")}
    model = mp.assemble(mesh, {"beam": spinup_section(Iy=2e-7)}, ends)
    held = clamp(model)
    exact = frequencies(held.K_ii, held.M_ii)
    for modes in (6, 7):
        count, kind, limit, method = claim(mp.craig_bampton(model, modes=modes))
        assert kind == "fixed-interface"
        assert count == np.sum(exact < limit)
        assert modes - 2 <= count < modes
        assert how in method
        assert 0.9999 < limit / exact[modes - 1] < 1


def test_floating_modes_are_claimed_without_rigid_motions():
    model = cantilever_model(10, tip="fixed")
    exact = frequencies(model.C.T @ model.K @ model.C, model.C.T @ model.M @ model.C)[6:]
    count, kind, limit, _ = claim(free_interface(model, modes=5))
    assert kind == "elastic free-interface"
    assert count == np.sum(exact < limit) == 4


def test_nothing_is_claimed_where_nothing_was_counted(monkeypatch):
    """A factorisation may not tell: SuperLU with exchanged rows, or one more that the memory has no room for."""
    large = cantilever_model(120)
    assert [n for n in mp.craig_bampton(large, modes=4, solver="superlu").notes if "found" in n]
    monkeypatch.setattr("modalprep.linalg.modes.count_below", lambda *arguments: None)
    assert not [n for n in mp.craig_bampton(large, modes=4).notes if "found" in n]
    assert not [n for n in mp.guyan(cantilever_model(5, tip="fixed")).notes if "found" in n]
    assert not [n for n in mp.craig_bampton(cantilever_model(5), modes=0).notes if "found" in n]


@pytest.fixture(scope="module")
def spans():
    """Root and middle fixed, tip free."""
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "middle": mp.Interface(near=(6.0, 0, 0), kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    return mp.assemble(beam_mesh(20), {"beam": spinup_section()}, ends)


def test_mixed_interfaces_are_exact_with_all_modes(spans):
    reduction = mp.craig_bampton(spans, modes=spans.n_dof, truncation=())
    exact = frequencies(spans.K[6:][:, 6:], spans.M[6:][:, 6:])
    np.testing.assert_allclose(reduction.frequency, exact, rtol=1e-6)  # spread of 1e10 in w^2


def test_mixed_interfaces_are_exact_in_statics(spans):
    """With two modes: forces and moments on the fixed middle and on the free tip, the root held."""
    reduction = mp.craig_bampton(spans, modes=2, truncation=("interfaces",))
    w2 = (2 * np.pi * reduction.frequency) ** 2
    F = reduction.loads[:, 18:30]
    exact = np.zeros_like(F)
    exact[6:] = np.linalg.solve(spans.K.toarray()[6:, 6:], F[6:])
    error = reduction.basis @ ((reduction.basis.T @ F) / w2[:, None]) - exact
    energy = np.einsum("dk,dk->k", exact, spans.K @ exact)
    assert np.all(np.einsum("dk,dk->k", error, spans.K @ error) < 1e-9 * energy)


def test_mixed_interfaces_converge_from_above(spans):
    exact = frequencies(spans.K[6:][:, 6:], spans.M[6:][:, 6:])[:6]
    few, many = (mp.craig_bampton(spans, modes=n).frequency[:6] / exact - 1 for n in (2, 12))
    assert np.all(many > -1e-9)
    assert many.max() < 1e-4 < few.max()


def test_mixed_interfaces_are_said(spans):
    notes = mp.craig_bampton(spans, modes=4, truncation=("inertia",)).notes
    assert "mixed interfaces: middle fixed, with constraint modes; tip free, moving with the modes" in notes
    assert any("interface tip is free and truncation_vectors leaves out 'interfaces'" in note for note in notes)
    assert not [n for n in mp.craig_bampton(cantilever_model(5), modes=2).notes if "interfaces" in n]
    push = np.zeros(spans.n_dof)
    push[spans.dof[-1, 1]] = 1.0
    (said,) = (
        n for n in mp.craig_bampton(spans, modes=4, truncation=("push",), loads={"push": push}).notes if "exact" in n
    )
    assert said == "interface tip is free: static responses are exact for the loads push alone"
    assert kind_of(said) == "notes"


def test_pseudo_resonances_are_said():
    """Modes 5 to 7 of a beam dropped: truncation vectors take over part of them, below the eighth mode, which is kept.

    Where all modes below the truncation vectors are kept, they are a residual above the modes, and nothing is said.
    """
    model = cantilever_model(20)
    warned = [n for n in mp.craig_bampton(model, modes=8, keep=[1, 2, 3, 8]).notes if "which they mix" in n]
    assert len(warned) == 1
    assert "2 truncation vectors, the lowest at 7.569 Hz, lie below dropped modes" in warned[0]
    assert not [n for n in mp.craig_bampton(model, modes=8, keep="effective_mass > 15%").notes if "mix" in n]
    assert not [n for n in mp.craig_bampton(model, modes=8).notes if "mix" in n]
    assert not [n for n in mp.craig_bampton(model, modes=8, keep="mode < 8", truncation=()).notes if "mix" in n]


def test_modes_dropped_in_the_band_are_said():
    table = mp.craig_bampton(cantilever_model(20), modes=8, keep="effective_mass > 15%").table
    (said,) = dropped_in_band(table, up_to=25.0)
    inside = table.frequency[:8] < 25.0
    missing = inside & ~table.kept[:8]
    assert said.startswith(f"the selection drops {missing.sum()} of {inside.sum()} modes below up_to = 25 Hz (")
    assert all(f"{f:.4g}" in said for f in table.frequency[:8][missing])
    assert dropped_in_band(table, up_to=table.frequency[:8][missing].min()) == ()


def test_band_filters():
    """A chain of comparisons, the same by `and`, and either side alone."""
    frequency = np.array([5.0, 20.0, 100.0, 500.0, 600.0])
    for keep in ("20 < frequency < 600", "frequency > 20 and frequency < 600 Hz", "600 > frequency > 20 Hz"):
        assert select(keep, frequency)[0].tolist() == [False, False, True, True, False]
    assert select("20 <= frequency < 500 Hz", frequency)[0].tolist() == [False, True, True, False, False]
    assert select("500 <= frequency", frequency)[0].tolist() == [False, False, False, True, True]
    assert select("2 <= mode <= 3 or frequency > 550", frequency)[0].tolist() == [False, True, True, False, True]
    reason = select("20 < frequency < 500", frequency)[1]
    assert reason[0] == "frequency 5 Hz, not > 20"
    assert reason[2] == "frequency 100 Hz > 20; frequency 100 Hz < 500"


@pytest.mark.parametrize("reduce", [mp.craig_bampton, free_interface])
def test_a_model_with_fewer_modes_says_so(reduce):
    model = cantilever_model(2)
    said = [note for note in reduce(model, modes=10**9).notes if "were asked for" in note]
    assert len(said) == 1
    assert f"of the {10**9} that were asked for" in said[0]
    assert not [note for note in reduce(model, modes=1).notes if "were asked for" in note]


@pytest.mark.parametrize(("frequency", "text"), [(12345.6, "12346"), (9999.4, "9999"), (12.3456, "12.35")])
def test_frequencies_have_no_power_of_ten(frequency, text):
    assert _hertz(frequency) == text
