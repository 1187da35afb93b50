"""Models as FMUs for Co-Simulation, FMI 2.0 and 3.0: the library in an archive with its description."""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as xml

import numpy as np

from gearmbs.dae.problem import ANY, Allowed, Number
from gearmbs.files import whole_file
from gearmbs.native.asked import Told
from gearmbs.units import powers_of

BASE = ("m", "kg", "s", "rad")
"""Base units as FMI names them, in the order of `gearmbs.units.powers_of`."""
ABILITIES = {
    "2.0": dict.fromkeys(("canGetAndSetFMUstate", "canSerializeFMUstate", "providesDirectionalDerivative"), "true"),
    "3.0": dict.fromkeys(
        (
            *("canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives"),
            *("hasEventMode", "providesIntermediateUpdate", "canReturnEarlyAfterIntermediateUpdate"),
        ),
        "true",
    ),
}
VECTORS = {("x", "y", "z"): "", ("fx", "fy", "fz"): "force", ("tx", "ty", "tz"): "moment"}
"""Components that are one array, and what they are called after what they are of."""
STEPS = 500
"""Communication points of the default experiment."""


class Variable(NamedTuple):
    """A variable of an FMU.

    Attributes
    ----------
    name, unit : str
    causality : {"input", "parameter", "output"}
    start : float or None
        None of outputs.
    size : int, optional
        Of an array how many numbers it has; 0 for a scalar.
    allowed : Allowed, optional
        What it can be set to.
    """

    name: str
    unit: str
    causality: str
    start: float | None
    size: int = 0
    allowed: Allowed = ANY


class Description(NamedTuple):
    """What an FMU says of itself.

    Attributes
    ----------
    name, identifier, token, tool : str
        Of the model and of its library; what tells the description from that of another model; who made it.
    start, end : float
        Span in which it can be simulated, s.
    variables : list of Variable
        Their references count the numbers in them, from 0 on.
    """

    name: str
    identifier: str
    token: str
    tool: str
    start: float
    end: float
    variables: list[Variable]


def variables_of(
    numbers: Mapping[str, tuple[str, str, float, Allowed]], told: Sequence[Told], arrays: bool = False
) -> list[Variable]:
    """Return the variables of a model: numbers by name with kind, unit, present value and range, then outputs.

    With ``arrays`` components of a vector that follow each other are one output.
    """
    found = [
        Variable(name, unit, kind, value, allowed=allowed) for name, (kind, unit, value, allowed) in numbers.items()
    ]
    outputs = [Variable(one.name, one.unit, "output", None) for one in told]
    k = 0
    while k < len(outputs):
        vector = _vector(outputs, k) if arrays else None
        found.append(vector or outputs[k])
        k += max(1, found[-1].size)
    return found


def _vector(outputs: Sequence[Variable], k: int) -> Variable | None:
    """Return the array that begins with an output, None if none does: it has one unit."""
    of, _, first = outputs[k].name.rpartition(".")
    unit = outputs[k].unit
    for components, name in VECTORS.items():
        if [(one.name, one.unit) for one in outputs[k : k + 3]] == [(f"{of}.{c}", unit) for c in components]:
            return outputs[k]._replace(name=f"{of}.{name}".rstrip("."), size=len(components))
    size = 0
    if first == "0":
        while k + size < len(outputs) and outputs[k + size][:2] == (f"{of}.{size}", unit):
            size += 1
    return outputs[k]._replace(name=of, size=size) if size > 1 else None


def range_of(number: Number) -> tuple[float, float]:
    """Return the least and the largest value that a number can be set to."""
    allowed = number.allowed
    # the next one above a bound that is left out
    least = math.nextafter(allowed.least, math.inf) if allowed.above else allowed.least
    return float(least), float(allowed.most)


def widths_of(variables: Sequence[Variable]) -> list[int]:
    """Return of each number how many a variable of its reference has, 0 where none begins."""
    return [width for one in variables for width in (max(1, one.size), *[0] * (one.size - 1))]


def _unit_name(unit: str) -> str:
    return "1" if unit in ("1", "dimensionless") else re.sub(r"\^1(?![\d.])", "", unit.replace("*", " "))


def _units(parent: xml.Element, variables: Sequence[Variable]) -> None:
    """Define the units of all variables by base units, where their powers are whole; others have a name alone."""
    names = dict.fromkeys(_unit_name(variable.unit) for variable in variables if variable.unit)
    if not names:
        return
    defined = xml.SubElement(parent, "UnitDefinitions")
    for name in names:
        unit = xml.SubElement(defined, "Unit", name=name)
        found = powers_of(name)
        powers = found[1][:4] if found is not None else (0.0,) * 4
        if (found is None and name != "1") or any(power != round(power) for power in powers):
            continue
        base = xml.SubElement(unit, "BaseUnit")
        for exponent, power in zip(BASE, powers, strict=True):
            if power:
                base.set(exponent, str(round(power)))


def model_description(told: Description, version: str) -> bytes:
    """Return ``modelDescription.xml`` of an FMU.

    Parameters
    ----------
    told : Description
    version : {"2.0", "3.0"}
    """
    second = version == "2.0"
    head = {
        "fmiVersion": version, "modelName": told.name, "guid" if second else "instantiationToken": told.token,
        "generationTool": told.tool, "variableNamingConvention": "flat",
    }  # fmt: skip
    root = xml.Element("fmiModelDescription", head)
    able = {"modelIdentifier": told.identifier, "canHandleVariableCommunicationStepSize": "true"}
    xml.SubElement(root, "CoSimulation", able | ABILITIES[version])
    _units(root, told.variables)
    xml.SubElement(
        root, "DefaultExperiment", startTime=repr(told.start), stopTime=repr(told.end),
        stepSize=repr((told.end - told.start) / STEPS),
    )  # fmt: skip
    listed, structure = xml.SubElement(root, "ModelVariables"), xml.Element("ModelStructure")
    references = np.cumsum([0, *(max(1, variable.size) for variable in told.variables)]).tolist()
    if not second:
        # time has a reference of its own behind all others
        xml.SubElement(
            listed, "Float64", name="time", valueReference=str(references[-1]), causality="independent",
            variability="continuous",
        )  # fmt: skip
    for reference, variable in zip(references, told.variables, strict=False):
        variability = "tunable" if variable.causality == "parameter" else "continuous"
        attributes = {
            "name": variable.name, "valueReference": str(reference), "causality": variable.causality,
            "variability": variability,
        }  # fmt: skip
        if variable.start is None:
            attributes["initial"] = "calculated"
        # the unit of an expression is not known
        real = {"unit": _unit_name(variable.unit)} if variable.unit else {}
        bounds = (("min", variable.allowed.least), ("max", variable.allowed.most))
        real |= {key: repr(float(bound)) for key, bound in bounds if math.isfinite(bound)}
        if variable.start is not None:
            real["start"] = repr(variable.start)
        if second:
            xml.SubElement(xml.SubElement(listed, "ScalarVariable", attributes), "Real", real)
        else:
            element = xml.SubElement(listed, "Float64", attributes | real)
            if variable.size:
                xml.SubElement(element, "Dimension", start=str(variable.size))
    outputs = [k for k, variable in enumerate(told.variables) if variable.causality == "output"]
    if second:
        for kind in ("Outputs", "InitialUnknowns") if outputs else ():
            unknowns = xml.SubElement(structure, kind)
            for k in outputs:
                xml.SubElement(unknowns, "Unknown", index=str(k + 1))
    else:
        for kind in ("Output", "InitialUnknown"):
            for k in outputs:
                xml.SubElement(structure, kind, valueReference=str(references[k]))
    root.append(structure)
    xml.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + xml.tostring(root, encoding="utf-8")


def write_fmu(path: Path, told: Description, version: str, libraries: Mapping[str, Path]) -> Path:
    """Write an FMU that appears under its name when it is whole, with libraries by their places among binaries."""
    with whole_file(path) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", model_description(told, version))
        for place, library in libraries.items():
            archive.write(library, f"binaries/{place}")
    return path
