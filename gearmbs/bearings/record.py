"""Rolling bearings of a mechanism as plain data, for storing beside results."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

from gearmbs.bearings.element import RollingBearing
from gearmbs.bearings.settings import BearingSettings

if TYPE_CHECKING:
    from gearmbs.mechanism import Mechanism


def described(mechanism: Mechanism) -> dict[str, dict[str, Any]]:
    """Return of each rolling bearing by name its ``bearing``, ``settings`` other than the defaults and ``defects``."""
    return {
        name: {
            "bearing": asdict(element.bearing),
            "settings": _settings(element.settings),
            "defects": [dict(defect.description) for defect in element.defects],
        }
        for name, element in mechanism.elements.items()
        if isinstance(element, RollingBearing)
    }


def _settings(settings: BearingSettings) -> dict[str, Any]:
    given = {item.name: (getattr(settings, item.name), item.default) for item in fields(settings)}
    return {name: value for name, (value, default) in given.items()
            if name not in ("bearing", "defects") and value != default}  # fmt: skip
