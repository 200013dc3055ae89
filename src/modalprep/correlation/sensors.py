"""Where to put sensors, what they tell of the whole mesh, and a synthetic test to try both."""

from __future__ import annotations

import numpy as np

from modalprep.correlation.criteria import sensor_inverse
from modalprep.correlation.mode_set import ModeSet
from modalprep.errors import InputError


def choose_sensors(modes: ModeSet, count: int, candidates: np.ndarray | None = None) -> np.ndarray:
    """Choose the components that tell the modes apart best, by effective independence.

    From all candidates the component is dropped, one after the other, that adds least to the determinant of the Fisher
    information of the modal coordinates, the smallest diagonal entry of ``A (A^T A)^-1 A^T``.

    Parameters
    ----------
    modes : ModeSet
        The target modes, real.
    count : int
        Components to keep, at least as many as modes.
    candidates : (p, 3) bool or None
        Components where a sensor may sit; default: all that are known.

    Returns
    -------
    (p, 3) bool

    Raises
    ------
    InputError
        When `count` is smaller than the number of modes, or the candidates cannot tell the modes apart.

    References
    ----------
    D. C. Kammer, Sensor placement for on-orbit modal identification and correlation of large space structures, J.
    Guidance, Control, and Dynamics 14 (1991) 251.

    Examples
    --------
    >>> from modalprep.correlation import body_modes
    >>> from modalprep.examples import uniform_beam
    >>> chosen = choose_sensors(body_modes(uniform_beam(modes=4)), 4)
    >>> int(chosen.sum()), bool(chosen[-1, 1]), bool(chosen[-1, 2])  # the tip, in both directions of bending
    (4, True, True)
    """
    allowed = modes.measured if candidates is None else modes.measured & candidates
    if not modes.n <= count <= allowed.sum():
        raise InputError(f"{count} sensors: give from {modes.n} (one for each mode) to {allowed.sum()} (candidates)")
    rows = modes.shape[allowed]
    sensor_inverse(rows)
    left = np.arange(len(rows))
    A = np.linalg.qr(rows)[0]
    while len(left) > count:
        worth = (A**2).sum(axis=1)
        worst = int(np.argmin(worth))
        left = np.delete(left, worst)
        A = _without(A, worst)
    chosen = np.zeros(modes.measured.shape, dtype=bool)
    at = np.argwhere(allowed)[left]
    chosen[at[:, 0], at[:, 1]] = True
    return chosen


def _without(A: np.ndarray, row: int) -> np.ndarray:
    """Return orthonormal columns (d - 1, n) of the rest of orthonormal columns (d, n) without a row.

    ``(1 - a a^T)^-1/2 = 1 + c a a^T`` for the row a, with ``c = (1 / sqrt(1 - a.a) - 1) / a.a``.
    """
    a = A[row]
    square = float(a @ a)
    rest = np.delete(A, row, axis=0)
    if square < 1e-300:
        return rest
    return rest + np.outer(rest @ a, a) * ((1 / np.sqrt(1 - square) - 1) / square)


def expand(test: ModeSet, node: np.ndarray, analysis: ModeSet) -> ModeSet:
    """Expand test modes from the sensors to all points of the analysis, in the span of its modes (SEREP).

    Parameters
    ----------
    test : ModeSet
        Real modes.
    node : (p,) int
        Point of the analysis for each test point, as `Correlation.node`.
    analysis : ModeSet
        Of the whole mesh.

    Returns
    -------
    ModeSet
        At the points of the analysis, in the scale of the test.

    Raises
    ------
    InputError
        When the sensors cannot tell the analysis modes apart.

    References
    ----------
    J. O'Callahan, P. Avitabile, R. Riemer, System equivalent reduction expansion process (SEREP), IMAC 1989.

    Examples
    --------
    >>> from modalprep.correlation import body_modes
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=4))
    >>> few = modes.with_(points=modes.points[::8], shape=modes.shape[::8], labels=modes.labels[::8])
    >>> bool(np.allclose(expand(few, np.arange(0, 41, 8), modes).shape, modes.shape))
    True
    """
    known = test.measured
    weights = sensor_inverse(test.sees(analysis.shape[node])[known]) @ test.shape[known]
    return test.with_(
        points=analysis.points,
        labels=analysis.labels,
        shape=analysis.shape @ weights,
        lines=np.zeros((0, 2), dtype=int),
        axes=None,
    )


def synthetic_test(
    modes: ModeSet, sensors: np.ndarray, *, noise: float = 0.0, frequency_error: float = 0.0, seed: int = 0
) -> ModeSet:
    """Return modes as a test would measure them: at some components, with noise, of arbitrary scale.

    Parameters
    ----------
    modes : ModeSet
    sensors : (p, 3) bool
        Measured components, as `choose_sensors` gives them.
    noise : float
        Standard deviation of the noise relative to the largest measured displacement of each mode.
    frequency_error : float
        Standard deviation of the relative error of the frequencies.
    seed : int

    Returns
    -------
    ModeSet
        At the points that have a sensor; each mode has the largest displacement 1.

    Examples
    --------
    >>> from modalprep.correlation import body_modes, correlate
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=4))
    >>> correlate(synthetic_test(modes, choose_sensors(modes, 8), noise=0.01), modes).pair_mac.min().round(2)
    np.float64(1.0)
    """
    random = np.random.default_rng(seed)
    points = np.flatnonzero(sensors.any(axis=1))
    shape = np.where(sensors[points][:, :, None], modes.shape[points], np.nan)
    largest = np.nanmax(np.abs(shape), axis=(0, 1))
    shape = shape / np.where(largest > 0, largest, 1.0) + noise * random.standard_normal(shape.shape)
    frequency = modes.frequency * (1 + frequency_error * random.standard_normal(modes.n))
    return modes.with_(
        name=f"test of {modes.name}",
        points=modes.points[points],
        labels=modes.labels[points],
        shape=shape,
        frequency=frequency,
        lines=np.zeros((0, 2), dtype=int),
        unit_mass=False,
    )
