"""Solid bodies of CAD files (Parasolid XT in text): nodes, geometry, exact solids and facets.

`gearmbs.mechanism.contacts.read_solid` makes of a body what touches others; what is here is the way there.
"""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.solids.bodies import Body, Face, Primitive, primitive, read_bodies
    from gearmbs.solids.facets import faceted

__all__ = ["Body", "Face", "Primitive", "faceted", "primitive", "read_bodies"]

late(
    __name__,
    {
        "Body": ".bodies",
        "Face": ".bodies",
        "Primitive": ".bodies",
        "faceted": ".facets",
        "primitive": ".bodies",
        "read_bodies": ".bodies",
    },
)
