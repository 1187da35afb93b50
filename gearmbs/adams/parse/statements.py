"""The statements of a deck that this program understands, as typed records, and those that it knows and does not.

A class is a row of the table of statements: its options say what the statement is, its fields with which keyword and
kind they are read and what is known of them (`gearmbs.adams.parse.grammar`). Values stay in the deck's units (angles in
radians). ``given`` says which arguments stood in the deck.
"""

from __future__ import annotations

from typing import NamedTuple

from gearmbs.adams.parse.data_statements import *  # noqa: F403
from gearmbs.adams.parse.grammar import Statement, specs_of
from gearmbs.adams.parse.model_statements import *  # noqa: F403
from gearmbs.mechanism.language.lowering import ELEMENT_FORCES

STATEMENTS: dict[str, type[Statement]] = Statement.table
"""What is read, by name."""
KEYWORD_OF = {cls: keyword for keyword, cls in STATEMENTS.items()}

KINDS = Statement.kinds
WITHOUT_ID = frozenset(name for name, cls in STATEMENTS.items() if cls.once)
"""Statements that stand once and have no id."""

READ_BY = {
    function: KEYWORD_OF[cls] for function, kind in ELEMENT_FORCES.items() for cls in KINDS if KINDS[cls] == kind
}
READ_BY |= {function: name for name, cls in STATEMENTS.items() for function in cls.read_by}
"""Statements that functions read by id; of CURVE it is the last argument."""

IGNORED = frozenset("PREFERENCES DEBUG FEMDATA FE_NODE LSOLVER SECTION".split())
"""Statements without effect on the numbers computed here."""


class Refused(NamedTuple):
    """What to do instead of a statement, whether it has part in the motion, and whether a script may switch it."""

    instead: str
    moves: bool = True
    switch: bool = False


REFUSED = {
    "CLEARANCE": Refused(
        "a REQUEST with DM between two markers; CONTACT tells how deep solids press", moves=False, switch=True
    ),
    "EXTERNAL_SYSTEM": Refused("a GSE with routines in Python"),
    "MREQUEST": Refused("a REQUEST for each marker", moves=False),
    "NFORCE": Refused("BEAM or FIELD between neighbouring PARTs", switch=True),
    "NODE": Refused("it belongs to a FLEX_BODY", moves=False),
    "NORMAL_MODE_ANALYSIS": Refused("LINEAR/EIGENSOL in the script", moves=False),
    "PSTATE": Refused("none needed: LINEAR chooses the coordinates", moves=False),
    "SURFACE": Refused("a mesh in an EXTERNAL solid of GRAPHICS"),
    "TIRE": Refused("a GFORCE with a routine in Python", switch=True),
    "UCON": Refused("a GCON with an expression, or a COUPLER with a routine", switch=True),
}
"""Statements of ADAMS that are not modelled here; most change the motion."""
UNSUPPORTED = frozenset(REFUSED)
INSTEAD = {name: row.instead for name, row in REFUSED.items()}
INSTEAD_OF_ARGUMENTS = {
    (name, spec.keyword): spec.instead
    for name, cls in STATEMENTS.items()
    for spec in specs_of(cls).values()
    if spec.instead
}
"""What to do instead of arguments that are refused, by the names of the statement and the argument."""
INSTEAD_OF_FUNCTIONS: dict[str, str] = {
    "ARYSUM": "the sum of ARYVALs",
    "CURVE": "read where a CURVE has its id",
    "DELAY": "a TFSISO that approximates the delay",
    "DXYZ": "DX, DY and DZ",
    "FXFREQ": "read in CRATIO of a FLEX_BODY",
    "FXMODE": "read in CRATIO of a FLEX_BODY",
    "FXYZ": "FX, FY and FZ",
    "INTERP": "CUBSPL or AKISPL of a SPLINE",
    "INVPSD": "a SPLINE of the signal",
    "MODE": "MODE without brackets",
    "NFORCE": "the forces of BEAM or FIELD",
    "RANDOM": "a SPLINE of the signal",
    "SENVAL": "read where a SENSOR has its id",
    "TXYZ": "TX, TY and TZ",
    "USER": "the routine in Python alone in the FUNCTION",
    "UVX": "DX, DY and DZ from the marker to one at 1 of its x axis",
    "UVY": "DX, DY and DZ from the marker to one at 1 of its y axis",
    "UVZ": "DX, DY and DZ from the marker to one at 1 of its z axis",
    "VXYZ": "VX, VY and VZ",
    "WXYZ": "WX, WY and WZ",
}
"""What to do instead of functions that are refused."""
MERELY_READ = frozenset(
    [name for name, cls in STATEMENTS.items() if not cls.moves]
    + [name for name, row in REFUSED.items() if not row.moves]
)
"""Statements that move nothing themselves; what reads them is named as well."""


def switched(how: str) -> list[str]:
    """Return the statements that a script switches and that act, or stay on: "acts" or "on"; "" those not modelled."""
    if not how:
        return [name for name, row in REFUSED.items() if row.switch]
    return sorted(name for name, cls in STATEMENTS.items() if cls.switch == how)


def instead_of_statement(name: str) -> str:
    """Return a clause on what to do instead of a statement that is refused."""
    return f"; instead: {INSTEAD[name]}"


def instead_of_function(name: str) -> str:
    """Return a clause on what to write instead of a function that is refused, "" where there is nothing."""
    return f"; instead: {INSTEAD_OF_FUNCTIONS[name]}" if name in INSTEAD_OF_FUNCTIONS else ""
