"""Second implementation of clamped rods under a dead force: Kirchhoff's equations with Reissner's stretch and shear.

    R' = R (k~),  k = k0 + C^-1 R^T ((r_L - r) x F),    r' = R (e_x + N^-1 R^T F)

from the clamp on by Runge and Kutta's method; the end r_L is found by shooting. No segments, no joints.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import root

STEPS = 64  # an error of fourth order: 1e-8 of the length for a turn of 90 degrees


def rod_tip(
    length, force, *, bending, curvature=(0.0, 0.0, 0.0), axial=(np.inf, np.inf, np.inf), corner=False
) -> np.ndarray:
    """Position (3,) of the tip of a rod that leaves the origin along x.

    `bending` (3,) are GJ, EI_y, EI_z, `axial` (3,) are EA, GA_y, GA_z, `curvature` (3,) is that of the unloaded rod,
    which a stiff `corner` in its middle turns from x to y.
    The force is applied in steps, each from the answer to the one before.
    """
    bending, curvature, axial, force = (np.asarray(v, dtype=float) for v in (bending, curvature, axial, force))

    def rates(y, tip, F):
        """Of rows r, and R^T: e_x, e_y, e_z of the section."""
        (x, y_, z), frame = tip - y[0], y[1:]
        moment = np.array([y_ * F[2] - z * F[1], z * F[0] - x * F[2], x * F[1] - y_ * F[0]])
        a, b, c = curvature + frame @ moment / bending
        turn = np.array([[0.0, c, -b], [-c, 0.0, a], [b, -a, 0.0]])
        return np.vstack([frame[0] + (frame @ F / axial) @ frame, turn @ frame])

    def end(tip, F):
        h, y = length / STEPS, np.vstack([np.zeros(3), np.eye(3)])
        for step in range(STEPS):
            if corner and step == STEPS // 2:
                y[1:] = np.array([y[2], -y[1], y[3]])
            one = rates(y, tip, F)
            two = rates(y + h / 2 * one, tip, F)
            three = rates(y + h / 2 * two, tip, F)
            y = y + h / 6 * (one + 2 * two + 2 * three + rates(y + h * three, tip, F))
        return y[0]

    tip = end(np.zeros(3), np.zeros(3))
    for share in (0.25, 0.5, 0.75, 1.0):
        found = root(lambda r, F: r - end(r, F), tip, (share * force,), options={"xtol": 1e-10})
        assert found.success, found.message
        tip = found.x
    return tip
