"""From the rows that a mechanism hands over one by one to the flat tables of `gearmbs.dae.equations.layout`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gearmbs.dae.compiled.pointers import address
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.expressions.opcodes import HEAD_ALGEBRAIC_LIST
from gearmbs.dae.equations.force_elements import FORCE_SIG, FRAME_COLUMNS, Diagnostic
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
        self.angles: list[tuple[int, int, int, int]] = []
        self.kernels: dict[int, Any] = {}
        """Kernel of each compiled force element by its row."""
        self.own_functions: dict[int, tuple[Any, Any]] = {}
        """Compiled functions of elements, with their signatures, by the place of their address in the integers."""
        self.diagnostics: list[tuple[Diagnostic, ...]] = []
        """Of each force element."""
        self.largest_jac = 0
        self._ground_marker: int | None = None
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
        counts = (bodies, len(tape.bodies), len(tape.algebraic))
        self.tape_rows.append((*row, *counts, *([0] * T.TAPE_KERNELS)))
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

    def ground_marker(self) -> int:
        """Return a marker at the origin of the ground."""
        if self._ground_marker is None:
            self._ground_marker = self.add_marker(0, np.zeros(3), np.eye(3))
        return self._ground_marker

    def add_angle(self, axis: int, i: int, j: int, start: float = 0.0) -> int:
        """Add an angle AX, AY or AZ (axis 0, 1 or 2) of marker i about j that is counted through full turns."""
        self.angles.append((axis, i, j, len(self.extra_r)))
        self.extra_r.extend([start, start, 0.0])
        return len(self.angles) - 1

    def add_extra(self, integers: Sequence[int] | np.ndarray, reals: Sequence[float] | np.ndarray) -> tuple[int, int]:
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
        bodies: list[int],
        unknowns: list[int] | None = None,
    ) -> int:
        """Add a load by expressions or the reactions of a joint; offsets in y are settled by :meth:`pack`.

        ``bodies`` and ``unknowns`` are what its derivative columns refer to.
        """
        row = self._force_row(kind, i, j, force, torque, bodies, unknowns or [])
        row[T.FORCE_IEXTRA], row[T.FORCE_REXTRA], row[T.FORCE_RM] = *extra, rm
        self.largest_jac = max(self.largest_jac, 6 * row[T.FORCE_WIDTH])
        return self._append(row, ())

    def add_element(
        self,
        kernel: Any,
        acting: Sequence[int],
        *,
        sees: Sequence[int] | None = None,
        force: bool = True,
        torque: bool = True,
        integers: Sequence[int] | np.ndarray = (),
        reals: Sequence[float] | np.ndarray = (),
        functions: Sequence[tuple[Any, Any]] = (),
        states: Sequence[int] = (),
        unknowns: Sequence[int] = (),
        times: Sequence[int] = (),
        angles: Sequence[int] = (),
        scratch: int = 0,
        diagnostics: Sequence[Diagnostic] = (),
    ) -> int:
        """Add a compiled force element, see `gearmbs.dae.equations.force_elements`; return its (first) row.

        Parameters
        ----------
        kernel : compiled function
            With the signature ``FORCE_SIG``.
        acting, sees : sequence of int
            Markers on whose bodies it acts, and markers whose frames the kernel is given; default: the same.
        force, torque : bool
            Whether F and N are unknowns; what the kernel writes for one that is not is ignored.
        integers, reals : sequence
            The element's own tables.
        functions : sequence of (compiled function, signature)
            Their addresses go before ``integers``.
        states : sequence of int
            ``STATE_DIFFERENTIAL`` or ``STATE_ALGEBRAIC`` for each of its own states.
        unknowns, times, angles : sequence of int
            Places in y, functions of time and counted angles that make up the inputs.
        scratch : int
        diagnostics : sequence of Diagnostic
        """
        sees = acting if sees is None else sees
        wrenches = len(acting) if len(acting) > 2 else 1
        at = len(self.extra_i)
        self.extra_i.extend([len(sees), *sees, len(times), *times, len(angles), *angles])
        extra = self.add_extra([*([0] * len(functions)), *integers], reals)
        for k, function in enumerate(functions):
            self.own_functions[extra[0] + 2 + k] = function
        first = len(self.states)
        self.states.extend((kind, -1) for kind in states)
        depends = [*(-1 - k for k in range(len(states))), *unknowns]
        handed = FRAME_COLUMNS * len(sees) + len(unknowns) + len(times) + len(angles)
        number = len(self.forces)
        for part in range(wrenches):
            i = acting[part]
            j = acting[1] if len(acting) == 2 else self.ground_marker()
            row = self._force_row(T.COMPILED, i, j, force, torque, [self.marker_body[m] for m in sees], depends)
            row[T.FORCE_IEXTRA], row[T.FORCE_REXTRA], row[T.FORCE_SEES] = *extra, at
            row[T.FORCE_WRENCHES], row[T.FORCE_PART] = wrenches, part
            if part == 0:
                row[T.FORCE_Z], row[T.FORCE_STATES], row[T.FORCE_DIAGNOSTICS] = first, len(states), len(diagnostics)
                row[T.FORCE_WORK] = 6 * wrenches + len(states) + len(diagnostics) + handed + scratch
                self.largest_jac = max(self.largest_jac, (6 * wrenches + len(states)) * row[T.FORCE_WIDTH])
            self._append(row, tuple(diagnostics) if part == 0 else ())
        self.kernels[number] = kernel
        return number

    def _force_row(
        self, kind: int, i: int, j: int, force: bool, torque: bool, bodies: list[int], unknowns: list[int]
    ) -> list[int]:
        row = [0] * T.FORCE_COLUMNS
        row[T.FORCE_KIND], row[T.FORCE_I], row[T.FORCE_J], row[T.FORCE_F], row[T.FORCE_N] = (
            kind,
            i,
            j,
            int(force),
            int(torque),
        )
        row[T.FORCE_DEPENDS], row[T.FORCE_WIDTH] = len(self.extra_i), 12 * len(bodies) + len(unknowns)
        self.extra_i.extend([len(bodies), *bodies, len(unknowns), *unknowns])
        return row

    def _append(self, row: list[int], diagnostics: tuple[Diagnostic, ...]) -> int:
        self.forces.append(row)
        self.diagnostics.append(diagnostics)
        return len(self.forces) - 1

    def renumber_unknowns(self, new: dict[int, int]) -> None:
        """Point everything that depends on an unknown to its new place in y; those missing in ``new`` are dropped.

        Only reactions depend on multipliers, and only multipliers are ever dropped. An element's own states have their
        number less than 0 there, until the tables are packed.
        """
        for row in self.forces:
            at = row[T.FORCE_DEPENDS]
            bodies = self.extra_i[at]
            first = at + 2 + bodies
            places = self.extra_i[first : first + self.extra_i[first - 1]]
            kept = [k if k < 0 else new[k] for k in places if k < 0 or k in new]
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
        extra_i = np.array(self.extra_i, dtype=np.int64)
        forces, need = self._packed_forces(at, extra_i)
        tapes = np.array(self.tape_rows, dtype=np.int64).reshape(-1, T.TAPE_COLUMNS)
        if self.tapes:
            from gearmbs.dae.equations.expression_loads import addresses

            tapes[:, T.TAPE_ADDRESS :] = addresses()
        rows = np.array([*self.rows, (len(self.terms), -1, -1)], dtype=np.int64)
        tables_i = [
            (T.H_I_AT, places(self.counts(), formulation)),
            (T.H_I_CODE, np.array(self.codes)),
            (T.H_I_MARKER_BODY, np.array(self.marker_body)),
            (T.H_I_ROW, rows),
            (T.H_I_TERM, np.array(self.terms)),
            (T.H_I_FORCE, forces),
            (T.H_I_FUNCTION, np.array(self.functions)),
            (T.H_I_EXTRA, extra_i),
            (T.H_I_SLOT, slots),
            (T.H_I_STATE, np.array(self.states)),
            (T.H_I_TAPE, tapes),
            (T.H_I_ANGLE, np.array(self.angles)),
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
        head[T.H_ANGLES] = len(self.angles)
        head[T.H_DIAGNOSTICS] = max((len(d) for d in self.diagnostics), default=0)
        head[T.H_N_EXTRA_I], head[T.H_N_EXTRA_R] = len(self.extra_i), len(self.extra_r)
        head[T.H_N_FUNCTION_R] = len(self.function_r)
        head[T.H_Z], head[T.H_STATES], head[T.H_TAPES] = at["z"], len(self.states), len(self.tapes)
        head[T.H_W_KIN] = 0
        head[T.H_W_MARKER] = bodies * KIN_COLUMNS
        head[T.H_W_FUNCTION] = head[T.H_W_MARKER] + markers * T.MK_COLUMNS
        head[T.H_W_TAPE] = head[T.H_W_FUNCTION] + 3 * len(self.functions)
        head[T.H_W_TAPE_SIZE] = self.tape_work
        head[T.H_W_SCRATCH] = head[T.H_W_TAPE] + self.tape_work
        head[T.H_WORK] = head[T.H_W_SCRATCH] + need
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

    def _packed_forces(self, at: dict[str, int], extra_i: np.ndarray) -> tuple[np.ndarray, int]:
        """Return the rows of the force elements with their places in y and in scratch, and the scratch needed.

        Places and addresses that stand in ``extra_i`` are put there.
        """
        forces = np.array(self.forces, dtype=np.int64).reshape(-1, T.FORCE_COLUMNS)
        next_f, next_n, next_work = at["F"], at["N"], T.SCRATCH_FIXED + self.largest_jac
        leader = np.zeros(T.FORCE_COLUMNS, dtype=np.int64)
        for number, row in enumerate(forces):
            for column, advance in ((T.FORCE_F, 0), (T.FORCE_N, 1)):
                if row[column]:
                    row[column] = next_n if advance else next_f
                    next_f += 0 if advance else 3
                    next_n += 3 if advance else 0
                else:
                    row[column] = -1
            if row[T.FORCE_KIND] != T.COMPILED:
                continue
            if row[T.FORCE_PART] == 0:
                leader = row
                row[T.FORCE_ADDRESS] = address(self.kernels[number], FORCE_SIG)
                row[T.FORCE_Z] += at["z"]
                row[T.FORCE_WORK], next_work = next_work, next_work + row[T.FORCE_WORK]
            else:
                row[T.FORCE_WORK] = leader[T.FORCE_WORK]
            first = row[T.FORCE_DEPENDS] + 2 + extra_i[row[T.FORCE_DEPENDS]]
            for k in range(first, first + extra_i[first - 1]):
                if extra_i[k] < 0:
                    extra_i[k] = leader[T.FORCE_Z] - 1 - extra_i[k]
        for place, (function, signature) in self.own_functions.items():
            extra_i[place] = address(function, signature)
        return forces, next_work
