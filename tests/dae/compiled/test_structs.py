"""Structs: the same members in Python and in compiled code, checked when an array is taken."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from numba import float64, int64, njit

from gearmbs.kernels.jit import njit as kernel
from gearmbs.kernels.pointers import direct
from gearmbs.kernels.structs import LINE, BlockLayout, IntVector, Matrix, Struct, Vector
from tests.says import says


class Sample(Struct):
    h: float
    order: int
    open: bool
    y: Vector
    rows: Matrix
    marks: IntVector


@njit(float64(Sample.numba_type, int64))
def work(st, row):
    """Change scalars and arrays of all kinds."""
    st.h += 0.5
    st.order = 2 * st.order + 1
    st.open = not st.open
    st.marks[0] = st.rows.shape[1]
    total = 0.0
    for i in range(st.y.shape[0]):
        st.y[i] += st.rows[row, i]
        total += st.y[i]
    return total


def sample() -> Sample:
    return Sample(y=np.ones(3), rows=np.arange(6.0).reshape(2, 3), marks=np.zeros(2, dtype=np.int64), order=3)


def test_compiled_code_and_python_see_the_same_members():
    st = sample()
    assert (st.h, st.order, st.open) == (0.0, 3, False)
    assert work(st, 1) == 3.0 + 3.0 + 4.0 + 5.0
    assert (st.h, st.order, st.open) == (0.5, 7, True)
    np.testing.assert_array_equal(st.y, [4.0, 5.0, 6.0])
    assert st.marks[0] == 3
    st.h = 2.0
    work(st, 0)
    assert st.h == 2.5


def test_an_array_replaced_in_python_is_the_one_compiled_code_sees():
    st = sample()
    st.y = np.array([10.0, 20.0, 30.0])
    st.rows = np.zeros((2, 3))
    assert work(st, 0) == 60.0


def test_scalars_take_numbers_of_numpy_and_nothing_of_another_kind():
    st = sample()
    st.h, st.order, st.open = np.int64(2), np.int32(5), np.bool_(True)
    assert [(type(value), value) for value in (st.h, st.order, st.open)] == [(float, 2.0), (int, 5), (bool, True)]
    assert work(st, 0) == 3.0 + 3.0
    assert st.order == 11
    for name, wrong in (("h", "2"), ("order", 2.5)):
        with pytest.raises(TypeError):
            setattr(st, name, wrong)


class Twin(Struct):
    h: float
    order: int
    open: bool
    y: IntVector
    rows: Matrix
    marks: IntVector


@njit
def first(st):
    """Return an entry of an array that is of another kind in each of two structs."""
    return st.y[0]


@pytest.mark.slow
def test_structs_with_the_same_record_and_other_arrays_are_told_apart():
    whole = np.full(3, 7)
    twin = Twin(y=whole, rows=np.zeros((2, 3)), marks=whole)
    assert [type(first(st)) for st in (sample(), twin, sample(), twin)] == [float, int, float, int]


def test_a_copy_has_memory_of_its_own():
    st = sample()
    other = pickle.loads(pickle.dumps(st))
    work(other, 1)
    assert other.order == 7
    assert st.order == 3
    np.testing.assert_array_equal(st.y, 1.0)


@pytest.mark.parametrize(
    "wrong", [np.ones(3, dtype=np.float32), np.ones((3, 1)), np.ones(6)[::2], np.zeros(3, dtype=np.int64)]
)
def test_an_array_of_another_kind_is_refused(wrong):
    with pytest.raises(TypeError, match=says("y", "f8", "1", "contiguous array")):
        sample().y = wrong


def test_unknown_and_missing_members_are_named():
    with pytest.raises(TypeError, match="missing marks, rows"):
        Sample(y=np.ones(1))
    with pytest.raises(AttributeError, match=says("Sample", "no attribute", "size")):
        sample().size = 1.0
    with pytest.raises(AttributeError, match="no member 'size'"):
        _ = sample().size


@kernel(float64(Sample.numba_type), cache=True)
def first_of_rows(st):
    """Change a scalar and return an entry."""
    st.order += 1
    return st.rows[0, 0]


def in_block(**members) -> Sample:
    return BlockLayout(Sample, {"y": 3, "marks": 2}, on_line={"y": 1}).new(rows=np.arange(6.0).reshape(2, 3), **members)


def test_arrays_of_a_block_are_zeros_that_both_sides_see():
    st = in_block(order=3)
    assert work(st, 1) == 3.0 + 4.0 + 5.0
    assert (st.h, st.order, st.open, st.marks[0]) == (0.5, 7, True, 3)
    np.testing.assert_array_equal(st.y, [3.0, 4.0, 5.0])
    st.y[:] = 1.0
    assert work(st, 0) == 3.0 + 3.0
    st.y = np.full(3, 10.0)
    assert work(st, 0) == 30.0 + 3.0


def test_arrays_of_a_block_stand_on_lines_of_the_cache_and_apart():
    st = in_block()
    assert st.y[1:].ctypes.data % LINE == 0
    assert st.marks.ctypes.data % LINE == 0
    st.marks[:] = -1
    assert not st.y.any()
    assert (st.rows == np.arange(6.0).reshape(2, 3)).all()


def test_structs_of_one_layout_share_nothing_and_a_pickled_one_is_whole():
    layout = BlockLayout(Sample, {"y": 3, "rows": (2, 3), "marks": 0})
    one, other = layout.new(), layout.new()
    one.y[:] = 1.0
    assert not other.y.any()
    back = pickle.loads(pickle.dumps(one))
    assert back.rows.shape == (2, 3)
    assert work(Sample(y=back.y, rows=back.rows, marks=np.zeros(1, dtype=np.int64)), 0) == 3.0


def test_arrays_outside_a_block_have_to_be_given_and_no_others_are_there():
    layout = BlockLayout(Sample, {"y": 3})
    with pytest.raises(TypeError, match="missing marks, rows"):
        layout.new()
    with pytest.raises(AttributeError, match="no member 'size'"):
        _ = in_block().size


def test_other_members_leave_the_struct_they_come_from_alone():
    st = sample()
    other = st.with_members(y=np.full(3, 7.0), order=9)
    assert (other.order, st.order) == (9, 3)
    assert other.rows is st.rows
    assert work(other, 0) == 21.0 + 3.0
    np.testing.assert_array_equal(st.y, 1.0)


def test_a_direct_call_is_the_same_call():
    st = sample()
    assert direct(first_of_rows)(st) == first_of_rows(st) == 0.0
    assert st.order == 5
    assert direct(first_of_rows) is direct(first_of_rows)
