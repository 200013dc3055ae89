"""modelDescription.xml of an FMU."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from modalprep import __version__
from modalprep.runtime.linear import LINEAR
from modalprep.runtime.model import INDICATORS, Model, Variable
from modalprep.runtime.units import BASE

STRUCTURED = re.compile(r"(der\()?[A-Za-z_]\w*(\.[A-Za-z_]\w*)*(\[\d+\])?\)?", re.ASCII)
MODEL_EXCHANGE, CO_SIMULATION = "me", "cs"
DERIVATIVES = {"FMUstate": ("DirectionalDerivative",), "FMUState": ("DirectionalDerivatives", "AdjointDerivatives")}
TAGS = {MODEL_EXCHANGE: "ModelExchange", CO_SIMULATION: "CoSimulation"}
INDEPENDENT = Variable("time", 0, "independent", "s", "simulation time")


def description(model: Model, name: str, version: str, kinds: Sequence[str]) -> bytes:
    """Return the XML of an FMU of a version of FMI, "2" or "3"; `name` is that of its library."""
    write = {"2": _version2, "3": _version3}[version]
    root = write(model, name, kinds)
    indent(root, " ")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root)


def _version2(model: Model, name: str, kinds: Sequence[str]) -> Element:
    count = str(sum(map(_is_indicator, model.variables)))
    root = _root(model, name, fmiVersion="2.0", guid=model.token, numberOfEventIndicators=count)
    _begin(root, model, name, kinds, state="FMUstate")
    for each in root.findall("CoSimulation"):
        each.set("canInterpolateInputs", "false" if model.kind == LINEAR else "true")
    variables = [INDEPENDENT, *model.variables]
    number = {each.reference: k for k, each in enumerate(variables, 1)}
    listed = SubElement(root, "ModelVariables")
    for each in variables:
        scalar = SubElement(listed, "ScalarVariable", _common(each))
        derivative = {} if each.derivative is None else {"derivative": str(number[each.derivative])}
        SubElement(scalar, "Real", {**_start(each), **derivative, **_size(each), **_unit(each)})
    structure = SubElement(root, "ModelStructure")
    for tag, chosen in _structure("Outputs", "Derivatives", "InitialUnknowns"):
        part = SubElement(structure, tag)
        for each in filter(chosen, variables):
            SubElement(part, "Unknown", index=str(number[each.reference]))
    return root


def _version3(model: Model, name: str, kinds: Sequence[str]) -> Element:
    root = _root(model, name, fmiVersion="3.0", instantiationToken=model.token)
    _begin(root, model, name, kinds, state="FMUState")
    listed = SubElement(root, "ModelVariables")
    variables = [INDEPENDENT, *model.variables]
    for each in variables:
        derivative = {} if each.derivative is None else {"derivative": str(each.derivative)}
        SubElement(listed, "Float64", {**_common(each), **_start(each), **derivative, **_size(each), **_unit(each)})
    structure = SubElement(root, "ModelStructure")
    for tag, chosen in _structure("Output", "ContinuousStateDerivative", "InitialUnknown"):
        for each in filter(chosen, variables):
            SubElement(structure, tag, valueReference=str(each.reference))
    for each in filter(_is_indicator, variables):
        SubElement(structure, "EventIndicator", valueReference=str(each.reference))
    return root


def _begin(root: Element, model: Model, name: str, kinds: Sequence[str], state: str) -> None:
    """Add what both versions have before the variables; `state` is how each spells an FMU's state."""
    for kind in kinds:
        own = {"modelIdentifier": name, f"canGetAndSet{state}": "true", f"canSerialize{state}": "true"}
        if kind == CO_SIMULATION:
            own["canHandleVariableCommunicationStepSize"] = "true"
        if model.differentiable:
            own |= {f"provides{name}": "true" for name in DERIVATIVES[state]}
        SubElement(root, TAGS[kind], own)
    _units(root)
    _categories(root)
    _experiment(root, model)


def _root(model: Model, name: str, **own: str) -> Element:
    structured = all(STRUCTURED.fullmatch(each.name) for each in model.variables)
    common = {
        "modelName": name,
        "description": "multibody system of modalprep",
        "generationTool": f"modalprep {__version__}",
        "generationDateAndTime": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "variableNamingConvention": "structured" if structured else "flat",
    }
    return Element("fmiModelDescription", {**own, **common})


def _units(root: Element) -> None:
    units = SubElement(root, "UnitDefinitions")
    for name, powers in BASE.items():
        SubElement(SubElement(units, "Unit", name=name), "BaseUnit", {key: str(power) for key, power in powers.items()})


def _categories(root: Element) -> None:
    categories = SubElement(root, "LogCategories")
    for name in ("logAll", "logStatusError", "logStatusWarning"):
        SubElement(categories, "Category", name=name)


def _experiment(root: Element, model: Model) -> None:
    values = {"startTime": model.begin, "stopTime": model.end, "tolerance": model.rtol, "stepSize": model.step}
    SubElement(root, "DefaultExperiment", {name: _number(value) for name, value in values.items()})


def _common(each: Variable) -> dict[str, str]:
    """Return the attributes that both versions have."""
    causality = "output" if each.causality == "state" else each.causality
    found = {"name": each.name, "valueReference": str(each.reference), "causality": causality}
    found["variability"] = "fixed" if causality == "parameter" else "continuous"
    if each.about:
        found["description"] = each.about
    if each.causality in ("state", "parameter"):
        found["initial"] = "exact"
    elif each.causality in ("output", "local"):
        found["initial"] = "calculated"
    return found


def _start(each: Variable) -> dict[str, str]:
    return {} if each.start is None else {"start": _number(each.start)}


def _is_indicator(each: Variable) -> bool:
    return each.reference >= INDICATORS


def _size(each: Variable) -> dict[str, str]:
    return {} if each.nominal is None else {"nominal": _number(each.nominal)}


def _unit(each: Variable) -> dict[str, str]:
    return {"unit": each.unit} if each.unit else {}


def _number(value: float) -> str:
    return repr(float(value))


def _structure(outputs: str, derivatives: str, unknowns: str) -> Iterable[tuple[str, Callable[[Variable], bool]]]:
    """Return the tags of the parts of the structure, and whether a variable belongs to each."""
    return (
        (outputs, lambda each: each.causality in ("output", "state")),
        (derivatives, lambda each: each.derivative is not None),
        (unknowns, lambda each: each.causality in ("output", "local") and not _is_indicator(each)),
    )
