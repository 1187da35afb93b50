"""The flexible slider crank of the Bari test set against its published solution.

Test Set for Initial Value Problem Solvers, release 2.4, problem "slider crank"; B. Simeon, Mathematical Modelling of
Systems 2 (1996) 1. The rod bends by two sines and stretches by a quadratic element of two nodes. The test set's mass
matrix of the stretching is fifteen times that of the element, which is kept here as the problem's own datum.
"""

import numpy as np
import scipy.linalg

from gearmbs.mechanism import Mechanism, Mode, ShapeIntegrals

CRANK, ROD = 0.15, 0.30
SPEED, DENSITY, SIDE, MODULUS = 150.0, 7870.0, 0.008, 0.20e12
ROD_MASS, ROD_INERTIA, BLOCK_MASS = 0.151104, 0.0045339259, 0.075552
START = np.array([0.0, 0.0, 0.103339863e-4, 0.169327969e-4])
START_RATE = np.array([0.444896105, 0.463434311e-2, -0.178591076e-5, -0.268938672e-5])
ROD_SPEED = -0.749957670e2
PUBLISHED = {
    "angle": -3.311734987910881e-01,
    "block": 1.697373326718410e-01,
    "rod speed": 6.025346682645789e01,
    "block speed": -8.753116989887888,
}
PUBLISHED_Q = np.array([1.893192460247178e-04, 2.375751865617931e-05, -5.323907988763734e-06, -8.363283141616840e-06])
PUBLISHED_RATES = np.array(
    [-3.005536801092212e-02, -5.500488291932075e-03, 4.978243404809343e-04, 1.104933470696396e-03]
)


def rod_data():
    """Mass, stiffness and the integrals c1, c2, c12, c21, B of the test set, times density."""
    whole, pi = DENSITY * SIDE**2 * ROD, np.pi
    stretch = MODULUS * SIDE**2 / ROD
    mass = whole * scipy.linalg.block_diag(0.5, 0.5, [[8.0, 1.0], [1.0, 2.0]])
    bend = pi**4 / 24 * (SIDE / ROD) ** 2
    stiffness = stretch * scipy.linalg.block_diag(bend, 16 * bend, [[16 / 3, -8 / 3], [-8 / 3, 7 / 3]])
    along = whole * np.array([0, 0, 2 / 3, 1 / 6])
    across = whole * np.array([2 / pi, 0, 0, 0])
    radial = whole * ROD * np.array([0, 0, 1 / 3, 1 / 6])
    moment = whole * ROD * np.array([1 / pi, -0.5 / pi, 0, 0])
    b = np.zeros((4, 4))
    b[0, 2], b[0, 3], b[1, 3] = -16 / pi**3, 8 / pi**3 - 1 / pi, 0.5 / pi
    return mass, stiffness, along, across, radial, moment, whole * (b - b.T)


def slider_crank():
    """The mechanism, its rod's place and the matrix from its modal coordinates to those of the test set."""
    mass, stiffness, along, across, radial, moment, b = rod_data()
    _, to_q = scipy.linalg.eigh(stiffness, mass)
    n, half = 4, ROD / 2
    angular, first, second, cross = np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros((n, n, 3, 3)), np.zeros((n, n, 3))
    angular[:, 2] = to_q.T @ (moment - half * across)
    first[:, 2, 2] = 2 * to_q.T @ (radial - half * along)
    second[:, :, 2, 2] = 2 * np.eye(n)
    cross[:, :, 2] = to_q.T @ b @ to_q
    momentum = np.column_stack([to_q.T @ along, to_q.T @ across, np.zeros(n)])
    integrals = ShapeIntegrals(np.eye(n), momentum, angular, cross, first, second)
    inverse = np.linalg.inv(to_q)
    stiff = np.diag(to_q.T @ stiffness @ to_q)
    modes = [Mode(stiffness=k, start=a, rate=v) for k, a, v in zip(stiff, inverse @ START, inverse @ START_RATE)]

    def shapes(place):
        """The ends only: nothing at the pin, the last node's stretching at the block."""
        moved = np.zeros((n, 3))
        if place[0] > half:
            moved[:, 0] = to_q[3]
        return moved, np.zeros((n, 3))

    m = Mechanism("slider crank")
    crank = m.body("crank", 0.36, (1e-4, 1e-4, 1e-4), position=(CRANK / 2, 0, 0), angular_velocity=(0, 0, SPEED),
                   velocity=(0, SPEED * CRANK / 2, 0))  # fmt: skip
    steady = ROD_INERTIA - ROD_MASS * half**2
    rod = m.modal_body(
        "rod", ROD_MASS, (1e-6 + steady, steady, steady), modes=modes, shapes=shapes, integrals=integrals,
        com=(half, 0, 0), position=(CRANK, 0, 0), velocity=(0, SPEED * CRANK, 0), angular_velocity=(0, 0, ROD_SPEED),
    )  # fmt: skip
    block = m.body("block", BLOCK_MASS, (1e-4,) * 3, position=(CRANK + ROD + START[3], 0, 0))
    m.rotation("drive", m.revolute("main", crank, m.ground, at=(0, 0, 0), axis=(0, 0, 1)), f"{SPEED}*TIME")
    pin, end = rod.marker((0, 0, 0), name="pin"), rod.marker((ROD, 0, 0), name="end")
    m.joint("revolute", "crank pin", pin, crank.marker((CRANK / 2, 0, 0), name="pin"))
    m.translational("guide", block, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    m.joint("spherical", "block pin", end, block.marker(name="pin"))
    return m, to_q


def end_of_run():
    """What is published of the end, and deflections and their rates."""
    m, to_q = slider_crank()
    found = m.simulate(0.1, rate=1000, tol=1e-9)
    assert found.success
    axis = found.orientation("rod")[-1][:, 0]
    at_end = {
        "angle": np.arctan2(axis[1], axis[0]),
        "block": found.com_position("block")[-1, 0],
        "rod speed": found.angular_velocity("rod")[-1, 2],
        "block speed": found.com_velocity("block")[-1, 0],
    }
    return at_end, to_q @ found.modal_coordinates("rod")[-1], to_q @ found.modal_velocities("rod")[-1]


def test_published_solution():
    at_end, q, rates = end_of_run()
    for name, value in at_end.items():
        np.testing.assert_allclose(value, PUBLISHED[name], rtol=1e-7, err_msg=name)
    # the start is published with nine digits, which the fast stretching keeps
    np.testing.assert_allclose(q, PUBLISHED_Q, rtol=2e-5)
    np.testing.assert_allclose(rates[:2], PUBLISHED_RATES[:2], rtol=1e-5)
    np.testing.assert_allclose(rates[2:], PUBLISHED_RATES[2:], rtol=1e-3)
