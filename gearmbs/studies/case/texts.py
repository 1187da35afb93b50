"""A case as the text of a case file, with quantities in the units they were given in."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from gearmbs.schema.described import toml_table
from gearmbs.schema.quantities import SHOWN, Measure
from gearmbs.studies.case.section import Section, measures_of


def case_toml(case: Section) -> str:
    """Return the case file of a case, from which `gearmbs.load_case` makes it again.

    Settings that were left at their defaults are left out; quantities stand as they were written, or in SI.
    """
    lines = [f"name = {json.dumps(vars(case)['name'])}"]
    tables: list[str] = []
    for key in type(case).model_fields:
        section = getattr(case, key)
        if not isinstance(section, Section) or not section.model_fields_set:
            continue
        values = section.model_dump(exclude_unset=True)
        faults = values.pop("teeth", ()) if key == "fault" else ()
        lines += toml_table(f"[{key}]", values | {k: v for k, v in section.written.items() if k in values})
        for fault in faults:
            tables += toml_table("[[fault.teeth]]", fault)
    return "\n".join([*lines, *tables]) + "\n"


def write_case(case: Section, path: str | Path) -> Path:
    """Write a case as a case file."""
    from gearmbs.files import write_whole

    return write_whole(path, case_toml(case))


def readable(section: Section, key: str) -> str:
    """Return a setting as a user reads it: as written, else in the unit that people use."""
    value, measure = getattr(section, key), measures_of(type(section)).get(key)
    if key in section.written:
        value, measure = section.written[key], None
    if value is None:
        return "default"
    if isinstance(value, tuple | list) and value and isinstance(value[0], tuple | list):
        inner = [(point[0], point[1]) for point in value]
        return ", ".join(f"{_text_of(t, Measure('time'))}: {_text_of(v, measure)}" for t, v in inner)
    if isinstance(value, tuple | list):
        return ", ".join(_text_of(item, measure) for item in value)
    return _text_of(value, measure)


def _text_of(value: Any, measure: Measure | None) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str) or measure is None:
        return f"{value:.6g}" if isinstance(value, float) else str(value)
    unit = measure.shown or measure.unit
    number = value / SHOWN.get(unit, 1.0)
    text = f"{number:.6g}" if math.isfinite(number) else str(number)
    return text if unit == "1" else f"{text} {unit}"
