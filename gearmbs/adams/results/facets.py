"""What is to be said of contacts whose solids are cut into facets: what rolls on these loses speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.adams.builders.model import AdamsModel
from gearmbs.adams.parse import statements as st
from gearmbs.mechanism.contacts import ContactTracks, SolidContact


@dataclass(frozen=True)
class FacetedTouch:
    """Two solids that touched, one of them round and cut into facets.

    Attributes
    ----------
    contact, first, second : str
        The CONTACT and both GRAPHICS.
    triangles : int
        Of both solids.
    sagitta, depth : float
        Between the facets and the round surface, and the median penetration while they touched, m.
    """

    contact: str
    first: str
    second: str
    triangles: int
    sagitta: float
    depth: float


def faceted_touches(model: AdamsModel, tracks: dict[int, ContactTracks]) -> list[FacetedTouch]:
    """Return pairs of round solids in facets that touched, those first whose facets are coarsest against the depth."""
    found = []
    for number, track in tracks.items():
        name = model.names["contact", number]
        statement, element = model.sources[name], model.mechanism.elements[name]
        assert isinstance(statement, st.Contact)
        assert isinstance(element, SolidContact)
        depths: dict[tuple[int, int], list[np.ndarray]] = {}
        for k, pair in enumerate(track.pairs):
            depths.setdefault(pair, []).append(track.penetration[track.touching[:, k], k])
        for (i, j), triangles, sagitta in element.round_facets():
            sunk = np.concatenate(depths.get((i, j), [np.zeros(0)]))
            if sunk.size:
                first, second = f"GRAPHICS/{statement.igeom[i]}", f"GRAPHICS/{statement.jgeom[j]}"
                label = statement.label()
                found.append(FacetedTouch(label, first, second, triangles, sagitta, float(np.median(sunk))))
    return sorted(found, key=lambda touch: -touch.sagitta / touch.depth)


def facets_remark(touches: list[FacetedTouch], length: float, unit: str) -> str:
    """Return one sentence on all of them, lengths in the deck's unit, which is ``length`` m and called ``unit``."""
    worst, others = touches[0], touches[1:]
    also = ""
    if others:
        named = list(dict.fromkeys(f"{t.first} and {t.second} of {t.contact}" for t in others))
        shown = ", ".join(named[:3]) + (f" and {len(named) - 3} more" if len(named) > 3 else "")
        also = f"; so are {shown}"
    return (
        f"{worst.contact}: {worst.first} and {worst.second} are cut into {worst.triangles} triangles, which leave the "
        f"round surface by up to {worst.sagitta / length:.3g} {unit}, while they sink in by {worst.depth / length:.3g}"
        f"{also}. What rolls on facets is lifted over each edge and loses speed to DAMPING, which nothing else tells; "
        "let it roll on solids whose contact is exact (PLANE, BOX, CYLINDER, FRUSTUM, ELLIPSOID for what is round), "
        "give a finer mesh, or less DAMPING, and compare"
    )
