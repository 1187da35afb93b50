"""Views into flat arrays for compiled code, without the price of a slice.

A slice of numba's normalises its bounds and counts a reference, a reshape calls a C function: some 40 ns each, which a
residual of a few microseconds that unpacks two dozen tables cannot afford. These views know that they lie inside, and
live no longer than the array they look into.
"""

from __future__ import annotations

from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from gearmbs._jit import njit


def _view(dimensions: int):
    def typing(array, *places):
        if not isinstance(array, types.Array) or array.layout != "C":
            return None
        if not all(isinstance(place, types.Integer) for place in places):
            return None
        return types.Array(array.dtype, dimensions, "C")(array, *[types.intp] * len(places))

    def codegen(context, builder, signature, args):
        source = make_array(signature.args[0])(context, builder, args[0])
        out = make_array(signature.return_type)(context, builder)
        size = context.get_abi_sizeof(context.get_data_type(signature.return_type.dtype))
        itemsize = context.get_constant(types.intp, size)
        first, *shape = args[1:]
        strides = [itemsize] if dimensions == 1 else [builder.mul(shape[1], itemsize), itemsize]
        populate_array(
            out,
            data=cgutils.gep(builder, source.data, first),
            shape=shape,
            strides=strides,
            itemsize=itemsize,
            meminfo=None,
        )
        return impl_ret_borrowed(context, builder, signature.return_type, out._getvalue())

    return typing, codegen


_VECTOR, _MATRIX = _view(1), _view(2)


@intrinsic
def vector_at(typingctx, array, first, size):
    """Return ``array.ravel()[first : first + size]``."""
    signature = _VECTOR[0](array, first, size)
    return (signature, _VECTOR[1]) if signature is not None else None


@intrinsic
def matrix_at(typingctx, array, first, rows, columns):
    """Return ``array.ravel()[first : first + rows * columns].reshape(rows, columns)``."""
    signature = _MATRIX[0](array, first, rows, columns)
    return (signature, _MATRIX[1]) if signature is not None else None


@njit(cache=True, error_model="numpy", forceinline=True)
def uncounted(array):
    """Return a view of a whole vector without its reference count.

    Every inlined call that is handed a counted array counts up and down, some 12 ns each: a third of a residual. The
    view must not outlive the array.
    """
    return vector_at(array, 0, array.size)


@njit(cache=True, error_model="numpy", forceinline=True)
def uncounted_rows(table):
    """Return a view of a whole matrix without its reference count, as `uncounted` of a vector."""
    return matrix_at(table, 0, table.shape[0], table.shape[1])
