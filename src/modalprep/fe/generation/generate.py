"""Meshes from a name and a few numbers: parametric shapes of shapes.py, meshed by gmsh."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, isfinite, pi, sin
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.errors import InputError
from modalprep.fe.generation import geometries as shapes
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.read import read_mesh
from modalprep.suggest import suggestion

LENGTHS = 1e-5, 1e6  # m; gmsh merges what is nearer than 1e-7 m in solids, 1e-8 of the whole elsewhere
SLENDER = 1e6  # longest over shortest
ADVICE = (  # what libgmsh links to, also without a display
    "as root: apt-get install libgl1 libglu1-mesa libgomp1 libfontconfig1 libx11-6 libxcursor1 libxext6 libxfixes3 "
    "libxft2 libxinerama1 libxrender1"
)
OPTIONS = {  # the same input gives the same bytes
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.MshFileVersion": 4.1,
    "Mesh.Binary": 0,
    "Mesh.SecondOrderIncomplete": 1,  # 20 nodes in a hexahedron, not 27
}


@dataclass(frozen=True)
class Parameter:
    """A parameter of a shape.

    Attributes
    ----------
    name, unit, meaning : str
    default : float, int or str
    choices : tuple
        The values it may take; empty for a number.
    sign : str
        Empty when it must be positive, else ``shapes.ZERO`` or ``shapes.SIGNED``.
    """

    name: str
    unit: str
    meaning: str
    default: Any
    choices: tuple = ()
    sign: str = ""

    def read(self, value: Any) -> Any:
        """Return `value`, a number or its text, in the type of the default, or raise InputError."""
        if self.choices:
            return self._choose(value)
        try:
            number = float("no" if isinstance(value, bool) else value)
        except (TypeError, ValueError, OverflowError):
            raise InputError(f"{self.name} = {value} is not a number; give one in {self.unit or 'digits'}") from None
        whole = isinstance(self.default, int)
        if not isfinite(number) or (whole and number != int(number)):
            raise InputError(f"{self.name} = {value} is not a {'whole' if whole else 'finite'} number")
        self._refuse_range(number)
        return int(number) if whole else number

    def _choose(self, value: Any) -> Any:
        found = {str(choice): choice for choice in self.choices}
        if str(value) in found:
            return found[str(value)]
        hint = suggestion(str(value), found, "known are")
        raise InputError(f"{self.name} = {value} is unknown; {hint}")

    def _refuse_range(self, number: float) -> None:
        if (number < 0 and self.sign != shapes.SIGNED) or not (number or self.sign):
            raise InputError(f"{self.name} = {number:g} must be positive{' or zero' if self.sign else ''}")
        if self.unit == "m" and number and not LENGTHS[0] <= abs(number) <= LENGTHS[1]:
            raise InputError(f"{self.name} = {number:g} m is outside {LENGTHS[0]:g} to {LENGTHS[1]:g}; give metres")


@dataclass(frozen=True)
class Generator:
    """A shape: what `modalprep mesh --list` says of it, and the function that draws it.

    Attributes
    ----------
    name, meaning : str
    parameters : {name: Parameter}
    groups : tuple of str
        Those that depend on a parameter (hole) included.
    """

    name: str
    meaning: str
    parameters: dict[str, Parameter]
    groups: tuple[str, ...]
    draw: Callable

    def read(self, given: dict[str, Any]) -> dict[str, Any]:
        """Return all parameters, the given ones checked."""
        for name in given:
            if name not in self.parameters:
                hint = suggestion(name, self.parameters, "it has")
                raise InputError(f"shape {self.name} has no parameter {name!r}; {hint}")
        values = {k: p.read(given[k]) if k in given else p.default for k, p in self.parameters.items()}
        lengths = {k: v for k, v in values.items() if v and self.parameters[k].unit == "m" and k != "size"}
        least, most = (f(lengths, key=lengths.get) for f in (min, max))
        if lengths[most] > SLENDER * lengths[least]:
            raise InputError(f"{least} = {lengths[least]:g} m is lost beside {most} = {lengths[most]:g} m")
        return values


def _describe(draw: Callable) -> Generator:
    """Read a shape's name, groups, parameters and meaning from its function."""
    hints = get_type_hints(draw, include_extras=True)
    parameters = {}
    for name, found in inspect.signature(draw).parameters.items():
        if found.kind is inspect.Parameter.KEYWORD_ONLY:
            kind, (unit, meaning, *sign) = hints[name].__origin__, hints[name].__metadata__
            choices = get_args(kind) if get_origin(kind) is Literal else ()
            parameters[name] = Parameter(name, unit, meaning, found.default, choices, *sign)
    meaning = inspect.getdoc(draw).partition("\n")[0].rstrip(".")
    return Generator(draw.__name__.replace("_", "-"), meaning, parameters, draw.groups, draw)


GENERATORS: dict[str, Generator] = {g.name: g for g in map(_describe, shapes.SHAPES)}


def make_mesh(name: str, path: str | Path, /, **params: float | int | str) -> Mesh:
    """Generate the mesh of a parametric shape, write it (.msh 4.1) and return it as read back.

    Parameters
    ----------
    name : str
        A key of `GENERATORS`.
    path : str or Path
    **params
        The shape's parameters, numbers or their text; SI, angles in degrees.

    Returns
    -------
    Mesh
        In m, with the groups that the shape names.

    Raises
    ------
    InputError
        When the shape or a parameter is unknown, a value is impossible or leads to too many elements, the suffix
        is not .msh, or gmsh cannot be imported.

    Examples
    --------
    >>> make_mesh("plat", "plate.msh")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    modalprep.errors.InputError: unknown shape 'plat'; did you mean 'plate'? known are beam, plate, ...
    >>> GENERATORS["plate"].parameters["width"].default
    0.5
    """
    path, name = Path(path), name.replace("_", "-")
    if name not in GENERATORS:
        raise InputError(f"unknown shape {name!r}; {suggestion(name, GENERATORS, 'known are')}")
    values = GENERATORS[name].read(params)
    if path.suffix != ".msh":  # Nastran and Abaqus files lose groups of nodes and edges on the way
        raise InputError(f"cannot write {path}: generated meshes are .msh files, which keep all groups; give one")
    with atomic_path(path) as temporary, _session() as gmsh:
        _generate(gmsh, GENERATORS[name], values)
        try:
            gmsh.write(str(temporary))
        except Exception as error:  # gmsh knows no other
            raise OSError(str(error)) from error
    return read_mesh(path)


@contextmanager
def _session() -> Iterator[Any]:
    """Open gmsh, silent and with its own defaults, and close it whatever happens."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise InputError(f"gmsh cannot be imported: {error} ({ADVICE})") from None
    if gmsh.isInitialized():
        raise InputError("gmsh is open in this program, with a model of its own; call gmsh.finalize() first")
    gmsh.initialize(readConfigFiles=False, interruptible=False)  # Ctrl-C stays Python's
    try:
        for option, value in OPTIONS.items():
            gmsh.option.setNumber(option, value)
        yield gmsh
    finally:
        gmsh.finalize()


def _generate(gmsh: Any, generator: Generator, values: dict[str, Any]) -> None:
    try:
        transform = generator.draw(Drawing(gmsh), **values)
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(3)
    except Exception as error:
        if type(error) is not Exception:  # gmsh raises plain ones
            raise
        raise InputError(f"gmsh cannot mesh this {generator.name}: {error}; choose other parameters") from error
    if transform:
        tags, flat, _ = gmsh.model.mesh.getNodes()
        for tag, point in zip(tags, transform(flat.reshape(-1, 3)), strict=True):
            gmsh.model.mesh.setNode(tag, point, [])


class Drawing:
    """What shapes draw with: pieces that several of them share, on an open gmsh."""

    def __init__(self, gmsh: Any) -> None:
        self.gmsh, self.model = gmsh, gmsh.model

    def name(self, dimension: int, **members: Iterable[int]) -> None:
        """Name groups of entities of one dimension; an empty one is left out."""
        self.model.geo.synchronize()
        for name, tags in members.items():
            if tags:
                self.model.addPhysicalGroup(dimension, list(tags), name=name)

    def fill(self, least: float, most: float, element: str, order: int = 1) -> None:
        """Set the element sizes of unstructured regions, their kind and order; the least size is for round walls."""
        curved = element == "tetrahedron" and least < most  # on plane faces gmsh takes 20 s to find no curvature
        for option, value in {
            "Mesh.MeshSizeMin": least,
            "Mesh.MeshSizeMax": most,
            "Mesh.MeshSizeFromCurvature": shapes.SEGMENTS * curved,
            "Mesh.Algorithm": 8 if element == "quad" else 6,  # frontal, made for quads or for triangles
            "Mesh.RecombineAll": element in ("quad", "hexahedron"),
            "Mesh.RecombinationAlgorithm": 2 if element == "quad" else 1,  # 2: leaves no triangle
            "Mesh.ElementOrder": order,
            "Mesh.HighOrderOptimize": curved,
        }.items():
            self.gmsh.option.setNumber(option, float(value))

    def strips(self, length: float, ys: Sequence[float], size: float, element: str, rim: Sequence[int] = ()) -> dict:
        """Draw rectangles side by side, between lines at `ys` along x; structured unless a `rim` is cut out.

        Returns ``faces, rows`` (the lines at `ys`), ``root, tip`` (lines), ``corners`` (points).
        """
        geo = self.model.geo
        along, across = shapes.steps(length, size), [shapes.steps(d, size) for d in np.diff(ys)]
        shapes.refuse_too_many(along * sum(across) * (1 if element == "quad" else 2), "give a larger size")
        left, right = ([geo.addPoint(x, y, 0) for y in ys] for x in (0, length))
        rows = [geo.addLine(a, b) for a, b in zip(left, right, strict=True)]
        root, tip = ([geo.addLine(*ends) for ends in pairwise(side)] for side in (left, right))
        faces = []
        for k, number in enumerate(across):
            loop = geo.addCurveLoop([rows[k], tip[k], -rows[k + 1], -root[k]])
            faces.append(geo.addPlaneSurface([loop, *([geo.addCurveLoop(list(rim))] if rim else [])]))
            if not rim:
                self._divide({rows[k]: along, rows[k + 1]: along, root[k]: number, tip[k]: number}, faces[-1], element)
        corners = [left[0], right[0], right[-1], left[-1]]
        return {"faces": faces, "rows": rows, "root": root, "tip": tip, "corners": corners}

    def _divide(self, numbers: dict[int, int], face: int, element: str) -> None:
        """Make a face structured, with so many elements along its lines."""
        for line, number in numbers.items():
            self.model.geo.mesh.setTransfiniteCurve(line, number + 1)
        self.model.geo.mesh.setTransfiniteSurface(face)
        if element == "quad":
            self.model.geo.mesh.setRecombine(2, face)

    def rolled(
        self, length: float, radius: float, start: float, arc: float, around: int, size: float, element: str
    ) -> dict:
        """Draw a structured shell of radius `radius` about x, over `arc` (rad, from y to z) from `start`.

        Returns ``faces, rows`` (the first and the last line along x), ``root, tip`` (arcs).
        """
        geo = self.model.geo
        quarters = max(1, ceil(2 * arc / pi - 1e-9))  # arcs of gmsh stay below half a turn
        around, along = shapes.steps(around, quarters), shapes.steps(length, size)
        shapes.refuse_too_many(quarters * around * along * (1 if element == "quad" else 2), "give a larger size")
        angles = start + arc * np.arange(quarters + (arc < 2 * pi)) / quarters
        centre = geo.addPoint(0, 0, 0)
        points = [geo.addPoint(0, radius * cos(a), radius * sin(a)) for a in angles]
        root = [geo.addCircleArc(points[k], centre, points[(k + 1) % len(points)]) for k in range(quarters)]
        for curve in root:
            geo.mesh.setTransfiniteCurve(curve, around + 1)
        quads, arcs = element == "quad", [(1, curve) for curve in root]
        made = [tag for _, tag in geo.extrude(arcs, length, 0, 0, numElements=[along], recombine=quads)]
        geo.remove([(0, centre)])
        # of each arc: its copy at the tip, the face, the line at its end, the reversed line at its start
        return {"faces": made[1::4], "rows": [-made[3], made[-2]], "root": root, "tip": made[::4]}

    def circle(self, centre: tuple[float, float], radius: float, size: float) -> list[int]:
        """Draw a circle in the plane z = 0, with elements of `size` at it; return its arcs."""
        geo = self.model.geo
        rim = [geo.addPoint(x, y, 0, size) for x, y in centre + radius * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])]
        middle = geo.addPoint(*centre, 0)
        return [geo.addCircleArc(rim[k - 1], middle, rim[k]) for k in range(4)]

    def faces_within(self, low: Sequence[float], high: Sequence[float]) -> list[int]:
        """List the faces inside a box, widened by the 1e-7 m that the solid modeller adds to their bounds."""
        slack = 2e-7 + 1e-6 * max(map(abs, (*low, *high)))
        found = self.model.getEntitiesInBoundingBox(*np.subtract(low, slack), *np.add(high, slack), dim=2)
        if not found:
            raise InputError("gmsh lost a face of this solid, which is too small for its tolerance of 1e-7 m")
        return [tag for _, tag in found]
