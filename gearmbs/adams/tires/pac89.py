"""PAC89: the Magic Formula of 1989 with ADAMS's names of coefficients; docs/theory/tires.md.

Loads are in kN, angles in degrees, longitudinal slip in percent, forces in N, moments in N m; y is to the right and z
down (SAE), so that lateral force and aligning torque change sign.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from gearmbs.adams.tires.chain import Contact, Wrench, linear, n, root
from gearmbs.adams.tires.property_file import PropertyFile, TireError

SECTIONS = {
    "MODEL", "DIMENSION", "PARAMETER", "VERTICAL", "LATERAL_COEFFICIENTS", "LONGITUDINAL_COEFFICIENTS",
    "ALIGNING_COEFFICIENTS",
}  # fmt: skip
COUNTS = {"A": 14, "B": 11, "C": 18}
PLAIN = set(
    "PROPERTY_FILE_FORMAT USE_MODE VXLOW UNLOADED_RADIUS WIDTH ASPECT_RATIO VERTICAL_STIFFNESS VERTICAL_DAMPING "
    "LATERAL_STIFFNESS ROLLING_RESISTANCE".split()
)
LOWEST_SPEED = 1.0
"""m/s: below it slips are slip speeds over it; these files do not say how ADAMS goes through rest."""
SMOOTHED = 0.1
"""s: time in which forces along the road come up where USE_MODE asks for smoothing (ADAMS's manual)."""
LEAST_LOAD = 1e-3
"""kN: loads that divide are not smaller."""
LEAST_SLIP = 1e-6
"""Slips that divide are not smaller, percent or sine."""
DEGREE = math.pi / 180.0


def pac89(tire: PropertyFile, contact: Contact, friction: float) -> Wrench:
    """Return forces and moments of a tire.

    Parameters
    ----------
    tire : PropertyFile
    contact : Contact
    friction : float
        Of the road, a factor of the tire's.

    Raises
    ------
    TireError
        If the file gives what is not modelled.
    """
    known = PLAIN | {f"{letter}{j}" for letter, count in COUNTS.items() for j in range(count)}
    tire.refuse_unknown(known, SECTIONS)
    mode = tire.number("USE_MODE", 4.0)
    if mode not in (1, 2, 3, 4):
        raise TireError(
            f"{tire.name}: USE_MODE = {mode:g} of PAC89; give 1 to 4: how relaxation (11 to 14) is computed is not "
            "published"
        )

    def k(name: str) -> float:
        return tire.number(name, 0.0)

    for name in ("UNLOADED_RADIUS", "VERTICAL_STIFFNESS", "LATERAL_STIFFNESS", "A0", "A4", "B0"):
        if not k(name) > 0.0:
            raise TireError(f"{tire.name}: {name} = {k(name):g} must be positive")
    low = tire.number("VXLOW", LOWEST_SPEED)
    c, var = contact, contact.variable
    load = var("load_kn", f"MAX({n(LEAST_LOAD)}, {c.fz}/1000)")
    along = var("slip_divisor", f"MAX(ABS({c.vx}), {n(low)})")
    kappa = var("slip_percent", f"MAX(-100, MIN(100, -100*({c.vx} - {c.spin}*{c.loaded})/{along}))")
    alpha = var("slip_degrees", f"{n(1 / DEGREE)}*ATAN({c.vsy}/{along})")
    gamma = var("inclination_degrees", f"{n(1 / DEGREE)}*{c.gamma}")
    # along the wheel
    peak_x = var("peak_x", f"{n(friction)}*{linear(0.0, (k('B1'), f'{load}**2'), (k('B2'), load))}")
    slope = f"{linear(0.0, (k('B3'), f'{load}**2'), (k('B4'), load))}*EXP({n(-k('B5'))}*{load})"
    x = var("shifted_x", f"{kappa} + {linear(k('B10'), (k('B9'), load))}")
    e = linear(k("B8"), (k("B7"), load), (k("B6"), f"{load}**2"))
    fx = _curve(var, "pure_x", k("B0"), peak_x, slope, x, e)
    # across it
    peak_y = var("peak_y", f"{n(friction)}*{linear(0.0, (k('A1'), f'{load}**2'), (k('A2'), load))}")
    z = f"{load}/{n(k('A4'))}"
    slope = f"{n(2 * k('A3'))}*({z})/(1 + ({z})**2)*(1 - {n(k('A5'))}*ABS({gamma}))"
    y = var("shifted_y", f"{alpha} + {linear(k('A10'), (k('A9'), load), (k('A8'), gamma))}")
    fy = _curve(var, "pure_y", k("A0"), peak_y, slope, y, linear(k("A7"), (k("A6"), load)))
    raised = linear(k("A13"), (k("A12"), load), (k("A11"), f"{load}*{gamma}"))
    # their aligning torque
    peak = linear(0.0, (k("C1"), f"{load}**2"), (k("C2"), load))
    slope = (
        f"{linear(0.0, (k('C3'), f'{load}**2'), (k('C4'), load))}*(1 - {n(k('C6'))}*ABS({gamma}))"
        f"*EXP({n(-k('C5'))}*{load})"
    )
    at = var("shifted_z", f"{alpha} + {linear(k('C13'), (k('C12'), load), (k('C11'), gamma))}")
    e = f"({linear(k('C9'), (k('C8'), load), (k('C7'), f'{load}**2'))}*(1 - {n(k('C10'))}*ABS({gamma})))"
    mz = _curve(var, "pure_z", k("C0"), var("peak_z", f"{n(friction)}*{peak}"), slope, at, e) if k("C0") else "0"
    mz += " + " + linear(k("C17"), (k("C16"), load), (k("C14"), f"{load}**2*{gamma}"), (k("C15"), f"{load}*{gamma}"))
    if mode in (2, 4):
        # ellipses: each force against the other's peak, in the direction of both slips
        bent = var("sine_y", f"SIN({n(DEGREE)}*{y})")
        part = var("share_x", f"{x}/100")
        gone = {
            "x": f"{bent}*{fx}/(MAX(ABS({part}), {n(LEAST_SLIP)})*{peak_y})",
            "y": f"{part}*{fy}/(MAX(ABS({bent}), {n(LEAST_SLIP)})*{peak_x})",
        }
        fx, fy = (f"{force}/" + root(f"1 + ({gone[axis]})**2") for axis, force in (("x", fx), ("y", fy)))
    # without load there is nothing to push on
    held = var("loaded_share", f"MIN(1, {c.fz}/{n(1000 * LEAST_LOAD)})")
    if mode in (3, 4):
        held = var("smoothing", f"{held}*STEP(TIME, 0, 0, {n(SMOOTHED)}, 1)")
    fx = var("longitudinal_force", f"{held}*({fx})")
    fy = var("lateral_force_sae", f"{held}*({fy} + {raised})")
    moved = f"{fy}/{n(k('LATERAL_STIFFNESS'))}"
    turns = f"MAX(-1, MIN(1, {c.spin}*{n(k('UNLOADED_RADIUS') / low)}))"
    my = f"-{n(k('ROLLING_RESISTANCE'))}*{c.fz}*{c.loaded}*{turns}" if k("ROLLING_RESISTANCE") else "0"
    return Wrench(fx, f"-{fy}", f"-{c.fz}*{moved}", my, f"-({held}*{c.heading(low)}*({mz}) + {fx}*{moved})")


def _curve(var: Callable[[str, str], str], name: str, c: float, peak: str, slope: str, x: str, e: str) -> str:
    """Return D sin(C atan(B X - E (B X - atan B X))), B from the slope at the origin BCD."""
    bx = var(f"{name}_argument", f"{slope}*{x}/({n(c)}*{peak})")
    return var(name, f"{peak}*SIN({n(c)}*ATAN({bx} - {e}*({bx} - ATAN({bx}))))")
