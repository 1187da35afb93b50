"""A function of parameters as the subject of a campaign: a mechanism of one's own, a drivetrain, anything."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import Any, ClassVar

import numpy as np

from gearmbs.campaigns.settings import CampaignError, by_name, whole
from gearmbs.campaigns.subjects.base import (
    Kept,
    SignalSpec,
    Subject,
    as_numbers,
    check_real,
    imported,
    kept_by_functions,
)
from gearmbs.schema.described import check_keys
from gearmbs.schema.quantities import Measure
from gearmbs.units import DIMENSIONS, to_si


class FunctionSubject(Subject):
    """``function(**parameters)``, which returns a dictionary of numbers and of arrays, or a Dataset.

    Parameters
    ----------
    function : str or callable
        ``"module:name"``, or a function at the top of a module: every worker imports it by that name. It returns a
        dictionary of numbers and arrays, a Dataset, or one number, which is kept under the function's name.
    parameters : dict
        Its arguments with their defaults: numbers, texts, truth values, None, and lists, arrays and tables of these.
        Texts with units where ``units`` says so. Factors reach into tables by dots: ``"spring.stiffness"``.
    units : dict, optional
        SI units or dimensions of those parameters that are quantities, as ``{"spring.stiffness": "N/m"}``.
    version : str
        Part of the identity of every case; to be changed whenever the function returns something else.
    signals : dict, optional
        For ``keep="signal:NAME"`` how many samples a signal has at most and its rate in Hz: ``{"force": (4096,
        12800)}``.
    """

    kind: ClassVar[str] = "function"
    keeps: ClassVar[tuple[str, ...]] = ("numbers", "record")

    def __init__(
        self,
        function: str | Callable[..., Any],
        parameters: dict[str, Any] | None = None,
        *,
        units: dict[str, str] | None = None,
        version: str = "1",
        signals: dict[str, Sequence[float]] | None = None,
    ) -> None:
        self.function, self.version = _name_of(function), str(version)
        self.units = by_name(units, "units")
        self.signal_sizes = {name: _size(name, size) for name, size in by_name(signals, "signals").items()}
        self.parameters = {name: _tree(name, value) for name, value in by_name(parameters, "parameters").items()}
        for path, unit in self.units.items():
            self._found(path)
            _check_unit(path, unit)
        self.parameters = self._in_si(self.parameters)

    def _in_si(self, data: dict[str, Any]) -> dict[str, Any]:
        """Return parameters with their quantities in SI."""
        found = copy.deepcopy(data)
        for path, unit in self.units.items():
            *tables, name = path.split(".")
            place = found
            for table in tables:
                place = place[table]
            if place[name] is None:
                continue
            try:
                place[name] = float(to_si(place[name], unit, path))
            except (ValueError, TypeError) as error:
                raise CampaignError(str(error)) from None
        return found

    def _found(self, path: str) -> Any:
        """Return the parameter at a path."""
        place: Any = self.parameters
        for part in path.split("."):
            if not isinstance(place, dict) or part not in place:
                raise CampaignError(
                    f"{path}: {self.function} has no such parameter; known are {', '.join(self.parameters)}"
                )
            place = place[part]
        return place

    def settings(self) -> dict[str, Any]:
        """Return the function's name, its parameters and their units."""
        return {
            "function": self.function,
            "parameters": self.parameters,
            "units": self.units,
            "version": self.version,
            "signals": {name: list(size) for name, size in self.signal_sizes.items()},
        }

    @classmethod
    def from_settings(cls, settings: dict[str, Any]) -> FunctionSubject:
        """Return the subject of a plan."""
        check_keys(settings, ("function", "parameters", "units", "version", "signals"), "subject", CampaignError)
        if "function" not in settings:
            raise CampaignError("subject: function is missing; give module:name")
        return cls(**settings)

    def modules(self) -> list[str]:
        """Return the name of the function's module, too."""
        return [*super().modules(), self.function.partition(":")[0]]

    def base(self) -> dict[str, Any]:
        """Return the parameters."""
        return copy.deepcopy(self.parameters)

    def unit_of(self, path: str) -> str:
        """Return the SI unit of a parameter."""
        self._found(path)
        return self.units.get(path, "1")

    def table_unit(self, path: str, table: Mapping[str, Any], key: str) -> str:
        """Return the SI unit of an entry of a table among the parameters."""
        return self.units.get(f"{path}.{key}", "1")

    def check(self, data: dict[str, Any], name: str) -> dict[str, Any]:
        """Return the parameters in SI."""
        imported(self.function, "function")
        return self._in_si(data)

    def canonical(self, thing: dict[str, Any]) -> dict[str, Any]:
        """Return the function's name and version and the parameters."""
        return {"function": self.function, "version": self.version, "parameters": thing}

    # a user's own function returns what it returns; `reduce` says what can be kept
    def run(self, thing: dict[str, Any], progress: Callable[[float], None], keep: Sequence[str]) -> Any:
        """Return what the function returns."""
        return imported(self.function, "function")(**thing)

    def reduce(self, thing: dict[str, Any], record: Any, keep: Sequence[str]) -> Kept:
        """Return the scalars of the record, and those of its arrays that are kept as signals."""
        if isinstance(record, Real) or (isinstance(record, np.ndarray) and record.ndim == 0):
            record = {self.function.partition(":")[2]: record}
        if not (isinstance(record, Mapping) or hasattr(record, "data_vars")):
            raise CampaignError(
                f"{self.function} returned {record!r:.60}; return a dictionary of numbers and arrays, a Dataset or one "
                "number"
            )
        if "record" in keep and not hasattr(record, "data_vars"):
            raise CampaignError(
                f"{self.function} returned a {type(record).__name__}, of which no record is kept; return an "
                "xarray.Dataset, or keep numbers and signals"
            )
        kept = kept_by_functions(keep, record)
        items = {**record.attrs, **record.data_vars} if hasattr(record, "data_vars") else dict(record)
        if not all(str(name).strip() for name in items):
            raise CampaignError(f"{self.function} returned a result without a name; give it one")
        if "numbers" in keep:
            single = {
                k: v for k, v in items.items() if not isinstance(v, str) and np.ndim(getattr(v, "values", v)) == 0
            }
            kept.add(as_numbers(single, self.function), "numbers")
        for item in keep:
            if item.startswith("signal:"):
                name = item.removeprefix("signal:")
                if name not in items:
                    raise CampaignError(f"{self.function} returned no {name!r}, which is to be kept as a signal")
                check_real(items[name], f"{self.function} returned the signal {name}")
                kept.signals[name] = np.atleast_2d(np.asarray(items[name], dtype=float))
        if not (kept.numbers or kept.signals or "record" in keep):
            told = ", ".join(f"{k} is {_described(v)}" for k, v in items.items()) or "it is empty"
            raise CampaignError(
                f"{self.function} returned nothing that is kept: {told}; return numbers, or describe arrays with "
                "FunctionSubject(signals={name: (n, rate)}) and keep 'signal:name'"
            )
        return kept

    def signals(self, keep: Sequence[str], things: Sequence[Any]) -> list[SignalSpec]:
        """Return the arrays that ``signals`` describes."""
        specs = []
        for item in keep:
            if item.startswith("signal:"):
                name = item.removeprefix("signal:")
                if name not in self.signal_sizes:
                    raise CampaignError(
                        f"keep: signal {name!r} needs its size: FunctionSubject(signals={{{name!r}: (n, rate)}})"
                    )
                samples, rate = self.signal_sizes[name]
                specs.append(SignalSpec(name, (name,), samples, rate, "1"))
        return specs


def _described(value: Any) -> str:
    """Return what a result is, in words."""
    values = getattr(value, "values", value)
    return f"an array of {np.size(values)}" if np.ndim(values) else f"a {type(values).__name__}"


def _size(name: str, size: Sequence[float]) -> tuple[int, float]:
    """Return samples and rate of a signal.

    Raises
    ------
    CampaignError
        If they are none, or the name is none of a folder, in which the signal is stored.
    """
    if not re.fullmatch(r"[^/\\.\0][^/\\\0]*", name):
        raise CampaignError(f"signals: {name!r} is stored under its name; give one without / and \\ and a dot in front")
    try:
        samples, rate = size
        return whole(samples, f"signals: {name}: samples", 1), float(Measure("frequency", above=0).as_given(rate))
    except (TypeError, ValueError) as error:
        raise CampaignError(
            f"signals: {name} = {size!r}; give samples and rate in Hz, as (4096, 12800): {error}"
        ) from None


def _name_of(function: str | Callable[..., Any]) -> str:
    """Return the name under which workers import a function."""
    if isinstance(function, str):
        name = function
    else:
        name = f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', function)}"
    module, _, attribute = name.partition(":")
    if module == "__main__":
        raise CampaignError(
            f"function {attribute!r} stands in the script or notebook that runs, where workers cannot import it; put "
            "it into a module beside it, and import it from there"
        )
    if not attribute.isidentifier():
        raise CampaignError(f"function {name!r}: give module:name of a function at the top of a module")
    if not isinstance(function, str) and imported(name, "function") is not function:
        # as functools.wraps makes it, which gives what is around a function its name
        raise CampaignError(
            f"function {name!r}: under this name workers import something else than what is given, which wraps it or "
            "was loaded before; give the text 'module:name' under which it stands at the top of a module"
        )
    return name


def _check_unit(path: str, unit: str) -> None:
    target = DIMENSIONS.get(unit, unit)
    try:
        to_si("1" if target in ("1", "dimensionless") else f"1 {target}", target, path)
    except Exception as error:
        # of the library of units, which has its own
        raise CampaignError(f"units: {path}: {unit!r} is no unit ({error})") from None


def _tree(name: str, value: Any) -> Any:
    """Return a parameter as a tree of numbers, texts, lists and tables, as it is stored.

    Raises
    ------
    CampaignError
        For anything else.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _tree(f"{name}.{key}", item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_tree(name, item) for item in value]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise CampaignError(
        f"parameter {name!r} is a {type(value).__name__}, which cannot be stored with the plan; give numbers, texts, "
        "lists or tables, and let the function make the object of them"
    )
