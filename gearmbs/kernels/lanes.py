"""Eight numbers at a time: values that hold the same quantity of eight neighbours, which the processor treats as one.

A table in lanes has `LANES` numbers where a table has one. What `lanes_at` reads of it is added and multiplied like a
number, in compiled code only, and `put_lanes` writes it. Compilers do not find this by themselves in code whose indices
come out of tables.
"""

from __future__ import annotations

from gearmbs.kernels.kinds import deferred

LANES = 8
"""Numbers in a value; processors with narrower registers take several for it."""

lanes_at = deferred("own.lanes", "lanes_at")
"""``lanes_at(array, place)``: lanes in a place of a flat table, ``array[LANES * place : LANES * (place + 1)]``."""
put_lanes = deferred("own.lanes", "put_lanes")
"""``put_lanes(array, place, value)``: write lanes to a place of a flat table."""
all_lanes = deferred("own.lanes", "all_lanes")
"""``all_lanes(number)``: lanes that all hold the same number."""
lanes_of = deferred("own.lanes", "lanes_of")
"""``lanes_of(a, b, c, d, e, f, g, h)``: lanes that hold eight numbers in turn."""
magnitude = deferred("own.lanes", "magnitude")
"""``magnitude(lanes)``: the absolute value in each lane."""
larger_number = deferred("own.lanes", "larger_number")
"""``larger_number(first, second)``: the larger number in each lane, the second where one is none: one instruction,
``maximum`` takes seven."""

# Magnitudes compared as integers, so that the compiler vectorises a maximum and no NaN is lost in it.
#
# The bit pattern of a non-negative double, read as an integer, orders as the number does, with infinity above all
# numbers and NaN above infinity. A maximum over patterns therefore needs no licence to reorder, costs one instruction a
# lane, and comes out as infinity or NaN as soon as one entry is not finite.

bits_of = deferred("own.lanes", "bits_of")
"""``bits_of(value)``: the bit pattern of a double; of magnitudes it orders as they do."""
double_of = deferred("own.lanes", "double_of")
"""``double_of(bits)``: the double with this bit pattern."""
