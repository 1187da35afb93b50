"""Drivetrains from TOML files: the same as in Python, and what is refused."""

import pytest

from gearmbs.drivetrain import Drivetrain, DrivetrainError, Shaft, SpeedDrive, read_description
from gearmbs.gears import GearSpec
from tests.drivetrain.support import stage
from tests.says import says

TEXT = """
name = "one stage"

[shafts.in]
length = "100 mm"
[shafts.out]
length = "100 mm"

[wheels.pinion]
shaft = "in"
teeth = 20
module = "3 mm"
[wheels.gear]
shaft = "out"
teeth = 60
module = "3 mm"

[meshes.mesh]
driver = "pinion"
driven = "gear"
backlash = "0.1 mm"

[bearings.a]
shaft = "in"
[bearings.b]
kind = "elastic"
shaft = "out"
stiffness = [1e8, "100 kN/mm", 1e8]
tilting = [1e5, 1e5]

[drives.motor]
shaft = "in"
speed = "1500 rpm"

[loads.brake]
shaft = "out"
torque = "300 N m"

[housings.box]
mass = "50 kg"
inertia = [1, 1, 1]
[housings.box.mounts.left]
at = ["-100 mm", 0, 0]
stiffness = [1e7, 1e7, 1e7]
[housings.box.modes.panel]
mass = 4
stiffness = 4e7
shape = { b = [0, 0, 1] }

[sensors.seat]
kind = "accelerometer"
bearing = "b"

[run]
duration = "0.2 s"
"""


def written(tmp_path, text):
    path = tmp_path / "train.toml"
    path.write_text(text)
    return path


def test_file_says_the_same_as_python(tmp_path):
    found = read_description(written(tmp_path, TEXT))
    train, same = found.train, stage()
    assert train.shafts == same.shafts
    assert train.wheels == same.wheels
    assert train.meshes == same.meshes
    assert train.drives == same.drives
    assert train.loads == same.loads
    assert train.housings[0].mounts[0].at == (-0.1, 0.0, 0.0)
    assert found.run.duration == 0.2
    assert found.run.output_rate(train) == 12800.0
    assert train.part("b").matrices[0][1, 1] == 1e8
    assert Drivetrain.from_file(written(tmp_path, TEXT)).name == "one stage"


@pytest.mark.parametrize(("old", "new", "words"), [
    ('shaft = "in"\nteeth', 'shft = "in"\nteeth', says("wheels.pinion", "'shft'", "'shaft'")),
    ("teeth = 20\n", "", "wheels.pinion: teeth is missing"),
    ('kind = "elastic"', 'kind = "soft"', says("bearings.b", "kind 'soft'", "elastic", "choose")),
    ('"1500 rpm"', '"1500 mm"', "drive 'motor': speed"),
    ('speed = "1500 rpm"', "", "drives.motor: 'speed' is missing"),
    ("[loads.brake]", "[load.brake]", says("'load'", "'loads'")),
    ("backlash =", "faults = [1]\nbacklash =", "faults cannot be read here"),
    ("teeth = 20", "teeth = 2", "wheels.pinion: .*teeth is 2"),
    ('duration = "0.2 s"', "duration = -1", "run.duration is -1 s"),
    ("mass = 4\n", "mass = -4\n", "mode 'box panel': mass is -4"),
    ("[run]", "[run", "not a valid TOML file"),
])  # fmt: skip
def test_mistakes_are_named_in_one_line(tmp_path, old, new, words):
    assert old in TEXT
    with pytest.raises(DrivetrainError, match=words) as caught:
        read_description(written(tmp_path, TEXT.replace(old, new, 1)))
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there():
    with pytest.raises(DrivetrainError, match=r"nowhere\.toml: cannot be read"):
        read_description("nowhere.toml")


def test_rolling_bearings_have_their_defects_in_the_file(tmp_path):
    from gearmbs.bearings import Spall

    rolling = """
kind = "rolling"
rolling = { designation = "6206", clearance = "10 um" }
settings = { cage_slip = 0.004, defects = [{ kind = "spall", part = "outer", width = "1 mm" }] }
shaft = "out"
"""
    path = tmp_path / "train.toml"
    path.write_text(TEXT.replace("[drives.motor]", f"[bearings.c]{rolling}[drives.motor]"))
    element = Drivetrain.from_file(path).build().elements["c"]
    assert element.defects == (Spall(part="outer", width=1e-3),)
    assert element.settings.cage_slip == 0.004
    assert element.bearing.clearance == pytest.approx(1e-5)
    path.write_text(path.read_text().replace('"spall"', '"hole"'))
    with pytest.raises(DrivetrainError, match=r"bearing 'c': settings: .*kind 'hole' is unknown"):
        Drivetrain.from_file(path)


STEPS = [{"length": "120 mm", "diameter": "30 mm"}, {"length": "80 mm", "diameter": "35 mm", "bore": "10 mm"}]


def test_stepped_shafts_carry_their_own_parts_and_change():
    """In Python as in files: copies of a shaft with sections know their length, which is no second statement of it."""
    shaft = Shaft(name="s", sections=STEPS, wheels={"z": ("60 mm", GearSpec(20, "2 mm"))},
                  bearings={"a": ("10 mm", "6206"), "b": ("190 mm", "6206")})  # fmt: skip
    train = Drivetrain("t", shafts=[shaft], drives=[SpeedDrive(name="m", shaft="s", speed="100 rpm")])
    assert {"z", "a", "b"} <= set(train.parts)
    kept = train.changed("s", modes=4).part("s", Shaft)
    assert (kept.length, kept.pieces) == (pytest.approx(0.2), shaft.pieces)
    longer = train.changed("s", sections=[*STEPS, {"length": "40 mm", "diameter": "20 mm"}]).part("s", Shaft)
    assert longer.length == pytest.approx(0.24)
    plain = train.changed("s", length="210 mm", diameter="40 mm").part("s", Shaft)
    assert (plain.length, plain.sections, plain.pieces[0].outer) == (pytest.approx(0.21), None, pytest.approx(0.04))
    assert train.changed("s", radius="15 mm").changed("s", diameter="40 mm").part("s", Shaft).radius is None
    with pytest.raises(DrivetrainError, match=says("0.3", "0.2", "length or sections")):
        Shaft(name="s", length="300 mm", sections=STEPS)


def test_values_that_are_set_from_outside_are_tables(tmp_path):
    """Torque and speed of the file as inputs: those of Python, which a mechanism has by name."""
    path = tmp_path / "stage.toml"
    given = TEXT.replace('torque = "300 N m"', 'torque = { input = "brake torque", unit = "N m", value = 300.0 }')
    given = given.replace('speed = "1500 rpm"', 'speed = "1500 rpm"\nreference = { input = "speed", unit = "rad/s" }')
    path.write_text(given)
    m = read_description(path).train.build()
    assert m.inputs["brake torque"].start == 300.0
    assert (m.inputs["speed"].unit, m.inputs["speed"].start) == ("rad/s", 0.0)
    for old, new, words in (
        ('unit = "N m", ', "", ("torque", "unit", "missing")),
        ('unit = "N m"', 'unit = "N"', ("brake torque", "in N", "torque")),
        ("value = 300.0", "start = 300.0", ("loads.brake.torque", "start", "value")),
    ):
        path.write_text(given.replace(old, new))
        with pytest.raises(DrivetrainError, match=says(*words)):
            read_description(path).train.build()
