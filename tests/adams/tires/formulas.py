"""The Magic Formulas of 2002 and 1989 in plain Python, after the published equations."""

from __future__ import annotations

from collections import defaultdict
from math import asin, atan, copysign, cos, exp, hypot, pi, sin, sqrt, tan

from .files import COEFFICIENTS, A, B, C

P = defaultdict(float, COEFFICIENTS)
for _name in "LFZO LCX LEX LKX LHX LVX LGAX LCY LMUY LEY LHY LVY LRES LXAL LYKA LSGKP LSGAL LGYR LMX LVMX LMY".split():
    P.setdefault(_name, 1.0)
R0, KZ, FZ0, BREFF, DREFF, FREFF, VREF = 0.32, 2e5, 4000.0, 8.0, 0.25, 0.07, 15.0


def rolling_radius(fz: float) -> float:
    """Return the effective radius of a wheel that rolls freely."""
    rho = fz / KZ / (FZ0 / KZ)
    return R0 - FZ0 / KZ * (DREFF * atan(BREFF * rho) + FREFF * rho)


def curve(x: float, b: float, c: float, d: float, e: float) -> float:
    """Return D sin(C atan(B x - E (B x - atan B x)))."""
    return d * sin(c * atan(b * x - e * (b * x - atan(b * x))))


def hill(x: float, b: float, c: float, e: float) -> float:
    """Return cos(C atan(B x - E (B x - atan B x)))."""
    return cos(c * atan(b * x - e * (b * x - atan(b * x))))


def sgn(x: float) -> float:
    return float((x > 0) - (x < 0))


def relaxation(fz: float, gamma: float) -> tuple[float, float]:
    """Return both relaxation lengths."""
    d = (fz - FZ0) / FZ0
    x = fz * (P["PTX1"] + P["PTX2"] * d) * exp(-P["PTX3"] * d) * R0 / FZ0
    y = P["PTY1"] * sin(2 * atan(fz / (P["PTY2"] * FZ0))) * (1 - P["PKY3"] * abs(gamma)) * R0
    return x, y


def pac2002(kappa: float, alpha: float, gamma: float, fz: float, vx: float, combined: bool = True) -> dict[str, float]:
    """Return forces and moments at the point of contact, and the residual torque's stiffness."""
    d = (fz - FZ0) / FZ0
    gx, gy, gz = P["LGAX"] * gamma, P["LGAY"] * gamma, P["LGAZ"] * gamma
    mux = (P["PDX1"] + P["PDX2"] * d) * (1 - P["PDX3"] * gx**2) * P["LMUX"]
    kx = fz * (P["PKX1"] + P["PKX2"] * d) * exp(P["PKX3"] * d) * P["LKX"]
    cx, shx = P["PCX1"], P["PHX1"] + P["PHX2"] * d
    svx = fz * (P["PVX1"] + P["PVX2"] * d) * P["LMUX"]
    kappax = kappa + shx
    ex = min(1.0, (P["PEX1"] + P["PEX2"] * d + P["PEX3"] * d**2) * (1 - P["PEX4"] * sgn(kappax)))
    fx = curve(kappax, kx / (cx * mux * fz), cx, mux * fz, ex) + svx
    muy = (P["PDY1"] + P["PDY2"] * d) * (1 - P["PDY3"] * gy**2) * P["LMUY"]
    ky = P["PKY1"] * FZ0 * sin(2 * atan(fz / (P["PKY2"] * FZ0))) * (1 - P["PKY3"] * abs(gy)) * P["LKY"]
    cy = P["PCY1"]
    shy = P["PHY1"] + P["PHY2"] * d + P["PHY3"] * gy
    svy = fz * (P["PVY1"] + P["PVY2"] * d + (P["PVY3"] + P["PVY4"] * d) * gy) * P["LMUY"]
    alphay = alpha + shy
    ey = min(1.0, (P["PEY1"] + P["PEY2"] * d) * (1 - (P["PEY3"] + P["PEY4"] * gy) * sgn(alphay)))
    by = ky / (cy * muy * fz)
    fy = curve(alphay, by, cy, muy * fz, ey) + svy
    svyk = 0.0
    if combined:
        shift = P["RHX1"]
        b, c, e = P["RBX1"] * cos(atan(P["RBX2"] * kappa)), P["RCX1"], min(1.0, P["REX1"] + P["REX2"] * d)
        fx *= hill(alpha + shift, b, c, e) / hill(shift, b, c, e)
        shift = P["RHY1"] + P["RHY2"] * d
        b = P["RBY1"] * cos(atan(P["RBY2"] * (alpha - P["RBY3"])))
        c, e = P["RCY1"], min(1.0, P["REY1"] + P["REY2"] * d)
        peak = muy * fz * (P["RVY1"] + P["RVY2"] * d + P["RVY3"] * gamma) * cos(atan(P["RVY4"] * alpha))
        svyk = peak * sin(P["RVY5"] * atan(P["RVY6"] * kappa)) * P["LVYKA"]
        fy = fy * hill(kappa + shift, b, c, e) / hill(shift, b, c, e) + svyk
    alphat = alpha + P["QHZ1"] + P["QHZ2"] * d + (P["QHZ3"] + P["QHZ4"] * d) * gz
    alphar = alpha + shy + svy / ky
    stiff = P["LKY"] / P["LMUY"]
    bt = (P["QBZ1"] + P["QBZ2"] * d + P["QBZ3"] * d**2) * (1 + P["QBZ4"] * gz + P["QBZ5"] * abs(gz)) * stiff
    ct = P["QCZ1"]
    dt = fz * (P["QDZ1"] + P["QDZ2"] * d) * (1 + P["QDZ3"] * gz + P["QDZ4"] * gz**2) * R0 / FZ0 * P["LTR"]
    et = (P["QEZ1"] + P["QEZ2"] * d + P["QEZ3"] * d**2) * (
        1 + (P["QEZ4"] + P["QEZ5"] * gz) * 2 / pi * atan(bt * ct * alphat)
    )
    br = P["QBZ9"] * stiff + P["QBZ10"] * by * cy
    dr = fz * R0 * (P["QDZ6"] + P["QDZ7"] * d + (P["QDZ8"] + P["QDZ9"] * d) * gz) * P["LMUY"]
    if combined:
        alphat, alphar = (atan(hypot(tan(x), kx / ky * kappa)) * sgn(x) for x in (alphat, alphar))
    trail = dt * hill(alphat, bt, ct, min(1.0, et)) * cos(alpha)
    mz = -trail * (fy - svyk) + dr * cos(atan(br * alphar)) * cos(alpha)
    if combined:
        mz += R0 * (P["SSZ1"] + P["SSZ2"] * fy / FZ0 + (P["SSZ3"] + P["SSZ4"] * d) * gamma) * P["LS"] * fx
    mx = R0 * fz * (P["QSX1"] - P["QSX2"] * gamma + P["QSX3"] * fy / FZ0)
    v = vx / VREF
    my = -R0 * fz * (P["QSY1"] + P["QSY2"] * fx / FZ0 + P["QSY3"] * abs(v) + P["QSY4"] * v**4)
    return {"fx": fx, "fy": fy, "mx": mx, "my": my, "mz": mz}


def pac89(kappa: float, alpha: float, gamma: float, fz: float, combined: bool = True) -> dict[str, float]:
    """Return forces and moments at the point of contact: y to the left, z up; angles in radians, slip as a share."""
    f, a, g, k = fz / 1000, alpha * 180 / pi, gamma * 180 / pi, 100 * kappa
    dx, c = B[1] * f**2 + B[2] * f, B[0]
    b = (B[3] * f**2 + B[4] * f) * exp(-B[5] * f) / (c * dx)
    x = k + B[9] * f + B[10]
    fx = curve(x, b, c, dx, B[6] * f**2 + B[7] * f + B[8])
    dy, c = A[1] * f**2 + A[2] * f, A[0]
    b = A[3] * sin(2 * atan(f / A[4])) * (1 - A[5] * abs(g)) / (c * dy)
    y = a + A[9] * f + A[10] + A[8] * g
    fy = curve(y, b, c, dy, A[6] * f + A[7])
    dz, c = C[1] * f**2 + C[2] * f, C[0]
    b = (C[3] * f**2 + C[4] * f) * (1 - C[6] * abs(g)) * exp(-C[5] * f) / (c * dz)
    z = a + C[11] * g + C[12] * f + C[13]
    mz = curve(z, b, c, dz, (C[7] * f**2 + C[8] * f + C[9]) * (1 - C[10] * abs(g)))
    mz += (C[14] * f**2 + C[15] * f) * g + C[16] * f + C[17]
    if combined:
        # the manual's way: by the angle of both slips
        beta = pi / 2 - asin(abs(x / 100) / hypot(x / 100, sin(y * pi / 180)))
        actual, most = (abs(fx) / fz, abs(fy) / fz), (dx / fz, dy / fz)
        mux = 1 / hypot(1 / actual[0], tan(beta) / most[1])
        muy = tan(beta) / sqrt(1 / most[0] ** 2 + (tan(beta) / actual[1]) ** 2)
        fx, fy = copysign(mux * fz, fx), copysign(muy * fz, fy)
    fy += A[11] * f * g + A[12] * f + A[13]
    moved = fy / 190e3
    return {"fx": fx, "fy": -fy, "mx": -fz * moved, "my": -0.01 * fz, "mz": -(mz + fx * moved)}
