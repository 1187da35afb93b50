"""Derivatives of springs from definitions, against complex steps of the same laws along variations of two frames."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.forces import derived as D
from tests.says import says

STEP = 1e-30
LAW = np.array([120.0, 3.0, 0.4, 2.0])


def frames(seed):
    rng = np.random.default_rng(seed)
    axes = Rotation.random(2, random_state=seed).as_matrix()
    return [np.array([*rng.normal(size=3), *a.ravel(), *rng.normal(size=6)], dtype=complex) for a in axes]


def varied(pair, column):
    """Return the frames after a complex step along one of the 24 variations."""
    new = [frame.copy() for frame in pair]
    frame, (kind, axis) = new[column // 12], divmod(column % 12, 3)
    if kind == 1:
        axes = frame[3:12].reshape(3, 3)
        frame[3:12] += 1j * STEP * np.cross(np.eye(3)[axis], axes, axisb=0, axisc=0).ravel()
    else:
        frame[{0: 0, 2: 12, 3: 15}[kind] + axis] += 1j * STEP
    return new


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ["line", "axis", "shifts"])
def test_derivatives_by_complex_steps(name, seed):
    pair, gradient = frames(seed), np.array([0.3, -0.8, 0.5])
    real = [frame.real.copy() for frame in pair]
    slopes = np.zeros((9, 24))
    if name == "shifts":
        D.shift_slopes.py_func(*real, slopes)
    elif name == "line":
        D.line_slopes.py_func(*real, LAW, slopes)
    else:
        D.axis_slopes.py_func(*real, LAW, 0.7, *gradient, slopes)
    for column in range(24):
        new = varied(pair, column)
        seen, wrench = np.zeros(9, dtype=complex), np.zeros((1, 6), dtype=complex)
        if name == "shifts":
            D.shifts.py_func(*new, seen)
        elif name == "line":
            D.line_load.py_func(*new, LAW, wrench)
            seen[:6] = wrench[0]
        else:
            kind, axis = divmod(column % 12, 3)
            turned = (1.0 if column < 12 else -1.0) * gradient[axis] if kind == 1 else 0.0
            D.axis_load.py_func(*new, LAW, 0.7 + 1j * STEP * turned, wrench)
            seen[:6] = wrench[0]
        assert slopes[:, column] == pytest.approx(seen.imag / STEP, rel=1e-10, abs=1e-12 * np.abs(slopes).max())


def elements():
    m = Mechanism("springs")
    body = m.body("b", mass=1.0, inertia=(1, 1, 1))
    i, j = body.marker(), m.ground.marker()
    yield m.spring_damper("line", i, j, stiffness=120.0, damping=3.0, length=0.4, preload=2.0)
    yield m.torsion_spring("axis", i, j, stiffness=12.0, damping=0.3, angle=0.2, preload=0.7)
    yield m.bushing("bushing", i, j, stiffness=(10, 20, 30), damping=(1, 2, 3), torsional_stiffness=(4, 5, 6))


@pytest.mark.parametrize("element", list(elements()), ids=lambda element: element.name)
def test_loads_by_their_numbers(element):
    """A load is linear in each of its numbers, but for the product of stiffness and free length."""
    rows = np.array([frame.real for frame in frames(4)])
    rows[0, 3:12] = Rotation.from_rotvec((0.1, -0.2, 0.3)).as_matrix().ravel()
    rows[1, 3:12] = np.eye(3).ravel()
    made = element.compiled()
    inputs = np.zeros(len(made.angles))

    def load(reals):
        wrench, work = np.zeros((1, 6)), np.zeros(made.scratch)
        made.kernel(
            np.array(made.integers, dtype=np.int64), reals, 0.0, rows, np.zeros(0), inputs, 0, work, wrench,
            np.zeros(0), np.zeros((6, 24)), np.zeros(0),
        )  # fmt: skip
        return wrench[0]

    assert made.settings
    for name, setting in made.settings.items():
        sides = []
        for sign in (1.0, -1.0):
            reals = np.array(made.reals, dtype=float)
            reals[setting.at] += 0.5 * sign
            sides.append(load(reals))
        exact = element.by_parameter(name, rows, inputs=inputs)
        assert exact == pytest.approx(sides[0] - sides[1], rel=1e-10, abs=1e-12)
        assert np.abs(exact).max() > 0.0
    with pytest.raises(ModelError, match=says(element.name, "mass", *made.settings)):
        element.by_parameter("mass", rows)


def test_elements_without_derivatives_by_numbers_say_so():
    m = Mechanism("motor")
    torque = m.torque("drive", m.body("b", mass=1.0, inertia=(1, 1, 1)).marker(), 3.0)
    with pytest.raises(ModelError, match=says("drive", "parameters", "differences")):
        torque.by_parameter("torque", np.zeros((1, 18)))
