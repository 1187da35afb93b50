"""Objects that show and save themselves: tables in notebooks, ``plot()`` and ``save(path)``.

The packages that draw know the objects, not the other way about; so what draws an object is looked up here by name when
it is first asked for.
"""

from __future__ import annotations

import html
import importlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

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
    "PlanetaryReport": "gearmbs.view:planetary_plot",
    "PaperStudy": "gearmbs.studies.show:study_plot",
}
"""What draws an object, by the name of its class."""

TABLES = {
    "GearSpec": "gearmbs.gears.show:wheel_html",
    "Mechanism": "gearmbs.mechanism.show:mechanism_html",
    "Solution": "gearmbs.dae.results.show:solution_html",
    "Case": "gearmbs.studies.show:case_html",
}
"""What makes a table of an object for notebooks, where its class does not do so itself."""


class Shown:
    """What objects that show themselves share."""

    def plot(self, **options: Any) -> Any:
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
    if isinstance(value, float):
        return f'<td style="text-align:right">{value:.6g}</td>'
    side = "right" if isinstance(value, int) else "left"
    return f'<td style="text-align:{side}">{html.escape(str(value))}</td>'
