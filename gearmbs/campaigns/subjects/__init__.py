"""What a campaign simulates: a case of the gear pair, a deck with parameters, or any function of parameters."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.campaigns.subjects.base import Kept, Outcome, Subject, make_subject, subject_kinds
    from gearmbs.campaigns.subjects.deck import DeckSubject
    from gearmbs.campaigns.subjects.function import FunctionSubject
    from gearmbs.campaigns.subjects.pair import PairSubject

__all__ = [
    "DeckSubject",
    "FunctionSubject",
    "Kept",
    "Outcome",
    "PairSubject",
    "Subject",
    "make_subject",
    "subject_kinds",
]

late(
    __name__,
    {
        "DeckSubject": ".deck",
        "FunctionSubject": ".function",
        "Kept": ".base",
        "Outcome": ".base",
        "PairSubject": ".pair",
        "Subject": ".base",
        "make_subject": ".base",
        "subject_kinds": ".base",
    },
)
