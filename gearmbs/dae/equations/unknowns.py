"""The unknowns y of eq. (9): blocks, offsets, units, masks, scales, and what the formulations choose.

    y = [u, p, p_f, eps, v_f, R, theta, q_f, lambda, F, N, z, mu]

Every body has u and R, three entries each; one that turns has p, eps and theta, three each. A body with modal
coordinates q_f also has their velocities v_f and momenta p_f = dT/dv_f; without such bodies these blocks are empty and
y is that of eq. (9), extended by the user-defined states z and the multipliers mu of the stabilisation. How many
coordinates a body has is a matter of its kind, see `gearmbs.dae.equations.bodies`.

Nothing else in the package computes an offset: Python asks `offsets` and `places`, kernels read the header of the
tables and their table ``at``, which are filled from these two.

=========== ================================ =========================== ===============================
formulation constraints of eq. (7)           mu                          lambda and mu enter eq. (5), (6)
=========== ================================ =========================== ===============================
I3          positions                        absent                      themselves
SI2         positions and velocities         present                     themselves
SI1         positions and velocities         present                     as derivatives of the unknowns
=========== ================================ =========================== ===============================
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.dae import methods
from gearmbs.dae.equations import layout as T
from gearmbs.kernels.jit import njit

FORMULATIONS = {name: known.number for name, known in methods.FORMULATIONS.items()}
I3 = FORMULATIONS["I3"]
SI2 = FORMULATIONS["SI2"]
SI1 = FORMULATIONS["SI1"]

BLOCKS = {
    "u": ("velocity of the centre of mass", "(6)", "m/s"),
    "p": ("generalised momentum", "(5)", "kg m^2/s"),
    "p_f": ("momentum of the modal coordinate", "(5)", "kg m^2/s"),
    "eps": ("rate of the Euler angle", "(6)", "rad/s"),
    "v_f": ("velocity of the modal coordinate", "(6)", "1/s"),
    "R": ("position of the centre of mass", "(1)", "m"),
    "theta": ("Euler angle", "(1)", "rad"),
    "q_f": ("modal coordinate", "(1)", "1"),
    "lambda": ("multiplier of the constraint", "(5), (7)", "N or N m"),
    "F": ("applied force", "(5)", "N"),
    "N": ("applied torque", "(5)", "N m"),
    "z": ("user-defined state", "-", "-"),
    "mu": ("multiplier of the stabilisation", "(6), stabilised", "-"),
}
"""Meaning, equation and unit of each block of y, in the order of y."""

COMPONENTS = {"u": "xyz", "p": ("psi", "theta", "phi"), "eps": ("psi", "theta", "phi"), "R": "xyz"}
COMPONENTS["theta"] = COMPONENTS["eps"]
ANGULAR = ("p", "eps", "theta")
MODAL = ("p_f", "v_f", "q_f")
LIGHTEST = 1e-12
"""Smallest inertia, kg m^2, by which a momentum is scaled."""
GRAVITY = 9.81
"""Acceleration, m/s^2, that turns the heaviest body into a typical force: it scales equations, and is no load of a
model."""


@dataclass(frozen=True)
class Unknown:
    """One entry of y: its index, block of eq. (9), name, meaning, equation number and unit."""

    index: int
    block: str
    name: str
    meaning: str
    equation: str
    unit: str


@dataclass(frozen=True)
class Counts:
    """What the length of y depends on.

    Attributes
    ----------
    angles, modes : tuple of int
        Number of Euler angles and of modal coordinates of each moving body.
    rows : int
        Constraint rows.
    forces, torques : int
        Force elements whose F, whose N is unknown.
    states : int
        User-defined states.
    """

    angles: tuple[int, ...]
    modes: tuple[int, ...]
    rows: int
    forces: int
    torques: int
    states: int

    @property
    def bodies(self) -> int:
        """Number of moving bodies."""
        return len(self.modes)

    @property
    def coordinates(self) -> int:
        """Number of coordinates: displacements, Euler angles and modal ones."""
        return 3 * self.bodies + sum(self.angles) + sum(self.modes)

    @property
    def spatial(self) -> int:
        """Number of places for displacements and rotations, six a body, and for modal coordinates."""
        return 6 * self.bodies + sum(self.modes)

    @property
    def owners(self) -> np.ndarray:
        """Number of the moving body that each coordinate is of, in the order of R, theta and q_f."""
        every = np.arange(self.bodies)
        return np.concatenate([np.repeat(every, n) for n in (3, self.angles, self.modes)])

    @property
    def turning(self) -> np.ndarray:
        """Numbers of the moving bodies that have Euler angles."""
        return np.flatnonzero(self.angles)


def offsets(counts: Counts, formulation: int) -> dict[str, int]:
    """Return the index in y of the first entry of each block, and the length of y as ``n``."""
    three, angles, modal = 3 * counts.bodies, sum(counts.angles), sum(counts.modes)
    sizes = {
        "u": three,
        "p": angles,
        "p_f": modal,
        "eps": angles,
        "v_f": modal,
        "R": three,
        "theta": angles,
        "q_f": modal,
        "lambda": counts.rows,
        "F": 3 * counts.forces,
        "N": 3 * counts.torques,
        "z": counts.states,
        "mu": counts.rows if rows_have_rates(formulation) else 0,
    }
    at, next_free = {}, 0
    for block in BLOCKS:
        at[block] = next_free
        next_free += sizes[block]
    at["n"] = next_free
    return at


@njit(cache=True, error_model="numpy", forceinline=True)
def has_rate_rows(formulation):
    """Whether the derivatives of the constraints are among the equations, and so mu among the unknowns."""
    return formulation != I3


@njit(cache=True, error_model="numpy", forceinline=True)
def multipliers_are_rates(formulation):
    """Whether lambda and mu are derivatives of unknowns."""
    return formulation == SI1


rows_have_rates, multipliers_stand_as_rates = has_rate_rows.py_func, multipliers_are_rates.py_func
"""The same two answers, for Python."""


def places(counts: Counts, formulation: int) -> np.ndarray:
    """Return the table ``at`` of the kernels: where the unknowns of each body are, one row a body, the ground first.

    Returns
    -------
    ndarray of int, shape (1 + bodies, AT_COLUMNS)
        Columns ``AT_*`` of `gearmbs.dae.equations.layout`; -1 in the ground's row, which has none. Columns about
        elastic frames and modal integrals are left at -1. Without Euler angles the place of theta is that of R: sines
        are taken of two bodies' angles at a time, whether they have some or not.
    """
    at = offsets(counts, formulation)
    table = np.full((1 + counts.bodies, T.AT_COLUMNS), -1, dtype=np.int64)
    table[:, T.AT_ANGLES] = (0, *counts.angles)
    table[:, T.AT_MODES] = (0, *counts.modes)
    table[:, T.AT_BODY] = np.arange(1 + counts.bodies)
    angle = mode = 0
    for b, (angles, modes) in enumerate(zip(counts.angles, counts.modes, strict=True)):
        row = table[1 + b]
        row[T.AT_U], row[T.AT_R] = at["u"] + 3 * b, at["R"] + 3 * b
        row[T.AT_THETA] = row[T.AT_R]
        if angles:
            for column, block in ((T.AT_P, "p"), (T.AT_EPS, "eps"), (T.AT_THETA, "theta")):
                row[column] = at[block] + angle
        for column, block in ((T.AT_PF, "p_f"), (T.AT_VF, "v_f"), (T.AT_QF, "q_f")):
            row[column] = at[block] + mode
        row[T.AT_V] = 6 * b
        row[T.AT_V_MODES] = 6 * counts.bodies + mode
        angle += angles
        mode += modes
    return table


# --- what the formulations choose, for kernels ---------------------------------------------------------


@njit(cache=True, error_model="numpy", forceinline=True)
def multipliers_of_row(r, y, yp, idata):
    """Return lambda and mu of constraint row r: unknowns, or in SI1 derivatives of unknowns."""
    form = idata[T.H_FORMULATION]
    lam, mu = idata[T.H_LAMBDA] + r, idata[T.H_MU] + r
    if not has_rate_rows(form):
        return y[lam], 0.0
    if multipliers_are_rates(form):
        return yp[lam], yp[mu]
    return y[lam], y[mu]


@njit(cache=True, error_model="numpy", forceinline=True)
def multiplier_factor(cj, idata):
    """Return the derivative of lambda and mu with respect to the unknown they are made from."""
    return cj if multipliers_are_rates(idata[T.H_FORMULATION]) else 1.0


# --- masks, scales, names ------------------------------------------------------------------------------


def differential_mask(at: dict[str, int], formulation: int, states: np.ndarray) -> np.ndarray:
    """Return which unknowns appear differentiated; ``states`` says it of the user-defined ones."""
    mask = np.zeros(at["n"], dtype=bool)
    mask[: at["eps"]] = True
    mask[at["R"] : at["lambda"]] = True
    mask[at["z"] : at["mu"]] = states
    if multipliers_stand_as_rates(formulation):
        mask[at["lambda"] : at["F"]] = True
        mask[at["mu"] :] = True
    return mask


def given_by_momenta(at: dict[str, int], formulation: int) -> np.ndarray:
    """Return which unknowns under error control follow from the momenta p and p_f: eps and v_f, with rate rows."""
    mask = np.zeros(at["n"], dtype=bool)
    if rows_have_rates(formulation):
        mask[at["eps"] : at["R"]] = True
    return mask


def error_mask(at: dict[str, int], formulation: int, states: np.ndarray) -> np.ndarray:
    """Return whose error an integrator is to control: positions, with rate rows velocities, differential states.

    Momenta are functions of these. Multipliers and loads are algebraic: their errors do not accumulate.
    """
    mask = np.zeros(at["n"], dtype=bool)
    mask[at["R"] : at["lambda"]] = True
    mask[at["z"] : at["mu"]] = states
    if rows_have_rates(formulation):
        mask[velocities(at)] = True
    return mask


def plain_states(at: dict[str, int], controlled: np.ndarray) -> np.ndarray:
    """Return which unknowns are states outside error control, ``controlled`` saying it of the user-defined ones.

    Outputs hold these as they stand; multipliers and loads are evaluated anew there.
    """
    mask = np.zeros(at["n"], dtype=bool)
    mask[at["z"] : at["mu"]] = ~controlled
    return mask


def loads(at: dict[str, int]) -> np.ndarray:
    """Return which unknowns are applied forces and torques."""
    mask = np.zeros(at["n"], dtype=bool)
    mask[at["F"] : at["z"]] = True
    return mask


def velocities(at: dict[str, int]) -> np.ndarray:
    """Return the indices of u, eps and v_f, in the order of the coordinates R, theta and q_f."""
    return np.concatenate([np.arange(at["u"], at["p"]), np.arange(at["eps"], at["R"])])


def between_modes(at: dict[str, int], indptr: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Return which entries of a CSC pattern are in the equation of one mode and by an unknown of another."""
    mode, count = np.full(at["n"], -1), at["lambda"] - at["q_f"]
    for block in MODAL:
        mode[at[block] : at[block] + count] = np.arange(count)
    row, column = mode[indices], np.repeat(mode, np.diff(indptr))
    return (row >= 0) & (column >= 0) & (row != column)


def places_of_modes(at: dict[str, int], modes: Sequence[int]) -> np.ndarray:
    """Return the places of p_f, v_f and q_f of each mode and its body, flat; ``modes`` are those of each body."""
    count = at["lambda"] - at["q_f"]
    bodies = np.repeat(np.arange(len(modes)), modes)
    return np.column_stack([at[block] + np.arange(count) for block in MODAL] + [bodies]).ravel().astype(np.int64)


def scales(
    counts: Counts, formulation: int, bodies: np.ndarray, modes: np.ndarray, length: float, largest_force: float
) -> np.ndarray:
    """Return typical magnitudes of the unknowns.

    Parameters
    ----------
    bodies : ndarray, shape (bodies, BODY_COLUMNS)
        Mass and inertia of the moving bodies.
    modes : ndarray, shape (modal coordinates, 2)
        For each a typical size and a modal mass.
    length : float
        Of the mechanism, m, at most 1.
    largest_force : float
        Among the loads at the start, N.

    Returns
    -------
    ndarray, shape (n,)
    """
    at = offsets(counts, formulation)
    scale = np.ones(at["n"])
    scale[at["u"] : at["p"]] = length
    scale[at["R"] : at["theta"]] = length
    for k, row in enumerate(bodies[counts.turning]):
        first = at["p"] + 3 * k
        largest = np.abs(row[T.BODY_INERTIA :]).max()
        scale[first : first + 3] = max(largest, row[T.BODY_MASS] * 1e-8, LIGHTEST)
    for k, (size, mass) in enumerate(modes):
        scale[at["q_f"] + k] = scale[at["v_f"] + k] = size
        scale[at["p_f"] + k] = max(mass * size, LIGHTEST)
    weight = max((row[T.BODY_MASS] for row in bodies), default=1.0) * GRAVITY
    force = max(weight, largest_force, 1e-3)
    scale[at["lambda"] : at["N"]] = force
    scale[at["N"] : at["mu"]] = force * length
    scale[at["mu"] :] = length
    return scale


def named(
    counts: Counts,
    formulation: int,
    bodies: Sequence[str],
    rows: Sequence[str],
    forces: Sequence[str],
    torques: Sequence[str],
    states: Sequence[str],
) -> list[Unknown]:
    """Return the table of the unknowns in their order, from the names of what they belong to.

    ``forces`` and ``torques`` name the elements with an unknown F, with an unknown N.
    """
    owners = {"lambda": rows, "F": forces, "N": torques, "z": states, "mu": rows}
    out: list[Unknown] = []
    for block, (meaning, equation, unit) in BLOCKS.items():
        if block == "mu" and not rows_have_rates(formulation):
            continue
        if block in MODAL:
            names = [f"{block}_{k + 1}({body})" for body, n in zip(bodies, counts.modes) for k in range(n)]
        elif block in COMPONENTS:
            every = counts.angles if block in ANGULAR else counts.bodies * (3,)
            names = [f"{block}_{part}({body})" for body, n in zip(bodies, every) for part in COMPONENTS[block][:n]]
        elif block in ("F", "N"):
            names = [f"{block}_{part}({owner})" for owner in owners[block] for part in "xyz"]
        else:
            names = [f"{block}({owner})" for owner in owners[block]]
        out.extend(Unknown(len(out) + k, block, name, meaning, equation, unit) for k, name in enumerate(names))
    return out


# Entries of sparse matrices: one walk in a fixed order counts them, notes their places or adds up their numbers.


NUMBERS, PLACES, COUNT = 0, 1, 2


@njit("int64(int64, int64[::1], float64[::1], int64, int64, int64, float64)", cache=True, error_model="numpy")
def put(mode, slot, vals, k, row, col, value):
    """Hand over entry k; return the number of the next.

    Parameters
    ----------
    mode : int
        ``NUMBERS``: add the value to its place; ``PLACES``: note row and column; ``COUNT``: neither.
    slot : ndarray of int
        Place of each entry among the values in CSC order.
    vals : ndarray
        Values, or rows and columns one after the other.
    """
    if mode == NUMBERS:
        vals[slot[k]] += value
    elif mode == PLACES:
        vals[2 * k] = row
        vals[2 * k + 1] = col
    return k + 1


@njit(cache=True, error_model="numpy", forceinline=True)
def put_pair(mode, slot, vals, k, row, col, value):
    """Hand over an entry of Phi_q and its mirror image in Phi_q^T; return the number of the next entry."""
    k = put(mode, slot, vals, k, row, col, value)
    return put(mode, slot, vals, k, col, row, value)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_number(slot, vals, k, value):
    """Add the number of entry k to its place, as `put` in the mode NUMBERS; return the number of the next entry."""
    vals[slot[k]] += value
    return k + 1


@njit(cache=True, error_model="numpy", forceinline=True)
def add_pair(slot, vals, k, value):
    """Add the number of an entry of Phi_q and of its mirror image to their places; return the number of the next."""
    return add_number(slot, vals, add_number(slot, vals, k, value), value)


def compressed(places: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the CSC pattern of a list of (row, column) places and the slot of each place in it."""
    unique, slots = np.unique(places[:, 1] * n + places[:, 0], return_inverse=True)
    columns, rows = np.divmod(unique, n)
    indptr = np.searchsorted(columns, np.arange(n + 1)).astype(np.int64)
    return indptr, rows.astype(np.int64), slots.astype(np.int64)
