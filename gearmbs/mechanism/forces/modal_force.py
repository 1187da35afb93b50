"""Generalised forces on a body with modal coordinates: distributed loads that do not act at single nodes.

A load of a distribution is a force F and a torque T on the body's frame, and a force Q_k on each mode. F and T act at a
marker that is the frame itself, without shapes. Q acts as a torque about one axis between two markers there, of which
one turns about this axis by psi_k = Q_k / max |Q| for one unit of mode k: the virtual work of the torque max |Q| is
sum Q_k dq_k, and, since the axis does not turn, nothing else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.modal import ModalBody, ShapedMarker

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.parts.elements import Load

COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")


def add_modal_force(
    mechanism: Mechanism,
    name: str,
    body: ModalBody,
    load: npt.ArrayLike,
    scale: str | float = 1.0,
    *,
    reaction: Marker | None = None,
    kind: str = "mforce",
) -> list[Load]:
    """Apply a distribution of forces on a modal body, scaled by an expression.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
        Of the load on the modes; that on the frame is ``name.frame``.
    body : ModalBody
    load : array_like, shape (6 + n,)
        Force (N) and torque (N m) about the origin of the body's frame, in its axes, and the force on each mode (J for
        one unit of its coordinate), as :meth:`gearmbs.flexible.ModalModel.modal_load` gives them.
    scale : str or float
        Expression in the mechanism's function language.
    reaction : Marker, optional
        On the rigid body that takes the reaction of force and torque, at the frame's origin; default: none does.
    kind : str

    Returns
    -------
    list of Load
        On the frame, where there is force or torque, and on the modes.

    Raises
    ------
    ModelError
        If the load has another size, or the body has no modes.

    Examples
    --------
    >>> from gearmbs.flexible import Shaft, ShaftSection
    >>> from gearmbs.mechanism import Mechanism, add_modal_force
    >>> bar = Shaft([ShaftSection(0.4, 0.01)], seats={"A": 0.0, "B": 0.4}).modal_model().slowest(4)
    >>> m = Mechanism("m")
    >>> body = bar.add_to(m)
    >>> load = bar.modal_load({"A": ((10.0, 0, 0), (0, 0, 0)), "B": ((-10.0, 0, 0), (0, 0, 0))})
    >>> loads = add_modal_force(m, "wind", body, load, "SIN(TIME)")
    """
    label = f"modal force '{name}'"
    if not isinstance(body, ModalBody):
        raise ModelError(f"{label}: {body!r} has no modes; apply a load(...)")
    n = body.modal.modes
    given = np.asarray(load, dtype=float)
    if given.shape != (6 + n,) or not np.all(np.isfinite(given)):
        raise ModelError(
            f"{label}: it has {given.size} numbers; force, torque and the forces on {n} modes are {6 + n} finite ones"
        )
    frame = frame_marker(body)
    units = [mechanism.units.factor("force")] * 3 + [mechanism.units.factor("torque")] * 3
    parts = {c: f"({scale})*({float(v / u)!r})" for c, v, u in zip(COMPONENTS, given[:6], units) if v != 0.0}
    made = []
    if parts:
        other = reaction or mechanism.ground.marker(name=f"{name}.reaction")
        held = f"{name}.frame"
        made.append(mechanism.load(held, frame, other, rm=frame, kind=kind, **parts))  # type: ignore[arg-type]
    largest = float(np.abs(given[6:]).max(initial=0.0))
    if largest > 0.0:
        turned = np.zeros((n, 3))
        turned[:, 0] = given[6:] / largest
        lever = ShapedMarker(f"{name}.modes", body, np.zeros(3), np.eye(3), moved=np.zeros((n, 3)), turned=turned)
        body.markers.append(lever)
        text = f"({scale})*({largest / mechanism.units.factor('torque')!r})"
        made.append(mechanism.load(name, lever, frame, rm=frame, kind=kind, tx=text))
    return made


def frame_marker(body: ModalBody) -> Marker:
    """Return the marker that is the body's own frame: it does not move with the deformation."""
    name = f"{body.name}.frame"
    found = next((marker for marker in body.markers if marker.name == name), None)
    if found is None:
        nothing = np.zeros((body.modal.modes, 3))
        found = ShapedMarker(name, body, np.zeros(3), np.eye(3), moved=nothing, turned=nothing)
        body.markers.append(found)
    return found
