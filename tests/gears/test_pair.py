"""What a pair is made of: geometry, contact model, operating point; the friendly class puts them together."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gearmbs.gears import ContactLaw, ContactModel, FlankFriction, GearPair, GearSpec, OperatingPoint, PairGeometry
from gearmbs.gears.faults import Pit, Wear
from gearmbs.gears.tables import pack

WHEELS = (GearSpec(17, "2 mm", name="driver"), GearSpec(38, "2 mm", name="driven"))


def test_parts_of_a_pair_hold_what_it_was_given():
    law = ContactLaw.impact(depth="0.05 mm")
    pair = GearPair(
        *WHEELS,
        centre_distance_error="0.2 mm",
        misalignment="0.5 deg",
        backlash="0.1 mm",
        contact=law,
        friction=FlankFriction.none(),
        rotation=-1,
        torque="60 N m",
        load="adams",
    )
    assert pair.geometry == PairGeometry(
        *WHEELS, centre_distance_error=2e-4, misalignment=math.radians(0.5), backlash=1e-4
    )
    assert pair.operating_point == OperatingPoint(60.0, -1)
    assert pair.contact_model == ContactModel(law, FlankFriction.none(), load="adams")
    assert pair.torque == 60.0
    assert pair.normal_force == pair.operating_point.normal_force(pair.geometry) == 60.0 / WHEELS[1].base_radius


def test_a_changed_pair_has_changed_parts():
    pair = GearPair(*WHEELS)
    assert pair.operating_point.torque == 100.0
    assert pair.with_changes(torque=7.0).operating_point.torque == 7.0
    assert pair.with_changes(slices=3).contact_model.slices == 3
    assert pair.with_changes(pivot=1e-3).geometry.pivot == 1e-3


def test_where_the_mate_touches():
    """On the line of action the lengths of roll of both wheels add up to its length."""
    geometry = GearPair.paper(centre_distance_error="1 mm").geometry
    assert geometry.sign == 1
    assert geometry.mate_roll_length(0, 12e-3) + 12e-3 == pytest.approx(geometry.line_of_action, rel=1e-15)
    assert geometry.mate_roll_length(1, geometry.mate_roll_length(0, 12e-3)) == pytest.approx(12e-3, rel=1e-14)
    start = geometry.start_of_active_profile[0]
    assert math.sqrt(start**2 - geometry.driver.base_radius**2) == pytest.approx(geometry.first_roll_lengths[0])


@pytest.mark.parametrize(
    ("changes", "slices"),
    [
        ({}, 1),
        ({"misalignment": "0.1 deg"}, 11),
        ({"axial_shift": "1 mm"}, 11),
        ({"faults": [Wear()]}, 1),
        ({"faults": [Pit()]}, 41),
        ({"faults": [Pit()], "slices": 5}, 5),
    ],
)
def test_slices_follow_what_varies_along_the_face(changes, slices):
    assert GearPair.paper(backlash="0.5 mm", **changes).face_slices == slices


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: OperatingPoint(rotation=2), r"OperatingPoint.rotation is 2"),
        (lambda: OperatingPoint("3 mm"), r"OperatingPoint.torque"),
        (lambda: ContactModel(slices=0), r"ContactModel.slices is 0"),
        (lambda: ContactModel(load="x"), r"ContactModel.load is 'x'"),
        (lambda: GearPair(*WHEELS, rotation=2), r"GearPair.rotation is 2"),
        (lambda: GearPair(*WHEELS, torque=math.inf), r"GearPair.torque is inf"),
        (lambda: PairGeometry(*WHEELS, backlash=-1e-3), r"PairGeometry.backlash is -1 mm"),
        (lambda: PairGeometry(*WHEELS, centre_distance_error="-3 mm"), r"PairGeometry: overlapping wheels"),
    ],
)
def test_wrong_settings_are_named_by_their_owner(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_pair_keeps_the_input_torque_that_it_was_given():
    """The torque on the driven wheel follows from it with other wheels; one that was given itself stays."""
    driver, driven, other = (GearSpec(z, "3 mm") for z in (19, 37, 57))
    pair = GearPair(driver, driven, input_torque="30 N m")
    for changed in (pair, pair.with_own_stiffness(), pair.with_changes(slices=3)):
        assert changed.torque == pytest.approx(30.0 * 37 / 19, rel=1e-14)
        assert changed.with_changes(driven=other).torque == pytest.approx(30.0 * 57 / 19, rel=1e-14)
    assert pair.with_changes(driven=other, torque=70.0).torque == 70.0
    assert pair.with_changes(torque=70.0).with_changes(driven=other).torque == 70.0
    assert GearPair(driver, driven, torque=70.0).with_changes(driven=other).torque == 70.0


def test_tables_are_those_of_a_pair_whatever_was_packed_before_it():
    changes = [
        {"torque": "10 N m"},
        {"rotation": -1},
        {"slices": 3},
        {"contact": ContactLaw.linear("1e8 N/m")},
        {"friction": FlankFriction.none()},
        {"faults": (Wear(depth="20 um"),)},
        {"faults": (Wear(depth="30 um"),)},
        {"centre_distance_error": "0.1 mm"},
    ]
    pairs = [GearPair(*WHEELS, backlash="0.1 mm", **change) for change in changes]
    alone = []
    for pair in pairs:
        pack(GearPair.paper())
        alone.append(pack(pair))
    for pair, (gi, gr, size) in zip(pairs, alone, strict=True):
        found = pack(pair)
        assert np.array_equal(found[0], gi)
        assert np.array_equal(found[1], gr)
        assert found[2] == size
        # whoever has tables may change them
        found[1][:] = 0.0
        assert np.array_equal(pack(pair)[1], gr)
    # the load is in none of them
    loads = [pack(GearPair(*WHEELS, backlash="0.1 mm", torque=torque))[1] for torque in ("5 N m", "50 N m")]
    assert np.array_equal(*loads)
