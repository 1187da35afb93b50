"""What of tires is not modelled is refused by its name; what is beside it runs."""

from __future__ import annotations

import pytest

from gearmbs.adams import read_view, run_deck
from gearmbs.adams.tires.property_file import TireError, read_property_file
from tests.says import says

from .files import FLAT, PAC89, PAC2002, driven, write

LEVEL = driven("5*TIME", up="-0.001", spin="16*TIME")
TEXT = PAC2002.format(mode=4)


def outcome(folder, tire=TEXT, road=FLAT, more="", **rig):
    """Return why the tire of a rig is refused, "" if it runs."""
    view = read_view(write(folder, tire, LEVEL + more, road, **rig))
    if view.deck.unsupported:
        return "; ".join(one.message for one in view.deck.unsupported)
    assert run_deck(view.deck, end=0.01, steps=1).success
    return ""


REFUSED = {
    "format": (TEXT.replace("'PAC2002'", "'FIALA'"), FLAT, ("PROPERTY_FILE_FORMAT", "FIALA", "PAC2002")),
    "coefficient": (TEXT + "QPX9 = 0.1\n", FLAT, ("QPX9", "tire.tir", "give 0")),
    "section": (TEXT + "[BOTTOMING_CURVE]\n{pen fz}\n0 0\n0.1 2\n", FLAT, ("BOTTOMING_CURVE", "take it out")),
    "contact": (
        TEXT.replace("VXLOW", "CONTACT_MODEL = '3D_ENVELOPING'\nVXLOW"),
        FLAT,
        ("CONTACT_MODEL", "MODEL", "out"),
    ),
    "mode": (TEXT.replace("USE_MODE = 4", "USE_MODE = 25"), FLAT, ("USE_MODE", "25", "give one")),
    "lag of PAC89": (PAC89.format(mode=14), FLAT, ("USE_MODE", "14", "give 1")),
    "side": (TEXT.replace("'LEFT'", "'SYMMETRIC'"), FLAT, ("TYRESIDE", "SYMMETRIC", "give LEFT")),
    "stiffness": (TEXT.replace("= 2e5", "= 0"), FLAT, ("VERTICAL_STIFFNESS", "0", "positive")),
    "factor": (TEXT.replace("LKY = 1.1", "LKY = 0"), FLAT, ("LKY", "0", "positive")),
    "missing": (TEXT.replace("FNOMIN = 4000", ""), FLAT, ("FNOMIN", "tire.tir", "missing")),
    "unit": (TEXT.replace("'meter'", "'parsec'"), FLAT, ("LENGTH", "parsec", "one of")),
    "unit of mass": (TEXT.replace("'kg'", "'stone'"), FLAT, ("MASS", "stone", "one of")),
    "twice": (TEXT + "PCX1 = 2\n", FLAT, ("PCX1", "tire.tir", "twice")),
    "road": (TEXT, FLAT.replace("'flat'", "'plank'"), ("ROAD_TYPE", "PLANK", "flat")),
    "slippery": (TEXT, FLAT.replace("MU = 1.0", "MU = 0"), ("MU", "0", "positive")),
    "lower road": (TEXT, FLAT + "[REFSYS]\nOFFSET = 0 0 5\n", ("OFFSET", "0 0 5", "marker")),
}
RUNNING = {
    "as it is": (TEXT, FLAT),
    "zero coefficient": (TEXT + "QPX9 = 0\n", FLAT),
    "shape": (TEXT + "[SHAPE]\n{radial width}\n1.0 0.0\n0.9 1.0\n", FLAT),
    "no numbers but the load": (TEXT.partition("[LONG")[0].replace("USE_MODE = 4", "USE_MODE = 0"), FLAT),
    "no unit of mass without a belt": (TEXT.replace("MASS = 'kg'\n", "").replace("MBELT", "!"), FLAT),
    "right": (TEXT.replace("'LEFT'", "'RIGHT'"), FLAT),
    "level road": (TEXT, FLAT + "[REFSYS]\nOFFSET = 0.0 0.0 0.0\nROTATION_ANGLE_XY_PLANE = 0.0\n"),
    "with relaxation": (PAC2002.format(mode=14), FLAT),
}


@pytest.mark.parametrize("case", REFUSED.values(), ids=REFUSED)
def test_what_is_not_modelled_is_named(tmp_path, case):
    tire, road, words = case
    with pytest.raises(ValueError, match=says(*words)):
        raise ValueError(outcome(tmp_path, tire, road))


@pytest.mark.parametrize("case", RUNNING.values(), ids=RUNNING)
@pytest.mark.slow
def test_what_is_beside_it_runs(tmp_path, case):
    assert outcome(tmp_path, *case) == ""


def test_instances_that_lack_something(tmp_path):
    for line, words in (
        ("variable modify variable_name = .rig.tire.long_vel real_value = 3", ("long_vel", "3", "initial_velocity")),
        (
            'variable modify variable_name = .rig.tire.property_file string_value = "x.tir"',
            ("property_file", "x.tir", "beside"),
        ),
        ('variable modify variable_name = .rig.tire.side string_value = "top"', ("side", "top", "left or")),
        ("variable modify variable_name = .rig.tire.j_fmarker object_value = (NONE)", ("j_fmarker", "tire", "missing")),
        ("marker delete marker_name = .rig.tire.wheel_part.gfo_i", ("gfo_i", "marker", "taken")),
    ):
        with pytest.raises(ValueError, match=says(*words)):
            raise ValueError(outcome(tmp_path, more=line + "\n"))


def test_a_file_outside_is_not_read(tmp_path):
    (tmp_path / "inner").mkdir()
    (tmp_path / "other.tir").write_text(TEXT)
    line = 'variable modify variable_name = .rig.tire.property_file string_value = "../other.tir"\n'
    assert "beside" in outcome(tmp_path / "inner", more=line)


def test_numbers_of_a_file_are_in_si(tmp_path):
    path = tmp_path / "a.tir"
    path.write_text(PAC89.format(mode=4))
    found = read_property_file(path)
    assert found.numbers["UNLOADED_RADIUS"] == pytest.approx(0.32)
    assert found.numbers["VERTICAL_STIFFNESS"] == pytest.approx(2e5)
    assert found.numbers["VERTICAL_DAMPING"] == pytest.approx(100.0)
    path.write_text("[UNITS]\nLENGTH = 'mm'\n")
    with pytest.raises(TireError, match=says("FORCE", "nothing", "one of")):
        read_property_file(path)
