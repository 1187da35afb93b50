"""How rolling bearings hold shafts along their axes: senses of pairs, and shafts that nothing holds."""

import warnings

import pytest

from gearmbs.drivetrain import Drivetrain, DrivetrainError, GearMesh, Shaft, SpeedDrive, TorqueLoad
from gearmbs.gears import GearSpec
from tests.says import says


def stage(first, second=("6208", "6208"), **more):
    """Return a helical stage whose shafts stand in bearings at 26 and 214 mm."""

    def at(letter, kinds):
        places = (26, 214, 120)
        return {f"{letter}{k}": {"station": f"{z} mm", **(one if isinstance(one, dict) else {"rolling": one})}
                for k, (one, z) in enumerate(zip(kinds, places), 1)}  # fmt: skip

    wheels = [GearSpec(z, "3 mm", helix_angle="15 deg", face_width="25 mm", hand=hand, bore_radius="15 mm")
              for z, hand in ((21, "right"), (52, "left"))]  # fmt: skip
    shafts = [Shaft(name=name, length="240 mm", diameter="30 mm", bearings=at(name, kinds),
                    wheels={f"z{name}": ("80 mm", wheel)})
              for name, kinds, wheel in zip("io", (first, second), wheels)]  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return Drivetrain("stage", shafts=shafts, meshes=[GearMesh(name="m", driver="zi", driven="zo")],
                          drives=[SpeedDrive(name="d", shaft="i", speed=157.0)],
                          loads=[TorqueLoad(name="l", shaft="o", torque=200.0)], running=True, **more)  # fmt: skip


def sense(kind, value):
    return {"rolling": kind, "sense": value}


def senses_built(train):
    """Return the senses that the elements of the mechanism have."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        elements = train.build().elements
    return [elements[name].settings.sense for name in ("i1", "i2")]


@pytest.mark.parametrize("kind", ["30206", "7206B"])
def test_two_one_sided_bearings_of_a_shaft_stand_face_to_face(kind):
    train = stage((kind, kind))
    assert train.senses == {"i1": -1, "i2": 1}
    assert senses_built(train) == [-1, 1]
    # the order in which they are told does not count, their places do
    turned = train.changed("i1", station="220 mm")
    assert turned.senses == {"i1": 1, "i2": -1}


def test_a_given_sense_wins_and_the_other_one_follows():
    assert senses_built(stage(("30206", sense("30206", -1)))) == [1, -1]
    assert senses_built(stage((sense("30206", 1), sense("30206", -1)))) == [1, -1]
    old = {"rolling": "30206", "settings": {"sense": -1}}
    assert senses_built(stage(("30206", old))) == [1, -1]
    with pytest.raises(DrivetrainError, match=says("i2", "sense", "1", "-1", "give")):
        stage(("30206", {**old, "sense": 1}))
    with pytest.raises(DrivetrainError, match=says("i1", "sense", "deep groove", "leave")):
        stage((sense("6206", 1), "6206"))
    assert stage(("6206", "6206")).senses == {}


@pytest.mark.parametrize("kinds", [("NU206", "NU206"), ("NU206", "NJ206"), ("NA4906", "NU206")])
def test_shafts_in_rollers_alone_are_free_along_their_axis(kinds):
    with pytest.raises(DrivetrainError, match=says("shaft", "i", kinds[0], "along", "give")):
        stage(kinds)
    assert stage(("6206", kinds[1])).bearings
    assert stage((kinds[0], {"kind": "elastic", "rolling": kinds[1]})).bearings


def test_shafts_held_one_way_are_refused():
    with pytest.raises(DrivetrainError, match=says("i1", "i2", "higher", "+1", "turn")):
        stage((sense("30206", 1), sense("30206", 1)))
    with pytest.raises(DrivetrainError, match=says("i1", "lower", "-1")):
        stage((sense("7206B", -1), "NU206"))
    assert stage((sense("30206", 1), sense("30206", 1), "6206")).senses == {"i1": 1, "i2": 1}
    assert stage((sense("7206B", -1), "6206")).senses == {"i1": -1}


def test_an_odd_one_needs_its_sense():
    for kinds in (("30206", "6206"), ("30206", "30206", "30206")):
        with pytest.raises(DrivetrainError, match=says("i1", "sense", "missing", "give")):
            stage(kinds)
    assert stage((sense("30206", 1), sense("30206", 1), sense("30206", -1))).senses["i3"] == -1
    # springs hold both ways, and what rolls in them counts for lives alone
    assert stage(({"kind": "elastic", "rolling": "30206"}, "6206")).senses == {}


def test_rows_back_to_back_hold_a_shaft_alone():
    with pytest.raises(DrivetrainError, match=says("shaft", "i", "tilt")):
        stage(("6206",))
    assert stage(("3206 B",)).bearings


@pytest.mark.slow
def test_helical_pair_on_tapered_bearings_carries_its_load():
    from gearmbs.drivetrain.plants import resting
    from gearmbs.mechanism.solve.analyses import static_equilibrium

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        train = resting(stage(("30206", "30206"), ("30208", "30208")))
        rest = static_equilibrium(train.build(), t=2.0 * train.run_up).solution
    normal = rest.diagnostics("m")["normal_force"][-1]
    assert normal == pytest.approx(2730.0, rel=2e-3)
    along = {name: float(rest.load(name)[0][-1][2]) for name in ("i1", "i2", "o1", "o2")}
    # every bearing presses its own way, and a shaft's two balance F_t tan(b)
    assert along["i1"] > 0.0 > along["i2"]
    assert along["o1"] > 0.0 > along["o2"]
    thrust = 200.0 * 21 / 52 / (0.5 * 21 * 3e-3 / 0.9659258) * 0.2679492
    assert abs(along["i1"] + along["i2"]) == pytest.approx(thrust, rel=2e-3)
    assert along["o1"] + along["o2"] == pytest.approx(-along["i1"] - along["i2"], rel=1e-3)
