"""Kernels of which the code does not tell that Python calls them, or with what types: a list, compiled ahead.

`gearmbs.kernels.calls` finds those with a declared signature that Python names. Beside them there are some without one,
which would do with any types, and some that are looked up by their names. The documentation's build holds that its
pages call no others.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import Any

from numba.types import Type, float32, float64, int16, int64

_WORDS, _REALS, _ROWS = int64[::1], float64[::1], float64[:, ::1]
_DEPTHS, _FACING, _OWNERS, _IMAGE = float64[:, ::1], float32[:, :, ::1], int16[:, ::1], float64[:, :, ::1]

ASKED = {
    "gearmbs.bearings.layout:variations": (int64,),
    "gearmbs.contact.laws:damping_of_share": (int64, float64, float64),
    "gearmbs.contact.laws:normal_law": (int64, *[float64] * 6),
    "gearmbs.dae.equations.layout:unpack": (_WORDS, _REALS, _REALS),
    "gearmbs.view.mesh:_corner_normals": (int64[:, ::1], _ROWS, _REALS, _WORDS, _WORDS),
    "gearmbs.view.render:_fill": (_IMAGE, _IMAGE, int64, _DEPTHS, _FACING, _OWNERS),
    "gearmbs.view.render:_shade": (_DEPTHS, _FACING, _OWNERS, _ROWS, float64, _IMAGE),
}
"""Types of the arguments of each, by its module and name."""

LOOKED_UP = tuple(
    f"gearmbs.dae.equations.expressions.evaluate:{name}" for name in ("eval_gradient", "update_angles", "angle_rates")
)
"""Kernels with a declared signature that kernels call, and Python by an address that is looked up by their names."""

LINKED = ("gearmbs.dae.integrators.differences:difference_matrix",)
"""Kernels that functions of a user's are compiled with, and no others: parts."""


def asked() -> Iterator[tuple[Any, tuple[Type, ...]]]:
    """Yield the kernels that Python calls, each with the types of its arguments."""
    for name, told in ASKED.items():
        yield _kernel(name), told
    for name in LOOKED_UP:
        kernel = _kernel(name)
        yield kernel, kernel.declared_types()[0]


def linked() -> Iterator[Any]:
    """Yield the kernels that functions of a user's are compiled with, and no others."""
    return map(_kernel, LINKED)


def _kernel(address: str) -> Any:
    module, _, name = address.partition(":")
    return getattr(import_module(module), name)


def texts() -> set[tuple[str, str]]:
    """Return module and name of each kernel that Python calls, and its types as numba tells them."""
    return {(f"{k.__module__}:{k.__name__}", ", ".join(map(str, args))) for k, args in asked()}
