"""Wheels whose axes are carried around are known by what they stand on, however little it turns."""

import warnings

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.gears import GearSpec, IdealMesh, PairGeometry
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.mechanism.solve.carriers import carrier_of
from tests.says import says

PAIR = gm.GearPair(GearSpec(21, "3 mm", face_width="40 mm"), GearSpec(39, "3 mm", face_width="40 mm"))
APART = PairGeometry(PAIR.driver, PAIR.driven).nominal_centre_distance
TURN = 2e-3
"""What the arm has turned by, rad: times the sum of the base radii it is 0.17 mm."""
Z = (0.0, 0.0, 1.0)
STIFF = {"stiffness": (1e9, 1e9, 1e9), "damping": (1e4, 1e4, 1e4)}


def solid(m, name, x=0.0, spin=0.0):
    return m.body(
        name,
        1.0,
        (1e-3, 1e-3, 1e-3),
        position=(x, 0, 0),
        velocity=(0, x * TURN / 0.1, 0),
        angular_velocity=(0, 0, spin),
    )


def on_springs(m, name, i, j, x, turning=0.0):
    here, there = (body.marker_at((x, 0, 0), np.eye(3), name=f"{name}.{end}") for body, end in ((i, "I"), (j, "J")))
    m.bushing(name, here, there, **STIFF, torsional_stiffness=(1e6, 1e6, turning))


def wheels(seat="joint", pin="joint", carrier=None):
    """A wheel that rolls on one that stands, on an arm that turns about the first one's axis by 2 mrad in 0.1 s."""
    m = Mechanism("set")
    rate = TURN / 0.1
    sun, arm = solid(m, "sun"), solid(m, "arm", spin=rate)
    planet = solid(m, "planet", APART, rate * (1.0 + 21 / 39))
    m.fixed("sun seat", sun, m.ground)
    base = m.ground
    if seat == "on a frame":
        base = solid(m, "frame")
        for k in range(3):
            on_springs(m, f"mount {k}", base, m.ground, 0.1 * k)
    if seat == "springs":
        on_springs(m, "arm seat", arm, m.ground, 0.0)
    elif seat != "none":
        m.revolute("arm seat", arm, base, axis=Z)
    on = arm
    if pin == "second arm":
        on = solid(m, "second arm", APART, rate)
        m.fixed("clamp", on, arm)
    if pin == "loose pin":
        on = solid(m, "pin body", APART, rate)
        m.cylindrical("bore", on, arm, axis=Z)
    if pin == "springs":
        on_springs(m, "pin", planet, arm, APART)
    else:
        m.revolute("pin", planet, on, axis=Z)
    if carrier is not None:
        carrier = {"carrier": m.bodies.get(carrier, m.ground)}
    m.gear_contact("mesh", sun, planet, IdealMesh(PAIR, stiffness="4e8 N/m", damping="4e3 N s/m"), **(carrier or {}))
    m.output("error", ("transmission_error", "mesh"))
    return m


def errors(m):
    """What a simulator, its solution and a plant at its state tell."""
    sim = gm.Simulator(m, 0.2, tol=1e-8)
    sim.advance(0.1)
    with warnings.catch_warnings():
        # what turns is looked at as it stands
        warnings.simplefilter("ignore")
        plant = m.linearize([], ["error"], at=sim.state())
    assert sim.solution().transmission_error("mesh")[-1] == sim.get("transmission_error", "mesh")
    return [sim.get("output", "error"), sim.solution().output("error")[-1], plant.point.outputs[0]]


@pytest.mark.parametrize(
    ("seat", "pin"),
    [
        ("joint", "joint"),
        ("joint", "springs"),
        ("joint", "second arm"),
        ("joint", "loose pin"),
        ("springs", "joint"),
        ("on a frame", "joint"),
        ("none", "joint"),
    ],
)
def test_a_wheel_on_an_arm_is_refused_and_counts_from_it_where_it_is_named(seat, pin):
    """By what it stands on, before anything turns; wheels that roll on each other err by nothing."""
    m = wheels(seat, pin)
    remedy = says("'mesh'", "'planet'", "arm'", "carrier=")
    start = m.simulate(1e-6)
    for asked in (
        lambda: start.output("error"),
        lambda: m.linearize([], ["error"]),
        lambda: gm.Simulator(m, 0.1).get("output", "error"),
    ):
        with pytest.raises(ModelError, match=remedy):
            asked()
    m.carriers["mesh"] = "arm"
    np.testing.assert_allclose(errors(m), 0.0, atol=1e-7)


def test_turns_from_the_ground_are_told_where_it_is_named():
    lever = PAIR.driver.base_radius + PAIR.driven.base_radius
    np.testing.assert_allclose(errors(wheels(carrier="ground")), lever * TURN, rtol=1e-3)
    assert wheels(carrier="arm").carriers == {"mesh": "arm"}


def pair(stand):
    """Two wheels that turn about their own axes, on what does not carry them about another one."""
    m = Mechanism("pair")
    one, two = solid(m, "one", spin=3.9), solid(m, "two", APART, -2.1)
    bodies = stand(m, one, two) or (one, two)
    m.gear_contact("mesh", *bodies, IdealMesh(PAIR, stiffness="4e8 N/m", damping="4e3 N s/m"))
    m.output("error", ("transmission_error", "mesh"))
    return m


def in_a_housing(m, one, two):
    """On four mounts."""
    housing = solid(m, "housing")
    for k, wheel in enumerate((one, two)):
        m.revolute(f"seat {k}", wheel, housing, axis=Z)
    for k in range(4):
        on_springs(m, f"mount {k}", housing, m.ground, 0.05 * k)


def on_shafts(m, one, two):
    """Loose on a shaft in bearings, and fixed to one that another goes on with behind a universal joint."""
    axle, shaft, beyond = solid(m, "axle"), solid(m, "shaft", APART), solid(m, "beyond", APART)
    m.revolute("bore", one, axle, axis=Z)
    m.fixed("key", two, shaft)
    for body, x in ((axle, 0.0), (shaft, APART)):
        m.spherical(f"{body.name} near", body, m.ground, at=(x, 0, 0))
        m.joint("inline", f"{body.name} far", body, m.ground, at=(x, 0, 0.1), axis=Z)
    m.universal("cross", shaft, beyond, at=(APART, 0, 0.2), axis=(1, 0, 0), axis_j=(0, 1, 0))
    m.spherical("end", beyond, m.ground, at=(APART, 0.1, 0.4))


def on_springs_alone(m, one, two):
    for wheel, x in ((one, 0.0), (two, APART)):
        on_springs(m, f"{wheel.name} bearing", wheel, m.ground, x)


def on_a_slide(m, one, two):
    slide = solid(m, "slide", APART)
    m.revolute("seat", one, m.ground, axis=Z)
    m.translational("rail", slide, m.ground, axis=(1, 0, 0))
    m.revolute("pin", two, slide, axis=Z)


def off_centre(m, one, two):
    """By a tenth of a millimetre."""
    m.revolute("seat", one, m.ground, at=(1e-4, 0, 0), axis=Z)
    m.revolute("pin", two, m.ground, axis=Z)


def hung(m, one, two):
    """In a box on six springs, three at each of two corners."""
    box = solid(m, "box")
    for k, wheel in enumerate((one, two)):
        m.revolute(f"seat {k}", wheel, box, axis=Z)
    for k, x in enumerate((-0.1, 0.2)):
        for c in range(3):
            far = np.array([x, 0.0, 0.0]) + 0.3 * np.eye(3)[c]
            m.spring_damper(f"spring {k} {c}", box.marker((x, 0, 0), name=f"corner {k} {c}"),
                            m.ground.marker(far, name=f"wall {k} {c}"), stiffness=1e6)  # fmt: skip


@pytest.mark.parametrize("stand", [in_a_housing, hung, on_shafts, on_springs_alone, on_a_slide, off_centre])
def test_wheels_whose_axes_stay_count_from_the_ground(stand):
    m = pair(stand)
    assert carrier_of(m, m.elements["mesh"]) is m.ground
    assert m.simulate(1e-6).output("error")[0] == 0.0


def crank(m, one, two):
    """The second wheel on the connecting rod of a crank."""
    turning, rod = solid(m, "crank", 0.0), solid(m, "rod", APART)
    m.revolute("seat", one, m.ground, axis=Z)
    m.revolute("main", turning, m.ground, at=(0, 0.1, 0), axis=Z)
    m.revolute("big end", rod, turning, at=(0, 0.15, 0), axis=Z)
    rocker = solid(m, "rocker", 0.3)
    m.revolute("small end", rod, rocker, at=(0.3, 0.15, 0), axis=Z)
    m.revolute("foot", rocker, m.ground, at=(0.3, 0, 0), axis=Z)
    m.revolute("pin", two, rod, axis=Z)


def off_the_axis(m, one, two):
    """A wheel that is fixed to what turns about another line than its own axis."""
    m.revolute("seat", one, m.ground, axis=Z)
    m.revolute("arm", two, m.ground, at=(0, 0, 0), axis=Z)


@pytest.mark.parametrize(("stand", "carrier"), [(crank, "crank"), (off_the_axis, "two")])
def test_wheels_on_what_swings_are_refused(stand, carrier):
    m = pair(stand)
    with pytest.raises(ModelError, match=says("'mesh'", "'two'", f"'{carrier}'", "carrier=")):
        m.linearize([], ["error"])
    m.carriers["mesh"] = carrier
    assert carrier_of(m, m.elements["mesh"]) is m.bodies[carrier]


def test_a_force_that_pushes_holds_nothing():
    """An arm on a bushing that is free about its axis is found with a force at its tip, too."""
    m = wheels("springs")
    tip = m.bodies["arm"].marker((0.05, 0.0, 0.0), name="tip")
    m.load("push", tip, m.ground.marker((0.05, 0.0, 0.0), name="there"), fx="5*TIME")
    with pytest.raises(ModelError, match=says("'mesh'", "'planet'", "'arm'")):
        carrier_of(m, m.elements["mesh"])
