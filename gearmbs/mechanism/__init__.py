"""What a person builds: bodies, markers, joints, motions, forces."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.dae.equations.loads.forces import Diagnostic
    from gearmbs.dae.problem import AssemblyError, ModelError, SingularModelError
    from gearmbs.mechanism.forces.friction import JointFriction
    from gearmbs.mechanism.forces.modal_force import add_modal_force
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.parts.bodies import Body, Marker
    from gearmbs.mechanism.parts.elements import Compiled, ForceElement, Load, State, Torque
    from gearmbs.mechanism.parts.functions import (
        TimeFunction,
        constant,
        curve,
        curve_integral,
        expression,
        harmonic,
        polyline,
        polyline_integral,
        polynomial,
        ramp,
        step,
    )
    from gearmbs.mechanism.parts.joints import Joint
    from gearmbs.mechanism.parts.modal import ModalBody, Mode, ShapeIntegrals
    from gearmbs.mechanism.solve.analyses import kinematic, linear_modes, quasi_static, static_equilibrium
    from gearmbs.mechanism.solve.simulate import simulate

__all__ = [
    "AssemblyError",
    "Body",
    "Compiled",
    "Diagnostic",
    "ForceElement",
    "Joint",
    "JointFriction",
    "Load",
    "Marker",
    "Mechanism",
    "ModalBody",
    "Mode",
    "ModelError",
    "ShapeIntegrals",
    "SingularModelError",
    "State",
    "TimeFunction",
    "Torque",
    "add_modal_force",
    "constant",
    "curve",
    "curve_integral",
    "expression",
    "harmonic",
    "kinematic",
    "linear_modes",
    "polyline",
    "polyline_integral",
    "polynomial",
    "quasi_static",
    "ramp",
    "simulate",
    "static_equilibrium",
    "step",
]

late(
    __name__,
    {
        "AssemblyError": "gearmbs.dae.problem",
        "Body": ".parts.bodies",
        "Compiled": ".parts.elements",
        "Diagnostic": "gearmbs.dae.equations.loads.forces",
        "ForceElement": ".parts.elements",
        "Joint": ".parts.joints",
        "JointFriction": ".forces.friction",
        "Load": ".parts.elements",
        "Marker": ".parts.bodies",
        "Mechanism": ".mechanism",
        "ModalBody": ".parts.modal",
        "Mode": ".parts.modal",
        "ModelError": "gearmbs.dae.problem",
        "ShapeIntegrals": ".parts.modal",
        "SingularModelError": "gearmbs.dae.problem",
        "State": ".parts.elements",
        "TimeFunction": ".parts.functions",
        "Torque": ".parts.elements",
        "add_modal_force": ".forces.modal_force",
        "constant": ".parts.functions",
        "curve": ".parts.functions",
        "curve_integral": ".parts.functions",
        "polyline": ".parts.functions",
        "polyline_integral": ".parts.functions",
        "expression": ".parts.functions",
        "harmonic": ".parts.functions",
        "kinematic": ".solve.analyses",
        "linear_modes": ".solve.analyses",
        "polynomial": ".parts.functions",
        "quasi_static": ".solve.analyses",
        "ramp": ".parts.functions",
        "simulate": ".solve.simulate",
        "static_equilibrium": ".solve.analyses",
        "step": ".parts.functions",
    },
)
