"""Calls through addresses: kernels compiled apart meet at run time.

Numba compiles everything a function calls into the function's own code. The contact and expression
kernels are large and are called from several of the equations' kernels, which would make each of them
large too, and would recompile all of them when one changes. So the equations call them through
addresses that stand in the header of the tables, put there when the tables are packed in this process.
"""

from __future__ import annotations

import importlib

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

VEC = types.float64[::1]
MAT = types.float64[:, ::1]
IVEC = types.int64[::1]
F8 = types.float64
I8 = types.int64

CONTACT, VALUE, GRADIENT, SECOND, TIME, ANGLES, ANGLE_RATES = range(7)

_TABLES = (IVEC, VEC)
_STATE = (F8, MAT, IVEC, MAT, VEC, VEC)

SIGNATURES = (
    types.void(IVEC, VEC, VEC, MAT, VEC, VEC, VEC, MAT, VEC, VEC, VEC, MAT, VEC, I8, VEC),
    F8(*_TABLES, *_STATE, VEC),
    F8(*_TABLES, *_STATE, VEC, VEC),
    F8(*_TABLES, *_STATE, VEC, VEC, VEC),
    types.void(*_TABLES, F8, VEC, VEC),
    types.void(*_TABLES, *_STATE, VEC),
    types.void(*_TABLES, *_STATE, VEC, VEC, VEC),
)

NAMES = (
    ("gearmbs.contact", "gear_contact"),
    ("gearmbs.dae.equations.expressions", "eval_value"),
    ("gearmbs.dae.equations.expressions", "eval_gradient"),
    ("gearmbs.dae.equations.expressions", "eval_second"),
    ("gearmbs.dae.equations.expressions", "eval_time"),
    ("gearmbs.dae.equations.expressions", "update_angles"),
    ("gearmbs.dae.equations.expressions", "angle_rates"),
)


def _caller(signature):
    function = types.FunctionType(signature)

    @intrinsic
    def function_at(typingctx, address):
        def codegen(context, builder, sig, args):
            value = cgutils.create_struct_proxy(function)(context, builder)
            null = cgutils.get_null_value(cgutils.voidptr_t)
            value.c_addr = null
            value.py_addr = null
            value.jit_addr = builder.inttoptr(args[0], cgutils.voidptr_t)
            return value._getvalue()

        return function(types.int64), codegen

    return function_at


contact_at = _caller(SIGNATURES[CONTACT])
value_at = _caller(SIGNATURES[VALUE])
gradient_at = _caller(SIGNATURES[GRADIENT])
second_at = _caller(SIGNATURES[SECOND])
time_at = _caller(SIGNATURES[TIME])
angles_at = _caller(SIGNATURES[ANGLES])
angle_rates_at = _caller(SIGNATURES[ANGLE_RATES])


def addresses() -> list[int]:
    """Return the addresses of the kernels in this process, in the order of `NAMES`."""
    out = []
    for (module, name), signature in zip(NAMES, SIGNATURES):
        dispatcher = getattr(importlib.import_module(module), name)
        compiled = dispatcher.overloads[signature.args]
        out.append(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))
    return out
