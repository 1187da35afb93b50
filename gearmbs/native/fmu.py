"""Models as FMUs for Co-Simulation, FMI 2.0 and 3.0: the library in an archive with its description."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as xml

from gearmbs.files import whole_file
from gearmbs.native.outputs import Told
from gearmbs.units import powers_of

PLATFORMS = {"2.0": "linux64", "3.0": "x86_64-linux"}
"""Folders of binaries by the version of FMI."""
BASE = ("m", "kg", "s", "rad")
"""Base units as FMI names them, in the order of `gearmbs.units.powers_of`."""
ABILITIES = {
    "2.0": dict.fromkeys(("canGetAndSetFMUstate", "canSerializeFMUstate", "providesDirectionalDerivative"), "true"),
    "3.0": dict.fromkeys(("canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives"), "true"),
}
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
    """

    name: str
    unit: str
    causality: str
    start: float | None


class Description(NamedTuple):
    """What an FMU says of itself.

    Attributes
    ----------
    name, identifier, token, tool : str
        Of the model and of its library; what tells the description from that of another model; who made it.
    start, end : float
        Span in which it can be simulated, s.
    variables : list of Variable
        By their references, from 0 on.
    """

    name: str
    identifier: str
    token: str
    tool: str
    start: float
    end: float
    variables: list[Variable]


def variables_of(numbers: Mapping[str, tuple[str, str, float]], told: Sequence[Told]) -> list[Variable]:
    """Return the variables of a model: numbers by name with kind, unit and present value, then outputs."""
    set_ = [Variable(name, unit, kind, value) for name, (kind, unit, value) in numbers.items()]
    return [*set_, *(Variable(one.name, one.unit, "output", None) for one in told)]


def _unit_name(unit: str) -> str:
    return "1" if unit in ("1", "dimensionless") else unit.replace("*", " ")


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
    if not second:
        # time has a reference of its own behind all others
        xml.SubElement(
            listed, "Float64", name="time", valueReference=str(len(told.variables)), causality="independent",
            variability="continuous",
        )  # fmt: skip
    for reference, variable in enumerate(told.variables):
        variability = "tunable" if variable.causality == "parameter" else "continuous"
        attributes = {
            "name": variable.name, "valueReference": str(reference), "causality": variable.causality,
            "variability": variability,
        }  # fmt: skip
        if variable.start is None:
            attributes["initial"] = "calculated"
        # the unit of an expression is not known
        real = {"unit": _unit_name(variable.unit)} if variable.unit else {}
        if variable.start is not None:
            real["start"] = repr(variable.start)
        if second:
            xml.SubElement(xml.SubElement(listed, "ScalarVariable", attributes), "Real", real)
        else:
            xml.SubElement(listed, "Float64", attributes | real)
    outputs = [k for k, variable in enumerate(told.variables) if variable.causality == "output"]
    if second:
        for kind in ("Outputs", "InitialUnknowns") if outputs else ():
            unknowns = xml.SubElement(structure, kind)
            for k in outputs:
                xml.SubElement(unknowns, "Unknown", index=str(k + 1))
    else:
        for kind in ("Output", "InitialUnknown"):
            for k in outputs:
                xml.SubElement(structure, kind, valueReference=str(k))
    root.append(structure)
    xml.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + xml.tostring(root, encoding="utf-8")


def write_fmu(path: Path, told: Description, version: str, library: Path) -> Path:
    """Write an FMU that appears under its name when it is whole."""
    with whole_file(path) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", model_description(told, version))
        archive.write(library, f"binaries/{PLATFORMS[version]}/{told.identifier}.so")
    return path
