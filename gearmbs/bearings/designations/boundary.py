"""Boundary dimensions of rolling bearings by series and code of the bore, and ratings that makers print.

They stand in ``sizes.csv``, one row for a size of a series: bore d, outside diameter D and width B (of tapered
roller bearings T, of thrust bearings H), mm; C and C_0, kN, and the limit e = 1.5 tan(a) of the load factors where a
maker prints them, and whose they are; of needle roller bearings the raceway F on the inner ring. Dimensions are those
of ISO 15, ISO 355 and ISO 104, which all makers keep: each row is in two catalogues, or in one and in the dimension
series that the standard gives it.

Ratings are those of one maker's public catalogue (URB, 2017); of four-point, double row angular contact, full
complement and needle roller bearings, which that has not, of DAS Lager, NKE and FBJ. Others differ by their steel and
by the number of elements, some 5 to 15 % for the same design: ``ratings.csv`` has those that hold where a maker is
named, of SKF's General Catalogue of 2008 for bores of 25 to 60 mm.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

SAME = {
    "70": "60", "72": "62", "73": "63", "QJ2": "62", "QJ3": "63", "NU10": "60", "NU2": "62", "NU3": "63", "NU4": "64",
    "NU22": "22", "NU23": "23", "12": "62", "13": "63", "213": "63", "222": "22", "223": "23", "622": "22", "623": "23",
    "42": "22", "43": "23",
}  # fmt: skip
"""Series with the boundary dimensions of another one, that stand in for a size they have no row of."""

LETTERS = {"72": "B", "73": "B"}
"""Series whose rows have a letter for the contact angle; the boundary dimensions are those of all letters."""

EDITIONS = {"SKF": "2008"}
"""Of the catalogues whose ratings hold where their maker is named; later ones print up to a quarter more."""

CAGE = re.compile(r"(\d+)X(\d+)X(\d+)$")
"""Code of a needle roller and cage assembly K: the raceways F and E and the width, mm."""


@dataclass(frozen=True)
class Size:
    """A size of a series, m and N; None where no maker prints it.

    Attributes
    ----------
    bore, outside_diameter, width : float
    dynamic_rating, static_rating : float or None
    limit : float or None
        e.
    raceway : float or None
        F.
    maker : str
        Whose the ratings are.
    """

    bore: float
    outside_diameter: float
    width: float
    dynamic_rating: float | None = None
    static_rating: float | None = None
    limit: float | None = None
    raceway: float | None = None
    maker: str = ""

    @property
    def boundary(self) -> dict[str, float]:
        """Bore, outside diameter and width."""
        return {"bore": self.bore, "outside_diameter": self.outside_diameter, "width": self.width}

    @property
    def ratings(self) -> dict[str, float | str]:
        """C and C_0 as fields of a bearing, and whose they are; empty if they are not tabulated."""
        if self.dynamic_rating is None or self.static_rating is None:
            return {}
        return {
            "dynamic_rating": self.dynamic_rating, "static_rating": self.static_rating, "rating_source": self.maker,
        }  # fmt: skip


@cache
def sizes() -> dict[tuple[str, str], Size]:
    """Return all sizes by series and code of the bore."""

    def number(text: str, power: int) -> float | None:
        return float(f"{text}e{power}") if text else None

    found = {}
    text = files("gearmbs.bearings.designations").joinpath("sizes.csv").read_text(encoding="utf-8")
    for row in csv.DictReader(text.splitlines()):
        found[row["series"], row["code"]] = Size(
            float(f"{row['d']}e-3"), float(f"{row['D']}e-3"), float(f"{row['B']}e-3"), number(row["C"], 3),
            number(row["C0"], 3), number(row["e"], 0), number(row["F"], -3), row["maker"],
        )  # fmt: skip
    return found


@cache
def maker_ratings() -> dict[tuple[str, str, str], tuple[float, float]]:
    """Return C and C_0 by maker, series and code of the bore, N."""
    text = files("gearmbs.bearings.designations").joinpath("ratings.csv").read_text(encoding="utf-8")
    return {
        (row["maker"], row["series"], row["code"]): (float(f"{row['C']}e3"), float(f"{row['C0']}e3"))
        for row in csv.DictReader(text.splitlines())
    }


def size_of(series: str, code: str, maker: str = "") -> Size | None:
    """Return a size of a series, of its own row or only with the dimensions of another series that has them.

    Parameters
    ----------
    series : str
        One of the table, such as "62", "NU2", "303"; RNA for NA without its inner ring, K for cages by their code.
    code : str
        Of the bore, as it stands in a designation: "05" for 25 mm, "/22" for 22 mm, "8" below 10 mm.
    maker : str
        Whose ratings take the place of those of the row, where they are tabulated.
    """
    size, rated = _size_of(series, code), maker_ratings().get((maker, series, code))
    if size is None or rated is None:
        return size
    return replace(size, dynamic_rating=rated[0], static_rating=rated[1], maker=f"{maker} {EDITIONS[maker]}")


def _size_of(series: str, code: str) -> Size | None:
    if series == "K":
        cage = CAGE.match(code)
        inner, outer, width = (0.0, 0.0, 0.0) if cage is None else (1e-3 * float(part) for part in cage.groups())
        return Size(inner, outer, width, raceway=inner) if inner < outer else None
    table = sizes()
    if series.startswith("RNA"):
        whole = table.get((series[1:], code))
        if whole is None or whole.raceway is None:
            return None
        return Size(
            whole.raceway, whole.outside_diameter, whole.width, whole.dynamic_rating, whole.static_rating, None,
            whole.raceway, whole.maker,
        )  # fmt: skip
    own = table.get((series, code)) or table.get((series + LETTERS.get(series, ""), code))
    if own is not None and (series, code) in table:
        return own
    other = own or table.get((SAME.get(series, ""), code))
    return None if other is None else Size(other.bore, other.outside_diameter, other.width)


def boundary(series: str, code: str) -> dict[str, float]:
    """Return bore, outside diameter and width of a size of a series, m; empty if it is not tabulated."""
    size = size_of(series, code)
    return {} if size is None else size.boundary
