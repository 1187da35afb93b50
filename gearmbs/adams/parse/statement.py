"""What all statements of a deck have."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

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
    pair : str
        A gear pair in comments in front, see `gearmbs.adams.pairs`.
    """

    keyword: ClassVar[str] = ""
    """The statement's name in a deck; a class gives it where it is not the class's own, as in ``keyword="IC"``."""

    id: int = 0
    file: str = ""
    line: int = 0
    name: str | None = None
    given: dict[str, int] = field(default_factory=dict, compare=False)
    pair: str = ""

    def __init_subclass__(cls, keyword: str | None = None, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.keyword = keyword or cls.__name__.upper()

    def label(self) -> str:
        """Return the statement as a modeller names it, for instance JOINT/3."""
        return f"{self.keyword}/{self.id}" if self.id else self.keyword
