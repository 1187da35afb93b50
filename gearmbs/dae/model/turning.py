"""Rotations prescribed far from where their joints are drawn.

The equation of a prescribed rotation is the sine of what the joint's angle lacks. It vanishes half a turn off, too, and
from a quarter of a turn on the nearest position that satisfies it is that one. Bodies are then turned in steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints.terms import ROTATION
from gearmbs.dae.equations.kinematics.rotation import POSE_A, POSE_V
from gearmbs.dae.equations.loads.time_functions import CONSTANT
from gearmbs.dae.model.evaluator import POSE_PLACES, Assembler
from gearmbs.dae.model.model import Model, frozen

if TYPE_CHECKING:
    from gearmbs.dae.model.base_system import BaseSystem
    from gearmbs.dae.model.configuration import Configuration

LONGEST_STEP = 0.5
"""rad, far from the quarter turn at which the nearest solution is another one."""


@dataclass(frozen=True)
class Turn:
    """A prescribed rotation: its row, the joint's angle as it is and what it lacks, -pi to pi, rad."""

    row: int
    angle: float
    missing: float

    @property
    def opposite(self) -> bool:
        """Whether the x axes are nearer to opposite than to each other.

        Where they are drawn so, a motion holds them opposite: the markers' axes were chosen without regard to it.
        """
        return abs(self.angle) > 0.5 * np.pi


def prescribed_turns(
    system: BaseSystem, configuration: Configuration, jacobian: scipy.sparse.csc_array, phi: np.ndarray
) -> list[Turn]:
    """Return the prescribed rotations at a configuration whose constraint Jacobian and Phi are given."""
    model = system.model
    found = []
    for row, span in enumerate(model.spans):
        first = span.start
        # rows given by an expression have no terms
        if span.stop == first or model.terms[first, T.TERM_TYPE] != ROTATION:
            continue
        (i, body_i), (j, body_j) = (
            _axes(model, configuration, int(model.terms[first, m])) for m in (T.TERM_I, T.TERM_J)
        )
        # one of the bodies moves: its rotation about the axis changes the sine by the cosine
        body, sense = (body_i, 1.0) if body_i > 0 else (body_j, -1.0)
        columns = POSE_PLACES * (body - 1) + 3 + np.arange(3)
        cosine = sense * float(jacobian[[row]][:, columns].toarray()[0] @ j[:, 2])
        angle = float(np.arctan2(i[:, 0] @ j[:, 1], i[:, 0] @ j[:, 0]))
        found.append(Turn(row, angle, float(np.arctan2(-phi[row], cosine))))
    return found


def _axes(model: Model, configuration: Configuration, marker: int) -> tuple[np.ndarray, int]:
    """Return the axes of a marker in global components, as columns, and its body; of a modal body the undeformed."""
    body = int(model.marker_body[marker])
    if body >= len(model.bodies):
        body = model.frame_body[body - len(model.bodies)]
    axes = model.marker_frame[marker, 3:].reshape(3, 3)
    return (axes if body == 0 else configuration.pose[body - 1, POSE_A:POSE_V].reshape(3, 3) @ axes), body


def stages(system: BaseSystem, turns: list[Turn]) -> Iterator[Assembler]:
    """Yield the equations with these rotations held at angles from the drawn ones to those prescribed, in steps."""
    count = int(np.ceil(max(abs(turn.missing) for turn in turns) / LONGEST_STEP))
    for share in np.linspace(0.0, 1.0, count + 1):
        yield Assembler(_held(system.model, {turn.row: turn.angle + share * turn.missing for turn in turns}))


def _held(model: Model, angles: dict[int, float]) -> Model:
    """Return the model with constant angles (rad) in place of the prescribed ones, by row."""
    terms = model.terms.copy()
    functions = [np.array(model.functions)]
    for k, row in enumerate(angles):
        terms[model.spans[row].start, T.TERM_FUNCTION] = len(model.functions) + k
        functions.append(np.array([[CONSTANT, len(model.function_r) + k]], dtype=np.int64))
    return replace(
        model,
        terms=frozen(terms),
        functions=frozen(np.concatenate(functions)),
        function_r=frozen(np.concatenate([model.function_r, list(angles.values())])),
    )
