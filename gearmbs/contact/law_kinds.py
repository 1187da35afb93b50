"""The table of contact laws: all that is known of a kind beside its pressure, `gearmbs.contact.laws.pressure`.

A new kind is a row here and a branch there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

LAW_IMPACT, LAW_HUNT_CROSSLEY, LAW_KUWABARA_KONO = range(3)
"""Branches of the pressure."""


class LawKind(NamedTuple):
    """A kind of contact law.

    Attributes
    ----------
    code : int
        Branch of the pressure, one of ``LAW_*``.
    damping_unit : str
        That of a force over the penetration rate, or of a factor on the elastic force.
    section_damping : callable
        What a unit of damping is in the transverse section of helical teeth per unit face width, from the cosine of the
        base helix angle and the width, m. Penetration and rate along the normal are the cosine times the section's.
    maker : str
        Method of ``gearmbs.gears.ContactLaw`` that makes one from its settings; "" for the class itself.
    """

    code: int
    damping_unit: str
    section_damping: Callable[[float, float], float]
    maker: str = ""

    @property
    def is_impact(self) -> bool:
        """Whether ADAMS's IMPACT is the law, with some stiffness and exponent."""
        return self.code == LAW_IMPACT

    @property
    def damps_by_factor(self) -> bool:
        """Whether the damping is a factor on the elastic force, which a share of the face leaves as it is."""
        return self.damping_unit != FORCE_OVER_RATE


FORCE_OVER_RATE = "N*s/m"
_impact = LawKind(LAW_IMPACT, FORCE_OVER_RATE, lambda cosine, width: cosine / width, "impact")
LAW_KINDS = {
    "impact": _impact,
    "hunt-crossley": LawKind(LAW_HUNT_CROSSLEY, "s/m", lambda cosine, width: cosine, "hunt_crossley"),
    "kuwabara-kono": LawKind(LAW_KUWABARA_KONO, "s", lambda cosine, width: 1.0),
    "linear": _impact._replace(maker="linear"),
    "hertz": _impact._replace(maker="hertz_line"),
}
