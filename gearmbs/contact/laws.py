"""Force laws of the contact: normal pressure by penetration and its rate; friction by speed.

IMPACT, eq. (10) and (11), and its friction are `gearmbs.dae.equations.loads.forces`.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.law_kinds import LAW_HUNT_CROSSLEY, LAW_IMPACT, LAW_KUWABARA_KONO
from gearmbs.contact.records import inlined, kernel
from gearmbs.dae.equations.loads.forces import friction_over_speed, impact, stored_energy

FRICTION_ADAMS = L.FRICTION_ADAMS
MANTISSA = 52  # bits of a double's fraction
ROOT_HALF = 0x3FE6A09E667F3BCD  # bits of the square root of a half
BIAS = 1023
LOG_2, LOG_2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10  # the first has zeros at its end
ODD = tuple(2.0 / (2 * i + 1) for i in range(11))  # series of the logarithm
INVERSE = (1.0, 1.0, 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040, 1 / 40320, 1 / 362880, 1 / 3628800, 1 / 39916800)
LAST_INVERSE = 1 / 479001600


@inlined
def power(x, e):
    """``x`` to the power ``e`` for a positive normal ``x``, without branches: loops that call it become vectors.

    The logarithm's series runs in ``(m - 1) / (m + 1)`` with the mantissa between the roots of 1/2 and 2, the
    exponential's within half a binary place. Good to about ten units in the last place for the exponents of contact
    laws.
    """
    bits = np.float64(x).view(np.int64)
    n = (bits - np.int64(ROOT_HALF)) >> np.int64(MANTISSA)
    m = np.int64(bits - (n << np.int64(MANTISSA))).view(np.float64)
    t = (m - 1.0) / (m + 1.0)
    u = t * t
    v = u * u
    even = ODD[0] + v * (ODD[2] + v * (ODD[4] + v * (ODD[6] + v * (ODD[8] + v * ODD[10]))))
    odd = ODD[1] + v * (ODD[3] + v * (ODD[5] + v * (ODD[7] + v * ODD[9])))
    y = e * (n * LOG_2 + (t * (even + u * odd) + n * LOG_2_LOW))
    k = max(np.rint(y / (LOG_2 + LOG_2_LOW)), 1.0 - BIAS)
    r = (y - k * LOG_2) - k * LOG_2_LOW
    s = r * r
    even = INVERSE[0] + s * (INVERSE[2] + s * (INVERSE[4] + s * (INVERSE[6] + s * (INVERSE[8] + s * INVERSE[10]))))
    odd = INVERSE[1] + s * (INVERSE[3] + s * (INVERSE[5] + s * (INVERSE[7] + s * (INVERSE[9] + s * INVERSE[11]))))
    scale = np.int64((np.int64(k) + np.int64(BIAS)) << np.int64(MANTISSA)).view(np.float64)
    return (even + (r * odd + s * s * s * s * s * s * LAST_INVERSE)) * scale


@inlined
def elastic_pressure(k, e, delta):
    """Elastic part of the pressure at a positive penetration: the same of all laws."""
    return k * delta if e == 1.0 else k * delta**e


@inlined
def damping_of_share(law, c, share):
    """Return the damping where a share of the stiffness is at work: a force goes with it, a factor on one does not."""
    return share * c if law == LAW_IMPACT else c


@inlined
def pressure(law, elastic, e, c, d, delta, rate):
    """Pressure per unit face width and its derivatives at a positive penetration from its elastic part.

    Parameters and results are those of `normal_law`; ``elastic`` is ``k delta^e``.
    """
    slope = e * elastic / delta
    energy = stored_energy(elastic, e, delta)
    if law == LAW_HUNT_CROSSLEY:
        factor = 1.0 + c * rate
        pushes = elastic * factor > 0.0
        p = elastic * factor if pushes else 0.0
        p_delta = slope * factor if pushes else 0.0
        p_rate = elastic * c if pushes else 0.0
    elif law == LAW_KUWABARA_KONO:
        damped = elastic + c * slope * rate
        pushes = damped > 0.0
        p = damped if pushes else 0.0
        p_delta = slope + c * (e - 1.0) * slope / delta * rate if pushes else 0.0
        p_rate = c * slope if pushes else 0.0
    else:
        p, p_delta, p_rate = impact(elastic, slope, c, d, delta, rate)
    return p, p_delta, p_rate, energy, elastic


@kernel
def normal_law(law, k, e, c, d, delta, rate):
    """Pressure per unit face width, its derivatives and the elastic energy density.

    IMPACT is the paper's eq. (10) and (11) with the damping acting on the penetration rate and no adhesion:
    ``p = max(0, k delta^e + c STEP(delta, 0, 0, d, 1) rate)``. The Hunt-Crossley law is
    ``p = max(0, k delta^e (1 + c rate))``, that of Kuwabara and Kono ``p = max(0, k delta^e + c d(k delta^e)/dt)``.
    Linear and Hertz line contact are IMPACT with their own exponents.

    Parameters
    ----------
    law : int
        One of ``law_kinds.LAW_*``.
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
    return pressure(law, elastic_pressure(k, e, delta), e, c, d, delta, rate)


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
        return friction_over_speed(mu_s, mu_d, v_s, v_d, speed)
    y = speed / v_s
    if y < 1e-2:
        y2 = y * y
        return mu_d / v_s * (1.0 - y2 / 3.0 + 2.0 * y2 * y2 / 15.0), mu_d / v_s**3 * (-2.0 / 3.0 + 8.0 * y2 / 15.0)
    t = np.tanh(y)
    ratio = mu_d * t / speed
    return ratio, (mu_d * (1.0 - t * t) / v_s - ratio) / (speed * speed)
