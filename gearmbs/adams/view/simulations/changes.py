"""What changes in a model between two simulations that follow each other without a reset, as commands of the solver.

View hands the model over again for each simulation. What differs from the one before becomes ACTIVATE, DEACTIVATE and
new arguments of statements, where the solver's commands can say it; the rest is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import CHANGEABLE
from gearmbs.adams.parse.grammar import specs_of
from gearmbs.adams.view.deckmaker import Made

SWITCHED = frozenset(st.switched("acts"))
"""Statements that ACTIVATE and DEACTIVATE switch."""
PASSIVE = frozenset(
    "MARKER REQUEST VARIABLE ARRAY SPLINE CURVE MATRIX STRING PINPUT POUTPUT OUTPUT RESULTS GRAPHICS".split()
)
"""Statements that change nothing of the motion as long as no other one names them."""
ANEW = frozenset(("INTEGRATOR", "EQUILIBRIUM", "KINEMATICS", "IC"))
"""Settings: a command may give those that the deck does not have, and does not get."""
DATA_FIRST = ("MARKER", "MATRIX", "ARRAY", "SPLINE", "CURVE", "STRING", "VARIABLE")
ZERO = {"QP": "0, 0, 0", "REULER": "0, 0, 0"}
"""Of markers: arguments that are not written where they are zero."""
REMEDY = "put 'simulation single_run reset' before this simulation, or make the change before the first one"


def keyword_of(head: str) -> str:
    """Return the keyword of a statement's head."""
    return head.partition("/")[0]


def _argument(text: str) -> tuple[str, str]:
    """Return an argument's keyword and value; of a word without a value the word itself, and nothing."""
    name, equals, value = text.partition("=")
    return (name.strip().upper(), value.strip()) if equals else (text.strip().upper(), "")


class ChangeError(ValueError):
    """Something changes that the solver's commands cannot change."""


class Course:
    """The statements that some simulations, each going on from where the last one ended, have in common.

    Parameters
    ----------
    first : sequence of Made
        The statements at the first of them.
    there : collection of str
        Heads of all elements that there were then, whether active or not.

    Attributes
    ----------
    statements : dict of str to Made
        Those of the deck by head: everything that ever acts.
    """

    def __init__(self, first: Sequence[Made], there: Iterable[str]) -> None:
        self.statements = {one.head: one for one in first}
        self.there = frozenset(there)
        self._arguments = {one.head: (one.arguments, one.pair) for one in first}
        self._off: set[str] = set()
        self._off_at_first: list[str] = []

    @property
    def before(self) -> list[str]:
        """Commands before the first simulation: what acts only later is off."""
        return [_switch("DEACTIVATE", head) for head in self._off_at_first]

    def changed(self, now: Sequence[Made]) -> list[str]:
        """Return the commands that lead from the statements of the last simulation to those of the next one.

        Raises
        ------
        ChangeError
            Naming what cannot be changed.
        """
        wanted = {one.head: one for one in now}
        off = [_switch("DEACTIVATE", head) for head in self._gone(wanted)]
        on, new = [], []
        for head, one in wanted.items():
            keyword = keyword_of(head)
            if head not in self._arguments:
                if keyword in SWITCHED and head in self.there:
                    self._off_at_first.append(head)
                    self._off.add(head)
                elif keyword in ANEW:
                    new.append(_joined(head, one.arguments))
                elif keyword not in PASSIVE:
                    raise ChangeError(f"{_label(one)} is made between two simulations; {REMEDY}")
                if keyword not in ANEW:
                    self.statements[head] = one
                self._arguments[head] = one.arguments, one.pair
            if self._arguments[head] != (one.arguments, one.pair):
                given = self._new_arguments(one, *self._arguments[head])
                new.append(_joined(head, given))
                self._arguments[head] = one.arguments, one.pair
            if head in self._off:
                self._off.discard(head)
                on.append(_switch("ACTIVATE", head))
        new.sort(key=lambda text: keyword_of(text) not in DATA_FIRST)
        return [*off, *new, *on]

    def _gone(self, wanted: Mapping[str, Made]) -> list[str]:
        """Return what is switched off from now on."""
        found = []
        for head, one in self.statements.items():
            if head in wanted or head in self._off or keyword_of(head) in PASSIVE:
                continue
            if keyword_of(head) not in SWITCHED:
                raise ChangeError(f"{_label(one)} is taken out between two simulations; {REMEDY}")
            found.append(head)
        self._off.update(found)
        return found

    def _new_arguments(self, one: Made, before: tuple[str, ...], pair: tuple[str, ...]) -> list[str]:
        """Return the arguments of a statement that have other values than before."""
        keyword = keyword_of(one.head)
        old, new = (dict(_argument(text) for text in several) for several in (before, one.arguments))
        different = {name for name in new if name not in old or old[name] != new[name]} | (old.keys() - new.keys())
        if keyword not in CHANGEABLE or pair != one.pair:
            what = f"{_label(one)}: {', '.join(sorted(different)) or 'its gears'}"
            raise ChangeError(f"{what} cannot be changed between two simulations; {REMEDY}")
        specs = specs_of(st.STATEMENTS[keyword]).values()
        start = different & {spec.keyword for spec in specs if spec.start}
        if start:
            what = f"{_label(one)}: {', '.join(sorted(start))} is where the motion starts"
            raise ChangeError(f"{what}, and is changed after it has; {REMEDY}")
        back = {name: ZERO[name] for name in old.keys() - new.keys() if keyword == "MARKER" and name in ZERO}
        lost = [name for name in old if name not in new and name not in back]
        lost += [name for name in new if name not in old and not new[name]]
        if lost:
            what = f"{_label(one)}: {', '.join(dict.fromkeys(lost))} is given or taken back"
            raise ChangeError(f"{what} between two simulations; {REMEDY}")
        given = [text for text in one.arguments if _argument(text)[0] in different]
        return [*given, *(f"{name} = {value}" for name, value in back.items())]


def _switch(word: str, head: str) -> str:
    keyword, _, number = head.partition("/")
    return f"{word}/{keyword}, ID={number}" if number else f"{word}/{keyword}"


def _joined(head: str, arguments: Sequence[str]) -> str:
    return head + ("" if head.endswith("/") else ", ") + ", ".join(arguments)


def _label(one: Made) -> str:
    return f"{one.head.rstrip('/')} ({one.name})" if one.name else one.head.rstrip("/")


def same(one: Iterable[Made], other: Iterable[Made]) -> bool:
    """Return whether statements are the same but for those that change nothing of the motion and have come since.

    Parameters
    ----------
    one, other : iterable of Made
        Before and after.
    """
    before = {made.head: (made.arguments, made.pair) for made in one}
    after = {made.head: (made.arguments, made.pair) for made in other}
    return all(after.get(head) == held for head, held in before.items()) and all(
        head in before or keyword_of(head) in PASSIVE for head in after
    )
