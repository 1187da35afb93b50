"""Products of small matrices, and sums over the sections of a strip of products of rows."""

from __future__ import annotations

from gearmbs.contact.jit import inlined, summing


@inlined
def row_of(matrix, i):
    """Row of a matrix, six numbers."""
    return matrix[i, 0], matrix[i, 1], matrix[i, 2], matrix[i, 3], matrix[i, 4], matrix[i, 5]


@inlined
def column_of(matrix, i):
    """Column of a matrix, six numbers."""
    return matrix[0, i], matrix[1, i], matrix[2, i], matrix[3, i], matrix[4, i], matrix[5, i]


@inlined
def dot(a, b):
    """Scalar product of six numbers and six others."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@inlined
def add_product(out, left, right, n):
    """Add the product of a 6 x 6 matrix and one of ``n`` columns, all columns side by side: ``out += left right``."""
    a, b, c = row_of(left, 0), row_of(left, 1), row_of(left, 2)
    d, e, f = row_of(left, 3), row_of(left, 4), row_of(left, 5)
    for j in range(n):
        x = column_of(right, j)
        out[0, j] += dot(a, x)
        out[1, j] += dot(b, x)
        out[2, j] += dot(c, x)
        out[3, j] += dot(d, x)
        out[4, j] += dot(e, x)
        out[5, j] += dot(f, x)


@inlined
def add_transposed_product(out, left, right, n):
    """Add the product of a transposed 6 x 6 matrix and one of ``n`` columns: ``out += left^T right``."""
    a, b, c = column_of(left, 0), column_of(left, 1), column_of(left, 2)
    d, e, f = column_of(left, 3), column_of(left, 4), column_of(left, 5)
    for j in range(n):
        x = column_of(right, j)
        out[0, j] += dot(a, x)
        out[1, j] += dot(b, x)
        out[2, j] += dot(c, x)
        out[3, j] += dot(d, x)
        out[4, j] += dot(e, x)
        out[5, j] += dot(f, x)


@inlined
def add_six(total, i, row):
    """Add six numbers to a row of a matrix."""
    v0, v1, v2, v3, v4, v5 = row
    total[i, 0] += v0
    total[i, 1] += v1
    total[i, 2] += v2
    total[i, 3] += v3
    total[i, 4] += v4
    total[i, 5] += v5


@summing
def add_outer(total, a, b, n):
    """Add the sum over the sections of ``a b^T``, the product of all rows of two quantities."""
    for i in range(6):
        v0 = v1 = v2 = v3 = v4 = v5 = 0.0
        for j in range(n):
            x = a[i, j]
            v0 += x * b[0, j]
            v1 += x * b[1, j]
            v2 += x * b[2, j]
            v3 += x * b[3, j]
            v4 += x * b[4, j]
            v5 += x * b[5, j]
        add_six(total, i, (v0, v1, v2, v3, v4, v5))


@summing
def add_two_outers(total, a, b, c, d, n):
    """Add the sum over the sections of ``a b^T + c d^T``."""
    for i in range(6):
        v0 = v1 = v2 = v3 = v4 = v5 = 0.0
        for j in range(n):
            x, y = a[i, j], c[i, j]
            v0 += x * b[0, j] + y * d[0, j]
            v1 += x * b[1, j] + y * d[1, j]
            v2 += x * b[2, j] + y * d[2, j]
            v3 += x * b[3, j] + y * d[3, j]
            v4 += x * b[4, j] + y * d[4, j]
            v5 += x * b[5, j] + y * d[5, j]
        add_six(total, i, (v0, v1, v2, v3, v4, v5))


@summing
def add_stack(total, stack, n):
    """Add the sum over the sections of a matrix a section."""
    for i in range(6):
        v0 = v1 = v2 = v3 = v4 = v5 = 0.0
        for j in range(n):
            v0 += stack[i, 0, j]
            v1 += stack[i, 1, j]
            v2 += stack[i, 2, j]
            v3 += stack[i, 3, j]
            v4 += stack[i, 4, j]
            v5 += stack[i, 5, j]
        add_six(total, i, (v0, v1, v2, v3, v4, v5))


@summing
def add_curvatures(total, weight, hess, n):
    """Add the sum over the sections of symmetric matrices, given by their upper triangles, times a weight."""
    for i in range(6):
        for k in range(i, 6):
            value = 0.0
            for j in range(n):
                value += weight[j] * hess[i, k, j]
            total[i, k] += value
            if k > i:
                total[k, i] += value
