"""FMUs of models by which importers are tried, compiled here, and a drivetrain under a controller of their kind."""

import platform
import shutil
import subprocess
import zipfile
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import TorqueDrive, TorqueLoad, Wheel
from gearmbs.gears import GearSpec
from gearmbs.mechanism import make_input
from gearmbs.native import ForeignFMU, export
from tests.drivetrain.support import stage

fmpy = pytest.importorskip("fmpy")
COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed"),
    pytest.mark.skipif(platform.system() != "Linux", reason="POSIX: FMUs are built for Linux"),
]
MODELS = ("ball", "dahlquist", "van_der_pol", "controller")
VARIABLES = ("x0 output", "x1 output", "p0 parameter", "p1 parameter", "u input", "y output")
PERIOD = 2.0**-10
"""Of the controller, s: a number whose sums are exact, so that both loops have the same times to the last bit."""


def built(model, folder, step):
    """Return the path of an FMU with steps of so many seconds."""
    path, binary = folder / f"{model}.fmu", folder / f"{model}.so"
    source = Path(__file__).with_name("reference.c")
    command = [
        COMPILER,
        "-shared",
        "-fPIC",
        "-O1",
        "-ffp-contract=off",
        f"-DMODEL={MODELS.index(model)}",
        f"-DSTEP={step}",
        source,
    ]
    subprocess.run([*command, "-o", binary], check=True)
    variables = []
    for k, told in enumerate(VARIABLES):
        name, kind = told.split()
        start = "" if kind == "output" else ' start="0"'
        variability = "tunable" if kind == "parameter" else "continuous"
        variables.append(
            f'<ScalarVariable name="{name}" valueReference="{k}" causality="{kind}" variability="{variability}">'
            f"<Real{start}/></ScalarVariable>"
        )
    outputs = "".join(f'<Unknown index="{k + 1}"/>' for k, told in enumerate(VARIABLES) if told.endswith("output"))
    able = 'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
    text = (
        f'<fmiModelDescription fmiVersion="2.0" modelName="{model}" guid="{model}">'
        f'<CoSimulation modelIdentifier="{model}" {able}/><ModelVariables>{"".join(variables)}</ModelVariables>'
        f"<ModelStructure><Outputs>{outputs}</Outputs></ModelStructure></fmiModelDescription>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(binary, f"binaries/linux64/{model}.so")
    return path


def disc():
    m = gm.Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    for name in ("first", "second"):
        m.torque(name, body, m.input(f"{name} load", "N m"))
    return m


def told_by(fmu, period, count):
    """Return what the states of an FMU have been at its samples, shape (count, 2), gone back to half way once."""
    sim = gm.Simulator(disc(), t_end=2.0 * period * count, records=False)
    ForeignFMU(fmu).control(sim, {"first load": "x0", "second load": "x1"}, period)
    rows, state = [], None

    def go(first):
        for k in range(first, count):
            # a value acts from its sample on, up to the next
            sim.advance((k + 0.5) * period)
            rows.append([sim.get("input", f"{name} load") for name in ("first", "second")])

    go(0)
    once = np.array(rows)
    sim = gm.Simulator(disc(), t_end=2.0 * period * count, records=False)
    ForeignFMU(fmu).control(sim, {"first load": "x0", "second load": "x1"}, period)
    rows.clear()
    sim.advance((count // 2 - 0.5) * period)
    state = sim.state()
    go(count // 2)
    sim.restore(state)
    rows.clear()
    go(count // 2)
    np.testing.assert_array_equal(rows, once[count // 2 :])
    return once


def test_dahlquist(tmp_path):
    """Euler's steps of x' = -x: x = (1 - h)^k, by whole powers as by repeated steps."""
    x = told_by(built("dahlquist", tmp_path, 0.1), 0.1, 60)[:, 0]
    np.testing.assert_allclose(x, 0.9 ** np.arange(60), rtol=1e-14)


def test_van_der_pol(tmp_path):
    """The same steps in Python, bit for bit."""
    told = told_by(built("van_der_pol", tmp_path, 0.01), 0.01, 700)
    x, y = 2.0, 0.0
    for row in told.tolist():
        assert row == [x, y]
        x, y = x + 0.01 * y, y + 0.01 * (1.0 * ((1.0 - x * x) * y) - x)
    # its limit cycle has an amplitude of 2.0086; a turn takes 6.66 s
    assert np.abs(told[:, 0]).max() == pytest.approx(2.01, abs=0.02)


def test_bouncing_ball(tmp_path):
    """It first meets the ground after sqrt(2 h / g), and then rises to 0.49 of where it came from, again and again."""
    period = 0.001
    h = told_by(built("ball", tmp_path, period), period, 2500)[:, 0]
    hits = np.flatnonzero(h == 0.0)[:5]
    # Euler's steps are late by half a step, and a hit is seen at the end of one
    assert hits[0] * period == pytest.approx(np.sqrt(2.0 / 9.81), abs=2.0 * period)
    heights = [1.0, *(h[a:b].max() for a, b in pairwise(hits))]
    np.testing.assert_allclose(np.divide(heights[1:], heights[:-1]), 0.49, rtol=0.02)


def train():
    torques = [make_input(f"{name} torque", "N m", value) for name, value in (("motor", 40.0), ("brake", 120.0))]
    made = stage(
        wheels=[
            Wheel(name=name, shaft=shaft, station=0.05, gear=GearSpec(teeth, "3 mm", name=name, bore_radius="15 mm"))
            for name, shaft, teeth in (("pinion", "in", 20), ("gear", "out", 60))
        ],
        drives=[TorqueDrive(name="motor", shaft="in", speed="1500 rpm", torque=torques[0])],
        loads=[TorqueLoad(name="brake", shaft="out", torque=torques[1])],
        run_up=0.01,
        running=True,
    )
    m = made.build()
    m.outputs.clear()
    m.output("speed", ("angular_velocity", "in", "z"))
    m.output("force", ("load", "mesh", "fx"))
    m.output("error", ("transmission_error", "mesh"))
    return m, {"tol": 1e-6, "rate_scale": made.rate_scale}


def test_a_drivetrain_under_a_controller_in_fmpy(tmp_path):
    """Drivetrain and controller as two FMUs that FMPy runs: bit for bit the loop of a simulator."""
    from tests.native.test_fmu import Driven

    m, options = train()
    controller, count, wanted = built("controller", tmp_path, PERIOD), 40, 160.0
    made = export(m, tmp_path, t_end=1.0, target="fmu2", name="train", processor="native", **options)
    plant = Driven(str(made.library), str(tmp_path / "plant")).begin()
    plant.step(PERIOD)
    law = Driven(str(controller), str(tmp_path / "law"))
    law.fmu.setupExperiment(startTime=PERIOD)
    law.fmu.enterInitializationMode()
    told = []
    for k in range(1, count):
        if k > 1:
            law.step(PERIOD)
        law.set(u=wanted - plant.get("speed")[0])
        if k == 1:
            law.fmu.exitInitializationMode()
        plant.fmu.setReal([plant.references["motor torque"]], law.get("y"))
        plant.fmu.doStep(currentCommunicationPoint=k * PERIOD, communicationStepSize=PERIOD)
        told.append(plant.get("speed", "force", "error"))
    # a number that is set before the first step lets a simulator start afresh: the loop begins behind it
    sim = gm.Simulator(m, 1.0, lump=False, records=False, **options)
    sim.advance(PERIOD)
    law_of_sim = ForeignFMU(controller, {"u": lambda t, sim: wanted - sim.get("output", "speed")})
    law_of_sim.control(sim, {"motor torque": "y"}, PERIOD)
    own = []
    for k in range(1, count):
        sim.advance((k + 1) * PERIOD)
        own.append([sim.get("output", name) for name in ("speed", "force", "error")])
    np.testing.assert_array_equal(told, own)
    assert len({one[0] for one in own}) == len(own)
    for one in (plant, law):
        one.end()
