"""What stands around the bodies of an MJCF file: included files, settings of the compiler, defaults, orientations."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from functools import reduce
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.formats.robots.xml import numbers, some
from modalprep.suggest import refuse_missing

REFUSED = {  # settings of <compiler> that change masses after the file is read, with what leaves them as they are
    "settotalmass": "-1",
    "boundmass": "0",
    "boundinertia": "0",
    "balanceinertia": "false",
    "coordinate": "local",
}
MAIN = "main"  # class of the defaults at the top


@dataclass(frozen=True)
class MjcfFile:
    """The root element with its included files, and what its compiler and its defaults say.

    Attributes
    ----------
    settings : {str: str}
        Attributes of <compiler>.
    parents : {class: class}
        Of the classes of defaults.
    defaults : {class: {tag: {attribute: str}}}
        Without those of their parents.
    """

    root: ET.Element
    folder: Path
    settings: dict[str, str] = field(default_factory=dict)
    parents: dict[str, str] = field(default_factory=dict)
    defaults: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)

    @classmethod
    def of(cls, root: ET.Element, folder: Path) -> MjcfFile:
        """Return the file of a root element; `folder` is where its files are."""
        file = cls(root, folder)
        _include(root, folder, ())
        for compiler in root.findall("compiler"):
            file.settings.update(compiler.attrib)
        for name, harmless in REFUSED.items():
            if file.settings.get(name, harmless) != harmless:
                raise InputError(
                    f"<compiler {name}={file.settings[name]!r}> is not read; write the compiled model by "
                    "mujoco.mj_saveLastXML, and take that"
                )
        for default in root.findall("default"):
            file._add_class(default, "")
        return file

    def _add_class(self, element: ET.Element, parent: str) -> None:
        name = element.get("class", MAIN) if parent else MAIN
        if parent:
            self.parents[name] = parent
        own = self.defaults.setdefault(name, {})
        for child in element:
            if child.tag == "default":
                self._add_class(child, name)
            else:
                own.setdefault(child.tag, {}).update(child.attrib)

    def complete(self, element: ET.Element, among: str) -> ET.Element:
        """Return an element with the defaults of its class, or of the class of what it is among."""
        name = element.get("class", among) or MAIN
        if name != MAIN and name not in self.parents:
            raise InputError(f"<{element.tag} class={name!r}>: the file has no defaults of this class")
        line = [name]
        while line[-1] in self.parents:
            line.append(self.parents[line[-1]])
        given = [self.defaults.get(each, {}).get(element.tag, {}) for each in reversed(line)]
        found = ET.Element(element.tag)
        found.attrib.update(_together([*given, element.attrib]))
        return found

    def angle(self, value: float) -> float:
        """Return an angle of the file in rad."""
        return value if self.settings.get("angle", "degree") == "radian" else float(np.deg2rad(value))

    def pose(self, element: ET.Element) -> tuple[np.ndarray, np.ndarray]:
        """Return position and rotation of an element in the axes around it."""
        return numbers(element, "pos", 3), self.rotation(element)

    def rotation(self, element: ET.Element) -> np.ndarray:
        """Return the rotation (3, 3) of an element, whichever way the file gives it."""
        from scipy.spatial.transform import Rotation  # not for systems without a robot

        if element.get("axisangle"):
            *axis, angle = numbers(element, "axisangle", 4)
            return Rotation.from_rotvec(self.angle(angle) * _unit(np.array(axis), element)).as_matrix()
        if element.get("euler"):
            return self._euler(numbers(element, "euler", 3))
        if element.get("xyaxes"):
            x, y = numbers(element, "xyaxes", 6).reshape(2, 3)
            x = _unit(x, element)
            y = _unit(y - (x @ y) * x, element)
            return np.column_stack([x, y, np.cross(x, y)])
        if element.get("zaxis"):
            return _turned_z(_unit(numbers(element, "zaxis", 3), element))
        quaternion = numbers(element, "quat", 4) if element.get("quat") else np.array([1.0, 0, 0, 0])
        return Rotation.from_quat(_unit(quaternion, element), scalar_first=True).as_matrix()

    def _euler(self, angles: np.ndarray) -> np.ndarray:
        """Return the rotation of three angles: about axes that move along (xyz), or that are fixed (XYZ)."""
        from scipy.spatial.transform import Rotation

        found = np.eye(3)
        for letter, angle in zip(self.settings.get("eulerseq", "xyz"), angles, strict=True):
            turn = Rotation.from_euler(letter.lower(), self.angle(angle)).as_matrix()
            found = found @ turn if letter.islower() else turn @ found
        return found

    def asset_folder(self) -> Path:
        """Return the folder of the meshes."""
        return self.folder / self.settings.get("meshdir", self.settings.get("assetdir", ""))


def _together(tables: list[dict[str, str]]) -> dict[str, str]:
    """Return attributes of which later ones replace others, also those that say the same in another way."""
    return reduce(_over, tables, {})


TURNS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")


def _over(before: dict[str, str], after: dict[str, str]) -> dict[str, str]:
    turned = any(key in after for key in TURNS)
    return {key: value for key, value in before.items() if not (turned and key in TURNS)} | after


def _include(element: ET.Element, folder: Path, around: tuple[Path, ...]) -> None:
    """Put the elements of included files in the place of <include>."""
    for child in list(element):
        if child.tag != "include":
            _include(child, folder, around)
            continue
        path = folder / child.get("file", "")
        refuse_missing(path, "included file")
        if path in around:
            raise InputError(f"{path} includes itself")
        try:
            found = ET.parse(path).getroot()
        except ET.ParseError as error:
            raise InputError(f"{path} is no XML file: {error}") from None
        _include(found, folder, (*around, path))
        at = list(element).index(child)
        element.remove(child)
        for k, each in enumerate(found):
            element.insert(at + k, each)


def _unit(vector: np.ndarray, element: ET.Element) -> np.ndarray:
    length = np.linalg.norm(vector)
    if not length > 0:
        raise InputError(f"<{element.tag} name={element.get('name')!r}> has an orientation or axis of length 0")
    return vector / length


def _turned_z(z: np.ndarray) -> np.ndarray:
    """Return the smallest rotation that takes the z axis to a unit vector."""
    from scipy.spatial.transform import Rotation

    axis = np.cross([0.0, 0.0, 1.0], z)
    sine = np.linalg.norm(axis)
    if sine < 1e-14:
        return np.diag([1.0, np.sign(z[2]), np.sign(z[2])])
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, z[2])).as_matrix()


def one(element: ET.Element, key: str) -> float:
    """Return the one number of an attribute, 0 where it is missing; a polynomial is refused.

    Examples
    --------
    >>> one(ET.fromstring('<joint damping="2 0 0"/>'), "damping")
    2.0
    """
    found = some(element, key)
    if np.any(found[1:]):
        raise InputError(f"<{element.tag} {key}={element.get(key)!r}>: only its first number can be other than 0 here")
    return float(found[0]) if len(found) else 0.0
