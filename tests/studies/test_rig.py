"""The test stand of a pair: its arguments are quantities, and its load is the pair's unless given."""

from __future__ import annotations

import math

import pytest

from gearmbs.gears import GearPair
from gearmbs.studies import gear_rig
from gearmbs.studies.run.rig import DRIVE, LOAD

PAIR = GearPair.paper(backlash="0.1 mm", torque="60 N m", rotation=-1)


def drive_and_load(rig):
    return rig.joints[DRIVE].rows[0].rotation, rig.elements[LOAD].function


def test_text_with_units_is_read():
    text = gear_rig(PAIR, speed="1000 rpm", torque="60 N m", run_up="50 ms", shaft_radius="15 mm", shaft_length="20 cm")
    plain = gear_rig(PAIR, speed=1000 * math.pi / 30, torque=60.0)
    for one, two in zip(drive_and_load(text), drive_and_load(plain)):
        assert one.parameters == pytest.approx(two.parameters, rel=1e-14)
    assert text.bodies["shaft 1"].mass == pytest.approx(plain.bodies["shaft 1"].mass, rel=1e-14)


def test_load_is_the_pairs_unless_given():
    _, own = drive_and_load(gear_rig(PAIR, speed=100.0))
    _, given = drive_and_load(gear_rig(PAIR, speed=100.0, torque=60.0))
    assert own == given


@pytest.mark.parametrize("wrong", [{"speed": "1000 mm"}, {"speed": "fast"}, {"speed": 100.0, "torque": "3 rpm"}])
def test_other_quantities_are_refused(wrong):
    with pytest.raises(ValueError, match=next(reversed(wrong))):
        gear_rig(PAIR, **wrong)
