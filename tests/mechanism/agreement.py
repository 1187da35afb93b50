"""All that a solution tells by names, beside what a simulator tells at one of its points."""

import numpy as np
import pytest

from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT
from gearmbs.dae.problem import EPS
from gearmbs.mechanism import ModelError
from gearmbs.mechanism.solve.carriers import pair_of

LOST = GROWTH_LIMIT * EPS
"""Part of the largest value of a series that is rounding, by as much as pivots are allowed to grow."""
ROUNDED = 1e-10
"""What is zero but for rounding, in SI: accelerations of what is held, beside those of what spins."""
BODY_QUANTITIES = (
    "com_position", "orientation", "com_velocity", "angular_velocity", "com_acceleration", "angular_acceleration",
    "modal_coordinates", "modal_velocities",
)  # fmt: skip
JOINT_QUANTITIES = ("reaction", "reaction_force", "joint_angle", "joint_displacement", "joint_rate")


def assert_all_names_agree(m, sim, solution, row=-1):
    """Whatever a solution tells by any name at ``row`` is the same by ``get``; what it does not tell, neither."""
    markers = [marker.name for body in (*m.bodies.values(), m.ground) for marker in body.markers]
    names = {what: list(known) for known, kinds in (
        (m.bodies, BODY_QUANTITIES), (m.joints, JOINT_QUANTITIES),
        (m.elements, ("load", "diagnostics", "contact", "transmission_error")),
        (markers, ("marker_position", "marker_velocity", "deflection")),
        (m.state_names, ("state",)), (m.outputs, ("output",)), (sim.numbers, ("input",)), (sim.unknowns, ("unknown",)),
    ) for what in kinds}  # fmt: skip
    told = dict.fromkeys([*names, "kinetic_energy", "multipliers", "constraint_violation"], 0)
    asked = [(what, (name,)) for what, given in names.items() for name in given]
    for what, given in [*asked, ("kinetic_energy", ()), ("multipliers", ()), ("constraint_violation", ())]:
        series = getattr(solution, what, None)
        try:
            wanted = series(*given) if callable(series) else series
        except (ModelError, KeyError) as error:
            with pytest.raises(type(error)):
                sim.get(what, *given)
            continue
        _assert_same(sim.get(what, *given), wanted, row)
        told[what] += 1
    return told


def add_outputs_of_all_kinds(m):
    """Add an output of each kind that solutions tell of, whole and by a component, and return their names."""
    body, mesh = list(m.bodies)[-1], next(name for name, one in m.elements.items() if pair_of(one) is not None)
    joint = next(one for one in m.joints.values() if one.kind in ("revolute", "cylindrical"))
    vectors = ("com_position", "com_velocity", "com_acceleration", "angular_velocity", "angular_acceleration")
    marker = m.bodies[body].markers[0].name
    asked = [
        *((what, body, *some) for what in vectors for some in ((), ("y",))), ("orientation", body),
        *((what, marker, *some) for what in ("marker_position", "marker_velocity") for some in ((), ("x",))),
        *(("reaction", joint.name, *some) for some in ((), ("fx",), ("tz",))), ("reaction_force", joint.name, "y"),
        *(("load", mesh, *some) for some in ((), ("fx",), ("tz",))), ("diagnostics", mesh),
        ("joint_angle", joint.name), ("joint_rate", joint.name), ("transmission_error", mesh),
        ("kinetic_energy",), ("constraint_violation",), ("unknown", f"eps_psi({body})"),
        *(("state", name) for name in m.state_names[:1]),
        f'FX("{m.elements[mesh].i.name}", "{m.elements[mesh].j.name}") + TIME', f'ACCX("{marker}")',
        f'2*AZ("{joint.i.name}", "{joint.j.name}")',
    ]  # fmt: skip
    names = [f"told {k}" for k in range(len(asked))]
    for name, what in zip(names, asked, strict=True):
        m.output(name, what)
    return names


def _assert_same(now, series, row):
    """Compare a value of an instant with one of a series, to the rounding of a solution with other pivots."""
    if isinstance(series, dict):
        for key, values in series.items():
            _assert_same(now[key], values, row)
    elif isinstance(series, tuple):
        for part, values in zip(now, series, strict=True):
            _assert_same(part, values, row)
    else:
        size = np.abs(series).max(initial=0.0)
        np.testing.assert_allclose(now, series[row], rtol=0.0, atol=LOST * size + ROUNDED)
