"""Public names that are loaded on first use, and where they live."""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

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


def lazy(package: str, names: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package whose modules are loaded on first use.

    ``names`` has, by the module below the package, its public names with a space between them.
    """
    homes = {name: f"{package}.{module}" for module, listed in names.items() for name in listed.split()}
    inside = PACKAGES if package == "modalprep" else ()

    def load(name: str) -> Any:
        if name in inside:
            return import_module(f"{package}.{name}")
        if name not in homes:
            raise AttributeError(_unknown(package, name, [*homes, *inside]))
        return getattr(import_module(homes[name]), name)

    return load, lambda: sorted([*homes, *inside]), sorted(homes)


def public_homes() -> dict[str, str]:
    """Return, by its public name such as ``reduction.Load``, the module where a name is defined.

    >>> public_homes()["reduction.Load"], public_homes()["simulate"]
    ('modalprep.reduction.loads', 'modalprep.multibody.simulate')
    """
    for package in () if _HOMES else ("", *PACKAGES):
        home = f"modalprep.{package}".rstrip(".")
        for module, names in import_module(home)._NAMES.items():
            _HOMES.update({f"{package}.{name}".lstrip("."): f"{home}.{module}" for name in names.split()})
    return _HOMES


_HOMES: dict[str, str] = {}  # filled at the first call


def _unknown(package: str, name: str, known: list[str]) -> str:
    public = () if name.startswith("_") else public_homes()  # Python and pytest ask for many private names
    elsewhere = [listed for listed in public if listed.rpartition(".")[2] == name]
    if elsewhere:
        return f"{package} has no {name!r}; it is modalprep.{elsewhere[0]}"
    return f"{package} has no {name!r}; it has {', '.join(sorted(known))}"
