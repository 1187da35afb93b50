"""The table of statements: what is read, against the reader, and that it is the only list of them."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import gearmbs.adams
from gearmbs.adams import DeckError, parse_deck, run_deck, support_table
from gearmbs.adams import support as table
from gearmbs.adams.builders.flexible import DEFORMING
from gearmbs.adams.builders.mechanism import MAKERS
from gearmbs.adams.builders.routines import BINDERS
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import UNSUPPORTED_COMMANDS
from gearmbs.adams.parse.grammar import specs_of
from gearmbs.mechanism.language.lowering import UNSUPPORTED as REFUSED_FUNCTIONS

from .decks import PENDULUM

UNSUPPORTED_ARGUMENTS = {
    cls: [name for name, spec in specs_of(cls).items() if spec.instead is not None] for cls in st.STATEMENTS.values()
}
PACKAGE = Path(gearmbs.adams.__file__).parent
ROWS = ("parse/statements.py", "parse/model_statements.py", "parse/data_statements.py")
"""Where the rows of statements are; those of what builds them stand beside the functions that do."""
PAGE = Path(__file__).parents[2] / "docs" / "howto" / "adams_table.md"


def test_every_statement_stands_in_the_table_as_the_reader_takes_it():
    how = {row[0]: row[1] for row in table.statement_rows()}
    assert set(how) == {*st.STATEMENTS, *st.IGNORED, *st.UNSUPPORTED}
    for name, word in how.items():
        if word == table.REFUSED:
            deck = parse_deck(PENDULUM.replace("END\n", f"{name}/77, X=1\nEND\n"))
            (told,) = [d.message for d in deck.unsupported]
            assert told.startswith(f"{name}/77 is not supported; it changes the motion")
            assert table.INSTEAD[name] in told
        elif word == table.OVER:
            deck = parse_deck(PENDULUM.replace("END\n", f"{name}/77, X=1\nEND\n"))
            assert any(name in d.message and "ignored" in d.message for d in deck.diagnostics)
        else:
            assert name in st.STATEMENTS


def test_what_is_refused_has_something_to_do_instead():
    assert set(table.INSTEAD) >= st.UNSUPPORTED
    for cls, fields in UNSUPPORTED_ARGUMENTS.items():
        for field in fields:
            keyword = specs_of(cls)[field].keyword
            known = (st.KEYWORD_OF[cls], keyword) in table.INSTEAD_OF_ARGUMENTS
            assert known or cls is st.Marker, f"{st.KEYWORD_OF[cls]} {keyword}"
    for name, keyword in table.INSTEAD_OF_ARGUMENTS:
        specs = specs_of(st.STATEMENTS[name]).values()
        assert keyword in {s.keyword for s in specs}, f"{name} has no {keyword}"


def test_functions_of_the_table_are_those_of_expressions():
    for name, how, _ in table.function_rows():
        if how != table.REFUSED:
            continue
        text = PENDULUM.replace("END\n", f"REQUEST/77, F2={name}(1,1,1,1)\nEND\n")
        from gearmbs.adams import run_deck

        with pytest.raises(DeckError, match=f"{name}|unsupported"):
            run_deck(parse_deck(text), end=0.01, steps=1)
    # TRANS is a name that decks use; no description of it was found
    assert set(table.INSTEAD_OF_FUNCTIONS) == REFUSED_FUNCTIONS - {"TRANS"}
    assert set(table.INSTEAD_OF_COMMANDS) == set(UNSUPPORTED_COMMANDS)


def test_the_page_shows_the_table():
    assert "adams_support.show()" in PAGE.read_text(encoding="utf-8")
    text = support_table()
    assert "| BEAM | read |" in text
    assert "| TIRE | refused | | | a GFORCE" in " ".join(text.split())


LEFT_OUT = """elements that are left out, and what asks for them
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
PART/2, MASS=1, CM=20, IP=1,1,1
MARKER/20, PART=2
JOINT/1, REVOLUTE, I=20, J=10
MATERIAL/1, YOUNGS_MODULUS=2E11, POISSONS_RATIO=0.3, DENSITY=7800
FE_PART/4, TYPE=2DOTHER, NODE_LABELS=1,2, COORDINATES=1,0,0,0,0,0,0,2,1,0,0,0,0,0
, SECTION=1,25,50,50,0,80,2,25,50,50,0,80, MATERIAL=1
MARKER/40, FE_PART=4, NODE_LABEL=1
SFORCE/2, TRANSLATIONAL, I=20, J=10, ACTIONONLY, FUNCTION=USER(1)
SFORCE/3, TRANSLATIONAL, I=20, J=10, ACTIONONLY, FUNCTION=1+VARVAL(5)
SFORCE/4, TRANSLATIONAL, I=20, J=40, FUNCTION=1
NFORCE/3, I=20
VARIABLE/5, FUNCTION=SFORCE(2,0,1,0)
SENSOR/1, FUNCTION=SFORCE(2,0,1,0), GE, VALUE=10, HALT
REQUEST/1, F2=DX(20,10)
REQUEST/2, F2=SFORCE(2,0,2,0)
REQUEST/3, F2=NFORCE(3,0,2,0)
REQUEST/4, F2=VARVAL(5)
REQUEST/5, F2=DX(40,10)
REQUEST/6, DISPLACEMENT, I=40, J=10
REQUEST/7, F2=SFORCE(4,0,2,0)
REQUEST/8, F2=FX(20,10,0)
END
"""


def test_what_asks_for_elements_that_are_left_out_is_left_out(tmp_path):
    deck = parse_deck(LEFT_OUT)
    with pytest.raises(DeckError):
        run_deck(deck, end=0.1, steps=5)
    result = run_deck(deck, end=0.1, steps=5, out=tmp_path / "run", allow_unsupported=True)
    assert result.success
    assert sorted(result.segments[0].requests) == [1, 8]
    needs = {"REQUEST/2": "SFORCE/2", "REQUEST/3": "NFORCE/3", "REQUEST/4": "VARIABLE/5", "REQUEST/5": "MARKER/40",
             "REQUEST/6": "MARKER/40", "REQUEST/7": "SFORCE/4", "SFORCE/3": "VARIABLE/5",
             "SENSOR/1": "SFORCE/2"}  # fmt: skip
    for label, need in needs.items():
        assert any(f"{label}: it needs {need}, which is left out" in str(d) for d in result.deck.diagnostics), label


def _listed(node: ast.AST, prose: set[int]) -> set[str]:
    """Return the statements that a tuple, list, set, table or text names, by keyword or class."""
    classes = {cls.__name__: keyword for keyword, cls in st.STATEMENTS.items()}
    known = {*st.STATEMENTS, *st.UNSUPPORTED, *st.IGNORED}
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        parts = node.elts
    elif isinstance(node, ast.Dict):
        parts = [part for part in (*node.keys, *node.values) if part is not None]
    elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
        return {word for word in node.value.split() if word in known}
    else:
        return set()
    found = {part.value for part in parts if isinstance(part, ast.Constant)} & known
    return found | {classes[p.attr] for p in parts if isinstance(p, ast.Attribute) and p.attr in classes}


@pytest.mark.slow
def test_no_other_module_lists_statements():
    """A statement is a class and a function with its row: nothing else names three of them in one breath."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        where = path.relative_to(PACKAGE).as_posix()
        if where in ROWS:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        prose = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)}
        # tables of functions, a row beside each
        prose |= {
            id(n.value)
            for n in ast.walk(tree)
            if isinstance(n, ast.AnnAssign)
            and re.fullmatch(r"dict\[type, (Maker|Callable)\]", ast.unparse(n.annotation))
        }
        found += [f"{where}:{n.lineno}" for n in ast.walk(tree) if id(n) not in prose and len(_listed(n, prose)) > 2]
    # commands of ADAMS and of View with the names of statements, and the words for elements that are written
    assert [place for place in found if not place.startswith(("parse/commands.py", "write/", "view/"))] == []


def test_rows_of_statements_are_complete():
    for name, cls in st.STATEMENTS.items():
        fields = specs_of(cls)
        assert cls.__doc__.startswith(name), name
        assert bool(cls.entity) <= (cls in MAKERS), f"{name} transmits a force, and nothing builds it"
        assert cls.switch in ("", "on", "acts")
        assert all(
            spec.idle != "" or spec.instead is None or spec.instead == spec.instead.strip() for spec in fields.values()
        )
        if cls.subroutine:
            assert cls in BINDERS or set(cls.results) <= set(fields), name
    assert set(DEFORMING) | set(MAKERS) | set(BINDERS) <= set(st.STATEMENTS.values())
    assert len({cls.entity for cls in st.KINDS}) == len(st.KINDS)
