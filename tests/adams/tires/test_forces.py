"""Tires on a flat road against the published formulas in plain Python, and what they do at their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gearmbs.adams import parse_script, read_view, run_deck

from .files import COEFFICIENTS, FLAT, PAC89, PAC2002, QUARTER_CAR, driven, write
from .formulas import KZ, R0, pac89, pac2002, relaxation, rolling_radius

STATES = [
    (0.0, 0.0, 0.0, 3000.0), (0.03, 0.0, 0.0, 4000.0), (0.0, 0.04, 0.0, 4000.0), (-0.06, 0.03, 2.0, 5000.0),
    (0.1, -0.08, -3.0, 2500.0), (0.6, 0.3, 4.0, 6000.0), (-0.8, -0.2, 0.0, 3500.0),
]  # fmt: skip
"""Longitudinal slip, slip angle, inclination in degrees, load."""
SPEED = 18.0


def ran(folder, tire, motion, end=0.01, steps=2, **rig):
    """Run a rig; return its VARIABLEs by names without "tire_", and the result."""
    view = read_view(write(folder, tire, motion, **rig))
    assert not view.deck.unsupported
    result = run_deck(view.deck, end=end, steps=steps)
    assert result.success, result.messages
    names = {one.name: one.id for one in view.deck if getattr(one, "keyword", "") == "VARIABLE"}
    return {name.removeprefix("tire_"): np.asarray(result.variable(k)) for name, k in names.items()}, result


def motion_of(kappa, alpha, gamma, load, radius, lift=0.0):
    """Return how a wheel that starts 0.3 m high is driven so that it has these slips."""
    loaded = R0 - load / KZ
    up = loaded * math.cos(math.radians(gamma)) - 0.3 + lift
    spin = (1 + kappa) * SPEED / radius
    return driven(f"{SPEED}*TIME", f"{SPEED * math.tan(alpha)!r}*TIME", repr(up), f"{spin!r}*TIME", gamma)


def at_hub(made, load, gamma):
    """Return forces and torques at the wheel's centre: along, across, up."""
    loaded, tilt = R0 - load / KZ, math.radians(gamma)
    s, c = math.sin(tilt), math.cos(tilt)
    return {
        "force_along": made["fx"],
        "force_across": made["fy"],
        "vertical_force": load,
        "torque_along": loaded * (s * load + c * made["fy"]) + made["mx"],
        "torque_across": -loaded * c * made["fx"] + made["my"],
        "torque_up": -loaded * s * made["fx"] + made["mz"],
    }


def compare(found, wanted, k=-1):
    size = {"f": wanted["vertical_force"], "v": wanted["vertical_force"], "t": R0 * wanted["vertical_force"]}
    for name, value in wanted.items():
        assert found[name][k] == pytest.approx(value, abs=1e-8 * size[name[0]]), name


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("mode", [3, 4])
@pytest.mark.slow
def test_pac2002_gives_the_published_formula(tmp_path, state, mode):
    kappa, alpha, gamma, load = state
    motion = motion_of(*state, rolling_radius(load))
    found, _ = ran(tmp_path, PAC2002.format(mode=mode), motion, camber=gamma)
    compare(found, at_hub(pac2002(kappa, alpha, math.radians(gamma), load, SPEED, mode == 4), load, gamma))


@pytest.mark.parametrize("state", STATES[1:])
@pytest.mark.parametrize("mode", [1, 2, 3, 4])
@pytest.mark.slow
def test_pac89_gives_the_published_formula(tmp_path, state, mode):
    kappa, alpha, gamma, load = state
    loaded = R0 - load / KZ
    found, _ = ran(tmp_path, PAC89.format(mode=mode), motion_of(*state, loaded), end=0.2, camber=gamma)
    made = pac89(kappa, alpha, math.radians(gamma), load, mode in (2, 4))
    made["my"] *= loaded
    compare(found, at_hub(made, load, gamma))
    if mode in (3, 4):
        # forces along the road come up in the first tenth of a second, the load at once
        early, _ = ran(tmp_path, PAC89.format(mode=mode), motion_of(*state, loaded), end=0.05, steps=1, camber=gamma)
        assert early["force_along"][-1] == pytest.approx(0.5 * made["fx"], rel=1e-6)
        assert early["vertical_force"][-1] == pytest.approx(load)


CHRONO = {(0.04, 0.0): (3364.127, -61.700), (0.02, 0.03): (1816.469, -1976.176), (-0.1, -0.05): (-4491.259, 2290.656)}
"""Forces along and across by slips, at 4400 N upright."""


@pytest.mark.slow
def test_numbers_of_another_program(tmp_path):
    """Project Chrono's ChPac02Tire, of the same coefficients; it adds 0.1 N to a divisor, which moves 2e-5 of them."""
    for (kappa, alpha), (fx, fy) in CHRONO.items():
        motion = motion_of(kappa, alpha, 0.0, 4400.0, rolling_radius(4400.0))
        found, _ = ran(tmp_path, PAC2002.format(mode=4).replace("LKY = 1.1", "LKY = 1"), motion)
        assert found["force_along"][-1] == pytest.approx(fx, abs=5e-5 * 4400)
        assert found["force_across"][-1] == pytest.approx(fy, abs=5e-5 * 4400)


@pytest.mark.slow
def test_relaxation_is_a_lag_over_a_length(tmp_path):
    """After a step of the slip angle the deflection comes up as 1 - exp(-x/sigma); forces end as those of rest."""
    load, alpha, kappa = 4000.0, 0.02, 0.01
    motion = motion_of(kappa, alpha, 0.0, load, rolling_radius(load))
    found, result = ran(tmp_path, PAC2002.format(mode=14), motion, end=0.4, steps=40)
    sigma = relaxation(load, 0.0)
    x = SPEED * result.t
    np.testing.assert_allclose(np.tan(found["lateral_slip"]), math.tan(alpha) * (1 - np.exp(-x / sigma[1])), atol=5e-5)
    np.testing.assert_allclose(found["longitudinal_slip"], kappa * (1 - np.exp(-x / sigma[0])), atol=5e-5)
    made = pac2002(kappa, alpha, 0.0, load, SPEED)
    assert found["force_along"][-1] == pytest.approx(made["fx"], rel=1e-3)
    assert found["force_across"][-1] == pytest.approx(made["fy"], rel=1e-3)
    # the gyroscopic couple: c m V dv/dt, at the start dv/dt is the slip speed
    turned = 0.2 * 5.0 * (1 + kappa) * SPEED * SPEED * math.tan(alpha)
    start = pac2002(0.0, 0.0, 0.0, load, SPEED)
    assert found["torque_up"][0] == pytest.approx(start["mz"] + turned, rel=1e-6)


@pytest.mark.parametrize("text", [PAC2002.format(mode=4), PAC89.format(mode=2)], ids=["PAC2002", "PAC89"])
@pytest.mark.slow
def test_load_is_stiffness_and_damping_and_never_pulls(tmp_path, text):
    motion = driven(up="0.02*SIN(20*TIME) + 0.01")
    found, result = ran(tmp_path, text, motion, end=0.5, steps=200)
    t = result.t
    height = 0.3 + 0.02 * np.sin(20 * t) + 0.01
    pressed = KZ * (R0 - height) - 100.0 * 0.4 * np.cos(20 * t)
    wanted = np.where(height < R0, np.maximum(0.0, pressed), 0.0)
    np.testing.assert_allclose(found["vertical_force"], wanted, atol=1e-5 * KZ * R0)
    assert (wanted == 0.0).any()
    assert (wanted > 4000.0).any()
    lifted = height > R0 + 1e-6
    for name in ("force_along", "force_across", "torque_along", "torque_across", "torque_up"):
        assert np.abs(found[name][lifted]).max() == 0.0


@pytest.mark.slow
def test_a_tire_with_relaxation_leaves_the_road_and_comes_back(tmp_path):
    """Without load its relaxation lengths are zero, and nothing may be divided by them: forces are none there."""
    motion = driven(f"{SPEED}*TIME", "0.5*TIME", "0.04*SIN(20*TIME) - 0.01", "56*TIME")
    found, result = ran(tmp_path, PAC2002.format(mode=14), motion, end=0.6, steps=150)
    load = found["vertical_force"]
    lifted = 0.29 + 0.04 * np.sin(20 * result.t) > R0 + 1e-3
    assert lifted.sum() > 10
    for name in ("force_along", "force_across", "torque_along", "torque_across", "torque_up"):
        assert np.isfinite(found[name]).all(), name
        assert np.abs(found[name][lifted]).max() < 1e-5 * load.max(), name
    # back on the road it carries no more than friction holds, and as at once what it carries in a steady state
    assert (np.abs(found["force_across"]) <= 1.6 * load + 1e-9).all()
    k = int(np.argmax(load))
    most = float(load[k])
    made = pac2002(56 * rolling_radius(most) / SPEED - 1, math.atan(0.5 / SPEED), 0.0, most, SPEED)
    assert found["force_across"][k] == pytest.approx(made["fy"], rel=0.1)


@pytest.mark.slow
def test_a_factor_of_the_stiffness_is_one_of_the_load(tmp_path):
    load = 4000.0
    soft = PAC2002.format(mode=4).replace("LMUX = 0.95", "LMUX = 0.95\nLCZ = 0.8")
    stiff = PAC2002.format(mode=4).replace("VERTICAL_STIFFNESS = 2e5", "VERTICAL_STIFFNESS = 1.6e5")
    motion = motion_of(0.02, 0.03, 0.0, load, rolling_radius(load))
    found = []
    for k, text in enumerate((soft, stiff)):
        (tmp_path / str(k)).mkdir()
        found.append(ran(tmp_path / str(k), text, motion)[0])
    assert found[0]["vertical_force"][-1] == pytest.approx(0.8 * load)
    for name in ("force_along", "force_across", "torque_up"):
        assert found[0][name][-1] == pytest.approx(found[1][name][-1], rel=1e-12)


@pytest.mark.parametrize("text", [PAC2002.format(mode=4), PAC89.format(mode=2)], ids=["PAC2002", "PAC89"])
@pytest.mark.slow
def test_a_tire_turns_into_its_way_in_either_direction(tmp_path, text):
    """What the slip angle changes of the torque about the vertical turns the wheel's plane towards its velocity."""
    for speed in (SPEED, -SPEED):
        torque, force = [], []
        for across in (-0.5, 0.5):
            folder = tmp_path / f"{speed} {across}"
            folder.mkdir()
            loaded = R0 - 4000.0 / KZ
            radius = rolling_radius(4000.0) if "PAC2002" in text else loaded
            motion = driven(f"{speed}*TIME", f"{across}*TIME", repr(loaded - 0.3), f"{speed / radius!r}*TIME")
            found, _ = ran(folder, text, motion, end=0.2)
            torque.append(found["torque_up"][-1])
            force.append(found["force_across"][-1])
        assert force[0] > 0.0 > force[1]
        assert (torque[1] - torque[0]) * speed > 10.0 * abs(speed)


@pytest.mark.slow
def test_the_belts_mass_is_in_the_unit_of_the_file(tmp_path):
    load, alpha = 4000.0, 0.02
    motion = motion_of(0.0, alpha, 0.0, load, rolling_radius(load))
    torques = {}
    for unit, mass in (("kg", 5), ("gram", 5000), ("gram", 5)):
        folder = tmp_path / f"{unit} {mass}"
        folder.mkdir()
        text = (
            PAC2002.format(mode=14).replace("MASS = 'kg'", f"MASS = '{unit}'").replace("MBELT = 5.0", f"MBELT = {mass}")
        )
        torques[unit, mass] = ran(folder, text, motion)[0]["torque_up"][0]
    assert torques["gram", 5000] == pytest.approx(torques["kg", 5], rel=1e-12)
    turned = 0.2 * 5.0 * SPEED * SPEED * math.tan(alpha)
    assert torques["kg", 5] - torques["gram", 5] == pytest.approx(0.999 * turned, rel=1e-6)


@pytest.mark.slow
def test_a_tire_on_the_other_side_is_its_mirror_image(tmp_path):
    (tmp_path / "l").mkdir()
    (tmp_path / "r").mkdir()
    text = PAC2002.format(mode=4)
    left, _ = ran(tmp_path / "l", text, motion_of(0.02, 0.05, 2.0, 4000.0, rolling_radius(4000.0)), camber=2.0)
    right, _ = ran(
        tmp_path / "r", text, motion_of(0.02, -0.05, -2.0, 4000.0, rolling_radius(4000.0)), camber=-2.0, side="right"
    )
    for name, sign in (
        ("force_along", 1),
        ("force_across", -1),
        ("torque_along", -1),
        ("torque_across", 1),
        ("torque_up", -1),
    ):
        assert right[name][-1] == pytest.approx(sign * left[name][-1], rel=1e-9)


@pytest.mark.slow
def test_friction_of_the_road_scales_what_a_sliding_tire_carries(tmp_path):
    text = PAC2002.format(mode=1).replace("PVX1 = 0.002", "PVX1 = 0").replace("PVX2 = 0.001", "PVX2 = 0")
    held = {}
    for mu in (1.0, 0.4):
        locked = driven(f"{SPEED}*TIME", up=repr(R0 - 4000.0 / KZ - 0.3))
        found, _ = ran(tmp_path, text, locked, road=FLAT.replace("MU = 1.0", f"MU = {mu}"))
        held[mu] = found["force_along"][-1]
        peak = mu * COEFFICIENTS["LMUX"] * COEFFICIENTS["PDX1"] * 4000.0
        # a locked wheel has a slip of -1; beyond the peak the force falls towards D sin(C pi/2)
        assert -peak < held[mu] < -peak * math.sin(COEFFICIENTS["PCX1"] * math.pi / 2)
    # slip stiffness does not depend on friction: on a slippery road a locked wheel is further beyond the peak
    assert 0.3 < held[0.4] / held[1.0] < 0.4


@pytest.mark.parametrize("text", [PAC2002.format(mode=4), PAC2002.format(mode=14), PAC89.format(mode=2)])
@pytest.mark.slow
def test_what_a_tire_does_takes_energy(tmp_path, text):
    """Sliding in any direction and at any spin, force times slip speed is a loss, shifts of the formulas aside."""
    rng = np.random.default_rng(3)
    for _ in range(4):
        vx, vy, spin = rng.uniform(-12, 12), rng.uniform(-8, 8), rng.uniform(-40, 40)
        motion = driven(f"{vx}*TIME", f"{vy}*TIME", repr(R0 - 0.02 - 0.3), f"{spin}*TIME")
        found, _ = ran(tmp_path, text, motion, end=0.6, steps=6)
        slid = vx - spin * rolling_radius(0.02 * KZ)
        power = found["force_along"][-1] * slid + found["force_across"][-1] * vy
        assert power < 0.0


@pytest.mark.slow
def test_a_locked_wheel_stands_still_and_holds(tmp_path):
    """Pushed sideways below what friction holds, a tire with relaxation is a spring and a damper, and stays there."""
    more = """\
part create rigid_body name_and_position part_name = .rig.sledge location = 0, 0, 0.3
marker create marker_name = .rig.sledge.cm location = 0, 0, 0.3 orientation = 0d, 0d, 0d
part create rigid_body mass_properties part_name = .rig.sledge mass = 387.75 center_of_mass_marker = cm ixx = 10 &
   iyy = 10 izz = 10
marker create marker_name = .rig.sledge.hub location = 0, 0, 0.3 orientation = 0d, 0d, 0d
marker create marker_name = .rig.ground.plane location = 0, 0, 0.3 orientation = 0d, 90d, 0d
marker create marker_name = .rig.tire.wheel_part.hub location = 0, 0, 0.3 orientation = 0d, 0d, 0d
constraint create joint fixed joint_name = .rig.held i_marker_name = .rig.tire.wheel_part.hub &
   j_marker_name = .rig.sledge.hub
constraint create primitive_joint orientation jprim_name = .rig.upright i_marker_name = .rig.sledge.hub &
   j_marker_name = .rig.ground.road_mark
force create body gravitational gravity_field_name = .rig.g x_component_gravity = 0 y_component_gravity = {push} &
   z_component_gravity = -9.81
"""
    found, _ = ran(tmp_path, PAC2002.format(mode=14), more.format(push=2.0), end=8.0, steps=200)
    weight = 407.75 * 9.81
    assert found["vertical_force"][-1] == pytest.approx(weight, rel=1e-3)
    assert np.abs(found["force_across"][-20:].mean()) == pytest.approx(2.0 * 407.75, rel=0.02)
    assert np.abs(found["speed_across"]).max() < 0.5


@pytest.mark.slow
def test_a_quarter_car_against_results_of_adams(tmp_path):
    """Root mean squares that ADAMS 2024.1 gave of a step of 10 mm, published with its model.

    takuma1122/quarter-car-adams-simulink-cosim, README: 86.6 mm/s2, 0.145 mm and 0.95 mm; the damper's force came from
    Simulink, held over 5 ms.
    """
    ramps = [f"((TIME - {t}) + SQRT((TIME - {t})**2 + 1E-6))/2" for t in (0.5, 0.6)]
    text = PAC2002.format(mode=14).replace("= 0.32 ", "= 0.326 ").replace("= 2e5", "= 2.1e5").replace("= 100", "= 50")
    (tmp_path / "tire.tir").write_text(text)
    (tmp_path / "flat.rdf").write_text(FLAT)
    path = tmp_path / "car.cmd"
    path.write_text(QUARTER_CAR.format(road=f"100*({ramps[0]} - {ramps[1]})"))
    view = read_view(path)
    result = run_deck(view.deck, parse_script("a\nb\nSIMULATE/STATICS\nSIMULATE/DYNAMICS, END=10, DTOUT=0.005\n"))
    assert result.success
    names = {one.name: one.id for one in view.deck if getattr(one, "keyword", "") == "VARIABLE"}
    assert result.variable(names["tire_deflection"])[0] == pytest.approx(350 * 9.80665 / 2.1e5, rel=1e-3)
    for name, published, share in (("comfort", 86.6, 0.005), ("holding", 0.145, 0.02), ("stroke", 0.95, 0.005)):
        values = np.asarray(result.variable(names[name]))[1:]
        assert np.sqrt(np.mean(values**2)) == pytest.approx(published, rel=share), name
