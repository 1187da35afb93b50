"""What a campaign simulates: gear pairs, drivetrains, bearings, decks with parameters, functions."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.campaigns.subjects.base import Kept, Outcome, Subject, make_subject, subject_kinds
    from gearmbs.campaigns.subjects.bearing import BearingSubject
    from gearmbs.campaigns.subjects.deck import DeckSubject
    from gearmbs.campaigns.subjects.drivetrain import DrivetrainSubject, PlanetarySubject
    from gearmbs.campaigns.subjects.function import FunctionSubject
    from gearmbs.campaigns.subjects.pair import PairSubject

__all__ = [
    "BearingSubject",
    "DeckSubject",
    "DrivetrainSubject",
    "FunctionSubject",
    "Kept",
    "Outcome",
    "PairSubject",
    "PlanetarySubject",
    "Subject",
    "make_subject",
    "subject_kinds",
]

late(
    __name__,
    {
        "BearingSubject": ".bearing",
        "DeckSubject": ".deck",
        "DrivetrainSubject": ".drivetrain",
        "FunctionSubject": ".function",
        "Kept": ".base",
        "Outcome": ".base",
        "PairSubject": ".pair",
        "PlanetarySubject": ".drivetrain",
        "Subject": ".base",
        "make_subject": ".base",
        "subject_kinds": ".base",
    },
)
