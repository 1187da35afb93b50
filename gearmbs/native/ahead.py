"""Objects of all kernels that exported models are made of, compiled ahead of any export.

They are what `gearmbs.native.kernels.Kernels` may number: the driver's, those of the equations, and every kernel that
tables hold by address, which goes by its signature. `gearmbs.kernels.ship` puts them into a wheel.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from functools import cache as cached
from functools import partial
from multiprocessing import get_context
from typing import Any

from gearmbs.contact.kernel import GEAR_CONTACT_SIG
from gearmbs.dae.equations import expressions
from gearmbs.dae.equations.fixed_axes import axes_hook, axes_jacobian, axes_residual
from gearmbs.dae.equations.jacobian import jacobian
from gearmbs.dae.equations.kinematics import hook
from gearmbs.dae.equations.loads.expressions import KERNELS
from gearmbs.dae.equations.loads.forces import FORCE_SIG, TURNING_SIG
from gearmbs.dae.equations.residual import residual
from gearmbs.dae.model.elastic import elastic_frames
from gearmbs.dae.model.evaluator import evaluate_rows
from gearmbs.dae.model.fixed_axes import evaluate_axes
from gearmbs.dae.model.kinetic import write_kinetic_energy
from gearmbs.dae.model.members import expand
from gearmbs.drivetrain.torque_element import LAW_SIG
from gearmbs.kernels import cache
from gearmbs.kernels.ahead import Report
from gearmbs.kernels.calls import address, entries, import_all, kernel_modules, kernels
from gearmbs.kernels.objects import compiled_object, file_of_object
from gearmbs.kernels.pointers import no_events, no_hook
from gearmbs.mechanism.language.series import evaluate_series
from gearmbs.native.kernels import BY_ADDRESS, CALLED, OF_MOTIONS
from gearmbs.system import cores

OF_EQUATIONS = (
    residual, jacobian, hook, no_hook, no_events, evaluate_rows, evaluate_series, elastic_frames, write_kinetic_energy,
    axes_residual, axes_jacobian, axes_hook, evaluate_axes, expand,
    *(getattr(expressions, name) for name in KERNELS),
)  # fmt: skip
"""Kernels of the equations and of what is told, which are in tables, or stand behind the driver by name."""


@cached
def exportable() -> dict[str, tuple[Any, Any]]:
    """Return kernels and signatures, None where they are declared, of all that an exported model may be made of."""
    import_all()
    known = kernels(kernel_modules())
    held = {_types(signature) for signature in (FORCE_SIG, TURNING_SIG, LAW_SIG, GEAR_CONTACT_SIG)}
    by_address = [k for k in entries(known) if k.declared_types() in held]
    plain = [*BY_ADDRESS, *OF_EQUATIONS, *by_address, *(k for k in known if k.late)]
    called = [*CALLED.values(), *OF_MOTIONS.values()]
    return {address(k): (k, None) for k in plain} | {address(k): (k, signature) for k, signature in called}


def _types(signature: Any) -> tuple[tuple, Any]:
    return tuple(signature.args), signature.return_type


def compile_objects(
    processor: str = cache.COMMON[0], report: Report | None = None, workers: int | None = None
) -> list[str]:
    """Compile and keep all objects that are not on disk; return the names of their files.

    Parameters
    ----------
    processor : str
        See `gearmbs.kernels.objects.compiled_object`.
    report : callable, optional
        Called with the name of each kernel that is ready.
    workers : int, optional
        Processes at a time; by default, as many as there are cores for this process.
    """
    wanted = exportable()
    files = {name: file_of_object(kernel, processor, signature) for name, (kernel, signature) in wanted.items()}
    missing = [name for name, file in files.items() if not any((f / file).exists() for f in cache.folders("gearmbs"))]
    if missing:
        # callers first: they take longest
        with ProcessPoolExecutor(min(workers or cores(), len(missing)), get_context("spawn")) as pool:
            for name in pool.map(partial(_compile, processor), missing):
                if report is not None:
                    report(name)
    return list(files.values())


def _compile(processor: str, name: str) -> str:
    """Compile the object of a kernel that is told by module and name, in a process of its own."""
    kernel, signature = exportable()[name]
    compiled_object(kernel, processor, signature)
    return name
