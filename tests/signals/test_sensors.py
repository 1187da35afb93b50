"""Virtual sensors against closed forms."""

import math

import numpy as np
import pytest

from gearmbs.signals import (
    FrfPath,
    ModalPath,
    Mode,
    SignalError,
    accelerometer,
    add_noise,
    convert,
    gmf_rms,
    joint_force,
    laser_vibrometer,
    make_signal,
    measure,
    quantise,
    read_signal,
    sample,
    units_of,
    write_signal,
)
from tests.says import says

RATE = 51200.0


def vector(x=0.0, y=0.0, z=0.0, n=100, units="m/s"):
    return make_signal({k: np.full(n, v) for k, v in zip("xyz", (x, y, z))}, RATE, units=units)


def test_laser_sees_the_velocity_along_its_line():
    seen = laser_vibrometer(vector(3.0, 4.0), [2.0, 0.0, 0.0])
    assert seen.values[0, 0] == 3.0
    assert units_of(seen) == ["m/s"]
    oblique = laser_vibrometer(vector(3.0, 4.0), [1.0, 1.0, 0.0])
    assert oblique.values[0, 0] == pytest.approx(7.0 / math.sqrt(2))


def test_laser_off_the_axis_sees_the_spin():
    spin = vector(z=100.0, units="rad/s")
    still = vector()
    # aimed at the axis: nothing; a spot 2 mm off it, looking along y: w x r = 100 * 0.002
    aimed = laser_vibrometer(still, [0, 1, 0], angular_velocity=spin, spot=[0, 0.015, 0.3])
    off = laser_vibrometer(still, [0, 1, 0], angular_velocity=spin, spot=[0.002, 0.015, 0.3])
    assert aimed.values[0, 0] == pytest.approx(0.0, abs=1e-15)
    assert off.values[0, 0] == pytest.approx(0.2)


def test_joint_force_along_a_direction():
    assert joint_force(vector(3.0, 4.0, units="N"), [0, -1, 0]).values[0, 0] == -4.0


@pytest.mark.parametrize("frequency", [50.0, 480.0, 1000.0, 3000.0])
def test_accelerometer_gives_the_accelerance(frequency):
    path = ModalPath((Mode(800.0, 0.05, 4.0), Mode(2500.0, 0.03, -9.0)))
    t = np.arange(RATE) / RATE
    force = make_signal(500.0 + 10.0 * np.cos(2 * np.pi * frequency * t), RATE, units="N")
    seen = accelerometer(force, path, name="support")
    w = 2 * np.pi * frequency
    gain = sum(
        -(w**2) / (m.mass * ((2 * np.pi * m.frequency) ** 2 - w**2 + 2j * m.damping * 2 * np.pi * m.frequency * w))
        for m in path.modes
    )
    expected = 10 * np.real(gain * np.exp(1j * w * seen["time"].values))
    # what is left of the start, a blow of 10 N / m each, has decayed by e^-10; over its last millisecond the
    # band-limited response sees the record's end coming
    left = 10 * (1 / 4 + 1 / 9) * math.exp(-10)
    assert np.abs(seen.values[:-50, 0] - expected[:-50]).max() < left + 1e-3 * 10 * abs(gain)
    assert units_of(seen) == ["m/s^2"]
    assert seen["channel"].values.tolist() == ["support"]


def test_accelerance_limits():
    path = ModalPath((Mode(100.0, 0.02, 5.0),))
    assert abs(path.accelerance(np.array([1e6]))[0]) == pytest.approx(1 / 5.0, rel=1e-6)  # a free mass far above
    assert abs(path.accelerance(np.array([100.0]))[0]) == pytest.approx(1 / (5.0 * 2 * 0.02))  # resonance
    w = 2 * np.pi * 1.0
    assert path.accelerance(np.array([1.0]))[0].real == pytest.approx(-(w**2) / (5 * (2 * np.pi * 100) ** 2), rel=1e-3)


def test_impulse_response_is_causal_and_rings_at_its_frequency():
    mode = Mode(1000.0, 0.02, 2.0)
    x = np.zeros(20480)
    x[10000] = RATE  # a unit impulse in N s
    seen = accelerometer(make_signal(x, RATE, units="N"), ModalPath((mode,)), settle="keep").values[:, 0]
    t = np.arange(1, 3000) / RATE
    wn, wd = 2 * np.pi * 1000, 2 * np.pi * 1000 * math.sqrt(1 - 0.02**2)
    # velocity h = e^(-d wn t) (cos wd t - d wn/wd sin wd t) / m; its derivative by differences
    h = np.exp(-0.02 * wn * t) * (np.cos(wd * t) - 0.02 * wn / wd * np.sin(wd * t)) / 2.0
    expected = np.gradient(h, 1 / RATE)
    got = seen[10001 : 10001 + t.size]
    assert np.abs(got[40:] - expected[40:]).max() < 0.02 * np.abs(expected).max()
    assert np.abs(seen[:9900]).max() < 0.02 * np.abs(expected).max()


def test_frf_path_reproduces_the_modal_path_it_was_sampled_from():
    modal = ModalPath((Mode(800.0, 0.05, 4.0),))
    f = np.arange(0.0, 25600.0, 1.0)
    given = FrfPath(f, modal.accelerance(f), settling=modal.settling)
    force = make_signal(np.random.default_rng(0).standard_normal(51200), RATE, units="N")
    a, b = accelerometer(force, modal), accelerometer(force, given)
    inner = slice(2000, 45000)
    assert np.abs(a.values[inner] - b.values[inner]).max() < 1e-2 * np.abs(a.values).max()


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: Mode(-1.0, 0.1, 1.0), says("mode", "frequency", "positive")),
        (lambda: Mode(1.0, 1.5, 1.0), says("mode", "damping", "1.5")),
        (lambda: Mode(1.0, 0.1, 0.0), says("mode", "mass", "0.0", "kg")),
        (lambda: FrfPath(np.array([1.0, 1.0]), np.array([1.0, 2.0]), 0.1), says("path", "frequencies", "increasing")),
        (lambda: accelerometer(vector(), ModalPath((Mode(1.0, 0.1, 1.0),))), "must be in N"),
        (lambda: accelerometer(vector(units="N"), ModalPath((Mode(1.0, 0.1, 1.0),))), "settling time"),
        (lambda: laser_vibrometer(vector(), [0, 0, 0]), says("direction", "[0, 0, 0]", "three")),
        (lambda: laser_vibrometer(make_signal([1.0], RATE), [1, 0, 0]), "Cartesian"),
        (lambda: add_noise(vector(), seed=0), says("noise", "rms and density")),
        (lambda: quantise(vector(), bits=1, full_scale=1.0), says("bits", "1", "2 and 32")),
        (lambda: quantise(vector(), bits=16, full_scale=0.0), says("full_scale", "0.0", "positive")),
        (lambda: sample(vector(), 1e6), "above the signal's own"),
        (lambda: measure(vector(n=1000), bits=16), "both or neither"),
    ],
)
def test_bad_calls_name_the_field(call, match):
    with pytest.raises(SignalError, match=match):
        call()


def test_quantisation_error_is_uniform():
    x = make_signal(np.random.default_rng(1).uniform(-0.9, 0.9, 200_000), RATE)
    out = quantise(x, bits=8, full_scale=1.0)
    step = 2.0 / 256
    error = out.values - x.values
    assert np.abs(error).max() <= step / 2 * (1 + 1e-9)
    assert error.std() == pytest.approx(step / math.sqrt(12), rel=0.01)
    assert out.attrs["clipped"] == 0
    loud = quantise(make_signal([0.0, 5.0, -5.0], RATE), bits=8, full_scale=1.0)
    assert loud.values[:, 0].tolist() == [0.0, 1.0 - step, -1.0]
    assert loud.attrs["clipped"] == 2


def test_noise_has_its_level_and_repeats_with_its_seed():
    quiet = make_signal(np.zeros(100_000), 12800.0, units="m/s^2")
    one, two, other = (
        add_noise(quiet, seed=3, rms=0.5),
        add_noise(quiet, seed=3, rms=0.5),
        add_noise(quiet, seed=4, rms=0.5),
    )
    assert one.values.std() == pytest.approx(0.5, rel=0.01)
    assert np.array_equal(one.values, two.values)
    assert not np.array_equal(one.values, other.values)
    dense = add_noise(quiet, seed=3, density=0.01)
    assert dense.values.std() == pytest.approx(0.01 * math.sqrt(6400.0), rel=0.01)


def test_a_measured_chain_keeps_the_gear_mesh_harmonics(tmp_path):
    gmf = 29 * 1000 / 60
    t = np.arange(round(1.2 * RATE)) / RATE
    x = sum(a * np.cos(2 * np.pi * k * gmf * t + k) for k, a in enumerate([1.0, 0.5, 0.25], 1))
    still = {"y": np.zeros_like(t), "z": np.zeros_like(t)}
    motion = make_signal({"x": x, **still}, RATE, units="m/s", speed=2 * math.pi * 1000 / 60, teeth=(29, 29))
    seen = measure(laser_vibrometer(motion, [1, 0, 0]), noise_rms=1e-3, bits=16, full_scale=4.0, seed=1)
    assert seen.attrs["sampling_rate"] == 12800.0
    np.testing.assert_allclose(gmf_rms(seen)["orders"][:, 0], np.array([1.0, 0.5, 0.25]) / math.sqrt(2), rtol=2e-3)
    back = read_signal(write_signal(seen, tmp_path / "laser.nc"))
    np.testing.assert_array_equal(back.values, seen.values)
    acceleration = convert(back, "acceleration", band=(100.0, 5000.0))
    expected = 2 * math.pi * gmf * np.array([1.0, 1.0, 0.75]) / math.sqrt(2)  # a = w v, w = k times the first
    np.testing.assert_allclose(gmf_rms(acceleration)["orders"][:, 0], expected, rtol=3e-3)


def test_truth_is_no_range_and_no_number_of_pulses():
    from gearmbs.signals import phase_from_tacho, quantise, to_signal

    pulses = to_signal(np.tile([0.0, 0.0, 1.0, 1.0], 10), rate=40.0, units="V")
    with pytest.raises(SignalError, match=r"full_scale.*True"):
        quantise(pulses, bits=8, full_scale=True)
    with pytest.raises(SignalError, match=r"pulses_per_rev.*True"):
        phase_from_tacho(pulses, pulses_per_rev=True)
    assert quantise(pulses, bits=8, full_scale=1).shape == pulses.shape
    assert phase_from_tacho(pulses, pulses_per_rev=1).size > 0
