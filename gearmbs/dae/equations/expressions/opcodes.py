"""Instruction codes and layout of an expression tape, and the columns of the tables of bodies that it reads.

A tape is two flat arrays.  ``ints`` holds a header, the lists of bodies and algebraic unknowns the
expression depends on, and the instructions; ``floats`` holds constants and spline tables.
Instruction ``k`` writes register ``k`` (static single assignment), so operands are register numbers.
"""

from __future__ import annotations

HEAD_COUNT = 0
"""Number of instructions."""
HEAD_RESULT = 1
"""Register of the value."""
HEAD_BODIES = 2
"""Number of bodies in the gradient."""
HEAD_ALGEBRAIC = 3
"""Number of algebraic unknowns in the gradient."""
HEAD_BODY_LIST = 4
"""Offset of the list of bodies (rows of the kinematics table)."""
HEAD_ALGEBRAIC_LIST = 5
"""Offset of the list of indices into y."""
HEAD_CODE = 6
"""Offset of the first instruction."""
HEAD_ANGLES = 7
"""Number of reference angles (entries of ``ref``)."""
HEAD_EXTERNAL = 8
"""Scratch at the end of ``work`` for functions of the user."""
HEAD_SIZE = 9

WIDTH = 10
"""Integers an instruction takes: code, operands a b c d e, gradient slots of up to four bodies."""

KIN_R = 0
"""Columns of the kinematics table, one row a body, row 0 the ground: position of the body frame's origin."""
KIN_V = 3
"""Velocity of the origin."""
KIN_A = 6
"""Orientation, row-major 3x3: columns are the body axes in global components."""
KIN_W = 15
"""Global angular velocity."""
KIN_AXES = 18
"""The three Euler axes a_1, a_2, a_3 in global components; only second derivatives read them."""

ACC_A = 0
"""Columns of the acceleration table: acceleration of the body frame's origin."""
ACC_ALPHA = 3
"""Global angular acceleration."""


# leaves
CONST = 0
TIME = 1
ALGEBRAIC = 2
DISPLACEMENT = 3
VELOCITY = 4
ANGULAR_VELOCITY = 5
ACCELERATION = 6
ANGULAR_ACCELERATION = 7
FORCE = 8
COSINE = 9
RADIAL_VELOCITY = 10
EULER_PARAMETER = 11
LAST_LEAF = 11

# one operand
FIRST_UNARY = 20
NEG = 20
ABS = 21
SQRT = 22
EXP = 23
LOG = 24
LOG10 = 25
SIN = 26
COS = 27
TAN = 28
ASIN = 29
ACOS = 30
ATAN = 31
SINH = 32
COSH = 33
TANH = 34
AINT = 35
ANINT = 36
STEP01 = 37
STEP5_01 = 38
HAVERSINE01 = 39
POSITIVE_PART = 40
UNIT_STEP = 41
POWER_INT = 42
UNWRAP = 43
INTEGRAL = 44
LAST_UNARY = 44

# two operands
FIRST_BINARY = 60
ADD = 60
SUB = 61
MUL = 62
DIV = 63
POW = 64
ATAN2 = 65
HYPOT = 66
MIN = 67
MAX = 68
MOD = 69
SIGN = 70
DIM = 71
POSITIVE_POWER = 72
SPLINE = 73
LAST_BINARY = 73

# a function of the user: where its arguments are listed, how many, its scratch, its address
EXTERNAL = 80
FIRST_SECOND = 2
"""Order for which a function of the user gives both derivatives by its first argument."""
ALL_SECOND = 3
"""Order for which it gives all first partials and, behind them, the matrix of all second ones."""
MOST_SECOND = 16
"""Arguments up to which a function of the user gives these, and may stand in a constraint."""

# condition and three branches
SELECT = 90

MAGNITUDE = 3
"""Axis operand of a vector leaf that asks for the vector's length."""
GLOBAL = -1
"""Marker operand that stands for the global frame at the ground's origin."""

LEVEL_CONSTANT = 0
"""What an expression depends on at most; likewise the next."""
LEVEL_TIME = 1
LEVEL_POSITION = 2
LEVEL_VELOCITY = 3
LEVEL_ALGEBRAIC = 4
LEVEL_ACCELERATION = 5


def external_results(count: int) -> int:
    """Return how many numbers a function of the user may write: its value and derivatives, two at least."""
    return 1 + max(count + (count**2 if count <= MOST_SECOND else 0), 2)


# What is raised about expressions.


class ExpressionError(ValueError):
    """A function expression that cannot be read or evaluated; says where and what to do."""


class NotEvaluatedError(ExpressionError):
    """A function of the language that is well written but not evaluated here, or not in this place."""
