"""Numbers and names in the XML files of robots."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.suggest import refuse_missing


@contextmanager
def reading(path: Path) -> Iterator[ET.Element]:
    """Give the root element of a file; what is wrong in it is said with its path."""
    refuse_missing(path, "robot file")
    try:
        yield ET.parse(path).getroot()
    except InputError as error:
        said = str(error)
        raise InputError(said if str(path) in said else f"{path}: {said}") from None
    except ET.ParseError as error:
        raise InputError(f"{path} is no XML file: {error}") from None


def plain(name: str) -> str:
    """Return a name in which a dot or slash is an underscore.

    Examples
    --------
    >>> plain(" arm/upper.link ")
    'arm_upper_link'
    """
    return name.strip().replace(".", "_").replace("/", "_")


def numbers(element: ET.Element, key: str, count: int) -> np.ndarray:
    """Return `count` numbers of an attribute, zeros where it is missing.

    Examples
    --------
    >>> numbers(ET.fromstring('<origin xyz="1 2 3"/>'), "xyz", 3)
    array([1., 2., 3.])
    """
    found = some(element, key) if element.get(key) is not None else np.zeros(count)
    if len(found) != count:
        raise InputError(f"<{element.tag} {key}={element.get(key)!r}> needs {count} numbers; correct it")
    return found


def some(element: ET.Element, key: str) -> np.ndarray:
    """Return the numbers of an attribute, none where it is missing.

    Examples
    --------
    >>> some(ET.fromstring('<geom size="1 2"/>'), "size")
    array([1., 2.])
    """
    try:
        found = np.array([float(word) for word in element.get(key, "").split()])
    except ValueError:
        found = np.array([np.nan])
    if not np.all(np.isfinite(found)):
        raise InputError(f"<{element.tag} {key}={element.get(key)!r}> needs {max(1, len(found))} numbers; correct it")
    return found


def number(element: ET.Element | None, key: str, default: float) -> float:
    """Return the number of an attribute, or the default.

    Examples
    --------
    >>> number(ET.fromstring('<mass value="2"/>'), "value", 0.0), number(None, "value", 0.5)
    (2.0, 0.5)
    """
    return default if element is None or element.get(key) is None else float(numbers(element, key, 1)[0])
