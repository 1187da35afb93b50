"""What planets of a stage stand on: springs, rolling bearings, or whatever a function makes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack

from gearmbs.drivetrain.connections import rolling_bearing
from gearmbs.gears.planetary_mechanism import PinBearing, Support

if TYPE_CHECKING:
    from gearmbs.bearings.settings import BearingKeywords


def pin_bearing(given: Any) -> Support | PinBearing | None:
    """Return what `gearmbs.gears.planetary_mechanism` takes as pins; see `gearmbs.drivetrain.PlanetaryStage`."""
    if given is None or isinstance(given, Support):
        return given
    if isinstance(given, Mapping) and "rolling" not in given:
        return Support(**given)
    if callable(given):
        return given
    table = dict(given) if isinstance(given, Mapping) else {"rolling": given}
    return rolling_pins(table.pop("rolling"), **table)


def rolling_pins(bearing: Any, **settings: Unpack[BearingKeywords]) -> PinBearing:
    """Return what puts rolling bearings between pins and planets, for `planetary_mechanism` and `PlanetaryRun`.

    Parameters
    ----------
    bearing : Bearing or str
        A `gearmbs.bearings.Bearing` or its designation. The inner ring is on the pin.
    **settings
        Of `gearmbs.bearings.RollingBearing`: defects (also as tables with their ``kind``), damping, ...

    Raises
    ------
    BearingError
        If the designation or a setting is unknown.
    """
    from gearmbs.bearings import RollingBearing
    from gearmbs.bearings.defects import as_defects
    from gearmbs.bearings.settings import bearing_settings

    kind = rolling_bearing(bearing)
    if "defects" in settings:
        settings["defects"] = as_defects(settings["defects"])
    bearing_settings(kind, settings, "RollingBearing")

    def make(name: str, pin: Any, bore: Any) -> RollingBearing:
        return RollingBearing(name, pin, bore, bearing=kind, **settings)

    make.rolling = kind  # type: ignore[attr-defined]
    return make
