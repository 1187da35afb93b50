"""Every named output of a solution is told by an exported model: a walk through what a simulator tells."""

import shutil

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism.parts.joints import kinds_with_angle, kinds_with_displacement
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.solve.carriers import pair_of
from gearmbs.mechanism.solve.told import AT_AN_INSTANT, COUNTED
from gearmbs.native import export
from gearmbs.studies.run.simulation import case_mechanism
from tests.native.support import Instance, Library
from tests.native.test_library import bench, flexible_on_rolling_bearings, misaligned, planetary

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed")]

BY_FORMULAS = {
    "joint_angle", "joint_displacement", "joint_rate", "marker_position", "marker_velocity", "deflection", "evaluate",
}  # fmt: skip
"""What Python finds by formulas of its own, and a library by expressions: equal to rounding."""


def healthy():
    return case_mechanism(gm.Case()), 0.01, {}


def asked_of(m, sim):
    """Return by quantity all that a simulator can be asked for: names of what each is told of."""
    bodies, joints = list(m.bodies), [one for name, one in m.joints.items() if name in sim._system.model.rows_of_joint]
    markers = [one for body in (m.ground, *m.bodies.values()) for one in body.markers]
    names = [one.name for one in markers if [other.name for other in markers].count(one.name) == 1]
    modal = [name for name, body in m.bodies.items() if isinstance(body, ModalBody)]
    turning = [one.name for one in joints if one.kind in kinds_with_angle()]
    sliding = [one.name for one in joints if one.kind in kinds_with_displacement()]
    forces = list(sim._system.model.names.forces)
    told = [name for name, d in zip(forces, sim._system.model.diagnostics, strict=True) if d]
    meshes = [
        name
        for name, one in m.elements.items()
        if pair_of(one) is not None and not one.i.body.name.startswith("planet")
    ]
    on_modal = [one.name for one in markers if isinstance(one.body, ModalBody) and one.name in names]
    of_bodies = ("com_position", "orientation", "com_velocity", "angular_velocity", "com_acceleration",
                 "angular_acceleration")  # fmt: skip
    return {
        **dict.fromkeys(of_bodies, bodies),
        **{key: [one.name for one in joints] for key in ("reaction", "reaction_force")},
        "load": forces,
        **dict.fromkeys(("diagnostics", "contact"), told),
        **dict.fromkeys(("modal_coordinates", "modal_velocities"), modal),
        "joint_angle": turning,
        "joint_displacement": sliding,
        "joint_rate": turning + sliding,
        **dict.fromkeys(("marker_position", "marker_velocity"), names),
        "deflection": on_modal,
        "state": list(m.state_names),
        **{key: [None] for key in ("multipliers", "kinetic_energy", "constraint_violation")},
        "transmission_error": meshes,
        "unknown": sim.unknowns,
        "evaluate": ["TIME"],
    }


def flat(told):
    """Return all numbers of what is told of an instant."""
    if isinstance(told, dict):
        told = list(told.values())
    return np.concatenate([np.ravel(part) for part in told]) if isinstance(told, list | tuple) else np.ravel(told)


@pytest.mark.parametrize("model", [healthy, misaligned, planetary, bench, flexible_on_rolling_bearings])
def test_a_library_tells_what_a_solution_tells(model, tmp_path):
    m, end, options = model()
    m.outputs.clear()
    walked = asked_of(m, gm.Simulator(m, end, lump=False, **options))
    # a quantity that solutions tell from now on is to be told by libraries, too
    assert set(walked) == {*AT_AN_INSTANT, *COUNTED}
    for what, names in walked.items():
        for k, name in enumerate(names):
            if what != "evaluate":
                m.output(f"{what} {k}", (what,) if name is None else (what, name))
    made = export(m, tmp_path, t_end=end, processor="native", **options)
    assert made.left_out == []
    places = {}
    for at, name in enumerate(made.outputs):
        places.setdefault(name.partition(".")[0], []).append(at)
    instance, sim = Instance(Library(made.library)), gm.Simulator(m, end, lump=False, **options)
    for t in np.linspace(0.0, end, 8)[1:-1].tolist():
        instance.advance(t)
        sim.advance(t)
        told = instance.outputs()
        for what, names in walked.items():
            for k, name in enumerate(names):
                if what == "evaluate":
                    continue
                wanted = flat(sim.get("output", f"{what} {k}"))
                found = told[places[f"{what} {k}"]]
                if what in BY_FORMULAS:
                    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12 * max(1.0, np.abs(wanted).max()))
                else:
                    np.testing.assert_array_equal(found, wanted, err_msg=f"{what} {name}")
