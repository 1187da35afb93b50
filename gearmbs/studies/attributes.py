"""What a record says of itself: every parameter of its case, its bearings, the versions, and what the run cost."""

from __future__ import annotations

import functools
import json
import platform
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

import gearmbs
from gearmbs.studies.case import Case, units_of_fields
from gearmbs.studies.drive import drive_angle
from gearmbs.studies.limits import remarks

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism import Mechanism

_version = functools.cache(version)


def attributes_of(case: Case, solution: Solution | None = None) -> dict[str, Any]:
    """Return every parameter of a case, the versions and the solver's statistics as flat attributes.

    The unit of a quantity is beside it: ``operation_speed`` has ``operation_speed_units``. What is unusual about the
    case is said in ``remarks``.
    """
    out: dict[str, Any] = {"title": f"gear pair: {case.name}", "case": case.name}
    for section in ("gears", "shafts", "operation", "fault", "contact", "friction", "solver"):
        settings = getattr(case, section)
        units = units_of_fields(settings)
        for key, value in settings.model_dump().items():
            name = f"{section}_{key}"
            if name in ("operation_speed", "operation_torque") and isinstance(value, tuple):
                out[f"{name}_curve"] = json.dumps(value)
                value = max(number for _, number in value)
            if value is None:
                out[name] = "default"
            elif name == "fault_teeth":
                out[name] = json.dumps(value)
            elif isinstance(value, bool):
                out[name] = int(value)
            else:
                out[name] = list(value) if isinstance(value, tuple) else value
                if key in units and not isinstance(value, str):
                    out[f"{name}_units"] = units[key]
    out["solver_tolerance"] = case.solver.used_tolerance
    for name, rate in (("signal_rate", case.signal_rate), ("output_rate", case.output_rate)):
        out[f"solver_{name}"], out[f"solver_{name}_units"] = rate, "Hz"
    pair = case.pair()
    out["operation_torque_of"] = "driven wheel"
    out["contact_law"] = str(pair.contact)
    out["contact_ratio"] = pair.contact_ratio
    out["face_slices"] = pair.face_slices
    out["remarks"] = "; ".join(remarks(case)) or "none"
    out["mesh_frequency"] = case.mesh_frequency
    out["mesh_frequency_units"] = "Hz"
    out["case_json"] = case.model_dump_json()
    out["gearmbs_version"] = gearmbs.__version__
    for package in ("numpy", "scipy", "numba", "scikit-sundae", "xarray"):
        out[f"{package.replace('-', '_')}_version"] = _version(package)
    out["python_version"] = platform.python_version()
    if solution is not None:
        out.update({f"solver_{key}": value for key, value in solution.stats.as_dict().items()})
        out.update(cost(case, solution))
    return out


def cost(case: Case, solution: Solution) -> dict[str, Any]:
    """Return what a run cost: seconds simulated in a second of the solver, and its time for each cycle of the mesh.

    The first falls with the speed of the wheels, the second hardly does.
    """
    operation = case.operation
    end, spent = float(solution.t[-1]), solution.stats.wall_time
    angle = drive_angle(operation.speed, operation.run_up, operation.run_up + operation.settling)
    cycles = case.gears.teeth[0] * (angle(end) - angle(0.0)) / (2.0 * np.pi)
    return {
        "solver_mesh_cycles": cycles,
        "solver_real_time_factor": end / spent if spent > 0.0 else 0.0,
        "solver_time_per_mesh_cycle": spent / cycles if cycles > 0.0 else 0.0,
        "solver_time_per_mesh_cycle_units": "s",
    }


def bearing_attributes(mechanism: Mechanism | None, title: str = "") -> dict[str, Any]:
    """Return what a record says of the rolling bearings of its mechanism, which its case does not know.

    Returns
    -------
    dict
        ``title``; ``bearings`` and ``bearing_defects`` in words; ``bearings_json``: of each by name its bearing, the
        settings other than the defaults and its defects with labels, in SI. Empty without rolling bearings.
    """
    if mechanism is None or not any(e.kind == "rolling bearing" for e in mechanism.elements.values()):
        return {}
    from gearmbs.bearings.record import described

    told = described(mechanism)
    words = {name: [d["label"] for d in one["defects"]] for name, one in told.items()}
    kinds = {one["bearing"]["designation"] or one["bearing"]["kind"] for one in told.values()}
    return {
        "title": f"{title} on rolling bearings",
        "bearings": f"{len(told)} rolling bearings {', '.join(sorted(kinds))}",
        "bearing_defects": "; ".join(f"{name}: {', '.join(labels)}" for name, labels in words.items() if labels)
        or "none",
        "bearings_json": json.dumps(told),
    }
