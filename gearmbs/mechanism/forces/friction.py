"""Joint friction in the manner of ADAMS, from a joint's reaction.

The friction on I's body opposes the slip s (m/s, components s_k in the marker J) of the joint's surfaces,

    F_k = -(mu_k N + P mu_k / mu_d),

with N the force that presses the surfaces together and P the preload. The coefficient depends on the slip speed
V = |s| as in ADAMS's joint friction: mu_s up to the stiction transition velocity v_s, mu_d from 1.5 v_s, a STEP
between, called g(V) below. How mu_k gets there depends on the largest stiction deformation D:

* D > 0: an elastic deformation z holds the joint and slides at the limit,

      z_k' = s_k - mu_s V z_k / (D g(V)),    mu_k = mu_s (z_k + tau z_k') / D,

  which is mu_k = g(V) s_k / V in steady sliding, and in the joint at rest holds any force up to mu_s N without
  creep. tau = D / v_s damps the deformation and lets the slip speed, too, hold the joint until the deformation has
  grown, as below; it fades between v_s and 1.5 v_s. This is the model known as LuGre's, which ADAMS offers next to
  its own of stick and slip.
* D = 0: mu_k = g(V) s_k / V, inside v_s the cubic mu_s V (3 - V^2/v_s^2) / (2 v_s): the joint creeps.

References
----------
C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky: A new model for control of systems with friction. IEEE
Transactions on Automatic Control 40 (1995) 419-425. The inputs of each joint follow the FRICTION statement of the
ADAMS Solver manual.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.forces.joint_friction import REALS
from gearmbs.mechanism.language.syntax import Units
from gearmbs.mechanism.parts import elements as el
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.elements import Compiled, ForceElement, Load, State
from gearmbs.mechanism.parts.joints import Joint
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.units import QuantityLike

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism

# Parameters of a joint's friction.


INPUTS = ("preload", "reaction_force", "bending_moment", "torsional_moment")
EFFECTS = ("all", "stiction", "sliding")
OVERLAPS = {"constant": 0.0, "increasing": 1.0, "decreasing": -1.0}
TINY = 1e-6
"""Forces, in the unit of force, and slips, in transition velocities, below which lengths of vectors are rounded off."""
STEP = 1e-30
"""Of complex steps: none is lost to rounding, and its square vanishes beside the number."""


@dataclass(frozen=True)
class JointFriction:
    """Parameters of a joint's friction, in the mechanism's units (SI unless read from a deck).

    Attributes
    ----------
    mu_static, mu_dynamic : float
        Coefficients of friction.
    stiction_transition_velocity : float
        Slip speed below which the joint sticks.
    max_stiction_deformation : float
        Deformation in the joint at which sticking gives way; 0: friction is a function of the slip speed alone.
    effect : {"all", "stiction", "sliding"}
        Both, no friction beyond the transition, or no increase of the coefficient at rest (without deformation).
    inputs : sequence of str
        What presses the surfaces together: preload, reaction_force, bending_moment, torsional_moment.
    preload_force, preload_torque : float
        Friction of the unloaded joint.
    pin_radius, friction_arm, bending_arm : float
        Revolute and universal: radius of the pin, arm of the axial force, arm that turns the bending moment into a
        force. Cylindrical: the radius.
    reaction_arm, overlap : float
        Translational: arm that turns the torsional moment into a force. Translational and cylindrical: length that
        turns the bending moment into a force.
    overlap_change : {"constant", "increasing", "decreasing"}
        How the overlap changes with the displacement.
    ball_radius : float
        Spherical.
    yoke : {"i", "j"}
        Universal: the arm with friction.
    max_force, max_torque : float, optional
        The most the friction can be: force of translational, torque of the other joints, both of cylindrical ones.
    """

    mu_static: float
    mu_dynamic: float
    stiction_transition_velocity: float = 1e-3
    max_stiction_deformation: float = 1e-5
    effect: str = "all"
    inputs: tuple[str, ...] = INPUTS
    preload_force: float = 0.0
    preload_torque: float = 0.0
    pin_radius: float = 0.0
    friction_arm: float = 0.0
    bending_arm: float = 0.0
    reaction_arm: float = 0.0
    overlap: float = 0.0
    overlap_change: str = "constant"
    ball_radius: float = 0.0
    yoke: str = "i"
    max_force: float | None = None
    max_torque: float | None = None

    def check(self, name: str) -> None:
        """Raise a ModelError that names a wrong parameter."""
        label = f"friction '{name}'"
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, (int, float)) and not (np.isfinite(value) and value >= 0.0):
                raise ModelError(f"{label}: {f.name} = {value}; it must not be negative")
        for field, known in (("effect", EFFECTS), ("overlap_change", tuple(OVERLAPS)), ("yoke", ("i", "j"))):
            if getattr(self, field) not in known:
                raise ModelError(f"{label}: {field} = {getattr(self, field)!r}; choose one of {', '.join(known)}")
        for item in self.inputs:
            if item not in INPUTS:
                raise ModelError(f"{label}: inputs has {item!r}; choose from {', '.join(INPUTS)}")
        if not self.stiction_transition_velocity > 0.0:
            raise ModelError(f"{label}: stiction_transition_velocity must be positive")
        for field in ("max_force", "max_torque"):
            if getattr(self, field) == 0.0:
                raise ModelError(f"{label}: {field} must be positive; leave it out for no limit")
        if not self.mu_dynamic > 0.0:
            raise ModelError(f"{label}: mu_dynamic = {self.mu_dynamic}; it must be positive")
        if self.mu_static < self.mu_dynamic and self.effect != "sliding":
            raise ModelError(f"{label}: mu_static = {self.mu_static} is less than mu_dynamic = {self.mu_dynamic}")


# A joint's friction in the function language: for decks, and for expressions that look into it.
#
# The law stands in `gearmbs.mechanism.forces.friction`; the equations have it as a kernel of its own.


@dataclass(frozen=True)
class FrictionText:
    """A joint's friction in the function language.

    Attributes
    ----------
    variables, states : dict of str to str
        Expressions by name; of a state, its rate.
    load : Load
    start : float
        Displacement along z of J from which a change of the overlap counts, m.
    """

    variables: dict[str, str]
    states: dict[str, str]
    load: Load
    start: float


def friction_text(name: str, joint: Joint, friction: JointFriction, units: Units) -> FrictionText:
    """Return the friction of a joint in the function language, in the units given."""
    writer = _Writer(name, joint, friction, units)
    load = KINDS[joint.kind].text(writer)
    return FrictionText(writer.variables, writer.states, load, writer.start)


class _Writer:
    """Writes one joint's friction in the function language."""

    def __init__(self, name: str, joint: Joint, friction: JointFriction, units: Units) -> None:
        self.name, self.joint, self.f, self.units = name, joint, friction, units
        self.i, self.j = joint.i, joint.j
        self.vs = float(friction.stiction_transition_velocity)
        self.variables: dict[str, str] = {}
        self.states: dict[str, str] = {}
        apart = joint.i.global_position() - joint.j.global_position()
        self.start = float(joint.j.global_orientation()[:, 2] @ apart)

    # --- joints -------------------------------------------------------------------------------------

    def pin(self) -> Load:
        """A pin about z of a frame: N r = r F_radial + a |F_axial| + (r/b) T_bending."""
        frame = self.i if KINDS[self.joint.kind].yoke and self.f.yoke == "i" else self.j
        radius = float(self.f.pin_radius)
        arm = self._lever("bending_moment", "bending_arm")
        parts = []
        if "reaction_force" in self.f.inputs:
            parts.append(f"{radius!r}*{self._length(frame, (2, 3))}")
            parts.append(f"{float(self.f.friction_arm)!r}*{self._length(frame, (4,))}")
        if arm:
            parts.append(f"{radius / arm!r}*{self._length(frame, (6, 7), radius)}")
        moment = self._variable("moment", " + ".join(parts) or "0")
        slip = f"{radius!r}*WZ({_ref(self.i)},{_ref(self.j)},{_ref(frame)})"
        mu = self._coefficients([slip])[0]
        text = _at_most(self._resisting(mu, moment, self.f.preload_torque), self.f.max_torque)
        return self._load(el.AXIS_TORQUE, (text,), frame)

    def slide(self) -> Load:
        parts = self._across()
        arm = self._lever("torsional_moment", "reaction_arm")
        if arm:
            parts.append(f"{self._length(self.j, (8,), arm)}/{arm!r}")
        normal = self._variable("normal", " + ".join(parts) or "0")
        a, c = _ref(self.i), _ref(self.j)
        mu = self._coefficients([f"VZ({a},{c},{c},{c})"])[0]
        text = _at_most(self._resisting(mu, normal, self.f.preload_force), self.f.max_force)
        return self._load(el.AXIS_FORCE, (text,), self.j)

    def cylinder(self) -> Load:
        """Slip along and about the axis: one surface, so both share the coefficient."""
        radius = float(self.f.pin_radius)
        normal = self._variable("normal", " + ".join(self._across()) or "0")
        a, c = _ref(self.i), _ref(self.j)
        along, about = self._coefficients([f"VZ({a},{c},{c},{c})", f"{radius!r}*WZ({a},{c},{c})"])
        force = _at_most(self._resisting(along, normal, self.f.preload_force), self.f.max_force)
        torque = _at_most(self._resisting(about, f"{radius!r}*{normal}", self.f.preload_torque), self.f.max_torque)
        return self._load(el.COMPONENTS, (None, None, force, None, None, torque), self.j)

    def ball(self) -> Load:
        radius = float(self.f.ball_radius)
        used = "reaction_force" in self.f.inputs
        normal = self._variable("normal", self._length(self.j, (2, 3, 4)) if used else "0")
        a, c = _ref(self.i), _ref(self.j)
        mu = self._coefficients([f"{radius!r}*W{x}({a},{c},{c})" for x in "XYZ"])
        torque = [self._resisting(m, f"{radius!r}*{normal}", self.f.preload_torque) for m in mu]
        if self.f.max_torque is not None:
            parts = [self._variable(f"torque{k + 1}", text) for k, text in enumerate(torque)]
            most = float(self.f.max_torque)
            size = f"SQRT({' + '.join(f'{p}**2' for p in parts)} + {(TINY * most) ** 2!r})"
            share = self._variable("share", f"MIN(1, {most!r}/{size})")
            torque = [f"{p}*{share}" for p in parts]
        return self._load(el.COMPONENTS, (None, None, None, *torque), self.j)

    # --- pieces -------------------------------------------------------------------------------------

    def _lever(self, moment: str, field: str) -> float:
        """Return the lever of a moment, 0 where it does not count."""
        return float(getattr(self.f, field)) if moment in self.f.inputs else 0.0

    def _across(self) -> list[str]:
        """Return the force across z of J and what the bending moment over the overlap adds."""
        parts = [self._length(self.j, (2, 3))] if "reaction_force" in self.f.inputs else []
        overlap = self._lever("bending_moment", "overlap")
        if overlap:
            length = f"{overlap!r}"
            sign = OVERLAPS[self.f.overlap_change]
            if sign:
                a, c = _ref(self.i), _ref(self.j)
                start = self.start / self.units.length
                length = f"({overlap!r} + {sign!r}*(DZ({a},{c},{c}) - ({start!r})))"
            parts.append(f"{self._length(self.j, (6, 7), overlap)}/{length}")
        return parts

    def _length(self, frame: Marker, components: tuple[int, ...], scale: float = 1.0) -> str:
        """Return the length of components, as JOINT counts them (2-4 force, 6-8 torque), of the joint's reaction."""
        squares = [f'JOINT("{self.joint.name}",0,{c},{_ref(frame)})**2' for c in components]
        return f"SQRT({' + '.join(squares)} + {(TINY * (scale if components[0] > 5 else 1.0)) ** 2!r})"

    def _variable(self, what: str, text: str) -> str:
        key = f"{self.name}.{what}"
        self.variables[key] = text
        return f'VARVAL("{key}")'

    def _resisting(self, mu: str, normal: str, preload: float) -> str:
        kept = float(preload) / self.f.mu_dynamic if "preload" in self.f.inputs else 0.0
        return f"-{mu}*({normal} + {kept!r})" if kept else f"-{mu}*{normal}"

    def _limit(self, speed: str) -> str:
        """g(V)."""
        dynamic = 1e-6 * self.f.mu_static if self.f.effect == "stiction" else self.f.mu_dynamic
        static = self.f.mu_dynamic if self.f.effect == "sliding" else self.f.mu_static
        return f"STEP({speed},{self.vs!r},{static!r},{1.5 * self.vs!r},{dynamic!r})"

    def _coefficients(self, slips: list[str]) -> list[str]:
        """Return mu_k for the components of the slip."""
        s = [self._variable(f"slip{k + 1}", text) for k, text in enumerate(slips)]
        if len(s) == 1:
            speed = f"ABS({s[0]})"
        else:
            floor = (TINY * self.vs) ** 2
            squares = " + ".join(f"{x}**2" for x in s)
            speed = f"SQRT({squares} + {floor!r})"
        speed = self._variable("speed", speed)
        if self.f.effect == "sliding" or self.f.max_stiction_deformation == 0.0:
            return [self._variable(f"mu{k + 1}", text) for k, text in enumerate(self._by_velocity(s, speed))]
        return [self._variable(f"mu{k + 1}", text) for k, text in enumerate(self._by_deformation(s, speed))]

    def _by_velocity(self, slips: list[str], speed: str) -> list[str]:
        static = self.f.mu_dynamic if self.f.effect == "sliding" else self.f.mu_static
        inside = f"{0.5 * static / self.vs!r}*(3 - ({speed}/{self.vs!r})**2)"
        outside = f"{self._limit(speed)}/MAX({speed},{0.5 * self.vs!r})"
        per_slip = self._variable("mu_per_slip", f"IF({speed} - {self.vs!r}: {inside}, {inside}, {outside})")
        return [f"{s}*{per_slip}" for s in slips]

    def _by_deformation(self, slips: list[str], speed: str) -> list[str]:
        deformation = float(self.f.max_stiction_deformation)
        stiffness = self.f.mu_static / deformation
        limit = self._variable("limit", self._limit(speed))
        tau = deformation / self.vs
        damping = self._variable("damping", f"{tau!r}*STEP({speed},{self.vs!r},1,{1.5 * self.vs!r},0)")
        found = []
        for k, slip in enumerate(slips):
            key = f"{self.name}.deformation{k + 1}"
            z = f'DIF("{key}")'
            rate = self._variable(f"rate{k + 1}", f"{slip} - {stiffness!r}*{speed}*{z}/{limit}")
            self.states[key] = rate if self.units.time == 1.0 else f"({rate})/{self.units.time!r}"
            found.append(f"{stiffness!r}*({z} + {damping}*{rate})")
        return found

    def _load(self, mode: int, expressions: tuple[str | None, ...], frame: Marker) -> Load:
        return Load(self.name, "friction", self.i, self.j, frame, mode, expressions)


@dataclass(frozen=True, kw_only=True)
class FrictionKind:
    """How the surfaces of a kind of joint rub.

    Attributes
    ----------
    text : callable
        ``text(writer)`` returns the load in the function language.
    kernel : str
        Which of the kinds of `gearmbs.mechanism.forces.joint_friction` it is.
    force, torque : bool
        Whether it rubs along z of J, and by turning.
    pressing : dict of str to str or None
        What presses the surfaces together, and the length that must not be zero for it.
    lever : str
        Radius without which there is no friction, "" where nothing turns.
    arm : str
        A further length.
    yoke : bool
        Whether it rubs in one of two arms.
    """

    text: Callable[[_Writer], Load]
    kernel: str
    force: bool = False
    torque: bool = True
    pressing: Mapping[str, str | None]
    lever: str = ""
    arm: str = ""
    yoke: bool = False

    @property
    def lengths(self) -> tuple[str, ...]:
        """All lengths that it takes."""
        return tuple(name for name in (self.lever, self.arm, *reversed(list(self.pressing.values()))) if name)


_PIN = FrictionKind(
    text=_Writer.pin,
    kernel="pin",
    pressing={"reaction_force": None, "bending_moment": "bending_arm"},
    lever="pin_radius",
    arm="friction_arm",
)
KINDS: dict[str, FrictionKind] = {
    "revolute": _PIN,
    "translational": FrictionKind(
        text=_Writer.slide,
        kernel="slide",
        force=True,
        torque=False,
        pressing={"reaction_force": None, "bending_moment": "overlap", "torsional_moment": "reaction_arm"},
    ),
    "cylindrical": FrictionKind(
        text=_Writer.cylinder,
        kernel="cylinder",
        force=True,
        pressing={"reaction_force": None, "bending_moment": "overlap"},
        lever="pin_radius",
    ),
    "spherical": FrictionKind(text=_Writer.ball, kernel="ball", pressing={"reaction_force": None}, lever="ball_radius"),
    "universal": replace(_PIN, yoke=True),
}
"""The joints that take friction; that of another kind which rubs as one of these does is one row."""


def _at_most(text: str, most: float | None) -> str:
    """Return an expression kept between -most and most."""
    return text if most is None else f"MAX({-float(most)!r}, MIN({float(most)!r}, {text}))"


def _ref(marker: Marker) -> str:
    return f'"{marker.name}"'


# The friction of a joint as a force element.


@dataclass(eq=False, repr=False)
class FrictionForce(ForceElement):
    """Friction of a joint, from its reaction and its slip; the law is that of `gearmbs.mechanism.forces.friction`.

    Attributes
    ----------
    joint : Joint
    friction : JointFriction
        In ``units``.
    units : Units
    own_states : tuple of State
        Deformations of the surfaces, m.
    text : FrictionText
        The same in the function language.
    """

    joint: Joint
    friction: JointFriction
    units: Units
    own_states: tuple[State, ...]
    text: FrictionText

    settled = (*ForceElement.settled, "joint", "friction", "units", "own_states", "text")

    def by_expressions(self, units: Units) -> tuple[Load, dict[str, tuple[str, float]]]:
        """Return the load that stands for the friction; its texts are in the mechanism's units already."""
        rates = zip(self.states, self.text.states.values(), strict=True)
        return self.text.load, {state.name: (text, state.start) for state, text in rates}

    kind = "friction"

    @property
    def states(self) -> tuple[State, ...]:
        """Deformations of the surfaces."""
        return self.own_states

    @property
    def has_force(self) -> bool:  # type: ignore[override]
        """Whether F is an unknown."""
        return KINDS[self.joint.kind].force

    @property
    def has_torque(self) -> bool:  # type: ignore[override]
        """Whether N is an unknown."""
        return KINDS[self.joint.kind].torque

    @property
    def parameters(self) -> Mapping[str, Any]:
        """What it was made from, for writing decks."""
        return {"joint": self.joint, "friction": self.friction, "keys": (*self.text.variables, *self.text.states)}

    def compiled(self) -> Compiled:
        from gearmbs.mechanism.forces.joint_friction.kernel import KERNELS, SCRATCH

        kind, numbers = KINDS[self.joint.kind], self._numbers(self.friction)
        kernel, changed = KERNELS[kind.kernel]
        loaded = any(numbers[REALS.index(part)] != 0.0 for part in REALS if part.startswith("per_"))
        return Compiled(
            kernel, (0 if kind.yoke and self.friction.yoke == "i" else 1,), numbers,
            reactions=(self.joint.name,) if loaded else (), scratch=SCRATCH, changed=changed,
        )  # fmt: skip

    def _reals_by(self, name: str, made: Compiled) -> np.ndarray:
        """Return how the reals change with a parameter of the friction: a complex step of what makes them."""
        value = getattr(self.friction, name, None)
        if name not in PARAMETERS or value is None:
            there = [one for one in PARAMETERS if getattr(self.friction, one) is not None]
            raise ModelError(f"friction '{self.name}': it has no number '{name}'; it has {', '.join(there)}")
        unit = self.units.factor(DIMENSIONS[name][1]) if name in DIMENSIONS else 1.0
        moved = replace(self.friction, **{name: value + 1j * STEP})
        return np.imag(self._numbers(moved)) / (STEP * unit)

    def _numbers(self, f: JointFriction) -> np.ndarray:
        """Return the reals of a friction, `REALS`, SI; those that the joint does not use press by nothing."""
        kind = KINDS[self.joint.kind]
        length, force, torque = (self.units.factor(d) for d in ("length", "force", "torque"))
        kept = 1.0 / f.mu_dynamic if "preload" in f.inputs else 0.0
        lever = getattr(f, kind.lever) if kind.lever else 0.0
        turning = (torque * kept * f.preload_torque, np.inf if f.max_torque is None else torque * f.max_torque)
        sliding = (force * kept * f.preload_force, np.inf if f.max_force is None else force * f.max_force)
        by = dict.fromkeys(REALS, 0.0) | {"overlap": 1.0, "tiny_bending": TINY, "tiny_twist": TINY}
        by |= {
            "lever": length * lever,
            "tiny_force": TINY * force,
            "static": f.mu_dynamic if f.effect == "sliding" else f.mu_static,
            "dynamic": 1e-6 * f.mu_static if f.effect == "stiction" else f.mu_dynamic,
            "transition": self.units.factor("velocity") * f.stiction_transition_velocity,
            "deformation": length * f.max_stiction_deformation,
            **dict(zip(("kept", "most"), sliding if kind.force else turning)),
            **dict(zip(("kept_about", "most_about"), turning)),
        }
        arms = {name: getattr(f, arm) for name, arm in kind.pressing.items() if arm and name in f.inputs}
        bending, twist = (arms.get(f"{name}_moment", 0.0) for name in ("bending", "torsional"))
        if "reaction_force" in f.inputs:
            by["per_force"] = length * lever if kind.kernel == "pin" else 1.0
            by["per_axial"] = length * f.friction_arm if kind.kernel == "pin" else 0.0
        if bending.real and kind.kernel == "pin":
            by |= {"per_bending": lever / bending, "tiny_bending": TINY * lever * torque}
        elif bending.real:
            by |= {"per_bending": 1.0, "tiny_bending": TINY * bending * torque, "overlap": length * bending}
            by |= {"overlap_slope": OVERLAPS[f.overlap_change], "start": self.text.start}
        if twist.real:
            by |= {"per_twist": 1.0 / (length * twist), "tiny_twist": TINY * twist * torque}
        return np.array([by[name] for name in REALS])

    def __repr__(self) -> str:
        return f"FrictionForce({self.name!r} in joint {self.joint.name!r})"


DIMENSIONS = {
    "stiction_transition_velocity": ("speed", "velocity"),
    "preload_force": ("force", "force"),
    "preload_torque": ("torque", "torque"),
    "max_force": ("force", "force"),
    "max_torque": ("torque", "torque"),
    **dict.fromkeys(
        ("max_stiction_deformation", "pin_radius", "friction_arm", "bending_arm", "reaction_arm", "overlap",
         "ball_radius"),
        ("length", "length"),
    ),
}  # fmt: skip
"""Dimension of each parameter with a unit, for texts and in the function language."""
PARAMETERS = ("mu_static", "mu_dynamic", *DIMENSIONS)
"""All that are numbers."""


def friction_of(
    name: str, mu_static: QuantityLike, mu_dynamic: QuantityLike, parameters: dict, units: Units
) -> JointFriction:
    """Return the parameters of a friction given as keywords; texts with a unit become numbers in ``units``.

    Raises
    ------
    ModelError
        For a keyword that does not exist, or a value that is not what it should be.
    """
    label = f"friction '{name}'"
    mu_static, mu_dynamic = (
        quantity(value, "dimensionless", f"{label}: {field}")
        for field, value in (("mu_static", mu_static), ("mu_dynamic", mu_dynamic))
    )
    known = [f.name for f in fields(JointFriction)]
    for key in parameters:
        if key not in known:
            raise ModelError(f"friction '{name}': {key!r} is no parameter; there are {', '.join(known)}")
    given = dict(parameters)
    for key, (unit, dimension) in DIMENSIONS.items():
        if given.get(key) is not None:
            given[key] = quantity(given[key], unit, f"{label}: {key}", units.factor(dimension))
    return JointFriction(mu_static, mu_dynamic, **given)


def add_friction(mechanism: Mechanism, name: str, joint: Joint, friction: JointFriction) -> list[FrictionForce]:
    """Add a joint's friction to a mechanism, and variables with what it is made of; return the force element.

    Raises
    ------
    ModelError
        For a joint without friction of this kind, or a parameter that is wrong or missing.
    """
    friction.check(name)
    if joint.kind not in KINDS:
        raise ModelError(f"friction '{name}': joint '{joint.name}' is {joint.kind}; it must be {', '.join(KINDS)}")
    lever = KINDS[joint.kind].lever
    if lever and not getattr(friction, lever) > 0.0:
        raise ModelError(f"friction '{name}': {lever} is needed for a {joint.kind} joint")
    text = friction_text(name, joint, friction, mechanism.units)
    for key, expression in text.variables.items():
        mechanism.variable(key, expression)
    states = tuple(State(key) for key in text.states)
    return [mechanism.add(FrictionForce(name, joint.i, joint.j, joint, friction, mechanism.units, states, text))]


__all__ = [
    "INPUTS",
    "KINDS",
    "JointFriction",
    "add_friction",
    "friction_of",
]
