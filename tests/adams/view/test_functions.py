"""Functions of View's design-time language against the examples of its manual and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.adams.view.expressions import parse
from gearmbs.adams.view.interpreter import Interpreter
from gearmbs.adams.view.lexer import ViewError

from ...says import says

MODEL = """\
model create model_name = m
defaults units length = foot angle = deg force = newton mass = kg time = sec
part create rigid_body name_and_position part_name = .m.P location = 0, 0, 0
marker create marker_name = .m.P.A adams_id = 7 location = 0, 0, 0 orientation = 30, 40, 50
variable create variable_name = .m.table real_value = ({[1, 2, 3], [4, 5, 6]})
"""
YAW, PITCH, ROLL = Rotation.from_euler("ZXZ", (30, 40, 50), degrees=True).as_euler("ZYX", degrees=True)


@pytest.fixture(scope="module")
def values():
    run = Interpreter()
    run.run(MODEL)
    assert not run.errors
    return run.values


def evaluated(values, text):
    return values.evaluate(parse(text, values.db.units), 0)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        # examples of View's manual
        ('STR_SPRINTF("The %s of %s is %03d%%.", {"value", "angle", 2})', "The value of angle is 002%."),
        ('STR_MATCH("f?d", "fad")', 1),
        ('STR_INSERT("That\'sfolks", " all ", 7)', "That's all folks"),
        ('STR_DELETE("This is your life", 9, 1)', "This is our life"),
        ('STR_DELETE("This is your life", -100, 10)', "ur life"),
        ('STR_DELETE("This is your life", 100, 10)', "This is your life"),
        ('STR_MERGE_STRINGS(" ", {"how", "now", "brown", "cow"})', "how now brown cow"),
        ('STR_XLATE("Why/-are/-you/-here/-?", "/-", ">_")', "Why>_are>_you>_here>_?"),
        ('STR_REPLACE_ALL("aabbccaaaeeffaaaa", "aa", "cba")', "cbabbcccbaaeeffcbacba"),
        ('STR_FIND_N("meant human", "an", 2)', 10),
        ('STR_FIND_N("43### 55###9 22##5", "##", 3)', 16),
        ('STR_FIND_COUNT("239990 129990", "99")', 2),
        ('STR_FIND_COUNT("hellllo jello", "ll")', 3),
        ('STR_SPLIT(" apple; orange; grape ", ";")', ["apple", "orange", "grape"]),
        ('STR_REMOVE_WHITESPACE("  two words ")', "two words"),
        ("CROSS({1, 0, 0}, {0, 1, 0})", [0, 0, 1]),
        ("DOT({1, 1, 0}, {1, 0, 1})", 1),
        (
            "INVERSE({[1, 2, 0], [2, 1, -1], [3, 1, 1]})",
            [[-0.25, 0.25, 0.25], [0.625, -0.125, -0.125], [0.125, -0.625, 0.375]],
        ),
        ("RESHAPE({1, 0, 0, 0}, {3, 3})", np.eye(3).tolist()),
        ('SORT({3, 2, 1}, "a")', [1, 2, 3]),
        ('SORT_INDEX({3, 5, 4, 2}, "a")', [4, 1, 3, 2]),
        ('REVERSE({"hello", "world"})', ["world", "hello"]),
        ("ELEMENT({1, 2, 3}, 3) + ELEMENT({1, 2, 3}, 11)", 1),
        ("SERIES2(2, 8, 4)", [2, 4, 6, 8]),
        ("NORMALIZE({3, 4, 5})", (np.array([3, 4, 5]) / np.sqrt(50)).tolist()),
        *((f"VALAT({{-1, 0, 2, 3}}, {{1, 2, 3, 4}}, {x})", y) for x, y in zip(range(-2, 5), (0, 1, 2, 2.5, 3, 4, 5))),
        ('UNITS_CONVERSION_FACTOR("inch")', 1.0 / 12.0),
        # by their formulas
        ("DET({[1, 2, 0], [2, 2, -1], [3, 1, 1]})", -7),
        ("TRANSPOSE(.m.table)", [[1, 4], [2, 5], [3, 6]]),
        (".m.table[2, *]", [4, 5, 6]),
        (".m.table[*, 3]", [3, 6]),
        (".m.table[2, 1]", 4),
        ("{5, 6}[*]", [5, 6]),
        ('UNIQUE_ID("marker")', 8),
        ('UNIQUE_ID("joint")', 1),
        ("YAW(.m.P.A, .m.ground)", YAW),
        ("PITCH(.m.P.A, .m.ground)", -PITCH),
        ("ROLL(.m.P.A, .m.ground)", ROLL),
        ('STR_SPRINTF("%6.2f|%-4d|%g", {1.005e2, 7, 0.5})', "100.50|7   |0.5"),
        ('STR_MATCH("*a*b", "xxaxxb") + STR_MATCH("a*b", "ac") + STR_MATCH("**", "")', 2),
    ],
)
def test_values(values, text, value):
    found = evaluated(values, text)
    if isinstance(value, str) or (isinstance(value, list) and isinstance(value[0], str)):
        assert found == value
    else:
        assert np.allclose(found, value, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('STR_SPRINTF("%s %s", {"one"})', ("STR_SPRINTF", "values")),
        ('STR_SPRINTF("%s", {"one", "two"})', ("STR_SPRINTF", "1", "values")),
        ('STR_SPRINTF("%9999d", {1})', ("STR_SPRINTF", "9999d")),
        ('STR_SPRINTF("%p", {1})', ("%p", "give")),
        ('STR_MATCH("[ab]c", "ac")', ("STR_MATCH", "brackets", "give")),
        ('STR_XLATE("abc", "ab", "x")', ("STR_XLATE", "2", "1")),
        ('STR_REPLACE_ALL("abc", "", "x")', ("STR_REPLACE_ALL", "give")),
        ("INVERSE({[1, 2], [2, 4]})", ("INVERSE", "singular")),
        ("INVERSE({[1, 2, 3], [2, 4, 5]})", ("INVERSE", "square")),
        ("DET({1, 2, 3})", ("DET", "rows")),
        ("CROSS({1, 2}, {3, 4, 5})", ("CROSS", "3")),
        ("DOT({1, 2}, {3, 4, 5})", ("DOT", "2")),
        ("NORMALIZE({0, 0})", ("NORMALIZE", "zeros")),
        ("RESHAPE({1}, {100000, 100000})", ("RESHAPE", "give")),
        ('SORT({1, 2}, "up")', ("SORT", "up", "give")),
        ("VALAT({1, 0}, {1, 2}, 0)", ("VALAT", "ascending")),
        ("SERIES2(0, 1, 1)", ("SERIES2", "give")),
        ('UNITS_CONVERSION_FACTOR("parsec")', ("parsec", "unit")),
        (".m.table[3, *]", ("member", "3")),
        ("LOC_PERPENDICULAR({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}})", ("LOC_PERPENDICULAR",)),
    ],
)
def test_what_has_no_value_is_named(values, text, words):
    with pytest.raises(ViewError, match=says(*words)):
        evaluated(values, text)


def test_a_model_that_is_deleted_is_gone():
    run = Interpreter()
    run.run(MODEL + "model delete model_name = .m\nmodel create model_name = n\n")
    assert not run.errors
    assert [item.path for item in run.database if item.kind in ("model", "part")] == [".n", ".n.ground"]
    run.run("model delete model_name = .n\nmarker create marker_name = here location = 0, 0, 0\n")
    assert len(run.errors) == 1
