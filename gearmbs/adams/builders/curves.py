"""CURVE, PTCV and CVCV of a deck."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gearmbs.adams.builders.builder import Builder
from gearmbs.adams.builders.curve_data import curve_points
from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.curves import Curve, curve_on_curve, point_on_curve
from gearmbs.mechanism.parts import Marker


def _parameter(b: Builder, curve: Curve, disp: Any, rm: Marker, icm: int | None) -> float | None:
    """Return the parameter of a point of contact given in the frame of ICM, or of RM."""
    if disp is None:
        return None
    given = np.array(disp)
    if icm is not None:
        other = b.markers[icm]
        place = other.global_position() + b.units.length * other.global_orientation() @ given
        given = rm.global_orientation().T @ (place - rm.global_position()) / b.units.length
    return curve.nearest(given)


def add_ptcv(b: Builder, s: st.Ptcv) -> None:
    """PTCV; after the first analysis it starts where the point is."""
    curve, rm = curve_points(b.deck, s.curve), b.markers[s.rm or 0]
    start = None if b.state else _parameter(b, curve, s.disp, rm, s.icm)
    speed = 0.0 if b.state or s.vel is None else s.vel
    point_on_curve(b.mechanism, b.model.names["ptcv", s.id], b.markers[s.i or 0], rm, curve, start, speed)


def add_cvcv(b: Builder, s: st.Cvcv) -> None:
    """CVCV; after the first analysis it starts where the curves touch."""
    first, second = curve_points(b.deck, s.icurve), curve_points(b.deck, s.jcurve)
    i, j = b.markers[s.irm or 0], b.markers[s.jrm or 0]
    starts = None
    if not b.state and s.idisp is not None and s.jdisp is not None:
        starts = _parameter(b, first, s.idisp, i, s.iicm) or 0.0, _parameter(b, second, s.jdisp, j, s.jicm) or 0.0
    curve_on_curve(b.mechanism, b.model.names["cvcv", s.id], i, first, j, second, starts)


CURVES: dict[type, Callable[[Builder, Any], None]] = {st.Ptcv: add_ptcv, st.Cvcv: add_cvcv}
