"""Drivetrains written as decks: their drives, loads and clutches as expressions that do what the compiled laws do."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import parse_deck, parse_script, run_deck, write_deck
from gearmbs.dae.problem import ModelError
from gearmbs.drivetrain import (
    Brake,
    CircuitMotor,
    ControlledDrive,
    CurveMotor,
    Drag,
    Drivetrain,
    ElasticClutch,
    Fan,
    IdealBearing,
    InductionMotor,
    Pump,
    Shaft,
    TableLoad,
    TorqueDrive,
    TorqueLoad,
)
from gearmbs.drivetrain.drives import Drive
from gearmbs.drivetrain.loads import Load
from tests.says import says

MOTOR = {"name": "motor", "shaft": "first", "speed": "1450 rpm"}
MILL = {"name": "mill", "shaft": "second"}
TORQUE = TorqueDrive(**MOTOR, torque=40.0)


def train(drive: Drive, load: Load, **clutch: float) -> Drivetrain:
    return Drivetrain(
        "coupled",
        shafts=[
            Shaft(name="first", radius="30 mm", length="200 mm"),
            Shaft(name="second", radius="40 mm", length="200 mm"),
        ],
        couplings=[
            ElasticClutch(name="clutch", first="first", second="second", stiffness=900.0, damping=0.8, **clutch)
        ],
        bearings=[IdealBearing(name="a", shaft="first"), IdealBearing(name="b", shaft="second")],
        drives=[drive],
        loads=[load],
        run_up=0.02,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:drive")
@pytest.mark.parametrize(
    ("drive", "load", "clutch"),
    [
        (TORQUE, TorqueLoad(**MILL, torque=25.0), {}),
        (TorqueDrive(**MOTOR, torque="40*SIN(30*TIME)"), Drag(**MILL, torque=3.0, viscous=0.05), {"cubic": 2000.0}),
        (InductionMotor(**MOTOR, power="3 kW"), Fan(**MILL, torque=10.0, at_speed=150.0), {}),
        (InductionMotor(**MOTOR, power="3 kW", lag=True), Brake(**MILL, torque=8.0, smoothing=1.0), {}),
        (
            CircuitMotor(
                **MOTOR, stator_resistance=0.8, rotor_resistance=0.7, stator_reactance=1.1, rotor_reactance=1.3
            ),
            Pump(**MILL, displacement="10 cm^3", pressure="4 MPa", teeth=9, lag="2 ms", idle=0.4, viscous=0.01),
            {},
        ),
        (
            CurveMotor(**MOTOR, speeds=(0.0, 60.0, 120.0, 170.0), torques=(30.0, 38.0, 20.0, 0.0)),
            TableLoad(**MILL, over="time", places=(0.0, 0.02, 0.05, 0.2), torques=(0.0, 5.0, 9.0, 4.0)),
            {"second_stiffness": 3000.0, "second_stage": 0.01, "transition": 0.004},
        ),
        (
            ControlledDrive(**MOTOR, proportional=0.6, integral=8.0, largest=45.0),
            TorqueLoad(**MILL, torque=12.0),
            {"dead_band": 0.004, "depth": 0.001},
        ),
    ],
    ids=["torque", "expression", "Kloss", "lag", "circuit", "curve", "controlled"],
)
def test_a_written_drivetrain_moves_as_it_does(drive, load, clutch):
    mechanism = train(drive, load, **clutch).build()
    solution = mechanism.simulate(0.1, t_eval=np.linspace(0.0, 0.1, 41), tol=1e-9)
    deck = parse_deck(write_deck(mechanism, requests={"speed": ['WZ("motor.I")', 'WZ("mill.I")']}))
    result = run_deck(deck, parse_script("a\nb\nsimulate/dynamics, end=0.1, steps=40\n"), tol=1e-9)
    speeds = [solution.angular_velocity(name)[:, 2] for name in ("first", "second")]
    found = result.request(1)[:, 1:3].T
    assert np.abs(speeds).max() > 5.0
    np.testing.assert_allclose(found, speeds, atol=2e-5 * np.abs(speeds).max())


def test_what_has_no_form_says_what_has_one():
    turned = TableLoad(**MILL, over="angle", places=(0.0, 2.0, 4.0, 2 * np.pi), torques=(1.0, 2.0, 1.5, 1.0))
    with pytest.raises(ModelError, match=says("'mill'", "angle", "speed", "time")):
        write_deck(train(TORQUE, turned).build())
