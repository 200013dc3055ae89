"""Public names: each at one place, loaded on first use, known to editors."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import modalprep
from modalprep.lazy import PACKAGES, public_homes

HOMES = ["modalprep", *(f"modalprep.{name}" for name in PACKAGES)]


@pytest.mark.parametrize("package", HOMES)
def test_every_name_is_found_and_listed(package):
    module = import_module(package)
    for name in module.__all__:
        assert getattr(module, name).__name__ == name
        assert name in dir(module)


@pytest.mark.parametrize("package", HOMES)
def test_editors_see_the_same_names(package):
    """What stands under TYPE_CHECKING is what is loaded at run time, from the same modules."""
    module = import_module(package)
    tree = ast.parse(Path(module.__file__).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [(node.module, alias) for node in block.body for alias in node.names]
    whole = {home for home, alias in imports if alias.name == "*"}
    # a re-export, as type checkers have it
    assert all(alias.name == alias.asname or home in whole for home, alias in imports)
    static = {alias.name: home for home, alias in imports if (home, alias.name[0].islower()) != ("modalprep", True)}
    static |= {name: home for home in whole for name in import_module(home).__all__}
    static.pop("*", None)
    prefix = package.removeprefix("modalprep").removeprefix(".")
    found = [(*name.rpartition("."), home) for name, home in public_homes().items()]
    lazy = {name: home for inside, _, name, home in found if inside == prefix}
    assert static == lazy


def test_a_name_has_one_place():
    names = [name.rpartition(".")[2] for name in public_homes()]
    twice = {name for name in names if names.count(name) > 1}
    assert not twice


@pytest.mark.parametrize("package", HOMES)
def test_no_module_hides_a_name(package):
    """Once loaded, a module is an attribute of its package, whatever ``__getattr__`` would have answered."""
    module = import_module(package)
    for name in module.__all__:
        with pytest.raises(ModuleNotFoundError):
            import_module(f"{package}.{name}")


def test_an_unknown_name_says_where_it_is():
    with pytest.raises(AttributeError, match="modalprep has no 'Orbit'; it is modalprep.multibody.Orbit"):
        modalprep.Orbit  # noqa: B018
    with pytest.raises(AttributeError, match="modalprep.reduction has no 'guyan'; it is modalprep.guyan"):
        modalprep.reduction.guyan  # noqa: B018
    with pytest.raises(AttributeError, match="modalprep.linalg has no 'nothing'; it has Factor, Modes, "):
        modalprep.linalg.nothing  # noqa: B018


def test_the_import_loads_nothing():
    """Of others' packages none, of its own those with names only."""
    code = (
        "import sys; before = set(sys.modules); import modalprep; dir(modalprep); modalprep.fe, modalprep.multibody;"
        "print(*set(sys.modules) - before)"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    packages = {name.partition(".")[0] for name in loaded}
    assert packages - sys.stdlib_module_names == {"modalprep"}
    assert {name for name in loaded if name.startswith("modalprep.")} == {
        "modalprep.lazy", "modalprep.fe", "modalprep.multibody"
    }  # fmt: skip


def test_types_ship_with_the_package(project):
    assert (project / "src" / "modalprep" / "py.typed").exists()
