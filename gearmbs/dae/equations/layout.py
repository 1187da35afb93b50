"""The flat tables of a mechanism, as the compiled kernels read them.

``idata`` starts with a header of counts and offsets (the constants ``H_*``); every other table is a
run of ``idata`` or ``rdata``.  :func:`unpack` turns the two arrays into named views.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from gearmbs.dae.equations.rotation import KIN_COLUMNS
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import IMAT, IVEC, MAT, VEC
from gearmbs.kernels.structs import matrix_at, vector_at

H_BODIES = 0
"""Bodies including the ground, which is body 0."""
H_MARKERS = 1
H_ROWS = 2
H_TERMS = 3
H_FORCES = 4
H_FUNCTIONS = 5
H_FORMULATION = 6
H_UNKNOWNS = 7
H_U = 8
H_P = 9
H_EPS = 10
H_R = 11
H_THETA = 12
H_LAMBDA = 13
H_F = 14
H_N = 15
H_MU = 16
H_SLOTS = 17
H_I_CODE = 18
H_I_MARKER_BODY = 19
H_I_ROW = 20
H_I_TERM = 21
H_I_FORCE = 22
H_I_FUNCTION = 23
H_I_EXTRA = 24
H_I_SLOT = 25
H_R_GRAVITY = 26
H_R_BODY = 27
H_R_MARKER = 28
H_R_COEF = 29
H_R_FUNCTION = 30
H_R_EXTRA = 31
H_N_EXTRA_I = 32
H_N_EXTRA_R = 33
H_N_FUNCTION_R = 34
H_W_KIN = 35
H_W_MARKER = 36
H_W_SCRATCH = 37
H_WORK = 38
H_R_REFERENCE = 39
H_Z = 40
"""First of the user-defined states z, between N and mu."""
H_STATES = 41
H_TAPES = 42
H_I_STATE = 43
H_I_TAPE = 44
H_W_FUNCTION = 45
H_W_TAPE = 46
H_W_TAPE_SIZE = 47
H_MODE = 48
"""What `jacobian` and `saddle` do with the entries: add up numbers, note places, count."""
H_ANGLES = 49
"""Number of the angles that force elements count."""
H_I_ANGLE = 50
H_DIAGNOSTICS = 51
"""Most diagnostics of a force element."""
H_I_AT = 52
"""The table of the bodies' places among the unknowns, columns ``AT_*``."""
H_PF = 53
H_VF = 54
H_QF = 55
H_COORDINATES = 56
"""Number of spatial displacements, six a body, and modal coordinates."""
H_FRAMES = 57
"""Rows of the kinematics table: the bodies, then the elastic frames of modal bodies."""
H_R_MODAL = 58
"""Integrals of modal bodies and shapes of elastic frames."""
H_N_MODAL = 59
H_W_PARTIAL = 60
"""Partial derivatives of elastic frames, see `gearmbs.dae.equations.bodies.frames`."""
H_N_PARTIAL = 61
H_SIZE = 62

HEAD_OF_BLOCK = {
    H_U: "u", H_P: "p", H_PF: "p_f", H_EPS: "eps", H_VF: "v_f", H_R: "R", H_THETA: "theta", H_QF: "q_f",
    H_LAMBDA: "lambda", H_F: "F", H_N: "N", H_Z: "z", H_MU: "mu",
}  # fmt: skip
"""Where the header holds the offset of a block of y."""

AT_U = 0
"""Index in y of a body's first velocity; likewise the next four. Each is the first of three entries; a body without
Euler angles has no places for p, eps and theta."""
AT_P = 1
AT_EPS = 2
AT_R = 3
AT_THETA = 4
AT_PF = 5
"""Index in y of a body's first modal momentum; likewise modal velocity and modal coordinate."""
AT_VF = 6
AT_QF = 7
AT_MODES = 8
"""Number of modal coordinates of a body, zero of a rigid one."""
AT_V = 9
"""Place of the first of v, omega (six entries) among the spatial accelerations and displacements."""
AT_V_MODES = 10
"""Place of the first modal acceleration or displacement there."""
AT_BODY = 11
"""The body an elastic frame belongs to; a body's own number."""
AT_SHAPE = 12
"""Offset of an elastic frame's shapes among the modal reals: s0, phi_k, psi_k; -1 of a body."""
AT_PARTIAL = 13
"""Offset of an elastic frame's partial derivatives, or of a modal body's present state."""
AT_MODAL = 14
"""Offset of a modal body's integrals, or of a point mass's orientation, among the modal reals; -1 of a rigid body."""
AT_ANGLES = 15
"""Number of Euler angles of a body; without them it does not turn."""
AT_COLUMNS = 16

BODY_MASS = 0
BODY_INERTIA = 1
"""About the centre of mass, body components; of a modal body as it is deformed at present."""
BODY_COLUMNS = 10

MARKER_COLUMNS = 12
"""Origin and row-major orientation, in body components."""

MK_ARM = 0
"""In the scratch marker table: origin relative to the body's centre of mass, global components."""
MK_AXES = 3
"""In the scratch marker table: the three axes one after the other, global components."""
MK_COLUMNS = 12

TERM_TYPE = 0
TERM_I = 1
TERM_J = 2
TERM_AXES = 3
"""3 * (axis of I) + axis of J, or the component of a point term."""
TERM_FUNCTION = 4
TERM_COLUMNS = 5

ROW_FIRST = 0
ROW_FUNCTION = 1
ROW_TAPE = 2
"""Tape of a general constraint, or -1."""
ROW_COLUMNS = 3

FORCE_KIND = 0
FORCE_I = 1
FORCE_J = 2
FORCE_F = 3
"""Index in y of the first component of the force F, or -1."""
FORCE_N = 4
"""Index in y of the first component of the torque N, or -1."""
FORCE_IEXTRA = 5
FORCE_REXTRA = 6
FORCE_RM = 7
FORCE_WANT = FORCE_RM
"""Column of a compiled element, which has no marker RM: what its kernel is asked for whenever the equations are
evaluated."""
FORCE_WORK = 8
"""Offset in the scratch of the element's wrenches, rates, diagnostics, frames and inputs, then its own."""
FORCE_DEPENDS = 9
"""Offset in the extra integers of the dependency list: count and bodies, count and unknowns."""
FORCE_WIDTH = 10
"""Columns of the element's derivative matrix."""
FORCE_ADDRESS = 11
"""Address of the kernel in this process."""
FORCE_SEES = 12
"""Offset in the extra integers of what the kernel sees: count and markers, functions of time, counted angles."""
FORCE_WRENCHES = 13
FORCE_PART = 14
"""Which of the wrenches acts here; the row of the first, 0, goes before those of the others."""
FORCE_Z = 15
"""Index in y of the first of the element's own states."""
FORCE_STATES = 16
FORCE_DIAGNOSTICS = 17
FORCE_COLUMNS = 18

COMPILED = 0
"""Kind of a force element with a kernel of its own, see `gearmbs.dae.equations.loads.forces`."""
EXPRESSION = 1
"""Components given by expressions, see `gearmbs.dae.equations.loads.expressions`."""
REACTION = 2
"""What constraint rows exert, see `gearmbs.dae.equations.loads.reactions`."""

ANGLE_AXIS = 0
ANGLE_I = 1
ANGLE_J = 2
ANGLE_AT = 3
"""Offset in the extra reals of the angle's reference, last value and last rate."""
ANGLE_COLUMNS = 4

FUNCTION_KIND = 0
FUNCTION_OFFSET = 1
"""Offset of the parameters, or the tape of an expression of time."""
FUNCTION_COLUMNS = 2
FUNCTION_VALUES = 3
"""Value and two derivatives, in scratch."""

FRAME_VARIATIONS = 12
"""Columns of derivatives a frame: displacement, rotation, and the changes of its velocity and angular velocity."""

TAPE_I = 0
TAPE_I_SIZE = 1
TAPE_R = 2
TAPE_R_SIZE = 3
TAPE_REFERENCE = 4
TAPE_REFERENCE_SIZE = 5
TAPE_BODIES = 6
"""Offset in the extra integers of the bodies, then the unknowns, the tape depends on; then its first marker or -1."""
TAPE_N_BODIES = 7
TAPE_N_UNKNOWNS = 8
TAPE_ADDRESS = 9
"""Addresses of the kernels that evaluate it, in the order of `gearmbs.dae.equations.loads.expressions.KERNELS`."""
TAPE_KERNELS = 6
TAPE_COLUMNS = TAPE_ADDRESS + TAPE_KERNELS

STATE_KIND = 0
STATE_TAPE = 1
STATE_COLUMNS = 2
STATE_DIFFERENTIAL = 0
"""z' = f(...)"""
STATE_ALGEBRAIC = 1
"""z = f(...)"""

SCRATCH_FIXED = 512
"""Scratch for gradients, Hessians and small vectors; then an element's derivatives, then what elements have of their
own."""

Tables = namedtuple(
    "Tables",
    "at code marker_body row term force function extra_i slot state tape angle "
    "gravity body marker coef function_r extra_r reference winding seen modal kin frame fval scratch tape_work partial",
)
TABLES = types.NamedTuple(
    (
        IMAT, IVEC, IVEC, IMAT, IMAT, IMAT, IMAT, IVEC, IVEC, IMAT, IMAT, IMAT,
        VEC, MAT, MAT, VEC, VEC, VEC, VEC, VEC, VEC, VEC, MAT, MAT, MAT, VEC, VEC, VEC,
    ),
    Tables,
)  # fmt: skip
"""Type of what `unpack` returns, for the signatures of late kernels."""


@njit(cache=True, error_model="numpy", forceinline=True)
def unpack(idata, rdata, work):
    """Return the named views of the flat tables; nothing is copied.

    The views are some 1.6 kB of addresses and sizes, which every call that is handed them would copy. So this and the
    small kernels of the residual are inlined by force, and what they do not look at is never made.
    """
    bodies = idata[H_BODIES]
    markers = idata[H_MARKERS]
    rows = idata[H_ROWS]
    terms = idata[H_TERMS]
    forces = idata[H_FORCES]
    functions = idata[H_FUNCTIONS]
    i = idata
    r = rdata
    reference = i[H_R_REFERENCE]
    return Tables(
        matrix_at(i, i[H_I_AT], i[H_FRAMES], AT_COLUMNS),
        vector_at(i, i[H_I_CODE], bodies),
        vector_at(i, i[H_I_MARKER_BODY], markers),
        matrix_at(i, i[H_I_ROW], rows + 1, ROW_COLUMNS),
        matrix_at(i, i[H_I_TERM], terms, TERM_COLUMNS),
        matrix_at(i, i[H_I_FORCE], forces, FORCE_COLUMNS),
        matrix_at(i, i[H_I_FUNCTION], functions, FUNCTION_COLUMNS),
        vector_at(i, i[H_I_EXTRA], i[H_N_EXTRA_I]),
        vector_at(i, i[H_I_SLOT], i[H_SLOTS]),
        matrix_at(i, i[H_I_STATE], i[H_STATES], STATE_COLUMNS),
        matrix_at(i, i[H_I_TAPE], i[H_TAPES], TAPE_COLUMNS),
        matrix_at(i, i[H_I_ANGLE], i[H_ANGLES], ANGLE_COLUMNS),
        vector_at(r, i[H_R_GRAVITY], 3),
        matrix_at(r, i[H_R_BODY], bodies, BODY_COLUMNS),
        matrix_at(r, i[H_R_MARKER], markers, MARKER_COLUMNS),
        vector_at(r, i[H_R_COEF], terms),
        vector_at(r, i[H_R_FUNCTION], i[H_N_FUNCTION_R]),
        vector_at(r, i[H_R_EXTRA], i[H_N_EXTRA_R]),
        vector_at(r, reference, terms),
        vector_at(r, reference + terms, 2 * terms + 1),
        vector_at(r, reference + 3 * terms + 1, 3 * bodies),
        vector_at(r, i[H_R_MODAL], i[H_N_MODAL]),
        matrix_at(work, i[H_W_KIN], i[H_FRAMES], KIN_COLUMNS),
        matrix_at(work, i[H_W_MARKER], markers, MK_COLUMNS),
        matrix_at(work, i[H_W_FUNCTION], functions, 3),
        vector_at(work, i[H_W_SCRATCH], work.size - i[H_W_SCRATCH]),
        vector_at(work, i[H_W_TAPE], i[H_W_TAPE_SIZE]),
        vector_at(work, i[H_W_PARTIAL], i[H_N_PARTIAL]),
    )


# --- the same for Python, which needs no kernel for it --------------------------------------------------


def rows_in(table: np.ndarray, first: int, rows: int, columns: int) -> np.ndarray:
    """Return the view of ``rows`` rows that begin at ``first`` of a packed table."""
    return table[first : first + rows * columns].reshape(rows, columns)


def kinematics_in(idata: np.ndarray, work: np.ndarray) -> np.ndarray:
    """Return the kinematics table, shape (frames, KIN_COLUMNS)."""
    return rows_in(work, int(idata[H_W_KIN]), int(idata[H_FRAMES]), KIN_COLUMNS)


def forces_in(idata: np.ndarray) -> np.ndarray:
    """Return the table of force elements, shape (elements, FORCE_COLUMNS)."""
    return rows_in(idata, int(idata[H_I_FORCE]), int(idata[H_FORCES]), FORCE_COLUMNS)


def states_in(idata: np.ndarray) -> np.ndarray:
    """Return the table of states of expressions, shape (states, STATE_COLUMNS)."""
    return rows_in(idata, int(idata[H_I_STATE]), int(idata[H_STATES]), STATE_COLUMNS)
