"""Linear equations: their Bode diagram, Nyquist diagram and root locus."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.analysis.root_locus import zeros_of_loop
from modalprep.multibody.analysis.state_space import LinearSystem, frequency_response
from modalprep.report.charts import plots
from modalprep.report.charts.figures import Axes, named
from modalprep.suggest import suggestion

POINTS, GAINS = 600, 600  # of a response over frequency, and of a root locus
BEYOND = 3.0  # times the fastest pole, and parts of the slowest one: the ends of the frequencies
RIGID, UNDAMPED = 1e-6, 1e-9  # of the largest pole and of a pole: less is round-off
AROUND = np.tan(np.linspace(-1.5, 1.5, 41))  # even steps of the phase of a resonance, in its half-widths
MARGIN = 1.2  # of a root locus about its poles and zeros
CUT = 10.0  # magnitude at which a response that goes to infinity is cut, times its median or 1


def chosen_loop(linear: LinearSystem, given: str | None, output: str | None) -> LinearSystem:
    """Return the equations with one of their inputs and one of their outputs, or all where None is named.

    Examples
    --------
    >>> two = LinearSystem(A=np.zeros((1, 1)), B=np.ones((1, 2)), C=np.ones((1, 1)), D=np.zeros((1, 2)),
    ...                    states=("v",), inputs=("f", "g"), outputs=("v",))
    >>> chosen_loop(two, "g", None).inputs
    ('g',)
    """
    i = _places(given, linear.inputs, "input")
    o = _places(output, linear.outputs, "output")
    return LinearSystem(
        A=linear.A,
        B=linear.B[:, i],
        C=linear.C[o],
        D=linear.D[np.ix_(o, i)],
        states=linear.states,
        inputs=tuple(linear.inputs[k] for k in i),
        outputs=tuple(linear.outputs[k] for k in o),
        notes=linear.notes,
    )


def _places(name: str | None, known: tuple[str, ...], what: str) -> list[int]:
    if name is None:
        return list(range(len(known)))
    if name not in known:
        raise InputError(f"the linear equations have no {what} {name!r}; {suggestion(name, known, 'they have')}")
    return [known.index(name)]


def telling_frequencies(linear: LinearSystem) -> np.ndarray:
    """Return frequencies (Hz) from below the slowest to above the fastest pole, closer about damped resonances.

    Examples
    --------
    >>> lag = LinearSystem(A=-np.ones((1, 1)), B=np.ones((1, 1)), C=np.ones((1, 1)), D=np.zeros((1, 1)),
    ...                    states=("v",), inputs=("f",), outputs=("v",))
    >>> (2 * np.pi * telling_frequencies(lag)[[0, -1]]).round(6).tolist()
    [0.333333, 3.0]
    """
    poles = linear.poles
    poles = poles[np.abs(poles) > RIGID * np.abs(poles).max(initial=0.0)]
    if not len(poles):
        return np.geomspace(1e-2, 1e2, POINTS)
    size = np.abs(poles)
    wide = np.geomspace(size.min() / BEYOND, size.max() * BEYOND, POINTS)
    damped = poles[(poles.imag > 0) & (np.abs(poles.real) > UNDAMPED * size)]
    near = np.ravel(damped.imag + np.outer(AROUND, damped.real))
    inside = near[(near > wide[0]) & (near < wide[-1])]
    return np.unique(np.append(wide, inside)) / (2 * np.pi)


def unlimited(linear: LinearSystem) -> bool:
    """Say whether a pole is undamped, and the response there infinite.

    Examples
    --------
    >>> mass = LinearSystem(A=np.zeros((1, 1)), B=np.ones((1, 1)), C=np.ones((1, 1)), D=np.zeros((1, 1)),
    ...                     states=("v",), inputs=("f",), outputs=("v",))
    >>> unlimited(mass)
    True
    """
    poles = linear.poles
    largest = np.abs(poles).max(initial=0.0)
    return bool(np.any(np.abs(poles.real) <= np.maximum(UNDAMPED * np.abs(poles), RIGID * UNDAMPED * largest)))


def draw_bode(amplitude: Axes, phase: Axes, linear: LinearSystem, frequency: np.ndarray, H: np.ndarray) -> None:
    """Draw amplitude and phase of responses ``H (nf, no, ni)`` over frequency (nf,), Hz."""
    for number, (label, values) in enumerate(response_pairs(linear, H)):
        style = {"linewidth": 2.0, **plots.curve_style(number)}
        amplitude.plot(frequency, np.abs(values), label=named(label), **style)
        phase.plot(frequency, np.degrees(np.angle(values)), **style)
    amplitude.set(xscale="log", yscale="log" if np.all(np.abs(H) > 0) else "linear", ylabel="output per unit input")
    phase.set(xlabel="frequency (Hz)", ylabel="phase (deg)", yticks=range(-180, 181, 90))
    plots.add_head(amplitude, "Frequency response")
    for axes in (amplitude, phase):
        plots.plain_axes(axes, grid="both")


def draw_nyquist(axes: Axes, linear: LinearSystem, frequency: np.ndarray) -> None:
    """Draw the responses in the complex plane, for negative frequencies broken, and the point -1."""
    responses = frequency_response(linear, frequency)
    for number, (label, values) in enumerate(response_pairs(linear, responses)):
        style = plots.curve_style(number)
        real, imaginary = np.real(values), np.imag(values)
        axes.plot(real, imaginary, linewidth=2.0, label=named(label), **style)
        axes.plot(real, -imaginary, linewidth=1.0, color=style["color"], linestyle=plots.LINES[1])
    axes.plot(-1, 0, "+", color=plots.INK, markersize=11, markeredgewidth=1.8)
    axes.set(xlabel="real part of output per input", ylabel="imaginary part")
    title = "Nyquist diagram"
    cut = unlimited(linear)
    if cut:
        limit = CUT * max(1.0, float(np.median(np.abs(responses))))
        axes.set(xlim=(-limit, limit), ylim=(-limit, limit))
        title += f", cut at {limit:.3g}: a pole is undamped"
    axes.set_aspect("equal", adjustable="box" if cut else "datalim")
    plots.add_head(axes, title)
    plots.plain_axes(axes, grid="both")


def draw_root_locus(axes: Axes, linear: LinearSystem, gains: np.ndarray, branches: np.ndarray) -> None:
    """Draw the poles (nk, nz) of a loop over its gains (nk,), those without gain as crosses, the zeros as circles."""
    zeros = zeros_of_loop(linear)
    for number, branch in enumerate(branches.T):
        axes.plot(branch.real, branch.imag, linewidth=1.8, color=plots.curve_style(number)["color"])
    axes.plot(linear.poles.real, linear.poles.imag, "x", color=plots.INK, label="poles of the open loop")
    axes.plot(zeros.real, zeros.imag, "o", color=plots.INK, markerfacecolor="none", label="zeros")
    axes.axvline(0.0, color=plots.GREY, linewidth=1.0, zorder=1)
    _limit(axes, np.append(linear.poles, zeros))
    axes.set(xlabel="growth (1/s)", ylabel="angular frequency (rad/s)")
    plots.add_head(axes, f"{linear.inputs[0]} = -k {linear.outputs[0]}, k from {gains.min():.3g} to {gains.max():.3g}")
    plots.plain_axes(axes, grid="both")


def telling_gains(linear: LinearSystem) -> np.ndarray:
    """Return zero and gains (nk,) from where the loop is weak everywhere to where it is strong at most frequencies.

    Examples
    --------
    >>> lag = LinearSystem(A=-np.ones((1, 1)), B=np.ones((1, 1)), C=np.ones((1, 1)), D=np.zeros((1, 1)),
    ...                    states=("v",), inputs=("f",), outputs=("v",))
    >>> telling_gains(lag)[[0, -1]].round(-1).tolist()
    [0.0, 1410.0]
    """
    size = np.abs(frequency_response(linear, telling_frequencies(linear)))
    size = size[size > 0]
    if not len(size):
        return np.zeros(1)
    return np.append(0.0, np.geomspace(1e-3 / size.max(), 1e3 / np.median(size), GAINS))


def _limit(axes: Axes, places: np.ndarray) -> None:
    """Show the poles of the open loop and the zeros, with room; branches leave for infinity."""
    reach = MARGIN * (np.abs(places).max(initial=0.0) or 1.0)
    wide = max(MARGIN * 2 * np.abs(np.real(places)).max(initial=0.0), 0.25 * reach)
    axes.set(xlim=(-wide, wide), ylim=(-reach, reach))


def response_pairs(linear: LinearSystem, H: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the name and the values (nf,) of each output per input of ``H (nf, no, ni)``."""
    for o, output in enumerate(linear.outputs):
        for i, given in enumerate(linear.inputs):
            yield f"{output} / {given}", H[:, o, i]
