"""The interface of what a campaign simulates.

A subject turns nested data (a dictionary of sections and fields, numbers in SI or texts with units) into something that
is checked, has a content identity, can be run, and leaves numbers and signals behind. A campaign knows nothing else of
it, so that further things to simulate need one class and one line of `KINDS`.
"""

from __future__ import annotations

import importlib
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearmbs.campaigns.settings import CampaignError
from gearmbs.schema.described import chosen
from gearmbs.units import DIMENSIONS

if TYPE_CHECKING:
    import xarray as xr

KINDS = {
    "pair": "gearmbs.campaigns.subjects.pair:PairSubject",
    "function": "gearmbs.campaigns.subjects.function:FunctionSubject",
    "deck": "gearmbs.campaigns.subjects.deck:DeckSubject",
    "drivetrain": "gearmbs.campaigns.subjects.tables:DrivetrainSubject",
    "planetary": "gearmbs.campaigns.subjects.tables:PlanetarySubject",
    "bearing": "gearmbs.campaigns.subjects.tables:BearingSubject",
    "paper claims": "gearmbs.campaigns.subjects.pair:ClaimsSubject",
}
"""Subjects that come with the package; a plan may also name one as ``"module:Class"``."""

ABOUT_RECORD = "record."
"""How names of numbers begin that say how far a record can be trusted, and nothing of what was simulated."""

DONE, IMPOSSIBLE, FAILED, TIME, MEMORY, DIED = (
    "done",
    "impossible",
    "failed",
    "time limit",
    "memory limit",
    "worker died",
)
"""How a case may end. All but ``worker died`` are what the case itself does, and are never tried again."""


@dataclass
class Kept:
    """What a case leaves behind.

    Attributes
    ----------
    numbers : dict
        Scalars by the name of their column.
    signals : dict of ndarray, shape (channels, samples)
        By the name of their array.
    """

    numbers: dict[str, float] = field(default_factory=dict)
    signals: dict[str, np.ndarray] = field(default_factory=dict)

    def add(self, numbers: Mapping[str, float], item: str) -> None:
        """Take the numbers of an entry of ``keep``.

        Raises
        ------
        CampaignError
            If one has the name of another that is kept, of which one would be lost.
        """
        if doubled := sorted(self.numbers.keys() & numbers.keys()):
            raise CampaignError(f"keep: {item!r} gives {', '.join(doubled)}, as another entry does; rename one")
        self.numbers |= numbers

    @property
    def finite(self) -> bool:
        """Whether all of it is a number, signals as they are stored, in single precision."""
        with np.errstate(over="ignore"):
            stored = [np.asarray(x).astype(np.float32) for x in self.signals.values()]
        return all(map(math.isfinite, self.numbers.values())) and all(np.isfinite(x).all() for x in stored)


@dataclass(frozen=True)
class Outcome:
    """How a case ended: its status, and for a failure the message and what to do about it."""

    status: str = DONE
    message: str = ""
    advice: str = ""


@dataclass(frozen=True)
class SignalSpec:
    """An array of signals: its channels, its longest length, its sampling rate (Hz) and unit."""

    name: str
    channels: tuple[str, ...]
    samples: int
    rate: float
    units: str


class NotImportable(CampaignError):
    """What a plan names by a module cannot be imported here; elsewhere it may be."""


class Subject(ABC):
    """What a campaign simulates.

    A subclass has a ``kind``, the name it is stored under, and is made again by every worker from `settings`.
    """

    kind: ClassVar[str]
    keeps: ClassVar[tuple[str, ...]] = ()
    """Names that `reduce` understands in ``keep``, without those of signals and of functions."""

    @abstractmethod
    def settings(self) -> dict[str, Any]:
        """Return what `from_settings` makes the subject again from: a tree of numbers and texts."""

    @classmethod
    @abstractmethod
    def from_settings(cls, settings: dict[str, Any]) -> Subject:
        """Return the subject that `settings` describes."""

    @abstractmethod
    def base(self) -> dict[str, Any]:
        """Return the nested data that the factors of a plan change."""

    @abstractmethod
    def unit_of(self, path: str) -> str:
        """Return the SI unit of a field, ``"1"`` for plain numbers and texts.

        Raises
        ------
        CampaignError
            If there is no such field.
        """

    def is_section(self, path: str) -> bool:
        """Return whether a path is that of a section, some of whose fields a choice may set together."""
        return False

    def unit_follows(self, path: str) -> str:
        """Return the path of the field by which the unit of another one goes, "" where it is the same always."""
        return ""

    def table_unit(self, path: str, table: Mapping[str, Any], key: str) -> str:
        """Return the SI unit of an entry of a table that stands in a field, as the depth of a fault."""
        return "1"

    def unit_of_result(self, name: str) -> str:
        """Return the unit of a number that is kept, "" where it has none or the subject does not know it."""
        return ""

    def as_simulated(self, thing: Any, keep: Sequence[str]) -> Any:
        """Return the thing as it is simulated for ``keep``: whatever changes the numbers belongs to its content."""
        return thing

    # what is simulated, and what a run of it leaves for `reduce`, are each subject's own
    @abstractmethod
    def check(self, data: dict[str, Any], name: str) -> Any:
        """Return the validated thing that nested data describe.

        Raises
        ------
        ValueError
            Naming the wrong field.
        """

    @abstractmethod
    def canonical(self, thing: Any) -> object:
        """Return its content in SI with defaults filled in and without names; see `gearmbs.campaigns.canonical`."""

    @abstractmethod
    def run(self, thing: Any, progress: Callable[[float], None], keep: Sequence[str]) -> Any:
        """Simulate and return a record; ``progress`` is called often and may raise to stop the run.

        What `reduce` does not need for ``keep`` may be left out of the record; the rest is the same whatever is kept.
        """

    @abstractmethod
    def reduce(self, thing: Any, record: Any, keep: Sequence[str]) -> Kept:
        """Return of a record what is kept."""

    def signals(self, keep: Sequence[str], things: Sequence[Any]) -> list[SignalSpec]:
        """Return the arrays that hold the signals of a campaign whose corners are ``things``."""
        return []

    def modules(self) -> list[str]:
        """Return the names of the modules that simulate; with what they import they are part of a result's identity."""
        return [type(self).__module__]

    def files(self) -> dict[str, str]:
        """Return digests of the files that cases read beside the plan, by name: results come from them, too."""
        return {}

    def explain(self, error: Exception) -> Outcome:
        """Return how a case that raised has ended."""
        status = IMPOSSIBLE if isinstance(error, ValueError) else FAILED
        return Outcome(status, f"{type(error).__name__}: {error}"[:2000])

    def partial(self, error: Exception) -> xr.Dataset | None:
        """Return the dataset of what was computed before an error, or None."""
        return None

    def tightened(self, thing: Any) -> Any | None:
        """Return the thing with a tighter tolerance for a second try, or None if there is none."""
        return None


def make_subject(kind: str, settings: dict[str, Any]) -> Subject:
    """Return a subject by its kind, one of `KINDS` or ``"module:Class"``.

    Raises
    ------
    CampaignError
        For an unknown kind.
    """
    home = kind if ":" in kind else chosen(KINDS, kind, "", CampaignError, otherwise=", or write module:Class")
    return imported(home, "kind").from_settings(settings)


def subject_kinds() -> list[str]:
    """Return the kinds of subjects that come with the package."""
    return list(KINDS)


def imported(name: str, what: str) -> Any:
    """Return the object that a text ``module:name`` stands for.

    Raises
    ------
    NotImportable
        If there is none.
    """
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise NotImportable(f"{what} {name!r}: cannot be imported ({error}); write module:name") from error


def kept_by_functions(keep: Sequence[str], record: Any) -> Kept:
    """Return what those entries of ``keep`` leave that name functions ``module:name`` of a record."""
    kept = Kept()
    for item in keep:
        if ":" in item and not item.startswith("signal:"):
            found = imported(item, "keep")(record)
            if not isinstance(found, Mapping):
                raise CampaignError(f"keep: {item!r} returned {found!r:.60}; return a dictionary of numbers")
            kept.add(as_numbers(found, item), item)
    return kept


def as_numbers(found: Mapping[Any, Any], item: str) -> dict[str, float]:
    """Return what a function has returned as numbers by name.

    Raises
    ------
    CampaignError
        Naming what is none.
    """
    numbers = {}
    for name, value in found.items():
        check_real(value, f"{item} returned {name}")
        try:
            numbers[str(name)] = float(value)
        except (TypeError, ValueError):
            raise CampaignError(f"{item} returned {name} = {value!r:.60}, which is no number; return one") from None
    return numbers


def check_real(value: Any, what: str) -> None:
    """Refuse complex numbers, of which the real part alone would be kept.

    Raises
    ------
    CampaignError
    """
    if np.iscomplexobj(value):
        shown = f" = {complex(value)}" if np.ndim(value) == 0 else ""
        raise CampaignError(
            f"{what}{shown}: complex, which no number that is kept may be; return its amplitude, or its real and "
            "imaginary parts by names of their own"
        )


def check_keep(subject: Subject, keep: Sequence[str]) -> None:
    """Refuse entries of ``keep`` that the subject does not know."""
    for item in keep:
        if item not in subject.keeps and ":" not in item:
            raise CampaignError(
                f"keep: {item!r} is unknown; a {subject.kind} keeps {', '.join(subject.keeps)}, "
                f"'signal:...' where it has "
                "signals, or module:function of a record"
            )


def tooth_fault_unit(table: Mapping[str, Any], key: str) -> str:
    """Return the SI unit of a parameter of a fault of a tooth, given as a table with its kind."""
    from gearmbs.studies.case.tooth_faults import kinds, tooth_fault

    label = tooth_fault(str(table.get("kind"))).label
    dimension = kinds()[label].units.get(key, "dimensionless")
    return "1" if dimension == "dimensionless" else DIMENSIONS[dimension].replace("*", " ")
