"""How two wheels touch: the law of a tooth pair, friction, and how the contact is discretised along the face."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import InitVar, dataclass, field
from typing import Literal

from gearmbs._shown import Written
from gearmbs.gears.fault import Fault
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.laws import ContactLaw, FlankFriction
from gearmbs.gears.spec import require
from gearmbs.units import shown

TILTED_SLICES = 11
"""Slices along the face where the gap varies linearly along it: tilted axes or faces that are not opposite."""

HELICAL_SLICES = 20
"""Slices of helical wheels, at least."""

SLICES_PER_OVERLAP = 20
"""Slices of helical wheels over an axial pitch: neighbouring sections differ by a twentieth of a mesh cycle."""

FAULTY_SLICES = 41
"""Slices where a fault varies along the face, so that a pit or a chipped corner of a few millimetres has several."""

BOTTOMING_CLEARANCE = 0.1
"""Tip clearance, in modules, below which contact of tips with roots is looked for by default."""


def varying_along_face(geometry: PairGeometry, faults: Iterable[Fault]) -> list[str]:
    """Return in words what makes the flanks' gap vary along the face."""
    return [
        *([f"the misalignment of {shown(geometry.misalignment, 'deg', '.4g')}"] if geometry.misalignment else []),
        *(["the helix"] if geometry.driver.helix_angle else []),
        *(fault.label for fault in faults if fault.along_face),
    ]


@dataclass(frozen=True)
class ContactModel(Written):
    """Contact of two toothed wheels.

    Parameters
    ----------
    law : ContactLaw
        Normal force of one tooth pair over its whole face.
    friction : FlankFriction
    slices : int, optional
        Slices along the face; default by `face_slices`: 1, 11 or 41.
    load : {"slices", "adams"}
        How a tooth pair carries its load. ``slices``: pressure distributed over the face. ``adams``: one force at the
        centroid of the overlap with the depth found there, as ADAMS does for solids.
    root_contact : bool, optional
        Whether tips may also meet the mate's root; default when the tip clearance is below a tenth of the module.
    stiffness_curve : {"constant", "potential-energy"}
        How the stiffness of a tooth pair varies along the path of contact; ``law.stiffness`` is its largest value.
    owner : str
        What messages call the fields' owner.

    Raises
    ------
    ValueError
        For a setting that is none of these.
    """

    law: ContactLaw = field(default_factory=ContactLaw.impact)
    friction: FlankFriction = field(default_factory=FlankFriction)
    slices: int | None = None
    load: Literal["slices", "adams"] = "slices"
    root_contact: bool | None = None
    stiffness_curve: Literal["constant", "potential-energy"] = "constant"
    owner: InitVar[str] = "ContactModel"

    # mypy may lose InitVar among modules that import each other for types
    def __post_init__(self, owner: str) -> None:  # type: ignore[override]
        require(self.load in ("slices", "adams"), f"{owner}.load is {self.load!r}; choose 'slices' or 'adams'")
        require(
            self.stiffness_curve in ("constant", "potential-energy"),
            f"{owner}.stiffness_curve is {self.stiffness_curve!r}; choose 'constant' or 'potential-energy'",
        )
        require(
            self.slices is None or (isinstance(self.slices, int) and self.slices >= 1),
            f"{owner}.slices is {self.slices!r}; give an integer of 1 or more",
        )

    def face_slices(self, geometry: PairGeometry, faults: Iterable[Fault] = ()) -> int:
        """Slices along the face in use: those asked for, or else as many as the gap's variation needs.

        One for spur wheels on parallel axes with opposite faces, where every section sees the same gap; `TILTED_SLICES`
        where misalignment or an axial shift make it vary along the face; `FAULTY_SLICES` where a fault does; at least
        `HELICAL_SLICES` and `SLICES_PER_OVERLAP` for each whole of the overlap ratio of helical wheels.
        """
        if self.slices is not None:
            return self.slices
        if any(fault.along_face for fault in faults):
            return FAULTY_SLICES
        if geometry.driver.helix_angle:
            return max(HELICAL_SLICES, math.ceil(SLICES_PER_OVERLAP * geometry.overlap_ratio))
        return 1 if geometry.uniform_along_face else TILTED_SLICES

    def tips_may_bottom(self, geometry: PairGeometry) -> bool:
        """Whether contact of tips with roots is looked for."""
        if self.root_contact is not None:
            return self.root_contact
        spur = geometry.driver.helix_angle == 0
        return spur and geometry.tip_clearance < BOTTOMING_CLEARANCE * geometry.driver.module

    def face_share(self, geometry: PairGeometry) -> float:
        """Share of the law's stiffness and damping that the faces have as they stand, `PairGeometry.face_share`.

        The law is that of faces that stand opposite. With ``load="adams"`` one force carries, whatever the face width.
        """
        return 1.0 if self.load == "adams" else geometry.face_share

    def penetration(self, force: float, pairs: int = 1, share: float = 1.0) -> float:
        """Static penetration when ``pairs`` tooth pairs of parallel wheels share a normal force (N) equally, m.

        ``share`` is that of the face in mesh, `face_share`.
        """
        return (force / (pairs * share * self.law.stiffness)) ** (1 / self.law.exponent)

    def tangent_stiffness(self, force: float, pairs: int = 1, share: float = 1.0) -> float:
        """Tangent stiffness along the line of action of that many tooth pairs under a normal force (N), N/m.

        ``share`` is that of the face in mesh, `face_share`.
        """
        return self.law.exponent * force / self.penetration(force, pairs, share)
