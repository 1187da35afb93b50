"""The contact of two wheels as a force element of a mechanism."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.dae.equations.force_elements import COUNT, DISSIPATED, STORED, Diagnostic
from gearmbs.dae.errors import ModelError
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.tables import pack
from gearmbs.mechanism.elements import Compiled, ForceElement


def contact_kernels() -> tuple[Any, tuple[Any, Any]]:
    """Return the kernel of the force, and that of the contact below it with its signature; they are imported now."""
    from gearmbs.contact import GEAR_CONTACT_SIG, gear_contact
    from gearmbs.contact.force_kernel import contact_force

    return contact_force, (gear_contact, GEAR_CONTACT_SIG)


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

    def compiled(self) -> Compiled:
        force, contact = contact_kernels()
        integers, reals, scratch = pack(self.pair)
        return Compiled(force, integers, reals, (contact,), scratch=scratch)

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
            warnings.warn(
                f"{label}, more than the tip radii together, {1e3 * most:.4g} mm: the teeth cannot touch", stacklevel=4
            )
        if geometry.sign < 0 and distance < most:
            warnings.warn(
                f"{label}, less than the tip radii differ, {1e3 * most:.4g} mm: the teeth cannot touch", stacklevel=4
            )

    def __repr__(self) -> str:
        return f"GearContact({self.name!r}, {self.i.body.name!r} with {self.j.body.name!r})"
