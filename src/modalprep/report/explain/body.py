"""A modal body in plain sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.quality.effective_mass import participation, totals
from modalprep.body.stations.error import errors_at
from modalprep.response.validity import BEYOND, highest_mode
from modalprep.verdicts.notes import warnings_of

LARGE = 0.4  # of the size: the deflection at which the error of stations is told
SMALL = 0.01  # of the mass: a direction that no mode moves
TRUSTED = 0.5  # of the highest frequency: modes of a reduced body are good to about half of it
SLOW = 0.1  # of the first frequency: a spin at which the geometric stiffness changes its square by about 1 %


def explain_body(body: FlexibleBody) -> list[str]:
    """Return what a body is, what moves, what dominates, what not to trust and what to change.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> for sentence in explain_body(uniform_beam(modes=2))[:3]: print(sentence)
    'beam' has 12 kg and reaches over 10 m; its frame sits on 'root', and 'tip' is its other interface.
    Its first mode has 0.6044 Hz (1st bending in y).
    In y mode 1 at 0.6044 Hz has most of the mass, 61 %; in z mode 2 at 1.209 Hz, 61 %; no mode moves it in x.
    """
    return [*describe_body(body), *distrust(warnings_of(body.notes))]


def describe_body(body: FlexibleBody) -> list[str]:
    """Return what a body is, what moves and what dominates, without what speaks against it.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> describe_body(uniform_beam(modes=2))[-1]
    'Its deflections may reach about 1 m, a tenth of its size; beyond, use several bodies or stations.'
    """
    found = [_what(body)]
    if body.n:
        found += [_first(body), *_dominant(body), _range(body), _damping(body), _spin(body)]
    return [*found, _reach(body)]


def _what(body: FlexibleBody) -> str:
    size = float(np.ptp(np.concatenate([body.points, body.interface_position]), axis=0).max())
    root, *others = (f"'{name}'" for name in body.interface_name)
    also = {0: "", 1: f", and {''.join(others)} is its other interface"}
    more = also.get(len(others), f", and its other interfaces are {', '.join(others)}")
    return f"'{body.name}' has {body.m:.4g} kg and reaches over {size:.3g} m; its frame sits on {root}{more}."


def _first(body: FlexibleBody) -> str:
    k = int(np.argmax(body.K > 0))
    free = f"It has {k} motions without stiffness; its" if k else "Its"
    return f"{free} first {'elastic ' if k else ''}mode has {body.frequency[k]:.4g} Hz{_named(body, k)}."


def _named(body: FlexibleBody, k: int) -> str:
    return f" ({body.mode_names[k]})" if body.mode_names else ""


def _dominant(body: FlexibleBody) -> list[str]:
    """Return the mode with most of the mass in each direction; nothing where modes have no effective mass."""
    if not (body.at_root and body.normalised):
        return []
    share = participation(body)[:, :3] ** 2 / totals(body)[:3]
    said, still = [], []
    for axis, column in zip("xyz", share.T, strict=True):
        k = int(column.argmax())
        if column[k] < SMALL:
            still.append(axis)
            continue
        most = f"mode {k + 1} at {body.frequency[k]:.4g} Hz"
        said.append(f"in {axis} {most}{' has most of the mass' * (not said)}, {100 * column[k]:.0f} %")
    if still:
        said.append(f"no mode moves it in {' or '.join(still)}")
    text = "; ".join(said)
    return [f"{text[0].upper()}{text[1:]}."]


def _range(body: FlexibleBody) -> str:
    table = body.modes
    top = highest_mode(body)
    kept = f"{int(np.count_nonzero(table.kept))} of {len(table.kind)} candidate vectors are kept" if table.kind else ""
    return (
        f"{kept or f'It has {body.n} modes'}, the highest mode of the structure at {top:.4g} Hz: trust its vibrations "
        f"up to about {TRUSTED * top:.3g} Hz, half of that, unless the error against the full model says more."
    )


def _damping(body: FlexibleBody) -> str:
    ratio = body.D / (2 * np.sqrt(np.where(body.K > 0, body.K, np.inf)))
    low = 100 * ratio[body.K > 0].min(initial=1.0)
    high = 100 * ratio.max(initial=0.0)
    if not high > 0:
        return "It has no damping: resonances grow without bound; give 'damping', 0.005 to 0.03 for most structures."
    span = f"{high:.3g} %" if high - low < 0.01 * high else f"{low:.3g} to {high:.3g} %"
    least = "about" if high - low < 0.01 * high else "at least"
    return f"Its damping is {span} of critical: a resonance amplifies {least} {50 / high:.3g} times."


def _spin(body: FlexibleBody) -> str:
    elastic = body.frequency[body.frequency > 0]
    first = float(elastic[0]) if len(elastic) else 0.0
    if body.has_geometric_stiffness:
        return "Its geometric stiffness is included: it stiffens or softens as spin, acceleration and loads ask for."
    limit = 2 * np.pi * SLOW * first
    return (
        f"It has no geometric stiffness: do not spin it faster than about {limit:.2g} rad/s, a tenth of its first mode."
    )


def _reach(body: FlexibleBody) -> str:
    size = float(np.ptp(np.concatenate([body.points, body.interface_position]), axis=0).max())
    if not body.n:
        return "It is rigid."
    if body.stations:
        left = 100 * float(errors_at(body, LARGE).both[0])
        idle = body.stations.idle_below
        often = f", where its modes alone are off by more than {100 * idle:.2g} %" if idle else ""
        return (
            f"Its {len(body.stations)} stations let it deflect by up to its size{often}: bent by {100 * LARGE:.0f} % "
            f"of it, they leave about {left:.1g} %; a run says what its own deflection leaves."
        )
    reach = f"{BEYOND * size:.2g} m, a tenth of its size"
    return f"Its deflections may reach about {reach}; beyond, use several bodies or stations."


def distrust(reasons: Sequence[str]) -> list[str]:
    """Return a sentence for each reason not to trust a result, or one that there is none.

    Examples
    --------
    >>> distrust(["its size is implausible"]), distrust([])
    (['Do not trust it blindly: its size is implausible.'], ['Nothing speaks against it: it has no warnings.'])
    """
    if not reasons:
        return ["Nothing speaks against it: it has no warnings."]
    return [f"Do not trust it blindly: {note}." for note in reasons]
