"""Decks changed at random: their characters, numbers, words, lines, and statements made up from the grammar."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

from gearmbs.adams.parse import grammar as g
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import MEASURES
from gearmbs.adams.parse.grammar import grammar_of
from gearmbs.mechanism.language.lowering import BINARY, ELEMENT_FORCES, UNARY

SPICE = ["/", ",", "=", "\\", "(", ")", "!", "&", ";", "\n", "\n,", "D", "E", "90D", "1E400", "-", "0", "\x00", "\t",
         "'", '"', ":", "**", "PART/", "END", "é", "\x01", "9" * 30, "FUNCTION=", "I=", " "]  # fmt: skip
NUMBERS = ["0", "1", "-1", "2", "1E-300", "1E300", "1E12", "-1E9", "1E-9", "0.5", "180D", "99999999",
           "999999999999999999", "3.5", "-0", "1E3D", "7E-3"]  # fmt: skip
WORDS = sorted(
    {word for grammar in map(grammar_of, st.STATEMENTS.values()) for word in grammar.words}
    | {*st.STATEMENTS, *MEASURES, *ELEMENT_FORCES, *UNARY, *BINARY}
)
NUMBER = re.compile(r"(?<![A-Za-z_0-9.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+)?D?")
WORD = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")
EXPRESSIONS = [
    "TIME", "{}*DX({},{},{})", "VARVAL({})", "DIF({})", "STEP(TIME,{},0,{},{})",
    "IMPACT(DZ({},{}),VZ({}),{},{},{},{},{})",
    "SQRT(DX({}))", "LOG(TIME-{})", "1/({}-{})", "{}**{}", "CUBSPL(TIME,0,{})", "CONTACT({},0,4,{})", "JOINT({},0,2,0)",
    "ARYVAL({},{})", "ACCZ({})", "WDTX({},{})", "SENVAL({})", "CURVE({},0,1,{})", "USER({},{})", "TANH(TIME/{})",
    "MOTION({},0,3,0)", "IF(TIME-{}:{},{},{})", "POLY(TIME,{},{},{})", "SHF(TIME,{},{},{},{},{})", "INCANG({},{},{})",
    "FX({},{})", "FRICTION({},0,2,{})", "ORIENT(27,{},{},{})", "PTCV({},0,3,0)", "PSI({})", "AZ({},{})", "EXP({}*TIME)",
]  # fmt: skip


def characters(text: str, rng: random.Random) -> str:
    """Delete, insert, replace, cut, repeat."""
    at = rng.randrange(len(text) + 1)
    to = min(len(text), at + rng.randint(1, 12))
    kind = rng.randrange(5)
    if kind == 0:
        return text[:at] + text[to:]
    if kind == 1:
        return text[:at] + rng.choice(SPICE) + text[at:]
    if kind == 2:
        return text[:at] + "".join(chr(rng.randint(1, 255)) for _ in range(3)) + text[to:]
    if kind == 3:
        return text[: rng.randrange(len(text) + 1)]
    return text[:at] + text[at:to] * rng.randint(2, 4) + text[to:]


def _one_of(pattern: re.Pattern[str], text: str, rng: random.Random) -> re.Match[str] | None:
    found = list(pattern.finditer(text))
    return rng.choice(found) if found else None


def number(text: str, rng: random.Random) -> str:
    """Put another number in the place of one: a strange one, one of the deck, or a scaled one."""
    match = _one_of(NUMBER, text, rng)
    if match is None:
        return text
    kind = rng.randrange(4)
    if kind == 0:
        new = rng.choice(NUMBERS)
    elif kind == 1:
        other = _one_of(NUMBER, text, rng)
        new = other.group() if other else "1"
    elif kind == 2:
        new = ""
    else:
        new = f"{match.group().rstrip('dD')}E{rng.randint(-6, 6)}" if "." in match.group() else f"-{match.group()}"
    return text[: match.start()] + new + text[match.end() :]


def word(text: str, rng: random.Random) -> str:
    """Put another word in the place of one: of the language, of the deck, or a piece of it."""
    match = _one_of(WORD, text, rng)
    if match is None:
        return text
    other = _one_of(WORD, text, rng)
    new = rng.choice([rng.choice(WORDS), other.group() if other else "", match.group()[: rng.randint(1, 3)]])
    return text[: match.start()] + new + text[match.end() :]


def lines(text: str, rng: random.Random) -> str:
    """Delete, double or exchange lines."""
    rows = text.split("\n")
    i, j = rng.randrange(len(rows)), rng.randrange(len(rows))
    kind = rng.randrange(3)
    if kind == 0:
        del rows[i]
    elif kind == 1:
        rows.insert(j, rows[i])
    else:
        rows[i], rows[j] = rows[j], rows[i]
    return "\n".join(rows)


def argument(text: str, rng: random.Random) -> str:
    """Add an argument to a statement, with a value of its kind."""
    rows = text.split("\n")
    at = rng.randrange(len(rows))
    keyword = rows[at].split("/")[0].strip().upper()
    cls = st.STATEMENTS.get(keyword)
    if cls is None:
        return text
    name, (_, spec, choice) = rng.choice(list(grammar_of(cls).words.items()))
    rows[at] += ", " + _argument(name, spec, choice, _ids(text), rng)
    return "\n".join(rows)


def statement(text: str, rng: random.Random) -> str:
    """Add a statement made up from the grammar."""
    ids = _ids(text)
    name = rng.choice(sorted(st.STATEMENTS))
    cls = st.STATEMENTS[name]
    words = list(grammar_of(cls).words.items())
    chosen = rng.sample(words, min(len(words), rng.randint(1, 8)))
    head = f"{name}/" if name in st.WITHOUT_ID else f"{name}/{rng.choice([rng.choice(ids), str(rng.randint(1, 9))])},"
    made = head + ", ".join(_argument(word_, spec, choice, ids, rng) for word_, (_, spec, choice) in chosen)
    rows = text.split("\n")
    rows.insert(rng.randint(1, max(1, len(rows) - 2)), made)
    return "\n".join(rows)


def _ids(text: str) -> list[str]:
    return re.findall(r"(?<=/)\d+", text) or ["1"]


def _value(kind: int, ids: list[str], rng: random.Random) -> str:
    if kind in (g.ID, g.INT):
        return rng.choice([rng.choice(ids), "1", "0", "3"])
    if kind == g.EXPRESSION:
        text = rng.choice(EXPRESSIONS)
        return text.format(*(rng.choice([*ids, *NUMBERS[:8]]) for _ in range(text.count("{}"))))
    if kind in (g.REAL, g.REALS, g.TABLE):
        return rng.choice([rng.choice(NUMBERS), rng.choice(ids), f"{rng.uniform(-10, 10):.4g}"])
    return rng.choice([rng.choice(WORDS), "ON", "a:b", "'text'", "X:Y"])


def _argument(name: str, spec: g.Spec, choice: str | None, ids: list[str], rng: random.Random) -> str:
    if choice is not None or spec.kind == g.FLAG:
        return name
    if spec.choices and rng.random() < 0.7:
        return f"{name} = {rng.choice(spec.choices)}"
    count = 1
    if spec.kind in (g.REALS, g.IDS, g.TABLE):
        low, high = spec.count
        count = rng.choice([low, low, min(high, low + 3), 2, 6])
    kind = g.ID if spec.kind == g.IDS else spec.kind
    return f"{name} = " + ", ".join(_value(kind, ids, rng) for _ in range(count))


CHANGES: list[tuple[Callable[[str, random.Random], str], int]] = [
    (characters, 2), (number, 5), (word, 2), (lines, 2), (argument, 3), (statement, 3),
]  # fmt: skip


def mutated(text: str, rng: random.Random, most: int = 3) -> str:
    """Return the text after one to ``most`` random changes."""
    kinds, weights = zip(*CHANGES)
    for _ in range(rng.choice([1, rng.randint(1, most)])):
        text = rng.choices(kinds, weights)[0](text, rng)
    return text
