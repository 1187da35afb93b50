"""Contact between solids: shapes, where they touch, what presses them apart and what rubs."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.mechanism.contacts.element import Coulomb, Impact, Poisson, SolidContact
    from gearmbs.mechanism.contacts.shapes import (
        Box,
        Cylinder,
        Ellipsoid,
        Frustum,
        HalfSpace,
        Mesh,
        Shape,
        Sphere,
        Torus,
        extruded,
        revolved,
    )
    from gearmbs.mechanism.contacts.solid_files import read_mesh, read_solid
    from gearmbs.mechanism.contacts.tracks import ContactTracks, contact_tracks

__all__ = [
    "Box",
    "ContactTracks",
    "Coulomb",
    "Cylinder",
    "Ellipsoid",
    "Frustum",
    "HalfSpace",
    "Impact",
    "Mesh",
    "Poisson",
    "Shape",
    "SolidContact",
    "Sphere",
    "Torus",
    "contact_tracks",
    "extruded",
    "read_mesh",
    "read_solid",
    "revolved",
]

late(
    __name__,
    {
        **dict.fromkeys(("Coulomb", "Impact", "Poisson", "SolidContact"), ".element"),
        "read_mesh": ".solid_files",
        "read_solid": ".solid_files",
        **dict.fromkeys(
            ("Box", "Cylinder", "Ellipsoid", "Frustum", "HalfSpace", "Mesh", "Shape", "Sphere", "Torus"), ".shapes"
        ),
        **dict.fromkeys(("extruded", "revolved"), ".shapes"),
        **dict.fromkeys(("ContactTracks", "contact_tracks"), ".tracks"),
    },
)
