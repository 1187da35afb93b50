"""Faults: what they do to the teeth, how they combine, and what the mesh shows."""

import math

import numpy as np
import pytest

from gearmbs.gears import GearPair, GearSpec, loaded_transmission_error
from gearmbs.gears.faults import (
    BrokenTooth,
    ChippedCorner,
    Crowning,
    CumulativePitchError,
    Eccentricity,
    EndRelief,
    Fault,
    FlankMap,
    GradedFlanks,
    LeadCorrection,
    Pit,
    PitchError,
    RootCrack,
    RootRelief,
    TipRelief,
    Waviness,
    Wear,
    Wobble,
    tolerances,
)
from gearmbs.gears.tables import tooth_deviations
from gearmbs.gears.transmission import StaticMesh, kinematic_transmission_error
from tests.says import says

ALL = [
    BrokenTooth,
    ChippedCorner,
    Crowning,
    CumulativePitchError,
    Eccentricity,
    EndRelief,
    FlankMap,
    GradedFlanks,
    LeadCorrection,
    Pit,
    PitchError,
    RootCrack,
    RootRelief,
    TipRelief,
    Waviness,
    Wear,
    Wobble,
]
TURN = 2 * math.pi / 29


def gaps(pair, driver_angle, lead=0.0, stations=(0.0,), shift=None, tilt=None):
    """Gap rows at given angles; optionally with the driver's frame shifted or turned in itself."""
    mesh = StaticMesh(pair)
    plain = StaticMesh(GearPair.paper(backlash=pair.backlash))
    driven = plain.touching_angle(driver_angle) - lead / 0.0417
    if shift is None and tilt is None:
        return mesh.gaps(driver_angle, driven, np.array(stations)).copy()
    from gearmbs.contact import GAP_COLUMNS, pair_gaps

    place = pair.frames(driver_angle, driven)
    origin = place.origin_1 + place.axes_1 @ np.append(shift if shift is not None else (0, 0), 0.0)
    axes = place.axes_1 if tilt is None else place.axes_1 @ tilt
    rows = np.zeros((200, len(GAP_COLUMNS)))
    n = pair_gaps(
        *(mesh.gi, mesh.gr, origin, np.ascontiguousarray(axes), place.origin_2, place.axes_2),
        *(np.array(stations), rows, mesh.work),
    )
    return rows[:n]


@pytest.mark.parametrize("kind", ALL)
@pytest.mark.parametrize("wheel", ["driver", "driven"])
def test_every_fault_has_a_name_a_size_and_an_effect(kind, wheel):
    fault = kind(wheel=wheel)
    assert isinstance(fault, Fault)
    assert fault.label != Fault.label
    assert fault.severity > 0
    assert fault.description["label"] == fault.label
    assert fault.description["wheel"] == wheel
    pair = GearPair.paper().with_faults(fault)
    mesh, plain = StaticMesh(pair, 41), StaticMesh(GearPair.paper(), 41)
    change = 0.0
    for k in range(29):
        for part in (0.2, 0.5, 0.9):
            angle = (k + part) * TURN
            driven = plain.ideal_angle(angle) + 25e-6 / 0.0417
            change = max(change, abs(mesh.torque(angle, driven)[0] - plain.torque(angle, driven)[0]))
    assert change > 0.5


@pytest.mark.parametrize(
    ("kind", "name", "bad", "words"),
    [
        (ChippedCorner, "height", -1e-3, ("-0.001 m", "0.006895 m")),
        (ChippedCorner, "length", "50 mm", ("0.05 m", "0.02 m")),
        (BrokenTooth, "lost", 1.2, ("1.2", "give", "1")),
        (RootCrack, "depth", 0.0, ("0.0 m", "positive")),
        (RootCrack, "angle", "-70 deg", ("-70 deg", "give", "90 deg")),
        (RootCrack, "angle", 70.0, ("4011 deg", "radians", "'70 deg'")),
        (EndRelief, "length", "0.1 mm", ("0.1 mm", "20 mm", "coarser")),
        (Pit, "width", "0.2 mm", ("0.2 mm", "20 mm", "coarser")),
        (Pit, "depth", -1e-6, ("-1e-06 m", "positive")),
        (Pit, "radius", "80 mm", ("0.08 m", "enlarge")),
        (Wear, "depth", -1e-6, ("-1e-06 m", "negative")),
        (Eccentricity, "amount", -1e-6, ("-1e-06 m", "negative")),
        (TipRelief, "length", 0.0, ("0.0 m", "positive")),
        (TipRelief, "power", 0.5, ("0.5", "give 1")),
        (GradedFlanks, "grade", 12, ("12.0", "1 to 11")),
        (TipRelief, "amount", 20, ("20 m", "3.065 mm", "'20 um'")),
        (TipRelief, "length", 3, ("3 m", "91.94 mm", "'3 mm'")),
        (Crowning, "amount", "20 mm", ("20 mm", "3.065 mm", "give less")),
        (Pit, "width", 5, ("5 m", "91.94 mm", "'5 mm'")),
        (FlankMap, "amounts", [[0.0, 0.0], [5.0, -20.0]], ("-20 m", "3.065 mm", "'-20 um'")),
        (Wobble, "angle", 0.05, ("2.865 deg", "2 deg", "radians")),
        (Wear, "flank", "top", ("'top'", "choose 'drive'")),
        (Wear, "teeth", "some", ("'some'", "give 'all'")),
    ],
)
def test_nonsense_is_named(kind, name, bad, words):
    with pytest.raises(ValueError, match=says(f"{kind.__name__}.{name}", *words)):
        GearPair.paper().with_faults(kind(**{name: bad})).contact_tables()
    with pytest.raises(ValueError, match=says(f"{kind.__name__}.wheel", "'third'", "choose 'driver'")):
        kind(wheel="third")


@pytest.mark.parametrize(
    ("kind", "name", "bad"),
    [
        (BrokenTooth, "tooth", 1.5),
        (BrokenTooth, "tooth", "a"),
        (BrokenTooth, "tooth", True),
        (BrokenTooth, "lost", [0.5]),
        (BrokenTooth, "lost", None),
        (TipRelief, "power", "two"),
        (TipRelief, "teeth", 2.5),
        (TipRelief, "teeth", [1, 2.5]),
        (TipRelief, "teeth", []),
        (TipRelief, "teeth", "some"),
        (TipRelief, "flank", "top"),
        (TipRelief, "wheel", 3),
        (ChippedCorner, "end", 0),
        (ChippedCorner, "end", 2),
        (GradedFlanks, "seed", -1),
        (GradedFlanks, "seed", 1.0),
        (GradedFlanks, "grade", 6.7),
        (GradedFlanks, "pitch", "no"),
        (CumulativePitchError, "order", 1.5),
        (Pit, "radius", "3 kg"),
    ],
)
def test_settings_are_checked_at_once(kind, name, bad):
    with pytest.raises(ValueError, match=rf"{kind.__name__}\.{name}"):
        kind(**{name: bad})


def test_numbers_of_numpy_will_do():
    order = CumulativePitchError(order=np.int64(2))
    worn = Wear(teeth=np.arange(3))
    assert order == CumulativePitchError(order=2)
    assert worn == Wear(teeth=[0, 1, 2])
    assert TipRelief(power=np.float64(2), teeth=np.int64(4)) == TipRelief(power=2.0, teeth=4)
    assert ChippedCorner(end=np.int64(-1)).end == -1
    assert Pit(radius="44 mm").radius == pytest.approx(44e-3)
    assert GradedFlanks(grade="6", pitch=np.bool_(False)).pitch is False
    GearPair.paper().with_faults(order, worn).contact_tables()


def test_eccentricity_is_a_shifted_wheel():
    # moving the driver's toothing by e in its own frame is the same as drawing the fault, to e^2 / rho
    amount, phase = 20e-6, 0.7
    pair = GearPair.paper(backlash="0.2 mm")
    faulty = pair.with_faults(Eccentricity(amount=amount, phase=phase))
    for angle in np.linspace(0, 6, 7):
        drawn = gaps(faulty, angle, 10e-6)
        moved = gaps(pair, angle, 10e-6, shift=(amount * math.cos(phase), amount * math.sin(phase)))
        flank = drawn[:, 5] == 0
        assert drawn[flank, 4] == pytest.approx(moved[flank, 4], abs=1e-7)


def test_wobble_is_a_tilted_wheel():
    angle, phase = 4e-4, 0.4
    lean = np.eye(3)
    lean[:2, 2] = angle * math.cos(phase), angle * math.sin(phase)
    lean[2, :2] = -lean[:2, 2]
    lean = np.linalg.qr(lean)[0] * np.sign(np.diag(np.linalg.qr(lean)[0]))
    pair = GearPair.paper(backlash="0.2 mm")
    faulty = pair.with_faults(Wobble(angle=angle, phase=phase))
    for driver_angle in np.linspace(0, 6, 5):
        drawn = gaps(faulty, driver_angle, 10e-6, (-8e-3, 5e-3))
        moved = gaps(pair, driver_angle, 10e-6, (-8e-3, 5e-3), tilt=lean)
        flank = (drawn[:, 5] == 0) & (moved[:, 5] == 0)
        assert drawn[flank, 4] == pytest.approx(moved[flank, 4], abs=2e-7)


def test_faults_add_up():
    pair = GearPair.paper(backlash="0.2 mm")
    one, two = Eccentricity(amount="10 um"), TipRelief(amount="20 um")
    base, first, second, both = (
        gaps(p, 0.4, 10e-6)[:, 4]
        for p in (pair, pair.with_faults(one), pair.with_faults(two), pair.with_faults(one, two))
    )
    assert both - base == pytest.approx(first - base + second - base, abs=1e-12)


def test_pitch_error_moves_one_tooth():
    pair = GearPair.paper(backlash="0.2 mm")
    plain = gaps(pair, 0.0)
    moved = gaps(pair.with_faults(PitchError(amount="12 um", tooth=0)), 0.0)
    change = moved[:, 4] - plain[:, 4]
    tooth = plain[:, 1] == 0
    assert change[tooth & (plain[:, 0] == 1)] == pytest.approx(-12e-6)
    assert change[tooth & (plain[:, 0] == -1)] == pytest.approx(12e-6)
    assert np.all(change[~tooth] == 0)


@pytest.mark.parametrize("rotation", [1, -1])
def test_cumulative_pitch_error_is_a_wave_of_displaced_teeth(rotation):
    pair = GearPair.paper(backlash="0.2 mm", rotation=rotation)
    faulty = pair.with_faults(CumulativePitchError(amount="30 um", order=2, phase="25 deg"))
    wave = np.sin(4 * math.pi * np.arange(29) / 29 + math.radians(25))
    index = 30e-6 * wave / np.ptp(wave)
    meshes = [StaticMesh(p) for p in (pair, faulty)]
    for angle in np.arange(29) * TURN:
        driven = meshes[0].touching_angle(angle)
        plain, moved = (mesh.gaps(angle, driven, np.zeros(1)).copy() for mesh in meshes)
        side = np.where(plain[:, 0] == rotation, 1.0, -1.0)
        assert moved[:, 4] - plain[:, 4] == pytest.approx(-side * index[plain[:, 1].astype(int)], abs=1e-15)
    with pytest.raises(ValueError, match=says("CumulativePitchError.order", "20", "give 1 up to 14")):
        pair.with_faults(CumulativePitchError(order=20)).contact_tables()


@pytest.mark.slow
@pytest.mark.parametrize("wheel", ["driver", "driven"])
def test_waviness_is_a_line_of_its_own_order(wheel):
    """All pairs that touch are displaced by the same wave, so that the transmission error is that wave.

    Steeper waves also let tip corners touch before the line of action.
    """
    waves, amount = 47, 2e-7
    pair = GearPair.paper(backlash="0.2 mm").with_faults(Waviness(wheel=wheel, amount=amount, waves=waves))
    teeth = 29 if wheel == "driver" else pair.driven.teeth
    cycles = teeth
    error = kinematic_transmission_error(pair, 24, cycles=cycles)
    turn = 2 * np.pi * error.phase / teeth
    wave = np.stack([np.cos(waves * turn), np.sin(waves * turn)], axis=1)
    size = np.linalg.lstsq(wave, error.error, rcond=None)[0]
    assert np.hypot(*size) == pytest.approx(amount, rel=0.01)
    assert np.abs(error.error - wave @ size).max() < 0.03 * amount
    with pytest.raises(ValueError, match=says("Waviness.waves", "900")):
        pair.with_faults(Waviness(waves=900)).contact_tables()


def removed(fault, places, stations):
    """Material a fault takes from the driver's drive flank of tooth 0, where it touches at these lengths of roll, m."""
    pair = GearPair.paper(backlash="0.2 mm")
    gear = pair.wheels[0]
    meshes = [StaticMesh(pair, 41), StaticMesh(pair.with_faults(fault), 41)]
    found = np.empty((len(places), len(stations)))
    for k, roll_length in enumerate(places):
        # tooth 0 touches at length of roll s when the driver is at s / r_b - psi - alpha
        angle = roll_length / gear.base_radius - gear.base_half_angle - pair.working_pressure_angle
        driven = meshes[0].touching_angle(angle)
        rows = [mesh.gaps(angle, driven, np.array(stations)).copy() for mesh in meshes]
        mine = [r[(r[:, 0] == 1) & (r[:, 1] == 0)] for r in rows]
        found[k] = mine[1][:, 4] - mine[0][:, 4]
    return found


def test_shapes_stand_where_they_were_put():
    pair = GearPair.paper(backlash="0.2 mm")
    tip, pitch = pair.driver.tip_roll_length, pair.driver.base_radius * math.tan(pair.working_pressure_angle)
    start = pair.line_of_action - pair.driven.tip_roll_length
    micron = 1e-6
    # 20 um at the tip, parabola over 3 mm: a quarter of it half-way, nothing below
    relief = removed(TipRelief(amount="20 um", power=2.0), [tip - 1e-9, tip - 1.5e-3, tip - 4e-3], [0.0])[:, 0]
    assert relief == pytest.approx([20 * micron, 5 * micron, 0.0], abs=0.1 * micron)
    # the same from the start of the active profile upwards, where the curve through the stations rounds the bend
    relief = removed(RootRelief(amount="20 um", power=2.0), [start + 1e-9, start + 1.5e-3, start + 4e-3], [0.0])[:, 0]
    assert relief == pytest.approx([20 * micron, 5 * micron, 0.0], abs=0.3 * micron)
    # parabola over the face: 10 um at its ends, a quarter of it half-way
    crown = removed(Crowning(amount="10 um"), [pitch], [-9.999e-3, -5e-3, 0.0, 5e-3])[0]
    assert crown == pytest.approx([10 * micron, 2.5 * micron, 0.0, 2.5 * micron], abs=0.05 * micron)
    # a pit 50 um deep, 5 mm wide, at 3 mm from mid-face on the pitch circle
    pit = removed(Pit(position="3 mm"), [pitch], [3e-3, 3e-3 + 1.25e-3, 6e-3, -3e-3])[0]
    assert pit == pytest.approx([50 * micron, 37.5 * micron, 0.0, 0.0], abs=2 * micron)
    # wear: nothing where nothing slides, all of it where most does
    worn = removed(Wear(depth="20 um"), [pitch, start + 1e-9], [0.0])[:, 0]
    assert worn == pytest.approx([0.0, 20 * micron], abs=0.7 * micron)


@pytest.mark.parametrize(("wheel", "hand"), [("driver", "right"), ("driven", "left")])
def test_a_helix_turns_the_wave_along_the_face(wheel, hand):
    """Where helical flanks touch their normal is the same: a wave over its direction moves all of them alike."""
    helix, other = {"helix_angle": "25 deg", "face_width": "60 mm"}, {"right": "left", "left": "right"}[hand]
    one, two = GearSpec(25, "3 mm", hand=hand, **helix), GearSpec(40, "3 mm", hand=other, **helix)
    plain = GearPair(one, two, backlash="0.2 mm")
    sections = np.linspace(-29e-3, 29e-3, 31)

    def touching(pair, angle, driven):
        rows = StaticMesh(pair).gaps(angle, driven, sections)
        return rows[(rows[:, 0] == 1) & (rows[:, 5] == 0)].copy()

    for kind, amount in ((Waviness(wheel=wheel, amount="1 um", waves=20), 1e-6), (Eccentricity(wheel=wheel), 20e-6)):
        means = []
        for angle in (0.0, 0.03, 0.05):
            driven = StaticMesh(plain).touching_angle(angle)
            found, bare = (touching(p, angle, driven) for p in (plain.with_faults(kind), plain))
            bears = np.abs(bare[:, 4]) < 1e-9
            assert len(found) == len(bare)
            assert bears.sum() > 20
            moved = found[bears, 4] - bare[bears, 4]
            assert np.ptp(moved) < 0.03 * amount
            means.append(moved.mean())
        assert 0.05 * amount < np.abs(means).max() < 1.01 * amount


def test_short_details_of_a_wide_face_have_sections_and_slices_of_their_own():
    wheels = [GearSpec(z, "3 mm", face_width="100 mm") for z in (25, 40)]
    pair = GearPair(*wheels, faults=[EndRelief(amount="20 um", length="3 mm")])
    deviations = tooth_deviations(pair)[0]
    relief = 20e-6 * np.maximum(0.0, 1 - (50e-3 - np.abs(deviations.section)) / 3e-3) ** 2
    assert deviations.shape[0, 0, :, 0] == pytest.approx(relief, abs=1e-12)
    assert pair.face_slices * 1e-3 >= 100e-3 > 100 * np.diff(deviations.section)[0]
    # of the paper's face they are as many as ever
    assert GearPair.paper(faults=[EndRelief(), Pit()]).face_slices == 41
    crowned = GearPair(*(GearSpec(z, "3 mm", face_width="100 mm", helix_angle="30 deg", hand=hand)
                         for z, hand in ((25, "right"), (40, "left"))), faults=[Crowning()])  # fmt: skip
    assert crowned.face_slices == crowned.with_changes(faults=()).face_slices > 100


def test_chipped_corner_shortens_one_end():
    # 2 mm of height missing at +z, nothing from 5 mm on: the corner bears lower there
    fault = ChippedCorner(height="2 mm", length="5 mm", tooth=0)
    deviations = tooth_deviations(GearPair.paper().with_faults(fault))[0]
    gear = GearPair.paper().driver
    radius = np.hypot(gear.base_radius, deviations.tip[:, 0])
    expected = gear.tip_radius - 2e-3 * np.maximum(0.0, 1 - (10e-3 - deviations.section) / 5e-3)
    assert radius == pytest.approx(np.tile(expected, (2, 1)), abs=1e-12)
    assert np.all(deviations.tip[:, 1:] == gear.tip_roll_length)


def test_broken_tooth_touches_lower_down():
    pair = GearPair.paper()
    faulty = pair.with_faults(BrokenTooth(lost=0.25, tooth=0))
    gear = pair.driver
    radius = gear.tip_radius - 0.25 * (gear.tip_radius - gear.root_radius)
    roll_length = math.sqrt(radius**2 - gear.base_radius**2)
    rows = np.concatenate([gaps(faulty, a) for a in np.linspace(-0.1, 0.3, 40)])
    mine = rows[(rows[:, 1] == 0) & (rows[:, 0] == 1)]
    corners = mine[mine[:, 5] == 1]
    assert corners[:, 6] == pytest.approx(roll_length)
    assert mine[:, 6].max() <= roll_length * (1 + 1e-12)


@pytest.mark.slow
def test_severity_shows_in_the_mesh():
    def swing(fault):
        pair = GearPair.paper().with_faults(fault)
        mesh = StaticMesh(pair)
        lag = []
        for angle in np.arange(29 * 4) * TURN / 4:
            ideal = mesh.ideal_angle(angle)
            lag.append(mesh.loaded_angle(angle, 100.0, ideal + 20e-6 / 0.0417) - ideal)
        spectrum = abs(np.fft.rfft(lag)) * 2 / len(lag) * 0.0417
        return spectrum[1:29]

    # once per revolution and its harmonics below the mesh frequency: none when healthy, rising with severity
    levels = [np.linalg.norm(swing(BrokenTooth(lost=x))) for x in (0.2, 0.4, 0.8)]
    assert 1e-8 < levels[0] < levels[1] <= levels[2]
    levels = [np.linalg.norm(swing(RootCrack(depth=d))) for d in (1e-3, 2e-3, 3e-3)]
    assert 1e-9 < levels[0] < levels[1] < levels[2]
    for amount in (10e-6, 30e-6):
        assert swing(Eccentricity(amount=amount))[0] == pytest.approx(amount, rel=0.02)
    assert np.linalg.norm(swing(TipRelief())) < 1e-12


@pytest.mark.slow
def test_sidebands_around_the_mesh_frequency():
    # one point per tooth quarter over a revolution: line 29 is the mesh frequency, 28 and 30 its sidebands
    def lines(**changes):
        mesh = StaticMesh(GearPair.paper(backlash="0.6 mm", **changes))
        lag = []
        for angle in np.arange(29 * 8) * TURN / 8:
            ideal = mesh.ideal_angle(angle)
            lag.append((mesh.loaded_angle(angle, 100.0, ideal + 20e-6 / 0.0417) - ideal) * 0.0417)
        spectrum = abs(np.fft.rfft(lag)) * 2 / len(lag)
        return spectrum[29], max(spectrum[28], spectrum[30])

    mesh_line, clean = lines()
    assert clean < 1e-4 * mesh_line
    small, large = (lines(faults=[Eccentricity(amount=a)])[1] for a in (20e-6, 80e-6))
    assert 10 * clean < small < large
    for changes in ({"misalignment": "0.5 deg"}, {"centre_distance_error": "1 mm"}):
        line, side = lines(**changes)
        assert side < 1e-4 * line


def test_symmetric_crowning_carries_in_the_middle():
    pair = GearPair.paper().with_faults(Crowning(amount="20 um"))
    te = loaded_transmission_error(pair, 100.0, 8)
    assert np.all(te.error > loaded_transmission_error(GearPair.paper(), 100.0, 8).error)


def test_lead_correction_undoes_a_skew():
    # skew by gamma opens the drive flanks by gamma cos(alpha) per unit of face
    gamma = math.radians(0.05)
    skewed = GearPair.paper(misalignment=gamma, backlash="0.2 mm")
    amount = gamma * math.cos(math.radians(20)) * 20e-3
    spread = {}
    for sign in (1, 0, -1):
        pair = skewed.with_faults(LeadCorrection(amount=sign * amount, flank="drive"))
        rows = gaps(pair, 0.05, 10e-6, (-9e-3, 9e-3))
        rows = rows[(rows[:, 0] == 1) & (rows[:, 5] == 0)]
        spread[sign] = abs(rows[1::2, 4] - rows[::2, 4]).max()
    assert min(spread[1], spread[-1]) < 0.01 * spread[0]
    assert max(spread[1], spread[-1]) == pytest.approx(2 * spread[0], rel=0.01)


@pytest.mark.parametrize("grade", [3, 6, 9])
def test_graded_flanks_meet_their_tolerances(grade):
    pair = GearPair.paper().with_faults(GradedFlanks(grade=grade, seed=5, profile=False, lead=False))
    limit = tolerances(pair.driver, grade)
    deviations = tooth_deviations(pair)[0]
    for flank in (0, 1):
        index = deviations.offset[flank]
        single = abs(np.diff(np.append(index, index[0]))).max()
        assert single <= limit.single_pitch * (1 + 1e-12)
        assert np.ptp(index) <= limit.total_pitch * (1 + 1e-12)
        assert single == pytest.approx(limit.single_pitch) or np.ptp(index) == pytest.approx(limit.total_pitch)
    again = tooth_deviations(
        GearPair.paper().with_faults(GradedFlanks(grade=grade, seed=5, profile=False, lead=False))
    )[0]
    assert np.array_equal(again.offset, deviations.offset)


def test_iso_1328_formulas():
    # grade 5, d = 100 mm, m = 4 mm, b = 25 mm: f_pT = 0.1 + 1.6 + 5 = 6.7 um, F_pT = 0.2 + 5.5 + 2.8 + 12 = 20.5 um
    limit = tolerances(GearSpec(25, "4 mm", face_width="25 mm"), 5)
    assert limit.single_pitch == pytest.approx(6.7e-6)
    assert limit.total_pitch == pytest.approx(20.5e-6)
    assert tolerances(GearSpec(25, "4 mm"), 7).single_pitch == pytest.approx(2 * 6.7e-6)


def test_wear_is_least_at_the_pitch_point():
    pair = GearPair.paper().with_faults(Wear(depth="20 um"))
    deviations = tooth_deviations(pair)[0]
    worn = deviations.shape[deviations.drive, 3, 0]
    assert abs(deviations.radius[worn.argmin()] - pair.driver.pitch_radius) < 0.3e-3
    assert worn.max() == pytest.approx(20e-6, rel=0.05)
    assert np.all(deviations.shape[1 - deviations.drive] == 0)


def test_end_relief_takes_from_the_ends_of_the_face():
    pair = GearPair.paper(backlash="0.4 mm", faults=[EndRelief(amount="20 um", length="4 mm", ends=1)])
    shape = tooth_deviations(pair)[0].shape[0, 3]
    section = tooth_deviations(pair)[0].section
    assert shape[-1, 0] == pytest.approx(20e-6)
    assert np.all(shape[section <= 6e-3] == 0)
    assert shape[np.isclose(section, 8.125e-3), 5] == pytest.approx(20e-6 * (2.125 / 4) ** 2)
    with pytest.raises(ValueError, match=says("EndRelief.length", "face width")):
        tooth_deviations(GearPair.paper(faults=[EndRelief(length="30 mm")]))
    with pytest.raises(ValueError, match="ends is 2"):
        tooth_deviations(GearPair.paper(faults=[EndRelief(ends=2)]))


def test_flank_map_passes_through_its_numbers():
    amounts = [["1 um", "2 um", "4 um"], ["0 um", "0 um", "-1 um"], ["3 um", "3 um", "3 um"]]
    pair = GearPair.paper(faults=[FlankMap(amounts=amounts, teeth=2, flank="drive")])
    found = tooth_deviations(pair)[0]
    assert found.shape[0, 2, 0, -1] == pytest.approx(4e-6)
    assert found.shape[0, 2, 16, -1] == pytest.approx(-1e-6)
    assert found.shape[0, 2, 8, 0] == pytest.approx(0.5e-6)
    assert np.all(found.shape[0, 2, -1] == pytest.approx(3e-6))
    assert not found.shape[1].any()
    assert not found.shape[0, 1].any()
    assert pair.faults[0].severity == pytest.approx(4e-6)
    for wrong in ([[0.0, 1.0]], [[0.0, 1e-6], [0.0]], "flat", [[0.0, float("nan")], [0.0, 0.0]]):
        with pytest.raises(ValueError, match=r"FlankMap\.amounts"):
            FlankMap(amounts=wrong)


@pytest.mark.parametrize("relief", [TipRelief, RootRelief, EndRelief])
def test_reliefs_take_material_away(relief):
    with pytest.raises(ValueError, match=rf"{relief.__name__}.amount is -10 um: a relief .* 0 or more, .* FlankMap"):
        relief(amount="-10 um")
    assert relief(amount=0.0).amount == 0.0
    # more material where it is meant
    assert FlankMap(amounts=((0.0, -1e-5), (0.0, -1e-5))).severity == 1e-5
