"""Carriers that deform inside of trains, against matrices that are assembled here."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

import gearmbs as gm
from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    FlexibleCarrier,
    IdealBearing,
    PlanetaryStage,
    RunSettings,
    Shaft,
    SpeedDrive,
    TorqueLoad,
)
from gearmbs.flexible import box_model
from gearmbs.gears import Support, planetary
from gearmbs.studies import mode_table, named_modes, run_train, train_modes, train_scene
from tests.says import says

TEETH, MESHES = (24, 30, 84), (4e8, 5e8)
PIN = 5e8
RADIAL, TANGENTIAL, AXIAL, TILTING = 3e8, 2e8, 1e8, 4e4
SPRINGS = FlexibleCarrier(radial=RADIAL, tangential=TANGENTIAL, axial=AXIAL, tilting=TILTING, damping=0.0)
TINY = 1e-9


def train(carrier_body=SPRINGS, *, torque=1e-6, gears=None, modes=None, **stage):
    """A stage alone, its ring held and its sun driven, the carrier on a light shaft in an ideal bearing."""
    set_of = gears or planetary(TEETH, "1.5 mm", 3, ideal=MESHES)
    shape = {"diameter": "10 mm", "mass": TINY, "inertia": 1e-15} if modes is None else {"diameter": "40 mm"}
    one = Shaft(name="sun", length="10 mm", diameter="10 mm", mass=TINY, inertia=1e-15)
    given = {"pins": Support(radial=PIN), "carrier_body": carrier_body, **stage}
    return Drivetrain(
        "stage",
        shafts=[one, Shaft(name="carrier", length="100 mm", modes=modes, **shape)],
        bearings=[IdealBearing(name=f"{name} seat", shaft=name) for name in ("sun", "carrier")],
        drives=[SpeedDrive(name="motor", shaft="sun", speed="600 rpm")],
        loads=[TorqueLoad(name="brake", shaft="carrier", torque=torque)],
        planetary_stages=[
            PlanetaryStage(name="set", gears=set_of, sun="sun", carrier="carrier", ring="ground",
                           sun_station="5 mm", carrier_station="50 mm", **given)
        ],
    )  # fmt: skip


def with_planets(stage, stiffness, mass, rows):
    """Return stiffness and mass of a carrier with its planets, ring and sun held: those of the planets come behind.

    Parameters
    ----------
    stiffness, mass : ndarray, shape (n, n)
        Of the carrier.
    rows : list of ndarray, shape (6, n)
        Displacement and rotation of each pin.
    """
    gears, (weight, moments) = stage.gears, stage.weights["planet"]
    n, count = len(stiffness), gears.planets
    k, m = np.zeros((n + 3 * count,) * 2), np.zeros((n + 3 * count,) * 2)
    k[:n, :n], m[:n, :n] = stiffness, mass
    radius = float(gears.carrier_radius)
    sun, planet, ring = (wheel.base_radius for wheel in (gears.sun, gears.planet, gears.ring))
    to_sun, to_ring = np.arccos((sun + planet) / radius), np.arccos((ring - planet) / radius)
    for number, (pin, angle) in enumerate(zip(rows, gears.angles)):
        at = n + 3 * number
        own = np.zeros((3, n + 3 * count))
        own[:, at : at + 3] = np.eye(3)
        m += own.T @ np.diag([weight, weight, moments[2]]) @ own
        # planets stay in the planes of their pins
        m[:n, :n] += pin[2:5].T @ np.diag([weight, moments[0], moments[1]]) @ pin[2:5]
        spring = own[:2].copy()
        spring[:, :n] -= pin[:2]
        k += PIN * spring.T @ spring
        out, ahead = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        for size, alpha, side in ((MESHES[0], to_sun, 1.0), (MESHES[1], to_ring, -1.0)):
            line = np.cos(alpha) * ahead + side * np.sin(alpha) * out
            row = line @ own[:2] - side * planet * own[2]
            k += size * np.outer(row, row)
    return k, m


def frequencies(k, m, count=None):
    chosen = None if count is None else (0, count)
    values = scipy.linalg.eigh(k, m, eigvals_only=True, subset_by_index=chosen)
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)


def found(one, least=1.0):
    modes = train_modes(one)
    values = np.sort(modes.frequencies[modes.oscillating])
    return values[values > least]


def by_hand(stage):
    """Return the frequencies of a carrier whose hub only turns, with pins on springs."""
    gears, (weight, moments) = stage.gears, stage.weights["carrier"]
    radius, count = float(gears.carrier_radius), gears.planets
    size = 1 + 6 * count
    k, m = np.zeros((size, size)), np.zeros((size, size))
    pin, turning = 0.05 * weight, 0.05 * weight * (0.1 * radius) ** 2
    m[0, 0] = moments[2] - count * (pin * radius**2 + turning)
    rows = []
    for number, angle in enumerate(gears.angles):
        at = 1 + 6 * number
        own = np.zeros((6, size))
        own[:, at : at + 6] = np.eye(6)
        rows.append(own)
        m[at : at + 6, at : at + 6] = np.diag([pin] * 3 + [turning] * 3)
        off = own.copy()
        off[:3, 0] -= radius * np.array([-np.sin(angle), np.cos(angle), 0.0])
        off[5, 0] -= 1.0
        turn = np.eye(6)
        turn[:2, :2] = [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        k += (turn @ off).T @ np.diag([RADIAL, TANGENTIAL, AXIAL, TILTING, TILTING, TILTING]) @ (turn @ off)
    return frequencies(*with_planets(stage, k, m, rows))


def test_a_carrier_by_the_stiffness_of_its_pins_has_the_frequencies_of_springs():
    one = train()
    expected = by_hand(one.planetary_stages[0])
    mine = found(one)
    np.testing.assert_allclose(mine[:20], expected[expected > 1.0][:20], rtol=1e-6)
    rigid = found(train(None))
    # the slowest is that of all that gives in series, below that of a rigid carrier
    assert mine[0] < 0.9 * rigid[0]


@pytest.mark.slow
def test_stiff_pins_are_a_rigid_carrier():
    stiff = FlexibleCarrier(radial=1e13, tangential=1e13, tilting=1e9, damping=0.0)
    rigid = found(train(None))
    np.testing.assert_allclose(found(train(stiff))[: rigid.size], rigid, rtol=2e-4)


def solid():
    """A block as a carrier: nodes on the pins and about the hub."""
    block = box_model((0.14, 0.14, 0.04), "19 mm", divisions=(3, 3, 1))
    return replace(block, positions=block.positions - [0.07, 0.07, 0.02])


HUB, BORE = (0.06, 0.05), (0.045, 0.05)


def averaged(model, place, sizes):
    """Return the motion of a place as the mean of the nodes in a cylinder about it, by least squares."""
    arm = model.positions - place
    inside = (np.hypot(arm[:, 0], arm[:, 1]) <= 0.51 * sizes[0]) & (np.abs(arm[:, 2]) <= 0.51 * sizes[1])
    chosen = np.flatnonzero(inside[model.dofs[:, 0]] & (model.dofs[:, 1] < 3))
    rigid = np.zeros((chosen.size, 6))
    for row, (node, way) in enumerate(model.dofs[chosen]):
        x, y, z = arm[node]
        turn = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
        rigid[row, way], rigid[row, 3:] = 1.0, turn[way]
    out = np.zeros((6, len(model.dofs)))
    out[:, chosen] = np.linalg.pinv(rigid)
    return out


@pytest.mark.slow
def test_a_carrier_of_finite_elements_has_the_frequencies_of_its_matrices():
    """To 1e-4 with a hundred shapes beside the static ones: with 400 it is 3e-5."""
    model = solid()
    one = train(FlexibleCarrier(model=model, hub=HUB, pin=BORE, modes=100, damping=0.0))
    stage = one.planetary_stages[0]
    radius = float(stage.gears.carrier_radius)
    pins = [averaged(model, radius * np.array([np.cos(a), np.sin(a), 0.0]), BORE) for a in stage.gears.angles]
    k, m = with_planets(stage, model.stiffness.toarray(), model.mass.toarray(), pins)
    hub = np.zeros((5, len(k)))
    # all of the hub but its turning is held by the bearing
    hub[:, : len(model.dofs)] = averaged(model, np.zeros(3), HUB)[:5]
    free = scipy.linalg.null_space(hub)
    expected = frequencies(free.T @ k @ free, free.T @ m @ free, 9)
    mine = found(one)
    np.testing.assert_allclose(mine[:8], expected[expected > 1.0][:8], rtol=1e-4)
    weight, moments = stage.weights["carrier"]
    assert weight == pytest.approx(model.mass_properties().mass)
    chain = dict(zip(one.torsional().names, one.torsional().inertias))
    planets = 3 * stage.weights["planet"][0] * radius**2
    assert chain["carrier"] == pytest.approx(moments[2] + planets, rel=1e-9)


@pytest.mark.slow
def test_a_carrier_with_modes_is_that_of_its_elements_wherever_it_is_put():
    """As a body with modes, turned and shifted in its own frame; on a shaft that bends, too."""
    model = solid()
    plain = FlexibleCarrier(model=model, hub=HUB, pin=BORE, modes=30)
    turn = np.deg2rad(-90.0)
    spun = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1.0]])
    blocks = np.kron(np.eye(len(model.positions)), spun)
    order = np.lexsort((model.dofs[:, 1], model.dofs[:, 0]))
    assert np.array_equal(order, np.arange(len(model.dofs)))
    moved = replace(
        model,
        positions=model.positions @ spun.T - [0.0, 0.0, 0.004],
        stiffness=blocks @ model.stiffness @ blocks.T,
        mass=blocks @ model.mass @ blocks.T,
    )
    other = FlexibleCarrier(model=moved, hub=HUB, pin=BORE, modes=30, at="4 mm", turned="90 deg")
    for modes in (None, 4):
        np.testing.assert_allclose(
            found(train(other, modes=modes))[:10], found(train(plain, modes=modes))[:10], rtol=1e-5
        )


@pytest.mark.slow
def test_modes_are_called_by_the_carrier_and_shown():
    soft = FlexibleCarrier(radial=2e7, tangential=2e7)
    one = train(soft)
    table = mode_table(named_modes(one))
    assert "carrier 'set carrier'" in set(table["name"])
    assert table["carrier"].iloc[0] > 0.5
    shown = train(soft, gears=planetary(TEETH, "1.5 mm", 3))
    assert "set carrier" in [part.name for part in train_scene(shown).parts]


def test_pins_that_give_way_share_the_load():
    """A pin that is off by e carries less by 2 e / (3 s), and the others more by half of it, s what a branch gives.

    Along the circle: half of what a mesh gives by both, of the pin's bearing, and of the pin.
    """
    error, radius = 1e-6, 40.5e-3
    gears = planetary(TEETH, "1.5 mm", 3, ideal=MESHES, pin_errors={0: (0.0, error)})
    inverse = 1.0 / np.cos(np.deg2rad(20.0)) ** 2
    meshes = 0.25 * inverse * sum(1.0 / k for k in MESHES)
    for body, pin in ((SPRINGS, 1.0 / TANGENTIAL), (None, 0.0)):
        one = train(body, torque="40 N m", gears=gears)
        rest = one.at_rest
        assert rest.trouble == ""
        forces = np.array([rest.forces[f"set sun-planet {k}"] for k in (1, 2, 3)])
        # of both meshes of a planet along the circle
        along = 2.0 * forces * np.cos(np.deg2rad(20.0))
        assert along.sum() == pytest.approx(40.0 / radius, rel=1e-6)
        gives = meshes + 1.0 / PIN + pin
        expected = along.mean() + error / (3.0 * gives) * np.array([-2.0, 1.0, 1.0])
        np.testing.assert_allclose(along, expected, rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("body", [SPRINGS, None])
@pytest.mark.parametrize("modes", [None, 3])
def test_a_set_with_a_soft_carrier_runs(body, modes):
    gears = planetary(TEETH, "1.5 mm", 3)
    record = run_train(
        train(body, torque="40 N m", gears=gears, modes=modes), RunSettings(settling=0.01, duration=0.03)
    )
    mean = record.normal_force.sel(mesh=[f"set sun-planet {k}" for k in (1, 2, 3)]).mean("time").values
    # of friction a part is lost
    np.testing.assert_allclose(mean, 175.2, rtol=0.05)


def test_the_inertia_of_a_carrier_is_about_the_axis():
    """That of what is off the axis by Steiner."""
    centred, off = solid(), replace(solid(), positions=solid().positions + [0.02, 0.0, 0.0])
    mass, moments = FlexibleCarrier(model=centred, hub=HUB, pin=BORE).mass((0.0, ()))
    _, moved = FlexibleCarrier(model=off, hub=HUB, pin=BORE, at="5 mm").mass((0.0, ()))
    assert moved[2] - moments[2] == pytest.approx(mass * (shift(off) - shift(centred)), rel=1e-9)


def shift(model):
    """Return the square of the distance of the centre of mass from the axis, m^2."""
    return float(np.sum(model.mass_properties().com[:2] ** 2))


FILE = """
[shafts]
sun = { length = "100 mm" }
carrier = { length = "100 mm" }
[planetary_stages.set]
sun = "sun"
carrier = "carrier"
ring = "ground"
teeth = [24, 30, 84]
module = "1.5 mm"
planets = 3
pins = { radial = "5e8 N/m" }
carrier_body = { radial = "3e8 N/m", tangential = "2e8 N/m", pin_mass = "20 g" }
[bearings]
a = { shaft = "sun" }
b = { shaft = "carrier" }
[drives.motor]
shaft = "sun"
speed = "600 rpm"
[loads.brake]
shaft = "carrier"
torque = "10 N m"
"""


def test_a_file_says_the_same(tmp_path):
    (tmp_path / "set.toml").write_text(FILE)
    one = Drivetrain.from_file(tmp_path / "set.toml")
    body = one.planetary_stages[0].flexible_carrier
    assert (body.radial, body.tangential, body.pin_mass) == (3e8, 2e8, 0.02)
    gm.save(one, tmp_path / "again.toml")
    again = Drivetrain.from_file(tmp_path / "again.toml")
    assert again.planetary_stages[0].flexible_carrier == body
    assert again.modal_models["set carrier"].modes == one.modal_models["set carrier"].modes == 18


@pytest.mark.parametrize(("fields", "words"), [
    ({}, says("'set'", "radial", "tangential", "model")),
    ({"radial": 1e8, "tangential": 1e8, "pin_mass": "100 kg"}, says("'set'", "pin_mass", "100 kg", "give")),
    ({"radial": 1e8, "tangential": 1e8, "model": {"program": "box"}}, says("'set'", "radial", "model")),
    ({"model": {"program": "box", "size": [1, 1, 1], "wall": 0.1, "divisions": [1, 1, 1]}},
     says("'set'", "hub", "give")),
    ({"stiffness": 1e8}, says("'set'", "stiffness", "radial")),
])  # fmt: skip
def test_carriers_that_are_none_are_refused(fields, words):
    with pytest.raises(DrivetrainError, match=words):
        _ = train(fields).modal_models
