"""Power that splits: shares of branches, and how the wheels of a closed chain are turned."""

import numpy as np
import pytest

from gearmbs.drivetrain import Drivetrain, DrivetrainError, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad
from gearmbs.gears import GearSpec
from tests.says import says

FACE = 0.025


def wheel(teeth):
    return GearSpec(teeth, "3 mm", face_width=FACE, bore_radius="10 mm")


def split(teeth=(20, 40, 20, 40), torque=400.0, backlash=0.0, **angles):
    """Two lay shafts, on either side of an input and an output shaft on one axis; rigid, each on an ideal bearing."""
    a, b, c, d = teeth
    stated = {"length": "200 mm", "diameter": "20 mm"}
    shafts = [
        Shaft(name="i", wheels={"a": ("50 mm", wheel(a))}, **stated),
        *(
            Shaft(name=f"l{k}", wheels={f"b{k}": ("50 mm", wheel(b)), f"c{k}": ("150 mm", wheel(c))}, **stated)
            for k in (1, 2)
        ),
        Shaft(name="o", wheels={"d": ("150 mm", wheel(d))}, **stated),
    ]
    ties = (("m1", "a", "b1", "90 deg"), ("m2", "a", "b2", "-90 deg"),
            ("m3", "c1", "d", "-90 deg"), ("m4", "c2", "d", "90 deg"))  # fmt: skip
    train = Drivetrain(
        "split",
        shafts=shafts,
        meshes=[GearMesh(name=name, driver=one, driven=two, direction=way, settings={"backlash": backlash})
                for name, one, two, way in ties],
        bearings=[IdealBearing(name=f"q {shaft.name}", shaft=shaft.name) for shaft in shafts],
        drives=[SpeedDrive(name="motor", shaft="i", speed=100.0)],
        loads=[TorqueLoad(name="brake", shaft="o", torque=torque)],
        running=True,
    )  # fmt: skip
    for name, angle in angles.items():
        train = train.changed(name, angle=angle)
    return train


def on_driven(flow):
    return np.array([flow.torques[f"m{k}"][1] for k in (1, 2, 3, 4)])


def test_equal_teeth_share_equally_and_a_chain_without_branches_shares_nothing():
    flow = split().nominal_power
    assert flow.shared == ("m1", "m2", "m3", "m4")
    assert flow.shared_by == "equal teeth"
    np.testing.assert_allclose(on_driven(flow), [-100.0, -100.0, 200.0, 200.0], rtol=1e-12)
    assert flow.drive["motor"] == pytest.approx(100.0, rel=1e-12)
    one_branch = Drivetrain(
        "single",
        shafts=[shaft for shaft in split().shafts if shaft.name != "l2"],
        wheels=[one for one in split().wheels if one.shaft != "l2"],
        meshes=[mesh for mesh in split().meshes if mesh.name in ("m1", "m3")],
        bearings=[bearing for bearing in split().bearings if bearing.shaft != "l2"],
        drives=split().drives,
        loads=split().loads,
    )
    assert one_branch.power.shared == ()
    assert one_branch.power.torques["m1"][1] == -200.0


def test_stiffer_branches_carry_more():
    """Castigliano: of branches of compliance s_1 and s_2 to their output torques, T_1 / T_2 = s_2 / s_1."""
    plain = split()
    train = plain
    for one in plain.wheels:
        if one.name not in ("b2", "c2"):
            wide = GearSpec(one.gear.teeth, "3 mm", face_width=3.0 * FACE, bore_radius="10 mm")
            train = train.changed(one.name, gear=wide)
    torques = on_driven(train.nominal_power)
    # faces that carry: 75 and 75 mm of the first branch, 25 and 25 mm of the second
    assert torques[2] / torques[3] == pytest.approx(3.0, rel=1e-9)
    assert torques[2] + torques[3] == pytest.approx(400.0, rel=1e-12)


def test_the_last_wheel_on_a_compound_shaft_is_turned():
    """With 21/40/20/41 teeth c2 has to be turned by a twentieth of its pitch or more, however small the backlash."""
    for teeth in ((20, 40, 20, 40), (21, 40, 20, 41)):
        train = split(teeth)
        layout = train.layout
        assert [name for name, angle in layout.wheels.items() if abs(angle) > 1e-12] == (
            [] if teeth[0] == 20 else ["c2"]
        )
        pair, turned = train.pairs["m4"], train.layout.directions["m4"]
        driver = layout.angles["l2"] + layout.wheels["c2"] - turned
        driven = layout.angles["o"] + layout.wheels["d"] - turned
        pitch = 2.0 * np.pi / teeth[3]
        off = (pair.driven_angle(driver) - driven) / pitch
        assert off - np.round(off) == pytest.approx(0.0, abs=1e-9)


def test_a_wheel_is_found_that_can_be_turned_where_the_last_mesh_has_none():
    """Listed so that the chain closes between an idler and the output, it closes at the compound shaft instead."""
    train = split((21, 40, 20, 41))
    later = Drivetrain(
        "reordered",
        shafts=train.shafts, wheels=train.wheels, bearings=train.bearings, drives=train.drives, loads=train.loads,
        meshes=[train.meshes[k] for k in (0, 2, 3, 1)],
    )  # fmt: skip
    assert abs(later.layout.wheels["b2"]) > 0.01
    # all that could be turned has its angle
    fixed = split((21, 40, 20, 41), b1=0.0, b2=0.0, c1=0.0, c2=0.0)
    with pytest.raises(DrivetrainError, match=says("'m4'", "leave out", "wheel 'c2'")):
        _ = fixed.layout
    assert split((20, 40, 20, 40), b1=0.0, b2=0.0, c1=0.0, c2=0.0).layout.wheels["c2"] == 0.0


def idlers(teeth):
    """Two idlers side by side between an input and an output wheel: nothing in the chain can be turned."""
    a, b, c, d = teeth
    names = {"a": a, "b": b, "c": c, "d": d}
    radius = {name: 1.5e-3 * z for name, z in names.items()}
    # a triangle of the three centre distances, and its mirror image
    one, two = radius["a"] + radius["b"], radius["b"] + radius["d"]
    apart = 0.9 * (one + two)
    cosine = (one**2 + apart**2 - two**2) / (2.0 * one * apart)
    up = float(np.degrees(np.arccos(cosine)))
    on = float(np.degrees(np.arccos((two**2 + apart**2 - one**2) / (2.0 * two * apart))))
    ways = (("m1", "a", "b", up), ("m2", "a", "c", -up), ("m3", "b", "d", -on), ("m4", "c", "d", on))
    shafts = [Shaft(name=name, length="60 mm", diameter="20 mm", wheels={f"z{name}": ("30 mm", wheel(z))})
              for name, z in names.items()]  # fmt: skip
    return Drivetrain(
        "idlers",
        shafts=shafts,
        meshes=[GearMesh(name=name, driver=f"z{one}", driven=f"z{two}", direction=f"{way!r} deg")
                for name, one, two, way in ways],
        bearings=[IdealBearing(name=f"q {name}", shaft=name) for name in names],
        drives=[SpeedDrive(name="motor", shaft="a", speed=100.0)],
        loads=[TorqueLoad(name="brake", shaft="d", torque=100.0)],
    )  # fmt: skip


def test_teeth_that_cannot_fit_are_refused_with_the_backlash_they_would_need():
    train = idlers((40, 21, 21, 43))
    with pytest.raises(DrivetrainError, match=says("'m4'", "overlap", "turned", "backlash")):
        _ = train.layout
    # the same with the backlash that is named
    needed = 1.001 * float(str(_refusal(train)).split("backlash of ")[1].split(" mm")[0])
    loose = train.with_parts(*(train.changed(m.name, settings={"backlash": f"{needed} mm"}).parts[m.name]
                               for m in train.meshes))  # fmt: skip
    assert set(loose.layout.angles) == {"a", "b", "c", "d"}


def _refusal(train):
    try:
        return train.layout
    except DrivetrainError as error:
        return error


@pytest.mark.slow
def test_shares_are_those_of_positions_of_rest():
    """Equal branches share equally to rounding; unequal teeth in the mean of the mesh cycle, as stiffnesses do."""
    flow = split(backlash="0.1 mm").power
    assert flow.shared_by == "rest"
    np.testing.assert_allclose(on_driven(flow), [-100.0, -100.0, 200.0, 200.0], rtol=1e-9)
    other = split((21, 40, 20, 41), backlash="0.1 mm")
    flow = other.power
    np.testing.assert_allclose(on_driven(flow)[:2], -400.0 * 20 / 41 / 2.0, rtol=2e-3)
    np.testing.assert_allclose(on_driven(flow)[2:].sum(), 400.0, rtol=1e-12)
    # at the start itself one pair of teeth carries in one branch, and two in the other
    assert other.at_rest.torques["m4"] / other.at_rest.torques["m3"] == pytest.approx(2.0, rel=1e-6)
    springs = other.mesh_springs
    base = other.pairs["m3"].geometry.driven.base_radius
    assert springs["m3"].preload == pytest.approx(flow.torques["m3"][1] / base, rel=1e-12)


@pytest.mark.slow
def test_a_branch_that_is_turned_back_by_an_angle_carries_less():
    """A gap g before one of two branches of compliance s takes g / s of its force from it and gives it to the other.

    Of pairs of stiffness k: s = (1/n_3 + (r_c / r_b)^2 / n_1) / k, seen along the line of action of the output wheel,
    with one pair at the last mesh and two at the first at the start, where r_b = 2 r_c; in the mean n is the contact
    ratio. (Compliances of a mean are not the mean of compliances: 3 % are left.)
    """
    plain = split(backlash="0.1 mm")
    gap = 2e-6
    base = plain.pairs["m4"].geometry.driver.base_radius
    # the driver c2 turns negatively: turned back is positive
    sense = -np.sign(plain.speeds["l2"])
    shifted = split(backlash="0.1 mm", c2=float(plain.layout.wheels["c2"] + sense * gap / base))
    pair = plain.pairs["m4"]
    arm, k = pair.geometry.driven.base_radius, pair.contact_model.law.stiffness
    rest = shifted.at_rest.torques
    assert rest["m3"] - rest["m4"] == pytest.approx(arm * gap * k / (1.0 + 0.25 / 2.0), rel=1e-6)
    torques = on_driven(shifted.power)
    assert torques[2] + torques[3] == pytest.approx(400.0, rel=1e-12)
    mean = arm * gap * k * pair.geometry.contact_ratio / 1.25
    assert torques[2] - torques[3] == pytest.approx(mean, rel=0.04)
    # the arm of a corner in contact is not r_b: 6e-5 of the torque
    far = split(backlash="0.1 mm", c2=float(plain.layout.wheels["c2"] + sense * 50e-6 / base))
    np.testing.assert_allclose(on_driven(far.power), [-200.0, 0.0, 400.0, 0.0], atol=0.05)


def test_without_load_a_law_with_an_exponent_has_no_stiffness():
    """F = K d^1.5: k = 1.5 K^(2/3) F^(1/3), which goes to 0 with F, and is not K in another unit."""
    contact = {"kind": "impact", "stiffness": 1e11, "exponent": 1.5, "damping": 0.0}
    one = Drivetrain(
        "pair",
        shafts=[Shaft(name="i", length="60 mm", wheels={"a": ("30 mm", wheel(20))}),
                Shaft(name="o", length="60 mm", wheels={"b": ("30 mm", wheel(40))})],
        meshes=[GearMesh(name="m", driver="a", driven="b", settings={"contact": contact})],
        bearings=[IdealBearing(name=f"q {name}", shaft=name) for name in "io"],
        drives=[SpeedDrive(name="motor", shaft="i", speed=100.0)],
        loads=[TorqueLoad(name="brake", shaft="o", torque=8.0)],
    )  # fmt: skip
    light = one.changed("brake", torque=1.0)
    ratio = one.mesh_springs["m"].stiffness / light.mesh_springs["m"].stiffness
    assert ratio == pytest.approx(2.0, rel=1e-12)
    idle = one.changed("brake", torque=0.0)
    with pytest.warns(UserWarning, match=says("'m'", "nothing", "load")):
        chain = idle.torsional()
    assert chain.springs[0].stiffness == 0.0
    assert chain.springs[0].damping == 0.0
    np.testing.assert_array_equal(chain.frequencies(), [0.0])
    # a linear law has its stiffness always
    linear = idle.changed("m", settings={"contact": {"kind": "linear", "stiffness": 3e8, "damping": 0.0}})
    loaded = linear.changed("brake", torque=8.0)
    assert linear.torsional().springs[0].stiffness == loaded.torsional().springs[0].stiffness > 3e8
