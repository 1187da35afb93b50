"""FMUs as controllers in a simulation: against sampled solutions, and what a state takes back."""

import re
import shutil
import warnings
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


def test_differences_have_no_zero(integrator, tmp_path):
    """The zero of a unit, as that of degC, is that of absolute quantities: FMI's relativeQuantity has none."""
    off = changed(
        integrator, tmp_path / "off.fmu", r'<BaseUnit s="-1" rad="1" ?/>', '<BaseUnit s="-1" rad="1" offset="5"/>'
    )
    relative = changed(off, tmp_path / "relative.fmu", r'unit="rad/s"', 'unit="rad/s" relativeQuantity="true"')
    torques = []
    for file in (integrator, off, relative):
        sim = simulator()
        ForeignFMU(file, {"load": 1.0}).control(sim, {"load": "speed"}, PERIOD)
        sim.advance(0.5)
        torques.append(sim.get("input", "load"))
    assert torques[1] == pytest.approx(torques[0] + 5.0, rel=1e-12)
    assert torques[2] == torques[0]


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


@pytest.fixture(scope="module", params=VERSIONS)
def two_outputs(request, tmp_path_factory):
    """The integrator with its torque beside its speed: that follows the input at once."""
    m, _ = disc("both", 1.0 / GAIN, 0.0)
    m.output("torque", ("load", "drive", "tz"))
    return export(m, tmp_path_factory.mktemp(request.param), t_end=5.0, target=request.param).library


def two_inputs(**options):
    m, _ = disc("plant", 2.0, 1.0)
    m.torque("second", m.bodies["disc"], m.input("other", "N m", 0.5))
    return gm.Simulator(m, t_end=2.0, records=False, tol=1e-9, **options)


OUTPUTS = {"load": "speed", "other": "torque"}


def test_all_outputs_are_those_of_inputs_read_once(two_outputs):
    """What an input follows is read before any output sets an input, once a sample."""
    sim, read = two_inputs(), []

    def both(t, sim):
        read.append((t, sim.get("input", "load"), sim.get("input", "other")))
        return read[-1][1] + 2.0 * read[-1][2]

    ForeignFMU(two_outputs, {"load": both}).control(sim, OUTPUTS, PERIOD)
    sim.advance(3.5 * PERIOD)
    load, other, speed, u, exact = 1.0, 0.5, 0.0, 0.0, []
    for k in range(4):
        speed += GAIN * u * PERIOD if k else 0.0
        exact.append((k * PERIOD, load, other))
        u = load + 2.0 * other
        load, other = speed, u
    np.testing.assert_allclose(read, exact, rtol=1e-6, atol=1e-9)
    assert sim.get("input", "other") == pytest.approx(other, rel=1e-6)


def test_all_outputs_go_on_at_their_samples_in_another_simulator(two_outputs):
    """From a state between two samples both inputs are set at the samples of before."""
    sim = two_inputs()
    ForeignFMU(two_outputs, {"load": error}).control(sim, OUTPUTS, PERIOD)
    sim.advance(50.6 * PERIOD)
    state = sim.state()
    other = two_inputs(initial=state)
    assert other.awaited == list(OUTPUTS)
    ForeignFMU(two_outputs, {"load": error}).control(other, OUTPUTS, PERIOD)
    for k in range(1, 40):
        for one in (sim, other):
            one.advance(50.6 * PERIOD + 0.003 * k)
        assert [one.get("output", "speed") for one in (sim, other)] == [sim.get("output", "speed")] * 2
        assert other.get("input", "other") == sim.get("input", "other")


def test_an_fmu_that_did_not_go_back_is_refused(integrator, tmp_path):
    """With a state of before it was there; from one of before its first sample it begins anew."""
    sim = simulator()
    before = sim.state()
    ForeignFMU(integrator, {"load": error}).control(sim, {"load": "speed"}, PERIOD)
    begun = sim.state()
    sim.advance(0.5)
    first = sim.get("output", "speed")
    sim.restore(begun)
    sim.advance(0.5)
    assert sim.get("output", "speed") == first
    sim.restore(before)
    with pytest.raises(ModelError, match=says("0.49", "states after", "sample_time")):
        sim.advance(0.6)
    # one that cannot save its state goes back within its last sample alone
    plain = changed(integrator, tmp_path / "plain.fmu", r'canGetAndSetFMU[sS]tate="true"', "")
    sim = simulator()
    ForeignFMU(plain, {"load": error}).control(sim, {"load": "speed"}, PERIOD)
    sim.advance(30.2 * PERIOD)
    state = sim.state()
    sim.advance(30.8 * PERIOD)
    sim.restore(state)
    sim.advance(32.5 * PERIOD)
    sim.restore(state)
    with pytest.raises(ModelError, match=says("0.32", "states after", "save")):
        sim.advance(0.5)


def spied(name, function, calls):
    """A method that notes its calls."""

    def noted(self, *args, **kwargs):
        calls.append((name, args))
        return function(self, *args, **kwargs)

    return noted


def test_it_is_initialised_with_its_first_inputs(integrator, monkeypatch):
    import fmpy.fmi2
    import fmpy.fmi3

    calls = []
    for kind, put in ((fmpy.fmi2.FMU2Slave, "setReal"), (fmpy.fmi3.FMU3Slave, "setFloat64")):
        for name in (put, "exitInitializationMode", "doStep"):
            monkeypatch.setattr(kind, name, spied(name, getattr(kind, name), calls))
    sim = simulator()
    sim.advance(0.1)
    with pytest.raises(ModelError, match=says("start", "0.1")):
        # it was exported to begin at zero
        ForeignFMU(integrator, {"load": 7.0}).control(sim, {"load": "speed"}, PERIOD)
    sim = simulator()
    calls.clear()
    ForeignFMU(integrator, {"load": 7.0}).control(sim, {"load": "speed"}, PERIOD)
    sim.advance(1.5 * PERIOD)
    assert [name for name, _ in calls] == [calls[0][0], "exitInitializationMode", "doStep", calls[0][0]]
    assert calls[0][1][1] == [7.0]
    # it may be asked to go back behind the beginning of a step
    assert calls[2][1][2] is False


def test_units_that_are_not_described_are_told(integrator, tmp_path):
    files = []
    for unit in ("1/min", "rpm"):
        named = changed(integrator, tmp_path / "named.fmu", r'unit="rad/s"', f'unit="{unit}"')
        alone = rf'<Unit name="{unit}" />'
        files.append(changed(named, tmp_path / f"{len(files)}.fmu", r'(?s)<Unit name="rad/s">.*?</Unit>', alone))
    turns, known = files
    with pytest.warns(UserWarning, match=says("1/min", "speed", "SI units")):
        ForeignFMU(turns, {"load": 1.0}).control(simulator(), {"load": "speed"}, PERIOD)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim = simulator()
        ForeignFMU(known, {"load": 1.0}).control(sim, {"load": "speed"}, PERIOD)
    sim.advance(10.5 * PERIOD)
    assert sim.get("input", "load") == pytest.approx(GAIN * 0.1 * 2 * np.pi / 60, rel=1e-6)
