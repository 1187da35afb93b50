"""Cost of the gear contact kernel: per call and per evaluated pair-slice."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numba import njit

from benchmarks.gear_pair import call_costs
from benchmarks.markdown import number, table
from gearmbs.contact import GAP_COLUMNS, gear_contact, layout
from gearmbs.gears import FlankFriction, GearPair, GearSpec
from gearmbs.gears.faults import GradedFlanks
from gearmbs.gears.transmission import StaticMesh
from gearmbs.studies import Case, simulate_case

HELICAL = {
    name: GearSpec(29, 95e-3 / 31, helix_angle="15 deg", hand=hand)
    for name, hand in (("driver", "right"), ("driven", "left"))
}
CASES = {
    "healthy": ({}, 1),
    "healthy, no friction": ({"friction": FlankFriction.none()}, 1),
    "+3 mm": ({"centre_distance_error": "3 mm"}, 1),
    "skew 1 deg, jammed, default slices": ({"misalignment": "1 deg"}, None),
    "skew 1 deg, jammed, 41 slices": ({"misalignment": "1 deg"}, 41),
    "skew 1 deg, 0.4 mm backlash, 41 slices": ({"misalignment": "1 deg", "backlash": "0.4 mm"}, 41),
    "graded flanks, 41 slices": ({"faults": (GradedFlanks(),)}, 41),
    "helix 15 deg, 20 slices": (HELICAL, 20),
}
WHOLE = {
    "healthy": (None, None),
    "skew 1 deg, default slices": ("1 deg", None),
    "skew 1 deg, 41 slices": ("1 deg", 41),
}
"""Misalignment and slices of the study's model whose whole residual is measured."""
SHORT_RUN = 0.002
SPEED = 1000 * 2 * np.pi / 60
REPEATS = 200
TITLE = "Gear contact kernel"
CALLS = 10
POSITIONS = 7


@njit
def _loop(n, gi, gr, R1, A1, v1, w1, R2, A2, v2, w2, wrench, jac, diag, want, work):
    for _ in range(n):
        gear_contact(gi, gr, R1, A1, v1, w1, R2, A2, v2, w2, wrench, jac, diag, want, work)


def measure(pair: GearPair, slices: int | None) -> dict[str, float]:
    """Shortest time per call over short bursts, averaged over a mesh cycle, at 100 N m."""
    mesh = StaticMesh(pair, slices)
    work = np.zeros_like(mesh.work)
    wrench, jac, diag = np.zeros(6), np.zeros((6, 24)), np.zeros(8)
    gi, gr, _ = pair.contact_tables(slices)
    zero = np.zeros(3)
    totals = {0: 0.0, 1: 0.0}
    pair_slices = 0.0
    for angle in np.linspace(0, 2 * np.pi / 29, POSITIONS):
        place = pair.frames(angle, mesh.loaded_angle(angle, 100.0, mesh.touching_angle(angle) + 1e-4))
        state = (
            *(place.origin_1, place.axes_1, zero, SPEED * place.axes_1[:, 2]),
            *(place.origin_2, np.ascontiguousarray(place.axes_2), zero, -SPEED * place.axes_2[:, 2]),
        )
        for want in totals:
            _loop(CALLS, gi, gr, *state, wrench, jac, diag, want, work)
            best = np.inf
            for _ in range(REPEATS):
                start = time.perf_counter()
                _loop(CALLS, gi, gr, *state, wrench, jac, diag, want, work)
                best = min(best, (time.perf_counter() - start) / CALLS)
            totals[want] += best / POSITIONS
        low, high = pair.common_face
        count = int(gi[layout.SLICES])
        stations = low + (np.arange(count) + 0.5) * (high - low) / count
        rows = mesh.gaps(
            angle, StaticMesh(pair, slices).loaded_angle(angle, 100.0, mesh.touching_angle(angle)), stations
        )
        pair_slices += np.count_nonzero(rows[:, GAP_COLUMNS.index("gap")] < 0) / POSITIONS
    return {
        "value_us": totals[0] * 1e6,
        "jacobian_us": totals[1] * 1e6,
        "touching_pair_slices": pair_slices,
        "ns_per_pair_slice": totals[1] * 1e9 / max(pair_slices, 1.0),
    }


def measure_whole(misalignment: str | None, slices: int | None) -> dict[str, float]:
    """Time the whole residual of the study's model and its Jacobian at the end of a short run at 100 N m."""
    case = Case(
        operation={"duration": SHORT_RUN, "torque": "100 N m"},
        fault={} if misalignment is None else {"misalignment": misalignment},
        contact={"slices": slices},
    )
    solution = simulate_case(case)
    costs = call_costs(solution)
    return {
        "value_us": 1e6 * costs["residual"],
        "jacobian_us": 1e6 * costs["jacobian"],
        "unknowns": solution.problem.n,
    }


def cells(quick: bool) -> list[tuple[str, Callable[[], dict]]]:
    """Return name and measurement of each part."""
    chosen = list(CASES.items())[: 2 if quick else None]
    whole = list(WHOLE.items())[: 1 if quick else None]
    parts: list[tuple[str, Callable[[], dict]]] = [
        (f"whole residual, {name}", lambda name=name, a=a: {"whole": name, **measure_whole(*a)}) for name, a in whole
    ]
    return parts + [
        (name, lambda name=name, a=(changes, slices): {"case": name, **measure(GearPair.paper(**a[0]), a[1])})
        for name, (changes, slices) in chosen
    ]


def finish(results: list[dict]) -> dict:
    """Return nothing: the parts say it all."""
    return {}


def render(extra: dict) -> str:
    """Return the table in Markdown."""
    results = extra["results"]
    header = ["case", "value us", "with derivatives us", "touching pair-slices", "ns per pair-slice"]
    rows = [
        [
            r["case"],
            number(r["value_us"]),
            number(r["jacobian_us"]),
            number(r["touching_pair_slices"]),
            number(r["ns_per_pair_slice"]),
        ]
        for r in results
        if "case" in r
    ]
    whole = [
        [r["whole"], str(r["unknowns"]), number(r["value_us"]), number(r["jacobian_us"])]
        for r in results
        if "whole" in r
    ]
    text = "One evaluation of a gear pair at 100 N m, averaged over a mesh cycle.\n\n" + table(header, rows)
    if whole:
        text += "\nThe whole residual of the study's model, all bodies in space, SI2:\n\n"
        text += table(["case", "unknowns", "residual us", "Jacobian us"], whole)
    return text
