"""Response to stationary random inputs: power spectral densities and their integrals (theory 11.4)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.response.channels import body_blocks
from modalprep.response.grid import integration_grid
from modalprep.response.inputs import Spectrum, as_spectra, uncovered
from modalprep.response.modal import Damping, ModalEquations, modal_equations
from modalprep.response.result import Collector, Response
from modalprep.response.validity import large_deflection, limits_of_validity, missing_modes
from modalprep.verdicts.notes import told

NEGATIVE = 1e-9  # eigenvalue of a correlation matrix below which it is none


@told
def random_response(
    body: FlexibleBody,
    inputs: Mapping[str, float | Spectrum],
    *,
    correlation: Literal["none", "full"] | np.ndarray = "none",
    band: tuple[float, float] | None = None,
    damping: Damping = None,
    channels: Sequence[str] = (),
) -> Response:
    """Return the power spectral densities of all channels under stationary random inputs, and their integrals.

    Parameters
    ----------
    inputs : {name: float or Spectrum}
        One-sided densities, the square of m/s^2, rad/s^2, N or N m per Hz, of ``base.x`` and so on.
    correlation : 'none', 'full' or (k, k)
        Of the inputs in their order: independent; one signal in all; or the Hermitian R of the cross spectra
        ``S_ij = R_ij sqrt(S_i S_j)``, whose absolute square is the coherence.
    band : (float, float)
        Hz; default that of all tables.
    damping : float, {Hz: ratio}, (n,), Rayleigh, or (n, n)
        Instead of the body's own, as in `modal_equations`.
    channels : sequence of str
        Names, or their beginnings, of the channels with curves; default all.

    Returns
    -------
    Response
        Peaks have ``rms``, ``three_sigma``, ``apparent_hz`` (positive zero crossings per second of a Gaussian process),
        and ``peak_density`` with ``at_hz``. Von Mises stress has its root mean square; it is not Gaussian.

    Raises
    ------
    InputError
        When an input or a channel is not known, the matrix is no correlation, there is no band, or a mode in it has
        no damping.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, chapter 20. D. J. Segalman,
    C. W. G. Fulcher, G. M. Reese, R. V. Field, An efficient method for calculating RMS von Mises stress in a random
    vibration environment, J. Sound Vib. 230 (2000) 393-410. S. O. Rice, Bell Syst. Tech. J. 23 (1944) 282. Theory 11.4.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> found = random_response(uniform_beam(modes=3), {"base.y": 1.0}, band=(0.1, 2.0), damping=0.01)
    >>> round(found.peak("tip.acceleration.y").figures["apparent_hz"], 1)
    0.6
    """
    spectra = as_spectra(inputs)
    low, high = find_band(spectra, band)
    equations = modal_equations(body, tuple(spectra), damping, high)
    _refuse_undamped(equations, low, high)
    corners = np.concatenate([x.frequency for x in spectra.values() if x.frequency is not None] or [np.zeros(0)])
    f, weight = integration_grid(low, high, corners, *equations.resonances)
    density = np.stack([x.values_at(f) for x in spectra.values()], axis=1)
    u = np.sqrt(density)[..., None] * correlation_factor(correlation, len(spectra))
    q = equations.solve(f, u)
    qdd = -((2 * np.pi * f[:, None, None]) ** 2) * q
    found = Collector(tuple(channels))
    for block in body_blocks(body, equations):
        for part in block.parts(2 * u.shape[2] * len(f)):
            S = _densities(part.values(q, qdd, u), block.mises)
            found.add(block, part, S, _figures(S, f, weight), "three_sigma")
    found.refuse_unmet()
    notes = [*missing_modes(body, equations, high), *limits_of_validity(body, equations, high)]
    notes += [*uncovered(spectra, low, high), *found.notes()]
    sigma = np.sqrt(np.tensordot(weight, (np.abs(q) ** 2).sum(-1), 1))
    notes += large_deflection(body, equations, 3 * np.diag(sigma), "deflects in one mode, at three sigma,")
    if any(block.kind == "stress" for block in body.recovery.values()):
        notes.append("three sigma of von Mises stress is three times its root mean square, though it is not Gaussian")
    return found.response("random", f, spectra, density, notes, weight)


def correlation_factor(given: str | np.ndarray, k: int) -> np.ndarray:
    """Return L (k, r) with ``L L^H = R``, the correlation of the inputs.

    Raises
    ------
    InputError
        When the matrix is no correlation.

    Examples
    --------
    >>> correlation_factor("full", 2).T
    array([[1., 1.]])
    """
    if isinstance(given, str):
        if given not in ("none", "full"):
            raise InputError(f"the correlation {given!r} is not known; give 'none', 'full' or a matrix")
        return np.eye(k) if given == "none" else np.ones((k, 1))
    R = np.asarray(given)
    if R.shape != (k, k) or not np.allclose(R, R.conj().T) or not np.allclose(np.diag(R), 1):
        raise InputError(f"the correlation of {k} inputs must be Hermitian, ({k}, {k}), with ones on its diagonal")
    values, vectors = np.linalg.eigh(R)
    if values[0] < -NEGATIVE:
        raise InputError(
            f"the coherences contradict each other: the correlation matrix has the negative eigenvalue "
            f"{values[0]:.3g}; lower them"
        )
    return vectors * np.sqrt(np.maximum(values, 0.0))


def find_band(spectra: Mapping[str, Spectrum], band: tuple[float, float] | None) -> tuple[float, float]:
    """Return the band of densities (Hz): the given one, or that of all tables.

    Raises
    ------
    InputError
        When there is none, or an input is no density.

    Examples
    --------
    >>> find_band({"base.x": Spectrum(frequency=np.array([20.0, 2000.0]), value=np.ones(2))}, None)
    (20.0, 2000.0)
    """
    for name, x in spectra.items():
        if np.any(x.value < 0) or x.phase is not None:
            raise InputError(f"the input {name} of a random response has a negative density, or a phase; correct it")
    tables = [x.band for x in spectra.values() if x.frequency is not None]
    if band is None and not tables:
        raise InputError("a random response to constant densities needs a band of frequencies")
    low, high = band or (min(a for a, _ in tables), max(b for _, b in tables))
    if not 0 < low < high:
        raise InputError(f"the band from {low:g} to {high:g} Hz must begin above 0 and ascend")
    return float(low), float(high)


def _refuse_undamped(equations: ModalEquations, low: float, high: float) -> None:
    at, ratio = equations.resonances
    some = at[(ratio <= 0) & (at >= low) & (at <= high)]
    if len(some):
        raise InputError(f"the mode at {some[0]:.4g} Hz has no damping, its random response is infinite; give damping")


def _densities(Y: np.ndarray, A: np.ndarray | None) -> np.ndarray:
    """Return densities (nf, p, c) of transfers (nf, p, c, r) to independent inputs; of stress with von Mises stress."""
    S = (np.abs(Y) ** 2).sum(-1)
    if A is None:
        return S
    mises = np.einsum("fpar,ab,fpbr->fp", Y.conj(), A, Y, optimize=True).real
    return np.concatenate([S, np.maximum(mises, 0.0)[..., None]], axis=2)


def _figures(S: np.ndarray, f: np.ndarray, weight: np.ndarray) -> dict[str, np.ndarray]:
    mean = np.tensordot(weight, S, 1)
    rms = np.sqrt(mean)
    at = np.argmax(S, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        apparent = np.sqrt(np.tensordot(weight * f**2, S, 1) / mean)
    return {
        "rms": rms,
        "three_sigma": 3 * rms,
        "apparent_hz": apparent,
        "peak_density": np.take_along_axis(S, at[None], 0)[0],
        "at_hz": f[at],
    }
