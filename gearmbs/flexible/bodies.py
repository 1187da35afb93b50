"""Wheels, carriers and housings of few dimensions, meshed, assembled and reduced: no file is needed to try them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.interfaces import Interface
from gearmbs.flexible.material import STEEL, ElasticMaterial
from gearmbs.flexible.modal_model import ModalModel
from gearmbs.flexible.reduction import reduce_model
from gearmbs.flexible.solid import CORNERS, nodes_where, revolved_mesh, solid_model, used_part
from gearmbs.mechanism.quantities import quantities, quantity
from gearmbs.units import Quantity

TOUCHES = 1e-6
"""Distance from a face, in sizes of the body, up to which a node is on it."""


def thin_rimmed_wheel(
    bore: Quantity,
    hub: Quantity,
    rim: Quantity,
    outer: Quantity,
    width: Quantity,
    web: Quantity,
    *,
    modes: int | None = None,
    around: int = 24,
    material: ElasticMaterial = STEEL,
    name: str = "wheel",
) -> ModalModel:
    """Return a wheel with a web that is thinner than hub and rim, about z, centred on the origin.

    Its seats are ``"bore"``, whose face moves as a rigid body, and ``"rim"``, which follows the outer face on average:
    the place of the teeth; both are at the origin, so that markers are made by :meth:`ModalModel.seat_marker`. A rim
    that turns and shifts against its hub is what a thin web adds to a rigid wheel; modes with two and more waves round
    about are in the model, but a single seat does not feel them.

    Parameters
    ----------
    bore, hub, rim, outer : float or str
        Diameters, m: of the bore, of the hub, inside the rim, and outside (the root circle of the teeth).
    width, web : float or str
        Of hub and rim, and the thickness of the web in their middle, m.
    modes : int, optional
        Shapes with held seats that are kept beside the static ones, see `reduce_model`; default 20.
    around : int
        Elements round about.
    material : ElasticMaterial
    name : str

    Raises
    ------
    FlexibleError
        If the diameters do not rise or the web is not thinner than the rim is wide; if scikit-fem is not installed.
    """
    a, b, c, d = _rising("thin_rimmed_wheel", bore=bore, hub=hub, rim=rim, outer=outer)
    w = quantity(width, "length", "thin_rimmed_wheel: width")
    t = quantity(web, "length", "thin_rimmed_wheel: web")
    if not 0.0 < t < w:
        raise FlexibleError(f"thin_rimmed_wheel: web = {t} m, width = {w} m; a web is thinner than its rim is wide")
    radii = np.array([a, b, 0.5 * (b + c), c, d]) / 2
    mesh = revolved_mesh(radii, np.array([-w, -t, t, w]) / 2, around, lambda r, z: abs(z) < t / 2 or not b < 2 * r < c)
    model = solid_model(mesh, material, name=name)
    seats = [
        Interface("bore", _on_cylinder(model, a / 2, around), at=(0.0, 0.0, 0.0)),
        Interface("rim", _on_cylinder(model, d / 2, around), "average", at=(0.0, 0.0, 0.0)),
    ]
    return reduce_model(model, seats, modes=modes)


def planet_carrier(
    bore: Quantity,
    outer: Quantity,
    width: Quantity,
    pins: int,
    pin_circle: Quantity,
    pin: Quantity,
    *,
    modes: int | None = None,
    material: ElasticMaterial = STEEL,
    name: str = "carrier",
) -> ModalModel:
    """Return a disc that carries planets on pins, about z, centred on the origin, the first pin on x.

    Its seats are ``"bore"``, whose face moves as a rigid body, and ``"pin 1"`` and so on, which follow the disc on
    average where the pins are pressed in.

    Parameters
    ----------
    bore, outer, width : float or str
        Diameters and thickness of the disc, m.
    pins : int
        Number of pins.
    pin_circle, pin : float or str
        Diameters of the circle of the pins and of a pin, m.
    modes : int, optional
        Shapes with held seats that are kept beside the static ones, see `reduce_model`; default 20.
    material : ElasticMaterial
    name : str

    Raises
    ------
    FlexibleError
        If the pins do not fit on the disc; if scikit-fem is not installed.
    """
    a, d = _rising("planet_carrier", bore=bore, outer=outer)
    w, circle, p = (
        quantity(v, "length", f"planet_carrier: {n}")
        for n, v in (("width", width), ("pin_circle", pin_circle), ("pin", pin))
    )
    if pins < 1 or not (w > 0.0 and p > 0.0 and circle - p > a and circle + p < d):
        raise FlexibleError(
            f"planet_carrier: {pins} pins of {p} m on a circle of {circle} m do not fit between {a} and {d} m"
        )
    if pins > 1 and circle * np.sin(np.pi / pins) <= p:
        raise FlexibleError(
            f"planet_carrier: {pins} pins of {p} m on a circle of {circle} m overlap; they are "
            f"{circle * np.sin(np.pi / pins):.4g} m apart"
        )
    around = pins * int(np.ceil(24 / pins))
    radii = np.unique(np.array([a, circle - p, circle, circle + p, d]) / 2)
    model = solid_model(revolved_mesh(radii, np.array([-w, w]) / 2, around), material, name=name)
    seats = [Interface("bore", _on_cylinder(model, a / 2, around), at=(0.0, 0.0, 0.0))]
    reach = 0.5 * p * (1 + TOUCHES)
    for k in range(pins):
        turn = 2 * np.pi * k / pins
        x0, y0 = 0.5 * circle * np.cos(turn), 0.5 * circle * np.sin(turn)
        nodes = nodes_where(model, lambda x, y, _, x0=x0, y0=y0: np.hypot(x - x0, y - y0) <= reach)
        seats.append(Interface(f"pin {k + 1}", nodes, "average", at=(x0, y0, 0.0)))
    return reduce_model(model, seats, modes=modes)


def box_housing(
    size: npt.ArrayLike,
    wall: Quantity,
    bearings: Sequence[Sequence[Quantity]],
    bearing: Quantity,
    *,
    divisions: tuple[int, int, int] = (6, 4, 4),
    modes: int | None = 10,
    material: ElasticMaterial = STEEL,
    name: str = "housing",
) -> ModalModel:
    """Return a box, open on top, whose end walls across z carry bearings, on four mounts below.

    Its seats are ``"bearing 1 front"`` (at z = 0) and ``"bearing 1 back"`` and so on, which follow the wall on average
    within the diameter of the bearing, and ``"mount 1"`` to ``"mount 4"`` at the corners of the bottom, likewise.

    Parameters
    ----------
    size : array_like of 3 floats or str
        Outer width (x), height (y) and length (z), m, from the origin.
    wall : float or str
        Thickness of all walls, m.
    bearings : sequence of pairs of float or str
        x and y of the axes, m.
    bearing : float or str
        Outer diameter of the bearings, m.
    divisions : tuple of 3 ints
        Elements between the walls.
    modes : int, optional
        Shapes with held seats that are kept beside the static ones, see `reduce_model`; 20 if None.
    material : ElasticMaterial
    name : str

    Raises
    ------
    FlexibleError
        If walls or bearings do not fit; if scikit-fem is not installed.
    """
    x, y, z = quantities(size, "length", "box_housing: size")
    t = quantity(wall, "length", "box_housing: wall")
    reach = 0.5 * quantity(bearing, "length", "box_housing: bearing")
    axes = quantities(bearings, "length", "box_housing: bearings").reshape(-1, 2)
    if not 0.0 < 2 * t < min(x, z) or not t < y:
        raise FlexibleError(f"box_housing: walls of {t} m do not fit into {x} x {y} x {z} m")
    for u, v in axes:
        if not (t + reach <= u <= x - t - reach and t + reach <= v <= y - reach):
            raise FlexibleError(f"box_housing: a bearing of {2 * reach} m at ({u}, {v}) m is not inside the end walls")
    for k, (u, v) in enumerate(axes):
        apart = np.hypot(*(axes[:k] - (u, v)).T)
        if apart.size and apart.min() < 2 * reach:
            other = axes[int(np.argmin(apart))]
            raise FlexibleError(
                f"box_housing: bearings of {2 * reach} m at ({u}, {v}) m and ({other[0]}, {other[1]}) m overlap; they "
                f"are {apart.min():.4g} m apart"
            )
    places = [
        np.concatenate([[0.0], np.linspace(t, x - t, divisions[0] + 1), [x]]),
        np.concatenate([[0.0], np.linspace(t, y, divisions[1] + 1)]),
        np.concatenate([[0.0], np.linspace(t, z - t, divisions[2] + 1), [z]]),
    ]
    counts = [len(p) for p in places]
    points = np.vstack([p.ravel() for p in np.meshgrid(*places, indexing="ij")])
    cells = [
        [((i + p) * counts[1] + j + q) * counts[2] + k + s for p, q, s in CORNERS]
        for i in range(counts[0] - 1)
        for j in range(counts[1] - 1)
        for k in range(counts[2] - 1)
        if i in (0, counts[0] - 2) or j == 0 or k in (0, counts[2] - 2)
    ]
    model = solid_model(used_part(points, np.array(cells)), material, name=name)
    return reduce_model(model, _housing_seats(model, (x, z), t, axes, reach), modes=modes)


def _housing_seats(
    model: FiniteElementModel, ground: tuple[float, float], wall: float, axes: np.ndarray, reach: float
) -> list[Interface]:
    """Return the interfaces of a box: bearings in both end walls, mounts at the corners of the bottom."""
    width, length = ground
    seats = []
    for number, (u, v) in enumerate(axes, 1):
        for side, middle in (("front", 0.5 * wall), ("back", length - 0.5 * wall)):

            def seated(x, y, z, u=u, v=v, middle=middle):
                return (np.hypot(x - u, y - v) <= reach) & (np.abs(z - middle) <= 0.5 * wall * (1 + TOUCHES))

            seats.append(
                Interface(f"bearing {number} {side}", nodes_where(model, seated), "average", at=(u, v, middle))
            )
    corners = [(u, w) for u in (0.5 * wall, width - 0.5 * wall) for w in (0.5 * wall, length - 0.5 * wall)]
    for number, (u, w) in enumerate(corners, 1):

        def below(x, y, z, u=u, w=w):
            near = 0.5 * wall * (1 + TOUCHES)
            return (np.abs(x - u) <= near) & (np.abs(z - w) <= near) & (y <= TOUCHES * wall)

        seats.append(Interface(f"mount {number}", nodes_where(model, below), "average", at=(u, 0.0, w)))
    return seats


def _rising(label: str, **diameters: Quantity) -> list[float]:
    """Return diameters that have to rise, m."""
    found = [quantity(v, "length", f"{label}: {n}") for n, v in diameters.items()]
    if not all(x < y for x, y in zip([0.0, *found], found)):
        text = ", ".join(f"{n} = {v} m" for n, v in zip(diameters, found))
        raise FlexibleError(f"{label}: {text}; the diameters must rise from a positive one")
    return found


def _on_cylinder(model: FiniteElementModel, radius: float, around: int) -> list[int]:
    """Return the nodes on the flat faces that stand for a cylinder about z."""
    flat = radius * np.cos(np.pi / around)
    return nodes_where(
        model,
        lambda x, y, _: (np.hypot(x, y) <= radius * (1 + TOUCHES)) & (np.hypot(x, y) >= flat * (1 - TOUCHES)),
    )
