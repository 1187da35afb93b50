"""A gear contact as the contact of two solids: meshes for other programs, the very pair in comments for this one."""

from __future__ import annotations

from typing import Any

from gearmbs.adams.pairs import friction_of, normal_law_of, pair_comments
from gearmbs.adams.write.contacts import external, friction_law, normal_law, touch
from gearmbs.adams.write.context import WriterContext
from gearmbs.dae.errors import ModelError
from gearmbs.gears import GearPair
from gearmbs.gears.contact_element import GearContact


def gear_solid_statements(writer: WriterContext, name: str, element: GearContact) -> None:
    """Write both wheels as meshes beside the deck, and a CONTACT between them with the pair in comments before it.

    Raises
    ------
    ModelError
        For what is no `GearPair`, a law without a form in ADAMS, or a deck that is no file.
    """
    from gearmbs.view import pair_solids

    pair: Any = element.pair
    if not isinstance(pair, GearPair):
        raise ModelError(f"gear contact '{name}': only a GearPair is written as solids, not a {type(pair).__name__}")
    try:
        comments = pair_comments(pair)
    except ValueError as error:
        raise ModelError(f"gear contact '{name}': {error}") from error
    laws = [*normal_law(writer, normal_law_of(name, pair)), *friction_law(writer, friction_of(pair.friction))]
    sides = []
    for marker, solid, wheel in zip((element.i, element.j), pair_solids(pair), ("driver", "driven")):
        label = f"{name}.{wheel}"
        arguments = external(writer, label, solid.vertices, solid.triangles, writer.markers[id(marker)])
        sides.append([writer.graphics(arguments, label)])
    writer.comment(f"{name}: read by gearmbs, this is the exact contact of the pair in the next comments;")
    writer.comment("other programs let the meshes touch")
    for comment in comments:
        writer.comment(comment)
    touch(writer, name, sides, laws)
