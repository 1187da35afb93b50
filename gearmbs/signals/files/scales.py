"""Factors that a file names beside counts of a converter or volts of a sensor without saying how to use them.

They are not applied, for nothing says whether to multiply or to divide; that they are there is said (CHECK THE SCALE).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gearmbs.signals.signal.record import number_of
from gearmbs.signals.signal.units import ELECTRICAL
from gearmbs.signals.signal.words import folded, words_of

FACTORS = frozenset(
    (
        "scale scaling scalefactor offset gain slope intercept sensitivity sens calibration factor lsb resolution cal "
        "calfactor calibrationfactor gainfactor multiplier skalierung skalierungsfaktor empfindlichkeit faktor "
        "kalibrierfaktor verstaerkung verstarkung citlivost meritko sensibilite echelle"
    ).split()
)
"""Names of numbers by which counts of a converter may have to be multiplied, divided or shifted."""
CHECK = "CHECK THE SCALE: "


def named_factors(header: Mapping[str, Any], more: Iterable[str] = ()) -> dict[str, str]:
    """Return those entries of a header that are factors other than 0 and 1, as text.

    Parameters
    ----------
    header : mapping
    more : iterable of str
        Words that may stand beside that of the factor, as the name of its channel.

    Examples
    --------
    >>> named_factors({"Scale": "0.001 g/count", "gain": 1.0, "Vertical Scale": 0.2, "acc_sens": 0.1}, ["acc"])
    {'Scale': '0.001 g/count', 'acc_sens': '0.1'}
    """
    beside, found = frozenset(more), {}
    for name, value in header.items():
        words = words_of(str(name).rpartition(".")[2])
        number = number_of(value)
        whole = folded("".join(words)) in FACTORS
        rest = [word for word in words if word not in FACTORS]
        if number is None or number[0] in (0.0, 1.0) or not (whole or (rest != words and beside.issuperset(rest))):
            continue
        found[str(name)] = str(value).strip() if isinstance(value, str) else f"{number[0]:g}"
    return found


def are_counts(values: np.ndarray) -> bool:
    """Return whether samples are whole numbers that change, as those of a converter."""
    return values.dtype.kind in "iu" or bool(np.ptp(values) > 0.0 and np.all(values == np.rint(values)))


def scale_told(name: str, unit: str, values: np.ndarray, factors: Mapping[str, str]) -> str | None:
    """Return what is to be said of a channel beside which factors stand, or None if it hardly needs them."""
    if not factors:
        return None
    electrical = unit.strip() in ELECTRICAL
    if not electrical and not are_counts(values):
        return None
    listed = ", ".join(f"{factor} = {value}" for factor, value in factors.items())
    what = f"is in {unit.strip()}" if electrical else "holds whole numbers"
    return (
        f"{CHECK}{name} {what} and the file names {listed}, not applied, for nothing says how; scale the samples "
        "yourself and give their units=... (--units)."
    )
