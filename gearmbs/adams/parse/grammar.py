"""What a statement and its arguments may be, and how a statement's text becomes their values.

A statement class is a dataclass whose fields carry their keyword, their kind and what else is known of them (``arg``);
its own options say what the statement is (`Statement`). The reader, the checks, the messages and the tables of the
documentation follow from both. Keywords may be shortened as long as they stay unambiguous among the statement's own.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any, ClassVar

from gearmbs.mechanism.language.syntax import ExpressionError, parse
from gearmbs.wording import did_you_mean

CONTINUED = "\x01"

REALS, REAL, INT, ID, IDS, FLAG, CHOICE, EXPRESSION, TEXT, WORD, WORDS, STRINGS, TABLE, PATH, LINE = range(15)
"""Kinds of arguments; a PATH is a text in which a backslash is part of the name, a LINE all of the statement's rest."""

_KEY = re.compile(r"\s*([A-Za-z][A-Za-z0-9_]*)\s*(=)?")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d+)?\Z")
_SEPARATORS = "," + CONTINUED
LARGEST = 1e100
"""Number of an argument: squares and cubes of it can still be computed."""


@dataclass(frozen=True)
class RawStatement:
    """The text of one statement and where its parts stand.

    Attributes
    ----------
    text : str
        Joined lines; continuation commas are ``CONTINUED``.
    starts : tuple of int
        Offset in ``text`` where each source line begins.
    lines : tuple of int
        The source line numbers.
    view_name : str or None
        Name from an ``adams_view_name`` comment in front.
    pair : str
        What comments in front say of a gear pair.
    """

    text: str
    starts: tuple[int, ...]
    lines: tuple[int, ...]
    view_name: str | None = None
    pair: str = ""

    @property
    def line(self) -> int:
        """First source line."""
        return self.lines[0]

    def line_at(self, offset: int) -> int:
        """Return the source line of a place in the text."""
        return self.lines[max(0, bisect_right(self.starts, offset) - 1)]


class StatementError(ValueError):
    """A malformed statement; ``offset`` is the place in its text."""

    def __init__(self, message: str, offset: int = 0) -> None:
        super().__init__(message)
        self.offset = offset


@dataclass(frozen=True)
class Spec:
    """How one argument is written.

    Attributes
    ----------
    keyword : str
    kind : int
    count : tuple of int
        Least and most number of values, for lists.
    choices : tuple of str
        Conditional keywords that set this field (``CHOICE``), or the allowed words.
    dimension : str
        Unit of the value, a key of the expression dimensions.
    aliases : tuple of str
        Short forms that ADAMS accepts although they are ambiguous prefixes.
    required, positive, unsigned : bool
        Whether a statement needs it, and whether its value must be positive, or at least not negative.
    start : bool
        Whether it says how the first analysis starts.
    idle : str
        Why it changes nothing where it is given, "" if it has an effect.
    instead : str or None
        What to write instead of an argument that is refused, "" if there is nothing; None of one that is read.
    """

    keyword: str
    kind: int
    count: tuple[int, int] = (1, 1)
    choices: tuple[str, ...] = ()
    dimension: str = "number"
    aliases: tuple[str, ...] = ()
    required: bool = False
    positive: bool = False
    unsigned: bool = False
    start: bool = False
    idle: str = ""
    instead: str | None = None


def arg(
    keyword: str,
    kind: int,
    default: Any = None,
    *,
    count: int | tuple[int, int] = 1,
    choices: str = "",
    dimension: str = "number",
    aliases: str = "",
    **facts: Any,
) -> Any:
    """Return a dataclass field for a keyword argument; for further facts see `Spec`."""
    counts = (count, count) if isinstance(count, int) else count
    spec = Spec(keyword, kind, counts, tuple(choices.split()), dimension, tuple(aliases.split()), **facts)
    return field(default=default, kw_only=True, metadata={"spec": spec})


def _specs(cls: Any) -> dict[str, Spec]:
    return {f.name: f.metadata["spec"] for f in fields(cls) if "spec" in f.metadata}


specs_of: Callable[[type], dict[str, Spec]] = cache(_specs)
"""Return field name -> Spec of a statement class."""


@dataclass(frozen=True)
class Statement:
    """What all statements have: id, place in the source, name. A subclass is a row of the table of statements.

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
        A gear pair in comments in front, see `gearmbs.adams.write.contacts`.
    """

    table: ClassVar[dict[str, type[Statement]]] = {}
    """All statements that are read, by name."""
    kinds: ClassVar[dict[type[Statement], str]] = {}
    """Kinds under which functions such as JOINT and SFORCE ask for an element's force."""
    keyword: ClassVar[str] = ""
    entity: ClassVar[str] = ""
    subroutine: ClassVar[str] = ""
    results: ClassVar[tuple[str, ...]] = ()
    read_by: ClassVar[tuple[str, ...]] = ()
    user: ClassVar[str] = ""
    once: ClassVar[bool] = False
    changeable: ClassVar[bool] = True
    moves: ClassVar[bool] = True
    switch: ClassVar[str] = ""

    id: int = 0
    file: str = ""
    line: int = 0
    name: str | None = None
    given: dict[str, int] = field(default_factory=dict, compare=False)
    pair: str = ""

    def __init_subclass__(
        cls,
        *,
        keyword: str = "",
        entity: str = "",
        subroutine: str = "",
        results: str = "function",
        read_by: str = "",
        user: str = "",
        once: bool = False,
        changeable: bool = True,
        moves: bool = True,
        switch: str = "",
        read: bool = True,
    ) -> None:
        """Enter a statement into the table.

        Parameters
        ----------
        keyword : str
            Its name in a deck, where it is not that of the class in capitals.
        entity : str
            What results files call it, if it transmits a force: expressions may ask for this force then.
        subroutine, results : str
            What ADAMS calls the routine that USER(...) stands for, and the arguments its results go to, with blanks.
        read_by : str
            Functions of expressions, with blanks, that read it by its id; not those of an element's force.
        user : str
            What names it, as in "a CONTACT", of a statement that is read only if it is named.
        once : bool
            Whether it stands once and has no id.
        changeable : bool
            Whether a command may change it.
        moves : bool
            Whether it has part in the motion, instead of being merely read by others.
        switch : {"", "on", "acts"}
            Whether a script switches it: "acts" if it does so here, as all that transmits a force; "on" if it stays on.
        read : bool
            False for what several statements share.
        """
        super().__init_subclass__()
        cls.keyword = keyword or cls.__name__.upper()
        cls.entity, cls.subroutine, cls.user = entity, subroutine, user
        cls.results, cls.read_by = tuple(results.split()), tuple(read_by.split())
        cls.once, cls.changeable, cls.moves = once, changeable, moves
        cls.switch = switch or ("acts" if entity else "")
        if read:
            Statement.table[cls.keyword] = cls
        if entity:
            Statement.kinds[cls] = cls.keyword.lower()

    def label(self) -> str:
        """Return the statement as a modeller names it, for instance JOINT/3."""
        return f"{self.keyword}/{self.id}" if self.id else self.keyword


class Grammar:
    """The keywords of one statement class."""

    def __init__(self, cls: type) -> None:
        self.words: dict[str, tuple[str, Spec, str | None]] = {}
        self.exact: dict[str, tuple[str, Spec, str | None]] = {}
        for name, spec in specs_of(cls).items():
            if spec.kind == CHOICE:
                for choice in spec.choices:
                    self.words[choice] = (name, spec, choice)
            else:
                self.words[spec.keyword] = (name, spec, None)
            for alias in spec.aliases:
                target, _, choice = alias.partition(":")
                self.exact[target] = (name, spec, choice or None)

    def find(self, word: str) -> tuple[str, Spec, str | None] | None:
        """Return (field, spec, choice) of a full or shortened keyword, None when there is none."""
        upper = word.upper()
        if upper in self.exact:
            return self.exact[upper]
        if upper in self.words:
            return self.words[upper]
        found = [w for w in self.words if w.startswith(upper)]
        if len(found) == 1:
            return self.words[found[0]]
        return None

    def explain(self, word: str) -> str:
        """Return why a keyword was not found."""
        found = [w for w in self.words if w.startswith(word.upper())]
        if found:
            return f"{word.upper()} is ambiguous: it could be {', '.join(found)}"
        return f"unknown argument {word.upper()}; it is not one of {', '.join(self.words)}"

    def mistyped(self, word: str) -> str | None:
        """Return that a word is no argument, and which it may have been meant to be; None if it resembles none."""
        meant = did_you_mean(word.upper()[:40], self.words) if word[:1].isalpha() else ""
        return f"unknown argument {word.upper()[:40]}; {meant}" if meant else None


_GRAMMARS: dict[type, Grammar] = {}


def grammar_of(cls: type) -> Grammar:
    """Return the keywords of a class of statements or commands."""
    if cls not in _GRAMMARS:
        _GRAMMARS[cls] = Grammar(cls)
    return _GRAMMARS[cls]


class ArgumentReader:
    """Reads the arguments of one statement."""

    def __init__(self, raw: RawStatement, start: int, grammar: Grammar) -> None:
        self.text = raw.text
        self.at = start
        self.grammar = grammar
        self.values: dict[str, Any] = {}
        self.lines: dict[str, int] = {}
        self._raw = raw

    def read(self) -> dict[str, Any]:
        """Return field values.

        Raises
        ------
        StatementError
        """
        n = len(self.text)
        while True:
            while self.at < n and self.text[self.at] in _SEPARATORS + " \\":
                self.at += 1
            if self.at >= n:
                return self.values
            start = self.at
            match = _KEY.match(self.text, start)
            if match is None:
                piece = self.text[start:].split(",")[0].replace(CONTINUED, " ").strip()
                raise StatementError(f"expected an argument, found {piece[:40]!r}", start)
            found = self.grammar.find(match.group(1))
            if found is None:
                raise StatementError(self.grammar.explain(match.group(1)), start)
            name, spec, choice = found
            self.at = match.end()
            if spec.kind in (FLAG, CHOICE):
                self._flag(match, name, spec, choice, start)
                continue
            if match.group(2) is None:
                values = " or ".join(spec.choices) or "..."
                raise StatementError(f"{spec.keyword} needs a value: {spec.keyword} = {values}", start)
            value_at = self.at
            raw_value = self._value(spec)
            self._store(name, spec, raw_value, start, value_at)

    def _flag(self, match: re.Match[str], name: str, spec: Spec, choice: str | None, start: int) -> None:
        if match.group(2) is not None:
            raise StatementError(f"{choice or spec.keyword} takes no value", start)
        rest = self.text[self.at :].lstrip()
        if rest and rest[0] not in _SEPARATORS + "\\":
            raise StatementError(f"expected a comma after {choice or spec.keyword}, found {rest[:20]!r}", self.at)
        if spec.kind == CHOICE and self.values.get(name, choice) != choice:
            raise StatementError(f"both {self.values[name]} and {choice} are given; only one is allowed", start)
        self.values[name] = choice if spec.kind == CHOICE else True
        self.lines[name] = self._raw.line_at(start)

    def _value(self, spec: Spec) -> str:
        """Return the text of a value: up to the next argument."""
        text, n = self.text, len(self.text)
        start, depth = self.at, 0
        quote = ""
        at = start
        if spec.kind == LINE:
            self.at = n
            return text[start:]
        nested = spec.kind not in (TEXT, STRINGS, PATH)
        while at < n:
            ch = text[at]
            if quote:
                quote = "" if ch == quote else quote
            elif ch in "\"'" and spec.kind in (STRINGS, TEXT, PATH, WORDS) and text.find(ch, at + 1) > 0:
                quote = ch
            elif nested and ch == "(":
                depth += 1
            elif nested and ch == ")":
                depth -= 1
            elif depth <= 0 and ch == "\\" and spec.kind != PATH:
                if spec.kind != TEXT or self._argument_follows(at + 1):
                    break
            elif depth <= 0 and ch in _SEPARATORS and self._argument_follows(at + 1):
                break
            at += 1
        self.at = at
        return text[start:at]

    def _argument_follows(self, at: int) -> bool:
        """Whether there is a known keyword at ``at`` (with its = sign, or alone for a flag)."""
        while at < len(self.text) and self.text[at] in _SEPARATORS + " ":
            at += 1
        if at >= len(self.text):
            return True
        match = _KEY.match(self.text, at)
        if match is None:
            return False
        if match.group(2) is not None:
            return True
        found = self.grammar.find(match.group(1))
        if found is None or found[1].kind not in (FLAG, CHOICE):
            return False
        rest = self.text[match.end() :].lstrip()
        return not rest or rest[0] in _SEPARATORS + "\\"

    def _store(self, name: str, spec: Spec, raw: str, start: int, value_at: int) -> None:
        if spec.kind != LINE and not raw.strip(" " + _SEPARATORS):
            raise StatementError(f"{spec.keyword} has no value", start)
        try:
            value = convert(spec, raw)
        except ExpressionError as error:
            raise StatementError(f"{spec.keyword}: {error}", value_at) from error
        except StatementError as error:
            # an argument without its value is taken for one more value of the argument before it
            more = items(raw)[1:] if spec.kind in (REAL, INT, ID, WORD) else []
            bare = next((found[1].keyword for part in more if (found := self.grammar.find(part))), None)
            if bare is not None:
                raise StatementError(f"{bare} needs a value: {bare} = ...", value_at) from error
            unknown = next((why for part in more if (why := self.grammar.mistyped(part))), None)
            if unknown is not None:
                raise StatementError(unknown, value_at) from error
            raise StatementError(f"{spec.keyword}: {error}", value_at) from error
        if spec.kind == TABLE:
            self.values[name] = (*self.values.get(name, ()), value)
        elif name in self.values:
            raise StatementError(f"{spec.keyword} is given twice", start)
        else:
            self.values[name] = value
        self.lines[name] = self._raw.line_at(value_at)


def items(raw: str) -> list[str]:
    """Split a list value at its commas."""
    raw = re.sub(rf",\s*{CONTINUED}", ",", raw)
    parts = [p.strip() for p in re.split(f"[{_SEPARATORS}]", raw)]
    while parts and not parts[-1]:
        parts.pop()
    while parts and not parts[0]:
        parts.pop(0)
    return parts


def real(text: str) -> float:
    """Read a number: FORTRAN exponents, and a final D for degrees."""
    word = re.sub(r"^([+-])\s+", r"\1", text.strip())
    degree = word[-1:] in ("D", "d")
    body = word[:-1] if degree else word
    if not _NUMBER.match(body):
        raise StatementError(f"{text.strip()[:40]!r} is not a number")
    value = float(re.sub("[dD]", "E", body))
    if not math.isfinite(value) or abs(value) > LARGEST:
        raise StatementError(f"{text.strip()[:40]!r} is too large")
    return value * math.pi / 180.0 if degree else value


def integer(text: str) -> int:
    """Read an integer; leading zeros do not matter."""
    word = text.strip()
    if not re.fullmatch(r"[+-]?\d{1,18}", word):
        raise StatementError(f"{word[:40]!r} is not an integer")
    return int(word)


def joined_expression(raw: str) -> str:
    """Undo line continuations in an expression.

    Inside brackets a continuation comma stands for a comma only where two operands would otherwise
    meet; everywhere else it just marks the new line.
    """
    out: list[str] = []
    depth = 0
    for line in raw.split(CONTINUED):
        line = line.strip()
        if not line:
            continue
        if out:
            meets = re.match(r"[A-Za-z0-9_.)]", out[-1][-1]) and re.match(r"[A-Za-z0-9_.(]", line)
            out.append(", " if meets and depth > 0 else " ")
        out.append(line)
        depth += line.count("(") - line.count(")")
    return " ".join("".join(out).split())


def _unquoted(text: str) -> str:
    text = text.strip()
    if len(text) >= 2 and text[0] == text[-1] and text[0] in "\"'":
        return text[1:-1]
    return text


def _outside_quotes(text: str) -> list[str]:
    """Split at colons and commas that stand outside quotes."""
    parts = [""]
    quote = ""
    for ch in text:
        if not quote and ch in ":,":
            parts.append("")
            continue
        if ch in "\"'":
            quote = "" if ch == quote else (quote or ch)
        parts[-1] += ch
    return parts


def convert(spec: Spec, raw: str) -> Any:
    """Turn the text of a value into Python.

    Raises
    ------
    StatementError, ExpressionError
    """
    kind = spec.kind
    if kind == EXPRESSION:
        text = joined_expression(raw)
        parse(text)
        return text
    if kind in (TEXT, PATH, LINE):
        return _unquoted(" ".join(raw.replace(CONTINUED, ",").split()))
    if kind == STRINGS:
        return tuple(_unquoted(p) for p in _outside_quotes(" ".join(raw.replace(CONTINUED, ",").split())))
    parts = items(raw)
    if kind in (REALS, TABLE):
        values = tuple(real(p) for p in parts)
        _check_count(spec, len(values))
        return values
    if kind == IDS:
        ids = tuple(integer(p) for p in parts)
        _check_count(spec, len(ids))
        return ids
    if kind == WORDS:
        words = tuple(w for p in parts for w in re.split(r"\s*:\s*", p) if w)
        return tuple(_word(spec, w) for w in words)
    if len(parts) != 1:
        stray = next((p for p in parts[1:] if re.match(r"[A-Za-z]", p)), None)
        what = f"got {len(parts)}" if stray is None else f"and {stray[:40]} behind it is no argument of this statement"
        raise StatementError(f"one value is expected, {what}")
    if kind == REAL:
        return real(parts[0])
    if kind in (INT, ID):
        value = integer(parts[0])
        if kind == ID and value < 0:
            raise StatementError(f"{value} is not an id; ids are positive")
        return value
    return _word(spec, parts[0])


def _check_count(spec: Spec, n: int) -> None:
    low, high = spec.count
    if not low <= n <= high:
        wanted = str(low) if low == high else f"{low} to {high}"
        raise StatementError(f"{wanted} values are expected, got {n}")


def _word(spec: Spec, text: str) -> str:
    word = _unquoted(text).upper()
    if not spec.choices or word in spec.choices:
        return word
    found = [c for c in spec.choices if word and c.startswith(word)]
    if len(found) == 1:
        return found[0]
    reason = "is ambiguous" if found else "is not known"
    raise StatementError(f"{word[:40]!r} {reason}; choose one of {', '.join(found or spec.choices)}")
