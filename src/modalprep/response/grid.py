"""Frequencies at which a response is computed: refined around resonances, with weights that integrate (theory 11.4)."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Legendre

NODES = 7  # of a Gauss-Lobatto rule, exact to degree 11; its ends are breakpoints


def integration_grid(
    low: float, high: float, breakpoints: np.ndarray, resonance: np.ndarray, ratio: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (Hz) from low to high and the weights of an integral over them.

    Panels end at the breakpoints, at octaves, at the resonances, and at distances of 1, 2, 4, ... half-widths from
    them, up to the middle between neighbours; each has a Gauss-Lobatto rule. The poles of a transfer function lie as
    far from a panel as it is long, so that an integral of its square has a relative error of about 1e-8.

    Parameters
    ----------
    breakpoints : (m,)
        Hz, where spectra have corners.
    resonance, ratio : (n,)
        Hz, ascending, and damping ratios; resonances without damping are left out.

    Returns
    -------
    (nf,), (nf,) float
        Frequencies, resonances included, and weights, Hz.

    References
    ----------
    P. J. Davis, P. Rabinowitz, Methods of Numerical Integration, Academic Press 1984, section 2.7; theory 11.4.

    Examples
    --------
    >>> f, weight = integration_grid(1.0, 100.0, np.zeros(0), np.array([10.0]), np.array([1e-3]))
    >>> w, H2 = f / 10, lambda w: 1 / ((1 - w**2) ** 2 + (2e-3 * w) ** 2)
    >>> bool(abs(weight @ H2(w) / (10 * np.pi / 4e-3) - 1) < 1e-3)  # the rest is outside the band
    True
    >>> f, weight = integration_grid(0.01, 1.0, np.zeros(0), np.zeros(0), np.zeros(0))
    >>> bool(abs(weight @ (1 / f) / np.log(100) - 1) < 1e-8)
    True
    """
    octaves = low * 2.0 ** np.arange(0, np.ceil(np.log2(high / low)))
    ends = np.concatenate([[low, high], octaves, breakpoints, _around(resonance, ratio, low, high)])
    ends = np.unique(ends[(ends >= low) & (ends <= high)])
    ends = ends[np.concatenate([[True], np.diff(ends) > 1e-12 * ends[1:]])]
    nodes, weights = lobatto(NODES)
    half = np.diff(ends) / 2
    f = (ends[:-1] + half)[:, None] + half[:, None] * nodes
    f[:, -1] = ends[1:]
    weight = np.zeros(len(half) * (NODES - 1) + 1)
    for k in range(NODES):
        weight[k : k + len(half) * (NODES - 1) : NODES - 1] += half * weights[k]
    return np.concatenate([f[:, :-1].ravel(), ends[-1:]]), weight


def _around(resonance: np.ndarray, ratio: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return the resonances, and points at growing distances from each up to the middle between neighbours."""
    some = (ratio > 0) & (resonance > 0)
    f = resonance[some]
    width = (ratio * resonance)[some]
    ends = np.concatenate([[min([low, *f[:1]])], (f[1:] + f[:-1]) / 2, [max([high, *f[-1:]])]])
    found = [f]
    for at, step, left, right in zip(f, width, ends[: len(f)], ends[1 : len(f) + 1], strict=True):
        for end, sign in ((left, -1.0), (right, 1.0)):
            count = max(0, int(np.ceil(np.log2(max(abs(end - at) / step, 1.0)))))
            found.append(at + sign * step * 2.0 ** np.arange(count))
    return np.concatenate(found)


def lobatto(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and weights of the Gauss-Lobatto rule of n points on [-1, 1].

    Examples
    --------
    >>> [x.round(3).tolist() for x in lobatto(3)]
    [[-1.0, 0.0, 1.0], [0.333, 1.333, 0.333]]
    """
    P = Legendre.basis(n - 1)
    x = np.concatenate([[-1.0], np.sort(P.deriv().roots().real), [1.0]])
    return x, 2 / (n * (n - 1) * P(x) ** 2)
