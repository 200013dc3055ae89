"""Bodies with stations for tests, their equilibria, and closed forms of beams that bend far."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

import modalprep as mp
from modalprep.multibody.reference.stations import station_equations
from modalprep.vectors import cross


def line_body(points, section, *, modes=4, stations=16, derivatives=6, boundary="fixed", recover=None, fibre=None):
    """Body of beams along points (n, 3), held at the first, with a tip at the last.

    `recover` by name; a fibre (2,) of the section at the root, where stress is recovered.
    """
    n = len(points) - 1
    mesh = mp.fe.Mesh(
        points=points, cells={"line": np.stack([np.arange(n), np.arange(1, n + 1)], axis=1)},
        groups={"line": {"line": np.arange(n)}},
    )  # fmt: skip
    ends = {"root": mp.Interface(node=1, kind="node"), "tip": mp.Interface(node=n + 1, kind="node", boundary=boundary)}
    model = mp.assemble(mesh, {"line": section}, ends)
    recovery = mp.fe.model_recovery(model, mesh, recover) if recover else None
    point = mp.fe.StressPoint(node=1, fibres=(fibre,)) if fibre else None
    stress = mp.fe.stress_recovery(model, mesh, {"root": point}) if point else None
    return bent(model, modes, stations, derivatives, recovery=recovery, stress=stress)


def bent(model, modes=4, stations=16, derivatives=6, **recoveries):
    """Return the body of a model with stations."""
    loads = ("interfaces", "inertia", "derivatives")
    reduction = mp.craig_bampton(model, modes=modes, truncation=loads, derivatives=derivatives)
    return mp.flexible_body(model, reduction, name="body", stations=stations, **recoveries)


def equilibrium(body, force=(0, 0, 0), torque=(0, 0, 0)):
    """Return place of the tip and modal coordinates under a dead force and a dead torque at the tip."""
    held = mp.Joint(name="clamp", type="weld", parent="ground", child="body")
    load = mp.PointForce(name="load", at="body.tip", force=np.array(force, float), torque=np.array(torque, float))
    rest = mp.static_equilibrium(mp.System(bodies={"body": body}, joints=(held,), loads=(load,)))
    return rest["body.tip.position"], rest.modal["body"]


def elastica(w):
    """Return ``P L^2 / EI`` and the shortening over L of a cantilever whose tip deflects by w L: exact."""
    load = brentq(lambda p: _tip(p)[0] - w, 1e-3, 60)
    return load, _tip(load)[1]


def _tip(p):
    """Deflection and shortening over L under ``P L^2 / EI = p`` by elliptic integrals (Bisshopp and Drucker 1945)."""

    def gap(angle):
        m = (1 + np.sin(angle)) / 2
        return ellipk(m) - ellipkinc(np.arcsin(1 / np.sqrt(2 * m)), m) - np.sqrt(p)

    angle = brentq(gap, 1e-9, np.pi / 2 - 1e-12)
    m = (1 + np.sin(angle)) / 2
    E = ellipe(m) - ellipeinc(np.arcsin(1 / np.sqrt(2 * m)), m)
    return 1 - 2 * E / np.sqrt(p), 1 - np.sqrt(2 * np.sin(angle) / p)


def lagrange(body, V, q, qd, step=1e-6):
    """Return the bias force of a body by differences of its kinetic energy: Lagrange's equations in its frame."""

    def mass(q):
        return station_equations(body, np.zeros(6), q, 0 * qd)[0]

    speeds = np.concatenate([V, qd])
    M = mass(q)
    momentum = M @ speeds
    bias = (mass(q + step * qd) - mass(q - step * qd)) @ speeds / (2 * step)
    for i, e in enumerate(step * np.eye(len(q))):
        bias[6 + i] -= 0.5 * speeds @ ((mass(q + e) - mass(q - e)) / (2 * step)) @ speeds
    v, w = V[:3], V[3:]
    bias[:3] += cross(w, momentum[:3])
    bias[3:6] += cross(w, momentum[3:6]) + cross(v, momentum[:3])
    bias -= M[:, :3] @ cross(w, v)
    bias[6:] += body.K * q + body.D * qd
    return bias
