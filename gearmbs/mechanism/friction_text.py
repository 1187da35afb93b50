"""A joint's friction in the function language: for decks, and for expressions that look into it.

The law stands in `gearmbs.mechanism.friction`; the equations have it as a kernel of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

from gearmbs.mechanism import elements as el
from gearmbs.mechanism.elements import Load
from gearmbs.mechanism.expression_syntax import Units
from gearmbs.mechanism.friction_parameters import OVERLAPS, TINY, JointFriction
from gearmbs.mechanism.joints import Joint
from gearmbs.mechanism.parts import Marker


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
    load = getattr(writer, f"_{joint.kind}")()
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

    def _revolute(self) -> Load:
        return self._pin(self.j)

    def _universal(self) -> Load:
        return self._pin(self.i if self.f.yoke == "i" else self.j)

    def _pin(self, frame: Marker) -> Load:
        """A pin about z of ``frame``: N r = r F_radial + a |F_axial| + (r/b) T_bending."""
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

    def _translational(self) -> Load:
        parts = self._across()
        arm = self._lever("torsional_moment", "reaction_arm")
        if arm:
            parts.append(f"{self._length(self.j, (8,), arm)}/{arm!r}")
        normal = self._variable("normal", " + ".join(parts) or "0")
        a, c = _ref(self.i), _ref(self.j)
        mu = self._coefficients([f"VZ({a},{c},{c},{c})"])[0]
        text = _at_most(self._resisting(mu, normal, self.f.preload_force), self.f.max_force)
        return self._load(el.AXIS_FORCE, (text,), self.j)

    def _cylindrical(self) -> Load:
        """Slip along and about the axis: one surface, so both share the coefficient."""
        radius = float(self.f.pin_radius)
        normal = self._variable("normal", " + ".join(self._across()) or "0")
        a, c = _ref(self.i), _ref(self.j)
        along, about = self._coefficients([f"VZ({a},{c},{c},{c})", f"{radius!r}*WZ({a},{c},{c})"])
        force = _at_most(self._resisting(along, normal, self.f.preload_force), self.f.max_force)
        torque = _at_most(self._resisting(about, f"{radius!r}*{normal}", self.f.preload_torque), self.f.max_torque)
        return self._load(el.COMPONENTS, (None, None, force, None, None, torque), self.j)

    def _spherical(self) -> Load:
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


def _at_most(text: str, most: float | None) -> str:
    """Return an expression kept between -most and most."""
    return text if most is None else f"MAX({-float(most)!r}, MIN({float(most)!r}, {text}))"


def _ref(marker: Marker) -> str:
    return f'"{marker.name}"'
