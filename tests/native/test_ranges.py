"""What a library takes and what not: ranges of numbers as in Python, times, and what importers hand over."""

import ctypes
import math
import shutil

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import ModelError
from gearmbs.native import export
from gearmbs.studies.run.simulation import case_mechanism
from tests.native.support import Instance, Library
from tests.says import says

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler is installed"),
]
END = 0.01
OUT_OF_RANGE = -23


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    m = case_mechanism(gm.Case())
    return m, Library(export(m, tmp_path_factory.mktemp("pair"), t_end=END, processor="native").library)


def range_of(library, name):
    least, most = ctypes.c_double(), ctypes.c_double()
    at = library.number_names.index(name)
    assert library.number_range(at, ctypes.addressof(least), ctypes.addressof(most)) == 0
    return least.value, most.value


def test_numbers_have_the_ranges_of_python(pair):
    """Each value is taken by both or refused by both, and what is refused changes nothing."""
    m, library = pair
    sim, instance = gm.Simulator(m, END, lump=False), Instance(library)
    refused = 0
    for at, name in enumerate(library.number_names):
        before = instance.number(name)
        for value in (-1e300, -1.0, -5e-324, 0.0, 5e-324, 0.5, 1.0, 1e300, math.inf, -math.inf, math.nan):
            try:
                sim.set(name, value)
                wanted = True
            except ModelError:
                wanted = False
            code = library.set(instance.address, at, value)
            assert (code == 0) == wanted, (name, value)
            refused += code == OUT_OF_RANGE
            if wanted:
                assert instance.number(name) == value
                instance.set(name, before)
                sim.set(name, before)
        assert instance.number(name) == before
    assert refused > 0
    assert range_of(library, "mesh.stiffness") == (5e-324, math.inf)
    assert range_of(library, "load.torque") == (-math.inf, math.inf)
    assert library.number_range(99, None, None) == library.set(instance.address, 99, 1.0) == -20
    assert b"range" in library.message(OUT_OF_RANGE)


class Lines:
    """What an FMU has told its importer."""

    def __init__(self):
        self.told = []

    def note(self, *words):
        self.told.append(str(words))


def test_an_fmu_tells_the_range(pair, tmp_path):
    import fmpy

    m, _ = pair
    for target in ("fmu2", "fmu3"):
        made = export(m, tmp_path, t_end=END, target=target, outputs=["mesh.load.fx"], processor="native")
        told = {one.name: one for one in fmpy.read_model_description(str(made.library)).modelVariables}
        assert (float(told["mesh.stiffness"].min), told["mesh.stiffness"].max) == (0.0, None)
        assert fmpy.validation.validate_fmu(str(made.library)) == []
        lines = Lines()
        with pytest.raises(Exception, match=says("failed", "error")):
            fmpy.simulate_fmu(
                str(made.library), start_values={"mesh.stiffness": -1.0}, stop_time=1e-3, logger=lines.note
            )
        assert any("mesh.stiffness = -1: it must lie between" in line for line in lines.told)


def test_derivatives_at_the_end_of_a_range(tmp_path):
    """They are differences of both sides, though none beyond the end may be set: of a damper of 0, dF/dd = -v."""
    m = gm.Mechanism("slider")
    body = m.body("body", mass=2.0, inertia=(1.0, 1.0, 1.0), velocity=(0.5, 0.0, 0.0))
    m.translational("guide", body, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    m.parameter("d", "N s/m", 0.0)
    m.axis_force("damper", m.joints["guide"].i, m.joints["guide"].j, "-d*VZ(guide.I, guide.J, guide.J)")
    m.output("a", ("com_acceleration", "body", "x"))
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    made = export(m, tmp_path, t_end=1.0, target="fmu2", processor="native")
    told = fmpy.read_model_description(str(made.library))
    references = {one.name: one.valueReference for one in told.modelVariables}
    fmu = FMU2Slave(guid=told.guid, unzipDirectory=fmpy.extract(str(made.library)),
                    modelIdentifier=told.coSimulation.modelIdentifier)  # fmt: skip
    fmu.instantiate()
    fmu.setupExperiment()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    (slope,) = fmu.getDirectionalDerivative([references["a"]], [references["d"]], [1.0])
    assert slope == pytest.approx(-0.5 / 2.0, rel=1e-6)
    fmu.terminate()
    fmu.freeInstance()


def test_a_point_just_behind_one_where_something_was_set(pair):
    """However near it is, nothing is lost: the run goes on as without it, but for rounding."""
    _, library = pair
    near, plain = Instance(library), Instance(library)
    for instance in (near, plain):
        instance.advance(0.4 * END)
        instance.set("load.torque", 150.0)
    t = 0.4 * END
    for _ in range(5):
        t = math.nextafter(t, 1.0)
        near.advance(t)
        assert np.isfinite(near.outputs()).all()
    for instance in (near, plain):
        instance.advance(END)
    np.testing.assert_allclose(near.unknowns()[0], plain.unknowns()[0], rtol=1e-6, atol=1e-6)
