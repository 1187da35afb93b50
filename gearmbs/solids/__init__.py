"""Solid bodies of CAD files (Parasolid XT in text): nodes, geometry, exact solids and facets.

`gearmbs.mechanism.contacts.read_solid` makes of a body what touches others; what is here is the way there.
"""

from gearmbs._lazy import late

__all__ = late(__name__)
