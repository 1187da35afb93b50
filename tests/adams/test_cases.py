"""Project Chrono's four ADAMS decks with MSC ADAMS's own tables, where their folder is at hand.

Set GEARMBS_ADAMS_CASES to the folder with the .adm files and the tables; the numbers below are what was measured.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gearmbs.adams.run import run_deck

FOLDER = os.environ.get("GEARMBS_ADAMS_CASES")
pytestmark = pytest.mark.skipif(not FOLDER, reason="set GEARMBS_ADAMS_CASES to the folder of the ADAMS cases")

G = 9.80665
KINDS = {
    "Pos": (1, [1, 2, 3]), "Vel": (2, [1, 2, 3]), "Avel": (2, [5, 6, 7]), "Acc": (3, [1, 2, 3]),
    "Aacc": (3, [5, 6, 7]), "Quat": (4, [1, 2, 3, 5]), "Rforce": (5, [1, 2, 3]), "Rtorque": (5, [5, 6, 7]),
}  # fmt: skip
"""Table -> request and columns."""

BOUNDS = {
    "Revolute": dict.fromkeys(("Pos", "Vel", "Avel", "Quat"), 1e-5) | dict.fromkeys(("Acc", "Aacc", "Rforce"), 1e-3),
    # ADAMS's printed multipliers scatter: 1.35e-3 from what its own positions and velocities give
    "Distance": {"Pos": 1e-5, "Vel": 1e-5, "Avel": 1e-5, "Quat": 1e-5, "Acc": 1.5e-3, "Aacc": 1e-3, "Rforce": 1.5e-3},
    # the table loses 7.9e-3 J, which this pendulum cannot
    "Spherical": {
        "Pos": 1e-3,
        "Vel": 3e-3,
        "Avel": 1.5e-3,
        "Quat": 3e-4,
        "Acc": 1.5e-2,
        "Aacc": 3e-3,
        "Rforce": 1.5e-2,
    },
}


def table(case: str, kind: str) -> np.ndarray:
    return np.loadtxt(Path(FOLDER or ".") / f"{case}_Case01_ADAMS_{kind}.txt", skiprows=3)


def run(case: str, **options):
    end = table(case, "Pos")[-1, 0]
    return run_deck(Path(FOLDER or ".") / f"{case}_Case01.adm", end=end, steps=round(end / 0.01), **options)


@pytest.mark.parametrize("case", list(BOUNDS))
def test_deck_against_its_tables(case):
    result = run(case)
    assert result.success, result.messages
    for kind, bound in BOUNDS[case].items():
        number, columns = KINDS[kind]
        ours, theirs = result.request(number)[:, columns], table(case, kind)[:, 1:]
        off = np.abs(ours - theirs).max()
        print(f"{case} {kind}: largest deviation {off:.2e} of {np.abs(theirs).max():.3g}")
        assert off < bound


@pytest.mark.parametrize("case", ["Revolute", "Spherical"])
def test_deck_against_its_equation(case):
    """(I + m L^2) a'' = m g L cos a; both decks are this pendulum."""
    result = run(case)
    exact = solve_ivp(lambda t, y: [y[1], G * 2 * np.cos(y[0]) / 4.1], (0, 5), [0, 0], t_eval=result.t,
                      method="DOP853", rtol=1e-12, atol=1e-12).y  # fmt: skip
    np.testing.assert_allclose(result.request(1)[:, 1], 2 * np.cos(exact[0]), atol=1e-6)
    np.testing.assert_allclose(result.request(1)[:, 3], -2 * np.sin(exact[0]), atol=1e-6)


def test_the_spherical_table_loses_energy():
    """m v^2/2 + I w^2/2 + m g z of the tables: 7e-5 J off for Revolute, -7.9e-3 J at the end for Spherical."""
    lost = {}
    for case in ("Revolute", "Spherical"):
        p, v, w = (table(case, kind)[:, 1:] for kind in ("Pos", "Vel", "Avel"))
        lost[case] = 0.5 * (v**2).sum(1) + 0.05 * (w**2).sum(1) + G * p[:, 2]
    assert np.abs(lost["Revolute"]).max() < 1e-4
    assert lost["Spherical"][-1] == pytest.approx(-7.93e-3, rel=0.01)


def test_the_distance_tables_accelerations_scatter():
    """The table's own positions and velocities give the acceleration of a point on a string: 1.35e-3 off its own."""
    p, v, a = (table("Distance", kind)[:, 1:] for kind in ("Pos", "Vel", "Acc"))
    pull = ((v**2).sum(1) - G * p[:, 2]) / 4
    assert np.abs(a - (-pull[:, None] * p - [0, 0, G])).max() == pytest.approx(1.35e-3, rel=0.02)


def test_the_spring_table_belongs_to_another_deck():
    """The deck starts at y = 2 m; its table at 0, falling on a spring of 10 N/m with 0.5 N s/m."""
    result = run("TransSpring")
    assert result.request(1)[0, 2] == pytest.approx(2.0)
    assert np.abs(table("TransSpring", "Pos")[:, 1:3]).max() == 0.0
    t, z = table("TransSpring", "Pos")[:, [0, 3]].T
    exact = solve_ivp(lambda _, y: [y[1], -G - 10 * y[0] - 0.5 * y[1]], (0, 5), [0, 0], t_eval=t, rtol=1e-11).y[0]
    np.testing.assert_allclose(z, exact, atol=1e-5)
