"""The mechanisms of the benchmark problems, built with the public calls of `gearmbs.mechanism`.

Definitions: Library of Computational Benchmark Problems, IFToMM Technical Committee for Multibody Dynamics,
https://www.iftomm-multibody.org/benchmark; F. Gonzalez, D. Dopico, U. Lugris, J. Cuadrado: A benchmarking system for
MBS simulation software. Multibody System Dynamics 16 (2006) 179-190. All lengths in m, masses in kg.
"""

from __future__ import annotations

import numpy as np

from gearmbs.mechanism import Mechanism, polynomial
from gearmbs.mechanism.parts.quantities import frame_along

GRAVITY = 9.81
"""m/s^2, as the problems of the IFToMM library state it."""


def pendulum() -> Mechanism:
    """A01: a point mass of 1 kg on a massless bar of 1 m, released horizontally."""
    m = Mechanism("A01 simple pendulum", gravity=(0, -GRAVITY, 0))
    mass = m.body("mass", 1.0, (0, 0, 0), position=(-1, 0, 0))
    m.revolute("pin", mass, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    return m


def four_bars(loops: int = 2) -> Mechanism:
    """A02: ``loops`` four-bar windows of equal links (1 m, 1 kg, slender); the tops start with 1 m/s.

    All cranks are parallel; when they lie flat, every window may fold or stay a parallelogram.
    """
    m = Mechanism(f"A02 {loops}-four-bar mechanism", gravity=(0, -GRAVITY, 0))
    slender = (0.0, 1.0 / 12.0, 1.0 / 12.0)
    upright = frame_along((0, 0, 1), x_hint=(0, 1, 0))
    cranks = []
    for k in range(loops + 1):
        crank = m.body(
            f"crank {k}", 1.0, slender, position=(k, 0.5, 0), orientation=upright,
            velocity=(0.5, 0, 0), angular_velocity=(0, 0, -1),
        )  # fmt: skip
        m.revolute(f"A{k}", crank, m.ground, at=(k, 0, 0), axis=(0, 0, 1))
        cranks.append(crank)
    for k in range(loops):
        coupler = m.body(f"coupler {k + 1}", 1.0, slender, position=(k + 0.5, 1, 0), velocity=(1, 0, 0))
        m.revolute(f"B{k} left", coupler, cranks[k], at=(k, 1, 0), axis=(0, 0, 1))
        m.revolute(f"B{k + 1} right", coupler, cranks[k + 1], at=(k + 1, 1, 0), axis=(0, 0, 1))
    return m


ANDREWS_ANGLES = np.array(
    [-0.0617138900142764496, 0.0, 0.455279819163070380256, 0.222668390165885884675,
     0.487364979543842550226, -0.222668390165885884675, 1.23054744454982119250]
)  # fmt: skip
"""Initial beta, Theta, gamma, Phi, delta, Omega, epsilon of the test set."""


def andrews() -> Mechanism:
    """A03: Andrews' squeezing mechanism, seven bodies in a plane, driven by a motor of 0.033 N m, on a spring.

    Data of the equivalent problem in F. Mazzia, C. Magherini: Test Set for Initial Value Problem Solvers, release 2.4
    (2008); angles beta, Theta, gamma ... as there.
    """
    beta, theta, gamma, phi, delta, omega, epsilon = ANDREWS_ANGLES
    o, a, b, c = (np.array(p) for p in ((0, 0), (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)))
    m = Mechanism("A03 Andrews' squeezer")

    def bar(name: str, mass: float, inertia: float, origin: np.ndarray, angle: float, com: tuple[float, float]):
        axes = frame_along((0, 0, 1), x_hint=(np.cos(angle), np.sin(angle), 0))
        return m.body(
            name, mass, (inertia, inertia, inertia), com=(*com, 0), position=(*origin, 0), orientation=axes
        )  # fmt: skip

    def turned(angle: float, x: float, y: float) -> np.ndarray:
        return np.array([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y])

    f, g, h = turned(beta, 0.007, 0), a + turned(delta, 0.04, 0), a + turned(epsilon, 0, -0.04)
    e = f - turned(beta + theta, 0.028, 0)
    k1 = bar("K1", 0.04325, 2.194e-6, o, beta, (0.00092, 0))
    k2 = bar("K2", 0.00365, 4.410e-7, f, beta + theta, (-0.0115, 0))
    k3 = bar("K3", 0.02373, 5.255e-6, b, gamma, (0.01043, -0.01874))
    k4 = bar("K4", 0.00706, 5.667e-7, g, phi + delta, (0, 0.01421 - 0.02))
    k5 = bar("K5", 0.07050, 1.169e-5, a, delta, (0.02308, 0.00916))
    k6 = bar("K6", 0.00706, 5.667e-7, h, omega + epsilon, (0.02 - 0.01421, 0))
    k7 = bar("K7", 0.05498, 1.912e-5, a, epsilon, (-0.00449, -0.01228))
    ground = m.ground
    pins = [("O", k1, ground, o), ("F", k2, k1, f), ("E2", k2, k3, e), ("B", k3, ground, b), ("E4", k4, k3, e)]
    pins += [("G", k4, k5, g), ("A5", k5, ground, a), ("E6", k6, k3, e), ("H", k6, k7, h), ("A7", k7, ground, a)]
    for name, i, j, place in pins:
        m.revolute(name, i, j, at=(*place, 0), axis=(0, 0, 1))
    corner, anchor = k3.marker((0.02, -0.018, 0), name="D"), m.ground.marker((*c, 0), name="C")
    m.spring_damper("spring", corner, anchor, stiffness=4530.0, length=0.07785)
    m.torque("motor", k1, 0.033)
    return m


def bricard() -> Mechanism:
    """A04: Bricard's linkage, five rods of 1 m and six revolute joints about the edges of a cube, from rest."""
    m = Mechanism("A04 Bricard's mechanism", gravity=(0, -GRAVITY, 0))
    points = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], dtype=float)
    axes = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]
    thick, long = 2 * 0.1**2 / 12, (1 + 0.1**2) / 12
    rods = []
    for k in range(5):
        direction = points[k + 1] - points[k]
        inertia = np.where(np.abs(direction) > 0.5, thick, long)
        rods.append(m.body(f"rod {k + 1}", 1.0, inertia, position=(points[k] + points[k + 1]) / 2))
    chain = [m.ground, *rods, m.ground]
    for k, (point, axis) in enumerate(zip(points, axes)):
        m.revolute(f"P{k + 1}", chain[k + 1], chain[k], at=point, axis=axis)
    rods[1].marker((0, -0.5, 0), name="P3")
    return m


DENSITY = 3000.0
"""Of rods and slider of the governor, kg/m^3, as the problem states it."""
ROD_MASS, BALL_MASS, SLIDER_MASS = DENSITY * 1e-4, 5.0, DENSITY * 1e-3
STIFFNESS, DAMPING, REST_LENGTH = 8e5, 4e4, 0.5


def governor() -> Mechanism:
    """A05: a flyball governor whose couplers are stiff springs with dampers; 2 pi rad/s, rods 30 degrees down."""
    m = Mechanism("A05 stiff flyball governor", gravity=(0, 0, -GRAVITY))
    spin = np.array([0, 0, 2 * np.pi])
    thick, long = ROD_MASS * 2 * 0.01**2 / 12, ROD_MASS * (1 + 0.01**2) / 12
    cube = SLIDER_MASS * 2 * 0.1**2 / 12
    shaft = m.body("shaft", ROD_MASS, (long, long, thick), position=(0, 0, 0.5), angular_velocity=spin)
    slider = m.body("slider", SLIDER_MASS, (cube,) * 3, position=(0, 0, 0.5), angular_velocity=spin)
    m.revolute("bearing", shaft, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.translational("guide", slider, shaft, at=(0, 0, 0.5), axis=(0, 0, 1))
    for side, name in ((1, "right"), (-1, "left")):
        top = np.array([0.05 * side, 0, 1])
        along = np.array([side * np.cos(np.pi / 6), 0, -np.sin(np.pi / 6)])
        # rod and ball are one body: the ball at the tip moves the centre of mass
        mass = ROD_MASS + BALL_MASS
        com = (0.5 * ROD_MASS + BALL_MASS) / mass
        about = long + ROD_MASS * (com - 0.5) ** 2 + BALL_MASS * (1 - com) ** 2
        axes = np.column_stack([along, (0, 1, 0), np.cross(along, (0, 1, 0))])
        rod = m.body(
            f"{name} rod", mass, (thick, about, about), com=(com, 0, 0), position=top, orientation=axes,
            velocity=np.cross(spin, top), angular_velocity=spin,
        )  # fmt: skip
        m.revolute(f"{name} pin", rod, shaft, at=top, axis=(0, 1, 0))
        eye, hook = rod.marker((0.5, 0, 0), name=f"{name} eye"), slider.marker((0.05 * side, 0, 0), name=f"{name} hook")
        m.spring_damper(f"{name} coupler", eye, hook, stiffness=STIFFNESS, damping=DAMPING, length=REST_LENGTH)
    return m


CRANK_CENTRE, CRANK, ROD = np.array([0.0, 0.1, 0.12]), 0.08, 0.3
CRANK_MASS, CONROD_MASS, BLOCK_MASS = 0.12, 0.5, 2.0
CRANK_INERTIA, CONROD_INERTIA = (1e-4, 1e-4, 1e-5), (4e-4, 4e-3, 4e-3)


def slider_crank() -> Mechanism:
    """Spatial rigid slider crank: crank about x at 6 rad/s, ball joint, rod, cross joint, slider along x.

    References
    ----------
    R. Masoudi's submission of the problem to the library; E. J. Haug: Computer Aided Kinematics and Dynamics of
    Mechanical Systems, Allyn and Bacon (1989), section 10.2.
    """
    driven = _slider_crank({}).compile()
    driven.initialise()
    # at the start the rates follow from the crank's
    rates = {name: (row[12:15], row[15:18]) for name, row in zip(driven.body_names, driven.pose)}
    return _slider_crank(rates)


def _slider_crank(rates: dict) -> Mechanism:
    """Build it with given velocities; without any, the crank is driven at 6 rad/s."""
    m = Mechanism("spatial slider crank", gravity=(0, 0, -GRAVITY))
    a, b = CRANK_CENTRE, CRANK_CENTRE + [0, 0, CRANK]
    c = np.array([np.sqrt(ROD**2 - b[1] ** 2 - b[2] ** 2), 0, 0])
    along = (c - b) / ROD
    arm = np.cross(along, (1, 0, 0))
    arm /= np.linalg.norm(arm)
    rest = (np.zeros(3), np.zeros(3))

    def part(name: str, mass: float, inertia, position: np.ndarray, axes: np.ndarray | None = None):
        v, w = rates.get(name, rest)
        return m.body(name, mass, inertia, position=position, orientation=axes, velocity=v, angular_velocity=w)

    crank = part("crank", CRANK_MASS, CRANK_INERTIA, (a + b) / 2)
    rod = part("rod", CONROD_MASS, CONROD_INERTIA, (b + c) / 2, np.column_stack([along, np.cross(arm, along), arm]))
    slider = part("slider", BLOCK_MASS, (1e-4,) * 3, c)
    pin = m.revolute("A", crank, m.ground, at=a, axis=(1, 0, 0))
    m.spherical("B", rod, crank, at=b)
    arms = (slider.marker_at(c, frame_along((1, 0, 0)), name="arm of slider"),
            rod.marker_at(c, frame_along(arm), name="arm of rod"))  # fmt: skip
    m.joint("universal", "C", *arms)
    m.translational("guide", slider, m.ground, at=c, axis=(1, 0, 0))
    if not rates:
        m.rotation("drive", pin, polynomial([0.0, 6.0]))
    return m
