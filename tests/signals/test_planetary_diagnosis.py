"""Faulty teeth of planetary sets found in records at the ring: simulated sets, signal models, noise, bad input."""

import math

import numpy as np
import pytest
import xarray as xr

from gearmbs.gears import ContactLaw, FlankFriction, faults, planetary
from gearmbs.signals import MissingMetadataError, SignalError, analyse, diagnose_planetary, make_signal, planetary_lines
from gearmbs.signals.diagnosis.planetary_averages import path_weight
from gearmbs.studies.planetary import PlanetaryRun, run_planetary
from tests.make_records import read
from tests.says import says

TEETH = (17, 19, 55)
BROKEN = faults.BrokenTooth(tooth=5, lost=0.6)


def simulated(*where, turns=9.0):
    gears = planetary(
        TEETH,
        "1.5 mm",
        contact=ContactLaw.linear("2e8 N/m", "3000 N*s/m", "10 um"),
        friction=FlankFriction.none(),
        backlash_sun="0.05 mm",
        backlash_ring="0.05 mm",
        profile_shifts=(0.3, 0.2, -0.7),
        faults=[(place, BROKEN) for place in where],
    )
    run = PlanetaryRun(
        gears,
        speeds={"carrier": "1200 rpm"},
        torques={"sun": "-11 N m"},
        run_up=0.004,
        settling=0.006,
        duration=turns / 20,
        rate=20_000.0,
        tolerance=3e-6,
    )
    return run_planetary(run)


@pytest.mark.slow
def test_a_planet_is_named_from_the_simulated_record():
    record = read("planet.nc")
    report = analyse(record)
    assert report.fault == "planet 2"
    assert [f.grade for f in report.findings] == ["none", "clear", "none"]
    found = report.findings[1]
    # f_m / z_p, the carrier turning 20 times a second
    assert found.found == pytest.approx(20 * 55 / 19, rel=1e-3)
    assert found.kinematic == pytest.approx(20 * 55 / 19, rel=1e-6)
    # without the angle the planets are not told apart
    heard = make_signal(record["ring_sensor"].values, 20_000.0, units="N")
    assert analyse(heard, planetary=TEETH, speed="1200 rpm").fault == "planet"
    assert analyse(heard, planetary=TEETH, speed="5082.35294 rpm", member="sun").fault == "planet"


@pytest.mark.slow
@pytest.mark.parametrize("where", ["", "sun", "ring", "planet 3 sun side"])
def test_each_part_is_named(where):
    report = analyse(simulated(*([where] if where else [])))
    assert report.fault == (where.removesuffix(" sun side") or None), report.verdict


def pulses(part, noise=0.05, turns=20, sharpness=4.0, seed=0, teeth=(23, 31, 85), planet=1):
    """Make a record over time at one turn of the carrier a second, written from the kinematics alone."""
    rate = 8500
    theta = np.arange(turns * rate) / rate
    sun, own, ring = teeth
    total = np.zeros_like(theta)
    for k in range(3):
        psi = k / 3
        # angle of the faulty part's tooth against the mesh with this planet, in turns
        turned = {"planet": ring * theta / own + 0.3, "sun": ring * theta / sun - psi + 0.3, "ring": theta + psi + 0.05}
        mesh = np.cos(2 * math.pi * ring * (theta + psi))
        if part in turned and (part != "planet" or k == planet):
            near = (turned[part] + 0.5) % 1.0 - 0.5
            width = 0.5 / dict(zip(("sun", "planet", "ring"), teeth))[part]
            mesh = mesh + 0.8 * np.exp(-0.5 * (near / width) ** 2)
        total += path_weight(2 * math.pi * (theta + psi), sharpness) * mesh
    total += noise * total.std() * np.random.default_rng(seed).normal(size=theta.size)
    signal = make_signal(total, float(rate), units="m/s^2")
    return signal.assign_coords(angle=("time", 2 * math.pi * theta))


@pytest.mark.slow
@pytest.mark.parametrize("part", ["sun", "planet", "ring"])
def test_pulses_at_the_kinematic_orders(part):
    report = diagnose_planetary(pulses(part), (23, 31, 85))
    assert report.fault == (part if part != "planet" else "planet 2")
    orders = {"sun": 3 * 85 / 23, "planet": 85 / 31, "ring": 3.0}
    named = report.accused[0]
    assert named.found == pytest.approx(orders[part], rel=1e-3)
    assert [f.part for f in report.accused] == [part]


@pytest.mark.parametrize("seeds", [range(3), range(3, 20)])
@pytest.mark.slow
def test_sound_records_are_not_accused(seeds):
    for seed in seeds:
        for noise in (1e-3, 0.05, 0.5):
            report = diagnose_planetary(pulses("none", noise=noise, turns=10, seed=seed), (23, 31, 85))
            assert report.fault is None, report.verdict


def test_a_sound_record_without_noise_is_not_accused():
    assert diagnose_planetary(pulses("none", noise=0.0, turns=10), (23, 31, 85)).fault is None


def test_unequal_planets_and_a_set_as_such():
    gears = planetary((24, 30, 84), "1.5 mm", 3)
    assert planetary_lines(gears).orders == pytest.approx({"sun": 10.5, "planet": 2.8, "ring": 3.0})
    lines = planetary_lines((24, 30, 84), [0.0, math.radians(120), math.radians(230)])
    assert lines.planets == 3
    table = lines.table(2.0).set_index(["part", "harmonic"])["frequency"]
    assert table["mesh", 2] == 336.0
    assert table["planet fault", 1] == pytest.approx(5.6)


def test_what_the_teeth_hide_is_said():
    report = diagnose_planetary(pulses("none", turns=10, teeth=(30, 30, 90)), (30, 30, 90))
    assert sum("is not told" in note for note in report.notes) == 2


@pytest.mark.slow
def test_the_report_shows_itself(tmp_path):
    report = diagnose_planetary(pulses("planet"), (23, 31, 85))
    assert "planet 2" in report.verdict
    assert "| planet 2 |" in report.to_markdown()
    assert report.to_frame()["fault"].item() == "planet 2"
    assert set(report.tables()) == {"planetary_evidence", "planetary_lines"}
    figure = report.plot()
    assert len(figure.axes) == 3
    report.save(tmp_path / "set.md")
    assert "Planetary set" in (tmp_path / "set.md").read_text()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"planetary": (23, 31)}, says("ring", "teeth of sun")),
        ({"planetary": (85, 31, 23)}, says("planetary", "most teeth")),
        ({"planets": 0}, says("planets", "0", "1 or more", "angles")),
        ({"speed": "20 rpm"}, says("turns", "24 s")),
        ({"speed": "6000 rpm"}, "sampling rate above"),
        ({"speed": "60 rpm", "member": "ring"}, "'carrier' or 'sun'"),
    ],
)
def test_bad_input_is_one_line(change, words):
    settings = {"planetary": (23, 31, 85), "speed": "60 rpm", **change}
    signal = pulses("none", turns=10).drop_vars("angle")
    with pytest.raises(SignalError, match=words) as caught:
        analyse(signal, **settings)
    assert "\n" not in str(caught.value)


def test_a_speed_is_needed():
    with pytest.raises(MissingMetadataError, match="carrier's"):
        analyse(pulses("none", turns=10).drop_vars("angle"), planetary=(23, 31, 85))


@pytest.mark.slow
def test_a_backward_carrier_is_followed_too():
    signal = pulses("planet")
    phase = xr.DataArray(-signal["angle"].values, dims="time", coords={"time": signal["time"].values})
    assert diagnose_planetary(signal, (23, 31, 85), phase=phase).fault == "planet"
