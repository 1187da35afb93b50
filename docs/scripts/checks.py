"""Quick checks of the validation page: each returns rows (what, expected, found, unit)."""

from __future__ import annotations

from math import acos, cos, pi, sin, sqrt, tan

import numpy as np
import pandas as pd
from scipy.special import ellipk

from gearmbs.gears import GearPair, loaded_transmission_error
from gearmbs.mechanism import Mechanism, ramp
from gearmbs.studies import Case
from gearmbs.studies.run.simulation import case_mechanism, simulate_case

Rows = list[tuple[str, float, float, str]]

MODULE, TEETH, ALPHA = 95e-3 / 31, 29, 20 * pi / 180
PITCH, BASE, TIP = TEETH * MODULE / 2, TEETH * MODULE / 2 * cos(ALPHA), (TEETH / 2 + 1) * MODULE
TRANSMISSION_ERRORS = {
    "0 mm": (16.574, 10.096, (4.074, 3.010, 1.671)),
    "3 mm": (25.489, 8.61, (2.048, 1.850, 1.552)),
}
"""Mean, peak to peak and harmonics in um at 100 N m, by two independent programs."""


def table(rows: Rows):
    """Return the rows as a table with the relative deviation; deviations from zero are absolute."""
    lines = []
    for what, expected, found, unit in rows:
        deviation = abs(found - expected) / (abs(expected) or 1.0)
        lines.append((what, f"{expected:.6g}", f"{found:.6g}", unit, f"{deviation:.1e}"))
    frame = pd.DataFrame(lines, columns=["quantity", "expected", "found", "unit", "deviation"])
    return frame.set_index("quantity")


def geometry() -> Rows:
    """Radii, working pressure angle, contact ratio and backlash of the paper's pair."""
    pair = GearPair.paper()
    rows: Rows = [
        ("pitch radius", PITCH * 1e3, pair.driver.pitch_radius * 1e3, "mm"),
        ("base radius", BASE * 1e3, pair.driver.base_radius * 1e3, "mm"),
        ("outer radius", 47.5, pair.driver.tip_radius * 1e3, "mm"),
        ("root radius", (TEETH / 2 - 1.25) * MODULE * 1e3, pair.driver.root_radius * 1e3, "mm"),
    ]
    base_pitch = 2 * pi * BASE / TEETH
    for error in (0.0, 1e-3, 3e-3):
        pair = GearPair.paper(centre_distance_error=error)
        distance = 2 * PITCH + error
        alpha = acos(2 * BASE / distance)
        ratio = (2 * sqrt(TIP**2 - BASE**2) - distance * sin(alpha)) / base_pitch
        backlash = 2 * distance * (tan(alpha) - alpha - tan(ALPHA) + ALPHA) * cos(alpha)
        at = f"at +{error * 1e3:g} mm"
        rows.append((f"working pressure angle {at}", np.rad2deg(alpha), np.rad2deg(pair.working_pressure_angle), "deg"))
        rows.append((f"contact ratio {at}", ratio, pair.contact_ratio, "1"))
        if error:
            rows.append((f"normal backlash {at}", backlash * 1e3, pair.normal_backlash * 1e3, "mm"))
    return rows


def statics() -> Rows:
    """Normal force, penetration and loaded transmission error."""
    stiffness = 2.9852e5 * 1e3**1.3
    rows: Rows = []
    for torque in (100.0, 200.0):
        pair = GearPair.paper(torque=torque)
        rows.append((f"normal force at {torque:g} N m", torque / BASE, pair.normal_force, "N"))
        for count in (1, 2):
            depth = (torque / BASE / count / stiffness) ** (1 / 1.3)
            found = pair.penetration(pairs=count) * 1e6
            rows.append((f"penetration, {count} pair(s), {torque:g} N m", depth * 1e6, found, "um"))
    for error, (mean, swing, harmonics) in TRANSMISSION_ERRORS.items():
        te = loaded_transmission_error(GearPair.paper(centre_distance_error=error), torque=100.0)
        rows.append((f"transmission error at +{error}, mean", mean, te.mean * 1e6, "um"))
        rows.append((f"transmission error at +{error}, peak to peak", swing, te.peak_to_peak * 1e6, "um"))
        for k, (expected, found) in enumerate(zip(harmonics, te.harmonics(3) * 1e6), start=1):
            rows.append((f"transmission error at +{error}, harmonic {k}", expected, found, "um"))
    return rows


def mechanics() -> Rows:
    """Pendulum, free fall, free symmetric top, slider-crank."""
    return [_pendulum(), *_free_fall(), _top(), _slider_crank()]


def _pendulum() -> tuple[str, float, float, str]:
    model = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = model.body("rod", mass=1.0, inertia=(1e-9, 1e-9, 1e-9), position=(1.0, 0, 0))
    model.revolute("pin", rod, model.ground, at=(0, 0, 0), axis=(0, 1, 0))
    quarter = ellipk(0.5) * sqrt(1 / 9.81)
    motion = model.simulate(4 * quarter, t_eval=np.array([0.0, quarter, 2 * quarter, 4 * quarter]), tol=1e-9)
    return ("pendulum from the horizontal, x after half a period", -1.0, motion.com_position("rod")[2, 0], "m")


def _free_fall() -> Rows:
    model = Mechanism("free fall", gravity=(0, 0, -9.81))
    model.body("stone", mass=2.0, inertia=(1, 1, 1), velocity=(3.0, 0, 0))
    end = model.simulate(2.0, t_eval=np.array([0.0, 2.0]), tol=1e-8).com_position("stone")[-1]
    return [("free fall after 2 s, z", -0.5 * 9.81 * 4, end[2], "m"), ("free fall after 2 s, x", 6.0, end[0], "m")]


def _top() -> tuple[str, float, float, str]:
    """The transverse angular velocity in the body turns by (J3 / J1 - 1) w3 t."""
    j1, j3, spin, nutation, end = 1.0, 1.5, 4.0, 1.0, 5.0
    model = Mechanism("free top")
    model.body("top", mass=1.0, inertia=(j1, j1, j3), angular_velocity=(nutation, 0, spin))
    motion = model.simulate(end, t_eval=np.array([0.0, end]), tol=1e-9)
    inside = motion.orientation("top")[-1].T @ motion.angular_velocity("top")[-1]
    return ("free top, omega_x in the body after 5 s", nutation * cos((j3 / j1 - 1) * spin * end), inside[0], "rad/s")


def _slider_crank() -> tuple[str, float, float, str]:
    r, length, speed = 0.05, 0.15, 2 * pi * 25
    model = Mechanism("slider-crank")
    crank = model.body("crank", 0.8, (1e-3, 1e-3, 1e-3), position=(r / 2, 0, 0))
    rod = model.body("rod", 0.5, (1e-5, 1e-3, 1e-3), position=(r + length / 2, 0, 0))
    piston = model.body("piston", 0.4, (1e-4, 1e-4, 1e-4), position=(r + length, 0, 0))
    main = model.revolute("main", crank, model.ground, at=(0, 0, 0))
    model.revolute("big end", rod, crank, at=(r, 0, 0))
    model.revolute("small end", rod, piston, at=(r + length, 0, 0))
    model.translational("cylinder", piston, model.ground, at=(r + length, 0, 0), axis=(1, 0, 0))
    model.rotation("motor", main, ramp(speed))
    motion = model.simulate(0.03, t_eval=np.array([0.0, 0.013, 0.03]))
    angle = speed * 0.013
    root = sqrt(length**2 - (r * sin(angle)) ** 2)
    # second derivative of r cos + sqrt(l^2 - r^2 sin^2) at constant speed
    expected = speed**2 * (
        -r * cos(angle) - r**2 * cos(2 * angle) / root - (r**2 * sin(angle) * cos(angle)) ** 2 / root**3
    )
    return ("slider-crank, acceleration of the piston", expected, motion.com_acceleration("piston")[1, 0], "m/s^2")


def running() -> Rows:
    """A record of the healthy pair: mean forces, agreement of the integrators, drift, energy."""
    rows: Rows = []
    case = Case(operation={"duration": 0.1}, friction={"enabled": False}, solver={"tolerance": 1e-8})
    end = 0.1 + 48 / case.mesh_frequency
    swings = []
    for integrator in ("WSTIFF", "IDA"):
        solution = simulate_case(case.changed(solver={"integrator": integrator}))
        force, _ = solution.reaction("seat 2")
        force = force[np.searchsorted(solution.t, 0.1) : np.searchsorted(solution.t, end)]
        mean = force.mean(axis=0)
        rows.append((f"{integrator}: mean tangential force at the seat", 100.0 / BASE * cos(ALPHA), abs(mean[1]), "N"))
        rows.append((f"{integrator}: mean radial over tangential force", tan(ALPHA), abs(mean[0] / mean[1]), "1"))
        rows.append((f"{integrator}: distance of gear and shaft before projection", 0.0, _drift(solution), "m"))
        swings.append(force[:, 1].std())
    rows.append(("RMS about the mean, tangential, IDA against WSTIFF", swings[0], swings[1], "N"))
    start = case_mechanism(case).simulate(0.02, rate=400_000, rate_scale=case.operation.speed * 29, tol=1e-9)
    imbalance = start.energy_balance().attrs["relative_imbalance"]
    rows.append(("energy balance over the start-up, relative to the work", 0.0, imbalance, "1"))
    return rows


def _drift(solution) -> float:
    """Return how far the seat of the driven gear opens in the integrator's own values."""
    names = solution.problem.names
    at = {body: names.index(f"R_x({body})") for body in ("gear 2", "shaft 2")}
    y = solution.result.y
    apart = y[:, at["gear 2"] : at["gear 2"] + 3] - y[:, at["shaft 2"] : at["shaft 2"] + 3]
    return float(np.abs(apart).max())
