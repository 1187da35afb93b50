"""The tables of a pair as records: its header of integers and of reals, the scratch and its strips."""

from __future__ import annotations

from numba import types

from gearmbs.contact import layout as L
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
