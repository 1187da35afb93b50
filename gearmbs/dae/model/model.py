"""The compiled, immutable model of a mechanism: typed tables and names, packed into arrays for the kernels.

Beside it its configuration: positions and velocities of all bodies at one instant, free of the singularities of angles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies import BodyKind
from gearmbs.dae.equations.bodies.frames import partials_size
from gearmbs.dae.equations.bodies.inertia import ModalInertia, present_size
from gearmbs.dae.equations.expressions.opcodes import HEAD_ALGEBRAIC_LIST
from gearmbs.dae.equations.loads.forces import FORCE_SIG, Diagnostic
from gearmbs.dae.equations.rotation import KIN_COLUMNS, POSE_A, POSE_COLUMNS, POSE_R, POSE_V
from gearmbs.dae.equations.unknowns import FORMULATIONS, I3, Counts, Unknown, named, offsets, places
from gearmbs.dae.problem import Number
from gearmbs.kernels.pointers import address


@dataclass(frozen=True, eq=False)
class Configuration:
    """Where the bodies are and how they move.

    Attributes
    ----------
    pose : ndarray, shape (bodies, 18)
        Position R and orientation A (row-major) of the centre of mass, velocity v and angular velocity omega of each
        moving body, global components.
    q_f, v_f : ndarray, shape (modal coordinates,)
        Modal coordinates of all bodies and their velocities.
    """

    pose: np.ndarray
    q_f: np.ndarray = field(default_factory=lambda: np.zeros(0))
    v_f: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, record: np.ndarray, bodies: int) -> Configuration:
        """Return the configuration of a record: the bodies' poses one after the other, then q_f and v_f."""
        end = POSE_COLUMNS * bodies
        half = (record.size - end) // 2
        return cls(record[:end].reshape(-1, POSE_COLUMNS), record[end : end + half], record[end + half :])

    @property
    def bodies(self) -> int:
        """Number of moving bodies."""
        return self.pose.shape[0]

    @property
    def coordinates(self) -> int:
        """Number of coordinates: six displacements of each body, then the modal coordinates."""
        return 6 * self.bodies + self.q_f.size

    def parts(self, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a vector over the coordinates as (bodies, 6) and what it has for the modal coordinates."""
        return change[: 6 * self.bodies].reshape(-1, 6), change[6 * self.bodies :]

    def displaced(self, step: np.ndarray) -> Configuration:
        """Return the configuration after displacements dR, rotations dpi (exponential map) and changes of q_f."""
        from scipy.spatial.transform import Rotation

        moved, bent = self.parts(step)
        pose = self.pose.copy()
        pose[:, POSE_R : POSE_R + 3] += moved[:, 0:3]
        axes = pose[:, POSE_A:POSE_V]
        turned = Rotation.from_rotvec(moved[:, 3:6]).as_matrix() @ axes.reshape(-1, 3, 3)
        axes[:] = turned.reshape(-1, 9)
        return Configuration(pose, self.q_f + bent, self.v_f)

    def pushed(self, change: np.ndarray) -> Configuration:
        """Return the configuration with changed velocities v, omega and v_f."""
        moved, bent = self.parts(change)
        pose = self.pose.copy()
        pose[:, POSE_V:POSE_COLUMNS] += moved
        return Configuration(pose, self.q_f, self.v_f + bent)

    def at_rest(self) -> Configuration:
        """Return the configuration with all velocities zero."""
        pose = self.pose.copy()
        pose[:, POSE_V:POSE_COLUMNS] = 0.0
        return Configuration(pose, self.q_f, np.zeros_like(self.v_f))

    @property
    def velocities(self) -> np.ndarray:
        """v and omega of each body, then v_f, shape (coordinates,)."""
        return np.concatenate([self.pose[:, POSE_V:POSE_COLUMNS].ravel(), self.v_f])


STATE_IMPLICIT = 2
"""Kind of a state z = f(..., z): to the equations algebraic, to integrators an unknown whose error counts."""


def frozen(array: npt.ArrayLike) -> np.ndarray:
    """Return a copy of an array that cannot be written to."""
    out = np.array(array)
    out.setflags(write=False)
    return out


@dataclass(frozen=True)
class Names:
    """Names of what the tables hold, for tables, results and messages.

    A row's name is ``joint: what it enforces``.
    """

    bodies: tuple[str, ...] = ()
    rows: tuple[str, ...] = ()
    forces: tuple[str, ...] = ()
    states: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Model:
    """Tables of a mechanism. Nothing changes them: dropping rows makes a new model.

    Attributes
    ----------
    gravity : ndarray, shape (3,)
        m/s^2.
    bodies : ndarray, shape (1 + moving bodies, BODY_COLUMNS)
        Mass and inertia about the centre of mass; the ground comes first.
    kinds : tuple of BodyKind
        Of each body.
    modes : tuple of int
        Number of modal coordinates of each body.
    marker_body, marker_frame : ndarray
        Body of each marker, its origin from the centre of mass and its axes in body components.
    rows, terms, coef, reference : ndarray
        Constraint rows, their terms, coefficients and, of counted angles, the values they start from.
    forces, functions, function_r, states, tape_rows : ndarray
        Force elements, functions of time with parameters, user-defined states, expressions.
    extra_i, extra_r : ndarray
        Tables that elements and expressions bring along.
    tapes : tuple
        The expressions as objects.
    angles : ndarray
        Angles that force elements count through full turns.
    kernels : mapping of int to compiled function
        Kernel of each compiled force element by its row.
    lean : mapping of int to callable
        Of elements with a leaner kernel for bodies that turn about fixed axes: what offers it, see `add_element`.
    own_functions : mapping of int to (compiled function, signature)
        Functions that elements call, by the place of their address in ``extra_i``.
    diagnostics : tuple
        Of each force element, what it reports besides its wrench.
    largest_jac : int
        Entries of the largest matrix of derivatives of a force element.
    modal : ndarray
        Integrals of modal bodies and shapes of elastic frames, as the kernels read them.
    modal_at, modal_inertia : tuple
        For each body the offset of its own numbers there, -1 of a rigid one, and the integrals; None without modes.
    frame_body, shape_at : tuple of int
        Of each elastic frame its body and the offset of its shapes; frames are numbered on from the bodies.
    numbers : mapping of str to Number
        What can be changed by its name; the tables of its places are ``H_R_EXTRA`` and ``H_R_FUNCTION``.
    aliases : mapping of str to str
        Further names of ``numbers``, and what each stands for.
    """

    gravity: np.ndarray
    bodies: np.ndarray
    kinds: tuple[BodyKind, ...]
    modes: tuple[int, ...]
    marker_body: np.ndarray
    marker_frame: np.ndarray
    rows: np.ndarray
    terms: np.ndarray
    coef: np.ndarray
    reference: np.ndarray
    forces: np.ndarray
    functions: np.ndarray
    function_r: np.ndarray
    extra_i: np.ndarray
    extra_r: np.ndarray
    states: np.ndarray
    tapes: tuple[Any, ...]
    tape_rows: np.ndarray
    tape_work: int
    angles: np.ndarray
    kernels: Mapping[int, Any]
    own_functions: Mapping[int, tuple[Any, Any]]
    diagnostics: tuple[tuple[Diagnostic, ...], ...]
    largest_jac: int
    modal: np.ndarray = field(default_factory=lambda: frozen(np.zeros(0)))
    modal_at: tuple[int, ...] = ()
    modal_inertia: tuple[ModalInertia | None, ...] = ()
    frame_body: tuple[int, ...] = ()
    shape_at: tuple[int, ...] = ()
    names: Names = field(default_factory=Names)
    numbers: Mapping[str, Number] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)
    lean: Mapping[int, Any] = field(default_factory=dict)

    @cached_property
    def rows_of_joint(self) -> dict[str, list[int]]:
        """Numbers of the constraint rows of each joint, by its name."""
        found: dict[str, list[int]] = {}
        for k, name in enumerate(self.names.rows):
            found.setdefault(name.rsplit(": ", 1)[0], []).append(k)
        return found

    @cached_property
    def has_finite_forces(self) -> bool:
        """Whether no load grows beyond bounds anywhere: there are none but those of this package's own kernels."""
        functions = [*self.kernels.values(), *(function for function, _ in self.own_functions.values())]
        homes = [str(getattr(function, "py_func", function).__module__) for function in functions]
        return not self.tapes and all(home.startswith("gearmbs.") for home in homes)

    @cached_property
    def counts(self) -> Counts:
        """What the length of y depends on."""
        return Counts(
            angles=tuple(kind.angles for kind in self.kinds[1:]),
            modes=self.modes[1:],
            rows=len(self.rows),
            forces=int(np.sum(self.forces[:, T.FORCE_F])),
            torques=int(np.sum(self.forces[:, T.FORCE_N])),
            states=len(self.states),
        )

    @cached_property
    def layouts(self) -> dict[int, dict[str, int]]:
        """Offsets of the blocks of y, eq. (9), by the formulation."""
        return {formulation: offsets(self.counts, formulation) for formulation in FORMULATIONS.values()}

    def unknowns(self, formulation: str = "SI2") -> list[Unknown]:
        """Return the table of the unknowns of eq. (9) in their order."""
        names = self.names
        forces = [name for name, row in zip(names.forces, self.forces) if row[T.FORCE_F]]
        torques = [name for name, row in zip(names.forces, self.forces) if row[T.FORCE_N]]
        owners = (names.bodies, names.rows, forces, torques, names.states)
        return named(self.counts, FORMULATIONS[formulation], *owners)

    @cached_property
    def differential_states(self) -> np.ndarray:
        """Which user-defined states are given by their rates, shape (states,)."""
        return self.states[:, T.STATE_KIND] == T.STATE_DIFFERENTIAL

    @cached_property
    def controlled_states(self) -> np.ndarray:
        """Which user-defined states have their error controlled: those by their rates, and by equations they enter."""
        return self.states[:, T.STATE_KIND] != T.STATE_ALGEBRAIC

    @cached_property
    def modal_sizes(self) -> np.ndarray:
        """For each modal coordinate a typical value and the modal mass, shape (modal coordinates, 2).

        Typical is what moves the mass of the body as much as a displacement of its radius of gyration would.
        """
        rows = []
        for body, modal in zip(self.bodies, self.modal_inertia):
            if modal is None:
                continue
            inertia = float(np.abs(body[T.BODY_INERTIA :]).max())
            for mass in np.diag(modal.mass):
                rows.append((np.sqrt(inertia / mass) if inertia > 0.0 else 1.0, mass))
        return frozen(np.array(rows).reshape(-1, 2))

    @cached_property
    def longest_arm(self) -> float:
        """Largest coordinate of a marker's origin from the undeformed body's centre of mass, m."""
        places = self.marker_frame[:, :3].copy()
        elastic = self.marker_body >= len(self.bodies)
        shapes = np.array(self.shape_at, dtype=np.int64)[self.marker_body[elastic] - len(self.bodies)]
        places[elastic] = self.modal[shapes[:, None] + np.arange(3)]
        return float(np.abs(places).max(initial=0.0))

    @cached_property
    def spans(self) -> list[slice]:
        """Where the terms of each constraint row are."""
        ends = [*self.rows[:, T.ROW_FIRST].tolist(), len(self.terms)]
        return [slice(first, end) for first, end in pairwise(ends)]

    def with_rows(self, kept: np.ndarray) -> Model:
        """Return the model with the constraint rows ``kept`` alone.

        What depends on an unknown is pointed to its new place in y; reactions lose the multipliers that are dropped.
        """
        spans = [self.spans[i] for i in kept]
        sizes = [span.stop - span.start for span in spans]
        places_of_terms = np.concatenate([np.arange(span.start, span.stop) for span in spans] or [np.zeros(0, int)])
        terms = places_of_terms.astype(np.int64)
        rows = self.rows[kept].copy()
        rows[:, T.ROW_FIRST] = np.concatenate([[0], np.cumsum(sizes)[:-1]]) if len(sizes) else 0
        old = self.layouts[I3]
        less = len(self.rows) - len(kept)
        new = {old["lambda"] + int(i): old["lambda"] + k for k, i in enumerate(kept)}
        new |= {k: k - less for k in range(old["F"], old["n"])}
        forces, extra_i = self._renumbered(new)
        return replace(
            self,
            rows=frozen(rows),
            terms=frozen(self.terms[terms]),
            coef=frozen(self.coef[terms]),
            reference=frozen(self.reference[terms]),
            forces=frozen(forces),
            extra_i=frozen(extra_i),
            names=replace(self.names, rows=tuple(self.names.rows[i] for i in kept)),
        )

    def _renumbered(self, new: dict[int, int]) -> tuple[np.ndarray, np.ndarray]:
        """Return forces and extra integers in which unknowns have new places; those missing in ``new`` are gone.

        Only reactions depend on multipliers, and only multipliers are ever dropped. An element's own states have their
        number less than 0 there, until the tables are packed.
        """
        forces, extra_i = self.forces.copy(), self.extra_i.copy()
        for row in forces:
            at = row[T.FORCE_DEPENDS]
            bodies = extra_i[at]
            first = at + 2 + bodies
            places = [int(k) for k in extra_i[first : first + extra_i[first - 1]]]
            kept = [k if k < 0 else new[k] for k in places if k < 0 or k in new]
            extra_i[first - 1] = len(kept)
            extra_i[first : first + len(kept)] = kept
            row[T.FORCE_WIDTH] = T.FRAME_VARIATIONS * bodies + len(kept)
        for tape in self.tape_rows:
            codes = tape[T.TAPE_I]
            unknowns, count = tape[T.TAPE_BODIES] + tape[T.TAPE_N_BODIES], tape[T.TAPE_N_UNKNOWNS]
            for at in (unknowns, codes + extra_i[codes + HEAD_ALGEBRAIC_LIST]):
                extra_i[at : at + count] = [new[int(k)] for k in extra_i[at : at + count]]
        return forces, extra_i

    # --- for the kernels ----------------------------------------------------------------------------

    def pack(
        self, formulation: int, slots: np.ndarray | None = None, codes: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Return new arrays for the kernels.

        Parameters
        ----------
        formulation : int
        slots : ndarray of int, optional
            Place of each entry of the Jacobian among its values.
        codes : ndarray of int, optional
            Euler reference of each body, the ground first; default: the identity.

        Returns
        -------
        idata, rdata : ndarray
        work_size : int
        """
        if formulation not in self._packed:
            self._packed[formulation] = self._tables(formulation)
        head, integers, rdata = self._packed[formulation]
        head = head.copy()
        codes = integers[T.H_I_CODE] if codes is None else codes
        slots = integers[T.H_I_SLOT] if slots is None else slots
        head[T.H_SLOTS] = slots.size
        integers = integers | {T.H_I_CODE: codes, T.H_I_SLOT: slots}
        _place(head, integers, T.H_SIZE)
        return np.concatenate([head, *integers.values()]), rdata.copy(), int(head[T.H_WORK])

    def numbers_in(self, idata: np.ndarray) -> dict[str, Number]:
        """Return what can be changed by its name, with its places among the numbers packed with ``idata``."""
        return {name: number.placed(idata) for name, number in self.numbers.items()}

    @cached_property
    def _packed(self) -> dict[int, tuple[np.ndarray, dict[int, np.ndarray], np.ndarray]]:
        """Header, tables of integers and all numbers as the kernels read them, by the formulation."""
        return {}

    def _tables(self, formulation: int) -> tuple[np.ndarray, dict[int, np.ndarray], np.ndarray]:
        """Return header, tables of integers and all numbers, with no slots and the identity as Euler reference."""
        head = self._head(formulation)
        forces, extra_i, work = self._placed_forces(formulation)
        head[T.H_WORK] = head[T.H_W_SCRATCH] + work
        end = [(len(self.terms), -1, -1)]
        integers = {
            T.H_I_AT: self._places(formulation),
            T.H_I_CODE: np.zeros(len(self.bodies)),
            T.H_I_MARKER_BODY: self.marker_body,
            T.H_I_ROW: np.concatenate([self.rows, end]),
            T.H_I_TERM: self.terms,
            T.H_I_FORCE: forces,
            T.H_I_FUNCTION: self.functions,
            T.H_I_EXTRA: extra_i,
            T.H_I_SLOT: np.zeros(0),
            T.H_I_STATE: self.states,
            T.H_I_TAPE: self._addressed_tapes(),
            T.H_I_ANGLE: self.angles,
        }
        # references of counted angles; time, values and rates where they were last counted; angles of the matrix
        now, unseen = np.zeros(1), np.zeros(len(self.reference) + 3 * len(self.bodies))
        reals = {
            T.H_R_GRAVITY: self.gravity,
            T.H_R_BODY: self.bodies,
            T.H_R_MARKER: self.marker_frame,
            T.H_R_COEF: self.coef,
            T.H_R_FUNCTION: self.function_r,
            T.H_R_EXTRA: self.extra_r,
            T.H_R_MODAL: self.modal,
            T.H_R_REFERENCE: np.concatenate([self.reference, now, self.reference, unseen]),
        }
        _place(head, reals, 0)
        rdata = np.concatenate([np.ravel(table).astype(np.float64) for table in reals.values()])
        return head, {key: np.ravel(table).astype(np.int64) for key, table in integers.items()}, rdata

    def _head(self, formulation: int) -> np.ndarray:
        """Return the header: counts, offsets of y and of the work array; the tables are placed later."""
        at, counts = self.layouts[formulation], self.counts
        head = np.zeros(T.H_SIZE, dtype=np.int64)
        head[T.H_BODIES], head[T.H_MARKERS] = len(self.bodies), len(self.marker_body)
        head[T.H_ROWS], head[T.H_TERMS] = len(self.rows), len(self.terms)
        head[T.H_FORCES], head[T.H_FUNCTIONS] = len(self.forces), len(self.functions)
        head[T.H_STATES], head[T.H_TAPES] = len(self.states), len(self.tapes)
        head[T.H_FORMULATION], head[T.H_UNKNOWNS], head[T.H_COORDINATES] = formulation, at["n"], counts.spatial
        for column, block in T.HEAD_OF_BLOCK.items():
            head[column] = at[block]
        head[T.H_ANGLES] = len(self.angles)
        head[T.H_DIAGNOSTICS] = max((len(d) for d in self.diagnostics), default=0)
        head[T.H_N_EXTRA_I], head[T.H_N_EXTRA_R] = len(self.extra_i), len(self.extra_r)
        head[T.H_N_FUNCTION_R] = len(self.function_r)
        head[T.H_FRAMES], head[T.H_N_MODAL] = len(self.bodies) + len(self.frame_body), self.modal.size
        head[T.H_N_PARTIAL] = sum(self._present_sizes) + sum(self._partial_sizes)
        head[T.H_W_KIN] = 0
        head[T.H_W_MARKER] = head[T.H_FRAMES] * KIN_COLUMNS
        head[T.H_W_FUNCTION] = head[T.H_W_MARKER] + len(self.marker_body) * T.MK_COLUMNS
        head[T.H_W_TAPE] = head[T.H_W_FUNCTION] + T.FUNCTION_VALUES * len(self.functions)
        head[T.H_W_TAPE_SIZE] = self.tape_work
        head[T.H_W_PARTIAL] = head[T.H_W_TAPE] + self.tape_work
        head[T.H_W_SCRATCH] = head[T.H_W_PARTIAL] + head[T.H_N_PARTIAL]
        return head

    def _places(self, formulation: int) -> np.ndarray:
        """Return the table ``at``: bodies, then the elastic frames, which have the places of their bodies."""
        bodies = places(self.counts, formulation)
        bodies[:, T.AT_MODAL] = self.modal_at
        partial = 0
        for row, size in zip(bodies, self._present_sizes):
            row[T.AT_PARTIAL] = partial
            partial += size
        frames = bodies[list(self.frame_body)]
        for row, body, shape, size in zip(frames, self.frame_body, self.shape_at, self._partial_sizes):
            row[T.AT_BODY], row[T.AT_SHAPE], row[T.AT_PARTIAL] = body, shape, partial
            partial += size
        return np.concatenate([bodies, frames])

    @cached_property
    def _present_sizes(self) -> list[int]:
        """How many numbers the present state of each body takes."""
        sizes = {modes: present_size(modes) for modes in {*self.modes}}
        return [sizes[modes] for modes in self.modes]

    @cached_property
    def _partial_sizes(self) -> list[int]:
        """How many numbers the partial derivatives of each elastic frame take."""
        return [partials_size(self.modes[body]) for body in self.frame_body]

    def _addressed_tapes(self) -> np.ndarray:
        """Return the rows of the expressions with the addresses of their evaluators, loaded only if there are any."""
        rows = self.tape_rows.copy()
        if self.tapes:
            from gearmbs.dae.equations.loads.expressions import addresses

            rows[:, T.TAPE_ADDRESS :] = addresses()
        return rows

    def _placed_forces(self, formulation: int) -> tuple[np.ndarray, np.ndarray, int]:
        """Return the force elements with their places in y and in scratch, the extra integers, the scratch needed.

        Places of an element's own states and addresses of functions are put among the extra integers.
        """
        at = self.layouts[formulation]
        forces, extra_i = self.forces.copy(), self.extra_i.copy()
        free = {T.FORCE_F: at["F"], T.FORCE_N: at["N"]}
        work = T.SCRATCH_FIXED + self.largest_jac
        leader = np.zeros(T.FORCE_COLUMNS, dtype=np.int64)
        for number, row in enumerate(forces):
            for column in (T.FORCE_F, T.FORCE_N):
                if row[column]:
                    row[column] = free[column]
                    free[column] += 3
                else:
                    row[column] = -1
            if row[T.FORCE_KIND] != T.COMPILED:
                continue
            if row[T.FORCE_PART] == 0:
                leader = row
                row[T.FORCE_ADDRESS] = address(self.kernels[number], FORCE_SIG)
                row[T.FORCE_Z] += at["z"]
                row[T.FORCE_WORK], work = work, work + int(row[T.FORCE_WORK])
            else:
                row[T.FORCE_WORK] = leader[T.FORCE_WORK]
            first = row[T.FORCE_DEPENDS] + 2 + extra_i[row[T.FORCE_DEPENDS]]
            depends = extra_i[first : first + extra_i[first - 1]]
            own = depends < 0
            depends[own] = leader[T.FORCE_Z] - 1 - depends[own]
        for place, (function, signature) in self.own_functions.items():
            extra_i[place] = address(function, signature)
        return forces, extra_i, int(work)


def _place(head: np.ndarray, tables: dict[int, np.ndarray], first: int) -> None:
    """Note in the header where each table starts, one after the other."""
    for key, table in tables.items():
        head[key] = first
        first += np.size(table)
