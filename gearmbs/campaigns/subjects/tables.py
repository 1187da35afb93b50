"""What a file of nested tables describes, as the subject of a campaign: drivetrains and planetary sets."""

from __future__ import annotations

import copy
import tomllib
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.subjects.base import FAILED, Outcome, SignalSpec, Subject, tooth_fault_unit
from gearmbs.units import si_unit, to_si


class TablesSubject(Subject):
    """Nested tables, as of a TOML file, whose entries factors change: ``"meshes.stage 1.backlash"``.

    A factor has the unit of the table's own entry; entries that are plain numbers, or not there, take numbers in SI.

    Parameters
    ----------
    tables : mapping
        As the file holds them.
    """

    def __init__(self, tables: Mapping[str, Any]) -> None:
        self.tables = copy.deepcopy(dict(tables))

    @classmethod
    def from_file(cls, path: str | Path) -> TablesSubject:
        """Return the subject of a TOML file."""
        try:
            return cls(tomllib.loads(Path(path).read_text(encoding="utf-8-sig")))
        except (OSError, ValueError) as error:
            raise CampaignError(f"{path}: {error}") from error

    def settings(self) -> dict[str, Any]:
        """Return the tables."""
        return {"tables": self.tables}

    @classmethod
    def from_settings(cls, settings: dict[str, Any]) -> TablesSubject:
        """Return the subject of a plan, which holds the tables or names their file."""
        return cls.from_file(settings["file"]) if "file" in settings else cls(settings["tables"])

    def base(self) -> dict[str, Any]:
        """Return the tables."""
        return copy.deepcopy(self.tables)

    def unit_of(self, path: str) -> str:
        """Return the SI unit of an entry, "1" for plain numbers and texts."""
        *sections, name = path.split(".")
        place: Any = self.tables
        for k, section in enumerate(sections):
            if not isinstance(place, Mapping) or section not in place:
                where = ".".join(sections[:k]) or "the file"
                raise CampaignError(f"{path}: {where} has no {section!r}; it has {', '.join(map(str, place))}")
            place = place[section]
        return si_unit(place.get(name)) or "1"

    def table_unit(self, path: str, table: Mapping[str, Any], key: str) -> str:
        """Return the SI unit of a parameter of a fault of a tooth."""
        return tooth_fault_unit(table, key) if path.rpartition(".")[2] in ("fault", "faults") else "1"

    def check(self, data: dict[str, Any], name: str) -> Any:
        """Return what the tables describe."""
        return self.made({**data, "name": name} if "name" in data else data)

    @abstractmethod
    def made(self, tables: dict[str, Any]) -> Any:
        """Return what tables describe.

        Raises
        ------
        ValueError
            Naming the wrong entry.
        """

    @abstractmethod
    def span_and_rate(self, thing: Any) -> tuple[float, float]:
        """Return the length of a record, s, and its sampling rate, Hz."""

    @abstractmethod
    def channels(self, thing: Any) -> dict[str, str]:
        """Return the signals that can be kept and their units."""

    def signals(self, keep: Sequence[str], things: Sequence[Any]) -> list[SignalSpec]:
        """Return the arrays of the signals, as long as the longest corner's."""
        specs = []
        for item in keep:
            if not item.startswith("signal:"):
                continue
            name = item.removeprefix("signal:")
            known = self.channels(things[0])
            if name not in known:
                raise CampaignError(f"keep: signal {name!r} is unknown; choose one of {', '.join(known)}")
            spans, rates = zip(*(self.span_and_rate(thing) for thing in things))
            if len(set(rates)) > 1:
                several = ", ".join(f"{rate:g}" for rate in sorted(set(rates)))
                raise CampaignError(
                    f"keep: {item!r} would have the sampling rates {several} Hz; give the record's rate"
                )
            specs.append(
                SignalSpec(name, (name,), int(np.ceil(max(spans) * rates[0] - 1e-6)) + 1, rates[0], known[name])
            )
        return specs

    def explain(self, error: Exception) -> Outcome:
        """Return how a case that raised has ended."""
        from gearmbs.studies import SimulationFailed

        if isinstance(error, SimulationFailed):
            return Outcome(FAILED, str(error)[:2000], "Loosen the tolerance, or make run_up and settling longer.")
        return super().explain(error)


def told(progress: Callable[[float], None], span: float) -> Callable[[float], None]:
    """Return a progress function of the simulated time."""
    return lambda t: progress(min(1.0, t / span))


def scalars(name: str, values: Any) -> dict[str, float]:
    """Return mean, RMS about it, least and largest value of a series."""
    x = np.asarray(values, dtype=float)
    return {f"{name}.mean": x.mean(), f"{name}.rms": x.std(), f"{name}.min": x.min(), f"{name}.max": x.max()}


def in_si(tree: Any) -> Any:
    """Return a tree whose texts with units are numbers in SI.

    Hertz are left apart: 10 Hz may stand where plain numbers are rad/s.
    """
    if isinstance(tree, dict):
        return {key: in_si(value) for key, value in tree.items()}
    if isinstance(tree, (list, tuple)):
        return [in_si(value) for value in tree]
    unit = si_unit(tree)
    if unit is None:
        return tree
    value = float(to_si(tree, unit))
    return [value, unit] if unit == "Hz" else value
