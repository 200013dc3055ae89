"""Public docstrings: what comes back is said, its type is public, formulas have a source."""

import ast
import dataclasses
import inspect
import re
from functools import cached_property
from importlib import import_module

import pytest

from modalprep.lazy import public_homes

HOMES = {
    name: home for name, home in public_homes().items() if not home.startswith(("modalprep.fe.", "modalprep.errors"))
}
PUBLIC = {name.rpartition(".")[2] for name in public_homes()}
# Of fields that assembly and recovery read, not users.
INTERNAL = {
    "Algebra",
    "Elements",
    "Groups",
    "MassTensor",
    "PrestressStiffness",
    "SharedNode",
    "RigidInertia",
    "RotatingMass",
    "StrainEnergy",
}
# An equation: letters, a sign of equality, and something multiplied, divided, added or to a power.
FORMULA = re.compile(r"``[^`\"']*[^=]=[^=`\"']*[\^+*/~][^`\"']*``")


def public(name):
    return getattr(import_module(public_homes()[name]), name.rpartition(".")[2])


def functions(name):
    """Yield the public functions of a public name: itself, or the methods that its class defines."""
    found = public(name)
    if not inspect.isclass(found):
        yield name, found
        return
    for key, value in vars(found).items():
        function = getattr(value, "__func__", value)
        if (key in ("__getitem__", "__call__") or not key.startswith("_")) and inspect.isfunction(function):
            yield f"{name}.{key}", function


def returned(name):
    """Yield the annotations of what users get: returns, properties, fields of records."""
    found = public(name)
    for key, function in functions(name):
        yield key, str(function.__annotations__.get("return", ""))
    if inspect.isclass(found):
        for key, value in vars(found).items():
            getter = value.fget if isinstance(value, property) else getattr(value, "func", None)
            if not key.startswith("_") and isinstance(value, property | cached_property):
                yield f"{name}.{key}", str(getter.__annotations__.get("return", ""))
        for field in dataclasses.fields(found) if dataclasses.is_dataclass(found) else ():
            yield f"{name}.{field.name}", str(field.type)


@pytest.fixture(scope="module")
def classes(project):
    """Names of all classes of the package."""
    files = (project / "src" / "modalprep").rglob("*.py")
    return {
        node.name for file in files for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.ClassDef)
    }


def test_types_that_users_get_are_public(classes):
    hidden = {}
    for name in public_homes():
        for key, annotation in returned(name):
            found = {word for word in re.findall(r"\w+", annotation) if word in classes} - PUBLIC - INTERNAL
            hidden |= {key: found} if found else {}
    assert not hidden


@pytest.mark.parametrize("name", public_homes())
def test_public_names_have_docstrings(name):
    for key, function in [(name, public(name)), *functions(name)]:
        assert inspect.getdoc(function), key


def described(record):
    """Names before a colon in the sections of attributes and parameters of a class and its bases."""
    texts = [inspect.cleandoc(base.__doc__ or "") for base in record.__mro__]
    sections = [re.search(r"^(?:Attributes|Parameters)\n-+\n(.*?)(?=\n\n\w+\n---|\Z)", x, re.M | re.S) for x in texts]
    lines = [line for section in sections if section for line in re.findall(r"^(\w[\w, ]*) :", section[1], re.M)]
    return {name for line in lines for name in line.split(", ")}


@pytest.mark.parametrize("name", public_homes())
def test_records_describe_all_their_fields(name):
    record = public(name)
    fields = [each.name for each in dataclasses.fields(record)] if dataclasses.is_dataclass(record) else ()
    fields = {each for each in getattr(record, "_fields", fields) if not each.startswith("_")}
    if inspect.isclass(record):
        assert fields <= described(record), f"{name} says nothing of {fields - described(record)}"


@pytest.mark.parametrize("name", HOMES)
def test_functions_say_what_they_return(name):
    for key, function in functions(name):
        if function.__annotations__.get("return") != "None":
            assert "\nReturns\n-------\n" in inspect.getdoc(function), f"{key} does not say what it returns"


@pytest.mark.parametrize("name", HOMES)
def test_formulas_have_a_source(name):
    for key, documented in [(name, public(name)), *functions(name)]:
        text = inspect.getdoc(documented)
        if FORMULA.search(text.partition("\nExamples\n")[0]):
            assert "\nReferences\n" in text or re.search(r"\b[Tt]heory \d", text), f"{key} has a formula without source"


@pytest.mark.parametrize("name", public_homes())
def test_sections_of_docstrings_are_in_the_order_of_numpy(name):
    order = ["Parameters", "Attributes", "Returns", "Raises", "Warns", "Notes", "References", "Examples"]
    for key, documented in [(name, public(name)), *functions(name)]:
        text = inspect.getdoc(documented)
        found = [title for title, rule in re.findall(r"^(\w+)\n(-+)$", text, re.MULTILINE) if len(title) == len(rule)]
        assert found == [title for title in order if title in found], key
