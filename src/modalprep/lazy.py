"""Public names that are loaded on first use, and where they live."""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

# those with public names
PACKAGES = (
    "fe",
    "reduction",
    "body",
    "supplied",
    "multibody",
    "ensemble",
    "sensitivity",
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
    """Return the module of each name that the source of a package imports for type checkers.

    Its lines are ``from module import name as name``, or ``from module import *``.
    """
    found = {}
    for words in map(str.split, _source(package).splitlines()):
        if words[:1] != ["from"] or not words[1].startswith("modalprep."):
            continue
        if words[3] == "*":
            found |= dict.fromkeys(_listed(_source(words[1])), words[1])
        elif words[4:] == ["as", words[3]]:
            found[words[3]] = words[1]
    return found


def _source(module: str) -> str:
    """Return the text of a module of this package, without importing it."""
    folder = __file__.removesuffix("lazy.py")
    place = module.removeprefix("modalprep").lstrip(".").replace(".", "/")
    name = "__init__" if module in ("modalprep", *(f"modalprep.{each}" for each in PACKAGES)) else ""
    loader: Any = __loader__
    return loader.get_data(f"{folder}{place}{'/' if place and name else ''}{name}.py").decode()


def _listed(source: str) -> list[str]:
    """Return the names in ``__all__`` of a source."""
    text = source.partition("\n__all__ = [")[2].partition("]")[0]
    return [name.strip().strip("\"'") for name in text.split(",") if name.strip()]


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
