"""Rolling bearings: geometry, catalogue, Hertz contact of every element, defects, statics, ratings and life."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.bearings.defects import (
        DEFECTS,
        Defect,
        Line,
        LooseFit,
        Misalignment,
        OffSize,
        Pit,
        Spall,
        UnevenSpacing,
        Waviness,
    )
    from gearmbs.bearings.element import RollingBearing, add_bearing
    from gearmbs.bearings.errors import BearingError
    from gearmbs.bearings.geometry import Bearing
    from gearmbs.bearings.laws_kernel import PointContact, groove_contact
    from gearmbs.bearings.layout import spall_depth
    from gearmbs.bearings.life import bearing_lives
    from gearmbs.bearings.ratings import equivalent_load, mean_load, rating_life
    from gearmbs.bearings.statics import BearingState, BearingStatics, stiffness_matrix

__all__ = [
    "DEFECTS",
    "Bearing",
    "BearingError",
    "BearingState",
    "BearingStatics",
    "Defect",
    "Line",
    "LooseFit",
    "Misalignment",
    "OffSize",
    "Pit",
    "PointContact",
    "RollingBearing",
    "Spall",
    "UnevenSpacing",
    "Waviness",
    "add_bearing",
    "bearing_lives",
    "equivalent_load",
    "groove_contact",
    "mean_load",
    "rating_life",
    "spall_depth",
    "stiffness_matrix",
]

late(
    __name__,
    {
        "DEFECTS": ".defects",
        "Bearing": ".geometry",
        "BearingError": ".errors",
        "BearingState": ".statics",
        "BearingStatics": ".statics",
        "Defect": ".defects",
        "Line": ".defects",
        "LooseFit": ".defects",
        "Misalignment": ".defects",
        "OffSize": ".defects",
        "Pit": ".defects",
        "PointContact": ".laws_kernel",
        "RollingBearing": ".element",
        "Spall": ".defects",
        "UnevenSpacing": ".defects",
        "Waviness": ".defects",
        "add_bearing": ".element",
        "bearing_lives": ".life",
        "equivalent_load": ".ratings",
        "groove_contact": ".laws_kernel",
        "mean_load": ".ratings",
        "rating_life": ".ratings",
        "spall_depth": ".layout",
        "stiffness_matrix": ".statics",
    },
)
