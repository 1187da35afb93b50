"""Quasi-static tables of a mesh: against the searches they come from, and as other programs read them."""

import csv
import re
import warnings

import numpy as np
import pytest
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.gears import GearPair, GearSpec, kinematic_transmission_error, loaded_transmission_error, mesh_tables
from gearmbs.gears.faults import PitchError
from gearmbs.gears.transmission import StaticMesh
from gearmbs.studies.export import described_pairs
from tests.says import says


def pair(internal=False, **changes):
    one = GearSpec(teeth=24, module="3 mm", face_width="20 mm", name="one")
    two = GearSpec(teeth=-80 if internal else 36, module="3 mm", face_width="20 mm", name="two")
    return GearPair(one, two, **{"backlash": "60 um", "torque": "200 N m", **changes}).with_own_stiffness("iso")


def between(table, load):
    """The deflection at which linear interpolation of the table carries a load on the flanks at work."""
    at_work = table.deflection >= 0.0
    return np.array([np.interp(load, row[at_work], table.deflection[at_work]) for row in table.force])


@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("internal", [False, True])
@pytest.mark.slow
def test_the_table_of_forces_is_the_inverse_of_the_transmission_error(internal, rotation):
    """Under a torque that is not among those of the table the deflection is that of the search."""
    geared = pair(internal, rotation=rotation)
    table = mesh_tables(geared, ["100 N m", "300 N m"], points=20)
    exact = loaded_transmission_error(geared, "170 N m", 20)
    found = between(table, 170.0 / table.base_radii[1])
    # linear pieces of a curve that is all but straight: a part in some thousands
    np.testing.assert_allclose(found, exact.error, rtol=2e-3)
    # of a hundredth of the largest torque, too
    small = loaded_transmission_error(geared, "3 N m", 20)
    np.testing.assert_allclose(between(table, 3.0 / table.base_radii[1]), small.error, rtol=2e-3)
    assert np.array_equal(table.error[0], loaded_transmission_error(geared, "100 N m", 20).error)
    # nothing touches within the backlash, and the other flanks push back behind it
    inside = (table.deflection < 0.0) & (table.deflection > -geared.geometry.normal_backlash)
    assert inside.any()
    assert not table.force[:, inside].any()
    assert np.all(table.force[:, 0] < 0.0)
    # the mirror image of the flanks at work: the same curve of stiffness in the mean over a mesh
    np.testing.assert_allclose(-table.force[:, 0].mean(), table.force[:, -1].mean(), rtol=0.02)


@pytest.mark.slow
def test_faults_are_in_tables_of_a_whole_turn():
    """A tooth out of place carries first when it comes, and the next ones as before."""
    sound = pair()
    broken = sound.with_changes(faults=(PitchError(wheel="driver", amount="-10 um", tooth=3),))
    table = mesh_tables(broken, ["100 N m"], points=6, lags=9, cycles=24)
    assert table.phase.size == 24 * 6
    apart = table.error[0] - np.tile(mesh_tables(sound, ["100 N m"], points=6, lags=9).error[0], 24)
    off = np.abs(apart) > 1e-9
    # it meshes for as many pitches as the contact ratio says, loaded somewhat longer
    assert off.sum() / 6 == pytest.approx(sound.contact_ratio, abs=0.6)
    assert apart[off].max() <= 10e-6 * (1.0 + 1e-9)


@pytest.mark.parametrize("amount", ["-10 um", "10 um", "40 um"])
@pytest.mark.slow
def test_teeth_out_of_place_touch_within_the_backlash(amount):
    """A tooth that stands forward, or back on the other flanks, carries where sound ones have room: as the kernel says,
    at lags that are none of the table. A sound pair has nothing there."""
    sound = pair()
    broken = sound.with_changes(faults=(PitchError(wheel="driver", amount=amount, tooth=3),))
    table = mesh_tables(broken, ["100 N m", "300 N m"], points=4, cycles=24)
    mesh = StaticMesh(broken, None)
    radius, gap = table.base_radii[1], sound.geometry.normal_backlash
    lags = np.linspace(-gap, 0.0, 14)[1:-1]
    exact = np.empty((table.phase.size, lags.size))
    for row, phase in zip(exact, table.phase, strict=True):
        angle = phase * mesh.rotation * 2 * np.pi / table.teeth[0]
        ideal = mesh.ideal_angle(angle)
        row[:] = [-mesh.turning * mesh.torque(angle, ideal + mesh.turning * lag / radius)[0] / radius for lag in lags]
    assert np.abs(exact).max() > 0.01 * table.force.max()
    found = np.array([np.interp(lags, table.deflection, row) for row in table.force])
    np.testing.assert_allclose(found, exact, rtol=0, atol=5e-3 * table.force.max())
    # where the search finds the tooth carry the whole load, ahead of the ratio
    error = loaded_transmission_error(broken, "170 N m", 4, cycles=24).error
    carried = [np.interp(170.0 / radius, row, table.deflection) for row in table.force]
    np.testing.assert_allclose(carried, error, rtol=0.02, atol=1e-8)
    free = (sound_table := mesh_tables(sound, ["300 N m"], points=4)).deflection
    assert not sound_table.force[:, (free > -gap) & (free < 0.0)].any()


def read_modelica(text, name):
    rows = re.search(rf"{name}\[:, :\] =\s*\[(.*?)\]", text, re.S)[1].split(";")
    return np.array([[float(value) for value in row.split(",")] for row in rows])


def test_files_hold_the_tables(tmp_path):
    table = mesh_tables(pair(), ["100 N m", "200 N m"], points=12)
    error, force = table.to_csv(tmp_path, "stage")
    rows = list(csv.reader(error.open()))
    assert len(rows) == 1 + 2 * 12
    numbers = np.array(rows[1:], dtype=float)
    np.testing.assert_allclose(numbers[:, 3].reshape(2, 12), table.error, rtol=1e-8)
    np.testing.assert_allclose(numbers[:12, 2], np.arange(12) / 12 * 2 * np.pi / 24, rtol=1e-8)
    rows = list(csv.reader(force.open()))
    np.testing.assert_allclose(np.array(rows[1:], dtype=float)[:, 1:], table.force, rtol=1e-8)
    np.testing.assert_allclose(np.array(rows[0][1:], dtype=float), table.deflection, rtol=1e-8)

    text = table.to_modelica(tmp_path, "Stage").read_text()
    found = read_modelica(text, "forceTable")
    np.testing.assert_allclose(found[1:-1, 1:], table.force, rtol=1e-8)
    # a table over a whole cycle ends as it begins
    assert found[-1, 0] == 1.0
    np.testing.assert_allclose(found[-1, 1:], found[1, 1:])
    np.testing.assert_allclose(read_modelica(text, "errorTable")[1:-1, 1:], table.error.T, rtol=1e-8)
    assert text.count("{") == text.count("}") > 0
    assert text.rstrip().endswith("end Stage;")
    assert [p.name for p in sorted(tmp_path.iterdir())] == [
        "Stage.mo",
        "stage_force.csv",
        "stage_transmission_error.csv",
    ]


@pytest.mark.slow
def test_the_component_does_the_work_of_its_potential():
    """The force over the deflection is that of a stored energy, which is none without contact and that of before again
    after a mesh."""
    table = mesh_tables(pair(), ["200 N m"], points=40)
    phase = np.append(table.phase, 1.0)
    force = np.vstack([table.force, table.force[:1]])
    # at a held phase the force is a function of the deflection alone; the work over it is the stored energy
    energy = np.zeros_like(force)
    energy[:, 1:] = np.cumsum(0.5 * (force[:, 1:] + force[:, :-1]) * np.diff(table.deflection), axis=1)
    free = np.argmin(np.abs(table.deflection))
    energy -= energy[:, free : free + 1]
    assert np.all(energy > -1e-12)
    # the torque on the driver beyond r_b1 F is what the teeth that come into mesh store: zero over a mesh cycle
    rate = np.diff(energy[:, -1]) / np.diff(phase)
    assert abs(np.sum(rate * np.diff(phase))) < 1e-9 * energy[:, -1].max()


@pytest.mark.parametrize(("given", "words"), [
    ({"torques": []}, says("torques", "none", "increasing")),
    ({"torques": ["100 N m", "50 N m"]}, says("torques", "50 N m", "increasing")),
    ({"torques": [-5.0]}, says("torque", "-5.0", "positive")),
    ({"lags": 3}, says("lags", "3", "give")),
    ({"points": 0}, says("points", "0", "give")),
])  # fmt: skip
def test_what_makes_no_tables(given, words):
    with pytest.raises(ValueError, match=words):
        mesh_tables(pair(), **{"torques": ["100 N m"], "points": 4, **given})


def test_names_are_those_of_programs(tmp_path):
    table = mesh_tables(pair(), ["100 N m"], points=4)
    for write in (table.to_csv, table.to_modelica):
        with pytest.raises(ValueError, match=says("name", "1 stage", "letter")):
            write(tmp_path, "1 stage")
    assert not list(tmp_path.iterdir())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert table.to_modelica(tmp_path, "stage_1").exists()


@pytest.mark.slow
def test_from_the_command_line(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(
        '[gears]\nteeth = [21, 34]\nmodule = "2.5 mm"\nface_width = "20 mm"\n[operation]\ntorque = "60 N m"\n'
    )
    result = CliRunner().invoke(app, ["export", str(case), "--target", "modelica", "--torques", "30 N m, 60 N m"])
    assert result.exit_code == 0, result.output
    text = (tmp_path / "case" / "case.mo").read_text()
    assert read_modelica(text, "stiffnessTable")[0, 1:].tolist() == [30.0, 60.0]
    result = CliRunner().invoke(app, ["export", str(case), "--target", "csv"])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "case" / "case_force.csv").exists()
    result = CliRunner().invoke(app, ["export", str(case), "--torques", "30 N m"])
    assert result.exit_code != 0
    assert re.search(says("--torques", "csv", "modelica"), " ".join(result.output.split()))


@pytest.mark.slow
def test_planetary_sets_have_tables_of_both_meshes(tmp_path):
    file = tmp_path / "set.toml"
    file.write_text(
        '[planetary]\nteeth = [28, 36, 100]\nmodule = "2 mm"\nplanets = 4\n[operation]\nspeeds = { sun = 50.0 }\n'
    )
    result = CliRunner().invoke(app, ["export", str(file), "--target", "csv"])
    assert result.exit_code != 0
    assert re.search(says("set.toml", "--torques", "driven"), " ".join(result.output.split()))
    result = CliRunner().invoke(app, ["export", str(file), "--target", "modelica", "--torques", "20 N m"])
    assert result.exit_code == 0, result.output
    texts = {which: (tmp_path / "set" / f"set_{which}.mo").read_text() for which in ("sun", "ring")}
    assert "z[2] = {28, 36}" in texts["sun"]
    assert "sign = -1" in texts["ring"]


def two_stages(first, second):
    shafts = "".join(f'[shafts.{shaft}]\nlength = "200 mm"\ndiameter = "30 mm"\n' for shaft in "abc")
    wheels = "".join(
        f'[wheels.z{k}]\nshaft = "{shaft}"\nstation = "{60 + 60 * (k // 2)} mm"\nteeth = {teeth}\nmodule = "3 mm"\n'
        f'bore_radius = "15 mm"\n'
        for k, (shaft, teeth) in enumerate([("a", 21), ("b", 52), ("b", 19), ("c", 47)])
    )
    meshes = "".join(
        f'[meshes."{name}"]\ndriver = "z{k}"\ndriven = "z{k + 1}"\nbacklash = "0.1 mm"\n'
        for k, name in ((0, first), (2, second))
    )
    bearings = "".join(f'[bearings.b{shaft}]\nkind = "ideal"\nshaft = "{shaft}"\n' for shaft in "abc")
    ends = '[drives.m]\nkind = "speed"\nshaft = "a"\nspeed = "1000 rpm"\n[loads.l]\nkind = "torque"\nshaft = "c"\n'
    return f'name = "two"\n{shafts}{wheels}{meshes}{bearings}{ends}torque = "200 N m"\n'


def test_tables_are_of_all_meshes(tmp_path):
    """Names of files have no other characters than letters, digits and underscores: two must not become one."""
    file = tmp_path / "train.toml"
    file.write_text(two_stages("stage-1", "stage 2"))
    assert {name: pair.wheels[0].teeth for name, pair in described_pairs(file).items()} == {
        "stage_1": 21,
        "stage_2": 19,
    }
    file.write_text(two_stages("stage-1", "stage 1"))
    with pytest.raises(ValueError, match=says("stage-1", "stage 1", "rename")):
        described_pairs(file)


def test_without_load_the_table_begins_at_contact():
    geared = pair()
    table = mesh_tables(geared, ["100 N m"], points=10)
    touching = kinematic_transmission_error(geared, points=10).error
    for row, first in zip(table.force, touching, strict=True):
        assert not row[(table.deflection >= 0.0) & (table.deflection < first - 1e-9)].any()
        assert np.all(row[table.deflection > first + 1e-9] > 0.0)
