"""The parser: messages that show the place, and no text that crashes it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.mechanism.language.library import compile_expression
from gearmbs.mechanism.language.syntax import ExpressionError, Scope, parse, unparse
from tests.dae.equations.expressions.support import MARKER_BODY, MARKERS, time_series
from tests.says import says


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", says("expression", "empty", "give")),
        ("1+", "end at column 3"),
        ("2*(3+4", says("'2*(3+4'", "close the bracket")),
        ("STP(1,2,3,4,5)", says("STP", "STEP")),
        ("STEP(1,2,3)", says("STEP", "5", "3", "1", "arguments")),
        ("1 + DX(77)", "no MARKER 77 at column 8"),
        ("DX(1.5)", says("'DX(1.5)'", "name", "expected")),
        ("3*TIM", "TIM is not TIME"),
        ("1/0", says("zero", "column 1", "'1/0'")),
        ("SQRT(-1)", "not a finite number"),
        ("STEP(TIME,1,0,1,1)", "x1 different from x0"),
        ("VARVAL(3)", "no VARIABLE 3"),
        ("JOINT(1,0,2,0)", "no JOINT 1"),
        ("CUBSPL(TIME,0,4)", "no SPLINE 4"),
        ("ACCX(1)", says("'ACCX(1)'", "accelerations", "measured")),
        ("CONTACT(1,0,2,0)", "no CONTACT 1"),
        ("ORIENT(13,1,1)", says("13", "supported")),
        ("FX(1,2)", says("joint", "MARKER 1", "MARKER 2")),
        ("1 2", says("'2'", "expression", "3")),
        ("2*(60D+3*TIME)", says("60D+3", "60", "60E+3", "4", "write 60D")),
        ("5 # 3", says("3", "unexpected character")),
        ("(" * 500, "end at column 501"),
        ("1E999", says("1E999", "too large", "column 1")),
    ],
)
def test_messages(text, message):
    with pytest.raises(ExpressionError, match=message):
        compile_expression(text, Scope(markers=MARKERS, marker_body=MARKER_BODY))


@pytest.mark.parametrize("text", ["-2**2", "1-(2-3)-4*5/6", "2**(3-1)**.5", "IF(TIME-1: SIN(90D), 2, 3E-7)*-TIME"])
def test_unparsed_text_means_the_same(text):
    again = unparse(parse(text))
    for t in (0.3, 1.7):
        tapes = [compile_expression(f"{x}+0*SIN(TIME)+TIME", Scope()) for x in (text, again)]
        assert time_series(tapes[0], t)[0] == time_series(tapes[1], t)[0]


def test_long_sums_do_not_nest():
    text = "+".join(["TIME"] * 5000)
    assert time_series(compile_expression(text, Scope()), 2.0)[1] == pytest.approx(5000.0)


@pytest.mark.parametrize(
    ("opened", "middle", "closed", "value"),
    [
        ("(1+", "TIME", ")", lambda n: 2.0 + n),
        ("-", "TIME", "", lambda n: 2.0 * (-1) ** n),
        ("MAX(1,", "TIME", ")", lambda n: 2.0),
        ("1**", "TIME", "", lambda n: 1.0),
        ("IF(TIME-3: ", "7", ", 0, 1)", lambda n: 7.0),
        ("IF(TIME-1: 0, 0, ", "7", ")", lambda n: 7.0),
    ],
)
def test_expressions_of_any_depth(opened, middle, closed, value):
    """Tables exported as IF in IF in IF; Python's own stack is far shorter."""
    text = opened * 1200 + middle + closed * 1200
    for same in (text, unparse(parse(text))):
        assert time_series(compile_expression(same, Scope()), 2.0)[0] == value(1200)


def test_equal_parts_are_evaluated_once():
    scope = Scope(markers=MARKERS, marker_body=MARKER_BODY)
    once = compile_expression("DX(1,2,3)", scope)
    many = compile_expression("(DX(1,2,3)*DX(1,2,3)+dx(1,2,3))/DX(1,2,3)", scope)
    assert many.length == once.length + 3


LEAVES = st.sampled_from(["TIME", "1.5", "2", "0.25", "PI", "3E-1"])


def combined(inner):
    return st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/"]), inner).map(lambda p: f"({p[0]}{p[1]}{p[2]})"),
        st.tuples(st.sampled_from(["SIN", "COS", "ABS", "ATAN", "TANH"]), inner).map(lambda p: f"{p[0]}({p[1]})"),
        inner.map(lambda p: f"(-{p})"),
        st.tuples(inner, st.sampled_from(["2", "3"])).map(lambda p: f"{p[0]}**{p[1]}"),
        st.tuples(inner, inner).map(lambda p: f"MAX({p[0]},{p[1]})"),
    )


PYTHON = {"SIN": math.sin, "COS": math.cos, "ABS": abs, "ATAN": math.atan, "TANH": math.tanh, "MAX": max, "PI": math.pi}


@pytest.mark.slow
@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.recursive(LEAVES, combined, max_leaves=12), st.floats(0.1, 3.0))
def test_arithmetic_agrees_with_python(text, t):
    """Python's precedence of these operators is FORTRAN's."""
    try:
        expected = eval(text, {"__builtins__": {}}, {**PYTHON, "TIME": t})
        tape = compile_expression(text, Scope())
    except (ZeroDivisionError, OverflowError, ExpressionError):
        return
    value = tape.constant if tape.constant is not None else time_series(tape, t)[0]
    assert value == pytest.approx(expected, rel=1e-9, abs=1e-9) or abs(expected) > 1e6


WORDS = """DX STEP ( ) , : TIME 1 2.5E3 90D ** * - / + ' .m.p
           IF IMPACT CUBSPL VARVAL ORIENT JOINT 1E5 \\ é 0 FX D E""".split()


@pytest.mark.slow
@settings(max_examples=400, deadline=None, derandomize=True)
@given(st.one_of(st.lists(st.sampled_from(WORDS), max_size=25).map("".join), st.text(max_size=40)))
def test_any_text_gives_a_tape_or_an_expression_error(text):
    try:
        parse(text)
        tape = compile_expression(text, Scope(markers=MARKERS, marker_body=MARKER_BODY))
    except ExpressionError:
        return
    assert tape.length >= 1
