"""Modes and frequency responses of a system: a table for the terminal, a chart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from modalprep.atomic import write_columns, write_table
from modalprep.multibody.analysis.inverse_kinematics import InverseKinematics
from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.multibody.analysis.system_modes import SystemModes
from modalprep.report.charts import plots
from modalprep.report.charts.figures import Figure, named, save_figure
from modalprep.report.linear import draw_bode, response_pairs
from modalprep.report.tables import hertz, percent
from modalprep.report.terminal import plain_table, print_table, right_aligned

GROWS = 1e-9  # real part over size of an eigenvalue: less is round-off


def system_table(modes: SystemModes, count: int, console: Console) -> None:
    """Print frequency, damping ratio in % and the joint or body with the largest motion, of the lowest `count` modes.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.analysis.system_modes import system_modes
    >>> from modalprep.multibody.model.system import System
    >>> weld = Joint(name="wall", type="weld", parent="ground", child="beam")
    >>> found = system_modes(System(bodies={"beam": uniform_beam(modes=2)}, joints=(weld,)))
    >>> system_table(found, 1, Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    Modes of the system
            Hz   damping %   moves most...
    1   0.6044           .   beam...
    """
    said = [course(z) for z in modes.eigenvalue.tolist()[:count]]
    figures = right_aligned("", "Hz", "damping %", no_wrap=False)
    rich = plain_table(*figures, "moves most", *(["course"] if any(said) else []))
    for k, moves in enumerate(most_moved(modes)[:count]):
        swings = modes.eigenvalue[k].imag != 0 or modes.frequency[k] == 0
        numbers = (hertz(modes.frequency[k]), percent(modes.damping[k])) if swings else (".", ".")
        rich.add_row(str(k + 1), *numbers, Text(moves), *([said[k]] if any(said) else []))
    console.print(Text("Modes of the system", "bold"))
    print_table(rich, console)


def kinematics_table(found: InverseKinematics, console: Console) -> None:
    """Print positions and speeds of the joints, what is left of the targets, and what they leave open.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.analysis.inverse_kinematics import Target, inverse_kinematics
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.system import System
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> tip = Target(at=f"arm.{arm.bodies['arm'].interface_name[1]}", position=(0.0, 10.0, float("nan")))
    >>> kinematics_table(inverse_kinematics(arm, [tip]), Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    Start values of the joints
    joint...
    hinge   1.5708         0...
    """
    rich = plain_table("joint", "position (m, rad)", "speed (m/s, rad/s)")
    for name, place in found.joints.items():
        rich.add_row(Text(name), _numbers(place), _numbers(found.joint_rates[name]))
    console.print(Text("Start values of the joints", "bold"))
    print_table(rich, console)
    for name, error in found.errors.items():
        console.print(Text(f"  {name} is met to {np.linalg.norm(error):.1e}"))
    if found.freedom:
        console.print(Text(f"  open: {found.freedom} motions of {', '.join(found.open)}, which moved little"))


def _numbers(values: np.ndarray) -> str:
    return ", ".join(f"{value:.6g}" for value in values + 0.0)  # no negative zeros


def course(z: complex) -> str:
    """Say how a mode goes on that does not just vibrate, by its eigenvalue (1/s).

    Examples
    --------
    >>> course(-0.1 + 2j), course(0.1 + 2j), course(3.0 + 0j)
    ('', 'unstable: grows by 0.1 1/s', 'unstable: grows by 3 1/s, without vibration')
    >>> course(-3.0 + 0j)
    'decays by 3 1/s, without vibration'
    """
    if not z.imag and z.real < 0:
        return f"decays by {-z.real:.4g} 1/s, without vibration"
    grows = z.real > GROWS * abs(z)
    return f"unstable: grows by {z.real:.4g} 1/s" + ("" if z.imag else ", without vibration") if grows else ""


def most_moved(modes: SystemModes) -> list[str]:
    """Return the joint or body whose coordinate is the largest in each mode."""
    parts = [(name, rows) for kind in (modes.joints, modes.modal) for name, rows in kind.items() if len(rows)]
    if not parts:
        return []
    sizes = np.array([np.abs(rows).max(axis=0) for _, rows in parts])
    return [parts[k][0] for k in np.argmax(sizes, axis=0)]


def response_plot(linear: LinearSystem, frequency: np.ndarray, H: np.ndarray, path: str | Path) -> Path:
    """Draw amplitude and phase of responses ``H (nf, no, ni)`` over frequency (nf,), Hz.

    Examples
    --------
    >>> import tempfile
    >>> mass = LinearSystem(A=np.zeros((2, 2)), B=np.zeros((2, 1)), C=np.zeros((1, 2)), D=np.ones((1, 1)),
    ...                     states=("x", "v"), inputs=("f",), outputs=("x",))
    >>> response_plot(mass, np.array([1.0, 2.0]), np.ones((2, 1, 1)), Path(tempfile.mkdtemp()) / "x.png").name
    'x.png'
    """
    figure = Figure(figsize=(9.0, 6.2), layout="constrained")
    amplitude, phase = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    draw_bode(amplitude, phase, linear, frequency, H)
    return save_figure(figure, path)


def write_response(linear: LinearSystem, frequency: np.ndarray, H: np.ndarray, path: str | Path) -> Path:
    """Write real and imaginary part of every response over frequency (Hz) as columns of a CSV file."""
    columns = {"frequency": frequency}
    for label, values in response_pairs(linear, H):
        columns |= {f"{label} re": np.real(values), f"{label} im": np.imag(values)}
    return write_columns(columns, path)


def sweep_plot(
    sweep: Mapping[float, SystemModes],
    count: int,
    path: str | Path,
    *,
    label: str = "time (s)",
    reference: Sequence[Mapping[str, Any]] = (),
) -> Path:
    """Draw frequencies and growth rates of the lowest `count` modes that vibrate or grow over the times of a sweep.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.analysis.system_modes import system_modes
    >>> from modalprep.multibody.model.system import System
    >>> wall = Joint(name="wall", type="weld", parent="ground", child="beam")
    >>> found = system_modes(System(bodies={"beam": uniform_beam(modes=2)}, joints=(wall,)))
    >>> sweep_plot({0.0: found, 1.0: found}, 2, Path(tempfile.mkdtemp()) / "x.png").name
    'x.png'
    """
    figure = Figure(figsize=(9.0, 6.2), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    found = [(t, z.imag, z.real) for t, modes in sweep.items() for z in _vibrations(modes, count)]
    rows = np.array(found).reshape(-1, 3)
    upper.plot(rows[:, 0], rows[:, 1] / (2 * np.pi), ".", color=plots.CURVES[0], markersize=4, label="modes")
    lower.plot(rows[:, 0], rows[:, 2], ".", color=plots.CURVES[1], markersize=4)
    for curve in reference:
        upper.plot(curve["t"], curve["y"], "o", color=plots.INK, markerfacecolor="none", label=named(curve["label"]))
    upper.set(ylabel="frequency (Hz)", ylim=(0, None))
    lower.set(xlabel=label, ylabel="growth (1/s)")
    plots.add_head(upper, "Modes over time" if label == "time (s)" else f"Modes over {label}")
    for axes in (upper, lower):
        plots.plain_axes(axes, grid="both")
    return save_figure(figure, path)


def write_sweep(sweep: Mapping[float, SystemModes], count: int, path: str | Path) -> Path:
    """Write the eigenvalues (1/s) of the lowest `count` modes that vibrate or grow, a row for each time."""
    header = ["t", *(f"mode {k + 1} {part}" for k in range(count) for part in ("re", "im"))]
    rows = [(t, *(x for z in _vibrations(modes, count) for x in (z.real, z.imag))) for t, modes in sweep.items()]
    return write_table(header, rows, path)


def _vibrations(modes: SystemModes, count: int) -> list[complex]:
    """Return the eigenvalues of the lowest `count` modes that vibrate or grow."""
    return [z for z in modes.eigenvalue.tolist() if z.imag > 0 or z.real > 0][:count]
