"""From the rows that a mechanism hands over one by one to the flat tables of `gearmbs.dae.equations.layout`."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.dae.compiled.pointers import NAMES, addresses
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.expressions.opcodes import HEAD_ALGEBRAIC_LIST
from gearmbs.dae.equations.rotation import KIN_COLUMNS
from gearmbs.dae.equations.unknowns import Counts, offsets, places


class TableBuilder:
    """Collects the rows of the tables in Python and packs them once.

    The methods return the index of what they add, for use in later rows.
    """

    def __init__(self) -> None:
        self.gravity = np.zeros(3)
        self.bodies: list[np.ndarray] = []
        self.modes: list[int] = []
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
        self.modes.append(0)
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
            at = row[T.FORCE_DEPENDS]
            bodies = self.extra_i[at]
            first = at + 2 + bodies
            kept = [new[k] for k in self.extra_i[first : first + self.extra_i[first - 1]] if k in new]
            self.extra_i[first - 1] = len(kept)
            self.extra_i[first : first + len(kept)] = kept
            row[T.FORCE_WIDTH] = 12 * bodies + len(kept)
        for tape in self.tape_rows:
            codes, bodies, count = tape[T.TAPE_I], tape[T.TAPE_BODIES] + tape[T.TAPE_N_BODIES], tape[T.TAPE_N_UNKNOWNS]
            for at in (bodies, codes + self.extra_i[codes + HEAD_ALGEBRAIC_LIST]):
                self.extra_i[at : at + count] = [new[k] for k in self.extra_i[at : at + count]]

    def counts(self) -> Counts:
        """Return what the length of y depends on."""
        return Counts(
            modes=tuple(self.modes[1:]),
            rows=len(self.rows),
            forces=sum(f[T.FORCE_F] for f in self.forces),
            torques=sum(f[T.FORCE_N] for f in self.forces),
            states=len(self.states),
        )

    def layout(self, formulation: int) -> dict[str, int]:
        """Return the offsets of the blocks of y, eq. (9)."""
        return offsets(self.counts(), formulation)

    def pack(self, formulation: int, slots: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, int]:
        """Return (idata, rdata, work size) for a formulation and a Jacobian slot map."""
        at = self.layout(formulation)
        slots = np.zeros(0, dtype=np.int64) if slots is None else slots
        bodies, markers = len(self.bodies), len(self.marker_body)
        head = np.zeros(T.H_SIZE, dtype=np.int64)
        head[:7] = bodies, markers, len(self.rows), len(self.terms), len(self.forces), len(self.functions), formulation
        head[T.H_UNKNOWNS] = at["n"]
        head[T.H_U : T.H_MU + 1] = [at[k] for k in ("u", "p", "eps", "R", "theta", "lambda", "F", "N", "mu")]
        head[T.H_COORDINATES] = self.counts().coordinates
        head[T.H_PF], head[T.H_VF], head[T.H_QF] = at["p_f"], at["v_f"], at["q_f"]
        head[T.H_SLOTS] = slots.size
        forces = np.array(self.forces, dtype=np.int64).reshape(-1, T.FORCE_COLUMNS).copy()
        next_f, next_n, next_work = at["F"], at["N"], T.SCRATCH_FIXED + 6 * self.widest
        for row in forces:
            for column, advance in ((T.FORCE_F, 0), (T.FORCE_N, 1)):
                if row[column]:
                    row[column] = next_n if advance else next_f
                    next_f += 0 if advance else 3
                    next_n += 3 if advance else 0
                else:
                    row[column] = -1
            need = row[T.FORCE_WORK]
            row[T.FORCE_WORK] = next_work
            next_work += need
        rows = np.array([*self.rows, (len(self.terms), -1, -1)], dtype=np.int64)
        tables_i = [
            (T.H_I_AT, places(self.counts(), formulation)),
            (T.H_I_CODE, np.array(self.codes)),
            (T.H_I_MARKER_BODY, np.array(self.marker_body)),
            (T.H_I_ROW, rows),
            (T.H_I_TERM, np.array(self.terms)),
            (T.H_I_FORCE, forces),
            (T.H_I_FUNCTION, np.array(self.functions)),
            (T.H_I_EXTRA, np.array(self.extra_i)),
            (T.H_I_SLOT, slots),
            (T.H_I_STATE, np.array(self.states)),
            (T.H_I_TAPE, np.array(self.tape_rows)),
        ]
        unseen = np.zeros(len(self.reference) + 3 * bodies)
        tables_r = [
            (T.H_R_GRAVITY, self.gravity),
            (T.H_R_BODY, np.array(self.bodies)),
            (T.H_R_MARKER, np.array(self.marker_frame)),
            (T.H_R_COEF, np.array(self.coef)),
            (T.H_R_FUNCTION, np.array(self.function_r)),
            (T.H_R_EXTRA, np.array(self.extra_r)),
            (T.H_R_REFERENCE, np.array([*self.reference, 0.0, *self.reference, *unseen])),
        ]
        head[T.H_ADDRESS : T.H_ADDRESS + len(NAMES)] = addresses()
        head[T.H_N_EXTRA_I], head[T.H_N_EXTRA_R] = len(self.extra_i), len(self.extra_r)
        head[T.H_N_FUNCTION_R] = len(self.function_r)
        head[T.H_Z], head[T.H_STATES], head[T.H_TAPES] = at["z"], len(self.states), len(self.tapes)
        head[T.H_W_KIN] = 0
        head[T.H_W_MARKER] = bodies * KIN_COLUMNS
        head[T.H_W_FUNCTION] = head[T.H_W_MARKER] + markers * T.MK_COLUMNS
        head[T.H_W_TAPE] = head[T.H_W_FUNCTION] + 3 * len(self.functions)
        head[T.H_W_TAPE_SIZE] = self.tape_work
        head[T.H_W_SCRATCH] = head[T.H_W_TAPE] + self.tape_work
        head[T.H_WORK] = head[T.H_W_SCRATCH] + next_work
        offset = T.H_SIZE
        for key, table in tables_i:
            head[key] = offset
            offset += table.size
        idata = np.concatenate([head, *(t.ravel().astype(np.int64) for _, t in tables_i)])
        offset = 0
        for key, table in tables_r:
            idata[key] = offset
            offset += table.size
        rdata = np.concatenate([t.ravel().astype(np.float64) for _, t in tables_r])
        return np.ascontiguousarray(idata), np.ascontiguousarray(rdata), int(head[T.H_WORK])
