"""Discs that were turned by another number of teeth than told, or the other way: the wheels' own errors tell."""

import math
import re

import numpy as np
import pytest

from gearmbs.signals import CoupledRun, SignalError, encoder, mark_errors, transmission_error_from_pulses
from tests.says import says
from tests.signals.encoders.bench import COUNTER, coupled

TEETH, RADIUS, LINES = 29, 40e-3, 512
PITCH = math.tau / TEETH
MARKS = [mark_errors(LINES, 0.01, k) for k in (1, 2)]


def runs(told, turned=PITCH / 2, tooth=10e-6, marks=1.0):
    """One run, and one with the driver's disc turned; a tooth of the driver is wrong."""

    def lag(turns):
        cycle = TEETH * turns
        own = np.where(np.floor(cycle + 0.5) % TEETH == 8, np.sin(math.pi * (cycle + 0.5)) ** 2, 0.0)
        return 3e-6 * np.cos(math.tau * cycle) + tooth * own

    angles = coupled(lag, (TEETH, TEETH), RADIUS, turns=16)

    def run(disc, shift, k):
        trains = [
            encoder(
                angles[s],
                LINES,
                marks=marks * MARKS[s],
                mounted=-disc * (s == 0),
                name=name,
                index=True,
                seed=k + s,
                **COUNTER,
            )
            for s, name in enumerate(("driver", "driven"))
        ]
        return CoupledRun(*trains, shift=(shift, 0.0))

    return [run(0.0, 0.0, 1), run(turned, told, 3)]


def found(told, **known):
    return transmission_error_from_pulses(runs(told, **known), (TEETH, TEETH), base_radius=RADIUS)


@pytest.mark.parametrize("told", [-PITCH / 2, 1.5 * PITCH])
def test_the_wrong_sense_and_a_tooth_too_many_are_refused(told):
    """Tooth 9 had been named for tooth 8, at -7.5 um within 0.05."""
    with pytest.raises(SignalError, match=says("shift", f"{math.degrees(PITCH / 2):+.3f} deg", "sense")):
        found(told)


def test_the_right_angle_runs_and_gives_the_tooth():
    result = found(PITCH / 2)
    assert not any("does not tell" in note for note in result.notes)
    teeth = result.tooth_errors("driver")
    assert int(teeth["deviation"].abs().idxmax()) == 8


def test_of_wheels_without_errors_the_marks_tell():
    """The disc of the other shaft stands elsewhere to the one that was turned."""
    with pytest.raises(SignalError, match=says("shift", "sense")):
        found(-PITCH / 2, tooth=0.0)


def test_where_nothing_but_the_mesh_is_seen_it_is_said():
    result = found(-PITCH / 2, tooth=0.0, marks=0.0)
    assert any(re.search(says("Run 2", "driver", "taken as told"), note) for note in result.notes)
