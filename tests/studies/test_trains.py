"""Records of drivetrains: what they hold, what they are checked against, the command line, the report and the view."""

import json
import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.drivetrain import (
    Accelerometer,
    Drivetrain,
    DrivetrainError,
    ElasticBearing,
    GearMesh,
    Housing,
    IdealBearing,
    InductionMotor,
    Laser,
    Mount,
    RunSettings,
    Shaft,
    SpeedDrive,
    SpeedSensor,
    TorqueDrive,
    TorqueLoad,
    TorqueSensor,
)
from gearmbs.gears import GearSpec
from gearmbs.saving import save
from gearmbs.signals import analyse, order_track, to_signal
from gearmbs.signals.analysis.bands import harmonic_amplitudes
from gearmbs.signals.files.simulated import read_any
from gearmbs.studies import run_train, run_trains, train_report, train_scene, train_signal, train_spectrum
from gearmbs.studies.train_record import HeldSpeed, by_angle, counted_turns
from gearmbs.studies.trains import check_record, load_train
from tests.drivetrain.support import stage
from tests.drivetrain.test_description import TEXT
from tests.says import says


def measured_stage():
    """A stage on a housing, with one sensor of each kind."""
    mounts = [Mount(name=f"m{k}", at=at, stiffness=(2e7,) * 3, damping=(2e3,) * 3) for k, at in
              enumerate(((-0.2, -0.1, 0.0), (0.2, -0.1, 0.0), (0.0, -0.1, 0.2)))]  # fmt: skip
    bearing = ElasticBearing(name="b", shaft="out", stiffness=(1e8, 1e8, 1e8), tilting=(1e5, 1e5))
    return stage(
        bearings=[IdealBearing(name="a", shaft="in", on="ground"), bearing],
        housings=[Housing(name="box", mass=50.0, inertia=(1.0, 1.0, 1.0), mounts=mounts)],
        sensors=[
            Accelerometer(name="seat", bearing="b", direction=(0, 1, 0)),
            Laser(name="laser", shaft="out", direction=(0, 1, 0)),
            Laser(name="rim", shaft="out", direction=(0, 1, 0), offset=0.01),
            SpeedSensor(name="speed", shaft="out"),
            TorqueSensor(name="torque", of="brake"),
        ],
        running=True,
    )


@pytest.fixture(scope="module")
def train():
    return measured_stage()


@pytest.fixture(scope="module")
def record(train):
    return run_train(train, RunSettings(duration=0.12, settling=0.05, tolerance=1e-6))


def test_record_holds_the_mean_loads(train, record):
    """Torque over base radius is the mean force, the bearing carries it against the mounts, and speeds are right."""
    force = 300.0 / train.pairs["mesh"].geometry.driven.base_radius
    assert float(record.normal_force.mean()) == pytest.approx(force, rel=0.03)
    mean = record.bearing_force.sel(bearing="b").mean("time").values
    assert np.linalg.norm(mean) == pytest.approx(force, rel=0.03)
    assert np.abs(mean[2]) < 0.01 * force
    assert float(record.speed.sel(shaft="out").mean()) == pytest.approx(train.speeds["out"], rel=1e-4)
    assert record.measured.sel(sensor="torque").values == pytest.approx(300.0)
    assert record.time.values[0] == pytest.approx(0.1)
    assert record.sizes["time"] == round(0.12 * 12800)
    # the bearing, the housing and its mounts give way, too
    assert np.abs(record.transmission_error).max() < 3e-4


def test_sensors_agree_with_each_other(record):
    """A laser beside the axis sees the spin; the seat's acceleration is that of a body that does not drift."""
    laser, rim, speed = (record.measured.sel(sensor=name).values for name in ("laser", "rim", "speed"))
    np.testing.assert_allclose(rim - laser, np.abs(0.01 * speed), rtol=1e-3)
    assert np.abs(laser).max() < 0.1
    seat = record.measured.sel(sensor="seat").values
    assert 0.01 < seat.std() < 100.0
    assert np.abs(seat.mean()) < 0.1 * seat.std()


def test_harmonics_of_the_mesh(train, record):
    levels = record.mesh_rms.sel(mesh="mesh")
    assert float(levels.mesh_frequency) == pytest.approx(500.0, rel=1e-4)
    force = record.normal_force.sel(mesh="mesh").values
    whole = force - force.mean()
    line = np.sqrt(2.0) * np.abs(np.mean(whole * np.exp(-2j * np.pi * 500.0 * record.time.values)))
    assert float(levels.sel(signal="force of mesh", harmonic=1)) == pytest.approx(line, rel=0.05)


@pytest.mark.slow
def test_signals_go_on_to_the_analysis(tmp_path, record):
    one = train_signal(record, "seat")
    assert one.attrs["teeth"] == (20, 60)
    report = analyse(one)
    named = report.lines[report.lines.of != ""]
    assert (named.of.str.contains("GMF of mesh")).any()
    assert "| what it is |" in report.to_markdown()
    path = tmp_path / "record.nc"
    record.to_netcdf(path, engine="h5netcdf")
    signal = read_any(path)
    assert list(signal.channel.values) == ["seat", "laser", "rim", "speed", "torque"]
    assert json.loads(signal.attrs["known_lines"]) == json.loads(one.attrs["known_lines"])
    assert signal.attrs["speed"] == pytest.approx(one.attrs["speed"])
    assert "m/s^2" in str(signal.attrs) + str(signal.coords)
    with pytest.raises(DrivetrainError, match="no channel 'moon'; known are seat"):
        train_signal(record, "moon")
    assert train_signal(record, "b y").sizes["time"] == record.sizes["time"]
    with xr.open_dataset(path, engine="h5netcdf") as again:
        assert json.loads(again.attrs["train_json"])["pinion"]["gear"]["teeth"] == 20


def test_turns_are_counted_over_long_steps():
    """An even acceleration seen at steps of up to three turns, in both senses."""
    t = np.array([0.0, 0.01, 0.05, 0.06, 0.15, 0.2])
    angle = np.stack([1.0 + 150.0 * t + 40.0 * t**2, -2.0 - 90.0 * t], axis=1)
    speed = np.stack([150.0 + 80.0 * t, np.full(t.size, -90.0)], axis=1)
    seen = np.angle(np.exp(1j * angle))
    found = counted_turns(t, seen, speed)
    np.testing.assert_allclose(found - found[0], angle - angle[0], atol=1e-12)


@pytest.mark.slow
def test_report_and_view(train, record):
    text = train_report(train, record)
    for words in ("## Speeds and frequencies", "| mesh | mesh | GMF | 500 |", "## Bearings", "| laser | m/s |",
                  "### mesh, 500"):  # fmt: skip
        assert words in text
    scene = train_scene(train)
    assert {"in", "out", "box"} <= {part.name for part in scene.parts}
    # the housing is seen through, whatever stands inside is in the picture, and the page is small
    assert {part.name for part in scene.parts if part.opacity < 1.0} == {"box"}
    assert len(scene.page().to_html()) < 1e6
    inside = next(part for part in scene.parts if part.name == "out")
    pictures = [np.asarray(one.still(dpi=60).axes[0].images[0].get_array()) for one in (
        scene, replace(scene, parts=[replace(part, opacity=1.0) for part in scene.parts]),
        replace(scene, parts=[part for part in scene.parts if part is not inside]),
    )]  # fmt: skip
    through, hidden = (np.abs(pictures[k][..., :3] - pictures[2][..., :3]).max(axis=2) > 0.05 for k in (0, 1))
    assert through.sum() > 1000
    assert through.sum() > 2 * hidden.sum()


def test_figure_names_lines_by_the_kinematic_table(train, record):
    """Its strongest lines are named where the table has them, mesh lines go through the spectrum, all have a row."""
    figure = train_spectrum(train, record, "force of mesh")
    upper, lower = figure.axes
    assert upper.get_title(loc="left") == f"{train.name}: force of mesh"
    rows = [text.get_text() for text in lower.get_yticklabels()]
    assert {"shaft in", "shaft out", "mesh mesh", "sidebands of mesh"} <= set(rows)
    named = upper.texts[-1].get_text().splitlines()
    assert 5 <= len(named) <= 10
    gmf = next(text for text in named if text.endswith("  1 x GMF of mesh"))
    assert float(gmf.split()[1]) == pytest.approx(500.0, abs=1.5 / 0.12)
    ticks = lower.collections[rows.index("mesh mesh")].get_segments()
    assert sorted(segment[0, 0] for segment in ticks) == pytest.approx([500.0, 1000.0, 1500.0], rel=1e-3)
    assert train_spectrum(train, record, maximum=600.0).axes[0].get_title(loc="left").endswith(": seat")
    with pytest.raises(DrivetrainError, match=says("record", "mesh_track", "run-up")):
        train_spectrum(train, record.assign(mesh_track=record.mesh_rms))


@pytest.mark.slow
def test_command_line(tmp_path):
    path = tmp_path / "train.toml"
    quick = TEXT.replace('duration = "0.2 s"', 'duration = "0.02 s"\nsettling = 0.0\ntolerance = 1e-6')
    mounts = "\n".join(
        f"[housings.box.mounts.m{k}]\nat = {at}\nstiffness = [1e7, 1e7, 1e7]"
        for k, at in enumerate(([0.1, 0, 0], [0, 0.1, 0.1]))
    )
    path.write_text("run_up = 0.01\nrunning = true\n" + quick.replace("[sensors.seat]", mounts + "\n[sensors.seat]"))
    result = CliRunner().invoke(app, ["run", str(path)])
    assert result.exit_code == 0, result.output
    assert "mesh                     500 Hz" in result.output
    for suffix in (".nc", ".md", ".html", ".png", ".svg"):
        assert path.with_suffix(suffix).exists()


def test_faults_in_files_and_wrong_files(tmp_path):
    path = tmp_path / "train.toml"
    path.write_text(
        TEXT.replace("[bearings.a]", '[[meshes.mesh.faults]]\nkind = "broken tooth"\nlost = 0.5\n[bearings.a]')
    )
    found = load_train(path)
    assert found.train.pairs["mesh"].faults[0].severity == 0.5
    path.write_text(path.read_text().replace("lost = 0.5", "lost = 1.5"))
    result = CliRunner().invoke(app, ["run", str(path)])
    assert result.exit_code == 1
    assert "lost is 1.5" in result.output
    path.write_text(TEXT.replace("teeth = 60", "teeth = 61.5"))
    result = CliRunner().invoke(app, ["run", str(path)])
    assert result.exit_code == 1
    assert "wheels.gear" in result.output


@pytest.mark.parametrize(("settings", "words"), [
    ({"rate": 2500.0}, says("run.rate", "2500 Hz", "3", "'mesh'", "1500 Hz")),
    ({"duration": 0.005}, says("run.duration", "0.005 s", "'mesh'", "500")),
])  # fmt: skip
def test_records_that_cannot_be_are_refused(settings, words):
    with pytest.raises(DrivetrainError, match=words):
        check_record(stage(), RunSettings(**settings))


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.slow
def test_trains_side_by_side_have_the_records_of_each_alone(integrator):
    """In the order of their names, with the progress of each; a failure of one stops the others."""
    run = RunSettings(duration=0.02, settling=0.0, tolerance=1e-6, integrator=integrator)
    torques = {"a": 80.0, "b": 90.0, "c": 90.0}
    loads = {name: [TorqueLoad(name="brake", shaft="out", torque=torque)] for name, torque in torques.items()}
    runs = {name: (stage(loads=load, running=True), run) for name, load in loads.items()}
    told = {}
    records = run_trains(runs, workers=2, progress=lambda name, fraction: told.update({name: fraction}))
    assert list(records) == list(runs)
    assert told == dict.fromkeys(runs, 1.0)
    assert records["b"]["mesh_rms"].equals(run_train(*runs["b"])["mesh_rms"])
    assert records["c"]["mesh_rms"].equals(records["b"]["mesh_rms"])
    assert not records["a"]["mesh_rms"].equals(records["b"]["mesh_rms"])
    with pytest.raises(DrivetrainError, match=r"run\.duration is 0\.005 s"):
        run_trains({**runs, "short": (stage(), RunSettings(duration=0.005))}, progress=False)


def driven(drive, **settings):
    """Return the record of the stage, 84 N m on its wheel and so 28 N m on its pinion, turned by a drive."""
    train = stage(drives=[drive], loads=[TorqueLoad(name="brake", shaft="out", torque="84 N m")], running=True)
    return train, run_train(train, RunSettings(**{"duration": 0.1, "settling": 0.0, "tolerance": 1e-6, **settings}))


@pytest.mark.parametrize(("drive", "largest"), [
    (InductionMotor(name="m", shaft="in", speed="1450 rpm", power="75 W"), "1.2348"),
    (TorqueDrive(name="m", shaft="in", speed="1450 rpm", torque="20 N m"), "20"),
])  # fmt: skip
def test_a_drive_that_cannot_carry_its_load_has_no_mesh_lines(drive, largest):
    """It is warned of with both torques; the record has no levels at a frequency that no tooth had, and says so."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        train, record = driven(drive)
    words = [str(one.message) for one in said]
    assert any(f"drive 'm': the largest torque is {largest} N m, but the loads need 28 N m on" in w for w in words)
    both = f"turns at {float(record.speed.sel(shaft='in').mean()) * 30 / np.pi:.5g} rpm in the mean, nominal are 1450"
    assert any(both in w and "no levels" in w for w in words)
    assert both in record.attrs["remarks"]
    assert np.isnan(record.mesh_rms).all()
    assert both in train_report(train, record)
    with pytest.raises(DrivetrainError, match="lines move"):
        train_spectrum(train, record, "force of mesh")
    signal = train_signal(record, "force of mesh")
    assert "known_lines" not in signal.attrs
    assert signal.attrs.get("speed") is None


def test_a_motor_with_slip_has_its_lines_at_its_own_speed():
    """A lightly loaded motor is 3 % faster than rated: its levels and lines are there, which the record says."""
    motor = InductionMotor(name="m", shaft="in", speed="1400 rpm", power="60 kW")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".*counted twice")
        train, record = driven(motor, settling=0.05)
    rpm = float(record.speed.sel(shaft="in").mean()) * 30 / np.pi
    assert 1.03 < rpm / 1400.0 < 1500.0 / 1400.0
    levels = record.mesh_rms.sel(mesh="mesh")
    assert float(levels.mesh_frequency) == pytest.approx(20 * rpm / 60, rel=1e-3)
    assert np.isfinite(levels).all()
    force = record.normal_force.sel(mesh="mesh").values
    weight = np.hanning(force.size)
    turned = np.exp(-2j * np.pi * float(levels.mesh_frequency) * record.time.values)
    line = np.sqrt(2.0) * np.abs(weight @ ((force - force.mean()) * turned)) / weight.sum()
    assert float(levels.sel(signal="force of mesh", harmonic=1)) == pytest.approx(line, rel=0.02)
    assert "levels are at the mesh frequency of the mean speed" in record.attrs["remarks"]
    assert "(nominal 466.667 Hz)" in train_report(train, record)
    assert json.loads(train_signal(record, "force of mesh").attrs["known_lines"])["1 x GMF of mesh"] == pytest.approx(
        float(levels.mesh_frequency), rel=1e-3
    )


@pytest.mark.slow
def test_signals_of_a_run_up_have_its_speed_over_time(tmp_path, train, record):
    """Their orders are those of the record's own tracks; from a file it is the same. A steady record has one speed."""
    drive = SpeedDrive(name="motor", shaft="in", speed="1500 rpm", curve=[["20 ms", "500 rpm"], ["0.3 s", "1500 rpm"]])
    up = stage(drives=[drive], sensors=[SpeedSensor(name="speed", shaft="out")], running=True)
    found = run_train(up, RunSettings(settling=0.02, duration=0.28, tolerance=5e-6))
    signal = train_signal(found, "force of mesh")
    assert "speed" not in signal.attrs
    assert "known_lines" not in signal.attrs
    np.testing.assert_array_equal(signal["speed"], found.speed.sel(shaft="in"))
    report = analyse(signal)
    assert np.array(report.speed_range) * 30 / np.pi == pytest.approx([500.0, 1500.0], rel=1e-3)
    track = found.mesh_track.sel(signal="force of mesh", mesh="mesh", harmonic=1).values
    # windows of a revolution, of the track of some mesh cycles
    level = np.sqrt(np.mean(order_track(signal, orders=[20], scaling="rms", revolutions=1.0).values ** 2))
    assert level == pytest.approx(np.sqrt(np.nanmean(track**2)), rel=0.15)
    sensed = to_signal(save(found, tmp_path / "up.nc"))
    assert "speed" not in sensed.attrs
    np.testing.assert_array_equal(sensed["speed"], signal["speed"])
    assert to_signal(tmp_path / "up.nc", speed="900 rpm").attrs["speed"] == pytest.approx(30.0 * np.pi)
    for steady in (train_signal(record, "seat"), to_signal(save(record, tmp_path / "steady.nc"), channels=["seat"])):
        assert steady.attrs["speed"] == pytest.approx(train.speeds["in"], rel=1e-4)
        assert "speed" not in steady.coords
        assert "known_lines" in steady.attrs


def test_a_shaft_that_turns_back_has_no_speed_for_its_lines(train, record):
    """One that only swings at rest has, with zero there."""
    turning = record["speed"].copy()
    swings, back = turning.copy(), turning.copy()
    swings.loc[{"shaft": "in"}] = -np.linspace(-0.1, 100.0, turning.sizes["time"])
    back.loc[{"shaft": "in"}] = np.linspace(-50.0, 100.0, turning.sizes["time"])
    moving = record.assign_attrs(speed_is_steady=0)
    speed = train_signal(moving.assign(speed=swings), "seat")["speed"]
    assert (float(speed[0]), float(speed[-1])) == (0.0, 100.0)
    signal = train_signal(moving.assign(speed=back), "seat")
    assert "speed" not in signal.coords
    assert "speed" not in signal.attrs


def test_levels_follow_the_angle_where_the_speed_drifts():
    """A change of 1 % over 500 mesh cycles smears a third harmonic; by angle it has its level."""
    t = np.arange(12800) / 12800.0
    cycles = 500.0 * (t + 0.01 * (0.5 * t**2 - 0.5 * t))
    signal = np.stack([np.cos(2.0 * np.pi * h * cycles) for h in (1, 3)], axis=1)
    orders = np.arange(1, 4)
    assert HeldSpeed("in", 1.0, 1.0, 0.01).smears(1500.0)
    assert not HeldSpeed("in", 1.0, 1.0, 1e-4).smears(1500.0)
    plain = np.abs(harmonic_amplitudes(signal, 12800.0, 500.0, orders))
    followed = np.abs(harmonic_amplitudes(*by_angle(signal, cycles), orders))
    assert plain[2, 1] < 0.6
    np.testing.assert_allclose(followed, [[1, 0], [0, 0], [0, 1]], atol=0.02)


@pytest.mark.slow
def test_a_light_wheel_that_swings_back_in_a_run_up_has_levels_by_the_angle_of_the_drive():
    """The lay shaft falls back by more than a tenth of a mesh cycle near a resonance; a mesh of few cycles says so."""
    wheel = partial(GearSpec, module="3 mm", face_width="25 mm", bore_radius="15 mm")
    pairs = {"in": {"z1": ("60 mm", wheel(19))}, "out": {"z4": ("150 mm", wheel(68))},
             "lay": {"z2": ("60 mm", wheel(61)), "z3": ("150 mm", wheel(17))}}  # fmt: skip
    springs, curve = {"stiffness": (2e8, 2e8, 1e8), "damping_time": 2e-5}, [["20 ms", "300 rpm"], ["1.5 s", "1800 rpm"]]
    two = Drivetrain(
        "two",
        shafts=[Shaft(name=name, wheels=wheels) for name, wheels in pairs.items()],
        meshes=[GearMesh(name="one", driver="z1", driven="z2"), GearMesh(name="two", driver="z3", driven="z4")],
        bearings=[
            ElasticBearing(name=f"{name} {z}", shaft=name, station=z, **springs) for name in pairs for z in (0.01, 0.19)
        ],
        drives=[SpeedDrive(name="motor", shaft="in", speed="1800 rpm", curve=curve)],
        loads=[TorqueLoad(name="brake", shaft="out", torque="100 N m")],
        running=True,
    )
    found = run_train(two, RunSettings(settling=0.02, duration=0.9))
    assert found.attrs["remarks"] == "none"
    forces = found.mesh_track.sel(signal="force of two", mesh="two")
    assert np.isfinite(forces.values).mean() > 0.5
    with pytest.warns(UserWarning, match=says("mesh 'two'", "16", "run.duration")):
        short = run_train(two, RunSettings(settling=0.02, duration=0.3))
    assert "mesh 'two'" in short.attrs["remarks"]
