"""The contact of two wheels as a force element of a mechanism."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.law_kinds import LAW_KINDS
from gearmbs.dae.equations.loads.forces import COUNT, DISSIPATED, STORED, Diagnostic
from gearmbs.dae.problem import ModelError
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.tables import law_factors, pack
from gearmbs.mechanism.parts.elements import NOT_NEGATIVE, POSITIVE, Compiled, ForceElement, Setting, StartOverlap
from gearmbs.units import shown
from gearmbs.wording import warn

DEEP = 0.02
"""Depth of teeth in each other, in modules, up to which no load is asked for: 0.06 mm at 3 mm, twice and a half what
100 N m press the paper's wheels."""

TOLD = [L.place(L.TOTALS, name) for name in ("depth_drive", "depth_coast", "normal_force")]
"""Places of what is asked of a contact at the start: depths on both flanks, m, and the sum of normal forces, N."""


def contact_kernels() -> tuple[Any, tuple[Any, Any]]:
    """Return the kernel of the force, and that of the contact below it with its signature; they are imported now."""
    from gearmbs.contact import GEAR_CONTACT_SIG, gear_contact
    from gearmbs.contact.kernel import contact_force

    return contact_force, (gear_contact, GEAR_CONTACT_SIG)


def lean_contact(
    integers: np.ndarray, reals: np.ndarray, frames: np.ndarray, axes: np.ndarray
) -> tuple[Any, np.ndarray] | None:
    """Offer the kernel of wheels on fixed parallel axes, as `Compiled.lean`; it is imported now."""
    from gearmbs.contact.parallel.kernel import parallel_axes, parallel_contact

    own = parallel_axes(integers, reals, frames, axes)
    return None if own is None else (parallel_contact, own)


def law_settings(pair: Mesh) -> dict[str, Setting]:
    """Return stiffness and damping of a pair's contact law as what can be changed while a simulation goes on."""
    geometry, law = pair.geometry, pair.contact_model.law
    cosine = math.cos(geometry.wheels[0].base_helix_angle)
    stiff, damped = law_factors(pair.contact_model, geometry.narrower_face_width, cosine)
    return {
        "stiffness": Setting(L.place(L.PAIR, "stiffness"), f"N/m^{law.exponent:g}", stiff, allowed=POSITIVE),
        "damping": Setting(L.place(L.PAIR, "damping"), LAW_KINDS[law.kind].damping_unit, damped, allowed=NOT_NEGATIVE),
    }


@dataclass(eq=False, repr=False)
class GearContact(ForceElement):
    """Tooth contact of the wheels whose frames are the markers I and J."""

    pair: Mesh

    kind = "gear contact"
    diagnostics = (
        Diagnostic("elastic_energy", "J", STORED),
        Diagnostic("damping_power", "W", DISSIPATED),
        Diagnostic("friction_power", "W", DISSIPATED),
        Diagnostic("penetration_drive", "m"),
        Diagnostic("penetration_back", "m"),
        Diagnostic("pairs_drive", "1", COUNT),
        Diagnostic("pairs_back", "1", COUNT),
        Diagnostic("normal_force", "N"),
    )

    @property
    def periods(self) -> tuple[int, int]:
        """Teeth of both wheels."""
        one, two = self.pair.geometry.wheels
        return one.teeth, two.teeth

    def compiled(self) -> Compiled:
        force, contact = contact_kernels()
        integers, reals, scratch = pack(self.pair)
        lean = partial(lean_contact, integers, reals)
        settings = law_settings(self.pair)
        return Compiled(force, integers, reals, (contact,), scratch=scratch, settings=settings, lean=lean)

    def check(self) -> None:
        """Check the initial distance of the two wheels.

        Raises
        ------
        ModelError
            If they overlap: closer than the sum of their base radii.

        Warns
        -----
        UserWarning
            If they are out of each other's reach.
        """
        axis = self.i.global_orientation()[:, 2]
        apart = self.j.global_position() - self.i.global_position()
        distance = float(np.linalg.norm(apart - axis * (axis @ apart)))
        label = f"gear contact '{self.name}': the axes are {1e3 * distance:.4g} mm apart"
        geometry = self.pair.geometry
        least, most = abs(geometry.base_radius_sum), abs(geometry.tip_radius_sum)
        if distance <= least:
            raise ModelError(
                f"{label}, less than the sum of the base radii, {1e3 * least:.4g} mm; place the wheels as the pair's "
                "placement() says"
            )
        if geometry.sign > 0 and distance > most:
            warn(f"{label}, more than the tip radii together, {1e3 * most:.4g} mm: the teeth cannot touch")
        if geometry.sign < 0 and distance < most:
            warn(f"{label}, less than the tip radii differ, {1e3 * most:.4g} mm: the teeth cannot touch")

    def start_overlap(self) -> StartOverlap | None:
        """Return how teeth stand in each other at the start: deeper than a fiftieth of the module, jams apart.

        Teeth that jam by their drawing, for want of backlash, start as deep as that makes them.
        """
        from gearmbs.contact import gear_contact

        geometry = self.pair.geometry
        gi, gr, size = pack(self.pair)
        wrench, jac, diag, zero = np.zeros(6), np.zeros((6, 24)), np.zeros(L.DIAGNOSTICS), np.zeros(3)
        origins = self.i.global_position(), self.j.global_position()
        axes = self.i.global_orientation(), self.j.global_orientation()
        one, two, *turned = map(np.ascontiguousarray, (*origins, *axes))
        gear_contact(
            gi, gr, one, turned[0], zero, zero, two, turned[1], zero, zero, wrench, jac, diag, 0, np.zeros(size)
        )
        drive, coast, force = diag[TOLD].tolist()
        jammed = max(0.0, geometry.jam_backlash - geometry.normal_backlash)
        depth = max(drive, coast)
        if depth <= DEEP * geometry.driver.module + jammed:
            return None
        where = (
            "on both flanks" if min(drive, coast) > 0.0 else f"on the {'drive' if drive > coast else 'coast'} flanks"
        )
        text = (
            f"its teeth are {shown(depth, 'mm', '.4g')} deep in each other {where}, which makes {1e-3 * force:.4g} kN"
        )
        # the driven wheel yields in its own sense where the drive flanks press
        turn = -geometry.sign * self.pair.operating_point.rotation * (drive - coast) / geometry.driven.base_radius
        remedy = (
            f"Turn '{self.j.body.name}' by {np.degrees(turn):.4g} deg about the wheel's axis, or place the wheels as "
            "the pair's placement() says"
        )
        if min(drive, coast) > 0.0:
            remedy = "Move the wheels apart, or give the pair more backlash"
        return StartOverlap(text, remedy, wrench)

    def __repr__(self) -> str:
        return f"GearContact({self.name!r}, {self.i.body.name!r} with {self.j.body.name!r})"
