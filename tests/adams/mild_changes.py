"""Decks changed so that most can still be run: a number scaled, another marker, one more term or statement, one less.

The changes of `mutations` break most decks; what these make is nearly always read, and mostly built and run.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable
from dataclasses import dataclass, field

from gearmbs.adams.parse import grammar as g
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import CONTINUED, RawStatement, grammar_of, specs_of
from gearmbs.adams.parse.reader import statements

from .mutations import NUMBER

_HEAD = re.compile(r"\s*([A-Za-z_]+)\s*/\s*(\d*)")
STAYS = (st.Part, st.Marker, st.Units)
"""Statements without which a deck is seldom built."""
DOUBLED = (st.Sforce, st.Vforce, st.Vtorque, st.Gforce, st.Variable, st.Request, st.Bushing, st.SpringDamper)
NUMBERS = (g.REAL, g.REALS, g.TABLE)
MARKERS = ("I", "J", "RM", "JFLOAT", "CM", "CORNER", "IM")
TERMS = [
    "{x}*DX({m},{m})", "-{x}*VX({m})", "STEP(TIME,0,0,1E-3,{x})", "{x}*SIN(300*TIME)", "{x}*TANH(VZ({m}))",
    "IF(DX({m}):0,{x},1)", "MAX(DY({m}),{x})", "SQRT(1+DX({m},{m})**2)", "AZ({m},{m})", "WX({m})", "{x}*ACCX({m})",
    "IMPACT(DZ({m}),VZ({m}),{x},1E3,1.5,1,1E-3)", "BISTOP(DX({m}),VX({m}),-{x},{x},1E3,1.5,1,1E-3)", "{x}*WDTZ({m})",
    "{x}*EXP(-TIME)", "POLY(TIME,0,{x},1)", "{x}*DM({m},{m})", "MIN({x},ABS(VY({m})))", "VM({m},{m})", "FZ({m},{m})",
    "PSI({m},{m})", "{x}*MOD(TIME,1E-3)", "1/(1+DY({m})**2)", "ATAN2(DX({m}),{x})", "SHF(TIME,0,{x},50,0,0)",
]  # fmt: skip
ADDED = [
    "SFORCE/{n}, TRANSLATIONAL, ACTIONONLY, I={m}, J={m}, FUNCTION={e}", "VARIABLE/{n}, FUNCTION={e}",
    "SFORCE/{n}, ROTATIONAL, ACTIONONLY, I={m}, J={m}, FUNCTION={e}", "SFORCE/{n}, TRANS, I={m}, J={m}, FUNCTION={e}",
    "SPRINGDAMPER/{n}, TRANSLATION, I={m}, J={m}, K={x}, C={x}, LENGTH={x}", "REQUEST/{n}, F2={e}\\F3={e}\\F7={e}",
    "BUSHING/{n}, I={m}, J={m}, K={x},1,1, C=0.1,0.1,0.1, KT=1,1,{x}, CT=.1,.1,.1", "REQUEST/{n}, A, I={m}, J={m}",
    "DIFF/{n}, IC={x}, FUNCTION=-{x}*DIF({n})+{e}", "JPRIM/{n}, INPLANE, I={m}, J={m}", "ACCGRAV/IGRAV={x}, KGRAV=-{x}",
    "SENSOR/{n}, GE, VALUE={x}, FUNCTION={e}, RETURN", "SENSOR/{n}, LE, VALUE={x}, FUNCTION={e}, DT=1E-4, RESTART",
    "INTEGRATOR/GSTIFF, ERROR=1E-{d}", "INTEGRATOR/WSTIFF, SI2, ERROR=1E-{d}, HMAX=1E-3", "INTEGRATOR/GSTIFF, SI1",
    "JPRIM/{n}, PARALLEL_AXES, I={m}, J={m}", "FIELD/{n}, I={m}, J={m}, KMATRIX={six}, CMATRIX={six}",
    "BEAM/{n}, I={m}, J={m}, LENGTH={x}, IXX=2, IYY=1, IZZ={x}, AREA=3, EMOD=2E5, GMOD=8E4, CRATIO=.01",
    "VTORQUE/{n}, I={m}, RM={m}, JFLOAT=999{d}, TX={e}\\TY=0\\TZ={x}\nMARKER/999{d}, PART=1, FLOATING",
]  # fmt: skip
SIX = ", ".join(str(float(i == j)) for i in range(6) for j in range(6))

REQUIRED = {cls: [name for name, spec in specs_of(cls).items() if spec.required] for cls in st.STATEMENTS.values()}


@dataclass
class Argument:
    """One argument of a statement, and where its value stands in the text."""

    name: str
    spec: g.Spec
    start: int
    end: int


class _Places(g.ArgumentReader):
    """Reads a statement and keeps where its values stand."""

    def __init__(self, raw: RawStatement, start: int, grammar: g.Grammar) -> None:
        super().__init__(raw, start, grammar)
        self.places: list[Argument] = []

    def _store(self, name: str, spec: g.Spec, raw: str, start: int, value_at: int) -> None:
        super()._store(name, spec, raw, start, value_at)
        self.places.append(Argument(name, spec, value_at, value_at + len(raw)))


@dataclass
class Piece:
    """A statement of a deck."""

    text: str
    cls: type | None = None
    id: str = ""
    arguments: list[Argument] = field(default_factory=list)


def pieces(deck: str) -> tuple[str, list[Piece]]:
    """Return the title of a deck and its statements; of those that cannot be read, the text alone."""
    found = []
    for raw in statements(deck, skip=1):
        piece = Piece(raw.text)
        head = _HEAD.match(raw.text)
        cls = st.STATEMENTS.get(head.group(1).upper()) if head else None
        if head is not None and cls is not None:
            reader = _Places(raw, head.end(), grammar_of(cls))
            try:
                reader.read()
            except g.StatementError:
                pass
            else:
                piece = Piece(raw.text, cls, head.group(2), reader.places)
        found.append(piece)
    return deck.split("\n", 1)[0], found


def mildly_changed(deck: str, rng: random.Random, most: int = 3) -> str:
    """Return a deck after one to ``most`` changes that it mostly survives."""
    kinds, weights = zip(*CHANGES)
    for _ in range(rng.randint(1, most)):
        title, found = pieces(deck)
        rng.choices(kinds, weights)[0](found, rng)
        deck = "\n".join([title, *(p.text.replace(CONTINUED, "\n,") for p in found), ""])
    return deck


def _chosen(
    found: list[Piece], rng: random.Random, wanted: Callable[[Argument], bool]
) -> tuple[Piece, Argument] | None:
    those = [(p, a) for p in found for a in p.arguments if wanted(a)]
    return rng.choice(those) if those else None


def _put(piece: Piece, start: int, end: int, text: str) -> None:
    piece.text = piece.text[:start] + text + piece.text[end:]


def _near(text: str, rng: random.Random) -> str:
    """Return a number near one: scaled, of other sign, zero, or moved."""
    tail = "D" if text[-1:] in "dD" else ""
    value = float(re.sub("[dD]", "E", text[: len(text) - len(tail)]))
    new = rng.choices([value * math.exp(rng.gauss(0.0, 0.7)), -value, 0.0, value + rng.gauss(0.0, 0.1)], [8, 1, 1, 2])
    return f"{new[0]:.6g}{tail}"


def number(found: list[Piece], rng: random.Random) -> None:
    """Scale one number of an argument, or of an expression where it stands alone."""
    one = _chosen(found, rng, lambda a: a.spec.kind in NUMBERS)
    if one is not None:
        piece, place = one
        numbers = list(NUMBER.finditer(piece.text, place.start, place.end))
        if numbers:
            at = rng.choice(numbers)
            _put(piece, at.start(), at.end(), _near(at.group(), rng))


def constant(found: list[Piece], rng: random.Random) -> None:
    """Scale a constant of an expression: a number behind a sign, which no function takes for an id."""
    one = _chosen(found, rng, lambda a: a.spec.kind == g.EXPRESSION)
    if one is not None:
        piece, place = one
        numbers = [n for n in NUMBER.finditer(piece.text, place.start, place.end) if "." in n.group()]
        if numbers:
            at = rng.choice(numbers)
            _put(piece, at.start(), at.end(), _near(at.group(), rng))


def reference(found: list[Piece], rng: random.Random) -> None:
    """Refer to another marker, or to another statement that is referred to elsewhere."""
    one = _chosen(found, rng, lambda a: a.spec.kind in (g.ID, g.IDS))
    if one is not None:
        piece, place = one
        word = place.spec.keyword
        ids = _markers(found)
        if word not in MARKERS:
            others = [(p, a) for p in found for a in p.arguments if a.spec.keyword == word]
            ids = [n.group() for p, a in others for n in re.finditer(r"\d+", p.text[a.start : a.end])]
        numbers = list(re.finditer(r"\d+", piece.text[place.start : place.end]))
        if ids and numbers:
            at = rng.choice(numbers)
            _put(piece, place.start + at.start(), place.start + at.end(), rng.choice(ids))


def choice(found: list[Piece], rng: random.Random) -> None:
    """Choose another of the words that an argument may be."""
    one = _chosen(found, rng, lambda a: bool(a.spec.choices) and a.spec.kind == g.WORD)
    if one is not None:
        piece, place = one
        _put(piece, place.start, place.end, f" {rng.choice(place.spec.choices)}")


def kind(found: list[Piece], rng: random.Random) -> None:
    """Make another kind of a joint, a primitive or a motion."""
    those = [p for p in found if p.cls in (st.Joint, st.Jprim, st.Motion)]
    if those:
        piece = rng.choice(those)
        specs = [s for s in g.specs_of(piece.cls).values() if s.kind == g.CHOICE]  # type: ignore[arg-type]
        spec = rng.choice(specs)
        pattern = re.compile(rf"\b(?:{'|'.join(spec.choices)})\b")
        piece.text = pattern.sub(rng.choice(spec.choices), piece.text, count=1)


def term(found: list[Piece], rng: random.Random) -> None:
    """Add a term to an expression, or multiply it by one."""
    one = _chosen(found, rng, lambda a: a.spec.kind == g.EXPRESSION)
    if one is not None:
        piece, place = one
        before = piece.text[place.start : place.end].strip()
        _put(piece, place.start, place.end, f" ({before}){rng.choice('+-*')}({_term(found, rng)})")


def left_out(found: list[Piece], rng: random.Random) -> None:
    """Leave out an argument that is not required."""
    those = [(p, a) for p in found for a in p.arguments if a.name not in REQUIRED.get(p.cls or object, ())]
    if those:
        piece, place = rng.choice(those)
        start = piece.text.rfind(",", 0, place.start)
        if start >= 0:
            _put(piece, start, place.end, "")


def removed(found: list[Piece], rng: random.Random) -> None:
    """Remove a statement that is no part and no marker."""
    those = [k for k, p in enumerate(found) if p.cls is not None and p.cls not in STAYS]
    if those:
        del found[rng.choice(those)]


def doubled(found: list[Piece], rng: random.Random) -> None:
    """Repeat a statement under another id."""
    those = [p for p in found if p.cls in DOUBLED and p.id]
    if those:
        piece = rng.choice(those)
        text = _HEAD.sub(lambda m: f"{m.group(1)}/{rng.randint(700, 799)}", piece.text, count=1)
        found.insert(len(found) - 1, Piece(text))


def added(found: list[Piece], rng: random.Random) -> None:
    """Add a statement between markers of the deck."""
    text = rng.choice(ADDED)
    while "{e}" in text:
        text = text.replace("{e}", _term(found, rng), 1)
    text = text.replace("{six}", SIX).replace("{n}", str(rng.randint(800, 899)))
    found.insert(len(found) - 1, Piece(_filled(text.replace("{d}", str(rng.randint(2, 9))), found, rng)))


def order(found: list[Piece], rng: random.Random) -> None:
    """Exchange two statements."""
    i, j = rng.randrange(max(1, len(found) - 1)), rng.randrange(max(1, len(found) - 1))
    found[i], found[j] = found[j], found[i]


def _markers(found: list[Piece]) -> list[str]:
    return [p.id for p in found if p.cls is st.Marker and "FLOATING" not in p.text] or ["1"]


def _term(found: list[Piece], rng: random.Random) -> str:
    return _filled(rng.choice(TERMS), found, rng)


def _filled(text: str, found: list[Piece], rng: random.Random) -> str:
    markers = _markers(found)
    text = re.sub(r"\{m\}", lambda _: rng.choice(markers), text)
    return re.sub(r"\{x\}", lambda _: f"{math.exp(rng.gauss(0.0, 2.0)):.4g}", text)


CHANGES: list[tuple[Callable[[list[Piece], random.Random], None], int]] = [
    (number, 8), (constant, 3), (reference, 3), (choice, 2), (kind, 2), (term, 4), (left_out, 2), (removed, 2),
    (doubled, 2), (added, 5), (order, 1),
]  # fmt: skip
