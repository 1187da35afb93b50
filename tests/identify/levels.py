"""Stored levels of a few cases over friction, in place of the simulations that a fit asks for."""

import math

import numpy as np
import xarray as xr
from scipy.interpolate import barycentric_interpolate

from gearmbs.studies import Case
from tests.make_records import FRICTION, NODES, read

SHORT = {"duration": 0.08, "run_up": 0.02, "settling": 0.02}
CASES = {
    "100 N m": Case(operation={**SHORT, "torque": 100.0}),
    "200 N m": Case(operation={**SHORT, "torque": 200.0}),
    "skew": Case(operation=SHORT, fault={"misalignment": "1 deg", "plane": "skew"}),
    "inclination": Case(operation=SHORT, fault={"misalignment": "1 deg", "plane": "inclination"}),
}
"""The cases whose levels are stored; other friction and tolerances, and lumped bodies, stand for the same case."""


def with_friction(case: Case, node: float) -> Case:
    """Return a case with the friction of a node: from -1, the lowest, to 1, the highest."""
    dynamic = FRICTION[1] * (FRICTION[2] / FRICTION[1]) ** node
    solver = {"tolerance": 1e-8, "lump": False}
    return case.changed(friction={"static": 2.0 * dynamic, "dynamic": dynamic}, solver=solver)


def run_stored(case: Case, *args, **kwargs) -> xr.Dataset:
    """Return the levels of a case, interpolated between those that are stored; it takes the place of `plain_record`."""
    assert math.isclose(case.friction.static, 2.0 * case.friction.dynamic)
    name = next(name for name, known in CASES.items() if with_friction(known, 0.0) == with_friction(case, 0.0))
    node = math.log(case.friction.dynamic / FRICTION[1]) / math.log(FRICTION[2] / FRICTION[1])
    stored = read("levels.nc")["gmf_rms"].sel(case=name).drop_vars("case")
    # levels have kinks where amplitudes pass through zero, their squares have none
    values = np.sqrt(barycentric_interpolate(NODES, stored.values.astype(float) ** 2, node))
    return stored.isel(friction=0, drop=True).copy(data=values).expand_dims(way=["orders"]).to_dataset()
