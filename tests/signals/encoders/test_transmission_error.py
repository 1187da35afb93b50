"""Transmission error from the pulses of two encoders: against the exact one of the bench, with and without marks."""

import dataclasses
import math
from fractions import Fraction

import numpy as np
import pytest
from scipy import stats

import gearmbs as gm
from gearmbs.signals import (
    CoupledRun,
    SignalError,
    encoder,
    mark_errors,
    pulse_train,
    transmission_error_from_pulses,
)
from gearmbs.signals.encoders.estimate import amplitude_interval
from gearmbs.signals.encoders.plausible import repeating_marks
from gearmbs.view import measured_error_plot
from tests.generators import seed
from tests.says import says
from tests.signals.encoders.bench import Discs, angle, closed, coupled, free, paper_error

TEETH = (29, 29)


def paper_angles(torque=100.0, turns=20, rate=40e3):
    error, radius = paper_error(torque)
    lag = closed(error.error)
    return coupled(lambda turned: lag(29 * turned), TEETH, radius, turns, rate=rate)


def exact_lines(error, count):
    return np.abs(np.fft.rfft(error.error))[1 : count + 1] * 2 / error.error.size


@pytest.mark.slow
def test_marks_known_from_free_runs_leave_the_mesh_harmonics_within_two_percent():
    error, radius = paper_error()
    discs = Discs()
    found = transmission_error_from_pulses(
        discs.run(paper_angles(turns=60, rate=100e3)), TEETH, base_radius=radius, free=discs.free(seconds=2.0)
    )
    mesh, exact = found.harmonics(), exact_lines(error, 17)
    assert len(mesh) == 17
    assert mesh["calibrated"].all()
    assert np.all(np.abs(mesh["amplitude"] - exact)[:7] < 0.02 * exact[:7])
    # what counting leaves of a small one
    assert np.all(np.abs(mesh["amplitude"] - exact) < 0.05e-6)
    assert any("mesh harmonic 18" in text.lower() for text in found.refused)
    # the curve, as far as 17 harmonics hold it
    lines = np.fft.rfft(error.error)
    lines[0] = lines[18:] = 0.0
    off = found.mesh_cycle(points=400)[1] - np.fft.irfft(lines, 400)
    assert np.sqrt(np.mean(off**2)) < 0.04e-6
    assert np.abs(off).max() < 0.1e-6
    pair = found.single_flank().set_index("of").loc["pair"]
    assert pair["f_l"] < pair["within"]
    assert abs(pair["F_i"] - error.peak_to_peak) < pair["within"] + 0.5e-6


@pytest.mark.slow
@pytest.mark.parametrize("pitch", [0.0, 3e-6])
def test_teeth_that_are_alike_show_harmonics_beyond_half_the_lines(pitch):
    """The corners of the loaded curve within 0.1 um by 1024 lines; of teeth that differ the interval knows it."""
    error, radius = paper_error()
    lag, teeth = closed(error.error), pitch * np.random.default_rng(seed(4)).standard_normal(29)

    def both(turned):
        tooth = 29 * turned
        return lag(tooth) + (teeth - teeth.mean())[np.floor(tooth).astype(int) % 29] * np.sin(np.pi * tooth) ** 2

    angles, discs = coupled(both, TEETH, radius, turns=80, rate=60e3), Discs(seed=seed(2))
    known = {"base_radius": radius, "free": discs.free(seconds=6.0), "harmonics": 64}
    found = transmission_error_from_pulses(discs.run(angles), TEETH, **known)
    mesh = found.harmonics()
    exact = exact_lines(error, 64)[mesh["harmonic"] - 1]
    # those folded to the shaft's orders 9 and 20 are none
    assert sorted({*range(1, 65)} - {*mesh["harmonic"]}) == [35, 36]
    assert "Mesh harmonics 35, 36" in found.refused[0]
    covered = (mesh["low"] <= exact) & (exact <= mesh["high"])
    # of 62 at 95 %, fewer than 53 are seen once in 1000 times
    assert covered.sum() >= 53
    if not pitch:
        off = found.mesh_cycle(points=400)[1] - (error.error - error.error.mean())
        assert np.abs(off).max() < 0.1e-6
    few = transmission_error_from_pulses(discs.run(angles), TEETH, base_radius=radius, harmonics=3)
    assert few.harmonics()["harmonic"].tolist() == [1, 2, 3]
    with pytest.raises(SignalError, match=says("harmonics", "0")):
        transmission_error_from_pulses(discs.run(angles), TEETH, base_radius=radius, harmonics=0)


@pytest.mark.parametrize("lines", [150, 200])
@pytest.mark.parametrize("lacking", [(), (0,)])
def test_uneven_marks_leak_nothing_from_line_to_line(lines, lacking):
    """Marks off by 3 % of their pitch, known from free runs without noise, one missing: no line is off by 1/2000."""
    orders = {29: 4e-6, 58: 1e-6}
    angles = coupled(
        lambda turned: sum(a * np.cos(math.tau * o * turned) for o, a in orders.items()), TEETH, 0.04, turns=10
    )
    marks = [mark_errors(lines, 0.03, seed(6) + k) for k in (0, 1)]
    still = free(seconds=0.5)
    trains, alone = (
        [encoder(a, lines, marks=m, index=True, lacking=lacking) for a, m in zip(pair, marks)]
        for pair in (angles, (still, still))
    )
    found = transmission_error_from_pulses(
        CoupledRun(*trains), TEETH, base_radius=0.04, free=dict(zip(("driver", "driven"), alone))
    )
    mesh = found.harmonics()
    assert np.allclose(mesh["amplitude"], [orders.get(o, 0.0) for o in mesh["order_driver"].astype(int)], atol=2e-9)


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [(29, 29), (21, 34)])
def test_what_counting_leaves_is_the_cramer_rao_bound(teeth):
    """Nothing unbiased could leave less than the information in all pulses; the window costs a tenth of it."""
    turns, seconds, speed = 120.0, 4.0, 100.0
    amplitudes, ratio = np.array([1e-6, 1e-7]), teeth[1] / teeth[0]
    angles = coupled(
        lambda turned: sum(a * np.cos(math.tau * (k + 1) * teeth[0] * turned) for k, a in enumerate(amplitudes)),
        teeth, 0.04, turns=turns, speed=speed, rate=20e3,
    )  # fmt: skip
    discs = Discs(seed=seed(9))
    mesh = transmission_error_from_pulses(
        discs.run(angles), teeth, base_radius=0.04, free=discs.free(seconds=seconds)
    ).harmonics()[:2]
    # of L pulses a turn with independent errors; the clock cuts evenly
    free, error = speed * seconds / math.tau, math.hypot(50e-9, 50e-9 / math.sqrt(12.0))
    bound = 0.04 * speed * error * math.sqrt(2 / 1024 * (1 / turns + ratio / turns + 1 / free + ratio**2 / free))
    known = (mesh["high"] - mesh["low"]) / 2 / stats.norm.ppf(0.975)
    assert np.all((known > 0.97 * bound) & (known < 1.1 * bound))
    # 4 standard deviations: once in 3000
    assert np.all(np.abs(mesh["amplitude"] - amplitudes) < 4 * known)


@pytest.mark.slow
def test_sixty_lines_show_one_harmonic_and_refuse_the_rest_by_name():
    error, radius = paper_error()
    discs = Discs(60)
    found = transmission_error_from_pulses(discs.run(paper_angles()), TEETH, base_radius=radius, free=discs.free())
    mesh = found.harmonics()
    assert mesh["harmonic"].tolist() == [1]
    assert abs(mesh["amplitude"][0] / exact_lines(error, 1)[0] - 1.0) < 0.03
    words = " ".join(found.refused)
    assert "Mesh harmonic 2 and later ones: order 58 of the driver is half of its 60 lines or more" in words
    assert "2 (harmonic 2)" in words
    assert 2.0 not in found.shaft_orders()["order_driver"].tolist()
    # of 56 lines the mesh is refused by name, and orders of the shafts are shown
    few = transmission_error_from_pulses(Discs(56).run(paper_angles()), TEETH, base_radius=radius)
    assert len(few.harmonics()) == 0
    assert "Mesh harmonic 1 and later ones: order 29 of the driver is half of its 56 lines or more" in " ".join(
        few.refused
    )
    assert {1.0, 3.0, 5.0, 7.0} <= set(few.shaft_orders()["order_driver"])
    assert not few.tooth_errors("driver")["stands_out"].any()


@pytest.mark.slow
@pytest.mark.parametrize(("told", "teeth"), [(None, (29, 29)), (0.01, (21, 34))])
@pytest.mark.hunt
def test_without_known_marks_the_interval_covers_the_truth(told, teeth):
    error, radius = paper_error()
    lag = closed(error.error)
    angles = coupled(lambda turned: lag(teeth[0] * turned), teeth, radius, turns=max(10, 7 * teeth[1] / teeth[0]))
    exact = exact_lines(error, 3)
    draws, inside = 200, np.zeros(3)
    for k in range(draws):
        run = Discs(256, seed=1000 + k).run(angles)
        mesh = transmission_error_from_pulses(run, teeth, base_radius=radius, mark_error=told).harmonics()[:3]
        assert not mesh["calibrated"].any()
        inside += (mesh["low"] <= exact) & (exact <= mesh["high"])
    # of 200 draws at 95 %, fewer than 180 are seen once in 500 times
    assert inside.min() >= 180, inside


@pytest.mark.slow
def test_of_known_marks_the_interval_covers_small_harmonics():
    """What jitter and clock leave of harmonics of some hundredths of a micrometre is told beside them."""
    exact, draws, inside, width = np.array([1e-6, 6.4e-8, 2.5e-8]), 60, np.zeros(3), np.zeros(3)
    angles = coupled(
        lambda turned: sum(a * np.cos(math.tau * 29 * (k + 1) * turned) for k, a in enumerate(exact)), TEETH, 0.04, 12,
        rate=20e3,
    )  # fmt: skip
    for k in range(draws):
        discs = Discs(256, seed=3000 + k)
        mesh = transmission_error_from_pulses(
            discs.run(angles), TEETH, base_radius=0.04, free=discs.free()
        ).harmonics()[:3]
        assert mesh["calibrated"].all()
        inside += (mesh["low"] <= exact) & (exact <= mesh["high"])
        width += (mesh["high"] - mesh["low"]) / 2 / exact / draws
    # of 60 draws at 95 %, fewer than 52 are seen once in 500 times
    assert inside.min() >= 52, inside
    # which are of use: half widths as shares of the values
    assert np.all(width < [0.04, 0.6, 1.3]), width


@pytest.mark.parametrize("freedom", [4.0, 12.0, math.inf])
def test_intervals_of_amplitudes_cover_them(freedom):
    """At nothing, at lines as large as noise, and at clear ones, where they are those of Student's t."""
    rng = np.random.default_rng(seed(5))
    draws = 60
    for true in (0.0, 1.0, 4.0, 25.0):
        seen = np.abs(true + rng.standard_normal(draws) + 1j * rng.standard_normal(draws))
        variances = np.ones(draws) if math.isinf(freedom) else rng.chisquare(freedom, draws) / freedom
        ends = [amplitude_interval(y, v, freedom, 0.9) for y, v in zip(seen, variances)]
        # of 60 draws at 90 %, fewer than 46 are seen once in 1000 times
        assert sum(low <= true <= high for low, high in ends) >= 46, true
    # a line that noise has all but cancelled is not known any better for that
    lucky, usual = (amplitude_interval(size, 1.0, freedom, 0.95) for size in (0.02, math.sqrt(2.0 * math.log(2.0))))
    assert lucky == (0.0, pytest.approx(usual[1]))
    assert lucky[1] > 1.0
    low, high = amplitude_interval(29.0, 1.0, freedom, 0.95)
    reach = stats.t.ppf(0.975, freedom)
    assert abs(low - 29.0 + reach) < 0.1
    assert abs(high - 29.0 - reach) < 0.1


@pytest.mark.slow
def test_turned_discs_tell_marks_and_errors_apart():
    error, radius = paper_error()
    angles, discs = paper_angles(), Discs()
    half = math.pi / 29
    base = discs.run(angles)
    first = CoupledRun(
        discs.pulses(0, angles[0], 1, mounted=half), discs.pulses(1, angles[1], 1), shift=(half + 0.01, 0)
    )
    second = CoupledRun(
        discs.pulses(0, angles[0], 2), discs.pulses(1, angles[1], 2, mounted=0.3 + half), shift=(0, "6 deg")
    )
    found = transmission_error_from_pulses([base, first, second], TEETH, base_radius=radius)
    mesh, exact = found.harmonics(), exact_lines(error, 3)
    assert abs(mesh["amplitude"][0] / exact[0] - 1.0) < 0.005
    assert abs(mesh["amplitude"][2] / exact[2] - 1.0) < 0.01
    # a disc turned by a tooth says nothing of the second harmonic
    assert mesh["high"][1] - mesh["low"][1] > 5 * (mesh["high"][0] - mesh["low"][0])
    assert sum("was turned by 6.2" in note for note in found.notes) == 2
    one = transmission_error_from_pulses([base, first], TEETH, base_radius=radius).harmonics()
    assert not one["calibrated"][0]
    assert one["low"][0] <= exact[0] <= one["high"][0]
    silent = CoupledRun(first.driver, first.driven)
    with pytest.raises(SignalError, match=says("shift", "give", "angle")):
        transmission_error_from_pulses([base, silent], TEETH, base_radius=radius)
    wrong = CoupledRun(first.driver, first.driven, shift=(0.4 * half, 0))
    with pytest.raises(SignalError, match=says("shift", "sense")):
        transmission_error_from_pulses([base, wrong], TEETH, base_radius=radius)


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [0.25, 3.5])
@pytest.mark.parametrize("which", [0, 1])
def test_a_disc_turned_in_the_sense_of_rotation_is_told_so(which, teeth):
    """Its marks pass earlier. Eccentricities of both shafts come back with their phases; against it, they did."""
    counts, ratio = (21, 34), 34 / 21
    driver, driven = 10e-6, 6e-6

    def lag(turned):
        one = math.tau * turned
        return driver * np.cos(one + 0.3) + driven * np.cos(one / ratio - 1.0) + 2e-6 * np.cos(21 * one)

    angles = coupled(lag, counts, 0.04, turns=44, rate=20e3)
    marks = [mark_errors(256, 0.01, k) for k in (0, 1)]
    by = teeth * math.tau / counts[which]

    def run(turned):
        at = [-turned if k == which else 0.0 for k in (0, 1)]
        return [encoder(angles[k], 256, marks=marks[k], mounted=at[k], index=True) for k in (0, 1)]

    told = (by, 0.0) if which == 0 else (0.0, by)
    found = transmission_error_from_pulses(
        [CoupledRun(*run(0.0)), CoupledRun(*run(by), shift=told)], counts, base_radius=0.04
    )
    orders = found.shaft_orders()
    name, height, phase = (("driver", driver, 0.3), ("driven", driven, -1.0))[which]
    line = orders[np.isclose(orders[f"order_{name}"], 1.0)].iloc[0]
    assert line["amplitude"] == pytest.approx(height, rel=0.02)
    assert line["phase"] == pytest.approx(phase, abs=0.1)


@pytest.mark.slow
def test_a_line_of_a_shaft_between_is_told():
    """Of a train of two stages, told by ratio: neither is it silent, nor doubts its second mesh the told one."""
    ratio, mesh, between = Fraction(34 * 53, 21 * 17), Fraction(21), 21 / 34
    error = {21.0: 3e-6, 10.5: 5e-6, between: 4e-6}

    def shafts(lines):
        lag = lambda turned: sum(a * np.cos(math.tau * o * turned + o) for o, a in lines.items())  # noqa: E731
        driver, driven = coupled(lag, (106, 535), 0.025, turns=250, rate=4e3)
        return driver, angle(driven.values * 535 / 106 / float(ratio), driven["time"].values)

    def found(lines):
        pulses = [encoder(a, 256) for a in shafts(lines)]
        return transmission_error_from_pulses(CoupledRun(*pulses), base_radius=0.025, ratio=ratio, mesh_order=mesh)

    told = found(error)
    assert any("0.618" in note or "0.6179" in note for note in told.notes if "BETWEEN" in note)
    assert "CHECK" not in told.verdict
    assert not any("BETWEEN" in note for note in found({21.0: 3e-6, 1.0: 2e-6, 0.5: 0.0}).notes)


@pytest.mark.slow
def test_the_difference_of_two_loads_knows_no_marks():
    errors = [paper_error(torque)[0] for torque in (100.0, 200.0)]
    radius, discs = paper_error()[1], Discs()
    runs = [discs.run(paper_angles(t), k, load=name) for k, (t, name) in enumerate(((100.0, "low"), (200.0, "high")))]
    found = transmission_error_from_pulses(runs, TEETH, base_radius=radius, probability=0.999)
    exact = np.abs(np.fft.rfft(errors[1].error - errors[0].error))[1:4] / 200
    difference = found.difference("high", "low")[:3]
    assert np.allclose(difference["amplitude"], exact, rtol=0.02)
    assert np.all((difference["low"] <= exact) & (exact <= difference["high"]))
    assert not found.harmonics("low")["calibrated"].any()


@pytest.mark.parametrize("case", range(4))
@pytest.mark.slow
def test_orders_of_both_shafts_come_back_from_any_pair(case):
    """Lines at chance orders of both shafts and the mesh, perfect discs: each to a part in a thousand."""
    rng = np.random.default_rng(seed(3) + case)
    teeth = tuple(int(z) for z in rng.integers(12, 40, 2))
    whole = teeth[1] // math.gcd(*teeth)
    # a record of few turns has to be whole periods of the pair, and six turns of the slower shaft at least
    turns = 12 * max(1.0, teeth[1] / teeth[0])
    if whole < 25:
        turns = whole * math.ceil(max(2, 6 * max(1.0, teeth[1] / teeth[0]) / whole))
    orders = {Fraction(1): 3e-6, Fraction(teeth[0], teeth[1]) * 2: 2e-6, Fraction(teeth[0]): 4e-6}
    phases = dict(zip(orders, rng.uniform(0, math.tau, len(orders))))

    def lag(turned):
        return sum(a * np.cos(math.tau * float(o) * turned + phases[o]) for o, a in orders.items())

    angles = coupled(lag, teeth, 0.04, turns=turns + 3, speed=float(rng.uniform(20.0, 300.0)))
    lines = [int(n) for n in rng.integers(180, 400, 2)]
    trains = [encoder(a, n, index=True) for a, n in zip(angles, lines)]
    found = transmission_error_from_pulses(CoupledRun(*trains), teeth, base_radius=0.04)
    lost = max(teeth) * 20 > min(lines) / 2  # mesh harmonics that could be folded onto the others
    for order, amplitude in orders.items():
        row = [line for line in found.lines if line.order == order]
        if not row:
            assert lost
            continue
        value, _ = row[0].found.of({"T load": 1.0})
        assert abs(abs(value) * 0.04 - amplitude) < 2e-3 * amplitude + 2e-9, (teeth, lines, order)


def test_records_that_do_not_fit_are_refused():
    _, radius = paper_error()
    angles, discs = paper_angles(turns=9), Discs(200)
    run = discs.run(angles)
    known = {"base_radius": radius}
    with pytest.raises(SignalError, match=says("ratio", "teeth", "lines")):
        transmission_error_from_pulses(run, (29, 40), **known)
    with pytest.raises(SignalError, match=says("teeth", "ratio", "mesh_order")):
        transmission_error_from_pulses(run, **known)
    with pytest.raises(SignalError, match=says("base_radius", "0")):
        transmission_error_from_pulses(run, TEETH, base_radius=0)
    with pytest.raises(SignalError, match=says("base_radius", "41.76", "mm")):
        transmission_error_from_pulses(run, TEETH, base_radius=41.76)
    late = dataclasses.replace(run.driven, times=run.driven.times * (1 + 1e-3))
    with pytest.raises(SignalError, match=says("driven", "ppm", "one counter")):
        transmission_error_from_pulses(CoupledRun(run.driver, late), TEETH, **known)
    near = dataclasses.replace(run.driven, times=run.driven.times * (1 + 1e-5))
    assert len(transmission_error_from_pulses(CoupledRun(run.driver, near), TEETH, **known).harmonics()) == 3
    with pytest.raises(SignalError, match=says("mark_error", "-1")):
        transmission_error_from_pulses(run, TEETH, mark_error=-1, **known)
    with pytest.raises(SignalError, match=says("probability", "2")):
        transmission_error_from_pulses(run, TEETH, probability=2, **known)
    with pytest.raises(SignalError, match=says("free", "rotor", "driver")):
        transmission_error_from_pulses(run, TEETH, free={"rotor": run.driver}, **known)
    with pytest.raises(SignalError, match=says("driver", "lines", "128", "200")):
        transmission_error_from_pulses(run, TEETH, free={"driver": encoder(angles[0], 128, index=True)}, **known)
    bare = CoupledRun(encoder(angles[0], 200), encoder(angles[1], 200))
    with pytest.raises(SignalError, match=says("mark 0", "index")):
        transmission_error_from_pulses([bare, bare], TEETH, **known)
    assert len(transmission_error_from_pulses(bare, TEETH, **known).harmonics()) == 3
    short = CoupledRun(encoder(angles[0][:9000], 200), encoder(angles[1][:9000], 200))
    with pytest.raises(SignalError, match=says("turns", "smooth")):
        transmission_error_from_pulses(short, TEETH, **known)


@pytest.mark.slow
@pytest.mark.parametrize(("told", "remedy"), [
    (512, None), (500, "512 and 512 lines"), (513, "512 and 512 lines"), (256, "512 and 512 lines"),
    (1024, "512 and 512 lines"),
])  # fmt: skip
def test_another_count_of_lines_is_told_by_the_mesh(told, remedy):
    """Both discs told alike show the ratio all the same; index pulses contradict the count, and are asked first."""
    error, radius = paper_error()
    lag = closed(error.error)
    angles = coupled(lambda turned: lag(29 * turned), TEETH, radius, 20, rate=20e3)
    seen = [
        encoder(a, 512, marks=mark_errors(512, 1e-3, k), index=True, jitter="50 ns", seed=k)
        for k, a in enumerate(angles)
    ]
    trains = [pulse_train(train.times, told, name=name) for train, name in zip(seen, ("driver", "driven"))]
    found = transmission_error_from_pulses(CoupledRun(*trains), TEETH, base_radius=radius)
    if remedy is None:
        assert found.doubt is None
        assert found.verdict.startswith("Mesh harmonic 1")
        # peaks, as the exact ones
        assert found.harmonics().attrs == {"units": "m", "scaling": "amplitude"}
        assert "peak amplitude, µm" in [axes.get_ylabel() for axes in found.plot().axes]
    else:
        assert found.verdict.startswith("CHECK THE LINES AND TEETH")
        assert remedy in found.verdict


@pytest.mark.slow
@pytest.mark.parametrize(("told", "turns"), [(256, 12), (512, 24), (768, 36), (1024, 36), (128, 12), (250, 12)])
@pytest.mark.parametrize("error", [0.01, 0.003])
def test_more_or_fewer_lines_than_there_are_are_told_by_the_marks(told, turns, error):
    """Errors of 1 % hide the mesh, which would tell; the marks of a disc recur after its own turn."""
    curve, radius = paper_error()
    lag = closed(curve.error)
    angles = coupled(lambda turned: lag(29 * turned), TEETH, radius, turns, rate=20e3)
    trains = [
        pulse_train(encoder(a, 256, marks=mark_errors(256, error, k), jitter="50 ns", seed=k).times, told, name=name)
        for k, (a, name) in enumerate(zip(angles, ("driver", "driven"), strict=True))
    ]
    found = transmission_error_from_pulses(CoupledRun(*trains), TEETH, base_radius=radius)
    if told == 256:
        assert found.doubt is None
    else:
        assert found.verdict.startswith("CHECK THE LINES AND TEETH")
        assert "256 and 256 lines" in found.verdict


def test_a_gap_behind_which_nothing_numbers_the_pulses_is_refused():
    error, radius = paper_error()
    lag = closed(error.error)
    angles = coupled(lambda turned: lag(29 * turned), TEETH, radius, 12, rate=20e3)
    trains = [encoder(a, 128, name=name, jitter="50 ns", seed=k) for k, (a, name) in enumerate(zip(angles, "ab"))]
    for lost, refused in ((300, True), (6, False)):
        cut = [pulse_train(np.delete(t.times, np.arange(700, 700 + lost)), 128, name=t.name) for t in trains]
        if refused:
            with pytest.raises(SignalError, match=says("'a'", "pulses", "gap")):
                transmission_error_from_pulses(CoupledRun(*cut), TEETH, base_radius=radius)
        else:
            transmission_error_from_pulses(CoupledRun(*cut), TEETH, base_radius=radius)


def test_half_the_lines_are_told_by_the_marks_of_one_disc():
    train = encoder(free(seconds=0.8), 1024, marks=mark_errors(1024, 0.01, 3), jitter="50 ns", seed=1)
    assert "discs of 1024 lines" in repeating_marks([pulse_train(train.times, 512)], [29.0])
    assert repeating_marks([pulse_train(train.times, 1024)], [29.0]) is None


@pytest.mark.parametrize("lines", [64, 100, 360, 1024])
@pytest.mark.parametrize("error", [0.01, 1e-4, 0.0])
@pytest.mark.slow
def test_marks_that_repeat_by_chance_are_rare(lines, error):
    """Of true counts none is doubted: random marks, marks below the counter's noise, and an eccentric disc."""
    turning = free(seconds=0.8)
    for number in range(12):
        marks = (
            mark_errors(lines, error, seed(300 + number)) + 0.01 * np.cos(math.tau * np.arange(lines) / lines) / lines
        )
        train = encoder(turning, lines, marks=marks, jitter="50 ns", seed=number)
        assert repeating_marks([train], [29.0]) is None


@pytest.mark.slow
@pytest.mark.parametrize(("told", "wrong"), [((29, 29), False), ((30, 30), True), ((58, 58), True), ((28, 28), True)])
def test_other_teeth_of_an_even_pair_are_told_by_the_mesh(told, wrong):
    error, radius = paper_error()
    lag = closed(error.error)
    angles = coupled(lambda turned: lag(29 * turned) + 5e-6 * np.cos(math.tau * turned), TEETH, radius, 15, rate=20e3)
    found = transmission_error_from_pulses(Discs(512).run(angles), told, base_radius=radius)
    assert ("CHECK THE LINES AND TEETH" in found.to_markdown()) == wrong
    assert ("teeth of 29 and 29" in found.verdict) == wrong


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [(29, 29), (20, 40), (21, 34)])
def test_errors_of_every_tooth_are_no_other_mesh(teeth):
    """Pitch errors stand at all orders of their shafts, two teeth that alternate at half the mesh order."""
    rng = np.random.default_rng(seed(12))
    steps = [3e-6 * rng.standard_normal(z) for z in teeth]

    def lag(turned):
        tooth = np.floor(teeth[0] * turned).astype(int)
        wrong = sum(step[tooth % z] for step, z in zip(steps, teeth))
        return 3e-6 * np.cos(math.tau * teeth[0] * turned) + wrong * np.sin(np.pi * teeth[0] * turned) ** 2

    angles = coupled(lag, teeth, 0.04, turns=15 * teeth[1] / teeth[0], rate=15e3)
    found = transmission_error_from_pulses(Discs(360, seed=seed(13)).run(angles), teeth, base_radius=0.04)
    assert found.doubt is None


@pytest.mark.slow
@pytest.mark.parametrize("case", range(3))
@pytest.mark.parametrize("error", [0.01, 5e-5])
def test_free_runs_of_other_discs_are_refused(case, error):
    """Of another disc, of the other shaft's, turned round, or the run itself; of errors below the noise none is."""
    angles = coupled(lambda turned: 4e-6 * np.cos(math.tau * 29 * turned), TEETH, 0.04, turns=8, rate=15e3)
    discs, other, round_about = (Discs(400, error, seed=seed(11) + 3 * case + k) for k in range(3))
    round_about.marks = [marks[::-1] for marks in discs.marks]
    run, own = discs.run(angles), discs.free(seconds=0.5)
    known = {"teeth": TEETH, "base_radius": 0.04}
    sound = transmission_error_from_pulses(run, free=own, **known)
    assert sound.harmonics()["calibrated"].all()
    if error > 1e-3:
        assert not any("does not tell" in note for note in sound.notes)
    wrong = {"other": other.free(seconds=0.5)["driven"], "turned": round_about.free(seconds=0.5)["driven"]}
    wrong["swapped"] = own["driver"]
    for train in wrong.values():
        if error > 1e-3:
            with pytest.raises(SignalError, match=says("free", "driven", "same mark 0")):
                transmission_error_from_pulses(run, free={"driven": train}, **known)
        else:
            assert len(transmission_error_from_pulses(run, free={"driven": train}, **known).harmonics()) == 6
    with pytest.raises(SignalError, match=says("free", "driver", "itself")):
        transmission_error_from_pulses(run, free={"driver": run.driver}, **known)


@pytest.mark.slow
def test_a_tooth_with_an_error_is_found_by_its_number():
    """The dynamic error of a simulated pair with two wrong teeth, through encoders."""
    faults = [
        {"kind": "single pitch error", "amount": "10 um", "tooth": 8, "wheel": "driver"},
        {"kind": "single pitch error", "amount": "-6 um", "tooth": 20, "wheel": "driven"},
    ]
    case = gm.Case(
        gears={"teeth": (21, 34), "module": "2.5 mm", "face_width": "20 mm"},
        operation={"duration": 1.6, "speed": "1500 rpm", "torque": "60 N m"},
        fault={"teeth": faults},
    )
    angles = gm.signals.shaft_angles(gm.run_case(case))
    discs = Discs()
    radius = case.pair().geometry.driver.base_radius
    found = transmission_error_from_pulses(discs.run(angles), (21, 34), base_radius=radius, free=discs.free())
    for shaft, tooth, sense in (("driver", 8, -1.0), ("driven", 20, 1.0)):
        teeth = found.tooth_errors(shaft)
        assert int(teeth["error"].abs().idxmax()) == tooth
        assert np.sign(teeth["error"][tooth]) == sense
        assert teeth["stands_out"][tooth]
        # the next one shares the load of a contact ratio of 1.6
        assert set(teeth.index[teeth["stands_out"]]) <= {tooth - 1, tooth, (tooth + 1) % len(teeth)}
    text = found.to_markdown()
    assert "Teeth of the driver that stand out:" in text
    assert " 8 (-" in text
    assert " 20 (+" in text
    assert {
        "mesh_harmonics", "shaft_orders", "single_flank", "record_lengths", "driver_teeth", "driven_teeth"
    } == set(found.tables())  # fmt: skip
    figure = measured_error_plot(found, title="two wrong teeth")
    assert len(figure.axes) == len(found.plot().axes) == 5


def test_marks_with_a_period_are_no_chance():
    """Errors of the marks at the mesh order alone pass for transmission error in one run, and not in two."""
    _, radius = paper_error()
    lines = 240
    wave = 1e-4 * np.cos(math.tau * 29 * np.arange(lines) / lines)
    angles = coupled(lambda turned: 0.0 * turned, TEETH, radius, turns=12)
    still = mark_errors(lines, 0.0, 0)
    one = CoupledRun(
        encoder(angles[0], lines, marks=wave, index=True), encoder(angles[1], lines, marks=still, index=True)
    )
    seen = transmission_error_from_pulses(one, TEETH, base_radius=radius).harmonics()
    assert abs(seen["amplitude"][0] / (1e-4 * radius) - 1.0) < 1e-3
    turned = math.pi / 29
    two = CoupledRun(encoder(angles[0], lines, marks=wave, index=True, mounted=turned), one.driven, shift=(turned, 0.0))
    known = transmission_error_from_pulses([one, two], TEETH, base_radius=radius, mark_error=(0.01, 1e-6)).harmonics()
    assert known["amplitude"][0] < 1e-3 * 1e-4 * radius


def wrong_tooth(run_out, size=4e-6, tooth=8, teeth=21):
    """A driver with one wrong tooth and run-out: m, over its turns."""

    def error(turns):
        place = np.mod(turns * teeth - tooth + 0.5, teeth) - 0.5
        return size * np.cos(np.pi * np.clip(place, -0.5, 0.5)) ** 2 + run_out * np.cos(math.tau * turns)

    return error


@pytest.mark.slow
@pytest.mark.parametrize("turns", [20, 48])
@pytest.mark.parametrize("run_out", [0.0, 10e-6])
def test_a_tooth_stands_out_of_run_out_and_on_its_own_wheel_alone(turns, run_out):
    """Short of the turns after which the wheels meet again the other wheel's teeth seem to have a part of the error."""
    radius = 41.76e-3
    discs = Discs(error=1e-4, jitter="10 ns")
    angles = coupled(wrong_tooth(run_out), (21, 34), radius, turns=turns)
    found = transmission_error_from_pulses(discs.run(angles), (21, 34), base_radius=radius)
    driver, driven = found.tooth_errors("driver"), found.tooth_errors("driven")
    assert list(driver.index[driver["stands_out"]]) == [8]
    assert not driven["stands_out"].any()
    assert driver["deviation"][8] == pytest.approx(2e-6, rel=0.15)
    assert (found.short is None) == (turns == 48)
    assert ("meet again after 34 turns" in found.to_markdown()) == (turns == 20)


@pytest.mark.slow
def test_run_out_alone_accuses_no_tooth():
    radius = 41.76e-3
    angles = coupled(wrong_tooth(10e-6, size=0.0), (21, 34), radius, turns=48)
    found = transmission_error_from_pulses(Discs(error=1e-4).run(angles), (21, 34), base_radius=radius)
    assert not any(found.tooth_errors(shaft)["stands_out"].any() for shaft in ("driver", "driven"))


SET = {"ratio": Fraction(9, 2), "mesh_order": Fraction(28, 3)}
"""Of a planetary set, sun to carrier: 12, 15 and 42 teeth."""


def planetary_motion(amplitudes, turns):
    """Angles of sun and carrier for mesh harmonics by number, m, and the lag over meshes from the beginning."""

    def lag(turned):
        return sum(a * np.cos(math.tau * h * turned * 28 / 3 + h) for h, a in amplitudes.items())

    return coupled(lag, (2, 9), 0.02, turns=turns), lambda cycle: lag(cycle * 3 / 28)


def noiseless(angles, lines, share=0.02):
    """Trains of both shafts in mesh and free, marks off by a share of the pitch, and nothing else."""
    marks = [mark_errors(lines, share, seed(11) + k) for k in (0, 1)]
    still = free(seconds=0.5)
    return (
        [encoder(a, lines, marks=m, index=True, mounted=0.3 * k, name=name) for a, m in zip(pair, marks)]
        for k, name, pair in ((1, "in mesh", angles), (0, "free", (still, still)))
    )


def test_harmonics_beyond_half_the_lines_leave_nothing_in_those_below():
    """Of a carrier's 200 lines two harmonics are below half; 3, 4 and 7, larger, fold onto its orders 74, 32 and 94."""
    amplitudes = {1: 3e-7, 2: 1e-7, 3: 2e-6, 4: 1e-6, 7: 5e-7}
    angles, _ = planetary_motion(amplitudes, 36)
    trains, alone = noiseless(angles, 200)
    found = transmission_error_from_pulses(
        CoupledRun(*trains), base_radius=0.02, free=dict(zip(("driver", "driven"), alone)), **SET
    )
    mesh = found.harmonics()
    assert mesh["harmonic"].tolist() == [1, 2]
    # as lines of the orders that they are folded to they would leave 2 um 2 pi 0.02/sqrt(200) = 18 nm
    assert np.allclose(mesh["amplitude"], [3e-7, 1e-7], atol=1e-9)


def test_a_mesh_cycle_of_a_planetary_set_begins_at_mark_0_of_the_sun():
    angles, lag = planetary_motion({1: 3e-6, 2: 1e-6}, 36)
    trains, alone = noiseless(angles, 200)
    found = transmission_error_from_pulses(
        CoupledRun(*trains), base_radius=0.02, free=dict(zip(("driver", "driven"), alone)), **SET
    )
    phase, error = found.mesh_cycle()
    # the sun is mounted at 0.3 rad, and any of its turns may be the first
    begins = [28 / 3 * (0.3 / math.tau + turn) for turn in range(3)]
    assert min(np.abs(error - lag(phase + begin)).max() for begin in begins) < 5e-9
