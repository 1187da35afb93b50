"""Between which markers the elements of a deck act, and what they need to act."""

from __future__ import annotations

from typing import Any

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.check import measured_markers
from gearmbs.adams.parse.deck import Deck

KINDS: dict[type, str] = {
    st.Joint: "joint", st.Jprim: "jprim", st.Motion: "motion", st.Sforce: "sforce", st.Vforce: "vforce",
    st.Vtorque: "vtorque", st.Gforce: "gforce", st.Bushing: "bushing", st.Field: "field",
    st.SpringDamper: "springdamper", st.Gcon: "gcon", st.Coupler: "coupler", st.Gear: "gear",
    st.Beam: "beam", st.Friction: "friction", st.Contact: "contact",
    st.Ptcv: "ptcv", st.Cvcv: "cvcv",
}  # fmt: skip
"""Kinds under which functions such as JOINT and SFORCE ask for an element's force."""


def joints_of(s: st.Statement) -> tuple[int, ...]:
    """Return the joints without which an element cannot act."""
    if isinstance(s, (st.Motion, st.Friction)) and s.joint is not None:
        return (s.joint,)
    return s.joints if isinstance(s, (st.Coupler, st.Gear)) else ()


def resting_joint(s: st.Statement, inactive: frozenset[tuple[str, int]]) -> int | None:
    """Return an inactive joint without which an element cannot act, None when there is none."""
    return next((ref for ref in joints_of(s) if ("JOINT", ref) in inactive), None)


def acts(s: st.Statement, inactive: frozenset[tuple[str, int]]) -> bool:
    """Whether an element is active, and the joints it needs are."""
    return (st.KEYWORD_OF[type(s)], s.id) not in inactive and resting_joint(s, inactive) is None


def marker_pair(deck: Deck, s: Any) -> tuple[int, int | None]:
    """Return the ids of the markers I and J of what transmits a force, None for a J that there is not."""
    if joints_of(s):
        joint = deck.of(st.Joint)[joints_of(s)[0]]
        return joint.i or 0, joint.j
    if isinstance(s, st.Gcon):
        return _gcon_pair(s)
    if isinstance(s, st.Ptcv):
        return s.i or 0, s.rm
    if isinstance(s, st.Cvcv):
        return s.irm or 0, s.jrm
    if isinstance(s, st.Contact):
        i, j = (deck.of(st.Graphics)[refs[0]].marker for refs in (s.igeom, s.jgeom))
        return i or 0, j
    if isinstance(s, (st.Vforce, st.Vtorque, st.Gforce)):
        return s.i or 0, s.jfloat
    if isinstance(s, st.Sforce) and s.action_only:
        return s.i or 0, None
    return s.i or 0, s.j


def _gcon_pair(s: st.Gcon) -> tuple[int, int | None]:
    """Return a general constraint's I marker and, when its expression names just one other, that one."""
    used = measured_markers(s.function or "")
    first = s.i if s.i is not None else (used[0] if used else 0)
    others = [m for m in used if m != first]
    return first, others[0] if len(others) == 1 else None
