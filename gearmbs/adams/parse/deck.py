"""A deck: its typed statements, and remarks on those that were not understood."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

from gearmbs.adams.errors import UNSUPPORTED, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.source import RawStatement
from gearmbs.adams.parse.units import deck_units
from gearmbs.mechanism.language.syntax import Units

if TYPE_CHECKING:
    from gearmbs.flexible import ModalNeutralFile
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.language.user_functions import UserFunction

S = TypeVar("S", bound=st.Statement)


@dataclass
class Deck:
    """The content of an .adm file.

    Attributes
    ----------
    title : str
    file : str
    items : dict
        Statement class -> id -> statement, in the order of the deck.
    diagnostics : list of Diagnostic
        Warnings, ignored and unsupported statements; errors raise.
    unread : dict
        (name, id) -> text of statements that are read only as far as others name them.
    functions : dict
        Functions that routines of the user have become, by name.
    modal_files : dict
        Modal neutral files that have been read, by path.
    left_out : set of (statement name, id)
        What was taken out since it is not supported, or reads what is not.
    """

    title: str = ""
    file: str = "<deck>"
    items: dict[type[st.Statement], dict[int, Any]] = field(default_factory=dict)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    unread: dict[tuple[str, int], RawStatement] = field(default_factory=dict)
    functions: dict[str, UserFunction] = field(default_factory=dict)
    modal_files: dict[str, ModalNeutralFile] = field(default_factory=dict)
    left_out: set[tuple[str, int]] = field(default_factory=set)

    def of(self, kind: type[S]) -> dict[int, S]:
        """Return the statements of one class by id."""
        return self.items.get(kind, {})

    def each(self, base: type[S]) -> Iterator[S]:
        """Yield the statements of all classes that have a base in common, class by class in the order of the table."""
        for cls in st.STATEMENTS.values():
            if issubclass(cls, base):
                yield from self.of(cls).values()

    def only(self, kind: type[S]) -> S | None:
        """Return the single statement of a class without id, or None."""
        return next(iter(self.of(kind).values()), None)

    def __iter__(self) -> Iterator[st.Statement]:
        return iter([statement for group in self.items.values() for statement in group.values()])

    @cached_property
    def units(self) -> Units:
        """SI values of the deck's units."""
        return deck_units(self.only(st.Units))

    @property
    def unsupported(self) -> list[Diagnostic]:
        """Statements and arguments that change the physics and are not modelled."""
        return [d for d in self.diagnostics if d.severity == UNSUPPORTED]

    def ground(self) -> st.Part:
        """Return the ground part."""
        return next(p for p in self.of(st.Part).values() if p.ground)

    def summary(self) -> str:
        """Return a table of what the deck holds and what was left out."""
        lines = [f"{self.title or '(no title)'}  [{self.file}]"]
        lines += [f"  {kind.keyword:14s} {len(group)}" for kind, group in self.items.items()]
        lines += [f"  {d}" for d in self.diagnostics]
        return "\n".join(lines)

    def to_mechanism(
        self, allow_unsupported: bool = False, routines: Mapping[str, Callable] | None = None
    ) -> Mechanism:
        """Build the mechanism as `gearmbs.adams.build_mechanism` does: ``read_deck(path).to_mechanism()``."""
        from gearmbs.adams import build_mechanism

        return build_mechanism(self, allow_unsupported, routines)
