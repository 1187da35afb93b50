"""Which kernels an exported model is made of: those of the driver, of the equations, and of the elements it has."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from gearmbs.dae.equations import layout as T
from gearmbs.dae.integrators.algebraic.between import settle_output
from gearmbs.dae.integrators.algebraic.part import PART_TYPE
from gearmbs.dae.integrators.run_state import STATE_TYPE
from gearmbs.dae.integrators.step import advance
from gearmbs.dae.integrators.stepping.jumps import pass_jump, steer
from gearmbs.dae.integrators.stepping.memory import value_between
from gearmbs.dae.integrators.stepping.reach import reach
from gearmbs.dae.linalg.left_out import converges_without
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE, scale_and_choose
from gearmbs.dae.linalg.pivoting import LINES_TYPE
from gearmbs.dae.linalg.plan_lists import lists_of_plan
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, factor, solve
from gearmbs.dae.model.elastic import elastic_frames
from gearmbs.dae.model.evaluator import evaluate_rows
from gearmbs.dae.model.kinetic import write_kinetic_energy
from gearmbs.dae.model.members import expand
from gearmbs.dae.problem import ModelError
from gearmbs.kernels.bound import FUNCTIONS_TYPE, NAMES
from gearmbs.kernels.jit import Kernel
from gearmbs.kernels.kinds import float64, int64
from gearmbs.kernels.pointers import address, no_events, no_hook
from gearmbs.mechanism.language.series import evaluate_series
from gearmbs.mechanism.solve.told import Begun
from gearmbs.native.afresh import AFRESH_TYPE, start_afresh
from gearmbs.native.driver import DRIVER_TYPE, go_to
from gearmbs.native.pivots import ROOM_TYPE, choose_for_run
from gearmbs.native.setting import apply, present_value
from gearmbs.native.teller import TELLER_TYPE, choose_for_outputs, factor_for_outputs, tell

if TYPE_CHECKING:
    from gearmbs.kernels.objects import Object

_PLANNED = PLAN_TYPE, FACTORS_TYPE
_ROOM = ROOM_TYPE, LINES_TYPE, LINES_TYPE
CALLED = {
    "go_to": (go_to, int64(FUNCTIONS_TYPE, STATE_TYPE, PART_TYPE, *_PLANNED, DRIVER_TYPE, float64)),
    "apply": (apply, int64(FUNCTIONS_TYPE, STATE_TYPE, *_PLANNED, DRIVER_TYPE, int64)),
    "present_value": (present_value, float64(STATE_TYPE, DRIVER_TYPE, int64)),
    "choose_for_run": (choose_for_run, int64(STATE_TYPE, DRIVER_TYPE, *_ROOM, *_PLANNED)),
    "tell": (tell, int64(STATE_TYPE, DRIVER_TYPE, TELLER_TYPE, *_PLANNED, int64)),
    "choose_for_outputs": (choose_for_outputs, int64(STATE_TYPE, DRIVER_TYPE, TELLER_TYPE, *_ROOM, *_PLANNED)),
    "factor_for_outputs": (factor_for_outputs, int64(DRIVER_TYPE, TELLER_TYPE, *_PLANNED)),
}
"""Kernels that the hand-written part calls, by what it calls them, with their signatures (``source/model.h``)."""
OF_MOTIONS = {
    "start_afresh": (
        start_afresh,
        int64(FUNCTIONS_TYPE, STATE_TYPE, PART_TYPE, *_PLANNED, DRIVER_TYPE, *_ROOM, AFRESH_TYPE, int64),
    ),
}
"""The same of models with inputs that prescribe motions."""


BY_ADDRESS = (
    advance, reach, value_between, settle_output, steer, pass_jump, scale_and_choose, lists_of_plan, factor, solve,
    converges_without,
)  # fmt: skip
"""Kernels that those call by the addresses in `gearmbs.native.driver.Driver`."""


class Objects(NamedTuple):
    """Objects of what is called by name, of numbered kernels, and of late ones by their names."""

    called: dict[str, Object]
    numbered: list[Object]
    late: dict[str, Object]


class Kernels:
    """The kernels of a model, numbered as they are asked for.

    Parameters
    ----------
    begun : Begun
        A run; its tables hold the addresses of the elements' kernels.
    motions : bool
        Whether inputs that prescribe motions can be set.
    """

    def __init__(self, begun: Begun, motions: bool) -> None:
        problem, model = begun.problem, begun.system.model
        self._called = {**CALLED, **(OF_MOTIONS if motions else {})}
        self._by_name: dict[str, Any] = {
            **{kernel.__name__: kernel for kernel in BY_ADDRESS},
            "evaluate_rows": evaluate_rows,
            "expand": expand,
            "write_kinetic_energy": write_kinetic_energy,
            "evaluate_series": evaluate_series,
            "elastic_frames": elastic_frames,
            "residual": problem.residual,
            "jacobian": problem.jacobian,
            "hook": problem.hook or no_hook,
            "events": no_events,
        }
        if begun.by_axes:
            # its kernels are of use to those alone who have such a model
            from gearmbs.dae.model.fixed_axes import evaluate_axes

            self._by_name["evaluate_axes"] = evaluate_axes
        own = [(kernel, None) for kernel in model.kernels.values()] + list(model.own_functions.values())
        self._own = {
            address(kernel, kernel.declared if signature is None else signature): (kernel, signature)
            for kernel, signature in own
            if hasattr(kernel, "py_func")
        }
        self._signatures: dict[Any, Any] = {}
        self.found: list[Any] = []
        states = len(model.states) + len(model.tapes) + sum(model.modes)
        self.needs_late = states > 0 or bool((model.forces[:, T.FORCE_KIND] == T.REACTION).any())

    def number(self, asked: int | str) -> int:
        """Return the number of a kernel by its name or by its address in this process.

        Raises
        ------
        ModelError
            For a function that is none of compiled code that can be exported.
        """
        if isinstance(asked, str):
            kernel, signature = self._by_name[asked], None
        else:
            kernel, signature = self._own.get(asked) or (_named(NAMES[asked]), None)
        if not hasattr(kernel, "py_func"):
            told = asked if isinstance(asked, str) else NAMES[asked]
            raise ModelError(
                f"function {told!r}: it is one of Python and cannot be exported; compile it with numba.njit"
            )
        if kernel not in self.found:
            self.found.append(kernel)
            self._signatures[kernel] = signature
        return self.found.index(kernel)

    def objects(self, processor: str, triple: str, report: Callable[[str], None]) -> Objects:
        """Return the objects of all kernels for a processor and a system; ``report`` is told the name of each."""
        # what the plain mode does without
        from gearmbs.kernels.objects import compiled_object, object_of_function

        called = {}
        for name, (kernel, signature) in self._called.items():
            report(name)
            called[name] = compiled_object(kernel, processor, signature, triple)
        numbered = []
        for number, kernel in enumerate(self.found):
            report(kernel.__name__)
            if isinstance(kernel, Kernel):
                numbered.append(compiled_object(kernel, processor, triple=triple))
                continue
            try:
                numbered.append(object_of_function(kernel, processor, self._signatures[kernel], str(number), triple))
            except ValueError as error:
                raise ModelError(str(error)) from None
            except TypeError as error:
                # numba's, of code that goes back to Python
                raise ModelError(
                    f"function {kernel.__name__!r}: it cannot be compiled without Python ({error}); leave out objmode "
                    "and what else calls Python"
                ) from None
        late: dict[str, Object] = {}
        waiting = [name for one in (*called.values(), *numbered) for name in one.late] if self.needs_late else []
        while waiting:
            name = waiting.pop()
            if name not in late:
                module, _, kernel_name = name.partition(":")
                report(kernel_name)
                found = getattr(importlib.import_module(module), kernel_name)
                late[name] = compiled_object(found, processor, triple=triple)
                waiting += late[name].late
        return Objects(called, numbered, late)


def _named(name: str) -> Any:
    """Return a function of the package by its module and name, None for any other."""
    module, _, function = name.rpartition(".")
    return getattr(importlib.import_module(module), function, None) if name.startswith("gearmbs.") else None
