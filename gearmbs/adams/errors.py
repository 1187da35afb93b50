"""Messages about a deck, each with its file and line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

ERROR = "error"
UNSUPPORTED = "unsupported"
IGNORED = "ignored"
WARNING = "warning"

SHOWN = 20
"""Messages a DeckError prints; the others are counted."""


@dataclass(frozen=True)
class Diagnostic:
    """One remark about one place of a deck.

    Attributes
    ----------
    severity : str
        "error", "unsupported" (changes the physics, so the model is not run without it), "ignored" (harmless
        here, such as graphics) or "warning".
    message : str
    file : str
        "" for what is in no file.
    line : int
        Counted from 1; 0 for the whole file.
    """

    severity: str
    message: str
    file: str
    line: int

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}: " if self.line else f"{self.file}: " if self.file else ""
        return f"{place}{self.severity}: {self.message}"


class DeckError(ValueError):
    """A deck or script that cannot be read or run.

    Attributes
    ----------
    diagnostics : tuple of Diagnostic
        Every place that is wrong.
    result : AdamsResult or None
        The analyses of a script that were carried out before, when it was being run.
    """

    result: Any = None

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        lines = [str(d) for d in self.diagnostics[:SHOWN]]
        if len(self.diagnostics) > SHOWN:
            lines.append(f"... and {len(self.diagnostics) - SHOWN} more")
        super().__init__("\n".join(lines))
