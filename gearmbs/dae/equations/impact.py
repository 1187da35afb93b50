"""IMPACT, eq. (10), with its STEP, eq. (11), and the friction that goes with it: laws of bodies that touch.

They have no branches, so that loops over many points that call them become vectors. Products may be contracted with
sums, and quotients become products with reciprocals.
"""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.equations.time_functions import cubic

CONTRACT = {"contract": True, "arcp": True}


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def impact(elastic, stiffness, damping, full_depth, depth, rate):
    """Return f = max(0, f_e + c STEP(d, 0, 0, d_max, 1) d'), f_e = k d^e, and its slopes by depth d and rate d'.

    Parameters
    ----------
    elastic, stiffness : float
        f_e, N, and its slope e f_e / d, N/m; or those of any other spring.
    damping, full_depth : float
        c, N s/m, and the depth of full damping d_max, m.
    depth, rate : float
        d > 0, m, and d', m/s.

    Returns
    -------
    force, by_depth, by_rate : float
    """
    ratio = min(depth / full_depth, 1.0)
    step, slope = cubic(ratio)
    force = elastic + damping * step * rate
    by_depth = stiffness + damping * (slope / full_depth) * rate
    pushes = force > 0.0
    return force if pushes else 0.0, by_depth if pushes else 0.0, damping * step if pushes else 0.0


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def stored_energy(elastic, exponent, depth):
    """Return the energy of the spring of `impact`, J."""
    return elastic * depth / (exponent + 1.0)


@njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)
def friction_over_speed(static, dynamic, stiction, transition, speed):
    """Return mu(v)/v, finite at rest, and its derivative by v over v.

    mu rises as a cubic STEP from -mu_s at -v_s to mu_s at v_s and falls as a STEP to mu_d at v_d.

    Parameters
    ----------
    static, dynamic : float
        mu_s, mu_d.
    stiction, transition : float
        Their speeds v_s < v_d, m/s.
    speed : float
        v >= 0, m/s.
    """
    r = speed / stiction
    stick = 0.5 * static * (3.0 - r * r) / stiction
    stick_slope = -static / (stiction * stiction * stiction)
    moving = max(speed, stiction)
    fall, slope = cubic(min((moving - stiction) / (transition - stiction), 1.0))
    ratio = (static + (dynamic - static) * fall) / moving
    ratio_slope = ((dynamic - static) * slope / (transition - stiction) - ratio) / (moving * moving)
    sticks = speed <= stiction
    return stick if sticks else ratio, stick_slope if sticks else ratio_slope
