"""What an exported model tells: quantities of solutions without an expression, and what is said of those left out."""

import shutil

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.dae.problem import ANY
from gearmbs.drivetrain import Shaft, Wheel
from gearmbs.gears import GearSpec
from gearmbs.mechanism import ModelError
from gearmbs.native import export
from gearmbs.native.fmu import variables_of
from gearmbs.native.library import _kinds
from gearmbs.studies.export import items_of
from tests.drivetrain.support import stage
from tests.native.support import Instance, Library
from tests.says import says

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler is installed"),
]
AXES = ("x", "y", "z")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")


def geared():
    """One stage on shafts that deform."""
    shafts = [Shaft(name=name, length="100 mm", diameter="30 mm", modes=4, elements=4) for name in ("in", "out")]
    wheels = [
        Wheel(name=name, shaft=shaft, station=0.05, gear=GearSpec(teeth, "3 mm", name=name, bore_radius="15 mm"))
        for name, shaft, teeth in (("pinion", "in", 20), ("gear", "out", 60))
    ]
    train = stage(shafts=shafts, wheels=wheels, run_up=0.01, running=True)
    m = train.build()
    m.outputs.clear()
    return m, {"tol": 1e-6, "rate_scale": train.rate_scale}


def test_outputs_of_a_mesh_and_its_markers(tmp_path):
    """Transmission error, markers, deflection, unknowns: what Python tells, the first and the last bit for bit."""
    m, options = geared()
    element = m.elements["mesh"]
    marker, shaft = element.i, element.i.body
    assert shaft.name == "in"
    m.output("error", ("transmission_error", "mesh"))
    m.output("force", ("load", "mesh"))
    m.output("way", ("marker_position", marker.name))
    m.output("speed", ("marker_velocity", marker.name, "y"))
    m.output("bent", ("deflection", marker.name))
    m.output("rates", ("modal_velocities", "in"))
    m.output("off", ("constraint_violation",))
    m.output("spring", ("unknown", next(iter(m.compile(0.0).problem("SI2", 1.0).names))))
    m.output("energy", ("kinetic_energy",))
    made = export(m, tmp_path, t_end=0.02, processor="native", **options)
    assert made.left_out == []
    units = made.outputs
    assert units["error"] == units["way.x"] == units["bent.fx"] == "m"
    assert (units["speed"], units["bent.tz"], units["force.tz"]) == ("m/s", "rad", "N m")
    instance, sim = Instance(Library(made.library)), gm.Simulator(m, 0.02, lump=False, **options)
    for t in np.linspace(0.0, 0.02, 21)[1:-1].tolist():
        instance.advance(t)
        sim.advance(t)
        told = dict(zip(units, instance.outputs(), strict=True))
        for name in ("error", "off", "spring", "energy"):
            assert told[name] == sim.get("output", name)
        np.testing.assert_array_equal([told[f"force.{c}"] for c in WRENCH], np.ravel(sim.get("output", "force")))
        rates = sim.get("output", "rates")
        np.testing.assert_array_equal([told[f"rates.{k}"] for k in range(rates.size)], rates)
        np.testing.assert_allclose([told[f"way.{c}"] for c in AXES], sim.get("output", "way"), atol=1e-15)
        assert told["speed"] == pytest.approx(sim.get("output", "speed"), rel=1e-10)
        np.testing.assert_allclose(
            [told[f"bent.{c}"] for c in WRENCH], np.ravel(sim.get("output", "bent")), rtol=1e-9, atol=1e-18
        )
    assert told["error"] != 0.0
    assert units["energy"] == "J"


def test_outputs_by_the_names_of_a_default(tmp_path):
    """All of them, with those that are declared; or single ones, with expressions and quantities in any order."""
    m, options = geared()
    m.output("turning", ("angular_velocity", "out", "z"))
    made = export(m, tmp_path, t_end=0.02, outputs="all", **options)
    assert {"turning", "mesh.transmission_error", "in.com_velocity.x", "mesh.load.fx"} <= made.outputs.keys()
    assert next(iter(made.outputs)) == "turning"
    asked = ["mesh.load.fx", "turning", ("marker_velocity", m.bodies["in"], "x"), "WZ(nothing)"]
    with pytest.raises(ModelError, match=says("WZ", "cannot be told", "nothing")):
        export(m, tmp_path, t_end=0.02, outputs=asked, **options)
    made = export(m, tmp_path, t_end=0.02, outputs=[*asked[:-1], "TIME*2.0 + (1.0)"], **options)
    assert list(made.outputs) == ["mesh.load.fx", "turning", "marker_velocity.in.x", "TIME*2.0 + (1.0)"]
    instance = Instance(Library(made.library))
    instance.advance(0.01)
    assert instance.get("TIME*2.0 + (1.0)") == pytest.approx(1.02)
    with pytest.raises(ModelError, match=says("mesh.load.fq", "did you mean")):
        export(m, tmp_path, t_end=0.02, outputs=["mesh.load.fq"], **options)
    m.ground.marker(name="fixed point")
    with pytest.raises(ModelError, match=says("deflection", "ground", "deform")):
        export(m, tmp_path, t_end=0.02, outputs=[("deflection", "fixed point", "fx")], **options)


def test_inputs_of_an_fmu_are_chosen(tmp_path):
    m, options = geared()
    made = export(
        m, tmp_path, t_end=0.02, target="fmu3", inputs=["mesh.stiffness"], outputs=["mesh.load.fx"], **options
    )
    import fmpy

    told = {one.name: one.causality for one in fmpy.read_model_description(str(made.library)).modelVariables}
    assert told["mesh.stiffness"] == "input"
    assert told["mesh.damping"] == "parameter"
    assert fmpy.validation.validate_fmu(str(made.library)) == []
    with pytest.raises(ModelError, match=says("inputs", "mesh.stifness", "did you mean")):
        export(m, tmp_path, t_end=0.02, target="fmu3", inputs=["mesh.stifness"], **options)
    with pytest.raises(ModelError, match=says("inputs", "numbers alike", "fmu2")):
        export(m, tmp_path, t_end=0.02, inputs=["mesh.stiffness"], **options)
    assert variables_of({"a": ("input", "m", 1.0, ANY)}, [])[0].causality == "input"
    assert _kinds({}, None) == {}
    assert items_of('a, DX("p, q", r), F(G(1, 2), 3)') == ["a", 'DX("p, q", r)', "F(G(1, 2), 3)"]
