"""Read a model of ADAMS, whatever it is written in: a deck of the solver or a command file of View."""

from __future__ import annotations

from pathlib import Path

from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.reader import is_view, parse_deck, read_file
from gearmbs.adams.view.reader import ViewModel, parse_view
from gearmbs.progress import waiting


@waiting("reading the deck")
def read_deck(path: str | Path) -> Deck:
    """Read an .adm file, or the model of a command file of View (.cmd) as a deck; see `gearmbs.adams.read_view`.

    Raises
    ------
    DeckError
        Naming file and line of everything that is wrong.
    """
    found = read_model(Path(path))
    return found.deck if isinstance(found, ViewModel) else found


def read_model(path: Path) -> Deck | ViewModel:
    """Read a deck, or a command file of View with its simulations.

    Raises
    ------
    DeckError
    """
    text = read_file(path)
    if is_view(text):
        return parse_view(text, str(path), folder=path.parent)
    return parse_deck(text, str(path))
