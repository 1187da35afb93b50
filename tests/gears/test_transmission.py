"""Transmission error without dynamics, with the same kernel the dynamics use."""

import math
import warnings

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from gearmbs.gears import GearPair, GearSpec, kinematic_transmission_error, loaded_transmission_error
from gearmbs.gears.faults import BrokenTooth, Crowning, EndRelief, FlankMap, LeadCorrection, PitchError, Wear
from gearmbs.gears.pattern import contact_pattern
from gearmbs.gears.transmission import StaticMesh
from tests.says import says

UM = 1e-6


@pytest.mark.parametrize(
    ("error", "mean", "peak_to_peak", "harmonics"),
    [
        (0.0, 16.574, 10.096, [4.074, 3.010, 1.671, 0.480, 0.279]),
        (3e-3, 25.489, 8.61, [2.048, 1.850, 1.552, 1.197, 0.831]),
    ],
)
@pytest.mark.slow
def test_loaded_tables(error, mean, peak_to_peak, harmonics):
    # K delta^1.3 per pair, corner contact, true moment arms, 100 N m
    te = loaded_transmission_error(GearPair.paper(centre_distance_error=error), 100.0)
    assert te.mean / UM == pytest.approx(mean, abs=6e-4)
    assert te.peak_to_peak / UM == pytest.approx(peak_to_peak, abs=6e-3 if error else 6e-4)
    assert te.harmonics() / UM == pytest.approx(harmonics, abs=6e-4)


def test_kinematic_error_is_zero_with_overlap():
    for error in (0.0, 1e-3, 2.1e-3):
        assert kinematic_transmission_error(GearPair.paper(centre_distance_error=error), 50).peak_to_peak < 1e-12


@pytest.mark.parametrize(("error", "value"), [(2.5e-3, 2.99), (3e-3, 17.91)])
def test_kinematic_error_without_overlap(error, value):
    # below contact ratio 1 a tip corner carries the motion between two spans of involute contact
    mesh = StaticMesh(GearPair.paper(centre_distance_error=error))

    def lag(phase):
        angle = phase * 2 * np.pi / 29
        return -(mesh.touching_angle(angle) - mesh.ideal_angle(angle)) * mesh.pair.driven.base_radius

    grid = np.arange(200) / 200
    at = grid[np.argmin([lag(p) for p in grid])]
    peak = minimize_scalar(lag, bounds=(at - 0.01, at + 0.01), method="bounded", options={"xatol": 1e-9})
    assert -peak.fun / UM == pytest.approx(value, abs=6e-3)


@pytest.mark.parametrize(("error", "value"), [(2.5e-3, 2.992), (3e-3, 17.91)])
def test_peaks_between_the_points_are_found(error, value):
    # the points alone see 2.93 and 17.65 um; 4000 points 2.991 and 17.895
    te = kinematic_transmission_error(GearPair.paper(centre_distance_error=error))
    assert te.peak_to_peak / UM == pytest.approx(value, abs=2e-3)
    assert te.extremes[0] <= te.error.min()
    assert te.extremes[1] >= te.error.max()


@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("wheel", ["driver", "driven"])
def test_faults_out_of_sight_are_told(rotation, wheel):
    pair = GearPair(GearSpec(17, "2 mm"), GearSpec(23, "2 mm"), rotation=rotation)
    healthy = loaded_transmission_error(pair, 20.0, 8)
    faulty = pair.with_faults(PitchError(wheel=wheel, tooth=8, amount="-40 um"))
    teeth = getattr(pair, wheel).teeth
    with pytest.warns(UserWarning, match=rf"tooth 8 of the {wheel} wheel .* cycles={teeth}"):
        hidden = loaded_transmission_error(faulty, 20.0, 8)
    assert hidden.error == pytest.approx(healthy.error, abs=1e-12)
    turn = loaded_transmission_error(faulty, 20.0, 8, cycles=teeth)
    change = abs(turn.error.reshape(teeth, 8) - healthy.error).max(axis=1)
    assert change.max() > 1e-6
    assert np.count_nonzero(change > 1e-9) <= 4
    # a cycle by itself where the tooth meshes, without a warning
    start = int(change.argmax())
    alone = loaded_transmission_error(faulty, 20.0, 8, start=start)
    assert alone.error == pytest.approx(turn.error[8 * start : 8 * start + 8], abs=1e-12)
    with pytest.raises(ValueError, match="cycles is 0"):
        loaded_transmission_error(faulty, 20.0, 8, cycles=0)


@pytest.mark.slow
def test_mesh_harmonics_of_a_whole_turn():
    pair = GearPair.paper(centre_distance_error="3 mm")
    one, turn = (kinematic_transmission_error(pair, 40, cycles=n) for n in (1, 29))
    assert turn.harmonics() == pytest.approx(one.harmonics(), abs=1e-12)
    assert turn.peak_to_peak == pytest.approx(one.peak_to_peak, abs=1e-10)
    with pytest.warns(UserWarning, match="broken tooth on tooth 10"):
        kinematic_transmission_error(pair.with_faults(BrokenTooth(tooth=10)), 4)


def test_faults_everywhere_are_not_warned_of(recwarn):
    loaded_transmission_error(GearPair.paper(faults=[Wear(), BrokenTooth(tooth=0)]), 100.0, 4)
    assert not recwarn.list


@pytest.mark.parametrize(("z1", "z2"), [(17, 38), (62, 62), (20, 53)])
def test_other_ratios(z1, z2):
    pair = GearPair(GearSpec(z1, "2 mm"), GearSpec(z2, "2 mm"))
    assert kinematic_transmission_error(pair, 20).peak_to_peak < 1e-12
    te = loaded_transmission_error(pair, 20.0, 40)
    # all pairs in full contact: r_b F = T; corners bear off the line of action and change the arm a little
    assert te.forces == pytest.approx(20.0 / pair.driven.base_radius, rel=0.03)
    # the load carries corners into contact beyond the path: one pair more at most
    assert te.pairs.min() >= 1
    assert te.pairs.max() <= np.ceil(pair.contact_ratio) + 1
    assert pair.penetration(20.0, 3) < te.error.min()
    assert te.error.max() < pair.penetration(20.0) * 1.001


def test_both_senses_of_rotation():
    one = loaded_transmission_error(GearPair.paper(centre_distance_error="1 mm"), 100.0, 40)
    two = loaded_transmission_error(GearPair.paper(centre_distance_error="1 mm", rotation=-1), 100.0, 40)
    assert two.error == pytest.approx(one.error, abs=1e-15)


def test_no_load_is_refused():
    with pytest.raises(ValueError, match="torque is 0"):
        loaded_transmission_error(GearPair.paper(), 0.0)


PLAIN = {"driver": GearSpec(23, "3 mm"), "driven": GearSpec(41, "3 mm"), "backlash": "0.1 mm"}


@pytest.mark.parametrize("law", ["own", "paper"])
@pytest.mark.parametrize("torque", [1e5, 3e5, 1e9, "100 MN m"])
def test_a_load_beyond_every_tooth_is_refused(law, torque):
    pair = GearPair(**PLAIN)
    pair = pair.with_own_stiffness() if law == "own" else pair
    for analyse in (loaded_transmission_error, contact_pattern):
        with pytest.raises(ValueError, match=says("torque", "N m", "3 mm")):
            analyse(pair, torque=torque, points=4)
    # as many N mm, or a thousandth, run
    fewer = "100 N m" if isinstance(torque, str) else min(1e-3 * torque, 3e3)
    te = loaded_transmission_error(pair, fewer, points=4)
    assert te.pairs.min() >= 1
    assert 0.0 < te.mean < 0.2 * 3e-3


@pytest.mark.parametrize("torque", [1e-6, 1e-3, 1.0])
def test_a_small_load_is_carried(torque):
    pair = GearPair(**PLAIN).with_own_stiffness()
    te = loaded_transmission_error(pair, torque, points=4)
    assert te.forces == pytest.approx(torque / pair.driven.base_radius, rel=1e-3)


@pytest.mark.parametrize("torque", [0.0, -100.0, np.inf, "100 mm"])
def test_a_load_that_is_none_is_refused_by_name(torque):
    for analyse in (loaded_transmission_error, contact_pattern):
        with pytest.raises(ValueError, match=r"^torque( is |: ).*; (give|write) "):
            analyse(GearPair(**PLAIN), torque=torque)


def test_a_load_may_be_text():
    pair = GearPair(**PLAIN)
    assert loaded_transmission_error(pair, "0.1 kN m", points=4).mean == loaded_transmission_error(pair, 100.0, 4).mean


def test_jammed_teeth_are_remarked_on():
    jammed = GearPair(**PLAIN, misalignment="1 deg")
    free = jammed.with_changes(backlash=1.01 * jammed.jam_backlash)
    for analyse in (kinematic_transmission_error, loaded_transmission_error):
        with pytest.warns(UserWarning, match=says("jam", "backlash", "0.1 mm")):
            analyse(jammed, points=2)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            analyse(free, points=2)


@pytest.mark.slow
@pytest.mark.parametrize("helix", [0.0, 15.0])
@pytest.mark.parametrize("ring", [False, True])
def test_flanks_touch_where_faults_leave_most(helix, ring):
    """The middle of a crowned flank bears without load, and the corrected one where it stands out, at its end."""
    sizes = {"module": "3 mm", "helix_angle": math.radians(helix)}
    mate = GearSpec.ring(71, **sizes) if ring else GearSpec(41, **sizes, hand="left" if helix else "right")
    pair = GearPair(GearSpec(23, **sizes), mate, backlash="0.1 mm")
    for fault in (
        Crowning(amount="20 um"),
        Crowning(amount="20 um", teeth=[0]),
        EndRelief(amount="20 um"),
        FlankMap(amounts=[["20 um"] * 2, ["0 um"] * 2, ["20 um"] * 2]),
    ):
        error = kinematic_transmission_error(pair.with_faults(fault), 3, cycles=23)
        assert abs(error.error).max() < 1e-9, fault.label
        assert error.peak_to_peak < 1e-9
    leaning = kinematic_transmission_error(pair.with_faults(LeadCorrection(amount="20 um")), 6)
    assert leaning.error == pytest.approx(-10e-6, abs=1e-9)


def test_error_of_a_crowned_pair_falls_to_that_without_load():
    pair = GearPair.paper(faults=[Crowning(amount="20 um")], axial_shift="2 mm")
    # the wheels' middles are 2 mm apart: of the crowned one it bears at mid-face
    unloaded = kinematic_transmission_error(pair, 4).error
    assert unloaded == pytest.approx(0.0, abs=1e-9)
    assert np.all(loaded_transmission_error(pair, 0.01, 4).error < 0.5e-6)


@pytest.mark.parametrize("shift", ["8 mm", "-8 mm"])
@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("ring", [False, True])
def test_an_axial_shift_of_helical_wheels_is_no_error(ring, rotation, hand, shift):
    """The driven wheel turns by its twist with the shift, some 2 mm at the base circle; what is left is the load's."""
    driver = GearSpec(23, "2 mm", face_width="20 mm", helix_angle="20 deg", hand=hand)
    other = {"right": "left", "left": "right"}[hand]
    mate = GearSpec.ring(67, "2 mm", hand=hand, face_width="20 mm", helix_angle="20 deg") if ring else GearSpec(
        37, "2 mm", hand=other, face_width="20 mm", helix_angle="20 deg")  # fmt: skip
    pair = GearPair(driver, mate, rotation=rotation, axial_shift=shift, torque=100.0)
    assert np.abs(kinematic_transmission_error(pair, points=12).error).max() < 1e-12
    opposite = loaded_transmission_error(pair.with_changes(axial_shift=0.0), points=12).mean
    # 12 mm of the 20 mm carry
    assert opposite < loaded_transmission_error(pair, points=12).mean < 20 / 12 * opposite


@pytest.mark.slow
def test_light_loads_on_tilted_wheels_are_found_where_the_teeth_are():
    """The search starts far from where an edge bears, and ends where its correction is rounding."""
    wheels = (GearSpec(20, "2 mm", face_width="20 mm"), GearSpec(60, "2 mm", face_width="20 mm"))
    pair = GearPair(*wheels, misalignment="1 deg", backlash="0.6 mm").with_own_stiffness()
    # the edge is 10 mm sin(1 deg) from mid-face, of which the flank's slope leaves a part
    errors = [loaded_transmission_error(pair, torque, points=4).error for torque in np.geomspace(0.1, 10.0, 40)]
    assert np.abs(errors).max() < 10e-3 * math.sin(math.radians(1.0))
    assert (np.diff(np.mean(errors, axis=1)) > 0.0).all()
