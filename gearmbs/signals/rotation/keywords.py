"""What is known of a shaft, as keywords that functions of signals hand on; for editors and type checkers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypedDict

from gearmbs.signals.signal.arguments import DataKeywords

if TYPE_CHECKING:
    import xarray as xr


class ShaftKeywords(TypedDict, total=False):
    """What may be given instead of a speed: keywords of `gearmbs.signals.shaft_phase`."""

    phase: xr.DataArray | None
    tacho: str | None
    pulses_per_rev: float
    speed_channel: str | None


class SpeedKeywords(ShaftKeywords, total=False):
    """These and a speed, in any shape that `gearmbs.signals.speed_curve` reads."""

    speed: Any


class ShaftAndDataKeywords(ShaftKeywords, DataKeywords, total=False):
    """What may be given instead of a speed, where the signal may be data of any shape."""
