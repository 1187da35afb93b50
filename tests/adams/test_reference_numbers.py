"""Small decks in the style of Project Chrono's, with single numbers of MSC ADAMS's tables for them.

Source: data/testing/joints of Project Chrono (BSD-3), files <case>_ADAMS_<kind>.txt, rows at 1, 2.5 and 5 s. The
numbers have six digits: half a unit of the last is added to the bounds 1e-5 for positions and velocities, 1e-6 for
Euler parameters, 1e-3 for accelerations and forces. Two tables are farther off, and `test_cases.py` shows why:
Spherical_Case01 comes from a run that lost energy, and the accelerations of Distance_Case01 contradict its positions.
"""

from __future__ import annotations

import numpy as np
import pytest

from .test_run import run

HEAD = """\
ADAMS/View model name: test_{name}
UNITS/
, FORCE = NEWTON
, MASS = KILOGRAM
, LENGTH = METER
, TIME = SECOND
PART/01, GROUND
MARKER/0101, PART = 01
MARKER/0102, PART = 01
, QP = {joint}, REULER = {angles}
PART/02, MASS = 1
, CM = 0201, IP = 0.04, 0.1, 0.1
MARKER/0201, PART = 02
, QP = {cm}, REULER = {angles}
MARKER/0202, PART = 02
, QP = {own}, REULER = {angles}
{element}
ACCGRAV/
, KGRAV = -9.80665
REQUEST/01, D,I=0201,J=0101,C=DISPLACEMENT: X Y Z PSI THETA PHI (body-fixed-3-1-3)
REQUEST/02, V,I=0201,J=0101,C=VELOCITY X Y Z WX WY WZ
REQUEST/03, A,I=0201,J=0101,C=ACCELERATION X Y Z WDX WDY WDZ
REQUEST/04, F2=ORIENT(27,1,0201,0101)\\F3=ORIENT(27,2,0201,0101)\\F4=ORIENT(27,3,0201,0101),C=EULER PARAMETERS
{force}
END
"""
REACTION = "REQUEST/05, F2=JOINT(1,0,2,0)\\F3=JOINT(1,0,3,0)\\F4=JOINT(1,0,4,0),C=RForce X Y Z"
TILTED = {"joint": "1,2,3", "cm": "3,2,3", "own": "1,2,3", "angles": "180D,45D,180D", "force": REACTION}
SPRING = "SFORCE/1\n, TRANSLATIONAL\n, I = 0102\n, J = 0202\n"
SPRING += ", FUNCTION = - 100.0*(dm(102,202)-2.0)\n, - 5.0*vr(102,202)"
TWIST = "JOINT/1, REVOLUTE\n, I = 0102, J = 0202\nSFORCE/1\n, ROTATIONAL\n, I = 0102\n, J = 0202\n"
TWIST += ", FUNCTION = - 200.0*az(102,202)\n, - 10.0*wz(102,202,202)"

CASES = {
    # case: (deck, {(kind, second): three numbers})
    "Cylindrical_Case03": (
        TILTED | {"element": "JOINT/1, CYLINDRICAL\n, I = 0102, J = 0202"},
        {
            ("Pos", 1): (1.0421, 0.962238, -0.865563), ("Pos", 5): (1.20996, -57.8852, -59.698),
            ("Vel", 1): (-5.20028, -4.8259, -4.98075), ("Vel", 5): (-5.15895, -24.1315, -24.9017),
            ("Force", 1): (0.427153, 14.4646, -14.4646), ("Force", 5): (2.11887, 14.3128, -14.3128),
        },
    ),
    "Prismatic_Case02": (
        TILTED | {"element": "JOINT/1, TRANSLATIONAL\n, I = 0102, J = 0202"},
        {
            ("Pos", 1): (3, -0.451662, 0.548338), ("Pos", 5): (3, -59.2916, -58.2916),
            ("Vel", 5): (0, -24.5166, -24.5166), ("Force", 5): (0, 4.90332, -4.90332),
        },
    ),
    "Spherical_Case02": (
        TILTED | {"element": "JOINT/1, SPHERICAL\n, I = 0102, J = 0202"},
        {
            ("Pos", 1): (0.107619, 2, 1.21012), ("Pos", 5): (-0.999684, 2, 2.96444),
            ("Vel", 1): (-5.23742, 0, 2.61123), ("Force", 1): (-11.4613, 0, -23.2273),
        },
    ),
    "Distance_Case03": (
        {"joint": "0,0,0", "cm": "0,4,0", "own": "0,2,0", "angles": "-90D,0D,0D",
         "element": "GCON/1\n, I = 0102, FUNCTION = DM(0202,0102)-2", "force": "REQUEST/05, F,I=0102,J=0202,RM=0101"},
        {
            ("Pos", 1): (0, 1.588488, -3.670108), ("Pos", 5): (0, 3.955759, -0.3015866),
            ("Vel", 1): (0, -7.766789, -3.27445), ("Force", 1): (0, 11.79422, -25.75644),
        },
    ),
    "TranSpring_Case02": (
        {"joint": "0,0,0", "cm": "0,2,0", "own": "0,2,0", "angles": "0D,0D,0D", "element": SPRING,
         "force": "REQUEST/05, F2=FX(102,202)\\F3=FY(102,202)\\F4=FZ(102,202)"},
        {
            ("Pos", 1): (0, -0.5973274, -2.189069), ("Pos", 5): (0, -1.945198, -0.767401),
            ("Vel", 1): (0, -5.641611, 1.647013), ("Force", 1): (0, -6.94731, -25.4603),
        },
    ),
    "RotSpring_Case01": (
        {"joint": "0,0,0", "cm": "2,0,0", "own": "0,0,0", "angles": "180D,90D,180D", "element": TWIST,
         "force": "REQUEST/05, F2=SFORCE(1,0,6,101)\\F3=SFORCE(1,0,7,101)\\F4=SFORCE(1,0,8,101)"},
        {
            ("Pos", 1): (1.994921, 0, -0.1424453), ("Pos", 5): (1.990439, 0, -0.1953254),
            ("Vel", 1): (-0.01711886, 0, -0.2397465), ("Force", 1): (0, 15.45839, 0), ("Force", 5): (0, 19.5638, 0),
        },
    ),
    "Revolute_Case01": (
        {"joint": "0,0,0", "cm": "2,0,0", "own": "0,0,0", "angles": "180D,90D,180D", "force": REACTION,
         "element": "JOINT/1, REVOLUTE\n, I = 0102, J = 0202"},
        {
            ("Pos", 1): (-0.892381, 0, -1.78988), ("Pos", 2.5): (-0.265506, 0, -1.9823),
            ("Pos", 5): (-1.99968, 0, -0.0355587), ("Vel", 1): (-5.23742, 0, 2.61123),
            ("Vel", 2.5): (6.10431, 0, -0.817604), ("Vel", 5): (-0.0146657, 0, 0.824742),
            ("Quat", 1): (0.372092, -0.372092, 0.601288), ("Quat", 5): (0.00628621, -0.00628621, 0.707079),
            ("Acc", 1): (11.4612, 0, 13.4207), ("Acc", 5): (0.510225, 0, -9.55839),
            ("Force", 1): (-11.4612, 0, -23.2273), ("Force", 2.5): (-3.77661, 0, -28.4357),
            ("Force", 5): (-0.510225, 0, -0.248259),
        },
    ),
    "Distance_Case01": (
        {"joint": "0,0,0", "cm": "0,2,0", "own": "0,2,0", "angles": "0D,0D,0D",
         "element": "GCON/1\n, I = 0102, FUNCTION = DM(0202,0102)-2", "force": "REQUEST/05, F,I=0102,J=0202,RM=0101"},
        {
            ("Pos", 1): (0, -0.956545, -1.756423), ("Pos", 2.5): (0, -0.07453383, -1.998611),
            ("Pos", 5): (0, -1.999998, -0.002779575), ("Vel", 1): (0, -5.154529, 2.807148),
            ("Vel", 2.5): (0, 6.256589, -0.2333259), ("Acc", 1): (0, 12.35703, 12.88352),
            ("Force", 1): (0, -12.35703, -22.69017), ("Force", 2.5): (0, -1.095646, -29.37955),
        },
    ),
    "Spherical_Case01": (
        {"joint": "0,0,0", "cm": "2,0,0", "own": "0,0,0", "angles": "0D,0D,0D", "force": REACTION,
         "element": "JOINT/1, SPHERICAL\n, I = 0102, J = 0202"},
        {
            ("Pos", 1): (-0.892369, 0, -1.78988), ("Pos", 5): (-1.99967, 0, -0.0361929),
            ("Vel", 1): (-5.23737, 0, 2.61106), ("Quat", 1): (0.52622, 0, 0.850348),
            ("Acc", 1): (11.4609, 0, 13.4204), ("Force", 1): (-11.4609, 0, -23.227),
            ("Force", 5): (-0.511671, 0, -0.248448),
        },
    ),
}  # fmt: skip
REQUESTS = {"Pos": 1, "Vel": 2, "Acc": 3, "Quat": 4, "Force": 5}
BOUNDS = {"Pos": 1e-5, "Vel": 1e-5, "Quat": 1e-6, "Acc": 1e-3, "Force": 1e-3}
LOOSE = {
    "Spherical_Case01": {"Pos": 3e-3, "Vel": 3e-3, "Quat": 3e-4, "Acc": 2e-2, "Force": 2e-2},
    "Distance_Case01": BOUNDS | {"Acc": 1.5e-3, "Force": 1.5e-3},
}


@pytest.mark.parametrize("case", list(CASES))
def test_numbers_of_adams(case):
    deck, numbers = CASES[case]
    result = run(HEAD.format(name=case, **deck), 5.0, 500)
    for (kind, second), values in numbers.items():
        ours = result.request(REQUESTS[kind])[round(100 * second), 1:4]
        largest = np.abs(values)
        digits = 5e-6 * 10.0 ** np.floor(np.log10(np.maximum(largest, 1e-30)))
        bound = digits + LOOSE.get(case, BOUNDS)[kind]
        assert np.all(np.abs(ours - values) <= bound), (kind, second, ours, values)
