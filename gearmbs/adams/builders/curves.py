"""CURVE, PTCV and CVCV of a deck."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.adams.builders.builder import Builder, Maker
from gearmbs.adams.builders.curve_data import curve_points
from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.curves import Curve, curve_on_curve, point_on_curve


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


def _kept(b: Builder, runner: str) -> tuple[float | None, float | None]:
    """Return parameter and rate with which the analysis before has left a runner; None where it did not run."""
    state = b.state.get((runner, 0))
    if state is None:
        return None, None
    return float(state.position[2]) / b.units.length, float(state.velocity[2]) / b.units.factor("velocity")


def _note_runner(b: Builder, s: st.Statement, runner: str, curve: Curve) -> None:
    """Remember a runner that can leave its curve."""
    if not curve.closed:
        b.model.runners[runner] = s, curve.length * b.units.length


def add_ptcv(b: Builder, s: st.Ptcv) -> None:
    """PTCV; after the first analysis it goes on from where the point is."""
    curve, rm = curve_points(b.deck, s.curve), b.markers[s.rm or 0]
    name = b.model.names["ptcv", s.id]
    start, speed = _kept(b, f"{name}.runner")
    if not b.state:
        start = _parameter(b, curve, s.disp, rm, s.icm)
    slot = point_on_curve(b.mechanism, name, b.markers[s.i or 0], rm, curve, start, speed)
    b.model.sources[slot.name] = s
    _note_runner(b, s, f"{name}.runner", curve)
    if s.vel is not None and not b.state:
        at = float(slot.i.global_position()[2]) / b.units.length
        rate = s.vel / float(np.linalg.norm(curve.spline()(at, 1)))
        b.model.initial_motions.append((slot, "translation", (at, rate)))


def add_cvcv(b: Builder, s: st.Cvcv) -> None:
    """CVCV; after the first analysis it goes on from where the curves touch."""
    first, second = curve_points(b.deck, s.icurve), curve_points(b.deck, s.jcurve)
    i, j = b.markers[s.irm or 0], b.markers[s.jrm or 0]
    name = b.model.names["cvcv", s.id]
    at_i, speed_i = _kept(b, f"{name}.runner I")
    at_j, speed_j = _kept(b, f"{name}.runner J")
    starts = speeds = None
    if at_i is not None and at_j is not None and speed_i is not None and speed_j is not None:
        starts, speeds = (at_i, at_j), (speed_i, speed_j)
    elif not b.state and s.idisp is not None and s.jdisp is not None:
        starts = _parameter(b, first, s.idisp, i, s.iicm) or 0.0, _parameter(b, second, s.jdisp, j, s.jicm) or 0.0
    curve_on_curve(b.mechanism, name, i, first, j, second, starts, speeds)
    _note_runner(b, s, f"{name}.runner I", first)
    _note_runner(b, s, f"{name}.runner J", second)


CURVES: dict[type, Maker] = {st.Ptcv: add_ptcv, st.Cvcv: add_cvcv}
