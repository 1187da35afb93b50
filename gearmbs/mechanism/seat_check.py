"""Whether seats of modal bodies that are held against turning kept enough of their flexibility in the reduction."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.equations import constraint_terms as terms
from gearmbs.mechanism.modal import ModalBody
from gearmbs.mechanism.parts import Marker

if TYPE_CHECKING:
    from gearmbs.mechanism.joints import Joint

MOST_LOST = 0.25
"""Share of the flexibility under torques that may be lacking: without a quarter a seat is a third too stiff."""

MESHES = ("gear contact", "ideal mesh")
"""Kinds of force elements that turn a marker about its z."""


def warn_of_stiff_seats(joints: Mapping[str, Joint], elements: Mapping[str, Any]) -> None:
    """Warn of each modal body of which a joint, or a mesh of teeth, turns a seat that the reduction made too stiff.

    Of a joint the directions count about which it holds the seat, of a mesh the axis of the wheel. Seats whose exact
    flexibility is not known, as of modal neutral files, are passed over.
    """
    worst: dict[ModalBody, dict[str, tuple[float, str, str]]] = {}
    for part, marker, axes in _held(joints, elements):
        body = marker.body
        if not isinstance(body, ModalBody) or body.lost_turning is None:
            continue
        turned = body.shape_at(marker)[1] if axes else None
        for axis in axes:
            seat, share = body.lost_turning(marker.position, marker.orientation @ axis, turned)
            kind = _kind(body, marker.orientation @ axis)
            if share > max(MOST_LOST, worst.get(body, {}).get(kind, (0.0,))[0]):
                worst.setdefault(body, {})[kind] = share, seat, part
    for body, kinds in worst.items():
        lost = ", ".join(
            f"{100 * share:.0f} % of the flexibility {kind} of seat '{seat}', which '{part}' holds or turns"
            for kind, (share, seat, part) in kinds.items()
        )
        meshes = any(part in elements for _, _, part in kinds.values())
        warnings.warn(
            f"body '{body.name}': its {body.modal.modes} modes lack {lost}; it is too stiff there. Keep more modes: "
            "all (leave modes= out), or, of all, those that matter (by_participation(torques=True))"
            + ("; or let the wheel be a Disc of its shaft, which needs fewer" if meshes else ""),
            stacklevel=4,
        )


def _kind(body: ModalBody, axis: np.ndarray) -> str:
    """Return what a torque about an axis does to a body."""
    if body.long_axis is not None:
        return "in torsion" if abs(body.long_axis @ axis) > np.sqrt(0.5) else "in bending under torques"
    return f"under torques about {np.array2string(axis, precision=2, suppress_small=True)} of the body"


def _held(joints: Mapping[str, Joint], elements: Mapping[str, Any]) -> Iterator[tuple[str, Marker, list[np.ndarray]]]:
    """Yield what turns a marker, the marker, and the axes about which, in its own components."""
    for joint in joints.values():
        axes = _directions(joint)
        for marker in (joint.i, joint.j):
            yield joint.name, marker, axes
    for element in elements.values():
        if getattr(element, "kind", "") in MESHES:
            for marker in (element.i, element.j):
                yield element.name, marker, [np.array([0.0, 0.0, 1.0])]


def _directions(joint: Joint) -> list[np.ndarray]:
    """Return the axes about which a joint holds its markers, whose axes are then parallel."""
    out = []
    for row in joint.rows:
        if len(row.terms) == 1 and row.terms[0].kind == terms.DOT1:
            first, second = divmod(row.terms[0].axes, 3)
            if first != second:
                out.append(np.cross(np.eye(3)[first], np.eye(3)[second]))
    return out
