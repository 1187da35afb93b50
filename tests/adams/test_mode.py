"""MODE: which analysis it is, in requests, forces and equations."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import parse_deck, run_deck
from gearmbs.adams.parse.commands import parse_script

DECK = """a mass on a spring, and a state that only an equilibrium sets
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
PART/2, MASS=1, CM=20, IP=1,1,1
MARKER/20, PART=2
JOINT/1, TRANSLATIONAL, I=20, J=10
SFORCE/1, TRANSLATION, I=20, J=10, ACTIONONLY, FUNCTION=IF(mode-5: -100*DZ(20,10), 9.80665-100*(DZ(20,10)-0.25), 0)
DIFF/1, IC=1, FUNCTION=IF(MODE-5: 0, 2-DIF(1), 0)
REQUEST/1, F2=MODE\\F3=DIF(1)\\F4=DZ(20,10)
ACCGRAV/KGRAV=-9.80665
END
"""


def run(deck, script):
    result = run_deck(parse_deck(deck), parse_script("model\nsample\n" + script))
    assert result.success
    return [segment.requests[1].values[:, 1:] for segment in result.segments]


def test_an_equation_and_a_force_of_statics_alone():
    start, static, moving = run(DECK, "SIM/INITIAL\nSIM/STAT\nSIM/DYN, END=0.1, STEPS=10\n")
    np.testing.assert_array_equal([v[0, 0] for v in (start, static, moving)], [3.0, 5.0, 4.0])
    assert start[0, 1] == 1.0
    # the equation holds at an equilibrium, with the force of statics, and rests afterwards
    np.testing.assert_allclose(static[0, 1:3], [2.0, 0.25], atol=1e-9)
    np.testing.assert_allclose(moving[:, 1], 2.0, atol=1e-9)
    t = np.linspace(0.0, 0.1, 11)
    middle = -9.80665 / 100.0
    np.testing.assert_allclose(moving[:, 2], middle + (0.25 - middle) * np.cos(10.0 * t), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("command", "mode"), [("STAT, END=1, STEPS=2", 6.0), ("KIN, END=1, STEPS=2", 1.0)])
def test_sequences(command, mode):
    driven = DECK.replace("END\n", "MOTION/1, TRANSLATION, JOINT=1, FUNCTION=0.1*TIME\nEND\n").replace("DIFF/1,", "!")
    (values,) = run(driven.replace("\\F3=DIF(1)", ""), f"SIM/{command}\n")
    np.testing.assert_array_equal(values[:, 0], mode)
