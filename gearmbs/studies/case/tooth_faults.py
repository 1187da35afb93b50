"""Faults of teeth in a case: from the text and tables of a user to the classes of `gearmbs.gears.faults`.

A fault is a name, such as ``"chipped corner"``, or a table ``{"kind": "chipped corner", "height": "2 mm"}``, or an
object of :mod:`gearmbs.gears.faults`. A case holds it as a table of plain numbers in SI.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

from gearmbs.gears import faults
from gearmbs.gears.tables import tooth_deviations
from gearmbs.schema.described import check_keys
from gearmbs.wording import did_you_mean

if TYPE_CHECKING:
    from gearmbs.gears.pair import GearPair


def kinds() -> dict[str, type[faults.Fault]]:
    """Return the faults a case can hold by their labels, such as "broken tooth"; modifications meant come last."""
    found = (value for value in vars(faults).values() if isinstance(value, type) and issubclass(value, faults.Fault))
    ordered = sorted(found, key=lambda kind: kind.__module__ != faults.__name__)
    return {kind.label: kind for kind in ordered if kind is not faults.Fault}


def tooth_fault(value: Any) -> faults.Fault:
    """Return the fault that a name, a table or a fault stands for.

    Raises
    ------
    ValueError
        For an unknown kind or key, or a value of the wrong unit; the message names what would do.

    Examples
    --------
    >>> tooth_fault({"kind": "broken_tooth", "lost": 0.5, "wheel": "driven"}).severity
    0.5
    """
    if isinstance(value, faults.Fault):
        return value
    table = {"kind": value} if isinstance(value, str) else value
    if not isinstance(table, Mapping) or not isinstance(table.get("kind"), str):
        raise ValueError(f"{value!r} is no fault; write its name or a table with 'kind', one of {', '.join(kinds())}")
    wanted = _letters(table["kind"])
    kind = next((k for label, k in kinds().items() if wanted in (_letters(label), _letters(k.__name__))), None)
    if kind is None:
        hint = did_you_mean(table["kind"].lower(), kinds(), before="; ", alike=0.5)
        raise ValueError(f"kind {table['kind']!r} is unknown; known ones are {', '.join(kinds())}{hint}")
    settings: dict[str, Any] = {str(key): item for key, item in table.items() if key != "kind"}
    check_keys(settings, [field.name for field in fields(kind)], kind.label, ValueError, listed=True)
    return kind(**settings)


def fault_table(fault: faults.Fault) -> dict[str, Any]:
    """Return a fault as a table of its kind and its values in SI, from which `tooth_fault` makes it again."""
    return {"kind": fault.label, **asdict(fault)}


def fault_tables(value: Any) -> tuple[dict[str, Any], ...]:
    """Return the tables of one fault or several.

    Raises
    ------
    ValueError
        As `tooth_fault`, beginning with the fault's place: ``[0].tooth is 1.5; ...``.
    """
    several = value if isinstance(value, (list, tuple)) else (value,)
    return tuple(fault_table(_placed(one, place)) for place, one in enumerate(several))


def check_each_fault(pair: GearPair, tables: Sequence[Mapping[str, Any]]) -> None:
    """Apply every fault to a sound pair by itself, to find those that do not fit their wheel before anything is run.

    Raises
    ------
    ValueError
        Naming the fault by its place, ``[0].lost``, with its value and what would do.
    """
    for place, table in enumerate(tables):
        fault = tooth_fault(table)
        try:
            tooth_deviations(pair.with_changes(faults=(fault,)))
        except ValueError as error:
            raise ValueError(_at(place, fault, error)) from None


def _placed(value: Any, place: int) -> faults.Fault:
    try:
        return tooth_fault(value)
    except ValueError as error:
        raise ValueError(_at(place, None, error)) from error


def _at(place: int, fault: faults.Fault | None, error: ValueError) -> str:
    text = str(error)
    names = [type(fault).__name__] if fault is not None else [kind.__name__ for kind in kinds().values()]
    for name in names:
        if text.startswith(f"{name}."):
            return f"[{place}]{text.removeprefix(name)}"
    return f"[{place}]: {text}"


def _letters(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())
