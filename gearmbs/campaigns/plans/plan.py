"""A plan: what is simulated, what varies, by which design, what is kept, under which limits."""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

from gearmbs.campaigns.plans import designs
from gearmbs.campaigns.plans.conditions import satisfied
from gearmbs.campaigns.plans.factors import (
    AnyFactor,
    Choice,
    Columns,
    Factor,
    Specimens,
    factor_from,
    factor_table,
)
from gearmbs.campaigns.plans.paths import get_path, set_path
from gearmbs.campaigns.settings import CampaignError, content_key
from gearmbs.campaigns.subjects.base import SignalSpec, Subject, make_subject
from gearmbs.files import python_scalar

if TYPE_CHECKING:
    from gearmbs.units import QuantityLike

FORMAT = 2

ABOUT = ("index", "unit", "point", "slot", "id", "status", "message", "advice")
"""Columns of a table that are neither factors nor results."""

ALONG = ("_channel", "_time")
"""What follows the name of an array of signals in those of its dimensions."""

TAKEN = (*ABOUT, "case")
"""Names that no column of a plan may have: those, and that of the dimension along which results are read."""

ALL_CORNERS = 6
"""Up to so many coordinates every corner is checked; beyond, both ends of each and some corners."""


class PlanKeywords(TypedDict, total=False):
    """Fields of a `Plan` but for what `gearmbs.campaigns.make_plan` names itself, as they are given to it."""

    seed: int
    constraints: str | Sequence[str]
    options: dict[str, Any]
    unit: int | None
    time_limit: QuantityLike | None
    wall_limit: QuantityLike | None
    memory_limit: QuantityLike | None
    on_failure: str
    reuse: str | Sequence[str | Path]


@dataclass(frozen=True)
class Plan:
    """What a campaign is to do; make it with `gearmbs.campaigns.make_plan`, which checks it.

    Attributes
    ----------
    subject : Subject
    factors : tuple
        Of `Factor`, `Choice` and `Specimens`, in SI.
    design : str
        One of `gearmbs.campaigns.plans.designs.DESIGNS`.
    n : int
        Points of a sequence, base points of a Saltelli design, trajectories of a Morris design; of no meaning
        otherwise.
    seed : int
    keep : tuple of str
        What of each record is kept; see the subject.
    constraints : tuple of str
        Points that do not satisfy them all are left out.
    options : dict
        Of the design: ``levels`` of a grid (where the factor does not say), a one-at-a-time or a Morris design,
        ``generators``, ``faced``, ``centre``, ``rows``.
    unit : int, optional
        Cases worked on and stored together; by default as many as make work for a hundred workers, 1024 at most.
    time_limit : float, optional
        Processor seconds of a case.
    wall_limit : float, optional
        Seconds of a case by the clock; by default ten times ``time_limit`` and a minute, without that no limit.
    memory_limit : float, optional
        Bytes a case may allocate beyond what its worker has.
    on_failure : {"record", "tighter", "stop"}
        Record a failed case and go on; try it once more with a tighter tolerance; or end the campaign.
    reuse : tuple of str
        Folders of other campaigns whose results of equal cases are taken over.
    """

    subject: Subject
    factors: tuple[AnyFactor, ...] = ()
    design: str = "sobol"
    n: int = 0
    seed: int = 0
    keep: tuple[str, ...] = ()
    constraints: tuple[str, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)
    unit: int | None = None
    time_limit: float | None = None
    wall_limit: float | None = None
    memory_limit: float | None = None
    on_failure: str = "record"
    reuse: tuple[str, ...] = ()

    def __str__(self) -> str:
        size = f", n = {self.n}" if self.n else ""
        head = f"plan of a {self.subject.kind}: {self.design}{size}, seed {self.seed}, {self.dimensions} dimensions"
        lines = [f"  {factor.name}: {self._range_text(factor)}" for factor in self.factors]
        lines += [f"  where {constraint}" for constraint in self.constraints]
        return "\n".join([head, *lines, f"  keeps {', '.join(self.keep) or 'nothing'}"])

    def _range_text(self, factor: AnyFactor) -> str:
        """Return what a factor may be, as text."""
        if isinstance(factor, Choice):
            return f"{'each' if factor.crossed else 'one'} of {', '.join(factor.options)}"
        if not isinstance(factor, Factor):
            return f"{factor.draws} draws, seed {factor.seed}"
        unit = self.subject.unit_of(factor.path)
        suffix = "" if unit == "1" else f" {unit}"
        if factor.values:
            return f"one of {', '.join(map(str, factor.values))}{suffix}"
        scale = ", logarithmic" if factor.scale == "log" else ""
        return f"{factor.low:g} to {factor.high:g}{suffix}{', whole' if factor.whole else ''}{scale}"

    @property
    def dimensions(self) -> int:
        """Coordinates of the unit cube."""
        return sum(factor.width for factor in self.factors)

    @property
    def variants(self) -> int:
        """Cases of each point: the options of its crossed choices."""
        return math.prod(len(f.options) for f in self.factors if isinstance(f, Choice) and f.crossed)

    @property
    def extends(self) -> bool:
        """Whether the design goes on where it stopped."""
        return self.design in (*designs.SEQUENCES, *designs.ANALYSES)

    @property
    def has_n(self) -> bool:
        """Whether n is of meaning to the design."""
        return self.extends or self.design == "latin hypercube"

    @property
    def group(self) -> str | None:
        """Column of the physical individual, the group of every split; None without specimens."""
        return next((f.name for f in self.factors if isinstance(f, Specimens)), None)

    @property
    def longest(self) -> float | None:
        """Seconds that a case may take by the clock, None without a limit."""
        if self.wall_limit is None and self.time_limit is not None:
            return 10.0 * self.time_limit + 60.0
        return self.wall_limit

    @property
    def points_a_base(self) -> int:
        """Points of the design for each of n."""
        return {"saltelli": self.dimensions + 2, "morris": self.dimensions + 1}.get(self.design, 1)

    @property
    def size(self) -> int:
        """Number of cases, before constraints leave any out."""
        return self.variants * (self.n * self.points_a_base if self.has_n else len(self.points()))

    def blocks(self, n: int, first: int, size: int) -> Iterator[tuple[int, np.ndarray]]:
        """Yield the points from the first on, some at a time, each block with the number of its first point.

        Those of a sequence or an analysis are drawn block by block: a plan need not fit into memory.
        """
        if not self.extends or not self.dimensions:
            points = self.points(n)
            for start in range(first, len(points), size):
                yield start, points[start : start + size]
            return
        levels = int(self.options.get("levels", 4))
        each = self.points_a_base
        base = max(1, size // each)
        for start in range(first // each, n, base):
            count = min(base, n - start)
            if self.design == "saltelli":
                yield start * each, designs.saltelli(count, self.dimensions, self.seed, start)
            elif self.design == "morris":
                yield start * each, designs.morris(count, self.dimensions, self.seed, levels, start)
            else:
                points = designs.sequence(self.design, count, self.dimensions, self.seed, start)
                yield start, self._dealt(points, start)

    def points(self, n: int | None = None) -> np.ndarray:
        """Return the points of the design in the unit cube, shape (points, dimensions)."""
        n, d, o = self.n if n is None else n, self.dimensions, self.options
        if self.design == "saltelli":
            return designs.saltelli(n, d, self.seed)
        if self.design == "morris":
            return designs.morris(n, d, self.seed, int(o.get("levels", 4)))
        if self.design == "grid":
            return designs.grid(self.counts())
        if self.design == "one at a time":
            base = self.subject.base()
            at = [x for factor in self.factors for x in self._base_coordinates(factor, base)]
            return designs.one_at_a_time(self.counts(beyond=0), at)
        if self.design == "factorial":
            return 0.5 + 0.5 * designs.factorial(d, o.get("generators", ()))
        if self.design == "plackett burman":
            return 0.5 + 0.5 * designs.plackett_burman(d)
        if self.design == "central composite":
            settings = {k: o[k] for k in ("faced", "centre") if k in o}
            return 0.5 + 0.5 * designs.central_composite(d, **settings)
        if self.design == "box behnken":
            return 0.5 + 0.5 * designs.box_behnken(d, int(o.get("centre", 1)))
        if self.design == "list":
            return np.zeros((len(o["rows"]), 0))
        return self._dealt(designs.sequence(self.design, n, d, self.seed))

    def _dealt(self, u: np.ndarray, first: int = 0) -> np.ndarray:
        """Return points, from a number on, with specimens dealt out in rounds, so that each is met once a round.

        A coordinate of a sequence meets some of few specimens several times and others never.
        """
        at = 0
        for factor in self.factors:
            if isinstance(factor, Specimens):
                rounds = range(first // factor.draws, -(-(first + len(u)) // factor.draws))
                order = [np.random.default_rng([factor.seed, self.seed, k]).permutation(factor.draws) for k in rounds]
                numbers = np.concatenate(order)[first % factor.draws :][: len(u)]
                u[:, at] = (numbers + 0.5) / factor.draws
            at += factor.width
        return u

    def count(self, factor: AnyFactor) -> int:
        """Return how many values of a factor a grid takes."""
        if isinstance(factor, Factor) and not factor.values and factor.levels is None:
            return int(self.options.get("levels", 2))
        return factor.count

    def counts(self, beyond: int = 1) -> list[int]:
        """Return how many values of each coordinate are taken: ``beyond`` of those beyond a factor's first.

        A crossed choice, all of whose options are taken with each point, has no coordinate of the choice.
        """
        return [
            count
            for f in self.factors
            for count in ([beyond] * f.width if crossed(f) else [self.count(f), *([beyond] * (f.width - 1))])
        ]

    def _base_coordinates(self, factor: AnyFactor, base: dict[str, Any]) -> list[float]:
        """Return the coordinates at which a factor gives what the base has; the first of the specimens."""
        if isinstance(factor, Specimens):
            return [0.0]
        if crossed(factor):
            return [0.5] * factor.width
        value = get_path(base, factor.path)
        if isinstance(factor, Factor):
            return [factor.coordinate(value, self.subject.unit_of(factor.path))]
        key = self._key(base)
        for at in factor.candidates(value):
            data = copy.deepcopy(base)
            row = {name: python_scalar(column[0]) for name, column in factor.columns(np.array([at])).items()}
            factor.apply(data, row)
            with suppress(ValueError):
                # an option that is impossible is not what the base has
                if self._key(data) == key:
                    return at
        raise CampaignError(
            f"{factor.path}: the base has {value!r:.60}, which is none of the options {', '.join(factor.options)}; "
            "give it as one more, with which the others are compared"
        )

    def _key(self, data: dict[str, Any]) -> str:
        """Return what nested data of the same content have in common."""
        return content_key(self.subject.kind, self.subject.canonical(self.subject.check(data, "base")))

    def columns(self, u: np.ndarray, first_point: int = 0) -> Columns:
        """Return the columns of points u, each with all its variants, and the number of the point."""
        count = self.variants
        rows = np.repeat(np.arange(len(u)), count)
        found: Columns = {"point": rows + first_point}
        if self.design == "list":
            here = self.options["rows"][first_point : first_point + len(u)]
            for name in dict.fromkeys(key for row in self.options["rows"] for key in row):
                values = [row.get(name) for row in here]
                # NaN stands for a number that a row leaves at the base's
                numbers = all(v is None or isinstance(v, float) for v in values) or (
                    None in values and all(v is None or type(v) is int for v in values)
                )
                found[name] = np.array(values, dtype=float) if numbers else _column(values)
            return found
        variant = np.tile(np.arange(count), len(u))
        at = 0
        for factor in self.factors:
            mine = u[rows, at : at + factor.width]
            at += factor.width
            if isinstance(factor, Choice) and factor.crossed:
                found |= factor.columns(mine, variant % len(factor.options))
                variant //= len(factor.options)
            else:
                found |= factor.columns(mine)
        return found

    def places(self, u: np.ndarray) -> np.ndarray:
        """Return where the values of points u lie in the ranges of their factors, (points, dimensions).

        0 to 1; NaN for what has no order. Few values lie elsewhere than the coordinates that choose them. Crossed
        choices, which take no coordinate of the choice itself, have none.
        """
        ends = np.cumsum([factor.width for factor in self.factors])
        parts = zip(self.factors, np.split(u, ends[:-1], axis=1), strict=True)
        return np.hstack([factor.places(mine) for factor, mine in parts])

    def allowed(self, columns: Columns) -> np.ndarray:
        """Return which rows satisfy all constraints."""
        good = np.ones(len(columns["point"]), dtype=bool)
        for text in self.constraints:
            good &= satisfied(text, columns, self.unit_of, empty=self.empty(columns))
        return good

    def empty(self, columns: Columns) -> dict[str, np.ndarray]:
        """Return in which rows columns of the plan are empty: what a row leaves out, ranges that an option has not."""
        if self.design == "list":
            here = [self.options["rows"][int(point)] for point in columns["point"]]
            names = {name for row in self.options["rows"] for name in row} & {*columns}
            return {name: np.array([name not in row for row in here]) for name in names}
        choices = [factor for factor in self.factors if isinstance(factor, Choice)]
        ranges = [f"{choice.name}.{key}" for choice in choices for keys in choice.ranges.values() for key in keys]
        return {name: np.isnan(columns[name]) for name in ranges if name in columns}

    def unit_of(self, name: str) -> str:
        """Return the unit of a column, "1" or "" where it has none."""
        if self.design == "list" and any(name in row for row in self.options["rows"]):
            return self.subject.unit_of(name)
        for factor in self.factors:
            if isinstance(factor, Factor) and factor.name == name:
                return self.subject.unit_of(factor.path)
            if isinstance(factor, Choice):
                for option, keys in factor.ranges.items():
                    for key in keys:
                        if name == f"{factor.name}.{key}":
                            return factor.unit_of_entry(self.subject, factor.options[option], key)
        return self.subject.unit_of_result(name.removeprefix("result."))

    def data(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the nested data of a row of the table."""
        data = self.subject.base()
        if self.design == "list":
            # the table does not tell None from what a row leaves at the base's, nor whole numbers beside such
            for name, value in self.options["rows"][int(row["point"])].items():
                set_path(data, name, value)
            return data
        # the errors of a specimen come on top of what else is chosen
        for factor in sorted(self.factors, key=lambda f: isinstance(f, Specimens)):
            factor.apply(data, row)
        return data

    def corners(self) -> Columns:
        """Return the columns of the corners that are checked before anything runs."""
        if self.design == "list":
            rows = len(self.options["rows"])
            u = np.zeros((rows, 0))
            return self.columns(u)
        d = self.dimensions
        if d <= ALL_CORNERS:
            u = np.array(list(itertools.product((0.0, 1.0), repeat=d))).reshape(-1, d)
        else:
            middle = np.full((2 * d, d), 0.5)
            for k in range(d):
                middle[2 * k, k], middle[2 * k + 1, k] = 0.0, 1.0
            random = np.random.default_rng(self.seed).integers(0, 2, (32, d)).astype(float)
            u = np.vstack([np.zeros(d), np.ones(d), middle, random])
        # every option of a choice is met, whichever corner it falls to
        extra = []
        at = 0
        for factor in self.factors:
            if isinstance(factor, Choice) and not factor.crossed:
                for option in range(len(factor.options)):
                    row = np.full(d, 0.5)
                    row[at] = (option + 0.5) / len(factor.options)
                    for end in (0.0, 1.0):
                        row = row.copy()
                        row[at + 1 : at + factor.width] = end
                        extra.append(row)
            at += factor.width
        u = np.vstack([u, *extra]) if extra else u
        # u = 1 is the end of a range, and never drawn of whole numbers and choices
        columns = self.columns(u)
        good = self.allowed(columns)
        return {name: values[good] for name, values in columns.items()}

    def check(self) -> list[SignalSpec]:
        """Check every corner; return the arrays of the signals that are kept.

        Raises
        ------
        CampaignError
            Naming the first corners that are impossible, with the reasons.
        """
        corners = self.corners()
        things, wrong = [], []
        for k in range(len(corners["point"])):
            row = {name: python_scalar(values[k]) for name, values in corners.items()}
            try:
                things.append(self.subject.check(self.data(row), f"corner {k}"))
            except ValueError as error:
                shown = ", ".join(f"{n} = {_short(v)}" for n, v in row.items() if n != "point")
                wrong.append(f"{shown}: {error}")
        if wrong and self.options.get("corners") != "ignore":
            reasons = {text.rpartition(": corner ")[2].partition(": ")[2] for text in wrong}
            if len(wrong) == len(corners["point"]) and len(reasons) == 1 and reasons != {""}:
                raise CampaignError(f"plan: no case is possible: {reasons.pop()}")
            more = f"\n(and {len(wrong) - 3} more corners)" if len(wrong) > 3 else ""
            raise CampaignError(
                f"plan: {len(wrong)} of {len(corners['point'])} corners are impossible; narrow the ranges or add a "
                "constraint:\n" + "\n".join(wrong[:3]) + more
            )
        if not things:
            raise CampaignError("plan: no corner satisfies the constraints and is possible; widen them")
        return self.subject.signals(self.keep, things)

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as a tree of numbers and texts."""
        return {
            "subject": {"kind": self.subject.kind, "settings": self.subject.settings()},
            "factors": [factor_table(f) for f in self.factors],
            **{f.name: getattr(self, f.name) for f in fields(self) if f.name not in ("subject", "factors", "n")},
        }

    @classmethod
    def from_dict(cls, tree: dict[str, Any], n: int) -> Plan:
        """Return the plan that `as_dict` made."""
        given: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in tree.items() if k not in ("subject", "factors")
        }
        return cls(
            make_subject(tree["subject"]["kind"], tree["subject"]["settings"]),
            tuple(factor_from(table) for table in tree["factors"]),
            n=n,
            **given,
        )


def _column(values: list[Any]) -> np.ndarray:
    """Return values of any kind as a column; those that are sequences stay in one place each."""
    if not any(isinstance(v, (list, tuple, dict)) or v is None for v in values):
        return np.array(values)
    column = np.empty(len(values), dtype=object)
    column[:] = values
    return column


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def crossed(factor: AnyFactor) -> bool:
    return isinstance(factor, Choice) and factor.crossed
