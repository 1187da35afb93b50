"""Read a deck (.adm): every statement typed and checked, with everything that was not understood named.

Lines become logical statements first: without comments, continuations joined, several on a line apart. A line that
begins with a comma continues the statement before it, and so does the line after a final ampersand. The comma of a
continuation is kept as ``CONTINUED``: between arguments it separates them, inside a function expression it only marks
the new line.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from gearmbs.adams.errors import ERROR, IGNORED, UNSUPPORTED, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.check import check, remark_defaults
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.grammar import CONTINUED, ArgumentReader, RawStatement, StatementError, grammar_of
from gearmbs.wording import did_you_mean

_HEAD = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)\s*(/)?\s*(?:(\d{1,18})(?![\dA-Za-z_.]))?\s*")

COMMANDS_OF_VIEW = re.compile(
    r"^\s*(?:model\s+cre\w*\b|part\s+(?:cre|mod)\w*\s+\w+|marker\s+(?:cre|mod)\w*\b|defaults?\s+(?:units|model|coord)\w*|"
    r"constraint\s+cre\w*\s+\w+|force\s+cre\w*\s+\w+|geometry\s+cre\w*\s+\w+|variable\s+(?:set|create)\b)",
    re.IGNORECASE | re.MULTILINE,
)
"""How lines of View's command files begin; no statement and no command of the solver does."""
_VIEW_NAME = re.compile(r"(?:adams_)?view_name\s*=\s*['\"]([^'\"]*)['\"]", re.IGNORECASE)
_PAIR = re.compile(r"\s*gearmbs pair:(.*)")
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")


def _names() -> list[str]:
    """Return the names of all statements that are known."""
    return [*sorted(st.STATEMENTS), *sorted(st.IGNORED), *sorted(st.UNSUPPORTED), "END"]


def parse_deck(text: str, file: str = "<deck>") -> Deck:
    """Parse the text of an .adm file.

    Parameters
    ----------
    text : str
    file : str
        Name for messages.

    Returns
    -------
    Deck

    Raises
    ------
    DeckError
        Naming the line of everything that is wrong.
    """
    refuse_view(text, file)
    if is_script(text):
        message = "these are commands of the solver (.acf), not a deck; give the deck (.adm) first, and them behind it"
        raise DeckError([Diagnostic(ERROR, message, file, 1)])
    first = re.split(r"\r\n|\r|\n", text, maxsplit=1)[0]
    deck = Deck(file=file)
    errors: list[Diagnostic] = []
    untitled = _is_statement(first)
    if untitled:
        deck.diagnostics.append(
            Diagnostic(WARNING, "the first line is the deck's title in ADAMS; it was read as a statement", file, 1)
        )
    else:
        deck.title = first.strip().lstrip("!").strip()
    return _read_all(deck, statements(text, skip=0 if untitled else 1), errors)


def is_view(text: str) -> bool:
    """Return whether a text is a command file of ADAMS View: its commands, and no statement of a deck."""
    found = COMMANDS_OF_VIEW.search(text)
    return found is not None and not is_deck(text)


def is_deck(text: str) -> bool:
    """Return whether a text has statements of a deck."""
    return re.search(r"^\s*(?:PART|MARKER|UNITS)\s*/", text, re.MULTILINE | re.IGNORECASE) is not None


def is_script(text: str) -> bool:
    """Return whether a text has commands for the solver, and no statement of a deck."""
    return not is_deck(text) and re.search(r"^\s*(?:SIM\w*|LINEAR)\s*/", text, re.MULTILINE | re.IGNORECASE) is not None


def refuse_view(text: str, file: str) -> None:
    """Say of a command file of View what it is.

    Raises
    ------
    DeckError
        If it is one.
    """
    if is_view(text):
        message = (
            "these are commands of ADAMS View (.cmd), not of the solver; `gearmbs adams model.cmd` runs them, "
            "`read_view` and `parse_view` read them in Python"
        )
        raise DeckError([Diagnostic(ERROR, message, file, 1)])


def deck_of(raws: Iterable[RawStatement], title: str, file: str) -> Deck:
    """Return the deck of statements that another reader has made; see `parse_deck`."""
    end = RawStatement("END", (0,), (0,))
    return _read_all(Deck(title=title, file=file), (*raws, end), [])


def _read_all(deck: Deck, raws: Iterable[RawStatement], errors: list[Diagnostic]) -> Deck:
    """Read statements into a deck, and check it.

    Raises
    ------
    DeckError
    """
    if not any(_take(deck, raw, errors) for raw in raws):
        deck.diagnostics.append(Diagnostic(WARNING, "END is missing; the deck may have been cut off", deck.file, 0))
    _read_named(deck, errors)
    if not errors:
        errors += check(deck)
    if errors:
        raise DeckError(sorted(errors, key=lambda d: d.line))
    remark_defaults(deck)
    _count_ignored(deck)
    return deck


def resolve_statement(word: str, names: Iterable[str] | None = None) -> str | None:
    """Return the full name of a possibly shortened statement, None when it is unknown or ambiguous."""
    upper = word.upper()
    names = tuple(_names() if names is None else names)
    if upper in names:
        return upper
    found = [n for n in names if n.startswith(upper)]
    return found[0] if len(found) == 1 else None


def _is_statement(line: str) -> bool:
    match = _HEAD.match(line)
    return match is not None and match.group(2) is not None and resolve_statement(match.group(1)) is not None


def _take(deck: Deck, raw: RawStatement, errors: list[Diagnostic]) -> bool:
    """Add one statement to the deck; return True at END."""

    def fail(message: str, line: int | None = None) -> None:
        errors.append(Diagnostic(ERROR, message, deck.file, raw.line if line is None else line))

    match = _HEAD.match(raw.text)
    if match is None:
        fail(f"expected a statement such as PART/1, found {raw.text.strip()[:40]!r}")
        return False
    name = resolve_statement(match.group(1))
    if name is None:
        fail(unknown_statement(match.group(1), _names()))
        return False
    if name == "END":
        return True
    if match.group(2) is None:
        fail(f"{name} needs a slash: {name}/" + ("" if name in st.WITHOUT_ID else "id"))
        return False
    number = int(match.group(3)) if match.group(3) else 0
    if name in st.UNSUPPORTED:
        message = f"{name}/{number} is not supported; it changes the motion{st.instead_of_statement(name)}"
        deck.diagnostics.append(Diagnostic(UNSUPPORTED, message, deck.file, raw.line))
        return False
    if name in st.STATEMENTS and st.STATEMENTS[name].user:
        deck.unread[name, number] = raw
        return False
    if name in st.IGNORED:
        deck.diagnostics.append(Diagnostic(IGNORED, name, deck.file, raw.line))
        return False
    try:
        statement = read_statement(name, number, raw, match.end(), deck.file)
    except StatementError as error:
        fail(f"{name}/{number or ''}: {error}", raw.line_at(error.offset))
        return False
    group = deck.items.setdefault(type(statement), {})
    if number in group:
        what = "is given twice" if name in st.WITHOUT_ID else "has an id that is in use"
        fail(f"{statement.label()} {what}; it stands first in line {group[number].line}")
        return False
    group[number] = statement
    return False


def _read_named(deck: Deck, errors: list[Diagnostic]) -> None:
    """Read the GRAPHICS that contacts name, the others are for show, and the MATERIAL of beams."""
    named: dict[str, set[int | None]] = {
        "GRAPHICS": {ref for contact in deck.of(st.Contact).values() for ref in (*contact.igeom, *contact.jgeom)},
        "MATERIAL": {part.material for part in deck.of(st.FePart).values()},
    }
    for (name, number), raw in deck.unread.items():
        if number not in named[name]:
            deck.diagnostics.append(Diagnostic(IGNORED, name, deck.file, raw.line))
            continue
        match = _HEAD.match(raw.text)
        try:
            statement = read_statement(name, number, raw, match.end() if match else 0, deck.file)
        except StatementError as error:
            line = raw.line_at(error.offset)
            errors.append(
                Diagnostic(ERROR, f"{name}/{number}, which {st.STATEMENTS[name].user} names: {error}", deck.file, line)
            )
            continue
        deck.items.setdefault(type(statement), {})[number] = statement


def read_statement(name: str, number: int, raw: RawStatement, start: int, file: str) -> st.Statement:
    """Read the arguments of one statement into its class.

    Raises
    ------
    StatementError
    """
    cls = st.STATEMENTS[name]
    if name in st.WITHOUT_ID:
        if number:
            raise StatementError(f"{name} has no id; write {name}/")
    elif not number:
        raise StatementError(f"an id is missing; write {name}/1")
    reader = ArgumentReader(raw, start, grammar_of(cls))
    values = reader.read()
    return cls(id=number, file=file, line=raw.line, name=raw.view_name, given=reader.lines, pair=raw.pair, **values)


def unknown_statement(word: str, names: Iterable[str]) -> str:
    """Return a message about a statement name that could not be resolved."""
    upper = word.upper()
    found = [n for n in names if n.startswith(upper)]
    if found:
        return f"{upper[:40]} is ambiguous: it could be {', '.join(found)}"
    return f"unknown statement {upper[:40]!r}{did_you_mean(upper[:40], names, before='; ')}"


def _count_ignored(deck: Deck) -> None:
    """Fold the ignored statements of one kind into one remark."""
    counts: dict[str, list[int]] = {}
    others = []
    for d in deck.diagnostics:
        if d.severity == IGNORED:
            counts.setdefault(d.message, []).append(d.line)
        else:
            others.append(d)
    for name, lines in counts.items():
        plural = "statement" if len(lines) == 1 else "statements"
        message = f"{len(lines)} {name} {plural} ignored: no effect on the results"
        others.append(Diagnostic(IGNORED, message, deck.file, lines[0]))
    deck.diagnostics = others


# From lines to logical statements.


def read_file(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    DeckError
        When it cannot be read.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DeckError([Diagnostic(ERROR, f"cannot be read: {error.strerror or error}", str(path), 0)]) from error
    return read_text(data)


def read_text(data: bytes) -> str:
    """Decode a file: UTF-8 where it is valid, else Latin-1."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _without_comment(line: str) -> tuple[str, str]:
    """Split a line at its comment sign."""
    at = line.find("!")
    return (line, "") if at < 0 else (line[:at], line[at + 1 :])


def statements(text: str, skip: int = 0) -> Iterator[RawStatement]:
    """Yield the statements of a deck or commands of a script.

    Parameters
    ----------
    text : str
    skip : int
        Lines to leave out at the start (the title).
    """
    pieces: list[str] = []
    starts: list[int] = []
    lines: list[int] = []
    length = 0
    name: str | None = None
    pending: str | None = None
    pair = pending_pair = ""
    open_end = False

    def flush() -> Iterator[RawStatement]:
        nonlocal pieces, starts, lines, length, name, pair
        if pieces and "".join(pieces).strip(" \t," + CONTINUED):
            yield RawStatement("".join(pieces), tuple(starts), tuple(lines), name, pair)
        pieces, starts, lines, length, name, pair = [], [], [], 0, None, ""

    def add(piece: str, number: int) -> None:
        nonlocal length
        starts.append(length)
        lines.append(number)
        pieces.append(piece)
        length += len(piece)

    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), 1):
        if number <= skip:
            continue
        body, comment = _without_comment(line)
        found = _VIEW_NAME.search(comment) if comment else None
        if found:
            pending = found.group(1)
        more = _PAIR.match(comment) if comment else None
        if more:
            pending_pair += more.group(1).strip()
        body = _CONTROL.sub(" ", body).replace("\t", " ").rstrip()
        stripped = body.lstrip()
        if not stripped:
            continue
        if stripped[0] == "," and pieces:
            add(" " + CONTINUED + stripped[1:], number)
        elif open_end and pieces:
            add(" " + stripped, number)
        else:
            yield from flush()
            name, pending, pair, pending_pair = pending, None, pending_pair, ""
            add(stripped, number)
        open_end = pieces[-1].endswith("&")
        if open_end:
            pieces[-1] = pieces[-1][:-1]
            length -= 1
        while ";" in pieces[-1]:
            head, _, rest = pieces[-1].partition(";")
            length -= len(pieces[-1]) - len(head)
            pieces[-1] = head
            yield from flush()
            if not rest.strip():
                break
            add(rest.lstrip(), number)
    yield from flush()
