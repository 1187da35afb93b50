"""Remarks on defaults of ADAMS that depend on the deck's units."""

from __future__ import annotations

from gearmbs.adams.errors import WARNING, Diagnostic, labels_of
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck

VISIBLE = 1e-3
"""Displacement of a joint that sticks, m, from which on a default is remarked."""


def remark_defaults(deck: Deck) -> None:
    """Remark on FRICTION whose stiction yields visibly, since MAX_STICTION_DEFORMATION is a number of length units."""
    found = [
        f
        for f in deck.of(st.Friction).values()
        if "deformation" not in f.given and f.effect != "SLIDING" and f.deformation * deck.units.length >= VISIBLE
    ]
    if found:
        yields = f"{found[0].deformation:g} units of length, here {1e3 * found[0].deformation * deck.units.length:g} mm"
        message = (
            f"{labels_of([f.label() for f in found])}: MAX_STICTION_DEFORMATION is not given; its default is {yields}, "
            "by which surfaces that stick still yield until the friction is whole: give a smaller one"
        )
        deck.diagnostics.append(Diagnostic(WARNING, message, deck.file, found[0].line))
