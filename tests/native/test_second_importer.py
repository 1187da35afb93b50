"""FMUs in libcosim, which reads and runs them by Modelon's FMI Library and knows FMI 2."""

import platform
import shutil

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.native import export
from gearmbs.studies.presets.bench import bench_train
from gearmbs.studies.run.simulation import case_mechanism
from tests.native.test_library import expected

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed"),
    pytest.mark.skipif(platform.system() != "Linux" or platform.machine() != "x86_64", reason="POSIX: linked on Linux"),
]
STEP = 100_000
"""Between two points of communication, ns, in which libcosim counts."""


def pair():
    return case_mechanism(gm.Case()), {}, ("load.torque", 60.0)


def bench():
    train = bench_train("5 MPa")
    return train.build(), {"tol": 1e-6, "rate_scale": train.rate_scale}, ("mount 1.stiffness_x", 3.5e6)


@pytest.mark.parametrize("model", [pair, bench])
def test_libcosim_tells_what_a_simulator_tells(model, tmp_path):
    """Every output at a hundred points, a number set at the fortieth: bit for bit."""
    pytest.importorskip("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    fmpy = pytest.importorskip("fmpy")
    m, options, (name, value) = model()
    made = export(m, tmp_path, t_end=0.1, target="fmu2", processor="native", **options)
    told = fmpy.read_model_description(str(made.library)).modelVariables
    references = {variable.name: variable.valueReference for variable in told}
    outputs = [references[output] for output in made.outputs]

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_step_size(STEP)
    slave = CosimLocalSlave(str(made.library), "model")
    # what it cannot load is a null pointer, which it would follow
    assert slave.ptr()
    index = execution.add_local_slave(slave)
    setting, looking = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(setting)
    execution.add_observer(looking)
    sim = gm.Simulator(m, 0.1, lump=False, **options)
    for k in range(100):
        if k == 40:
            setting.slave_real_values(index, [references[name]], [value])
            sim.set(name, value)
        assert execution.step()
        sim.advance((k + 1) * STEP / 1e9)
        wanted = [expected(m, sim, output) for output in made.outputs]
        np.testing.assert_array_equal(looking.last_real_values(index, outputs), wanted)
