"""FMUs as controllers in a simulation: against sampled solutions, and what a state takes back."""

import re
import shutil
import zipfile

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import ModelError
from gearmbs.native import ForeignFMU, export
from tests.says import says

pytest.importorskip("fmpy")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler is installed"),
]

PERIOD = 0.01
GAIN = 3.0
"""Of the integrator: 1 / its moment of inertia."""
VERSIONS = ("fmu2", "fmu3")


def disc(name, inertia, load):
    m = gm.Mechanism(name)
    body = m.body("disc", mass=1.0, inertia=(inertia,) * 3)
    pin = m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", body, m.input("load", "N m", load))
    m.output("speed", ("angular_velocity", "disc", "z"))
    m.output("angle", ("evaluate", "AZ(pin.I, pin.J)")) if load else None
    return m, pin


@pytest.fixture(scope="module", params=VERSIONS)
def integrator(request, tmp_path_factory):
    """A disc whose speed is the integral of its torque, as an FMU of somebody else."""
    m, _ = disc("integrator", 1.0 / GAIN, 0.0)
    return export(m, tmp_path_factory.mktemp(request.param), t_end=5.0, target=request.param).library


def simulator(**options):
    m, _ = disc("plant", 2.0, 1.0)
    return gm.Simulator(m, t_end=2.0, records=False, tol=1e-9, **options)


def error(t, sim):
    return 1.0 - sim.get("output", "speed")


def sampled(count):
    """Speeds of the plant at the samples under the integral of the error, both held in between: exact."""
    w, x, out = 0.0, 0.0, []
    u = 1.0 - w
    for _ in range(count):
        torque = x
        w, x = w + torque * PERIOD / 2.0, x + GAIN * u * PERIOD
        u = 1.0 - w
        out.append(w)
    return np.array(out)


def test_a_loop_is_that_of_its_samples(integrator):
    sim = simulator()
    ForeignFMU(integrator, {"load": error}).control(sim, {"load": "speed"}, PERIOD)
    speeds = []
    for k in range(1, 151):
        sim.advance(k * PERIOD)
        speeds.append(sim.get("output", "speed"))
    exact = sampled(150)
    # the integrator has a tolerance of its own, 1e-6
    np.testing.assert_allclose(speeds, exact, rtol=0, atol=3e-6 * np.abs(exact).max())


def test_a_state_takes_the_fmu_back(integrator):
    """What follows from a state is the same again, in this simulator and in another one with another FMU."""
    sim = simulator()
    ForeignFMU(integrator, {"load": error}).control(sim, {"load": "speed"}, PERIOD)
    sim.advance(0.5)
    state = sim.state()

    def go_on(one):
        out = []
        for k in range(1, 31):
            one.advance(0.5 + k * 0.007)
            out.append(one.get("output", "speed"))
        return out

    first = go_on(sim)
    sim.restore(state)
    assert go_on(sim) == first
    other = simulator(initial=state)
    assert other.awaited == ["load"]
    ForeignFMU(integrator, {"load": error}).control(other, {"load": "speed"}, PERIOD)
    assert other.awaited == []
    assert go_on(other) == first


def changed(path, target, pattern, by):
    """A copy of an FMU whose description says something else."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                text, count = re.subn(pattern, by, data.decode())
                assert count
                data = text.encode()
            new.writestr(name, data)
    return target


def test_an_fmu_that_saves_nothing_is_told(integrator, tmp_path):
    """It runs as well; after a restore there is a word on what did not go back."""
    plain = changed(integrator, tmp_path / "plain.fmu", r'canGetAndSetFMU[sS]tate="true"', "")
    sims = [simulator(), simulator()]
    for sim, file in zip(sims, (integrator, plain), strict=True):
        ForeignFMU(file, {"load": error}).control(sim, {"load": "speed"}, PERIOD)
        sim.advance(0.5)
    assert sims[0].get("output", "speed") == sims[1].get("output", "speed")
    state = sims[0].state()
    with pytest.warns(UserWarning, match=says("load", "state", "restore")):
        sims[1].restore(state)


def test_units_are_those_of_the_fmu(integrator, tmp_path):
    """A speed that the FMU counts in turns a minute is brought to rad/s."""
    rpm = changed(integrator, tmp_path / "rpm.fmu", r'<BaseUnit s="-1" rad="1" ?/>',
                  f'<BaseUnit s="-1" rad="1" factor="{2 * np.pi / 60!r}"/>')  # fmt: skip
    torques = []
    for file in (integrator, rpm):
        sim = simulator()
        ForeignFMU(file, {"load": 1.0}).control(sim, {"load": "speed"}, PERIOD)
        sim.advance(0.5)
        torques.append(sim.get("input", "load"))
    assert torques[1] == pytest.approx(torques[0] * 2 * np.pi / 60, rel=1e-12)


def test_what_inputs_follow(integrator):
    """Outputs by name, quantities with a component, numbers and functions mean the same."""
    found = []
    for source in ("speed", ("angular_velocity", "disc", "z"), lambda t, sim: sim.get("angular_velocity", "disc")[2]):
        sim = simulator()
        sim.set("load", 4.0)
        ForeignFMU(integrator, {"load": source}).control(sim, {"load": "speed"}, PERIOD)
        sim.advance(0.4)
        found.append(sim.get("output", "speed"))
    assert found[0] == found[1] == found[2]


def test_mistakes_are_told(integrator, tmp_path):
    with pytest.raises(ModelError, match=says("lod", "did you mean", "load")):
        ForeignFMU(integrator, {"lod": 1.0})
    with pytest.raises(ModelError, match=says("none.fmu", "no such file")):
        ForeignFMU(tmp_path / "none.fmu")
    (tmp_path / "text.fmu").write_text("no archive")
    with pytest.raises(ModelError, match=says("FMU", "cannot be read")):
        ForeignFMU(tmp_path / "text.fmu")
    with pytest.raises(ModelError, match=says("speeed", "did you mean", "speed")):
        ForeignFMU(integrator, {"load": 1.0}).control(simulator(), {"load": "speeed"}, PERIOD)
    sim = simulator()
    ForeignFMU(integrator, {"load": float("nan")}).control(sim, {"load": "speed"}, PERIOD)
    with pytest.raises(ModelError, match=says("load", "nan", "finite")):
        sim.advance(0.1)
    only = r'<ModelExchange modelIdentifier="integrator" />'
    exchange = changed(integrator, tmp_path / "me.fmu", r"<CoSimulation[^>]*/>", only)
    with pytest.raises(ModelError, match=says("me.fmu", "Co-Simulation", "export")):
        ForeignFMU(exchange)
    used = ForeignFMU(integrator, {"load": 1.0})
    used.control(simulator(), {"load": "speed"}, PERIOD)
    with pytest.raises(ModelError, match=says("already", "another", "ForeignFMU")):
        used.control(simulator(), {"load": "speed"}, PERIOD)
