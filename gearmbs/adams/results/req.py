"""The request file (.req): a directory of the requests, then their values step by step.

Header, title and unit line; for every request a line with id, type, I, J and the length of its comment,
then the comment; for every output time a line with the time and one line of six values a request, the
columns 2-4 and 6-8 (magnitudes are left out, as ADAMS does).
"""

from __future__ import annotations

from datetime import datetime

import numpy as np

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.statements_data import REQUEST_TYPES
from gearmbs.adams.parse.units import unit_names
from gearmbs.adams.results.record import RunRecord

OF_EXPRESSIONS = 5
"""The type of a request by F1 to F8."""
KEPT = (1, 2, 3, 5, 6, 7)
"""Columns that are written."""
UNIT_CODES = {"MILLIMETER": "MM", "METER": "M", "CENTIMETER": "CM", "INCH": "IN", "FOOT": "FT"}


def unit_line(result: RunRecord) -> tuple[str, float]:
    """Return the name of the deck's unit system and its consistency factor."""
    names = unit_names(result.deck.only(st.Units))
    length = UNIT_CODES.get(names["length"], names["length"][:2] or "NO")
    units = result.deck.units
    factor = units.force * units.time**2 / (units.mass * units.length)
    mass = {"KILOGRAM": "KG", "GRAM": "G"}.get(names["mass"], names["mass"][:2])
    return f"{length}{mass}{names['time'][:1]}_{names['force'][:1]}_RACA", factor


def request_text(result: RunRecord, now: datetime | None = None) -> str:
    """Return the content of the request file.

    Parameters
    ----------
    result : RunRecord
    now : datetime, optional
        Time stamp in the header.
    """
    stamp = (now or datetime.now()).strftime("%Y-%m-%d %H:%M:%S")
    requests = result.deck.of(st.Request)
    name, factor = unit_line(result)
    lines = [f" A.R3    {stamp}               0         0  3D", f"{result.deck.title[:80]:<80}"]
    lines.append(f"{len(requests):>5}{name:>17} {factor:.15E}")
    for number, request in requests.items():
        comment = (request.comment or request.name or "")[:80]
        kind = REQUEST_TYPES[request.type].number if request.type else OF_EXPRESSIONS
        lines.append(f"{number:>10}{kind:>5}{request.i or 0:>10}{request.j or 0:>10}{len(comment):>5}")
        lines.append(comment)
    values = [result.request(number)[:, KEPT] for number in requests]
    for k, t in enumerate(result.t):
        lines.append(f"{t:14.5E}")
        lines.extend("".join(f"{v:14.5E}" for v in rows[k]) for rows in values)
    return "\n".join(lines) + "\n"


def read_requests(text: str) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Read a request file back: times, and the six kept columns of every request.

    Raises
    ------
    ValueError
        If the file is cut off or not a request file.
    """
    lines = text.splitlines()
    try:
        count = int(lines[2].split()[0])
        ids = [int(lines[3 + 2 * k].split()[0]) for k in range(count)]
        numbers = np.array(" ".join(lines[3 + 2 * count :]).split(), dtype=float).reshape(-1, 1 + 6 * count)
    except (IndexError, ValueError) as error:
        raise ValueError("not a request file, or cut off") from error
    table = numbers[:, 1:].reshape(-1, count, 6)
    return numbers[:, 0], {number: table[:, k] for k, number in enumerate(ids)}
