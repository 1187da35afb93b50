"""Reading of results files (.res) in ADAMS's XML form, those of ADAMS and those written here."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gearmbs.adams.errors import ERROR, DeckError, Diagnostic


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
        message = f"{error}; the file is cut off, or no results file in XML (RESULTS/XRF)"
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
