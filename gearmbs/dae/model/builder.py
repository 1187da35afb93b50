"""Collects what a mechanism hands over piece by piece; the result is an immutable `Model`."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies import RIGID, BodyKind
from gearmbs.dae.equations.bodies.frames import shape_table
from gearmbs.dae.equations.bodies.inertia import ModalInertia
from gearmbs.dae.equations.expressions.opcodes import HEAD_ALGEBRAIC_LIST
from gearmbs.dae.equations.loads.forces import FRAME_COLUMNS, Diagnostic
from gearmbs.dae.equations.unknowns import Counts
from gearmbs.dae.model.model import Model, Names
from gearmbs.dae.problem import INPUT, Number, Place


class TableBuilder:
    """Collects the rows of the tables; `build` makes a `Model` of them.

    The methods return the index of what they add, for use in later rows.
    """

    def __init__(self) -> None:
        self.gravity = np.zeros(3)
        self.bodies: list[np.ndarray] = []
        self.kinds: list[BodyKind] = []
        self.modes: list[int] = []
        self.modal = array("d")
        self.modal_at: list[int] = []
        self.modal_inertia: list[ModalInertia | None] = []
        self.frame_body: list[int] = []
        self.shape_at: list[int] = []
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
        self.lean: dict[int, Any] = {}
        """What offers a leaner kernel for bodies that turn about fixed axes, by the row of its element."""
        self.own_functions: dict[int, tuple[Any, Any]] = {}
        """Compiled functions of elements, with their signatures, by the place of their address in the integers."""
        self.diagnostics: list[tuple[Diagnostic, ...]] = []
        """Diagnostics of each force element."""
        self.largest_jac = 0
        self.numbers: dict[str, Number] = {}
        """Inputs and parameters by name, with places among the tables `H_R_EXTRA` and `H_R_FUNCTION`; see
        `Model.numbers`."""
        self.aliases: dict[str, str] = {}
        """Further names of these."""
        self._ground_marker: int | None = None
        self.add_body(0.0, np.zeros((3, 3)))

    def add_body(
        self,
        mass: float,
        inertia: np.ndarray,
        modal: ModalInertia | None = None,
        *,
        kind: BodyKind = RIGID,
        numbers: Sequence[float] = (),
    ) -> int:
        """Add a body; its inertia is about the centre of mass, undeformed. All bodies go before the first marker.

        ``numbers`` are those that its kind needs beside, as the kernels read them.
        """
        # the acceleration system has rotations of every body: one that does not turn has inertia there, and no moment
        inertia = inertia if kind.angles else np.eye(3)
        self.kinds.append(kind)
        self.bodies.append(np.concatenate([[mass], np.asarray(inertia, dtype=float).ravel()]))
        self.modes.append(0 if modal is None else modal.modes)
        self.modal_inertia.append(modal)
        own = np.asarray(numbers, dtype=float) if modal is None else modal.table(inertia)
        self.modal_at.append(len(self.modal) if own.size else -1)
        self.modal.frombytes(own.tobytes())
        return len(self.bodies) - 1

    def add_marker(
        self,
        body: int,
        position: np.ndarray,
        orientation: np.ndarray,
        shape: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> int:
        """Add a marker, given from the centre of mass in body components.

        ``shape`` holds displacements and rotations of a modal body there, a row a mode; of a point mass it has none.
        """
        if shape is not None:
            # the marker of such a body is the origin of a frame of its own
            self.frame_body.append(body)
            self.shape_at.append(len(self.modal))
            self.modal.frombytes(shape_table(position, *shape).tobytes())
            body, position = len(self.bodies) + len(self.frame_body) - 1, np.zeros(3)
        self.marker_body.append(body)
        self.marker_frame.append(np.concatenate([position, np.asarray(orientation, dtype=float).ravel()]))
        return len(self.marker_body) - 1

    def add_function(self, kind: int, parameters: list[float]) -> int:
        self.functions.append((kind, len(self.function_r)))
        self.function_r.extend(float(p) for p in parameters)
        return len(self.functions) - 1

    def add_number(self, name: str, unit: str, kind: str, value: float) -> None:
        """Add a number with a name; its first place is one of its own, whatever uses it."""
        at = len(self.extra_r)
        self.extra_r.extend([0.0, value, 0.0] if kind == INPUT else [value])
        self.numbers[name] = Number(name, unit, kind, (Place(at, 2 if kind == INPUT else 0, table=T.H_R_EXTRA),))

    def add_place(self, name: str, place: Place, row: str | None = None) -> None:
        """Note a further place of a number, and the constraint row whose function it is if it is one."""
        number = self.numbers[name]
        prescribes = number.prescribes if row is None else (*number.prescribes, (row, place.order))
        self.numbers[name] = replace(number, places=(*number.places, place), prescribes=prescribes)

    def add_rows(self, rows: Iterable[tuple[list[tuple], int]]) -> None:
        """Add constraint rows: terms of (type, I, J, axes, function, coefficient, start of an angle), a function."""
        for terms, function in rows:
            self.rows.append((len(self.terms), function, -1))
            for *term, coefficient, start in terms:
                self.terms.append(tuple(term))
                self.coef.append(coefficient)
                self.reference.append(start)

    def add_tape(self, tape: Any, about: int | None = None) -> int:
        """Add an expression, a `Tape` whose unknowns are bound to indices of y; return its number.

        Of a constraint ``about`` is the marker about which its reaction is told, by default the first in the tape.
        """
        bodies = len(self.extra_i)
        unknowns = tape.ints[tape.ints[HEAD_ALGEBRAIC_LIST] :][: len(tape.algebraic)]
        self.extra_i.extend([*tape.bodies, *(int(k) for k in unknowns), tape.first_marker if about is None else about])
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
        self.extra_i.extend(np.asarray(integers, dtype=np.int64).tolist())
        self.extra_r.extend(np.asarray(reals, dtype=np.float64).tolist())
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
        """Add a load by expressions or the reactions of a joint; offsets in y are assigned by :meth:`Model.pack`.

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
        lean: Any = None,
    ) -> int:
        """Add a compiled force element, see `gearmbs.dae.equations.loads.forces`; return its (first) row.

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
        lean : callable, optional
            Called with the frames of two acting markers where nothing has turned, shape (2, 18), and point and
            direction of either fixed axis, shape (2, 2, 3). Returns a kernel of signature ``TURNING_SIG`` that does the
            same for bodies that turn about these axes, and its own table, or None.
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
        if lean is not None:
            self.lean[number] = lean
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

    def counts(self) -> Counts:
        """Return what the length of y depends on."""
        return Counts(
            angles=tuple(kind.angles for kind in self.kinds[1:]),
            modes=tuple(self.modes[1:]),
            rows=len(self.rows),
            forces=sum(f[T.FORCE_F] for f in self.forces),
            torques=sum(f[T.FORCE_N] for f in self.forces),
            states=len(self.states),
        )

    def build(self, names: Names) -> Model:
        """Return the tables as an immutable model."""
        return Model(
            gravity=_reals(self.gravity),
            bodies=_reals(self.bodies),
            kinds=tuple(self.kinds),
            modes=tuple(self.modes),
            marker_body=_integers(self.marker_body),
            marker_frame=_reals(np.array(self.marker_frame).reshape(-1, T.MARKER_COLUMNS)),
            rows=_integers(self.rows, T.ROW_COLUMNS),
            terms=_integers(self.terms, T.TERM_COLUMNS),
            coef=_reals(self.coef),
            reference=_reals(self.reference),
            forces=_integers(self.forces, T.FORCE_COLUMNS),
            functions=_integers(self.functions, T.FUNCTION_COLUMNS),
            function_r=_reals(self.function_r),
            extra_i=_integers(self.extra_i),
            extra_r=_reals(self.extra_r),
            states=_integers(self.states, T.STATE_COLUMNS),
            tapes=tuple(self.tapes),
            tape_rows=_integers(self.tape_rows, T.TAPE_COLUMNS),
            tape_work=self.tape_work,
            angles=_integers(self.angles, T.ANGLE_COLUMNS),
            kernels=MappingProxyType(dict(self.kernels)),
            lean=MappingProxyType(dict(self.lean)),
            own_functions=MappingProxyType(dict(self.own_functions)),
            diagnostics=tuple(self.diagnostics),
            largest_jac=self.largest_jac,
            modal=_reals(self.modal),
            modal_at=tuple(self.modal_at),
            modal_inertia=tuple(self.modal_inertia),
            frame_body=tuple(self.frame_body),
            shape_at=tuple(self.shape_at),
            names=names,
            numbers=MappingProxyType(dict(self.numbers)),
            aliases=MappingProxyType({alias: name for alias, name in self.aliases.items() if name in self.numbers}),
        )


def _reals(numbers: Any) -> np.ndarray:
    """Return an array of numbers that cannot be written to."""
    array = np.array(numbers, dtype=float)
    array.setflags(write=False)
    return array


def _integers(rows: Sequence[Any], columns: int | None = None) -> np.ndarray:
    """Return a table of integers that cannot be written to."""
    table = np.array(rows, dtype=np.int64)
    table = table if columns is None else table.reshape(-1, columns)
    table.setflags(write=False)
    return table
