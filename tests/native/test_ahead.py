"""What a wheel brings for exports: objects of all kernels that a model may be made of."""

import numba
import pytest

import gearmbs as gm
from gearmbs.kernels import objects
from gearmbs.kernels.calls import address
from gearmbs.mechanism.forces.functions import by_differences
from gearmbs.native import ahead, export, library
from gearmbs.studies.presets.bench import bench_train
from gearmbs.studies.run.simulation import case_mechanism
from tests.mechanism.test_stepping import flexible_pair, slider_crank
from tests.native.test_functions import restoring
from tests.native.test_library import flexible_on_rolling_bearings, planetary, rolling

pytestmark = pytest.mark.slow


@pytest.fixture
def numbered(monkeypatch):
    """Kernels of the last export, which is not compiled."""
    found = []

    def kept(path, command, others, kernels, *rest):
        found[:] = kernels.found
        path.write_bytes(b"")
        return path

    monkeypatch.setattr(library, "_compile", kept)
    monkeypatch.setattr(library, "c_compiler", lambda *given: ["cc"])
    return found


MODELS = {
    "pair": lambda: case_mechanism(gm.Case()),
    "planetary set": planetary,
    "bench": lambda: bench_train("5 MPa").build(),
    "rolling bearings": rolling,
    "flexible shafts": flexible_on_rolling_bearings,
    "flexible pair": flexible_pair,
    "expressions": slider_crank,
}


LUMPED = ("pair", "bench")
"""Those whose bodies are integrated by angles alone, or as fewer, if that is asked for."""


@pytest.mark.parametrize(("model", "lump"), [*((name, False) for name in MODELS), *((name, True) for name in LUMPED)])
def test_every_kernel_of_a_model_is_compiled_ahead(model, lump, numbered, tmp_path):
    made = MODELS[model]()
    export(made[0] if isinstance(made, tuple) else made, tmp_path, t_end=1e-4, lump=lump)
    assert len(numbered) > 12
    assert {address(kernel) for kernel in numbered} <= set(ahead.exportable())


def test_kernels_behind_functions_of_a_user_are_among_them():
    assert address(by_differences) in ahead.exportable()
    assert address(numba.njit(restoring)) not in ahead.exportable()


def test_objects_have_names_of_their_own_for_each_processor_and_types():
    kernel, signature = ahead.exportable()["gearmbs.native.setting:present_value"]
    names = {objects.file_of_object(kernel, name, signature) for name in ("x86-64-v3", "generic", "native")}
    assert len(names) == 3
    assert all(name.startswith("native.setting.present_value-") for name in names)
