"""Which objects of a model are handed to the solver.

An object is off if it is switched off itself, if what it belongs to is, if a group that it is in is, or if it cannot
act without something that is off: an element without one of its markers, parts, joints or geometries.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item
from gearmbs.adams.view.values import Values

NEEDED = (
    "i_marker_name", "j_marker_name", "i_part_name", "j_part_name", "joint_name", "j_floating_marker_name",
    "ref_marker_name", "common_velocity_marker", "flex_body", "curve_name",
)  # fmt: skip
"""Arguments of elements that name what these cannot act without."""
TOUCHING = ("i_geometry_name", "j_geometry_name")
"""Arguments that name several solids, of which a contact needs one each."""


def needed(values: Values, item: Item) -> Iterator[list[Item]]:
    """Yield what an element cannot act without: of each list one at least must act."""
    read = set(item.used)
    for key in (*NEEDED, *TOUCHING):
        try:
            found = values.refs(item, key)
        except ViewError:
            # said where the statement is made
            continue
        if key in TOUCHING:
            yield found
        else:
            yield from ([one] for one in found)
    item.used = read


class Activity:
    """Says what is off, and why.

    Parameters
    ----------
    values : Values
    elements : collection of str
        Kinds of objects that go with what they need.

    Attributes
    ----------
    doubts : list of (Item, str)
        Groups of which it is not known what they do to one of their objects, and why.
    """

    def __init__(self, values: Values, elements: Collection[str]) -> None:
        self.values, self.db, self.elements = values, values.db, elements
        self.doubts: list[tuple[Item, str]] = []
        self._groups: dict[int, Item] = {}
        self._known: dict[int, Item | None] = {}
        self._on: dict[int, Item] = {}
        off: list[Item] = []
        on: list[Item] = []
        for group in self.db.of("group"):
            switched_off = self._is_off(group)
            if switched_off is not None:
                (off if switched_off else on).append(group)
        for group in on:
            self._read_on(group)
        for group in off:
            self._read_off(group)

    def cause(self, item: Item) -> Item | None:
        """Return what an object is off by, itself perhaps; None if it is active."""
        if id(item) not in self._known:
            # what needs itself in a circle is no reason
            self._known[id(item)] = None
            self._known[id(item)] = self._cause(item)
        return self._known[id(item)]

    def _cause(self, item: Item) -> Item | None:
        if not item.active:
            return item
        if id(item) in self._groups:
            return self._groups[id(item)]
        owner = self.db.items.get(item.parent.lower())
        if owner is not None and owner is not item and (above := self.cause(owner)) is not None:
            return above
        if item.kind in self.elements:
            for several in needed(self.values, item):
                causes = [self.cause(one) for one in several]
                if causes and all(one is not None for one in causes):
                    return causes[0]
        return None

    def _is_off(self, group: Item) -> bool | None:
        """Return whether a group is off, None if that cannot be evaluated."""
        if "expr_active" not in group.fields:
            return not group.active
        try:
            return not self.values.number(group, "expr_active")
        except ViewError as error:
            self.doubts.append((group, str(error)))
            return None

    # A group that is on leaves each of its objects as it is. Where an object, or another group of it, was switched to
    # the opposite, and the later of the two commands switched on, it is not known which of them View goes by.

    def _read_on(self, group: Item) -> None:
        for member in self._members(group, set()):
            if not isinstance(member, Item) or not group.told:
                continue
            if not member.active and 0 < member.told < group.told:
                why = f"it was switched on after {member.path} was switched off"
                self.doubts.append((group, f"{why}; switch {member.name} itself by its attributes, after the group"))
            before = self._on.get(id(member))
            if before is None or before.told < group.told:
                self._on[id(member)] = group

    def _read_off(self, group: Item) -> None:
        for member in self._members(group, set()):
            if not isinstance(member, Item):
                self.doubts.append((group, f"objects_in_group: there is no {member[:80]} to switch off"))
                continue
            if member.active and member.told > group.told:
                why = f"{member.path} was switched on after its group was switched off"
                self.doubts.append((group, f"{why}; take it out of the group, or switch the group on"))
            other = self._on.get(id(member))
            if other is not None and other.told > group.told:
                why = f"{member.path} is in {other.path}, too, which was switched on after this group was switched off"
                self.doubts.append((group, f"{why}; take it out of one of them"))
            self._groups[id(member)] = group

    def _members(self, group: Item, seen: set[int]) -> Iterator[Item | str]:
        """Yield the objects of a group, and of groups within it; of what is not there the name."""
        if id(group) in seen or "objects_in_group" not in group.fields:
            return
        seen.add(id(group))
        for value in self.values.values(group, "objects_in_group"):
            one = value if isinstance(value, Item) else self.db.find(str(value))
            if one is not None and one.kind == "group":
                yield from self._members(one, seen)
            elif one is not None or value != "":
                yield one or str(value)
