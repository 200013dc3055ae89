"""Response to harmonic inputs over frequency (theory 11.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.response.channels import Block, body_blocks
from modalprep.response.grid import integration_grid
from modalprep.response.inputs import Spectrum, as_spectra, uncovered
from modalprep.response.modal import Damping, ModalEquations, modal_equations
from modalprep.response.result import Collector, Response
from modalprep.response.validity import large_deflection, limits_of_validity, missing_modes
from modalprep.verdicts.notes import told


@told
def harmonic_response(
    body: FlexibleBody,
    inputs: Mapping[str, float | Spectrum],
    frequency: Sequence[float] | np.ndarray,
    *,
    damping: Damping = None,
    refine: bool = True,
    channels: Sequence[str] = (),
) -> Response:
    """Return the complex amplitudes of all channels under harmonic inputs ``Re(u exp(i w t))``.

    Parameters
    ----------
    inputs : {name: float or Spectrum}
        Amplitudes, m/s^2, rad/s^2, N or N m, of ``base.x`` and so on; all of them act together.
    frequency : (nf,)
        Hz, ascending.
    damping : float, {Hz: ratio}, (n,), Rayleigh, or (n, n)
        Instead of the body's own, as in `modal_equations`.
    refine : bool
        Add the resonances, with points around them.
    channels : sequence of str
        Names, or their beginnings, of the channels with curves; default all.

    Returns
    -------
    Response
        Peaks have ``peak``, ``at_hz`` and ``phase_deg``.

    Raises
    ------
    InputError
        When an input or a channel is not known, frequencies descend, or one is that of a mode without damping.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, chapter 11; theory 11.3.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> found = harmonic_response(uniform_beam(modes=3), {"base.y": 1.0}, [0.1, 1.0], damping=0.01)
    >>> found.peak("tip.acceleration.y").figures["at_hz"]
    0.604
    """
    spectra = as_spectra(inputs)
    f = _ascending(np.asarray(frequency, dtype=float))
    equations = modal_equations(body, tuple(spectra), damping, f[-1])
    f = _axis(f, equations, spectra, refine)
    u = np.stack([x.values_at(f) for x in spectra.values()], axis=1).astype(complex)
    q = equations.solve(f, u[..., None])
    qdd = -((2 * np.pi * f[:, None, None]) ** 2) * q
    found = Collector(tuple(channels))
    for block in body_blocks(body, equations):
        for part in block.parts(2 * len(f)):
            s = part.values(q, qdd, u[..., None])[..., 0]
            values = with_largest_mises(block, s)
            found.add(block, part, values, _figures(values, f), "peak")
    found.refuse_unmet()
    notes = [*missing_modes(body, equations, f[-1]), *limits_of_validity(body, equations, f[-1])]
    notes += large_deflection(body, equations, q[..., 0])
    notes += [*uncovered(spectra, f[0], f[-1]), *_undamped(equations, f)]
    return found.response("harmonic", f, spectra, u, [*notes, *found.notes()])


def _ascending(f: np.ndarray) -> np.ndarray:
    if f.ndim != 1 or not len(f) or f[0] < 0 or np.any(np.diff(f) <= 0):
        raise InputError("the frequencies of a harmonic response must not be negative, and ascend")
    return f


def _axis(f: np.ndarray, equations: ModalEquations, spectra: Mapping[str, Spectrum], refine: bool) -> np.ndarray:
    if not refine or len(f) < 2:
        return f
    low = f[0] or f[1]
    corners = np.concatenate([x.frequency for x in spectra.values() if x.frequency is not None] or [np.zeros(0)])
    return np.unique(np.concatenate([f, integration_grid(low, f[-1], corners, *equations.resonances)[0]]))


def _figures(values: np.ndarray, f: np.ndarray) -> dict[str, np.ndarray]:
    """Return peak (p, c), its frequency and its phase."""
    size = np.abs(values)
    at = np.argmax(size, axis=0)
    peak = np.take_along_axis(values, at[None], 0)[0]
    return {"peak": np.abs(peak), "at_hz": f[at], "phase_deg": np.degrees(np.angle(peak))}


def with_largest_mises(block: Block, s: np.ndarray) -> np.ndarray:
    """Return amplitudes (nf, p, c), of stress with the largest von Mises stress in a cycle as a further component."""
    return s if block.mises is None else np.concatenate([s, largest_mises(s, block.mises)[..., None]], axis=2)


def largest_mises(s: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Return the largest von Mises stress in a cycle of complex stress ``s (..., c)``.

    With ``s(t) = Re(s exp(i w t))`` the square is ``(s^H A s + Re(s^T A s exp(2 i w t))) / 2``.

    Examples
    --------
    >>> largest_mises(np.array([3j]), np.eye(1))
    np.float64(3.0)
    """
    As = s @ A
    return np.sqrt(np.maximum(((As * s.conj()).sum(-1).real + np.abs((As * s).sum(-1))) / 2, 0.0))


def _undamped(equations: ModalEquations, f: np.ndarray) -> list[str]:
    """Say that the peaks at modes without damping have no bound."""
    at, ratio = equations.resonances
    some = at[(ratio <= 0) & (at >= f[0]) & (at <= f[-1])]
    shown = ", ".join(f"{x:.4g}" for x in some[:5]) + ", ..." * (len(some) > 5)
    return (
        [f"modes without damping in the band, whose peaks have no bound: {shown} Hz; give damping"] if len(some) else []
    )
