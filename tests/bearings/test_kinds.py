"""The table of kinds of bearings is the only place that tells them apart: a row makes a kind known everywhere."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gearmbs
from gearmbs.bearings import Bearing, BearingError, BearingStatics, RollingBearing
from gearmbs.bearings.kinds import KINDS, Known
from gearmbs.bearings.rating import dynamic_rating, equivalent_load
from gearmbs.mechanism import Mechanism
from tests.says import says

PACKAGE = Path(gearmbs.__file__).parent
GIVEN = {"elements": 11, "element_diameter": 7.94e-3, "pitch_diameter": 38.5e-3}


def _known(found, boundary):
    fields = {**boundary, "pitch_diameter": 0.5 * (boundary["bore"] + boundary["outside_diameter"])}
    return Known({**fields, "contact_angle": math.radians(30.0)}, ("elements", "element_diameter"))


@pytest.fixture
def another(monkeypatch):
    """Add a kind as anybody would: by a row. Its balls touch one shoulder, as of angular contact."""
    row = replace(
        KINDS["angular contact"],
        reduction=0.9,
        designation=re.compile(r"^XB([23])(\d\d)(?!\d)"),
        known=_known,
        unclassed="theirs is another",
        load_factors=lambda bearing, radial, axial: (0.5, 0.4, 2.0),
    )
    monkeypatch.setitem(KINDS, "magneto", row)


@pytest.mark.usefixtures("another")
def test_a_row_makes_a_kind():
    bearing = Bearing(kind="magneto", contact_angle="25 deg", **GIVEN)
    same = bearing.changed(kind="angular contact")
    assert dynamic_rating(bearing) == pytest.approx(0.9 / 0.95 * dynamic_rating(same))
    assert equivalent_load(bearing, 100.0, 80.0) == pytest.approx(0.4 * 100.0 + 2.0 * 80.0)
    load = [200.0, 0.0, 300.0]
    found, expected = (BearingStatics(b).under(load) for b in (bearing, same))
    np.testing.assert_array_equal(found.displacement, expected.displacement)
    by_name = Bearing.from_designation("XB205", elements=12, element_diameter="7.5 mm")
    assert (by_name.kind, by_name.contact_angle) == ("magneto", pytest.approx(math.radians(30.0)))


@pytest.mark.usefixtures("another")
def test_messages_know_it():
    with pytest.raises(BearingError, match=says("magneto", "choose deep groove")):
        Bearing(kind="needle", **GIVEN)
    with pytest.raises(BearingError, match=says("contact_angle", "0", "bearing", "kind 'magneto'")):
        Bearing(kind="magneto", **GIVEN)
    with pytest.raises(BearingError, match=r"XB205': magneto bearing, .* give elements="):
        Bearing.from_designation("XB205")
    with pytest.raises(BearingError, match=says("C3", "magneto")):
        Bearing.from_designation("XB205C3", elements=12, element_diameter="7.5 mm")
    bearing = Bearing(kind="magneto", contact_angle="25 deg", **GIVEN)
    with pytest.warns(UserWarning, match=says("magneto bearing", "against its sense")):
        BearingStatics(bearing).under([200.0, 0.0, -300.0])


def test_no_other_module_tells_kinds_apart():
    """By name; the catalogue has bearings of certain kinds, and deep groove is the kind where none is given."""
    names = "|".join(KINDS)
    word = re.compile(rf"[\"']({names})[\"']")
    found = {
        f"{path.relative_to(PACKAGE).as_posix()}: {name}"
        for path in PACKAGE.rglob("*.py")
        for name in word.findall(path.read_text(encoding="utf-8"))
        if path.name != "kinds.py"
    }
    assert found <= {"bearings/designations/catalogue.py: angular contact", "bearings/bearing.py: deep groove"}


@pytest.mark.parametrize("kind", ["angular contact", "tapered roller"])
def test_a_preload_below_what_a_negative_clearance_presses_is_refused(kind):
    rollers = {"roller_length": "9.5 mm"} if "roller" in kind else {}
    bearing = Bearing(
        kind=kind, elements=11, element_diameter="7.94 mm", pitch_diameter="38.5 mm", contact_angle="25 deg",
        clearance="-20 um", **rollers,
    )  # fmt: skip
    m = Mechanism("seat")
    shaft = m.body("shaft", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
    with pytest.raises(BearingError, match=says("preload", "10", "clearance", "-20")):
        RollingBearing("A", shaft.marker(), m.ground.marker(), bearing=bearing, preload="10 N")
    assert RollingBearing("A", shaft.marker(), m.ground.marker(), bearing=bearing, preload="30 kN")
