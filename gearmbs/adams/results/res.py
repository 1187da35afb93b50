"""The results file (.res) in ADAMS's XML form (XRF): parts, joints, forces and requests by components."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.results.record import FORCE_COLUMNS, PART_COLUMNS, PART_DIMENSIONS, POINT_COLUMNS, RunRecord
from gearmbs.adams.results.remarks import TRACK_COLUMNS
from gearmbs.wording import of_adams

NAMESPACE = "http://www.mscsoftware.com/:xrf10"
PER_LINE = 6
STEP_TYPES = {"KINEMATICS": "kinematic", "STATICS": "static", "INITIAL_CONDITIONS": "initialConditions"}


class _Entity:
    """One set of components and its values over time."""

    def __init__(self, attributes: str, names: tuple[str, ...], units: tuple[str, ...], values: np.ndarray) -> None:
        self.attributes = attributes
        self.names = names
        self.units = units
        self.values = values


def _entities(result: RunRecord) -> Iterator[_Entity]:
    deck = result.deck
    for number, part in deck.of(st.Part).items():
        if part.ground:
            continue
        name = part.name or f"PART_{number}"
        attributes = f'name={quoteattr(name + "_XFORM")} entity={quoteattr(name)} entType="Part" objectId="{number}"'
        units = result.units_of(PART_DIMENSIONS)
        yield _Entity(attributes, PART_COLUMNS, units, result.part(number))
    for number, point in deck.of(st.PointMass).items():
        name = point.name or f"POINT_MASS_{number}"
        kind = f'entity={quoteattr(name)} entType="Point_Mass" objectId="{number}"'
        columns = [k for k, column in enumerate(PART_COLUMNS) if column in POINT_COLUMNS]
        units = result.units_of(PART_DIMENSIONS[k] for k in columns)
        yield _Entity(f"name={quoteattr(name + '_XFORM')} {kind}", POINT_COLUMNS, units, result.point_mass(number))
    yield from _flexible_entities(result)
    yield from _beam_entities(result)
    wrench_units = (result.unit("force"),) * 3 + (result.unit("torque"),) * 3
    kinds = {kind: cls for cls, kind in st.KINDS.items()}
    for kind, number in result.elements:
        name = deck.of(kinds[kind])[number].name or f"{kind.upper()}_{number}"
        attributes = (
            f'name={quoteattr(name)} entity={quoteattr(name)} entType="{kinds[kind].entity}" objectId="{number}"'
        )
        yield _Entity(attributes, FORCE_COLUMNS, wrench_units, result.force(kind, number))
        if kind == "contact":
            yield from _tracks(result, number, name)
    yield from _variable_entities(result)
    for number, request in deck.of(st.Request).items():
        name = request.results_name or request.name or f"REQUEST_{number}"
        names = result.segments[0].requests[number].names if result.segments else ()
        attributes = f'name={quoteattr(name)} entity={quoteattr(name)} entType="Request" objectId="{number}"'
        yield _Entity(attributes, names, result.request_units(number), result.request(number))


def _tracks(result: RunRecord, number: int, contact: str) -> Iterator[_Entity]:
    """Yield the sets of components of every track of a contact: CONTACT_1.Track_1.I_Point and so on."""
    table, units = result.tracks(number), result.track_units
    names = [column.split(".") for column in TRACK_COLUMNS]
    for track in range(table.shape[1]):
        for first in dict.fromkeys(name for name, _ in names):
            at = [k for k, (name, _) in enumerate(names) if name == first]
            full = quoteattr(f"{contact}.Track_{track + 1}.{first}")
            attributes = f'name={full} entity={quoteattr(contact)} entType="Contact" objectId="{number}"'
            components = tuple(names[k][1] for k in at)
            yield _Entity(attributes, components, tuple(units[k] for k in at), table[:, track, at])


def _flexible_entities(result: RunRecord) -> Iterator[_Entity]:
    """Frames of flexible bodies as those of parts, then their modal coordinates and the rates of these."""
    for number, body in result.deck.of(st.FlexBody).items():
        name = body.name or f"FLEX_BODY_{number}"
        kind = f'entity={quoteattr(name)} entType="Flexible_Body" objectId="{number}"'
        units = result.units_of(PART_DIMENSIONS)
        yield _Entity(f"name={quoteattr(name + '_XFORM')} {kind}", PART_COLUMNS, units, result.flexible(number))
        q_f, v_f = result.modal(number)
        names = tuple(f"{letter}{k + 1}" for letter in ("Q", "QDOT") for k in range(q_f.shape[1]))
        rates = (f"1/{result.unit('time')}",) * q_f.shape[1]
        modal = ("no_units",) * q_f.shape[1] + rates
        yield _Entity(f"name={quoteattr(name + '_Q')} {kind}", names, modal, np.hstack([q_f, v_f]))


def _beam_entities(result: RunRecord) -> Iterator[_Entity]:
    """Nodes of FE_PARTs with the columns of parts, one set a node."""
    units = result.units_of(PART_DIMENSIONS)
    for number in result.beams:
        name = result.deck.of(st.FePart)[number].name or f"FE_PART_{number}"
        kind = f'entity={quoteattr(name)} entType="FE_Part" objectId="{number}"'
        for label, motion in result.nodes(number).items():
            yield _Entity(f"name={quoteattr(f'{name}_{label}_XFORM')} {kind}", PART_COLUMNS, units, motion)


def _variable_entities(result: RunRecord) -> Iterator[_Entity]:
    """VARIABLEs, then the lists of a control program that have all of their members."""
    deck, known = result.deck, result.variables
    for number in known:
        name = quoteattr(deck.of(st.Variable)[number].name or f"VARIABLE_{number}")
        attributes = f'name={name} entity={name} entType="ADAMS_Variable" objectId="{number}"'
        yield _Entity(attributes, ("Q",), ("no_units",), result.variable(number)[:, None])
    for plant in deck.each(st.Plant):
        if not plant.variables or not set(plant.variables) <= set(known):
            continue
        way = plant.keyword[1:].title()
        name = quoteattr(plant.name or f"{plant.keyword}_{plant.id}")
        attributes = f'name={name} entity={name} entType="Plant_{way}" objectId="{plant.id}"'
        columns = tuple(f"{way.removesuffix('put').upper()}{k + 1}" for k in range(len(plant.variables)))
        values = np.stack([result.variable(v) for v in plant.variables], axis=1)
        yield _Entity(attributes, columns, ("no_units",) * len(columns), values)


def _package_version() -> str:
    try:
        return version("gearmbs")
    except PackageNotFoundError:
        return "0"


def results_text(result: RunRecord) -> str:
    """Return the content of the results file.

    Forces act on the I marker's part, in global components; angles are in radians.
    """
    stamp = datetime.now().strftime("%Y-%m-%d %H:%M:%S")
    out = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<Results xmlns="{NAMESPACE}">',
        "<Bibliography>",
        f'<File URI="" schema="xrf" version="2.0.0.0" publicationDate="{stamp}" />',
        '<Revision version="1" derivedFrom="-unknown-">',
        "<Comment>forces on the part of the I marker, global components; angles in radians</Comment>",
        "</Revision>",
        "</Bibliography>",
        f'<Analysis name="Analysis" executionDate="{stamp}" Solver="gearmbs {_package_version()}" script="-unknown-">',
        f'<ModelInfo title={quoteattr(result.deck.title)} creationDate="-unknown-" checksum="-unknown-" />',
        f'<Units angle="rad" length="{result.unit("length")}" mass="{result.unit("mass")}" '
        f'time="{result.unit("time")}" />',
        '<StepMap name="map_001">',
        '<Entity name="time">',
        f'<Component name="TIME" unitsValue="{result.unit("time")}" id="1" />',
        "</Entity>",
    ]
    entities = list(_entities(result))
    number = 1
    for entity in entities:
        out.append(f"<Entity {entity.attributes}>")
        for name, unit in zip(entity.names, entity.units):
            number += 1
            out.append(f'<Component name={quoteattr(name)} unitsValue={quoteattr(unit)} id="{number}" />')
        out.append("</Entity>")
    out.append("</StepMap>")
    row = 0
    for k, segment in enumerate(result.segments, 1):
        kind = STEP_TYPES.get(segment.kind, "dynamic")
        out.append(f'<Data name="{kind}_{k:03d}" id="{k}">')
        for _ in range(segment.solution.t.size):
            out.append(f'<Step type="{kind}">')
            out.append(f"{result.t[row]:.17g}")
            for entity in entities:
                values = entity.values[row]
                for c in range(0, values.size, PER_LINE):
                    out.append(" ".join(f"{v:.17g}" for v in values[c : c + PER_LINE]))
            out.append("</Step>")
            row += 1
        out.append("</Data>")
    out += ["</Analysis>", "</Results>"]
    return "\n".join(out) + "\n"


# Reading of results files (.res) in ADAMS's XML form, those of ADAMS and those written here.


@dataclass(frozen=True, eq=False)
class ResultSet:
    """Components of one entity over time.

    Attributes
    ----------
    name, entity, kind : str
        Name of the set, of what it belongs to, and its type as the file has it, such as ``"Part"``.
    components, units : tuple of str
    values : ndarray, shape (m, components)
        In the units of the file.
    """

    name: str
    entity: str
    kind: str
    components: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray

    def __getitem__(self, component: str) -> np.ndarray:
        """Return one component over time, shape (m,)."""
        try:
            return self.values[:, self.components.index(component)]
        except ValueError:
            known = ", ".join(self.components)
            raise KeyError(f"{self.name} has no component {component!r}; it has {known}") from None


@dataclass(frozen=True, eq=False)
class ResultsFile:
    """Content of a results file.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Output times in the unit of the file.
    units : dict of str to str
        Names of the units of angle, length, mass and time.
    sets : dict of str to ResultSet
        By name, modal coordinates of flexible bodies among them.
    """

    t: np.ndarray
    units: dict[str, str]
    sets: dict[str, ResultSet]

    def __getitem__(self, name: str) -> ResultSet:
        """Return a result set by its name."""
        try:
            return self.sets[name]
        except KeyError:
            raise KeyError(f"there is no result set {name!r}; the file has {', '.join(self.sets)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self.sets)


def read_results(path: str | Path) -> ResultsFile:
    """Read a results file (.res).

    Raises
    ------
    DeckError
        If the file is no XML, as of ADAMS's other formats, or is cut off, or a step has not as many numbers as the
        map of its components says.
    """
    path = Path(path)

    def fail(message: str, line: int = 0) -> DeckError:
        return DeckError([Diagnostic(ERROR, message, str(path), line)])

    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as error:
        message = f"{error}; the file is cut off, or no results file in XML (RESULTS/XRF){of_adams(path)}"
        raise fail(message, error.position[0]) from error
    except OSError as error:
        raise fail(f"{error.strerror}") from error
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    found = root.find(".//StepMap")
    if found is None:
        raise fail("there is no StepMap: it is no results file")
    entities = [(e, list(e.iter("Component"))) for e in found.iter("Entity")]
    columns = {int(c.get("id", "0")): k for k, c in enumerate(c for _, parts in entities for c in parts)}
    rows = []
    for number, step in enumerate(root.iter("Step"), 1):
        try:
            row = np.array([float(word) for text in step.itertext() for word in text.split()])
        except ValueError as error:
            raise fail(f"step {number}: {error}") from error
        if row.size != len(columns):
            raise fail(f"step {number} has {row.size} numbers for {len(columns)} components")
        rows.append(row)
    order = [columns[k] for k in sorted(columns)]
    values = np.empty((len(rows), len(columns)))
    if rows:
        values[:, order] = np.array(rows)
    unit = root.find(".//Units")
    sets: dict[str, ResultSet] = {}
    at = 0
    for entity, parts in entities:
        name = entity.get("name", f"set {len(sets) + 1}")
        sets[name] = ResultSet(
            name,
            entity.get("entity", ""),
            entity.get("entType", ""),
            tuple(c.get("name", "") for c in parts),
            tuple(c.get("unitsValue", "") for c in parts),
            values[:, at : at + len(parts)],
        )
        at += len(parts)
    times = sets.pop("time", None)
    if times is None:
        raise fail("there is no entity 'time': it is no results file")
    return ResultsFile(times.values[:, 0], dict(unit.attrib) if unit is not None else {}, sets)
