"""Derivatives of springs from definitions, against complex steps of the same laws along variations of two frames."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gearmbs.mechanism.forces import derived as D

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
