"""Force laws of the contact: normal pressure against penetration and its rate, friction against sliding speed."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel
from gearmbs.dae.equations.time_functions import smooth_step

LAW_HUNT_CROSSLEY = L.LAW_HUNT_CROSSLEY
FRICTION_ADAMS = L.FRICTION_ADAMS


@kernel
def normal_law(law, k, e, c, d, delta, rate):
    """Pressure per unit face width, its derivatives and the elastic energy density.

    IMPACT is the paper's eq. (10) and (11) with the damping acting on the penetration rate and no adhesion:
    ``p = max(0, k delta^e + c STEP(delta, 0, 0, d, 1) rate)``. The Hunt-Crossley law is
    ``p = max(0, k delta^e (1 + c rate))``. Linear and Hertz line contact are IMPACT with their own exponents.

    Parameters
    ----------
    law : int
        One of ``layout.LAW_*``.
    k, e, c, d : float
        Stiffness, exponent, damping and penetration of full damping, per unit face width.
    delta, rate : float
        Penetration, m, and its rate, m/s.

    Returns
    -------
    p, p_delta, p_rate, energy, p_elastic : float
    """
    if delta <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    elastic = k * delta if e == 1.0 else k * delta**e
    slope = e * elastic / delta
    energy = elastic * delta / (e + 1.0)
    if law == LAW_HUNT_CROSSLEY:
        factor = 1.0 + c * rate
        if factor <= 0.0:
            return 0.0, 0.0, 0.0, energy, elastic
        return elastic * factor, slope * factor, elastic * c, energy, elastic
    if delta >= d:
        step = 1.0
        step_slope = 0.0
    else:
        _, step, step_slope, _ = smooth_step(delta / d, 0)
        step_slope /= d
    p = elastic + c * step * rate
    if p <= 0.0:
        return 0.0, 0.0, 0.0, energy, elastic
    return p, slope + c * step_slope * rate, c * step, energy, elastic


@kernel
def friction_law(kind, mu_s, mu_d, v_s, v_d, speed):
    """Friction coefficient over sliding speed, and the derivative of that ratio over the speed.

    The ADAMS law rises as a cubic STEP from ``-mu_s`` at ``-v_s`` to ``mu_s`` at ``v_s`` and falls as a STEP to
    ``mu_d`` at ``v_d``. The smooth law is ``mu_d tanh(speed / v_s)``: no Stribeck peak, every derivative continuous.

    Returns
    -------
    ratio : float
        ``mu(speed) / speed``, finite at rest.
    ratio_slope : float
        ``(d ratio / d speed) / speed``, finite at rest.
    """
    if kind == FRICTION_ADAMS:
        if speed <= v_s:
            r = speed / v_s
            return 0.5 * mu_s * (3.0 - r * r) / v_s, -mu_s / v_s**3
        if speed >= v_d:
            return mu_d / speed, -mu_d / speed**3
        _, step, step_slope, _ = smooth_step((speed - v_s) / (v_d - v_s), 0)
        mu = mu_s + (mu_d - mu_s) * step
        slope = (mu_d - mu_s) * step_slope / (v_d - v_s)
        ratio = mu / speed
        return ratio, (slope - ratio) / (speed * speed)
    y = speed / v_s
    if y < 1e-2:
        y2 = y * y
        return mu_d / v_s * (1.0 - y2 / 3.0 + 2.0 * y2 * y2 / 15.0), mu_d / v_s**3 * (-2.0 / 3.0 + 8.0 * y2 / 15.0)
    t = np.tanh(y)
    ratio = mu_d * t / speed
    return ratio, (mu_d * (1.0 - t * t) / v_s - ratio) / (speed * speed)
