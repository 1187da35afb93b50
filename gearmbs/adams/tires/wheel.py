"""A tire on a flat road as function expressions: where it touches, how it moves there, and what its hub receives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gearmbs.adams.tires.chain import Contact, Wrench, n, root
from gearmbs.adams.tires.pac89 import pac89
from gearmbs.adams.tires.pac2002 import pac2002
from gearmbs.adams.tires.property_file import PropertyFile, TireError

FORMATS = ("PAC2002", "PAC89")
ROAD = {"FLAT"}
FLAT_SECTIONS = {"MODEL", "PARAMETERS", "REFSYS"}


@dataclass(frozen=True)
class Hub:
    """Where a tire is in a deck.

    Attributes
    ----------
    wheel, tip, road : int
        Ids of markers: the wheel's centre, a point on its axle to the left, the road (z is up).
    arm : float
        Distance of the first two.
    length, force, time : float
        SI values of the deck's units.
    """

    wheel: int
    tip: int
    road: int
    arm: float
    length: float
    force: float
    time: float


def read_friction(road: PropertyFile) -> float:
    """Return the friction of a flat road.

    Raises
    ------
    TireError
        If it is another road.
    """
    kind = road.texts.get("ROAD_TYPE", "")
    if road.texts.get("METHOD", "2D") != "2D" or kind not in ROAD:
        raise TireError(
            f"{road.name}: ROAD_TYPE = {kind[:30] or 'nothing'}, METHOD = {road.texts.get('METHOD', '2D')[:30]}; "
            "flat of 2D is modelled"
        )
    road.refuse_unknown(
        {"METHOD", "FUNCTION_NAME", "ROAD_TYPE", "MU", "OFFSET", "ROTATION_ANGLE_XY_PLANE"}, FLAT_SECTIONS
    )
    for name in ("OFFSET", "ROTATION_ANGLE_XY_PLANE"):
        if road.texts.get(name, "0").strip("0. +-,"):
            raise TireError(
                f"{road.name}: {name} = {road.texts[name][:30]} is not modelled; place the road's marker instead"
            )
    friction = road.number("MU", 1.0)
    if not friction > 0.0:
        raise TireError(f"{road.name}: MU = {friction:g} must be positive")
    return friction


def hub_forces(
    tire: PropertyFile,
    friction: float,
    hub: Hub,
    right: bool,
    variable: Callable[[str, str], str],
    state: Callable[[str], str],
    rate: Callable[[str, str], None],
) -> list[str]:
    """Return forces and torques on the wheel at its centre, in the axes of the road's marker.

    Parameters
    ----------
    tire : PropertyFile
    friction : float
        Of the road.
    hub : Hub
    right : bool
        Whether it is on the right side.
    variable, state, rate : callable
        As of `Contact`.

    Raises
    ------
    TireError
    """
    kind = tire.texts.get("PROPERTY_FILE_FORMAT", "nothing")
    if kind not in FORMATS:
        raise TireError(
            f"{tire.name}: PROPERTY_FILE_FORMAT = {kind[:30]}; one of {', '.join(FORMATS)}, or a GFORCE of your own"
        )
    w, t, r = hub.wheel, hub.tip, hub.road
    speed, arm = hub.length / hub.time, hub.arm
    radius, stiffness = tire.number("UNLOADED_RADIUS"), tire.number("VERTICAL_STIFFNESS")
    if kind == "PAC2002":
        stiffness *= tire.number("LCZ", 1.0)
    sx, sy, sz = (f"(D{axis}({t}, {w}, {r})/{n(arm)})" for axis in "XYZ")
    flat = variable("axle_flat", root(f"{sx}**2 + {sy}**2"))
    # along the wheel and across it: (sy, -sx)/flat and (sx, sy)/flat
    ahead = variable("ahead_x", f"{sy}/{flat}"), variable("ahead_y", f"-{sx}/{flat}")
    vx, vy, wx, wy = (
        f"{what}({w}, {r}, {r}{more})" for what, more in (("VX", f", {r}"), ("VY", f", {r}"), ("WX", ""), ("WY", ""))
    )
    rolled = variable("roll_rate", f"({wx}*{ahead[0]} + {wy}*{ahead[1]})/{n(hub.time)}")
    height = f"{n(hub.length)}*DZ({w}, {r}, {r})"
    loaded = variable("loaded_radius", f"{height}/{flat}")
    along = variable("speed_along", f"{n(speed)}*({vx}*{ahead[0]} + {vy}*{ahead[1]})")
    across = variable("speed_across", f"{n(speed)}*({vy}*{ahead[0]} - {vx}*{ahead[1]}) + {loaded}*{flat}*{rolled}")
    spin = variable("spin", f"({wx}*{sx} + {wy}*{sy} + WZ({w}, {r}, {r})*{sz})/{n(hub.time)}")
    deflection = variable("deflection", f"MAX(0, {n(radius)} - {loaded})")
    slower = f"({n(speed)}*VZ({w}, {r}, {r}, {r})/{flat} + {loaded}*{sz}*{rolled}/{flat})"
    pressed = f"MAX(0, {n(stiffness)}*{deflection} - {n(tire.number('VERTICAL_DAMPING', 0.0))}*{slower})"
    fz = variable("vertical_force", f"IF({deflection}: 0, 0, {pressed})")
    gamma = variable("inclination_angle", f"ATAN({sz}/{flat})")
    contact = Contact(variable, state, rate, along, across, spin, gamma, loaded, deflection, fz)
    if kind == "PAC2002":
        side = tire.texts.get("TYRESIDE", "LEFT")
        if side not in ("LEFT", "RIGHT"):
            raise TireError(f"{tire.name}: TYRESIDE = {side[:30]}; give LEFT or RIGHT")
        made = pac2002(tire, contact, friction, (side == "RIGHT") != right)
    else:
        made = pac89(tire, contact, friction)
    return _at_hub(made, variable, ahead, sz, loaded, flat, fz, hub)


def _at_hub(
    made: Wrench,
    variable: Callable[[str, str], str],
    ahead: tuple[str, str],
    sz: str,
    loaded: str,
    flat: str,
    fz: str,
    hub: Hub,
) -> list[str]:
    """Return forces and torques at the centre: the point of contact is (0, R s_z, -R c) from it, along, across, up."""
    fx, fy = variable("force_along", made.fx), variable("force_across", made.fy)
    tx = variable("torque_along", f"{loaded}*({sz}*{fz} + {flat}*{fy}) + ({made.mx})")
    ty = variable("torque_across", f"-{loaded}*{flat}*{fx} + ({made.my})")
    tz = variable("torque_up", f"-{loaded}*{sz}*{fx} + ({made.mz})")
    found = []
    for scale, (x, y, z) in ((hub.force, (fx, fy, fz)), (hub.force * hub.length, (tx, ty, tz))):
        found += [
            f"({ahead[0]}*{x} - {ahead[1]}*{y})/{n(scale)}",
            f"({ahead[1]}*{x} + {ahead[0]}*{y})/{n(scale)}",
            f"{z}/{n(scale)}",
        ]
    return found
