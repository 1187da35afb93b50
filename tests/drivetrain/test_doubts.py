"""Descriptions that a model can have, and nobody means: sizes that do not fit, plain numbers in other units."""

import copy
import re
import warnings

import pytest

from gearmbs.drivetrain import DrivetrainError
from gearmbs.drivetrain.description import make_description
from gearmbs.drivetrain.static.doubts import warn_of_doubts
from tests.says import says

HELICAL = {"module": "3 mm", "helix_angle": "15 deg", "face_width": "25 mm"}
BOX = {
    "shafts": {
        "in": {
            "length": "240 mm",
            "diameter": "30 mm",
            "bearings": {"a": ["26 mm", "6206"], "b": ["214 mm", "6206"]},
            "wheels": {"z1": {"station": "80 mm", "teeth": 21, "bore_radius": "15 mm", **HELICAL}},
        },
        "out": {
            "length": "240 mm",
            "diameter": "40 mm",
            "bearings": {"c": ["26 mm", "6208"], "d": ["214 mm", "6208"]},
            "wheels": {"z2": {"station": "80 mm", "teeth": 52, "bore_radius": "20 mm", "hand": "left", **HELICAL}},
        },
    },
    "meshes": {"stage": {"driver": "z1", "driven": "z2"}},
    "housings": {
        "case": {
            "mass": "40 kg",
            "inertia": [1.0, 1.0, 1.0],
            "mounts": {
                name: {"at": at, "stiffness": [5e7, 5e7, 5e7]}
                for name, at in (("one", [0, 0, 0]), ("two", [0.3, 0, 0]), ("three", [0, 0, 0.2]))
            },
        }
    },
    "drives": {"motor": {"shaft": "in", "speed": "1500 rpm"}},
    "loads": {"brake": {"shaft": "out", "torque": "300 N m"}},
}


def doubts(changes):
    """Return what is warned of a box with some values changed, by their places."""
    data = copy.deepcopy(BOX)
    for place, value in changes.items():
        *way, last = place.split("/")
        table = data
        for key in way:
            table = table[key]
        if value is None:
            del table[last]
        else:
            table[last] = value
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        train = make_description(data, "box.toml").train
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        warn_of_doubts(train)
    return [str(one.message) for one in found]


def test_a_sound_box_has_none():
    assert doubts({}) == []


Z1, Z2 = "shafts/in/wheels/z1", "shafts/out/wheels/z2"


@pytest.mark.parametrize(("changes", "words"), [
    ({"shafts/in/diameter": "15 mm"}, says("'a'", "30 mm", "a radius")),
    ({"shafts/out/diameter": None, "shafts/out/radius": "40 mm"}, says("'c'", "80 mm", "a radius")),
    ({"shafts/in/bearings/a": ["26 mm", "6208"]}, says("'a'", "40 mm", "diameter")),
    ({"shafts/in/bearings/a": ["26 mm", "6204"]}, says("'a'", "20 mm", "diameter")),
    ({f"{Z2}/bore_radius": "40 mm"}, says("'z2'", "bore_radius 40 mm", "a radius")),
    ({f"{Z2}/bore_radius": "10 mm"}, says("'z2'", "bore_radius 10 mm", "a radius")),
    ({f"{Z1}/station": "2 mm", f"{Z1}/face_width": "60 mm"}, says("'z1'", "end of shaft", "station")),
    ({f"{Z1}/face_width": "250 mm"}, says("'stage'", "250", "unit")),
    ({f"{Z1}/face_width": "2.5 mm", f"{Z2}/face_width": "2.5 mm"}, says("'z1'", "2.5 mm", "unit")),
    ({"meshes/stage/backlash": "2 mm"}, says("'stage'", "backlash", "module")),
    ({"shafts/in/bearings/a": ["80 mm", "6206"]}, says("'a'", "'z1'", "overlap")),
    ({"shafts/in/bearings/a": ["80 mm", "6210"]}, says("'a'", "'z2'", "overlap")),
    ({"shafts/out/bearings/c": ["26 mm", "6320"]}, says("'a'", "'c'", "overlap")),
    ({"housings/case/mounts/one/stiffness": [50.0, 5e7, 5e7]}, says("one", "50 N/m", "unit")),
    ({f"housings/case/mounts/{k}/stiffness": [50.0] * 3 for k in ("one", "two", "three")},
     says("'case'", "Hz", "N/mm")),
    ({"meshes/stage/direction": 90}, says("'stage'", "direction", "'90 deg'")),
    ({f"{Z1}/angle": 45}, says("'z1'", "angle", "'45 deg'")),
    ({"drives/motor/speed": "1500 Hz"}, says("'a'", "90000 rpm", "rad/s")),
    ({"gravity": [0, -9810, 0]}, says("gravity", "9810", "mm/s")),
])  # fmt: skip
def test_what_is_hardly_meant_is_warned_of(changes, words):
    found = doubts(changes)
    assert any(re.search(words, one) for one in found), found


def test_shafts_that_do_not_say_how_thick_they_are_are_not_doubted():
    assert doubts({"shafts/in/diameter": None}) == []
    assert doubts({"shafts/in/diameter": "15 mm", "shafts/in/mass": "2 kg"}) == []


def test_a_shaft_that_is_in_the_way_is_told_by_its_bearings():
    with pytest.raises(DrivetrainError, match=says("'z2'", "runs through", "a radius")):
        doubts({"shafts/in/diameter": "60 mm"})
