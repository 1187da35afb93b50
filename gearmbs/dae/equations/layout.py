"""The flat tables of a mechanism, as the compiled kernels read them.

``idata`` starts with a header of counts and offsets (the constants ``H_*``); every other table is a
run of ``idata`` or ``rdata``.  :func:`unpack` turns the two arrays into named views.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np
from numba import njit

from gearmbs.dae.compiled.pointers import NAMES, addresses
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations.expressions.opcodes import HEAD_ALGEBRAIC_LIST
from gearmbs.dae.equations.rotation import KIN_COLUMNS

I3 = 0
SI2 = 1
SI1 = 2

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
H_ADDRESS = 49
"""Addresses of the kernels called from outside, in the order of `gearmbs.dae.compiled.pointers.NAMES`."""
H_SIZE = 56

BODY_MASS = 0
BODY_INERTIA = 1
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
TERM_EXTRA = 5
TERM_COLUMNS = 6

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
FORCE_FUNCTION = 8
FORCE_WORK = 9
FORCE_DEPENDS = 10
"""Offset in the extra integers of the dependency list: count and bodies, count and unknowns."""
FORCE_WIDTH = 11
"""Columns of the element's derivative matrix."""
FORCE_COLUMNS = 12

FUNCTION_KIND = 0
FUNCTION_OFFSET = 1
"""Offset of the parameters, or the tape of an expression of time."""
FUNCTION_COLUMNS = 2

TAPE_I = 0
TAPE_I_SIZE = 1
TAPE_R = 2
TAPE_R_SIZE = 3
TAPE_REFERENCE = 4
TAPE_REFERENCE_SIZE = 5
TAPE_BODIES = 6
"""Offset in the extra integers of the bodies, then the unknowns, the tape depends on."""
TAPE_N_BODIES = 7
TAPE_N_UNKNOWNS = 8
TAPE_COLUMNS = 9

STATE_KIND = 0
STATE_TAPE = 1
STATE_COLUMNS = 2
STATE_DIFFERENTIAL = 0
"""z' = f(...)"""
STATE_ALGEBRAIC = 1
"""z = f(...)"""

SCRATCH_FIXED = 512
"""Scratch for gradients, Hessians and small vectors; then the widest element's derivatives, then the elements' own."""

Tables = namedtuple(
    "Tables",
    "address code marker_body row term force function extra_i slot state tape "
    "gravity body marker coef function_r extra_r reference winding seen kin frame fval scratch tape_work",
)


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
        vector_at(i, H_ADDRESS, H_SIZE - H_ADDRESS),
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
        vector_at(r, i[H_R_GRAVITY], 3),
        matrix_at(r, i[H_R_BODY], bodies, BODY_COLUMNS),
        matrix_at(r, i[H_R_MARKER], markers, MARKER_COLUMNS),
        vector_at(r, i[H_R_COEF], terms),
        vector_at(r, i[H_R_FUNCTION], i[H_N_FUNCTION_R]),
        vector_at(r, i[H_R_EXTRA], i[H_N_EXTRA_R]),
        vector_at(r, reference, terms),
        vector_at(r, reference + terms, 2 * terms + 1),
        vector_at(r, reference + 3 * terms + 1, 3 * bodies),
        matrix_at(work, i[H_W_KIN], bodies, KIN_COLUMNS),
        matrix_at(work, i[H_W_MARKER], markers, MK_COLUMNS),
        matrix_at(work, i[H_W_FUNCTION], functions, 3),
        vector_at(work, i[H_W_SCRATCH], work.size - i[H_W_SCRATCH]),
        vector_at(work, i[H_W_TAPE], i[H_W_TAPE_SIZE]),
    )


class TableBuilder:
    """Collects the rows of the tables in Python and packs them once.

    The methods return the index of what they add, for use in later rows.
    """

    def __init__(self) -> None:
        self.gravity = np.zeros(3)
        self.bodies: list[np.ndarray] = []
        self.codes: list[int] = []
        self.marker_body: list[int] = []
        self.marker_frame: list[np.ndarray] = []
        self.rows: list[tuple[int, int, int]] = []
        self.states: list[tuple[int, int]] = []
        self.tapes: list[Any] = []
        self.tape_rows: list[tuple[int, ...]] = []
        self.tape_work = 0
        self.terms: list[tuple[int, ...]] = []
        self.coef: list[float] = []
        self.reference: list[float] = []
        self.forces: list[list[int]] = []
        self.functions: list[tuple[int, int]] = []
        self.function_r: list[float] = []
        self.extra_i: list[int] = []
        self.extra_r: list[float] = []
        self.widest = 0
        self.add_body(0.0, np.zeros((3, 3)))

    def add_body(self, mass: float, inertia: np.ndarray, code: int = 0) -> int:
        self.bodies.append(np.concatenate([[mass], np.asarray(inertia, dtype=float).ravel()]))
        self.codes.append(code)
        return len(self.bodies) - 1

    def add_marker(self, body: int, position: np.ndarray, orientation: np.ndarray) -> int:
        self.marker_body.append(body)
        self.marker_frame.append(np.concatenate([position, np.asarray(orientation, dtype=float).ravel()]))
        return len(self.marker_body) - 1

    def add_function(self, kind: int, parameters: list[float]) -> int:
        self.functions.append((kind, len(self.function_r)))
        self.function_r.extend(float(p) for p in parameters)
        return len(self.functions) - 1

    def add_row(
        self, terms: list[tuple[int, int, int, int, int, float]], function: int = -1, extras: list[int] | None = None
    ) -> int:
        """Add a constraint row: terms of (type, I, J, axes, function, coefficient)."""
        self.rows.append((len(self.terms), function, -1))
        for k, (kind, i, j, axes, fun, coefficient) in enumerate(terms):
            self.terms.append((kind, i, j, axes, fun, extras[k] if extras else -1))
            self.coef.append(coefficient)
            self.reference.append(0.0)
        return len(self.rows) - 1

    def add_tape(self, tape: Any) -> int:
        """Add an expression, a `Tape` whose unknowns are bound to indices of y; return its number."""
        bodies = len(self.extra_i)
        unknowns = tape.ints[tape.ints[HEAD_ALGEBRAIC_LIST] :][: len(tape.algebraic)]
        self.extra_i.extend([*tape.bodies, *(int(k) for k in unknowns)])
        i = len(self.extra_i)
        self.extra_i.extend(int(v) for v in tape.ints)
        r = len(self.extra_r)
        self.extra_r.extend(float(v) for v in tape.floats)
        reference = len(self.extra_r)
        self.extra_r.extend([0.0] * (3 * tape.n_angles))
        row = (i, len(tape.ints), r, len(tape.floats), reference, tape.n_angles)
        self.tape_rows.append((*row, bodies, len(tape.bodies), len(tape.algebraic)))
        self.tapes.append(tape)
        second = tape.second_size if tape.second_order else 0
        self.tape_work = max(self.tape_work, tape.work_size + tape.gradient_size + second * (second + 1) + 16)
        return len(self.tapes) - 1

    def add_tape_row(self, tape: int) -> int:
        """Add a constraint row given by an expression that must vanish."""
        self.rows.append((len(self.terms), -1, tape))
        return len(self.rows) - 1

    def add_state(self, kind: int, tape: int) -> int:
        """Add a user-defined state z with z' = f or z = f."""
        self.states.append((kind, tape))
        return len(self.states) - 1

    def add_extra(self, integers: np.ndarray | list[int], reals: np.ndarray | list[float]) -> tuple[int, int]:
        """Append a force element's own tables; return their offsets and lengths are stored in front."""
        i, r = len(self.extra_i), len(self.extra_r)
        self.extra_i.extend([len(integers), len(reals)])
        self.extra_i.extend(int(v) for v in integers)
        self.extra_r.extend(float(v) for v in reals)
        return i, r

    def add_force(
        self,
        kind: int,
        i: int,
        j: int,
        *,
        force: bool,
        torque: bool,
        extra: tuple[int, int] = (-1, -1),
        rm: int = -1,
        function: int = -1,
        work: int = 0,
        bodies: list[int],
        unknowns: list[int] | None = None,
    ) -> int:
        """Add a force element; offsets in y and in scratch are settled by :meth:`pack`.

        ``bodies`` and ``unknowns`` are what its derivative columns refer to.
        """
        unknowns = unknowns or []
        depends = len(self.extra_i)
        self.extra_i.extend([len(bodies), *bodies, len(unknowns), *unknowns])
        width = 12 * len(bodies) + len(unknowns)
        self.widest = max(self.widest, width)
        self.forces.append(
            [kind, i, j, int(force), int(torque), extra[0], extra[1], rm, function, work, depends, width]
        )
        return len(self.forces) - 1

    def renumber_unknowns(self, new: dict[int, int]) -> None:
        """Point everything that depends on an unknown to its new place in y; those missing in ``new`` are dropped.

        Only reactions depend on multipliers, and only multipliers are ever dropped.
        """
        for row in self.forces:
            at = row[FORCE_DEPENDS]
            bodies = self.extra_i[at]
            first = at + 2 + bodies
            kept = [new[k] for k in self.extra_i[first : first + self.extra_i[first - 1]] if k in new]
            self.extra_i[first - 1] = len(kept)
            self.extra_i[first : first + len(kept)] = kept
            row[FORCE_WIDTH] = 12 * bodies + len(kept)
        for tape in self.tape_rows:
            codes, bodies, count = tape[TAPE_I], tape[TAPE_BODIES] + tape[TAPE_N_BODIES], tape[TAPE_N_UNKNOWNS]
            for at in (bodies, codes + self.extra_i[codes + HEAD_ALGEBRAIC_LIST]):
                self.extra_i[at : at + count] = [new[k] for k in self.extra_i[at : at + count]]

    def layout(self, formulation: int) -> dict[str, int]:
        """Return the offsets of the blocks of y = [u, p, eps, R, theta, lambda, F, N, mu]."""
        n3 = 3 * (len(self.bodies) - 1)
        m = len(self.rows)
        n_f = 3 * sum(f[FORCE_F] for f in self.forces)
        n_n = 3 * sum(f[FORCE_N] for f in self.forces)
        at = {"u": 0, "p": n3, "eps": 2 * n3, "R": 3 * n3, "theta": 4 * n3, "lambda": 5 * n3}
        at["F"] = 5 * n3 + m
        at["N"] = at["F"] + n_f
        at["z"] = at["N"] + n_n
        at["mu"] = at["z"] + len(self.states)
        at["n"] = at["mu"] + (0 if formulation == I3 else m)
        return at

    def pack(self, formulation: int, slots: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, int]:
        """Return (idata, rdata, work size) for a formulation and a Jacobian slot map."""
        at = self.layout(formulation)
        slots = np.zeros(0, dtype=np.int64) if slots is None else slots
        bodies, markers = len(self.bodies), len(self.marker_body)
        head = np.zeros(H_SIZE, dtype=np.int64)
        head[:7] = bodies, markers, len(self.rows), len(self.terms), len(self.forces), len(self.functions), formulation
        head[H_UNKNOWNS] = at["n"]
        head[H_U : H_MU + 1] = [at[k] for k in ("u", "p", "eps", "R", "theta", "lambda", "F", "N", "mu")]
        head[H_SLOTS] = slots.size
        forces = np.array(self.forces, dtype=np.int64).reshape(-1, FORCE_COLUMNS).copy()
        next_f, next_n, next_work = at["F"], at["N"], SCRATCH_FIXED + 6 * self.widest
        for row in forces:
            for column, advance in ((FORCE_F, 0), (FORCE_N, 1)):
                if row[column]:
                    row[column] = next_n if advance else next_f
                    next_f += 0 if advance else 3
                    next_n += 3 if advance else 0
                else:
                    row[column] = -1
            need = row[FORCE_WORK]
            row[FORCE_WORK] = next_work
            next_work += need
        rows = np.array([*self.rows, (len(self.terms), -1, -1)], dtype=np.int64)
        tables_i = [
            (H_I_CODE, np.array(self.codes)),
            (H_I_MARKER_BODY, np.array(self.marker_body)),
            (H_I_ROW, rows),
            (H_I_TERM, np.array(self.terms)),
            (H_I_FORCE, forces),
            (H_I_FUNCTION, np.array(self.functions)),
            (H_I_EXTRA, np.array(self.extra_i)),
            (H_I_SLOT, slots),
            (H_I_STATE, np.array(self.states)),
            (H_I_TAPE, np.array(self.tape_rows)),
        ]
        unseen = np.zeros(len(self.reference) + 3 * bodies)
        tables_r = [
            (H_R_GRAVITY, self.gravity),
            (H_R_BODY, np.array(self.bodies)),
            (H_R_MARKER, np.array(self.marker_frame)),
            (H_R_COEF, np.array(self.coef)),
            (H_R_FUNCTION, np.array(self.function_r)),
            (H_R_EXTRA, np.array(self.extra_r)),
            (H_R_REFERENCE, np.array([*self.reference, 0.0, *self.reference, *unseen])),
        ]
        head[H_ADDRESS : H_ADDRESS + len(NAMES)] = addresses()
        head[H_N_EXTRA_I], head[H_N_EXTRA_R] = len(self.extra_i), len(self.extra_r)
        head[H_N_FUNCTION_R] = len(self.function_r)
        head[H_Z], head[H_STATES], head[H_TAPES] = at["z"], len(self.states), len(self.tapes)
        head[H_W_KIN] = 0
        head[H_W_MARKER] = bodies * KIN_COLUMNS
        head[H_W_FUNCTION] = head[H_W_MARKER] + markers * MK_COLUMNS
        head[H_W_TAPE] = head[H_W_FUNCTION] + 3 * len(self.functions)
        head[H_W_TAPE_SIZE] = self.tape_work
        head[H_W_SCRATCH] = head[H_W_TAPE] + self.tape_work
        head[H_WORK] = head[H_W_SCRATCH] + next_work
        offset = H_SIZE
        for key, table in tables_i:
            head[key] = offset
            offset += table.size
        idata = np.concatenate([head, *(t.ravel().astype(np.int64) for _, t in tables_i)])
        offset = 0
        for key, table in tables_r:
            idata[key] = offset
            offset += table.size
        rdata = np.concatenate([t.ravel().astype(np.float64) for _, t in tables_r])
        return np.ascontiguousarray(idata), np.ascontiguousarray(rdata), int(head[H_WORK])
