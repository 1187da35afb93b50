"""Linear plants of decks against plants known in closed form."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gearmbs.adams import DeckError, linear_plant, parse_deck, parse_script, read_results, run_deck
from tests.says import says

MASS, STIFFNESS, DAMPING = 2.0, 50.0, 3.0
SPRING = f"""mass, spring and damper
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
MARKER/11, PART=1, ZP=1,0,0
PART/2, MASS={MASS}, CM=20, IP=1,1,1
MARKER/20, PART=2
MARKER/21, PART=2, ZP=1,0,0
JOINT/1, TRANSLATIONAL, I=21, J=11
VARIABLE/1, FUNCTION=0
VARIABLE/2, FUNCTION=DX(20,1)
VARIABLE/3, FUNCTION=VX(20,1)
VARIABLE/4, FUNCTION=ACCX(20,1)
PINPUT/1, VARIABLES=1
POUTPUT/1, VARIABLES=2,3,4
SFORCE/1, TRANSLATIONAL, I=21, J=11, ACTIONONLY
, FUNCTION=VARVAL(1)-{STIFFNESS}*DX(20,1)-{DAMPING}*VX(20,1)
END
"""
LENGTH, INERTIA = 0.4, 0.1
PENDULUM_AT_REST = f"""hangs along -y, and a torque may act on it
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
PART/2, MASS={MASS}, CM=20, IP={INERTIA},{INERTIA},{INERTIA}, QG=0,-{LENGTH},0
MARKER/20, PART=2
MARKER/21, PART=2, QP=0,{LENGTH},0
JOINT/1, REVOLUTE, I=21, J=1
VARIABLE/1, FUNCTION=0
VARIABLE/2, FUNCTION=FX(21,1)
VARIABLE/3, FUNCTION=JOINT(1,0,2,0)
PINPUT/1, VARIABLES=1
POUTPUT/1, VARIABLES=2,3
SFORCE/1, ROTATIONAL, I=21, J=1, FUNCTION=-VARVAL(1)
DIFF/1, IC=0, FUNCTION=FY(21,1)
DIFF/2, IC=0, FUNCTION=JOINT(1,0,3,0)
REQUEST/1, F2=DIF(1)\\F3=DIF(2)
ACCGRAV/JGRAV=-9.81
END
"""


def in_other_units(text: str) -> str:
    """Return the deck with lengths in mm and times in ms; forces stay in N."""
    text = text.replace("LENGTH=METER, TIME=SECOND", "LENGTH=MILLIMETER, TIME=MILLISECOND").replace("1,0,0", "1E3,0,0")
    return text.replace(f"{STIFFNESS}*DX", f"{STIFFNESS / 1e3}*DX").replace(f"{DAMPING}*VX", f"{DAMPING}*VX")


@pytest.mark.parametrize("s", [0.3j, 5.0j, 1.0 + 2.0j, 100.0])
def test_a_mass_on_a_spring_has_its_transfer_function(s):
    plant = linear_plant(parse_deck(SPRING))
    exact = np.array([1.0, s, s**2]) / (MASS * s**2 + DAMPING * s + STIFFNESS)
    assert plant.transfer(s)[:, 0] == pytest.approx(exact, rel=1e-8)
    assert plant.poles == pytest.approx(np.roots([MASS, DAMPING, STIFFNESS]), rel=1e-8)


def test_the_plant_is_in_the_units_of_the_deck():
    # DX in mm, VX in mm/ms = m/s: the damping stays as it is
    plant = linear_plant(parse_deck(in_other_units(SPRING)))
    s = 5.0j
    exact = np.array([1e3, s, s**2 * 1e-3]) / (MASS * s**2 + DAMPING * s + STIFFNESS)
    assert plant.transfer(s * 1e-3)[:, 0] == pytest.approx(exact, rel=1e-8)
    assert plant.time_unit == 1e-3


def test_a_step_of_the_plant_is_that_of_the_deck():
    plant = linear_plant(parse_deck(SPRING))
    driven = parse_deck(SPRING.replace("VARIABLE/1, FUNCTION=0", "VARIABLE/1, FUNCTION=1").replace(
        "END\n", "REQUEST/1, F2=VARVAL(2)\\F3=VARVAL(3)\\F4=VARVAL(4)\nEND\n"))  # fmt: skip
    result = run_deck(driven, parse_script("a\nb\nsimulate/dynamics, end=3, steps=60\n"), tol=1e-10)
    found, simulated = plant.step(result.t), result.request(1)[:, 1:4]
    natural = np.sqrt(STIFFNESS / MASS)
    ratio = DAMPING / (2.0 * MASS * natural)
    damped = natural * np.sqrt(1.0 - ratio**2)
    decay = np.exp(-ratio * natural * result.t)
    turned = np.cos(damped * result.t) + ratio * natural / damped * np.sin(damped * result.t)
    assert found[:, 0] == pytest.approx((1.0 - decay * turned) / STIFFNESS, abs=1e-12)
    assert simulated == pytest.approx(found, abs=1e-7)


PENDULUM = """a pendulum driven at its hinge
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
ACCGRAV/JGRAV=-9.81
PART/1, GROUND
MARKER/1, PART=1
PART/2, MASS=1.5, CM=20, IP=0.1,0.1,0.2, QG={x},{y},0
MARKER/20, PART=2
MARKER/21, PART=2, QP={mx},{my},0
JOINT/1, REVOLUTE, I=21, J=1
VARIABLE/1, FUNCTION={torque}
VARIABLE/2, FUNCTION=AZ(21,1)
PINPUT/1, VARIABLES=1
PINPUT/2, VARIABLES=1
POUTPUT/1, VARIABLES=2
SFORCE/1, ROTATIONAL, I=21, J=1, ACTIONONLY, FUNCTION=VARVAL(1)
END
"""


@pytest.mark.parametrize("angle", [0.0, np.pi])
def test_a_pendulum_hanging_or_standing(angle):
    length = 0.8
    x, y = length * np.sin(angle), -length * np.cos(angle)
    deck = parse_deck(PENDULUM.format(x=x, y=y, mx=-x, my=-y, torque=0))
    plant = linear_plant(deck, pinput=1)
    inertia = 0.2 + 1.5 * length**2
    s = 0.7 + 2.0j
    exact = 1.0 / (inertia * s**2 + 1.5 * 9.81 * length * np.cos(angle))
    assert plant.transfer(s)[0, 0] == pytest.approx(exact, rel=1e-8)
    assert (plant.poles.real.max() > 1.0) == (angle > 0.0)


def test_a_pendulum_at_the_equilibrium_under_its_torque():
    torque, length = 5.0, 0.8
    deck = parse_deck(PENDULUM.format(x=0, y=-length, mx=0, my=length, torque=torque))
    plant = linear_plant(deck, pinput=2, at="equilibrium")
    angle = np.arcsin(torque / (1.5 * 9.81 * length))
    exact = 1.0 / (1.5 * 9.81 * length * np.cos(angle))
    assert plant.transfer(0.0)[0, 0] == pytest.approx(exact, rel=1e-8)


def test_a_script_writes_the_plant(tmp_path):
    script = parse_script("a\nb\nsimulate/statics\nlinear/statemat, pinput=1, poutput=1, file=arm\n")
    result = run_deck(parse_deck(SPRING), script, tmp_path / "run")
    from scipy.io import loadmat

    found = loadmat(tmp_path / "arm.mat")
    (plant,) = result.plants
    assert np.array_equal(found["A"], plant.A)
    assert "S T A T E" in (tmp_path / "run.msg").read_text()
    with np.load(plant.save(tmp_path / "arm.npz")) as again:
        assert again["outputs"].tolist() == ["VARIABLE/2", "VARIABLE/3", "VARIABLE/4"]


@pytest.mark.parametrize(
    ("deck", "options", "message"),
    [
        (SPRING.replace("PINPUT/1, VARIABLES=1\n", ""), {}, says("deck", "add PINPUT/1")),
        (SPRING, {"poutput": 4}, says("POUTPUT/4", "deck", "POUTPUT 1")),
        (PENDULUM.format(x=0, y=-1, mx=0, my=1, torque=0), {}, says("deck", "1", "2", "give PINPUT")),
        (SPRING, {"at": "rest"}, says("'rest'", "choose initial")),
    ],
)
def test_what_is_missing_is_named(deck, options, message):
    with pytest.raises(DeckError, match=message):
        linear_plant(parse_deck(deck), **options)


def test_a_force_that_follows_the_acceleration_counts_in_the_modes():
    added = 1.3
    text = SPRING.replace(f"-{DAMPING}*VX(20,1)", f"-{added}*ACCX(20,1)")
    deck = parse_deck(text)
    (modes,) = run_deck(deck, parse_script("a\nb\nlinear/eigensol\n")).modes
    natural = np.sqrt(STIFFNESS / (MASS + added))
    assert modes.eigenvalues.imag == pytest.approx([natural], rel=1e-9)
    s = 2.0 + 3.0j
    exact = np.array([1.0, s, s**2]) / ((MASS + added) * s**2 + STIFFNESS)
    assert linear_plant(deck).transfer(s)[:, 0] == pytest.approx(exact, rel=1e-8)


@pytest.mark.slow
def test_the_command_writes_the_plant(tmp_path):
    from typer.testing import CliRunner

    from gearmbs.cli import app

    (tmp_path / "mass.adm").write_text(SPRING)
    runner = CliRunner()
    done = runner.invoke(app, ["plant", str(tmp_path / "mass.adm"), "--equilibrium", "-o", str(tmp_path / "m.npz")])
    assert done.exit_code == 0, done.output
    with np.load(tmp_path / "m.npz") as found:
        assert found["A"].shape == (2, 2)
    done = runner.invoke(app, ["plant", str(tmp_path / "mass.adm"), "-o", str(tmp_path / "m.txt")])
    assert done.exit_code == 1
    assert "a plant is written as .mat or .npz" in done.output


def test_variables_and_lists_of_a_control_program_are_in_the_results(tmp_path):
    """As ADAMS has them: VARIABLEs with the component Q, PINPUT with IN1 and so on, POUTPUT with OUT1."""
    script = parse_script("m\no\nSIM/DYN, END=0.1, STEPS=5\nVARIABLE/1, FUNCTION=8*TIME\nSIM/DYN, END=0.2, STEPS=5\n")
    result = run_deck(parse_deck(SPRING), script, tmp_path / "spring", tol=1e-8)
    assert result.variables == [1, 2, 3, 4]
    np.testing.assert_array_equal(result.variable(1), np.r_[np.zeros(6), 8 * result.t[6:]])
    np.testing.assert_allclose(result.variable(2), result.part(2)[:, 0], atol=1e-15)
    np.testing.assert_allclose(result.variable(4), result.part(2)[:, 12], atol=1e-12)
    np.testing.assert_array_equal(result.to_dataset().variable_2, result.variable(2))
    found = read_results(tmp_path / "spring.res")
    assert found["VARIABLE_2"].kind == "ADAMS_Variable"
    np.testing.assert_allclose(found["VARIABLE_2"]["Q"], result.variable(2), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(found["PINPUT_1"]["IN1"], result.variable(1), rtol=1e-9)
    assert found["POUTPUT_1"].components == ("OUT1", "OUT2", "OUT3")
    with pytest.raises(KeyError, match=says("VARIABLE/9", "1", "2", "3", "4")):
        result.variable(9)


def test_the_force_between_two_markers_is_that_of_their_joint_once():
    hung = PENDULUM_AT_REST
    plant = linear_plant(parse_deck(hung))
    # m g - F = 0 along the arm, and the force across it follows the torque: M / L (m L^2) / (m L^2 + I)
    across = -1.0 / LENGTH * MASS * LENGTH**2 / (MASS * LENGTH**2 + INERTIA)
    assert plant.D[:, 0] == pytest.approx([across, across], rel=1e-8)
    result = run_deck(parse_deck(hung), parse_script("a\nb\nsimulate/dynamics, end=0.5, steps=5\n"))
    assert result.request(1)[-1, 1:3] == pytest.approx(0.5 * MASS * 9.81, rel=1e-6)


SPINNING = """top
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
PART/2, MASS=2, CM=20, IP=1,2,3, WX=1, WY=2, WZ=3
MARKER/20, PART=2
VARIABLE/1, FUNCTION=0
VARIABLE/2, FUNCTION=WX(20)
PINPUT/1, VARIABLES=1
POUTPUT/1, VARIABLES=2
JOINT/1, SPHERICAL, I=20, J=1
SFORCE/1, ROTATIONAL, ACTIONONLY, I=20, J=1, FUNCTION=VARVAL(1)
END
"""


def test_plants_whose_coefficients_vary_are_told(recwarn):
    """As a remark of the script, and as a warning of the function."""
    script = parse_script("a\nb\nLINEAR/STATEMAT, PINPUT=1, POUTPUT=1\n")
    result = run_deck(parse_deck(SPINNING), script)
    assert not recwarn
    assert any(re.search(says("LINEAR", "PART_2"), message) for message in result.messages)
    with pytest.warns(UserWarning, match=says("LINEAR", "PART_2")):
        linear_plant(parse_deck(SPINNING))
