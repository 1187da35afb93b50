"""The torsional chain of a drivetrain: what it is when everything but rotation is rigid.

M theta'' + C theta' + K theta = T, one angle a shaft, or of all shafts that rigid couplings join. A coupling of
stiffness k between shafts i and j adds k to the diagonal and -k beside it; a mesh of stiffness k along the line of
action adds k g g^T with g = (r_b1, s r_b2) in the angles of its shafts, where s is 1 for external and -1 for internal
pairs. A mesh of a planetary stage counts angles from the carrier, whose lever is therefore -(r_b1 + s r_b2); planets
have angles of their own, and the carrier's inertia has their masses at its radius.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.linalg

from gearmbs.drivetrain.couplings.aligned import is_rigid
from gearmbs.drivetrain.drives import SpeedDrive
from gearmbs.drivetrain.part import errors_named, require
from gearmbs.drivetrain.planetary import Meshing, PlanetaryStage, standing
from gearmbs.gears.ideal_mesh import IdealMesh
from gearmbs.gears.stiffness import pair_stiffness
from gearmbs.kernels.jit import njit
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

CURVE_POINTS = 200
"""Along the path of contact, for the mean of a stiffness that varies."""

CYCLE_POINTS = 50
"""Over a mesh cycle, for the mean stiffness of tilted wheels: where pairs come and go is known to a fiftieth of it."""


@dataclass(frozen=True)
class TorsionalSpring:
    """A spring between shafts: k (g . theta), with g from its levers.

    Attributes
    ----------
    name : str
    shafts : tuple of int
        Two; of a mesh of a planetary stage also the carrier, and of what is held none.
    levers : tuple of float
        1 and -1 of a coupling; base radii of a mesh, m.
    stiffness, damping : float
        N m/rad and N m s/rad of a coupling, N/m and N s/m of a mesh.
    backlash : float
        Of a mesh along the line of action, or of a clutch its dead band, m or rad.
    preload : float
        Force or torque at the operating point.
    sense : int
        Of a mesh: the sign of g . theta for which the drive flanks close.
    """

    name: str
    shafts: tuple[int, ...]
    levers: tuple[float, ...]
    stiffness: float
    damping: float = 0.0
    backlash: float = 0.0
    preload: float = 0.0
    sense: int = 1

    def row(self, size: int) -> np.ndarray:
        """Return g, shape (shafts,)."""
        g = np.zeros(size)
        for shaft, lever in zip(self.shafts, self.levers, strict=True):
            g[shaft] += lever
        return g


@dataclass(frozen=True)
class TorsionalModel:
    """Inertias and torsional springs; see `gearmbs.drivetrain.torsional` for the equations.

    Attributes
    ----------
    names : tuple of str
        Shafts, then planets; of shafts in rigid couplings the first one.
    inertias : ndarray, shape (n,)
        kg m^2.
    springs : tuple of TorsionalSpring
    ground : ndarray, shape (n,)
        Torsional damping against the ground (of drives and loads), N m s/rad.
    held : tuple of int
        Shafts whose rotation is prescribed.
    joined : dict of str to str
        The name under which the others of rigid couplings are counted, by theirs.
    """

    names: tuple[str, ...]
    inertias: np.ndarray
    springs: tuple[TorsionalSpring, ...]
    ground: np.ndarray
    held: tuple[int, ...] = field(default=())
    joined: Mapping[str, str] = field(default_factory=dict)

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return M, C and K, each (n, n)."""
        n = len(self.names)
        k, c = np.zeros((n, n)), np.diag(self.ground).astype(float)
        for spring in self.springs:
            g = spring.row(n)
            k += spring.stiffness * np.outer(g, g)
            c += spring.damping * np.outer(g, g)
        return np.diag(self.inertias), c, k

    def frequencies(self) -> np.ndarray:
        """Return the undamped natural frequencies with prescribed shafts held, increasing, Hz.

        Of the modes that oscillate, and 0 of rigid ones: those that are damped above critical by their
        `damping_ratios` have none, and are left out. `modes` has them, too.
        """
        return self.modes()[0][self.damping_ratios() < 1.0]

    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the undamped frequencies (Hz) and shapes of all modes, columns scaled to a largest entry of 1.

        Whether one oscillates at its frequency is told by `damping_ratios`.
        """
        m, _, k = self.matrices()
        free = [i for i in range(len(self.names)) if i not in self.held]
        if not free:
            return np.zeros(0), np.zeros((len(self.names), 0))
        squares, vectors = scipy.linalg.eigh(k[np.ix_(free, free)], m[np.ix_(free, free)])
        largest = np.abs(squares).max(initial=0.0)
        squares[np.abs(squares) < 1e-10 * largest] = 0.0
        shapes = np.zeros((len(self.names), len(free)))
        shapes[free] = vectors / np.abs(vectors).max(axis=0)
        return np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi), shapes

    def damping_ratios(self) -> np.ndarray:
        """Return phi.C phi / (2 w phi.M phi) of each of `modes`: from 1 on it does not oscillate; 0 of rigid ones."""
        m, c, _ = self.matrices()
        frequencies, shapes = self.modes()
        lost, held = (np.einsum("ia,ij,ja->a", shapes, matrix, shapes) for matrix in (c, m))
        rates = 4.0 * np.pi * frequencies * held
        return np.divide(lost, rates, out=np.zeros(rates.size), where=rates > 0.0)

    def response(self, frequency: np.ndarray, force: dict[str, complex]) -> np.ndarray:
        """Return the complex amplitudes of the angles under harmonic torques, or motions of prescribed shafts.

        Parameters
        ----------
        frequency : ndarray, shape (m,)
            Hz.
        force : dict of str to complex
            Amplitude of the torque (N m) by shaft; of a prescribed shaft that of its angle (rad).

        Returns
        -------
        ndarray of complex, shape (m, n)
        """
        m, c, k = self.matrices()
        held = list(self.held)
        free = [i for i in range(len(self.names)) if i not in self.held]
        applied = np.zeros(len(self.names), dtype=complex)
        for name, size in force.items():
            applied[self._place(name, "response")] += size
        out = np.zeros((np.size(frequency), len(self.names)), dtype=complex)
        for row, f in enumerate(np.atleast_1d(frequency)):
            w = 2.0 * np.pi * f
            dynamic = k + 1j * w * c - w * w * m
            out[row, held] = applied[held]
            load = applied[free] - dynamic[np.ix_(free, held)] @ applied[held]
            out[row, free] = np.linalg.solve(dynamic[np.ix_(free, free)], load)
        return out

    def simulate(
        self,
        duration: float,
        torques: dict[str, float],
        motion: dict[str, tuple[float, float, float]],
        *,
        samples: float = 2000.0,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Integrate the chain in time, with the backlash of its springs, by Runge-Kutta steps of fixed length.

        Parameters
        ----------
        duration : float
            s.
        torques : dict of str to float
            Constant torques on free shafts, N m.
        motion : dict of str to (float, float, float)
            Of every prescribed shaft w (rad/s), A (rad) and f (Hz) of its angle w t - A sin(2 pi f t).
        samples : float
            Rows a second; at least.

        Returns
        -------
        t : ndarray, shape (m,)
        angles, speeds : ndarray, shape (m, n)

        Raises
        ------
        DrivetrainError
            If a prescribed shaft has no motion.
        """

        n = len(self.names)
        prescribed = np.zeros((n, 4))
        motions = {self._place(name, "simulate"): one for name, one in motion.items()}
        for i in self.held:
            require(i in motions, f"simulate: shaft '{self.names[i]}' is prescribed; give its motion")
            w, a, f = motions[i]
            prescribed[i] = (1.0, w, a, 2.0 * np.pi * f)
        load = np.zeros(n)
        for name, torque in torques.items():
            load[self._place(name, "simulate")] += torque
        rows = np.array([spring.row(n) for spring in self.springs]).reshape(-1, n)
        numbers = np.zeros((len(self.springs), 5))
        for k, spring in enumerate(self.springs):
            # a clutch is free on both sides, a mesh on one
            share = 0.5 if spring.levers[1:] == (-1.0,) else 0.0
            high, low = share * spring.backlash, (share - 1.0) * spring.backlash
            numbers[k] = (spring.stiffness, spring.damping, spring.sense, high, low)
        fastest = max(1.0, *self.modes()[0])
        every = max(1, int(np.ceil(STEPS_PER_PERIOD * fastest / samples)))
        step = 1.0 / (max(samples, STEPS_PER_PERIOD * fastest / every) * every)
        count = int(np.ceil(duration / (step * every) - 1e-9))
        out = np.empty((count + 1, 2 * n))
        state = np.zeros(2 * n)
        held = {i: motions[i][0] - motions[i][1] * prescribed[i, 3] for i in self.held}
        state[n:] = [self._rolling(i, held) for i in range(n)]
        out[0] = state
        integrate(state, self.inertias, self.ground, load, rows, numbers, prescribed, step, every, out)
        return np.arange(count + 1) * step * every, out[:, :n], out[:, n:]

    def _place(self, name: str, asked_by: str) -> int:
        """Return which inertia a shaft is, or belongs to."""
        known = self.joined.get(name, name)
        require(known in self.names, f"{asked_by}: there is no shaft '{name}'; they are {', '.join(self.names)}")
        return self.names.index(known)

    def _rolling(self, shaft: int, known: dict[int, float]) -> float:
        """Return the speed of a shaft with which no spring between it and the prescribed shafts is stretched."""
        if any(len(spring.shafts) != 2 for spring in self.springs):
            free = [k for k in range(len(self.names)) if k not in known]
            rows = np.array([spring.row(len(self.names)) for spring in self.springs])
            drive = rows[:, list(known)] @ np.array(list(known.values()))
            found = dict(zip(free, np.linalg.lstsq(rows[:, free], -drive, rcond=None)[0]))
            return float({**known, **found}[shaft])
        speeds = dict(known)
        for _ in self.springs:
            for spring in self.springs:
                one, two = spring.shafts
                if (one in speeds) != (two in speeds):
                    a, b = spring.levers
                    here, there = (one, two) if one in speeds else (two, one)
                    speeds[there] = -speeds[here] * (a / b if here == one else b / a)
        return speeds.get(shaft, 0.0)

    def __repr__(self) -> str:
        frequencies, over = self.frequencies(), self.damping_ratios() >= 1.0
        shown = ", ".join(f"{f:.5g}" for f in frequencies[frequencies > 0.0]) or "no"
        rigid = int(np.sum(frequencies == 0.0))
        apart = f", {rigid} rigid" if rigid else ""
        apart += f", {int(over.sum())} over-damped" if over.any() else ""
        return f"TorsionalModel({len(self.names)} inertias, {len(self.springs)} springs: {shown} Hz{apart})"


def torsional_model(train: Drivetrain) -> TorsionalModel:
    """Return the torsional chain of a drivetrain; meshes have their mean stiffness at the operating torque.

    The mean over a mesh cycle is the tangent stiffness of one tooth pair (of the law, under the force it has to carry,
    over the part of the faces in mesh) times the contact ratio. Under a misalignment, which lets a part of the face
    carry only, it is that of `gearmbs.gears.loaded_transmission_error`, and the damping is as much less.

    Warns
    -----
    UserWarning
        Of tilted wheels without load, whose stiffness is taken as that of parallel ones.
    """
    names, place = inertias_of(train)
    inertias = _inertias(train, names, place)
    springs = []
    for coupling in train.couplings:
        if is_rigid(coupling):
            continue
        shafts = place[coupling.first], place[coupling.second]
        springs.append(
            TorsionalSpring(
                coupling.name, shafts, (1.0, -1.0), coupling.tangent, coupling.tangent_damping,
                getattr(coupling, "dead_band", 0.0), train.power.torques[coupling.name][1],
            )
        )  # fmt: skip
    springs += [train.mesh_springs[mesh.name] for mesh in train.meshings]
    ground = np.zeros(len(names))
    for drive in train.drives:
        ground[place[drive.shaft]] += drive.damping()
    held = tuple(sorted({place[d.shaft] for d in train.drives if isinstance(d, SpeedDrive)}))
    joined = {name: names[k] for name, k in place.items() if name != names[k]}
    return TorsionalModel(names, inertias, tuple(springs), ground, held, joined)


def inertias_of(train: Drivetrain) -> tuple[tuple[str, ...], dict[str, int]]:
    """Return the names of the inertias of the chain, and which of them each shaft and planet is.

    Shafts in rigid couplings are one, under the name of the first of them.
    """
    first = {name: name for name in train.turning}
    for coupling in train.couplings:
        if is_rigid(coupling):
            one, two = sorted((first[coupling.first], first[coupling.second]), key=list(first).index)
            first = {name: one if of == two else of for name, of in first.items()}
    names = tuple(dict.fromkeys(first.values()))
    return names, {name: names.index(of) for name, of in first.items()}


class MeshDynamics(NamedTuple):
    """How a mesh of a drivetrain springs and damps at the operating point.

    Attributes
    ----------
    law : str
        The contact law of a tooth pair.
    stiffness, damping : float
        Means over a mesh cycle, in the transverse plane along the line of action, N/m and N s/m; zero without load by
        laws of another exponent than 1.
    mass : float
        Of both shafts with their wheels there, 1 / (r_b1^2 / J_1 + r_b2^2 / J_2), kg, and with those that rigid
        couplings join to them; a shaft of prescribed speed counts as held.
    """

    law: str
    stiffness: float
    damping: float
    mass: float

    @property
    def frequency(self) -> float:
        """Natural frequency of both shafts on this mesh alone, without damping, Hz."""
        return math.sqrt(self.stiffness / self.mass) / (2.0 * math.pi) if self.mass > 0.0 else math.nan

    @property
    def damping_ratio(self) -> float:
        """Damping ratio of that motion, c / (2 sqrt(k m)); above 1 it does not oscillate."""
        size = 2.0 * math.sqrt(self.stiffness * self.mass)
        return self.damping / size if size > 0.0 else math.nan


def mesh_dynamics(train: Drivetrain) -> dict[str, MeshDynamics]:
    """Return law, stiffness, damping and reduced mass of each mesh, by name; of stages by "sun" and "ring"."""
    names, place = inertias_of(train)
    inertias = _inertias(train, names, place)
    held = [place[drive.shaft] for drive in train.drives if isinstance(drive, SpeedDrive)]
    out = {}
    for mesh in train.meshings:
        if mesh.group in out:
            # planets of a stage are alike
            continue
        spring = train.mesh_springs[mesh.name]
        softness = spring.row(len(names)) ** 2 / inertias
        softness[held] = 0.0
        mass = 1.0 / softness.sum() if softness.any() else 0.0
        law = mesh_law(train, mesh.name)
        out[mesh.group] = MeshDynamics(law, float(spring.stiffness), float(spring.damping), float(mass))
    return out


def mesh_law(train: Drivetrain, mesh: str) -> str:
    """Return the contact law of a mesh in words."""
    pair = train.pairs[mesh]
    # an ideal mesh has words of its own
    return str(getattr(pair, "law", None) or pair.contact_model.law)


def warn_of_overdamped_meshes(train: Drivetrain) -> None:
    """Warn of meshes whose damping is above critical.

    Warns
    -----
    UserWarning
        With the mesh, its law and the remedy.
    """
    for name, found in train.mesh_dynamics.items():
        if found.damping_ratio > 1.0:
            warn(
                f"mesh '{name}' is damped {found.damping_ratio:.3g} times critically by its law ({found.law}): its "
                f"mode at {found.frequency:.4g} Hz does not oscillate, and is missing in modes and Campbell diagrams; "
                "leave contact out for the stiffness of the wheels and a damping ratio, or give less damping"
            )


def warn_of_idle_meshes(train: Drivetrain) -> None:
    """Warn of meshes that carry nothing by laws that have no stiffness then.

    Warns
    -----
    UserWarning
        With the mesh, its law and the remedy.
    """
    for name, found in train.mesh_dynamics.items():
        if found.stiffness == 0.0:
            warn(
                f"mesh '{name}' carries nothing, and its law ({found.law}) has no stiffness without load: the "
                "torsional chain has no spring there; give a load, or a law of exponent 1"
            )


def _inertias(train: Drivetrain, names: tuple[str, ...], place: dict[str, int]) -> np.ndarray:
    """Return the moments of inertia of all shafts with their wheels, and of planets, about their axes, kg m^2."""
    inertias = np.zeros(len(names))
    for shaft in train.shafts:
        inertias[place[shaft.name]] += shaft.body()[2] + sum(c.inertia[2] for c in standing(train, shaft.name))
    for planet, stage in train.planets.items():
        mass, moments = stage.weights["planet"]
        inertias[place[planet]] += moments[2]
        if stage.carrier in place:
            carrier = place[stage.carrier]
            inertias[carrier] += mass * float(stage.gears.carrier_radius) ** 2
            if stage.carrier_apart(train):
                inertias[carrier] += stage.weights["carrier"][1][2] / stage.gears.planets
    return inertias


def mesh_springs(train: Drivetrain) -> dict[str, TorsionalSpring]:
    """Return the spring of each mesh, by name; see `torsional_model`."""
    _, place = inertias_of(train)
    return {mesh.name: _mesh_spring(train, mesh, place) for mesh in train.meshings}


def _carried_force(train: Drivetrain, mesh: Meshing) -> float:
    """Return the force along the transverse line of action at the operating point, N; planets share a stage's."""
    geometry = train.pairs[mesh.name].geometry
    if not mesh.stage:
        return train.power.on_driven(mesh.name) / geometry.driven.base_radius
    stage = train.part(mesh.stage, PlanetaryStage)
    member = mesh.group.removeprefix(f"{mesh.stage} ")
    wheel = geometry.driver if member == "sun" else geometry.driven
    return abs(train.power.members[mesh.stage][member]) / (stage.gears.planets * wheel.base_radius)


def _mesh_spring(train: Drivetrain, mesh: Meshing, place: dict[str, int]) -> TorsionalSpring:
    pair = train.pairs[mesh.name]
    geometry, law = pair.geometry, pair.contact_model
    force = _carried_force(train, mesh)
    share = max(1.0, geometry.contact_ratio)
    # a helical flank has its normal out of the transverse plane, in gap and in force, and a longer line of contact
    transverse = math.cos(geometry.driver.base_helix_angle)
    face = law.face_share(geometry)
    linear = law.law.exponent == 1.0
    if linear:
        one = face * law.law.stiffness
    else:
        # F = K d^n has the slope n K d^(n - 1): none without load
        one = law.tangent_stiffness(force / share, 1, face) if force > 0.0 else 0.0
    if law.stiffness_curve == "potential-energy":
        # the law's stiffness is the largest along the path
        path = np.linspace(geometry.first_roll_lengths[0], geometry.driver.tip_roll_length, CURVE_POINTS)
        curve = pair_stiffness(geometry, path)
        one *= float(curve.mean() / curve.max())
    stiffness = float(transverse * one * geometry.contact_ratio)
    damping = float(transverse * law.tangent_damping(force / share, face) * geometry.contact_ratio)
    if stiffness == 0.0:
        # flanks that do not press on each other do not damp each other
        damping = 0.0
    # an ideal mesh is one spring, however its wheels stand
    if geometry.misalignment and stiffness > 0.0 and not isinstance(pair, IdealMesh):
        tilted = _tilted_stiffness(train, mesh.name, stiffness, force)
        stiffness, damping = tilted, damping * tilted / stiffness
    one, two = geometry.driver.base_radius, geometry.sign * geometry.driven.base_radius
    levers = {mesh.bodies[0]: one, mesh.bodies[1]: two, mesh.carrier: -(one + two)}
    levers = {body: lever for body, lever in levers.items() if body in place}
    return TorsionalSpring(
        mesh.name,
        tuple(place[body] for body in levers),
        tuple(levers.values()),
        stiffness,
        damping,
        max(0.0, geometry.normal_backlash),
        force,
        int(pair.rotation),
    )


def _tilted_stiffness(train: Drivetrain, mesh: str, parallel: float, force: float) -> float:
    """Return the mean tangent stiffness of tilted wheels under their load, N/m; without load that of parallel ones."""
    # the contact kernels are compiled for this only
    from gearmbs.gears.transmission import loaded_transmission_error, warn_of_jam

    pair, label = train.pairs[mesh], train.parts[mesh].label
    tilt = math.degrees(pair.geometry.misalignment)
    if force <= 0.0:
        warn(
            f"{label}: misalignment is {tilt:.4g} deg, and without load no part of the face carries: its stiffness in "
            f"the torsional chain is that of parallel wheels, {parallel:.4g} N/m; give the drivetrain a load"
        )
        return parallel
    warn_of_jam(pair)
    with errors_named(label), warnings.catch_warnings():
        # faults of single teeth need not pass
        warnings.simplefilter("ignore")
        return float(loaded_transmission_error(pair, points=CYCLE_POINTS).stiffness.mean())


# A chain of inertias and springs with backlash, integrated by the classical Runge-Kutta method.


STEPS_PER_PERIOD = 40
"""Steps in a period of the fastest mode."""


@njit(
    "void(float64, float64[::1], float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], "
    "float64[:, ::1], float64[::1])",
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def slopes_of(t, state, inertias, ground, load, rows, numbers, prescribed, out):
    """Write the rates of angles and speeds.

    Parameters
    ----------
    t : float
        s.
    state : ndarray, shape (2n,)
        Angles, speeds; those of prescribed shafts are set here.
    inertias, ground, load : ndarray, shape (n,)
        kg m^2, damping against the ground (N m s/rad), torques (N m).
    rows : ndarray, shape (springs, n)
        Levers g.
    numbers : ndarray, shape (springs, 5)
        Stiffness, damping, sense, upper and lower end of the free way.
    prescribed : ndarray, shape (n, 4)
        1 for a prescribed shaft; w, A and 2 pi f of its angle w t - A sin(2 pi f t).
    out : ndarray, shape (2n,)
        Out.
    """
    n = inertias.size
    for i in range(n):
        if prescribed[i, 0] != 0.0:
            w = prescribed[i, 3]
            state[i] = prescribed[i, 1] * t - prescribed[i, 2] * np.sin(w * t)
            state[n + i] = prescribed[i, 1] - prescribed[i, 2] * w * np.cos(w * t)
        out[i] = state[n + i]
        out[n + i] = load[i] - ground[i] * state[n + i]
    for k in range(rows.shape[0]):
        stretch, rate = 0.0, 0.0
        for i in range(n):
            stretch += rows[k, i] * state[i]
            rate += rows[k, i] * state[n + i]
        sense = numbers[k, 2]
        x, force = sense * stretch, 0.0
        if x > numbers[k, 3]:
            force = sense * (numbers[k, 0] * (x - numbers[k, 3])) + numbers[k, 1] * rate
        elif x < numbers[k, 4]:
            force = sense * (numbers[k, 0] * (x - numbers[k, 4])) + numbers[k, 1] * rate
        for i in range(n):
            out[n + i] -= rows[k, i] * force
    for i in range(n):
        out[n + i] = 0.0 if prescribed[i, 0] != 0.0 else out[n + i] / inertias[i]


@njit(
    "void(float64[::1], float64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1], "
    "float64, int64, float64[:, ::1])",
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def integrate(state, inertias, ground, load, rows, numbers, prescribed, step, every, out):
    """Integrate from time 0; write a row each ``every`` steps from the second on.

    Parameters
    ----------
    state : ndarray, shape (2n,)
        At the start; in and out.
    inertias, ground, load, rows, numbers, prescribed : ndarray
        See `slopes_of`.
    step : float
        s.
    every : int
    out : ndarray, shape (m, 2n)
        Out.
    """
    size = state.size
    here, k1, k2, k3, k4 = np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    for n in range((out.shape[0] - 1) * every):
        t = n * step
        slopes_of(t, state, inertias, ground, load, rows, numbers, prescribed, k1)
        for i in range(size):
            here[i] = state[i] + 0.5 * step * k1[i]
        slopes_of(t + 0.5 * step, here, inertias, ground, load, rows, numbers, prescribed, k2)
        for i in range(size):
            here[i] = state[i] + 0.5 * step * k2[i]
        slopes_of(t + 0.5 * step, here, inertias, ground, load, rows, numbers, prescribed, k3)
        for i in range(size):
            here[i] = state[i] + step * k3[i]
        slopes_of(t + step, here, inertias, ground, load, rows, numbers, prescribed, k4)
        for i in range(size):
            state[i] += step * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0
        if (n + 1) % every == 0:
            # what is prescribed is exact
            slopes_of(t + step, state, inertias, ground, load, rows, numbers, prescribed, k1)
            out[(n + 1) // every] = state
