"""Expressions of View: operators, units, texts, places and orientations; trees of any length, bounded depth."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as hs
from scipy.spatial.transform import Rotation

from gearmbs.adams import parse_view
from gearmbs.adams.view import frames
from gearmbs.adams.view.expressions import parse
from gearmbs.adams.view.interpreter import Interpreter
from gearmbs.adams.view.lexer import ViewError

from ...says import says
from .files import PENDULUM

MODEL = """\
model create model_name = m
defaults units length = mm angle = deg force = newton mass = kg time = sec
part create rigid_body name_and_position part_name = .m.P location = 10, 20, 30 orientation = 90, 0, 0
marker create marker_name = .m.P.A location = 11, 20, 30 orientation = 0, 90, 0
marker create marker_name = .m.P.B location = 10, 25, 30
marker create marker_name = .m.P.D location = 0, 0, 0 orientation = 30, 40, 50
marker create marker_name = .m.P.E location = 0, 0, 0 orientation = 0, 10, 0
point create point_name = .m.P.C location = 10, 20, 37
variable create variable_name = .m.v real_value = 4
variable create variable_name = .m.list real_value = 1, 2, 3
variable create variable_name = .m.text string_value = "hello"
"""


D, E = (Rotation.from_euler("ZXZ", angles, degrees=True).as_matrix() for angles in ((30, 40, 50), (0, 10, 0)))
IN_E = E.T @ D
TURNED = np.degrees(
    [
        np.arctan2(-IN_E[1, 2], IN_E[2, 2]),
        np.arctan2(IN_E[0, 2], IN_E[2, 2]),
        np.arctan2(IN_E[1, 0], IN_E[0, 0]),
    ]
)
TURNED_IN_ALL = np.degrees(np.arctan2(D[0, 2], D[2, 2]))


@pytest.fixture(scope="module")
def values():
    run = Interpreter()
    run.run(MODEL)
    assert not run.errors
    return run.values


def evaluated(values, text, frame=None):
    return values.evaluate(parse(text, values.db.units), 0, frame)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3 ** 2", 19),
        ("-2 ^ 2", -4),
        ("7 - 2 - 1", 4),
        ("2 ** 3 ** 2", 512),
        ("1 + 1 == 2 && !(3 < 2)", 1),
        ("0 || 0", 0),
        ("7 % 4", 3),
        (".m.v / 8", 0.5),
        ("2.5cm", 25.0),
        ("0.1meter", 100.0),
        ("1(newton/meter)", 1e-3),
        ("2(newton-mm-sec/rad)", 2.0 * np.pi / 180.0),
        ("7.8(kg/meter**3)", 7.8e-9),
        ("180.0d", 180.0),
        ("1rad", 180.0 / np.pi),
        ("SIN(30)", 0.5),
        ("ATAN2(1, 1)", 45.0),
        ("(3 * 2)cm", 60.0),
        (".m.list[2] + {1, 2}[1]", 3),
        ("{1, 2} * 3", [3, 6]),
        ("{1, 2} + {3, 4}", [4, 6]),
        ("MAX(1, {5, 3})", 5),
        ('"a" // "b" // RTOI(3.9)', "ab3"),
        ('.m.text == "hello"', 1),
        ('DB_EXISTS(".m.P.A") + DB_EXISTS(".m.Q")', 1),
        ('STR_LENGTH("abc") + STOI("4")', 7),
        ("NINT(-2.5)", -3),
        ("DM(.m.P.A, .m.P.B)", np.sqrt(26.0)),
        ("DX(.m.P.B, .m.P.A)", -1.0),
        ("DY(.m.P.B, .m.P.A, .m.P.A)", 0.0),
        ("LOC_RELATIVE_TO({0, 0, 1}, .m.P.A)", [11.0, 19.0, 30.0]),
        ("LOC_ON_AXIS(.m.P.A, 2, 'z')", [11.0, 18.0, 30.0]),
        ("LOC_X_AXIS(.m.P.A)", [1.0, 0.0, 0.0]),
        ("LOC_Z_AXIS(.m.P.A)", [0.0, -1.0, 0.0]),
        ("LOC_INLINE({1, 0, 0}, .m.P, .m.ground)", (np.array([10.0, 21.0, 30.0]) / np.sqrt(1441.0)).tolist()),
        ("LOC_ALONG_LINE(.m.P.A, .m.P.C, 0)", [11.0, 20.0, 30.0]),
        ("LOC_LOCAL({11, 20, 31}, .m.P.A)", [0.0, 1.0, 0.0]),
        ("LOC_MIRROR({0, 0, 5}, .m.P.B, 'xy')", [0.0, 0.0, 55.0]),
        ("ORI_RELATIVE_TO({0, 0, 0}, .m.P.A)", [0.0, 90.0, 0.0]),
        ("ORI_ALL_AXES({{0, 0, 0}, {0, 1, 0}, {-1, 0, 0}}, 'xy')", [90.0, 0.0, 0.0]),
        # examples of View's manual
        ("ORI_ALIGN_AXIS(.m.ground, 'z-z')", [90.0, 180.0, 0.0]),
        ("ORI_ALIGN_AXIS_EUL({8, 10, 0}, 'z-z')", [-172.0, 170.0, 90.0]),
        ("ORI_FRAME_MIRROR({6, 14, 0}, .m.ground, 'xz', 'xz')", [174.0, 14.0, 180.0]),
        ("ORI_MIRROR({{10, 8, 0}}, .m.ground, 'xy', 'xy')", [-170.0, 8.0, 180.0]),
        ("ORI_PLANE_MIRROR({0, 0, 0}, {{18, 6, 0}, {18, 12, 0}, {21, 6, 0}}, 'xy')", [0.0, 0.0, 0.0]),
        ("ORI_PLANE_MIRROR({0, 0, 0}, {{18, 6, 0}, {18, 12, 0}, {21, 6, 0}}, 'xz')", [0.0, 180.0, 0.0]),
        ("LOC_PLANE_MIRROR({2, 4, 5}, {{10, 12, 1}, {14, 12, 1}, {12, 10, 1}})", [2.0, 4.0, -3.0]),
        # of z axes about x and y, of the x axis about z, as the solver's
        ("AX(.m.P.D, .m.P.E)", TURNED[0]),
        ("AY(.m.P.D, .m.P.E)", TURNED[1]),
        ("AZ(.m.P.D, .m.P.E)", TURNED[2]),
        ("AY(.m.P.D)", TURNED_IN_ALL),
        (".m.P.C.loc_x + 10 * .m.P.A.loc_y", -10.0),
        ("LOC_SPHERICAL(10, 8d, 90d)", [10 * np.cos(np.radians(8)), 10 * np.sin(np.radians(8)), 0.0]),
    ],
)
def test_values(values, text, value):
    found = evaluated(values, text)
    assert found == value if isinstance(value, str) else np.allclose(found, value, rtol=1e-13, atol=1e-12)


def test_places_come_in_the_frame_that_they_are_asked_in(values):
    part = values.db.find(".m.P")
    assert np.allclose(evaluated(values, "LOC_RELATIVE_TO({0, 0, 0}, .m.P.B)", part), [5.0, 0.0, 0.0])
    assert np.allclose(values.location(values.db.find(".m.P.B")), [5.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("axis", "direction", "x", "z"),
    [
        # as View placed markers of public models along these directions
        ("z", (1, 0, 0), (0, 0, -1), (1, 0, 0)),
        ("z", (0, 0, -1), (-1, 0, 0), (0, 0, -1)),
        ("z", (0, -1, 0), (1, 0, 0), (0, -1, 0)),
        ("z", (-0.6402, -0.7682, 0), (0, 0, 1), (-0.6402, -0.7682, 0)),
        ("x", (-0.7894, -0.6139, 0), (-0.7894, -0.6139, 0), (0, 0, -1)),
        ("x", (-0.7775, -0.1728, 0.6047), (-0.7775, -0.1728, 0.6047), (-0.6139, 0, -0.7894)),
        ("y", (-0.7071, 0.7071, 0), (0.7071, 0.7071, 0), (0, 0, 1)),
    ],
)
def test_axes_along_a_direction(axis, direction, x, z):
    a = frames.along(axis, np.array(direction, float))
    assert np.allclose(a[:, 0], x, atol=1e-4)
    assert np.allclose(a[:, 2], z, atol=1e-4)


@pytest.mark.parametrize("named", ["xx", "xz", "zy", "y-z", "z-y", "z-z", "x-x"])
def test_aligned_axes(named):
    a = Rotation.from_euler("zxz", [0.3, 0.4, 0.5]).as_matrix()
    sign = -1.0 if "-" in named else 1.0
    found = frames.aligned(a, named[0], sign, named[-1])
    assert np.allclose(found.T @ found, np.eye(3))
    assert np.isclose(np.linalg.det(found), 1.0)
    assert np.allclose(found[:, "xyz".index(named[0])], sign * a[:, "xyz".index(named[-1])])


@given(hs.sampled_from(("313", "123", "321", "121", "232")), hs.tuples(*[hs.floats(-7, 7)] * 3), hs.booleans())
@settings(max_examples=60, deadline=None)
def test_rotations_of_any_sequence(sequence, angles, body):
    found = frames.rotation(list(angles), ("body" if body else "space") + sequence)
    axes = "".join("xyz"[int(c) - 1] for c in sequence)
    assert np.allclose(found, Rotation.from_euler(axes.upper() if body else axes, angles).as_matrix(), atol=1e-12)
    assert np.allclose(frames.rotation(frames.angles_313(found)), found, atol=1e-12)


def test_long_sums_and_deep_brackets(values):
    assert evaluated(values, " + ".join(["1"] * 20_000)) == 20_000
    assert evaluated(values, "(" * 25 + "1" + ")" * 25) == 1
    with pytest.raises(ViewError, match=says("deeper", "60")):
        evaluated(values, "(" * 200 + "1" + ")" * 200)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 / 0", ("zero",)),
        ("10 ** 400", ("10",)),
        ("SQRT(-1)", ("-1",)),
        ("nobody", ("nobody",)),
        ("EXECUTE(1)", ("EXECUTE",)),
        ("SIN(1, 2)", ("SIN", "2")),
        ("1 +", ("ends",)),
        ("{1, 2} + {1, 2, 3}", ("2", "3")),
        (".m.P + 1", (".m.P", "number")),
        ("5parsec", ("parsec", "unit")),
        ("__import__('os')", ("__IMPORT__",)),
        ("LOC_RELATIVE_TO({1, 2}, .m.P.A)", ("three",)),
        ("ORI_ALONG_AXIS(.m.P.A, .m.P.A, 'z')", ("direction",)),
        ("DB_CHILDREN(.m, 'joints')", ("joints", "joint")),
    ],
)
def test_what_has_no_value_is_named(values, text, words):
    with pytest.raises(ViewError, match=says(*words)):
        evaluated(values, text)


def with_places(*places):
    """Return places of markers that are modified one after the other: where the first of them is then."""
    run = Interpreter()
    run.run(MODEL + "".join(f"marker create marker_name = .m.P.{name} location = 0, 0, 0\n" for name in "FGH"))
    for name, place in zip("FGH", places):
        run.run(f"marker modify marker_name = .m.P.{name} relative_to = .m.P {place}\n")
    assert not run.errors
    return run.values.location(run.database.find(".m.P.F"))


AT = "location = (LOC_RELATIVE_TO({{{}, 0, 0}}, .m.P.{}))"


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ((AT.format(1, "G"), AT.format(1, "F")), (".m.P.F", ".m.P.G")),
        ((AT.format(0, "G"), AT.format(1, "H"), AT.format(1, "F")), (".m.P.F", ".m.P.G", ".m.P.H")),
        (("orientation = (ORI_RELATIVE_TO({0, 0, 0}, .m.P.G))  &\n " + AT.format(1, "F"),), (".m.P.F",)),
    ],
)
def test_places_in_a_circle_are_refused_by_all_names(places, words):
    with pytest.raises(ViewError, match=says("itself", "numbers", *words)):
        with_places(*places)


def test_places_and_axes_of_two_markers_are_no_circle():
    """F is where G is, and G has the axes of F: neither asks for itself."""
    found = with_places(AT.format(0, "G"), "location = 1, 2, 3 orientation = (ORI_RELATIVE_TO({0, 0, 0}, .m.P.F))")
    assert np.allclose(found, (1, 2, 3))
    found = with_places(AT.format(2, "G"), "location = 1, 2, 3 orientation = (ORI_RELATIVE_TO({90, 0, 0}, .m.P.F))")
    assert np.allclose(found, (1, 4, 3))
    assert np.allclose(with_places(AT.format(1, "G"), "location = 1, 2, 3"), (2, 2, 3))


def test_variables_in_a_row_are_no_deep_recursion():
    row = "".join(f"variable create variable_name = .m.r{k} real_value = (.m.r{k - 1} + 1)\n" for k in range(1, 500))
    model = f"{MODEL}variable create variable_name = .m.r0 real_value = (.m.list[1])\n{row}"
    run = Interpreter()
    run.run(model)
    assert not run.errors
    assert evaluated(run.values, ".m.r499") == 500
    run.run("variable modify variable_name = .m.list real_value = 7, 8\n")
    assert evaluated(run.values, ".m.r499") == 506
    run.run("variable modify variable_name = .m.r0 real_value = (.m.r499)\n")
    with pytest.raises(ViewError, match=says("real_value", "depends on itself")):
        evaluated(run.values, ".m.r499")


VALUELESS = "variable create variable_name = .swing.Q real_value = (.swing.NOPE * 2)\n"


def test_a_variable_without_a_value_is_remarked_and_refused_where_it_is_needed():
    view = parse_view(PENDULUM + VALUELESS)
    assert list(view.variables) == list(parse_view(PENDULUM).variables)
    assert not view.deck.unsupported
    assert [d.line for d in view.deck.diagnostics if "NOPE" in d.message] == [PENDULUM.count("\n") + 1]
    needed = parse_view(PENDULUM + VALUELESS + "marker create marker_name = .swing.ROD.M location = (.swing.Q), 0, 0\n")
    assert ["NOPE" in d.message for d in needed.deck.unsupported] == [True]


def test_limits_without_a_value_are_remarked():
    text = "variable create variable_name = .swing.Q real_value = 3 range = (.swing.NOPE), 3\n"
    view = parse_view(PENDULUM + text, variables={"Q": 2.0})
    assert view.variables[".swing.Q"] == 2.0
    assert any("NOPE" in d.message and "limits" in d.message for d in view.deck.diagnostics)


@pytest.mark.parametrize("held", ["3.5", "(3.5)", "(eval(7))", "{1, 2}"])
def test_an_object_that_is_a_number_is_refused_where_an_object_is_needed(held):
    text = f"variable create variable_name = .swing.WHICH object_value = {held}\n"
    assert not parse_view(PENDULUM + text).deck.unsupported
    marker = "marker create marker_name = .swing.ROD.M location = (LOC_RELATIVE_TO({0, 0, 0}, .swing.WHICH))\n"
    assert len(parse_view(PENDULUM + text + marker).deck.unsupported) == 1
