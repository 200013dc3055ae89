"""Public names that are loaded on first use, and where they live."""

from __future__ import annotations

import re
import sys
from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

IMPORT = re.compile(r"^    from (modalprep\.\S+) import (\w+) as \2$", re.MULTILINE)
WHOLE = re.compile(r"^    from (modalprep\.\S+) import \*", re.MULTILINE)
LISTED = re.compile(r"^__all__ = \[(.*?)\]", re.MULTILINE | re.DOTALL)
# those with public names
PACKAGES = (
    "fe",
    "reduction",
    "body",
    "supplied",
    "multibody",
    "ensemble",
    "formats",
    "correlation",
    "response",
    "report",
    "linalg",
)


def lazy(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package whose modules are loaded on first use.

    Its names and their modules are those that its ``__init__`` imports for type checkers alone; of a module that it
    imports as a whole, the names in its ``__all__``.
    """
    homes = _imported(package)
    inside = PACKAGES if package == "modalprep" else ()

    def load(name: str) -> Any:
        if name in inside:
            return import_module(f"{package}.{name}")
        if name not in homes:
            raise AttributeError(_unknown(package, name, [*homes, *inside]))
        return getattr(import_module(homes[name]), name)

    return load, lambda: sorted([*homes, *inside]), sorted(homes)


def _imported(package: str) -> dict[str, str]:
    """Return the module of each name that the source of a package imports for type checkers."""
    loader: Any = sys.modules[package].__loader__
    source = loader.get_source(package)
    found = {name: module for module, name in IMPORT.findall(source)}
    for module in WHOLE.findall(source):
        file = module.removeprefix(f"{package}.").replace(".", "/")
        text = loader.get_data(f"{loader.path.removesuffix('__init__.py')}{file}.py").decode()
        found |= dict.fromkeys(re.findall(r"\w+", LISTED.findall(text)[0]), module)
    return found


def public_homes() -> dict[str, str]:
    """Return, by its public name such as ``reduction.Load``, the module where a name is defined.

    >>> public_homes()["reduction.Load"], public_homes()["simulate"]
    ('modalprep.reduction.loads', 'modalprep.multibody.simulate')
    """
    for package in () if _HOMES else ("", *PACKAGES):
        home = f"modalprep.{package}".rstrip(".")
        import_module(home)
        _HOMES.update({f"{package}.{name}".lstrip("."): module for name, module in _imported(home).items()})
    return _HOMES


_HOMES: dict[str, str] = {}  # filled at the first call


def _unknown(package: str, name: str, known: list[str]) -> str:
    public = () if name.startswith("_") else public_homes()  # Python and pytest ask for many private names
    elsewhere = [listed for listed in public if listed.rpartition(".")[2] == name]
    if elsewhere:
        return f"{package} has no {name!r}; it is modalprep.{elsewhere[0]}"
    return f"{package} has no {name!r}; it has {', '.join(sorted(known))}"
