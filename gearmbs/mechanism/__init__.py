"""What a person builds: bodies, markers, joints, motions, forces."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.dae.equations.force_elements import Diagnostic
    from gearmbs.dae.errors import AssemblyError, ModelError, SingularModelError
    from gearmbs.mechanism.analyses import kinematic, linear_modes, quasi_static, static_equilibrium
    from gearmbs.mechanism.elements import Compiled, ForceElement, Load, State, Torque
    from gearmbs.mechanism.forces.modal_force import add_modal_force
    from gearmbs.mechanism.friction_parameters import JointFriction
    from gearmbs.mechanism.functions import (
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
    from gearmbs.mechanism.joints import Joint
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.modal import ModalBody, Mode, ShapeIntegrals
    from gearmbs.mechanism.parts import Body, Marker
    from gearmbs.mechanism.simulate import simulate

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
        "AssemblyError": "gearmbs.dae.errors",
        "Body": ".parts",
        "Compiled": ".elements",
        "Diagnostic": "gearmbs.dae.equations.force_elements",
        "ForceElement": ".elements",
        "Joint": ".joints",
        "JointFriction": ".friction_parameters",
        "Load": ".elements",
        "Marker": ".parts",
        "Mechanism": ".mechanism",
        "ModalBody": ".modal",
        "Mode": ".modal",
        "ModelError": "gearmbs.dae.errors",
        "ShapeIntegrals": ".modal",
        "SingularModelError": "gearmbs.dae.errors",
        "State": ".elements",
        "TimeFunction": ".functions",
        "Torque": ".elements",
        "add_modal_force": ".forces.modal_force",
        "constant": ".functions",
        "curve": ".functions",
        "curve_integral": ".functions",
        "polyline": ".functions",
        "polyline_integral": ".functions",
        "expression": ".functions",
        "harmonic": ".functions",
        "kinematic": ".analyses",
        "linear_modes": ".analyses",
        "polynomial": ".functions",
        "quasi_static": ".analyses",
        "ramp": ".functions",
        "simulate": ".simulate",
        "static_equilibrium": ".analyses",
        "step": ".functions",
    },
)
