"""Notes for the user on a choice of modes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.factor import Factor
from modalprep.reduction.table import FIXED, FREE, ModeTable

UNCOUNTED = (
    "modes satisfy their equation, but that none is missing is not proven: the factor that counts them did not fit "
    "into the memory in double precision, or was not accurate enough"
)
BELOW = 1e-6  # relative to a frequency: `lowest_modes` counts to 5e-7 below its highest one


def completeness(w2: np.ndarray, counted: str, kind: str) -> tuple[str, ...]:
    """Report below which frequency no mode is missing, as verified by `linalg.lowest_modes`.

    Where no factorisation gave the number of modes, the note is a warning that it is not proven.

    Parameters
    ----------
    w2 : (n,)
        Result of `lowest_modes`, without rigid-body modes.
    counted : str
        How the modes were counted.
    kind : str
        Kind of the modes.

    Examples
    --------
    >>> completeness((2 * np.pi * np.array([1.0, 2.0, 3.0])) ** 2, "a dense solver leaves none out", "fixed-interface")
    ('all 2 fixed-interface modes below 2.9999 Hz were found (a dense solver leaves none out)',)
    """
    if not len(w2):
        return ()
    if not counted:
        return (f"the {len(w2)} {kind} {UNCOUNTED}",)
    frequency = np.sqrt(w2) / (2 * np.pi)
    top = frequency[-1] * (1 - BELOW)
    digit = 10.0 ** (np.floor(np.log10(top)) - 4)
    limit = float(np.floor(top / digit) * digit)
    count = int(np.sum(frequency < limit))
    if not count:
        return (f"there are no {kind} modes below {limit:.7g} Hz ({counted})",)
    return (f"all {count} {kind} modes below {limit:.7g} Hz were found ({counted})",)


def place_of(factor: Factor) -> tuple[str, ...]:
    """Report what a factor that is large, in single precision or on disk needed.

    Examples
    --------
    >>> from scipy.sparse import csr_array
    >>> from modalprep.linalg.factor import factorise
    >>> place_of(factorise(csr_array(np.eye(2)), "superlu"))
    ()
    """
    forecast = getattr(factor, "forecast", None)
    if forecast is None or not (forecast.large or forecast.single or forecast.disk):
        return ()
    return (f"the stiffness was factorised: {forecast}",)


def more_modes(keep: str | list[int], table: ModeTable, modes: int) -> tuple[str, ...]:
    """Report that the highest candidate still satisfies a bound on frequency; `table` has the candidates only."""
    if not (isinstance(keep, str) and len(table.kept) and table.kept[-1] and "frequency" in table.reason[-1]):
        return ()
    return (
        f"the highest of the {modes} candidates, {table.frequency[-1]:.4g} Hz, still satisfies {keep!r}: "
        "there may be more modes, raise 'modes'",
    )


def fewer_modes(count: int, modes: int, kind: str) -> tuple[str, ...]:
    """Report that the model has fewer modes than asked for.

    Examples
    --------
    >>> fewer_modes(239, 1000, "fixed-interface")
    ('the model has 239 fixed-interface modes only, of the 1000 that were asked for',)
    """
    return () if count >= modes else (f"the model has {count} {kind} modes only, of the {modes} that were asked for",)


def pseudo_resonances(candidates: ModeTable, w2_t: np.ndarray) -> tuple[str, ...]:
    """Warn of a truncation vector between kept modes and among dropped ones: it combines them and is not a mode."""
    dropped = candidates.frequency[~candidates.kept]
    kept = candidates.frequency[candidates.kept]
    pseudo = np.sqrt(w2_t) / (2 * np.pi)
    among = pseudo[pseudo < min(dropped.max(initial=0.0), kept.max(initial=0.0))]
    if not len(among):
        return ()
    lowest = f"{_hertz(among.min())} Hz"
    lies = f"{len(among)} truncation vectors, the lowest at {lowest}, lie"
    mixes = "they mix"
    if len(among) == 1:
        lies = f"a truncation vector at {lowest} lies"
        mixes = "it mixes"
    return (
        f"{lies} below dropped modes (of {_hertz(dropped.min())} to {_hertz(dropped.max())} Hz), which {mixes}: static "
        "responses are exact, but resonances there are not those of the structure. A simulation excites them, the "
        "responses of this body do not; keep these modes where that band matters",
    )


def _hertz(frequency: float) -> str:
    return f"{frequency:.4g}" if frequency < 1e4 else f"{frequency:.0f}"


def dropped_in_band(table: ModeTable, up_to: float) -> tuple[str, ...]:
    """Warn when a selection drops modes below `up_to` (Hz).

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> dropped_in_band(craig_bampton(cantilever_model(), modes=4, keep="mode > 1").table, up_to=1.0)[0][:60]
    'the selection drops 1 of 1 modes below up_to = 1 Hz (0.6044 '
    """
    candidate = np.array([kind in (FIXED, FREE) for kind in table.kind], dtype=bool)
    inside = candidate & (np.nan_to_num(table.frequency, nan=np.inf) < up_to)
    dropped = table.frequency[inside & ~table.kept]
    if not len(dropped):
        return ()
    listed = ", ".join(map(_hertz, dropped[:5])) + (", ..." if len(dropped) > 5 else "")
    return (
        f"the selection drops {len(dropped)} of {inside.sum()} modes below up_to = {up_to:g} Hz ({listed} Hz): their "
        f"motion in that band is missing; add 'or frequency < {up_to:g} Hz' to keep, unless nothing excites them",
    )


def interface_boundaries(model: FEModel, truncation: Sequence[str]) -> tuple[str, ...]:
    """Report the boundaries of the interfaces if they differ, and what free ones lack."""
    names = {b: [f.name for f in model.interfaces[1:] if f.boundary == b] for b in ("fixed", "free")}
    said = []
    if names["fixed"] and names["free"]:
        said.append(
            f"mixed interfaces: {', '.join(names['fixed'])} fixed, with constraint modes; {', '.join(names['free'])} "
            "free, moving with the modes"
        )
    chosen = [name for name in truncation if name not in ("interfaces", "inertia", "derivatives")]
    if names["free"] and "interfaces" not in truncation and chosen:
        listed = ", ".join(names["free"])
        said.append(f"interface {listed} is free: static responses are exact for the loads {', '.join(chosen)} alone")
    elif names["free"] and "interfaces" not in truncation:
        said.append(
            f"interface {', '.join(names['free'])} is free and truncation_vectors leaves out 'interfaces': its static "
            "responses are only those of the kept modes"
        )
    return tuple(said)
