"""What all statements of a deck have."""

from __future__ import annotations

from dataclasses import dataclass, field

Vector = tuple[float, ...]


@dataclass(frozen=True)
class Statement:
    """What all statements have: id, place in the source, name.

    Attributes
    ----------
    id : int
        0 for statements without one.
    file : str
    line : int
    name : str or None
        From an ``adams_view_name`` comment.
    given : mapping of str to int
        Source line of every argument that was given.
    """

    id: int = 0
    file: str = ""
    line: int = 0
    name: str | None = None
    given: dict[str, int] = field(default_factory=dict, compare=False)

    def label(self) -> str:
        """Return the statement as a modeller names it, for instance JOINT/3."""
        keyword = keyword_of(type(self))
        return f"{keyword}/{self.id}" if self.id else keyword


def keyword_of(cls: type[Statement]) -> str:
    """Return the keyword a class of statements is read from, for instance JOINT."""
    from gearmbs.adams.statements import KEYWORD_OF

    return KEYWORD_OF[cls]
