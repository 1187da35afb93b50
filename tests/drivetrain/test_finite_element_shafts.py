"""Shafts of finite elements in trains, beside shafts by sections and wherever their model is put."""

import math

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    GearMesh,
    IdealBearing,
    PlanetaryStage,
    RollingContactBearing,
    RunSettings,
    Shaft,
    SpeedDrive,
    TorqueLoad,
    Wheel,
)
from gearmbs.flexible import mnf_of, solid_model, write_mnf
from gearmbs.flexible.solid import revolved_mesh
from gearmbs.gears import planetary
from gearmbs.studies import mode_table, named_modes, run_train, train_modes, train_scene
from tests.says import says

AROUND = 16
LENGTH, BORE, OUTER = 0.24, 0.010, 0.040


def hollow(divisions=12):
    """Return a hollow cylinder, its prism of the areas of its circles."""
    grown = math.sqrt(2.0 * math.pi / (AROUND * math.sin(2.0 * math.pi / AROUND)))
    radii = 0.5 * grown * np.array([BORE, OUTER])
    return solid_model(revolved_mesh(radii, np.linspace(0.0, LENGTH, divisions + 1), AROUND))


SECTIONS = [{"length": LENGTH, "diameter": OUTER, "bore": BORE}]
TOLD = ("c", "d", "z2", "brake")
NARROW = {name: ("60 mm", "1 mm") for name in TOLD}
"""One layer of nodes, as a shaft by sections has it."""


def train(lay, **wheel):
    z1 = gm.GearSpec(21, "3 mm", helix_angle="15 deg", face_width="25 mm", bore_radius="15 mm")
    z2 = gm.GearSpec(52, "3 mm", helix_angle="15 deg", face_width="25 mm", hand="left", bore_radius="20 mm")
    one = Shaft(
        name="in",
        length="240 mm",
        diameter="30 mm",
        modes=4,
        wheels={"z1": ("80 mm", z1)},
        bearings={"a": ("20 mm", "6206"), "b": ("220 mm", "6206")},
    )
    seats = (("c", "20 mm"), ("d", "220 mm"))
    return Drivetrain(
        "box",
        shafts=[one, lay],
        wheels=[Wheel(name="z2", shaft="lay", station="80 mm", gear=z2, **wheel)],
        bearings=[RollingContactBearing(name=n, shaft="lay", station=s, rolling="6208") for n, s in seats],
        meshes=[GearMesh(name="stage", driver="z1", driven="z2")],
        drives=[SpeedDrive(name="motor", shaft="in", speed="1500 rpm")],
        loads=[TorqueLoad(name="brake", shaft="lay", torque="300 N m")],
        running=True,
    )


@pytest.fixture(scope="module")
def solid():
    return train(Shaft(name="lay", model=hollow(), modes=12, seats=NARROW))


@pytest.fixture(scope="module")
def cut():
    return train(Shaft(name="lay", sections=SECTIONS, modes=12))


def frequencies(one, count=10):
    modes = train_modes(one)
    return np.sort(modes.frequencies[modes.oscillating])[:count]


def test_it_has_the_frequencies_of_a_shaft_by_sections(solid, cut):
    """Sixteen elements round about, of which bending is 0.2 % too soft in the second bend, and seats of one layer."""
    np.testing.assert_allclose(frequencies(solid, 6), frequencies(cut, 6), rtol=2e-3)
    assert solid.part("lay").length == pytest.approx(LENGTH)
    mine, sections = (one.part("lay").body() for one in (solid, cut))
    np.testing.assert_allclose(mine, sections, rtol=5e-4)
    np.testing.assert_allclose(solid.torsional().inertias, cut.torsional().inertias, rtol=1e-4)


def test_it_rests_as_a_shaft_by_sections(solid, cut):
    one, other = solid.at_rest, cut.at_rest
    assert one.trouble == ""
    assert one.forces["stage"] == pytest.approx(other.forces["stage"], rel=1e-4)
    for name in ("c", "d"):
        np.testing.assert_allclose(one.bearings[name], other.bearings[name], atol=2.0)
    assert one.openings["stage"] == pytest.approx(other.openings["stage"], rel=0.03)
    # a load on one layer of nodes deforms it, within a diameter, as no section of a beam does
    area = 0.25 * math.pi * (OUTER**2 - BORE**2)
    local = one.forces["stage"] * OUTER / (2.1e11 * area)
    assert one.apart["stage"] == pytest.approx(other.apart["stage"], abs=local)
    assert solid.power.on_driven("stage") == pytest.approx(300.0)


def test_it_gives_way_as_a_beam_between_its_bearings(solid, cut):
    """Under a lateral load at the wheel, by Timoshenko with Cowper's share of shear (J. Appl. Mech. 33, 1966)."""
    modulus, poisson, hollow_by = 2.1e11, 0.3, (BORE / OUTER) ** 2
    area, second = 0.25 * math.pi * (OUTER**2 - BORE**2), math.pi / 64.0 * (OUTER**4 - BORE**4)
    whole = 6.0 * (1.0 + poisson) * (1.0 + hollow_by) ** 2
    share = whole / ((7.0 + 6.0 * poisson) * (1.0 + hollow_by) ** 2 + (20.0 + 12.0 * poisson) * hollow_by)
    a, b = 0.06, 0.14
    bending = a**2 * b**2 / (3.0 * modulus * second * (a + b))
    shearing = a * b / (a + b) / (share * modulus / (2.0 * (1.0 + poisson)) * area)
    found = []
    for one in (solid, cut):
        body = one.modal_models["lay"]
        at = {name: seat.moved[:, 0] for key, seat in body.seats.items() for name in key.split(", ")}
        bent = at["z2"] - b / (a + b) * at["c"] - a / (a + b) * at["d"]
        found.append(float(np.sum((bent / (2.0 * np.pi * body.frequencies)) ** 2)))
    assert found[1] == pytest.approx(bending + shearing, rel=1e-6)
    # what one layer of nodes does within a diameter
    assert found[0] == pytest.approx(bending + shearing, abs=OUTER / (modulus * area))


@pytest.mark.slow
def test_wider_seats_are_stiffer(solid):
    """A wheel and bearings carry as wide as they are: what they do to a section is spread."""
    found = frequencies(train(Shaft(name="lay", model=hollow(), modes=12)), 8)
    narrow = frequencies(solid, 8)
    assert np.all(found > narrow * (1.0 - 1e-4))
    assert found[7] > 1.005 * narrow[7]


@pytest.mark.slow
@pytest.mark.parametrize("reduced", [False, True])
def test_it_is_the_same_wherever_its_model_is_put(solid, reduced):
    """Along x of its own frame, off its origin; as a body with modes, too."""
    axes = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    off = np.array([0.1, 0.2, 0.3])
    model = solid.modal_models["lay"] if reduced else hollow()
    given = {} if reduced else {"modes": 12, "seats": NARROW}
    moved = train(Shaft(name="lay", model=model.placed(axes, off), axes=axes.T, at=tuple(-axes.T @ off), **given))
    np.testing.assert_allclose(frequencies(moved), frequencies(solid), rtol=1e-8)


def test_modes_are_named_and_it_runs(solid):
    table = mode_table(named_modes(solid))
    assert any("bending of shaft 'lay'" in name for name in table["name"])
    record = run_train(solid, RunSettings(settling="10 ms", duration="20 ms", tolerance=1e-6))
    at_rest = solid.at_rest.forces["stage"]
    assert float(record.normal_force.mean("time")[0]) == pytest.approx(at_rest, rel=0.05)
    assert {"lay", "z2"} <= {part.name for part in train_scene(solid).parts}


FILE = """
[shafts.in]
length = "240 mm"
bearings.a = ["30 mm", "6206"]
bearings.b = ["210 mm", "6206"]
[shafts.lay]
model = { program = "mnf", files = "lay.mnf" }
bearings.c = ["30 mm", "6208"]
bearings.d = ["210 mm", "6208"]
[wheels.z1]
shaft = "in"
station = "80 mm"
teeth = 21
module = "3 mm"
bore_radius = "15 mm"
[wheels.z2]
shaft = "lay"
station = "80 mm"
teeth = 52
module = "3 mm"
bore_radius = "20 mm"
[meshes.stage]
driver = "z1"
driven = "z2"
[drives.motor]
shaft = "in"
speed = "1500 rpm"
[loads.brake]
shaft = "lay"
torque = "300 N m"
"""


def test_a_file_says_the_same(tmp_path, solid):
    write_mnf(tmp_path / "lay.mnf", mnf_of(solid.modal_models["lay"]))
    (tmp_path / "box.toml").write_text(FILE)
    one = Drivetrain.from_file(tmp_path / "box.toml")
    assert one.part("lay").length == pytest.approx(LENGTH)
    assert one.modal_models["lay"].modes == solid.modal_models["lay"].modes
    gm.save(one, tmp_path / "again.toml")
    again = Drivetrain.from_file(tmp_path / "again.toml")
    np.testing.assert_allclose(again.modal_models["lay"].frequencies, one.modal_models["lay"].frequencies)
    with pytest.raises(DrivetrainError, match=says("'lay'", "model", "memory")):
        gm.save(solid, tmp_path / "no.toml")


def twist(body, one, other):
    """Return by how much two seats of a body turn against each other under a torque of 1 N m between them, rad."""
    apart = (body.seats[one].turned - body.seats[other].turned)[:, 2]
    return float(np.sum((apart / (2.0 * np.pi * body.frequencies)) ** 2))


@pytest.mark.slow
def test_a_sun_on_it_has_its_mass():
    """As a body of its own that turns with the shaft: at speed, too."""
    gears = planetary((24, 30, 84), "3 mm", 3, face_width="20 mm")

    def stage(**sun):
        return Drivetrain(
            "stage",
            shafts=[Shaft(name="sun", **sun), Shaft(name="carrier", length="100 mm", diameter="40 mm")],
            bearings=[IdealBearing(name=f"{name} {k}", shaft=name, station=z)
                      for name, far in (("sun", "220 mm"), ("carrier", "80 mm"))
                      for k, z in ((1, "20 mm"), (2, far))],
            drives=[SpeedDrive(name="motor", shaft="sun", speed="600 rpm")],
            loads=[TorqueLoad(name="brake", shaft="carrier", torque="40 N m")],
            planetary_stages=[PlanetaryStage(name="set", gears=gears, sun="sun", carrier="carrier", ring="ground",
                                             sun_station="120 mm", carrier_station="50 mm")],
        )  # fmt: skip

    names = [*(f"sun {k}" for k in (1, 2)), "set sun", "motor"]
    narrow = {name: ("60 mm", "1 mm") for name in names}
    one, soft = (stage(model=hollow(), modes=10, seats=narrow, faces=faces) for faces in ("rigid", "average"))
    other = stage(sections=SECTIONS, modes=10)
    assert {body.name for body in one.build().bodies.values()} - set(other.build().bodies) == {"set sun"}
    masses = [sum(body.mass for body in model.build().bodies.values()) for model in (one, other)]
    assert masses[0] == pytest.approx(masses[1], rel=1e-6)
    # sections of a round shaft turn as rigid ones (Saint-Venant): sixteen corners twist by 1.4e-4 less
    twists = [twist(model.modal_models["sun"], "motor", "set sun") for model in (one, soft, other)]
    assert twists[0] == pytest.approx(twists[2], rel=2e-4)
    first, softened, exact = (frequencies(model, 1)[0] for model in (one, soft, other))
    assert first == pytest.approx(exact, rel=1e-4)
    # on average one layer twists in itself, too; between motor and wheel the teeth have little of the first frequency
    assert 0.8 < (1.0 - softened / exact) / (1.0 - math.sqrt(twists[2] / twists[1])) < 1.0
    np.testing.assert_allclose(frequencies(soft, 4)[1:], frequencies(other, 4)[1:], rtol=1e-3)
    turning = train_modes(one, speed="600 rpm")
    assert len(turning.frequencies) > 10


@pytest.mark.parametrize(("fields", "words"), [
    ({"diameter": "40 mm"}, says("'lay'", "diameter", "model")),
    ({"length": "30 mm"}, says("'lay'", "length", "model")),
    ({"axes": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}, says("centre of mass", "axes", "mm")),
    ({"at": (0, 0, "10 mm")}, says("10", "250", "at")),
    ({"axes": [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}, says("axes", "rotation matrix")),
    ({"faces": "soft"}, says("faces", "soft", "average")),
    ({"density": "7000 kg/m^3"}, says("'lay'", "density", "model")),
    ({"elements": 40}, says("'lay'", "elements", "model")),
    ({"damping": -0.1}, says("'lay'", "damping", "0 or more")),
])  # fmt: skip
def test_shafts_that_are_none_are_refused(fields, words):
    with pytest.raises(DrivetrainError, match=words):
        Shaft(name="lay", model=hollow(4), **fields)


def test_parts_without_nodes_are_refused():
    with pytest.raises(DrivetrainError, match=says("'c'", "nodes", "seats")):
        _ = train(Shaft(name="lay", model=hollow(2))).modal_models
    with pytest.raises(DrivetrainError, match=says("'z3'", "'lay'", "brake, c, d, z2")):
        _ = train(Shaft(name="lay", model=hollow(2), seats={"z3": ("60 mm", "1 mm")})).modal_models
    with pytest.raises(DrivetrainError, match=says("'lay'", "without model")):
        Shaft(name="lay", at=(0, 0, 0))
