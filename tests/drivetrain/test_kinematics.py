"""The kinematic table against hand calculation."""

import numpy as np
import pytest

from gearmbs.drivetrain import DrivetrainError, IdealBearing, Pump
from tests.drivetrain.support import stage
from tests.says import says


@pytest.fixture(scope="module")
def table():
    return stage(
        bearings=[IdealBearing(name="a", shaft="in", rolling="6205"), IdealBearing(name="b", shaft="out")],
        loads=[Pump(name="pump", shaft="out", displacement=1e-4, pressure=1e6, teeth=11)],
    ).kinematics


def test_frequencies(table):
    assert table.mesh_frequency("mesh") == pytest.approx(500.0)
    assert table.ratio("in", "out") == pytest.approx(-3.0)
    # 20 and 60 teeth: the same two meet once a turn of the wheel
    assert table.hunting_frequency("mesh") == pytest.approx(25 / 3)
    assert table.common_period() == pytest.approx(3 / 25)
    found = table.bearing_frequencies("a")
    # multiples of a 6205 that its maker prints
    for name, multiple in {"FTF": 0.3983, "BPFO": 3.5848, "BPFI": 5.4152, "BSF": 4.7135 / 2}.items():
        assert found[name] / 25.0 == pytest.approx(multiple, abs=6e-5)
    assert found["BPFO"] + found["BPFI"] == pytest.approx(9 * 25.0)
    lines = table.lines.set_index(["of", "name"]).frequency
    assert lines["pump", "displacement"] == pytest.approx(11 * 25 / 3)
    with pytest.raises(DrivetrainError, match="no rolling geometry"):
        table.bearing_frequencies("b")


def test_sidebands_and_names_of_lines(table):
    bands = table.sidebands("mesh", harmonics=1, order=1).frequency.values
    np.testing.assert_allclose(sorted(bands), [475.0, 500 - 25 / 3, 500 + 25 / 3, 525.0])
    assert table.nearest(1000.4)[0] == "2 x GMF of mesh"
    name, off = table.nearest(974.0)
    assert (name, round(off, 6)) == ("2 x GMF of mesh -1 x in", -1.0)
    assert table.for_analysis("mesh") == {"speed": pytest.approx(50 * np.pi), "teeth": (20, 60)}


def test_lines_by_what_they_come_from(table):
    parts = table.lines_by_part(harmonics=2, order=1)
    meshing = ["mesh mesh", "sidebands of mesh", "hunting teeth of mesh"]
    assert list(parts) == ["shaft in", "shaft out", *meshing, "bearing a", "load pump"]
    assert parts["mesh mesh"] == pytest.approx({"1 x GMF of mesh": 500.0, "2 x GMF of mesh": 1000.0})
    assert len(parts["sidebands of mesh"]) == 8
    assert table.known_lines(2, 1) == {name: at for lines in parts.values() for name, at in lines.items()}


def test_bearings_and_shafts_for_a_diagnosis(table):
    from gearmbs.signals import diagnose_bearing, make_signal

    given = table.for_bearings()
    assert given["speed"] == pytest.approx(50 * np.pi)
    assert given["shafts"] == pytest.approx([1 / 3])
    assert [(name, ratio) for name, (_, ratio) in given["bearing"].items()] == [("a", 1.0)]
    report = diagnose_bearing(make_signal(np.random.default_rng(0).standard_normal(40000), 8000.0), **given)
    assert report.fault is None
    assert report.shafts == pytest.approx((1 / 3,))
    assert table.for_bearings("out")["bearing"]["a"][1] == pytest.approx(3.0)
    with pytest.raises(DrivetrainError, match=says("'elsewhere'", "drivetrain's")):
        table.for_bearings("elsewhere")


def test_table_as_text(table):
    assert "| mesh | mesh | GMF | 500 | 20 |" in table.to_markdown()
    assert "<table" in table._repr_html_()
    assert "hunting tooth" in repr(table)
