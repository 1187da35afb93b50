"""Ratings and life of rolling bearings: C by ISO 281, C_0 by ISO 76, equivalent loads, lives.

Of ball bearings, with g = d cos(a)/D, lengths in mm and f the groove radii by the ball diameter,

    C = 1.3 f_c (i cos(a))^0.7 Z^(2/3) d^1.8    (d^1.4 3.647 above 25.4 mm),
    f_c = 39.9 lambda g^0.3 (1 - g)^1.39/(1 + g)^(1/3) (2 f_i/(2 f_i - 1))^0.41 (1 + u^(10/3))^(-3/10),
    u = 1.04 ((1 - g)/(1 + g))^1.72 (f_i (2 f_o - 1)/(f_o (2 f_i - 1)))^0.41;

of roller bearings C = 1.1 f_c (i L cos(a))^(7/9) Z^(3/4) d^(29/27) with

    f_c = 207.9 lambda g^(2/9) (1 - g)^(29/27)/(1 + g)^(1/4) (1 + u^(9/2))^(-2/9),
    u = 1.04 ((1 - g)/(1 + g))^(143/108).

Of thrust bearings at 90 degrees f_c is 146.1 g^0.3 of balls and 293.3 g^(2/9) of rollers, g = d/D, which are the tables
of the standard to 0.2 %, without the factor 1.1 and with no cos(a); C_0 is 220 Z L d of rollers, and of balls the load
at which each presses its groove of 0.54 with 4200 MPa.

1.1 is 1.15 of spherical roller bearings. i counts rows; makers count the two paths of four-point bearings as two. The
standard fixes f_i = f_o = 0.52, of self-aligning ball bearings f_i = 0.53 and the sphere, f_o = (1/g + 1)/2, and the
reduction factors lambda, whatever the grooves are. Static: of balls the load at which the most loaded one,
5 F/(i Z cos a), presses its groove with 4200 MPa, or the sphere with 4600 MPa; of rollers 44 (1 - g) i Z L d cos(a).

References
----------
.. [1] ISO 281:2007, Rolling bearings: dynamic load ratings and rating life. ISO/TR 1281-1:2008 derives the factors.
.. [2] ISO 76:2006, Rolling bearings: static load ratings.
"""

from __future__ import annotations

import math
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.bearings.kinds import KINDS, BearingError, Loads, require
from gearmbs.bearings.laws_kernel import groove_contact
from gearmbs.units import Quantity, to_si

if TYPE_CHECKING:
    from gearmbs.bearings.bearing import Bearing

OFF_RATING = 20.0
"""Rating of a catalogue by that of the standard's formula, or the reverse, that no steel and no second row explains."""
STANDARD_GROOVE = 0.52
"""Radius of the inner ring's groove, in ball diameters, that ISO 281 and ISO 76 state their ratings for."""
PRESSURE = 4.2e9
"""Contact pressure of the static rating of ball bearings, Pa (ISO 76)."""
THRUST_GROOVE = 0.54
"""The same radius of thrust ball bearings."""
SPHERE_GROOVE = 0.53
"""The same radius of self-aligning ball bearings, and their pressure, Pa; their outer ring is a sphere."""
SPHERE_PRESSURE = 4.6e9  # ISO 76, of self-aligning ball bearings


def sphere_curvature(ratio: float) -> float:
    """Return the radius of a self-aligning outer ring by the ball's diameter: (1/g + 1)/2, g = d cos(a)/D."""
    return 0.5 * (1.0 / ratio + 1.0)


def dynamic_rating(bearing: Bearing) -> float:
    """Return the basic dynamic radial load rating C by ISO 281, N."""
    g, z, cosine = bearing.ratio, bearing.elements, math.cos(bearing.contact_angle)
    d, factor, i = 1e3 * bearing.element_diameter, KINDS[bearing.kind].reduction, KINDS[bearing.kind].rated_rows
    if KINDS[bearing.kind].axial:
        return _axial_rating(bearing)
    if bearing.rollers:
        u = 1.04 * ((1 - g) / (1 + g)) ** (143 / 108)
        f_c = 207.9 * factor * g ** (2 / 9) * (1 - g) ** (29 / 27) / (1 + g) ** 0.25 * (1 + u**4.5) ** (-2 / 9)
        return (
            1.1
            * KINDS[bearing.kind].steel
            * f_c
            * (i * 1e3 * bearing.roller_length * cosine) ** (7 / 9)
            * z**0.75
            * d ** (29 / 27)
        )
    f = SPHERE_GROOVE if bearing.on_sphere else STANDARD_GROOVE
    f_o = sphere_curvature(g) if bearing.on_sphere else f
    u = 1.04 * ((1 - g) / (1 + g)) ** 1.72 * (f * (2 * f_o - 1) / (f_o * (2 * f - 1))) ** 0.41
    f_c = 39.9 * factor * g**0.3 * (1 - g) ** 1.39 / (1 + g) ** (1 / 3) * (2 * f / (2 * f - 1)) ** 0.41
    f_c *= (1 + u ** (10 / 3)) ** -0.3
    size = d**1.8 if d <= 25.4 else 3.647 * d**1.4
    return 1.3 * f_c * (i * cosine) ** 0.7 * z ** (2 / 3) * size


def _axial_rating(bearing: Bearing) -> float:
    """Return the basic dynamic axial load rating C_a of a thrust bearing at 90 degrees, N."""
    d, z, share = 1e3 * bearing.element_diameter, bearing.elements, bearing.element_diameter / bearing.pitch_diameter
    if bearing.rollers:
        return 293.3 * share ** (2 / 9) * (1e3 * bearing.roller_length) ** (7 / 9) * z**0.75 * d ** (29 / 27)
    size = d**1.8 if d <= 25.4 else 3.647 * d**1.4
    return 1.3 * 146.1 * share**0.3 * z ** (2 / 3) * size


def roller_length_for(bearing: Bearing) -> Bearing:
    """Return a roller bearing with the effective length that gives its ``dynamic_rating`` by ISO 281.

    The rating grows with the length to the 7/9, so the length follows from it, from number and diameter.
    """
    require(bearing.rollers, f"a {bearing.kind} bearing has no rollers whose length could follow from its rating")
    require(bearing.dynamic_rating is not None, "Bearing.dynamic_rating is missing; give the maker's")
    length = bearing.roller_length * (bearing.dynamic_rating / dynamic_rating(bearing)) ** (9.0 / 7.0)
    return bearing.changed(roller_length=length)


def static_rating(bearing: Bearing) -> float:
    """Return the basic static radial load rating C_0 by ISO 76, N."""
    g, z, cosine = bearing.ratio, KINDS[bearing.kind].rated_rows * bearing.elements, math.cos(bearing.contact_angle)
    if KINDS[bearing.kind].axial:
        if bearing.rollers:
            return 220.0 * z * 1e6 * bearing.roller_length * bearing.element_diameter
        return z * groove_contact(bearing.element_diameter, THRUST_GROOVE, 0.0).force_at(PRESSURE)
    if bearing.rollers:
        return 44.0 * (1 - g) * z * 1e6 * bearing.roller_length * bearing.element_diameter * cosine
    if bearing.on_sphere:
        sphere = groove_contact(bearing.element_diameter, sphere_curvature(g), -g / (1 + g))
        return sphere.force_at(SPHERE_PRESSURE) * z * cosine / 5.0
    contact = groove_contact(bearing.element_diameter, STANDARD_GROOVE, g / (1 - g))
    return contact.force_at(PRESSURE) * z * cosine / 5.0


def load_factors(bearing: Bearing, radial: float, axial: float) -> tuple[float, float]:
    """Return X and Y of P = X F_r + Y F_a by ISO 281; below F_a = e F_r X is 1, and Y is 0 of single rows.

    Raises
    ------
    BearingError
        For cylindrical rollers under axial load, and contact angles outside the standard's table.
    """
    x, y = _factors(bearing, abs(radial), abs(axial))
    return float(x), float(y)


def _factors(bearing: Bearing, radial: Loads, axial: Loads) -> tuple[np.ndarray, np.ndarray]:
    """Return X and Y of loads that are not negative; see `load_factors`."""
    e, x, y, *below = KINDS[bearing.kind].load_factors(bearing, radial, axial)
    # e is infinite of rollers that carry no axial load, which need not have a radial one
    with np.errstate(invalid="ignore"):
        is_below = axial <= np.multiply(e, radial)
    return np.where(is_below, 1.0, x), np.where(is_below, below[0] if below else 0.0, y)


ROUNDS = 8
"""Passes over axial loads that e of small contact angles depends on: it goes with their power 0.2, so to 1e-5."""


def induced_thrust(bearing: Bearing, radial: float, axial: float = 0.0) -> float:
    """Return the axial load that a radial one induces in a bearing that carries one way, N.

    F_r/(2 Y) of tapered rollers, e F_r of balls, as makers' catalogues have it; zero of other kinds.

    Parameters
    ----------
    radial, axial : float
        N; of contact angles below 20 degrees e depends on the axial load.
    """
    if KINDS[bearing.kind].thrust != "one way" or KINDS[bearing.kind].axial:
        return 0.0
    e, _, y = map(float, KINDS[bearing.kind].load_factors(bearing, abs(radial), abs(axial))[:3])
    return abs(radial) / (2.0 * y) if bearing.rollers else e * abs(radial)


def paired_thrust(first: Bearing, second: Bearing, radial: tuple[float, float], outer: float) -> tuple[float, float]:
    """Return the axial loads of two bearings that hold a shaft one way each, N.

    Each carries at least the thrust S that its own radial load induces, and the other one's with what pushes the shaft
    towards it: F_a1 = max(S_1, S_2 + K), F_a2 = max(S_2, S_1 - K). Only so are both in contact over half of their
    elements, which the factors of the equivalent load presuppose.

    Parameters
    ----------
    first, second : Bearing
    radial : tuple of float
        Radial load of each, N.
    outer : float
        Axial load K on the shaft towards the side that the first one carries, N.
    """
    found = (0.0, 0.0)
    for _ in range(ROUNDS):
        one, two = induced_thrust(first, radial[0], found[0]), induced_thrust(second, radial[1], found[1])
        found = (max(one, two + outer), max(two, one - outer))
    return found


def _newtons(load: Quantity, name: str) -> Quantity:
    """Return a load as a number if it is a text with a unit, and as it is if not."""
    try:
        return to_si(load, "force", name) if isinstance(load, str) else load
    except ValueError as error:
        raise BearingError(str(error)) from None


def equivalent_load(bearing: Bearing, radial: Quantity, axial: Quantity = 0.0) -> float:
    """Return the dynamic equivalent radial load P = max(F_r, X F_r + Y F_a), N; signs of the loads do not count.

    Raises
    ------
    BearingError
        For loads that are not finite, and as `load_factors`.
    """
    radial, axial = _newtons(radial, "radial"), _newtons(axial, "axial")
    for name, value in (("radial", radial), ("axial", axial)):
        require(math.isfinite(value), f"{name} is {float(value)!r} N; give a finite load")
    radial, axial = abs(radial), abs(axial)
    x, y = load_factors(bearing, radial, axial)
    return max(radial, x * radial + y * axial)


def rating_life(bearing: Bearing, load: Quantity, *, reliability: float = 0.9, life_factor: float = 1.0) -> float:
    """Return the life in revolutions, L_na = a_1 a_ISO (C/P)^p 10^6, p = 3 for balls and 10/3 for rollers.

    Parameters
    ----------
    load : float or str
        Equivalent load P, N.
    reliability : float
        Share of bearings that reach it, 0.9 to 0.9995; a_1 is the standard's from 95 % up.
    life_factor : float
        a_ISO, for lubrication and cleanliness.

    Raises
    ------
    BearingError
        For a load or life factor that is not positive and finite, and another reliability.
    """
    load = _newtons(load, "load")
    require(0.0 < load < math.inf, f"load is {load!r} N; give a positive equivalent load")
    require(
        0.0 < life_factor < math.inf, f"life_factor is {life_factor!r}; give a positive a_ISO, 1 if it is not known"
    )
    shares = (0.9, 0.95, 0.96, 0.97, 0.98, 0.99, 0.992, 0.994, 0.996, 0.998, 0.999, 0.9992, 0.9994, 0.9995)
    factors = (1.0, 0.64, 0.55, 0.47, 0.37, 0.25, 0.22, 0.19, 0.16, 0.12, 0.093, 0.087, 0.080, 0.077)
    told = isinstance(reliability, Real) and not isinstance(reliability, bool)
    require(told and shares[0] <= reliability <= shares[-1], f"reliability is {reliability!r}; give 0.9 up to 0.9995")
    a_1 = float(np.interp(reliability, shares, factors))
    return a_1 * life_factor * 1e6 * (bearing.rating / load) ** life_exponent(bearing)


def life_exponent(bearing: Bearing) -> float:
    """Return p: 3 for balls, 10/3 for rollers."""
    return 10.0 / 3.0 if bearing.rollers else 3.0


def mean_load(
    bearing: Bearing, radial: np.ndarray, axial: np.ndarray | None = None, speed: np.ndarray | None = None
) -> float:
    """Return the constant load with the same life as loads over time, N.

    Parameters
    ----------
    radial, axial : ndarray, shape (m,)
        Loads at even instants, as a simulation gives them, N.
    speed : ndarray, shape (m,), optional
        Relative speed of the rings there; default constant.

    Raises
    ------
    BearingError
        For other lengths, none at all, values that are not finite, and speeds that are all zero.
    """
    radial = np.asarray(radial, dtype=float)
    axial = np.zeros_like(radial) if axial is None else np.asarray(axial, dtype=float)
    turns = np.ones_like(radial) if speed is None else np.abs(np.asarray(speed, dtype=float))
    for name, value in (("radial", radial), ("axial", axial), ("speed", turns)):
        require(
            value.ndim == 1 and value.shape == radial.shape and value.size > 0,
            f"{name} has the shape {value.shape} beside radial of {radial.shape}; give as many of each, from one up",
        )
        require(bool(np.isfinite(value).all()), f"{name} has values that are not finite; leave these instants out")
    require(bool(turns.any()), "speed is 0 throughout: a bearing at rest has no life in revolutions; see static_rating")
    p = life_exponent(bearing)
    across, along = np.abs(radial), np.abs(axial)
    x, y = _factors(bearing, across, along)
    loads = np.maximum(across, x * across + y * along)
    return float((np.sum(turns * loads**p) / np.sum(turns)) ** (1.0 / p))
