"""System modes of welded bodies: a table, a chart of strain energy, pictures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from modalprep.reduction.synthesis import SynthesisedModes
from modalprep.report.charts import plots
from modalprep.report.charts.figures import Figure, named, save_figure
from modalprep.report.pictures.sheet import render_modes
from modalprep.report.scene.record import Scene
from modalprep.report.tables import hertz, percent
from modalprep.report.terminal import plain_table, print_table, right_aligned


def synthesis_table(
    modes: SynthesisedModes, fractions: Mapping[str, np.ndarray], console: Console, damping: np.ndarray | None = None
) -> None:
    """Print one row per system mode: frequency, strain energy in each body in %, damping ratio in %.

    Parameters
    ----------
    modes : SynthesisedModes
    fractions : {name: (s,)}
        Fraction of each body in the strain energy.
    console : Console
    damping : (elastic modes,) or None

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.reduction.synthesis import synthesise
    >>> arm = uniform_beam(modes=4)
    >>> pair = synthesise({"a": arm, "b": arm}, [("a.tip", "b.root")], modes=7)
    >>> synthesis_table(pair, {"a": np.zeros(7), "b": np.zeros(7)}, Console(width=80, color_system=None))
    ... # doctest: +ELLIPSIS
    System modes...
    7 modes of 2 bodies, 6 of them rigid-body modes.
    """
    heads = ("", "Hz", *fractions, *(["damping"] if damping is not None else []))
    rich = plain_table(*right_aligned(*map(Text, heads), no_wrap=False))
    for k, frequency in enumerate(modes.frequency):
        elastic = k >= modes.rigid
        cells = [percent(share[k]) if elastic else "" for share in fractions.values()]
        if damping is not None:
            cells.append(f"{100 * damping[k - modes.rigid]:.3g}" if elastic else "")
        rich.add_row(str(k + 1), hertz(frequency), *cells)
    head = ("System modes", "bold"), (": strain energy in each body and damping ratio, %", "dim")
    console.print(Text.assemble(*head))
    print_table(rich, console)
    without = f", {modes.rigid} of them rigid-body modes" if modes.rigid else ""
    console.print(Text(f"{len(modes.frequency)} modes of {len(modes.bodies)} bodies{without}."))


def strain_plot(modes: SynthesisedModes, fractions: Mapping[str, np.ndarray], path: str | Path) -> Path:
    """Draw the strain energy of each body in each elastic mode, stacked to 100 %."""
    figure = Figure(figsize=(9.0, 3.9), layout="constrained")
    axes = figure.add_subplot()
    elastic = np.arange(modes.rigid, len(modes.frequency))
    below = np.zeros(len(elastic))
    for rank, (name, share) in enumerate(fractions.items()):
        height = 100 * share[elastic]
        axes.bar(elastic + 1, height, bottom=below, label=named(name), color=plots.COLOURS[rank % len(plots.COLOURS)])
        below += height
    axes.set_xticks(elastic + 1, [f"{k + 1}\n{hertz(modes.frequency[k])}" for k in elastic])
    axes.set_xlabel("system mode, Hz")
    axes.set_ylabel("strain energy (%)")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=6, frameon=False)
    plots.plain_axes(axes, grid="y")
    return save_figure(figure, path)


def assembled(modes: SynthesisedModes, name: str) -> Scene:
    """Return all bodies as one for drawing, with their names at the node nearest to their centre."""
    names = list(modes.bodies)
    points, shapes = ([of(n) for n in names] for of in (modes.points, modes.nodal_shape))
    start = np.cumsum([0, *map(len, points)])
    cells: dict[str, list[np.ndarray]] = {}
    for first, body in zip(start, modes.bodies.values(), strict=False):
        for kind, nodes in body.cells.items():
            cells.setdefault(kind, []).append(nodes + first)
    middle = [int(np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1))) for x in points]
    return Scene(
        name=name,
        points=np.vstack(points),
        cells={kind: np.vstack(parts) for kind, parts in cells.items()},
        shape=np.concatenate(shapes),
        phi=np.array([shape[k] for shape, k in zip(shapes, middle, strict=True)]),
        frequency=modes.frequency,
        interface_name=tuple(names),
        interface_position=np.array([x[k] for x, k in zip(points, middle, strict=True)]),
    )


def draw_modes(modes: SynthesisedModes, name: str, folder: Path, count: int) -> list[Path]:
    """Draw the first `count` elastic modes as ``<name>-system-mode-<number>.png``.

    Raises
    ------
    RenderError
        When the machine cannot draw.
    """
    body = assembled(modes, name)
    chosen = range(modes.rigid + 1, min(modes.rigid + count, body.n) + 1)
    return list(render_modes(body, {mode: folder / f"{name}-system-mode-{mode:02d}.png" for mode in chosen}))
