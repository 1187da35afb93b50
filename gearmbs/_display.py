"""Objects that show and save themselves: tables in notebooks, ``plot()`` and ``save(path)``.

The packages that draw know the objects, not the other way about; so what draws an object is looked up here by name when
it is first asked for.
"""

from __future__ import annotations

import html
import importlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from gearmbs._lazy import Guessed
from gearmbs.units import Given

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLOTS = {
    "GearSpec": "gearmbs.view:wheel_plot",
    "GearPair": "gearmbs.view:mesh_view",
    "Mechanism": "gearmbs.view:mechanism_plot",
    "Solution": "gearmbs.view:solution_plot",
    "Case": "gearmbs.studies.show:case_plot",
    "Sweep": "gearmbs.studies.show:sweep_plot",
    "AnalysisReport": "gearmbs.view:report_plot",
    "VibrationReport": "gearmbs.view:report_plot",
    "ComparisonReport": "gearmbs.view:report_plot",
    "BearingReport": "gearmbs.view:bearing_plot",
    "PlanetaryReport": "gearmbs.view:planetary_plot",
    "MeasuredTransmissionError": "gearmbs.view:measured_error_plot",
    "PaperStudy": "gearmbs.studies.show:study_plot",
}
"""Functions that draw objects, by the name of their class."""

REPORTS = ("AnalysisReport", "VibrationReport", "ComparisonReport", "BearingReport", "PlanetaryReport")
TABLES = {
    "GearSpec": "gearmbs.gears.mesh:wheel_html",
    "Mechanism": "gearmbs.mechanism.solve.measures:mechanism_html",
    "Solution": "gearmbs.dae.results.dataset:solution_html",
    "Case": "gearmbs.studies.show:case_html",
    **dict.fromkeys(
        (*REPORTS, "MeasuredTransmissionError"),
        "gearmbs.view.pages:report_body",
    ),
}
"""Functions that make tables of objects for notebooks, for classes that do not do so themselves."""


class Written(Guessed):
    """What dataclasses share that show themselves as they were written: fields at their defaults left out, quantities
    with the units that the user gave."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        # a method of the class itself is left alone by the decorator of dataclasses
        if "__repr__" not in cls.__dict__:
            cls.__repr__ = written  # type: ignore[assignment]


def written(thing: Any) -> str:
    """Return how a dataclass is built: its name and the fields that differ from their defaults.

    Examples
    --------
    >>> from gearmbs.gears import OperatingPoint
    >>> OperatingPoint("60 N m", rotation=-1)
    OperatingPoint(torque='60 N m', rotation=-1)
    """
    return f"{type(thing).__name__}({', '.join(f'{name}={_code(value)}' for name, value in settings_of(thing))})"


def settings_of(thing: Any) -> list[tuple[str, Any]]:
    """Return name and value of the fields of a dataclass that differ from their defaults."""
    found = []
    for item in fields(thing):
        value = getattr(thing, item.name)
        default = item.default if item.default_factory is MISSING else item.default_factory()
        if isinstance(value, Given):
            same = value.text == default
        else:
            plain = is_dataclass(default) or isinstance(default, (str, float, int, tuple))
            same = value is default or (plain and isinstance(value, type(default)) and value == default)
        if item.repr and not same:
            found.append((item.name, value))
    return found


def readable(value: Any) -> str:
    """Return a setting as a table shows it: a quantity as it was given, vectors with commas."""
    if isinstance(value, Given):
        return value.text
    if isinstance(value, str):
        return value.strip()
    if isinstance(value, (list, tuple)):
        return ", ".join(map(readable, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _code(value: Any) -> str:
    """Return a value as it stands in a program, a quantity as it was given."""
    if isinstance(value, Given):
        return repr(value.text)
    if type(value) in (tuple, list):
        inner = ", ".join(map(_code, value))
        if isinstance(value, list):
            return f"[{inner}]"
        return f"({inner},)" if len(value) == 1 else f"({inner})"
    return repr(value)


class PlotKeywords(TypedDict, total=False):
    """Keywords of all functions that draw objects, for type checkers; which of them one has follows from its class."""

    title: str | None
    ax: Axes | None
    # of pairs of gears; the places and points are theirs
    driver_angle: float | None
    torque: float | None
    place: Any
    points: Any
    width: float | None
    section: float
    exaggeration: float
    # of reports and studies
    signal: xr.DataArray | None
    channel: str | None
    component: str | None
    load: str | None
    speed: Any
    phase: xr.DataArray | None
    tacho: str | None
    pulses_per_rev: float
    speed_channel: str | None
    # of sweeps over speeds, whose figure is a waterfall
    style: str
    decibels: float | None
    maximum: float | str | None


class Shown(Guessed):
    """What objects that show themselves share."""

    def plot(self, **options: Unpack[PlotKeywords]) -> Figure:
        """Draw the object and return the figure, which shows itself in notebooks.

        Parameters
        ----------
        **options
            Of the function that draws it: `gearmbs.view.wheel_plot`, `mesh_view`, `mechanism_plot`, `solution_plot` or
            `report_plot`.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return draw(self, **options)

    def _repr_html_(self) -> str | None:
        maker = _found(self, TABLES)
        # None leaves it to what the object has besides, such as Markdown
        return None if maker is None else maker(self)

    def save(self, path: str | Path) -> Path | list[Path]:
        """Write the object; the ending of the path says as what. See `gearmbs.save`."""
        return importlib.import_module("gearmbs").save(self, path)


def draw(thing: Any, **options: Any) -> Any:
    """Return the figure of an object.

    Raises
    ------
    TypeError
        If nothing is known that draws it.
    """
    maker = _found(thing, PLOTS)
    if maker is None:
        raise TypeError(
            f"{type(thing).__name__}: nothing is known that draws it; gearmbs.view has figures for many things"
        )
    return maker(thing, **options)


def _found(thing: Any, makers: dict[str, str]) -> Callable | None:
    """Return what a table of makers has for the class of an object, or for one that it is made from."""
    for kind in type(thing).__mro__:
        if kind.__name__ in makers and kind.__module__.startswith("gearmbs."):
            module, _, name = makers[kind.__name__].partition(":")
            return getattr(importlib.import_module(module), name)
    return None


def html_table(caption: str, header: Sequence[str], rows: Iterable[Sequence[Any]], note: str = "") -> str:
    """Return a table for notebooks; texts are escaped, numbers stand to the right."""
    head = "".join(f"<th>{html.escape(str(cell))}</th>" for cell in header)
    body = "".join("<tr>" + "".join(_cell(cell) for cell in row) + "</tr>" for row in rows)
    below = f"<p>{html.escape(note)}</p>" if note else ""
    title = f'<caption style="text-align:left;font-weight:bold">{html.escape(caption)}</caption>'
    return f"<table>{title}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{below}"


def _cell(value: Any) -> str:
    if isinstance(value, Given):
        value = value.text
    if isinstance(value, float):
        return f'<td style="text-align:right">{value:.6g}</td>'
    side = "right" if isinstance(value, int) else "left"
    return f'<td style="text-align:{side}">{html.escape(str(value))}</td>'
