"""The 5 MW reference gearbox from its file: what is published of it, and what follows from that."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from gearmbs.studies import load_train, train_modes

# to make its 12 pairs takes a second
pytestmark = pytest.mark.slow

TIPS = {
    "third": ((1395.372, 1334.248), (380.751, 319.627)),
    "first sun-planet 1": ((978.839, 798.061), (905.440, 724.662)),
    "first planet 1-ring": ((905.440, 724.662), (2475.087, 2677.507)),
    "second sun-planet 2": ((432.845, 341.845), (815.655, 724.655)),
    "second planet 2-ring": ((815.655, 724.655), (1906.074, 2000.574)),
}
"""Tip and root diameters of driver and driven wheel, mm: Nejad et al., Wind Energy 19 (2016) 1089, Table V."""
CONTACT = dict(zip(TIPS, (1.4627, 1.1148, 1.2785, 1.3703, 1.6177), strict=True))
"""Contact ratios that follow from them, computed by another program."""
BEARINGS = {
    "INP-A": (0.0, 1.5e10, 1.5e10), "INP-B": (4.06e8, 1.54e10, 1.54e10), "PLC-A": (6.6e4, 1.7e9, 1.1e9),
    "PLC-B": (6.6e7, 1.7e9, 1.1e9), "IMS-PLC-A": (9.1e4, 6e7, 1.2e9), "IMS-PLC-B": (9.1e7, 6e7, 1.2e9),
    "IMS-A": (0.0, 6e7, 1.2e9), "IMS-B": (7.4e7, 5e8, 5e8), "IMS-C": (7.8e7, 7.4e8, 3.3e8),
    "HS-A": (1.3e8, 8.2e8, 8.2e8), "HS-B": (6.7e7, 8e8, 1.3e8), "HS-C": (8e7, 1e9, 7.3e7),
}  # fmt: skip
"""K_x, K_y, K_z, N/m, x along the shaft: ibid., Tables VI and IX."""


@pytest.fixture(scope="module")
def train():
    with warnings.catch_warnings():
        # flanks yield by 35 um by their own stiffness; no other law is told of
        warnings.simplefilter("error")
        return load_train("nrel_5mw").train


def test_ratios_and_frequencies(train):
    """Carrier in, ring held, sun out: 1 + z_r / z_s; the mesh is at the ring's teeth times the carrier's turns."""
    table = train.kinematics
    first, second, third = 1 + 56 / 19, 1 + 93 / 18, 95 / 24
    for ratio, published in ((first, 3.947), (second, 6.167), (third, 3.958)):
        assert round(ratio, 3) == published
    assert table.ratio("intermediate", "main") == pytest.approx(first, rel=1e-13)
    assert table.ratio("fast", "intermediate") == pytest.approx(second, rel=1e-13)
    assert table.ratio("generator", "rotor") == pytest.approx(-first * second * third, rel=1e-13)
    turns = 12.1 / 60
    assert table.shaft_frequency("generator") == pytest.approx(turns * 96.3541666667, rel=1e-10)
    meshes = {"first": 56 * turns, "second": 93 * first * turns, "third": 95 * first * second * turns}
    for name, frequency in meshes.items():
        assert table.mesh_frequency(name) == pytest.approx(frequency, rel=1e-13)
    assert [round(f, 2) for f in meshes.values()] == [11.29, 74.03, 466.35]


def test_the_gearbox_of_750_kw_has_its_published_ratio():
    """81.491 = (1 + 99/21) 82/23 88/22; meshes by their teeth at 22 rpm; power of 750 kW passes."""
    other = load_train("grc_750kw").train
    table = other.kinematics
    assert table.ratio("high", "rotor") == pytest.approx(81.491, rel=1e-5)
    found = [table.mesh_frequency(name) for name in ("first", "second", "third")]
    turns = 22.0 / 60.0
    assert found == pytest.approx([99 * turns, 82 * turns * 40 / 7, 88 * turns * 40 / 7 * 82 / 23])
    assert other.power.drive["wind"] * 2.0 * math.pi * turns == pytest.approx(750e3, rel=1e-4)


@pytest.mark.parametrize("mesh", TIPS)
def test_wheels(train, mesh):
    pair = train.pairs[mesh]
    for wheel, (tip, root) in zip((pair.driver, pair.driven), TIPS[mesh], strict=True):
        # the published pitch diameters of the helical wheels have three digits
        assert 2e3 * wheel.tip_radius == pytest.approx(tip, abs=1e-3)
        assert 2e3 * wheel.root_radius == pytest.approx(root, abs=1e-3)
    assert pair.contact_ratio == pytest.approx(CONTACT[mesh], abs=2e-4)
    if mesh == "third":
        assert pair.overlap_ratio == pytest.approx(360 * math.sin(math.radians(10)) / (14 * math.pi), rel=1e-12)


def test_bearings_and_pins(train):
    for name, (along, across, up) in BEARINGS.items():
        k, _ = train.part(name).matrices
        assert k.diagonal()[:3].tolist() == [across, up, along]
    # two bearings a pin
    assert train.part("first").on_pins.across == (2 * 9.4e9, 2 * 3.2e9)
    assert train.part("second").on_pins.across == (2 * 6e7, 2 * 1.2e9)


def test_rated_torques(train):
    """Power over speed on the rotor; a planet's pin carries a third of the carrier's torque over its radius."""
    rated = 5e6 / (12.1 * math.pi / 30)
    assert train.power.members["first"]["carrier"] == pytest.approx(-rated, rel=1e-6)
    speed = abs(train.speeds["generator"])
    power, control = train.part("power"), train.part("speed control")
    assert power.nominal(speed) * speed == pytest.approx(5e6, rel=1e-5)
    assert control.nominal(speed) == pytest.approx(0.0, abs=1.0)
    assert (control.nominal(speed + 0.1) - control.nominal(speed - 0.1)) / 0.2 == pytest.approx(2200.0, rel=1e-4)
    gives = [rated / (3 * 0.863) / 6.4e9, rated / (75 / 19) / (3 * 0.584) / 2.4e9]
    np.testing.assert_allclose(gives, 0.238e-3, rtol=2e-3)


@pytest.mark.parametrize("turned", [math.pi / 3, 7 * math.pi / 6])
def test_with_its_weight_it_rests_wherever_its_carrier_stands(train, turned):
    """The planets' forces on a sun make its torque; those that stand with their weight on it carry more or less."""
    rest = replace(train, gravity=(0.0, -9.81, 0.0)).changed("rotor", angle=turned).at_rest
    assert rest.trouble == ""
    for stage in ("first", "second"):
        forces = np.array([rest.forces[f"{stage} sun-planet {k}"] for k in (1, 2, 3)])
        radius = train.part(stage).gears.sun.base_radius
        assert radius * forces.sum() == pytest.approx(abs(train.power.members[stage]["sun"]), rel=1e-3)
        shares = 3.0 * forces / forces.sum()
        assert 0.005 < np.ptp(shares) < 0.05


def test_energy_is_closed(train):
    """Of 50 MJ that turn 3 kJ are worked: what is lost falls with the tolerance, to 1e-5 of the work at 1e-8."""
    faster = replace(train, run_up=0.005)
    lost = []
    for tol in (1e-7, 1e-8):
        solution = faster.build().simulate(0.02, rate=20_000, tol=tol, rate_scale=train.rate_scale)
        lost.append(solution.energy_balance().relative_imbalance)
    assert lost[1] < min(lost[0], 1e-5)


def test_the_first_mode_is_that_of_what_gives_in_series(train):
    """Two inertias on all that gives between them, referred to the rotor; meshes below 200 Hz are stiff as statics."""
    first, second, third = 75 / 19, 37 / 6, 95 / 24
    gives = [1.0 / train.part("hub").tangent]
    i1, i2 = first**2, (first * second) ** 2
    bars = [
        (0.7, 1.667, 1),
        (0.4, 0.2455, i1),
        (0.533, 0.775, i1),
        (0.2, 0.275, i2),
        (0.333, 0.666, i2),
        (0.4, 0.18, i2),
    ]
    shear = 2.1e11 / 2.6
    gives += [32.0 * length / (shear * math.pi * d**4) / ratio for d, length, ratio in bars]
    for stage, ratio in (("first", 1.0), ("second", i1)):
        gears = train.part(stage).gears
        along = train.part(stage).on_pins.across[1]
        gives.append(1.0 / (3 * along * gears.carrier_radius**2) / ratio)
        sun, ring = gears.sun.base_radius, gears.ring.base_radius
        for mesh in (f"{stage} sun-planet 1", f"{stage} planet 1-ring"):
            # torque on the carrier over the force of a mesh: three times both base radii
            gives.append(1.0 / (3 * train.mesh_springs[mesh].stiffness * (sun + ring) ** 2) / ratio)
    gives.append(1.0 / (4 * 1e9 * 1.5**2))
    referred = {"intermediate": first, "fast": first * second, "high": first * second * third}
    referred["generator"] = referred["high"]
    chain = train.torsional()
    inertia = dict(zip(chain.names, chain.inertias, strict=True))
    behind = sum(inertia[name] * ratio**2 for name, ratio in referred.items())
    expected = math.sqrt((1.0 / inertia["rotor"] + 1.0 / behind) / sum(gives)) / (2.0 * math.pi)
    modes = train_modes(train)
    slow = modes.frequencies[modes.oscillating]
    # teeth of contact ratio 1.1 are not as stiff at each moment as in the mean
    assert slow[slow > 0.5][0] == pytest.approx(expected, rel=0.01)
