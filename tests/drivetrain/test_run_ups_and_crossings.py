"""Modes, the ranking of their crossings and simulated run-ups of teeth in contact agree."""

import numpy as np
import pytest
from scipy.signal import find_peaks

from gearmbs.drivetrain import Drivetrain, GearMesh, RunSettings, Shaft, SpeedDrive, TorqueLoad
from gearmbs.gears import GearSpec
from gearmbs.signals import order_track
from gearmbs.studies import ranked_crossings, run_train, train_campbell, train_signal

CURVE = [["0.05 s", "640 rpm"], ["2.2 s", "770 rpm"], ["2.9 s", "1330 rpm"], ["5.1 s", "1480 rpm"]]
"""Slow where the crossings ranked first are, so that what rings there, for 16 ms, shifts peaks by 0.2 %."""


def pair():
    """A helical pair on two shafts that bend, in elastic bearings; its first mode under load has a gain above 2."""

    def shaft(name, diameter, teeth, hand, bearings):
        gear = GearSpec(teeth, "3 mm", face_width="25 mm", helix_angle="15 deg", hand=hand, bore_radius=diameter / 2)
        spring = {"kind": "elastic", "stiffness": (2e8, 2e8, 1e8), "damping_time": 5e-5}
        seats = {n: {"station": z, **spring} for n, z in zip(bearings, ("26 mm", "214 mm"))}
        return Shaft(name=name, length="240 mm", diameter=diameter, modes=4, elements=6,
                     wheels={f"{name} wheel": ("80 mm", gear)}, bearings=seats)  # fmt: skip

    return Drivetrain(
        "pair",
        shafts=[shaft("input", 0.03, 21, "right", "ab"), shaft("output", 0.04, 52, "left", "cd")],
        meshes=[GearMesh(name="stage", driver="input wheel", driven="output wheel")],
        drives=[SpeedDrive(name="motor", shaft="input", speed="1480 rpm", curve=CURVE)],
        loads=[TorqueLoad(name="brake", shaft="output", torque="200 N m")],
        running=True,
    )


def tracks(record, channels):
    """Speeds, rpm, and levels (n, 2) of two mesh harmonics: root of the sum of squares of some channels."""
    found = [order_track(train_signal(record, c), orders=[21, 42], revolutions=1.5, overlap=0.9) for c in channels]
    level = np.sqrt(sum(np.abs(track.values[..., 0]) ** 2 for track in found))
    return np.abs(found[0].speed.values) * 30.0 / np.pi, level


def centre(speed, level, peak):
    """Mean speed, rpm, over which a level is within 1 % of its peak.

    A resonance is flat there to 0.1 % while the speed of a window of 1.5 turns swings by 0.7 %: which of these samples
    is the highest hangs on the steps.
    """
    low = level < 0.99 * level[peak]
    first = peak - np.argmax(low[peak::-1]) + 1
    last = peak + np.argmax(low[peak:])
    return speed[first:last].mean()


@pytest.mark.slow
def test_clear_peaks_of_a_run_up_stand_at_the_crossings_that_are_ranked_first():
    """Peaks of 6 dB and more in the tracks of tooth and bearing forces, from a tenth of the largest line on."""
    train = pair()
    ranked = ranked_crossings(train_campbell(train, ["0 rpm", "6000 rpm"], harmonics=2, maximum=3000.0))
    first = ranked[ranked.gain > 1.0]
    assert sorted(first.order) == ["1 x stage", "2 x stage"]
    record = run_train(train, RunSettings(settling=0.05, duration=5.05, tolerance=1e-6))
    for channels in (["force of stage"], [f"{bearing} {axis}" for bearing in "abcd" for axis in "xyz"]):
        speed, level = tracks(record, channels)
        met = set()
        for k in range(2):
            peaks, _ = find_peaks(20.0 * np.log10(level[:, k]), prominence=6.0)
            # between the slow parts the speed passes too fast for lines to follow
            slowly = (speed[peaks] < 770.0) | (speed[peaks] > 1330.0)
            for at in peaks[(level[peaks, k] > 0.1 * level.max()) & slowly]:
                stands = centre(speed, level[:, k], at)
                away = np.abs(stands / first.speed_rpm - 1.0)
                assert away.min() < 0.01, (channels, k + 1, stands)
                met.add(int(away.idxmin()))
        assert met == set(first.index)
