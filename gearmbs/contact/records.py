"""How kernels of contact are compiled, and the records as which they see a pair's tables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearmbs.contact import layout as L
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.views import behind, header, numbers, rows

options_at = header(L.OPTIONS)
"""``options_at(gi)``: the header of a pair's integers."""
pair_at = header(L.PAIR)
"""``pair_at(gr)``: the header of its reals."""
scratch_at = header(L.SCRATCH, L.CACHE_LINE)
"""``scratch_at(work)``: the scratch record; strips follow."""

integers_of = numbers(types.int64)
"""``integers_of(options)``: all of ``gi``."""
reals_of = numbers(types.float64)
"""``reals_of(wheels)``: all of ``gr``."""

strip_at = behind(L.STRIP, L.SCRATCH)
"""``strip_at(scratch, k)``: strip ``k`` behind the scratch record."""
rows_of = rows(L.STRIP, L.LANES)
"""``rows_of(strip)``: all its rows, (rows, LANES)."""


# How kernels of contact compile: cached, without Python's division checks; products may be contracted with sums.
#
# A quotient may become a product with the reciprocal, which is one unit in the last place less exact: loops over
# sections divide by what all of them share, and a division costs as much as ten products.


CONTRACT = {"contract": True, "arcp": True}
REASSOCIATE = {**CONTRACT, "reassoc": True}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for use inside other kernels."""
    return njit(cache=True, error_model="numpy", fastmath=CONTRACT)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a small function that disappears in its callers, so that their loops over sections become vectors."""
    return njit(cache=True, error_model="numpy", fastmath=CONTRACT, forceinline=True)(function)


def summing(function: Callable[..., Any]) -> Any:
    """Compile a function whose sums over sections may be added up in any order, lane by lane."""
    return njit(cache=True, error_model="numpy", fastmath=REASSOCIATE)(function)
