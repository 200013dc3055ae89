"""Modes chosen by their share in recoveries: series of beams, sums over all modes, the grammar of `keep`."""

import numpy as np
import pytest
from analytic import cantilever_roots

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.fe.recovery.fields import Fields
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp
from modalprep.reduction.free_interface_basis import free_interface
from modalprep.reduction.recoveries.shares import Share, recovery_shares
from modalprep.reduction.recoveries.unit_loads import Contributions, fixed_interface_loads
from modalprep.reduction.selection import recoveries_named, select

LENGTH, STEEL = 2.0, mp.Material(E=210e9, nu=0.3, rho=7800.0)
SECTION = mp.Beam(material=STEEL, A=6e-4, Iy=2e-8, Iz=5e-8, J=4e-8, theory="euler-bernoulli")
Recover = mp.fe.Recover
WANTED = {
    "root": Recover(kind="section_force", box=((-0.01, -1, -1), (LENGTH / 40 + 0.01, 1, 1)), method="displacement"),
    "base": Recover(kind="reaction"),
    "feel": Recover(kind="acceleration", group="tip"),
    "move": Recover(kind="displacement", group="tip"),
}


def cantilever(modes=12, elements=40, wanted=WANTED, tip=None, **options):
    mesh = beam_mesh(elements, LENGTH)
    ends = {"root": mp.Interface(group="root", kind="node")} | ({"tip": tip} if tip else {})
    model = mp.assemble(mesh, {"beam": SECTION}, ends)
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    return model, recovery, mp.craig_bampton(model, modes=modes, recovery=recovery, **options)


def judged(model, modes=12):
    """The loads of a model and its modes."""
    held = clamp(model)
    w2, Phi, _ = lowest_modes(held.K_ii, held.M_ii, modes)
    return held, fixed_interface_loads(held, w2, Phi, {})


def only(loads, label):
    """The one load of a label."""
    k = [loads.label.index(label)]
    fields = Fields(*(x[:, k] for x in loads.fields))
    return loads._replace(label=(label,), fields=fields, moves=loads.moves[k], force=loads.force[:, k])


def test_the_share_in_a_reaction_is_the_effective_mass():
    """Of a lateral acceleration of the base: 0.6131, 0.1883, 0.0647 of the mass (Blevins 1979, table 8-1)."""
    model, recovery, reduction = cantilever()
    loads = only(judged(model)[1], "base acceleration z")
    parts = Contributions.of(recovery.quantities["base"], loads)
    assert parts.complete[0, 2, 0] == pytest.approx(1.0, rel=1e-9)  # the weight of 1 N
    share = parts.modal[0, 2] * parts.factor[:, 0]
    found = share[share > 1e-6]
    assert found[:3] == pytest.approx([0.6131, 0.1883, 0.0647], rel=2e-3)  # digits of the table
    z = cantilever_roots(3)
    sigma = (np.sinh(z) - np.sin(z)) / (np.cosh(z) + np.cos(z))
    assert found[:3] == pytest.approx(4 * sigma**2 / z**2, rel=1e-3)  # rotary inertia, forty elements
    mass = reduction.table.fraction[:12, 2]
    assert mass[mass > 1e-6] == pytest.approx(found, rel=5e-3)  # which counts the base's own part of the first element


def test_the_share_in_a_moment_under_a_tip_force_is_that_of_its_series():
    """``EI phi''(0) phi(L) / w^2 = 4 F L / z^2`` of F L at the root: 1.1377, 0.1815, 0.0648, with changing signs."""
    tip = mp.Interface(group="tip", kind="node", boundary="free")
    model, recovery, _ = cantilever(tip=tip)
    loads = only(judged(model)[1], "load on tip z")
    found = Contributions.of(recovery.quantities["root"], loads)
    assert found.complete[0, :, 0] == pytest.approx([0, 0, 1, 0, -LENGTH, 0], abs=1e-8)
    parts = found.modal[0, 4] * found.factor[:, 0] / -LENGTH
    z = cantilever_roots(3)
    series = np.array([1, -1, 1]) * 4 / z**2
    assert parts[np.abs(parts) > 1e-6][:3] == pytest.approx(series, rel=1e-3)  # inertia of the first element


def test_shares_are_the_largest_parts_of_the_complete_response():
    """Entry by entry, for every load: of what the modes give, over the largest value of the same unit."""
    wanted = WANTED | {"root": Recover(kind="section_force")}
    model, recovery, _ = cantilever(elements=6, wanted=wanted, tip=mp.Interface(group="tip", kind="node"))
    _, loads = judged(model, 8)
    found = recovery_shares(recovery, loads)
    assert {label.rsplit(" ", 1)[0] for label in loads.label} == {"base acceleration", "acceleration of tip"}
    none = np.zeros_like(loads.modes)
    zero = np.zeros((12, 8))
    for name, quantity in recovery.quantities.items():
        moving = quantity.kind == "acceleration"
        unit = quantity.values(Fields(none, loads.modes, zero) if moving else Fields(loads.modes, none, zero))
        whole = loads.fields._replace(u=np.zeros_like(loads.fields.u)) if moving else loads.fields
        complete, units = quantity.values(whole), np.array(quantity.units)
        factor = loads.force if moving else loads.force / loads.w2[:, None]
        for k in range(8):
            largest = 0.0
            for u in set(quantity.units):
                top = np.abs(complete[:, units == u]).max(axis=(0, 1))
                parts = np.abs(unit[:, units == u, k, None] * factor[k]).max(axis=(0, 1))
                real = top > 1e-2 * top.max()
                largest = max(largest, (parts[real] / top[real]).max(initial=0.0))
            assert found[name][k].value == pytest.approx(largest, rel=1e-9)


def test_modes_of_the_floating_body_have_shares_but_not_in_accelerations():
    """Unit loads on both interfaces, balanced by inertia: of the tip's displacement the lowest bending modes matter."""
    tip = mp.Interface(group="tip", kind="node")
    mesh = beam_mesh(10, LENGTH)
    model = mp.assemble(mesh, {"beam": SECTION}, {"root": mp.Interface(group="root", kind="node"), "tip": tip})
    recovery = mp.fe.model_recovery(model, mesh, WANTED | {"root": Recover(kind="section_force")})
    table = free_interface(model, modes=8, recovery=recovery, keep="recovery.move > 20%").table
    assert table.kept[:2].all()
    assert not table.kept[4:8].any()
    assert "recovery share" in table.reason[0]
    assert "load on " in table.reason[0]
    with pytest.raises(mp.InputError, match="these modes have no recovery.feel"):
        free_interface(model, modes=8, recovery=recovery, keep="recovery.feel > 2%")


def test_expressions_of_recoveries():
    values = {"struts": [Share(0.3, "struts", "1.N", "x"), Share(0.001, "struts", "2.N", "y")],
              "skin-a": [Share(0.02, "skin-a", "3.xx", "z"), Share(0.0, "skin-a", "", "")]}  # fmt: skip
    frequency = np.array([5.0, 50.0])
    for keep, kept in (
        ("recovery > 1%", [True, False]),
        ("recovery.struts > 1%", [True, False]),
        ("recovery.skin-a > 5% or frequency > 40 Hz", [False, True]),
        ("5% < recovery.struts and not recovery.skin-a > 3%", [True, False]),
        ("recovery >= 0%", [True, True]),
    ):
        found, reason = select(keep, frequency, recovery=values)
        assert found.tolist() == kept, keep
        assert all(reason)
    assert select("recovery > 1%", frequency, recovery=values)[1] == (
        "recovery share 30% in struts (1.N, x) > 1%",
        "recovery share 0.1% in struts (2.N, y), not > 1%",
    )
    assert recoveries_named("recovery.a-b > 1% or recovery > 2%") == (True, ("a-b",))
    with pytest.raises(mp.InputError, match=r"no recovery.skin; they have .*recovery.struts.*\[recovery.NAME\]"):
        select("recovery.skin > 1%", frequency, recovery=values)
    with pytest.raises(mp.InputError, match="these modes have no recovery"):
        select("recovery > 1%", frequency)
