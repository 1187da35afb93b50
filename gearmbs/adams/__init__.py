"""ADAMS decks in and out: .adm and .acf read, .res, .req and .msg written."""

from gearmbs.adams.commands import Script, parse_script, read_script
from gearmbs.adams.deck import Deck, parse_deck, read_deck
from gearmbs.adams.errors import DeckError, Diagnostic

__all__ = ["Deck", "DeckError", "Diagnostic", "Script", "parse_deck", "parse_script", "read_deck", "read_script"]
