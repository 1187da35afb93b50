"""One word for everything that is written: ``save(thing, path)``, the ending of the path says as what."""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gearmbs._display import REPORTS
from gearmbs.progress import waiting
from gearmbs.wording import any_of

WRITERS: dict[str, dict[str, str]] = {
    "Case": {".toml": "gearmbs.studies.case.texts:write_case"},
    "Drivetrain": {".toml": "gearmbs.studies.train_files:write_train"},
    "Description": {".toml": "gearmbs.studies.train_files:write_train"},
    "GearSpec": {
        ".dxf": "gearmbs.view:write_dxf",
        ".step": "gearmbs.view:write_step",
        ".stp": "gearmbs.view:write_step",
        ".stl": "gearmbs.view:write_stl",
    },
    "Mesh": {".stl": "gearmbs.view:write_stl"},
    "Mechanism": {".adm": "gearmbs.adams:write_deck"},
    "Solution": {".nc": "gearmbs.saving:_solution"},
    "Dataset": {".nc": "gearmbs.saving:_dataset"},
    "DataFrame": {".csv": "gearmbs.saving:_table"},
    "AnalysisReport": {
        ".md": "gearmbs.saving:_report",
        ".html": "gearmbs.view.pages:write_report_page",
        ".csv": "gearmbs.saving:_report_tables",
        ".json": "gearmbs.saving:_report_data",
    },
}
WRITERS["GearPair"] = WRITERS["GearSpec"]
for _report_kind in (*REPORTS, "MeasuredTransmissionError"):
    WRITERS[_report_kind] = WRITERS["AnalysisReport"]
REPORT_FACTS = ("source", "rate", "duration", "teeth", "speed", "speed_origin", "gmf", "missing", "notes")
"""Attributes of reports that go into JSON beside their tables; speeds in rad/s."""
FIGURE_ENDINGS = (".png", ".svg", ".pdf")


def save(thing: Any, path: str | Path) -> Path | list[Path]:
    """Write an object as a file that appears under its name only when it is whole.

    Parameters
    ----------
    thing : object
        A case or a drivetrain (``.toml``), a wheel or pair (``.dxf``, ``.step``, ``.stl``), a mechanism (``.adm``), a
        solution or data set (``.nc``), a signal (any format of `gearmbs.write_signal`), a figure (``.png``, ``.svg``,
        ``.pdf``), a table (``.csv``), a report (``.md``, ``.html`` with its figure, ``.json`` with all tables, ``.csv``
        for one file a table: ``worn.csv`` gives ``worn_levels.csv`` and others), or anything with a ``save`` of its
        own, such as scenes, animations and studies.
    path : path
        Folders are made.

    Returns
    -------
    Path or list of Path
        What was written.

    Raises
    ------
    ValueError
        If an object of this kind cannot be written in that form, of which the message names the endings that will do;
        for a path that is none.
    TypeError
        If objects of this kind cannot be written.

    Examples
    --------
    >>> import gearmbs as gm
    >>> gm.save(gm.GearSpec(20, "2 mm"), "wheel.pdf")
    Traceback (most recent call last):
        ...
    ValueError: path is 'wheel.pdf'; a GearSpec is saved as .dxf, .step, .stp or .stl
    """
    if not isinstance(path, str | os.PathLike) or not str(path):
        raise ValueError(f"path is {path!r}; give the name of a file")
    path = Path(path)
    with waiting(f"saving {path.name}"):
        return _saved(thing, path)


def _saved(thing: Any, path: Path) -> Path | list[Path]:
    kinds = [kind.__name__ for kind in type(thing).__mro__]
    name = next((kind for kind in kinds if kind in WRITERS), "")
    if name:
        return _by_ending(thing, path, type(thing).__name__, WRITERS[name])
    if "DataArray" in kinds:
        endings = importlib.import_module("gearmbs.signals.files.formats").written_endings()
        return _by_ending(thing, path, "signal", dict.fromkeys(endings, "gearmbs.signals:write_signal"))
    if "Figure" in kinds:
        return _by_ending(thing, path, "figure", dict.fromkeys(FIGURE_ENDINGS, "gearmbs.saving:_figure"))
    own: Callable | None = getattr(thing, "save", None)
    if callable(own):
        written = own(path)
        return written if written is not None else path
    raise TypeError(f"{type(thing).__name__}: an object of this kind cannot be saved")


def _by_ending(thing: Any, path: Path, kind: str, writers: dict[str, str]) -> Path | list[Path]:
    endings = ("".join(path.suffixes[-parts:]).lower() for parts in (2, 1))  # of two parts: ".csv.gz"
    writer = next((writers[ending] for ending in endings if ending in writers), None)
    if writer is None:
        article = "an" if kind[0] in "AEIOU" else "a"
        raise ValueError(f"path is {str(path)!r}; {article} {kind} is saved as {any_of(writers)}")
    path.parent.mkdir(parents=True, exist_ok=True)
    module, _, name = writer.partition(":")
    written = getattr(importlib.import_module(module), name)(thing, path)
    return written if isinstance(written, (Path, list)) else path


def _dataset(data: Any, path: Path) -> Path:
    from gearmbs.studies.run.store import write_dataset

    return write_dataset(path, data)


def _solution(solution: Any, path: Path) -> Path:
    return _dataset(solution.to_dataset(), path)


def _table(table: Any, path: Path) -> Path:
    from gearmbs.files import write_whole

    return write_whole(path, table.to_csv(index=table.index.name is not None))


def _report(report: Any, path: Path) -> Path:
    from gearmbs.files import write_whole

    return write_whole(path, report.to_markdown())


def _report_tables(report: Any, path: Path) -> list[Path]:
    from gearmbs.files import write_whole

    return [
        write_whole(path.with_name(f"{path.stem}_{name}.csv"), table.to_csv(index=False))
        for name, table in report.tables().items()
    ]


def _report_data(report: Any, path: Path) -> Path:
    from gearmbs.files import write_whole

    data = {name: getattr(report, name) for name in REPORT_FACTS if hasattr(report, name)}
    # numbers that are not known are null, as JSON has it
    tables = {
        name: json.loads(table.to_json(orient="records", double_precision=15))
        for name, table in report.tables().items()
    }
    return write_whole(path, json.dumps({"kind": type(report).__name__, **data, "tables": tables}, indent=1) + "\n")


def _figure(figure: Any, path: Path) -> Path:
    from gearmbs.files import whole_file
    from gearmbs.view.figures.style import DPI, look

    with look(), whole_file(path) as part:
        figure.savefig(part, dpi=DPI)
    return path
