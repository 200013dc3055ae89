"""Files that a robot file names: the surfaces of its links."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.fe.readers.surface import read_surface
from modalprep.formats.robots.tree import Picture, Robot
from modalprep.vectors import VectorLike

READ = (".stl", ".obj", ".dae")


def located(name: str, folder: Path) -> str:
    """Return the path of a file that a robot file names: ``package://`` is searched in the folders above.

    Examples
    --------
    >>> located("file:///a/link.stl", Path("robots"))
    '/a/link.stl'
    >>> Path(located("meshes/link.stl", Path("/robots"))).as_posix()
    '/robots/meshes/link.stl'
    """
    if not name.startswith(("package://", "model://")):
        return str(folder.absolute() / name.removeprefix("file://"))
    inside = name.partition("://")[2]
    places = [above / part for above in (folder.absolute(), *folder.absolute().parents) for part in _parts(inside)]
    return str(next((place for place in places if place.is_file()), places[0]))


def _parts(inside: str) -> tuple[str, str]:
    """Return a path with its package, and without."""
    return inside, inside.partition("/")[2]


def drawable(robot: Robot) -> None:
    """Keep the pictures that can be drawn; a note names the others."""
    files = {each.file for pictures in robot.pictures.values() for each in pictures}
    missing = sorted(file for file in files if not _can_be_read(Path(file)))
    for name, pictures in robot.pictures.items():
        robot.pictures[name] = [each for each in pictures if each.file not in missing]
    if missing:
        names = ", ".join(Path(file).name for file in missing[:3]) + ", ..." * (len(missing) > 3)
        robot.dropped.append(f"pictures of links that are missing or neither STL, OBJ nor DAE are left out: {names}")


def _can_be_read(path: Path) -> bool:
    return path.suffix.lower() in READ and path.is_file()


def surface(path: Path, scale: VectorLike, position: VectorLike, rotation: np.ndarray) -> Picture:
    """Return a picture of a file at a place in a body."""
    return Picture(str(path), np.asarray(scale, float), np.asarray(position, float), rotation)


def pictured(body: FlexibleBody, pictures: Sequence[Picture]) -> FlexibleBody:
    """Return a rigid body that is drawn with the surfaces of its link.

    Parameters
    ----------
    pictures : sequence of Picture
        Places from the root of the body.

    Raises
    ------
    InputError
        When a file cannot be read.
    """
    if not pictures:
        return body
    points, triangles = list(body.points), []
    for each in pictures:
        vertices, corners = read_surface(Path(each.file))
        triangles.append(corners + len(points))
        points += list(each.position + (vertices * each.scale) @ np.asarray(each.rotation).T)
    shape = np.zeros((len(points), 3, body.n))
    return body.with_(points=np.array(points), cells={"triangle": np.concatenate(triangles)}, shape=shape)
