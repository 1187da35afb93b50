"""A function of parameters as the subject of a campaign: a mechanism of one's own, a drivetrain, anything."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np

from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.subjects.base import Kept, SignalSpec, Subject, imported, kept_by_functions
from gearmbs.units import to_si


class FunctionSubject(Subject):
    """``function(**parameters)``, which returns a dictionary of numbers and of arrays, or a Dataset.

    Parameters
    ----------
    function : str
        ``"module:name"``, so that every worker finds it.
    parameters : dict
        Its arguments with their defaults: numbers, texts with units where ``units`` says so, other texts.
    units : dict, optional
        SI units or dimensions of those parameters that are quantities, as ``{"stiffness": "N/m"}``.
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
        function: str,
        parameters: dict[str, Any] | None = None,
        *,
        units: dict[str, str] | None = None,
        version: str = "1",
        signals: dict[str, Sequence[float]] | None = None,
    ) -> None:
        self.function, self.version = function, str(version)
        self.units = dict(units or {})
        self.signal_sizes = {name: (int(size[0]), float(size[1])) for name, size in (signals or {}).items()}
        self.parameters = {name: self._value(name, value) for name, value in (parameters or {}).items()}

    def _value(self, name: str, value: Any) -> Any:
        return to_si(value, self.units[name], name) if name in self.units else value

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
        rest = {k: v for k, v in settings.items() if k not in ("function", "parameters")}
        return cls(settings["function"], settings.get("parameters"), **rest)

    def base(self) -> dict[str, Any]:
        """Return the parameters."""
        return dict(self.parameters)

    def unit_of(self, path: str) -> str:
        """Return the SI unit of a parameter."""
        if path not in self.parameters:
            raise CampaignError(
                f"{path}: {self.function} has no such parameter; known are {', '.join(self.parameters)}"
            )
        return self.units.get(path, "1")

    def check(self, data: dict[str, Any], name: str) -> dict[str, Any]:
        """Return the parameters in SI."""
        imported(self.function, "function")
        return {key: self._value(key, value) for key, value in data.items()}

    def canonical(self, thing: dict[str, Any]) -> Any:
        """Return the function's name and version and the parameters."""
        return {"function": self.function, "version": self.version, "parameters": thing}

    def run(self, thing: dict[str, Any], progress: Callable[[float], None], keep: Sequence[str]) -> Any:
        """Return what the function returns."""
        return imported(self.function, "function")(**thing)

    def reduce(self, thing: dict[str, Any], record: Any, keep: Sequence[str]) -> Kept:
        """Return the scalars of the record, and those of its arrays that are kept as signals."""
        kept = Kept(numbers=kept_by_functions(keep, record))
        items = {**record.attrs, **record.data_vars} if hasattr(record, "data_vars") else dict(record)
        if "numbers" in keep:
            kept.numbers |= {
                k: float(v)
                for k, v in items.items()
                if not isinstance(v, str) and np.ndim(getattr(v, "values", v)) == 0
            }
        for item in keep:
            if item.startswith("signal:"):
                name = item.removeprefix("signal:")
                kept.signals[name] = np.atleast_2d(np.asarray(items[name], dtype=float))
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
