"""Messages about a deck, each with its file and line."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

ERROR = "error"
UNSUPPORTED = "unsupported"
IGNORED = "ignored"
WARNING = "warning"

_LABELLED = re.compile(r"([A-Z_]+)/(\d+)(?!\d)(.*)", re.DOTALL)
SHOWN_LABELS = 4
SHOWN = 20
"""Messages a DeckError prints; the others are counted."""

LEAVE_OUT = (
    "--skip-unsupported (in Python allow_unsupported=True) leaves out what is unsupported and what reads it, with a "
    "remark on each"
)


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


def folded(diagnostics: Sequence[Diagnostic]) -> list[Diagnostic]:
    """Return remarks with those of one that say the same of several statements of a kind; errors stay as they are."""
    groups: dict[Any, list[tuple[str, Diagnostic]]] = {}
    for k, d in enumerate(diagnostics):
        match = _LABELLED.match(d.message)
        if match is None or d.severity == ERROR:
            groups[k] = [("", d)]
        else:
            key = (d.severity, d.file, match.group(1), match.group(3))
            groups.setdefault(key, []).append((f"{match.group(1)}/{match.group(2)}", d))
    found = []
    for key, group in groups.items():
        first = group[0][1]
        if len(group) > 1:
            first = Diagnostic(
                first.severity, f"{labels_of([label for label, _ in group])}{key[3]}", first.file, first.line
            )
        found.append(first)
    return found


def skipped_labels(diagnostics: Sequence[Diagnostic]) -> list[str]:
    """Return the names of the statements that are not supported, or not wholly, in the order of the remarks."""
    matches = (_LABELLED.match(d.message) for d in diagnostics if d.severity == UNSUPPORTED)
    return list(dict.fromkeys(f"{m.group(1)}/{m.group(2)}" for m in matches if m is not None))


def labels_of(labels: Sequence[str]) -> str:
    """Return the names of statements, the first few of many."""
    shown = ", ".join(labels[:SHOWN_LABELS])
    more = len(labels) - SHOWN_LABELS
    return f"{shown} and {more} more" if more > 0 else shown


class DeckError(ValueError):
    """A deck or script that cannot be read or run.

    Attributes
    ----------
    diagnostics : tuple of Diagnostic
        Every place that is wrong.
    result : AdamsResult or None
        The analyses of a script that were carried out before, when it was being run.
    kept : Segment or None
        What the analysis in which a routine of the user failed computed until then.
    """

    result: Any = None
    kept: Any = None

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        shown = folded(self.diagnostics)
        lines = [str(d) for d in shown[:SHOWN]]
        if len(shown) > SHOWN:
            lines.append(f"... and {len(shown) - SHOWN} more")
        if any(d.severity == UNSUPPORTED for d in shown):
            lines[-1:] = [f"{lines[-1]} ({LEAVE_OUT})"] if len(lines) == 1 else [lines[-1], LEAVE_OUT]
        super().__init__("\n".join(lines))
