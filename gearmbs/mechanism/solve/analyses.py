"""Static equilibrium, linear modes and kinematic analysis of a mechanism in one call each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.analyses import kinematics as _kinematic
from gearmbs.dae.analyses import modes as _modes
from gearmbs.dae.analyses import statics as _sequence
from gearmbs.dae.analyses import statics as _statics
from gearmbs.dae.analyses.modes import Modes
from gearmbs.dae.analyses.statics import StaticResult
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.checks import warn_of_stiff_seats
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.parts.quantities import quantities
from gearmbs.mechanism.solve.points import joint_coordinates
from gearmbs.mechanism.solve.simulate import just_inside
from gearmbs.progress import waiting
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism.mechanism import Mechanism


@waiting("equilibrium")
def static_equilibrium(
    mechanism: Mechanism, *, t: float = 0.0, tol: float = 1e-10, max_iterations: int = 200, move: bool = False
) -> StaticResult:
    """Find the position in which a mechanism rests.

    Parameters
    ----------
    mechanism : Mechanism
    t : float
        Time at which functions of time are frozen, s.
    tol : float
        Largest unbalanced force relative to the heaviest weight or largest load.
    max_iterations : int
    move : bool
        Make the equilibrium, at rest, the mechanism's initial position.

    Returns
    -------
    StaticResult

    Raises
    ------
    SingularModelError
        If a body is free to move and its loads do not balance.
    ModelError
        If the mechanism cannot be assembled or no equilibrium is found.

    Warns
    -----
    UserWarning
        If joints have friction: it does not help to find the equilibrium.
    """
    _warn_of_friction(mechanism)
    warn_of_stiff_seats(mechanism.joints, mechanism.elements)
    result = _statics.static_equilibrium(mechanism.compile(t), tol=tol, max_iterations=max_iterations)
    if move:
        place(mechanism, result)
    return result


def frozen_friction(mechanism: Mechanism) -> str | None:
    """Return what static analyses make of friction, None without any."""
    names = [n for n, e in mechanism.elements.items() if getattr(e, "kind", "") == "friction"]
    if not names:
        return None
    return (
        f"friction does not take part in static analyses ({', '.join(names)}): at rest it exerts what its stiction "
        "deformation was before, nothing at the start; simulate with damping to find where it holds the mechanism"
    )


def _warn_of_friction(mechanism: Mechanism) -> None:
    remark = frozen_friction(mechanism)
    if remark is not None:
        warn(remark)


def place(mechanism: Mechanism, equilibrium: StaticResult) -> None:
    """Make an equilibrium, at rest, the initial position of the mechanism it was found for, with its counted turns."""
    if list(mechanism.bodies) != list(equilibrium.body_names):
        raise ModelError(f"the equilibrium is not one of mechanism '{mechanism.name}': its bodies differ")
    for row, body in zip(equilibrium.pose, mechanism.bodies.values()):
        axes = row[POSE_A:POSE_V].reshape(3, 3).copy()
        body.orientation = axes
        arm = body.com
        if isinstance(body, ModalBody):
            body.start = equilibrium.solution.modal_coordinates(body.name)[0].copy()
            body.rate = np.zeros_like(body.start)
            arm = arm + body.start @ body.mean
        body.position = row[POSE_R:POSE_A] - axes @ arm
        body.velocity, body.angular_velocity = np.zeros(3), np.zeros(3)
    states = equilibrium.solution.result.y[0]
    own = mechanism.every_state
    for value, state in zip(states[states.size - len(own) :], own):
        state.start = float(value)
    system = equilibrium.solution.system
    frames = (system.mechanism.ground, *system.mechanism.bodies.values())
    names = {system.marker_index.get(id(marker)): marker.name for body in frames for marker in body.markers}
    for (function, i, j), angle in equilibrium.solution.counted().items():
        mechanism.turns[function, names.get(i, ""), names.get(j, "")] = angle


@waiting("equilibrium")
def quasi_static(mechanism: Mechanism, t_eval: np.ndarray, *, tol: float = 1e-10) -> Solution:
    """Follow the position in which a mechanism rests while its functions of time change slowly.

    Parameters
    ----------
    mechanism : Mechanism
    t_eval : ndarray, shape (m,)
        Increasing times at which functions of time are frozen, s.
    tol : float
        As in :func:`static_equilibrium`.

    Returns
    -------
    Solution
        Positions, reactions and loads; velocities are zero.

    Raises
    ------
    SingularModelError, ModelError
        As :func:`static_equilibrium`.
    """
    times = quantities(t_eval, "time", "t_eval")
    if times.ndim != 1 or times.size == 0 or not np.all(np.isfinite(times)):
        raise ModelError("t_eval: give a sequence of finite times")
    _warn_of_friction(mechanism)
    warn_of_stiff_seats(mechanism.joints, mechanism.elements)
    return _sequence.quasi_static(mechanism.compile(float(times[0])), times, tol=tol)


@waiting("modes")
def linear_modes(mechanism: Mechanism, *, t: float = 0.0, at: StaticResult | str = "initial") -> Modes:
    """Linearise a mechanism and return its eigenvalues and mode shapes.

    Parameters
    ----------
    mechanism : Mechanism
    t : float
        Time at which functions of time are frozen, s.
    at : StaticResult or {"initial", "equilibrium"}
        Operating point: the initial position and velocity, the equilibrium reached from there, or one found before.

    Returns
    -------
    Modes

    Raises
    ------
    ModelError
        If the mechanism cannot be assembled, or a free motion has no inertia.
    """
    warn_of_stiff_seats(mechanism.joints, mechanism.elements)
    if isinstance(at, str):
        if at not in ("initial", "equilibrium"):
            raise ModelError(f"at = {at!r}; choose 'initial', 'equilibrium' or give a StaticResult")
        system = mechanism.compile(t)
        if at == "initial":
            return _modes.linear_modes(system, joint_coordinates(mechanism))
        at = _statics.static_equilibrium(system)
    return _modes.linear_modes(at.solution.instant())


@waiting("kinematics")
def kinematic(mechanism: Mechanism, t_eval: np.ndarray) -> Solution:
    """Solve positions, velocities, accelerations and reactions of a mechanism whose motion is all prescribed.

    Parameters
    ----------
    mechanism : Mechanism
        Without degrees of freedom.
    t_eval : ndarray, shape (m,)
        Increasing times, s.

    Raises
    ------
    ModelError
        If the mechanism has degrees of freedom, or locks at some time.
    """
    times = quantities(t_eval, "time", "t_eval")
    if times.ndim != 1 or times.size == 0 or not np.all(np.isfinite(times)):
        raise ModelError("t_eval: give a sequence of finite times")
    solution = _kinematic.kinematic(mechanism.compile(float(times[0])), times)
    solution.inside = just_inside(times)
    return solution
