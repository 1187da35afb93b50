"""ADAMS decks in and out: .adm and .acf read and run, .res, .req and .msg written, mechanisms written as .adm."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.adams.builders.routines import RoutineCall, load_routines
    from gearmbs.adams.errors import DeckError, Diagnostic
    from gearmbs.adams.parse.commands import Script, parse_script, read_script
    from gearmbs.adams.parse.deck import Deck
    from gearmbs.adams.parse.reader import parse_deck, read_deck
    from gearmbs.adams.results.res import ResultSet, ResultsFile, read_results
    from gearmbs.adams.results.result import AdamsResult
    from gearmbs.adams.run.deck_plant import linear_plant
    from gearmbs.adams.run.runner import run_deck
    from gearmbs.adams.support import support_table
    from gearmbs.adams.write.deck_writer import write_deck

__all__ = [
    "AdamsResult",
    "Deck",
    "DeckError",
    "Diagnostic",
    "ResultSet",
    "ResultsFile",
    "RoutineCall",
    "Script",
    "linear_plant",
    "load_routines",
    "parse_deck",
    "parse_script",
    "read_deck",
    "read_results",
    "read_script",
    "run_deck",
    "support_table",
    "write_deck",
]

late(
    __name__,
    {
        "AdamsResult": ".results.result",
        "ResultSet": ".results.res",
        "ResultsFile": ".results.res",
        "Deck": ".parse.deck",
        "DeckError": ".errors",
        "Diagnostic": ".errors",
        "RoutineCall": ".builders.routines",
        "Script": ".parse.commands",
        "linear_plant": ".run.deck_plant",
        "load_routines": ".builders.routines",
        "parse_deck": ".parse.reader",
        "parse_script": ".parse.commands",
        "read_deck": ".parse.reader",
        "read_results": ".results.res",
        "read_script": ".parse.commands",
        "run_deck": ".run.runner",
        "support_table": ".support",
        "write_deck": ".write.deck_writer",
    },
)
