"""A solution as tables: everything with its units, and a few rows for notebooks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs._display import html_table
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W

if TYPE_CHECKING:
    import xarray as xr


def dataset(solution: Any) -> xr.Dataset:
    """Return everything that a solution tells as an :class:`xarray.Dataset` with units in the attributes."""
    import xarray as xr

    xyz = ["x", "y", "z"]
    joints = list(solution.system.model.rows_of_joint)
    reactions = [solution.reaction(j) for j in joints]

    def var(dims, data, unit, title):
        return (dims, data, {"units": unit, "long_name": title})

    body = ("time", "body", "xyz")
    data = {
        "position": var(body, solution._pose[:, :, POSE_R:POSE_A], "m", "position of the centre of mass"),
        "orientation": var(
            ("time", "body", "xyz", "axis"),
            solution._pose[:, :, POSE_A:POSE_V].reshape(solution.t.size, -1, 3, 3),
            "1",
            "rotation matrix, columns are the body's axes",
        ),
        "velocity": var(body, solution._pose[:, :, POSE_V:POSE_W], "m/s", "velocity of the centre of mass"),
        "angular_velocity": var(body, solution._pose[:, :, POSE_W:POSE_COLUMNS], "rad/s", "angular velocity"),
        "acceleration": var(body, solution._acc[:, :, 0:3], "m/s^2", "acceleration of the centre of mass"),
        "angular_acceleration": var(body, solution._acc[:, :, 3:6], "rad/s^2", "angular acceleration"),
    }
    if joints:
        joint = ("time", "joint", "xyz")
        data["reaction_force"] = var(joint, np.stack([r[0] for r in reactions], 1), "N", "joint force on I's body")
        data["reaction_moment"] = var(
            joint, np.stack([r[1] for r in reactions], 1), "N m", "joint moment on I's body about marker I"
        )
        data["constraint_violation"] = var(
            ("time",), solution.constraint_violation, "1", "largest |Phi| before projection"
        )
    if sum(solution.system.model.modes):
        q_f, v_f, _ = solution._records.modal
        data["modal_coordinate"] = var(("time", "mode"), q_f, "1", "modal coordinate")
        data["modal_velocity"] = var(("time", "mode"), v_f, "1/s", "rate of the modal coordinate")
    if solution.system.state_names and solution.system.mechanism is not None:
        values = np.stack([solution.state(name) for name in solution.system.state_names], 1)
        data["states"] = var(("time", "state"), values, "-", "user-defined state")
    if solution.system.force_names:
        element = ("time", "element", "xyz")
        data["load_force"] = var(element, solution._loads[:, :, 0:3], "N", "applied force on I's body")
        data["load_torque"] = var(element, solution._loads[:, :, 3:6], "N m", "applied torque on I's body at marker I")
        for name, unit, values in _diagnostics_by_name(solution):
            data[name] = var(("time", "element"), values, unit, name.replace("_", " "))
    coords = {
        "time": ("time", solution.t, {"units": "s"}),
        "body": solution.system.body_names,
        "xyz": xyz,
        "axis": xyz,
        "joint": joints,
        "state": solution.system.state_names,
        "element": solution.system.force_names,
        "mode": [
            f"{name} {k + 1}"
            for name, n in zip(solution.system.body_names, solution.system.model.modes[1:])
            for k in range(n)
        ],
    }
    used = {d for v in data.values() for d in v[0]}
    out = xr.Dataset(data, coords={k: v for k, v in coords.items() if k in used})
    out.attrs["status"] = solution.status.name
    out.attrs["message"] = solution.message
    out.attrs.update({f"solver_{k}": v for k, v in solution.stats.as_dict().items()})
    return out


def _diagnostics_by_name(solution: Any) -> Iterator[tuple[str, str, np.ndarray]]:
    """Yield name, unit and values (m, elements) of each diagnostic; zero for elements without it."""
    found: dict[tuple[str, str], np.ndarray] = {}
    for k, diagnostics in enumerate(solution.system.model.diagnostics):
        for c, d in enumerate(diagnostics):
            table = found.setdefault((d.name, d.unit), np.zeros((solution.t.size, len(solution.system.force_names))))
            table[:, k] = solution._loads[:, k, 6 + c]
    for (name, unit), values in found.items():
        shared = sum(other == name for other, _ in found) > 1
        yield f"{name} ({unit})" if shared else name, unit, values


def solution_html(solution: Any) -> str:
    """Return how a run ended, what it cost and what it is about."""
    system, stats = solution.system, solution.stats
    mechanism = getattr(system, "mechanism", None)
    name = mechanism.name if mechanism is not None else "mechanism"
    span = (
        f"{solution.t[0]:.6g} to {solution.t[-1]:.6g} s, {solution.t.size} outputs" if solution.t.size else "no outputs"
    )
    joints = list(dict.fromkeys(row.rsplit(": ", 1)[0] for row in system.row_names))
    rows = [
        ("status", solution.status.name.replace("_", " ").lower()),
        ("time", span),
        ("steps", f"{stats.steps}, {stats.residuals} residuals, {stats.jacobians} Jacobians"),
        ("solver time", f"{stats.wall_time:.3g} s"),
        ("bodies", ", ".join(system.body_names)),
        ("joints", ", ".join(joints) or "none"),
        ("forces", ", ".join(system.force_names) or "none"),
    ]
    return html_table(f"Solution of {name}", ("", ""), rows, solution.message)
