"""Solid bodies of CAD files (Parasolid XT in text): nodes, geometry, exact solids and facets."""
