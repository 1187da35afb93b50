"""Where the energy of a linear mode is: in which force elements, in which bodies that deform, and what damps it there.

With changes x of the coordinates (R, theta, q_f) in a mode, M x'' + C x' + K x = 0 has parts: a force element e, whose
load follows the coordinates by its own derivatives dF_e = D_e x + G_e x' and acts by A_e, has K_e = -A_e D_e and
C_e = -A_e G_e; a body with modes has its own block of K and C. Of a mode with |s| = omega

    share of its energy     Re(x^H K_e x) / Re(x^H K x),
    part of its damping     Re(x^H C_e x) / (2 omega x^H M x),

which sum to one and to the damping ratio where C is small; what is in neither, as loads that turn with their bodies, is
the rest. States of elements go with them, z = (s - S)^-1 (P + s Q) x, and loads with those. Motion has
Re(x_b^H (M x)_b) / x^H M x of body b.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.dae.analyses.kinematics import Instant


@dataclass(frozen=True, eq=False)
class ModeParts:
    """Energies and damping of modes by part.

    Attributes
    ----------
    names : list of str
        Force elements, then bodies with modes.
    energy, damping : ndarray, shape (k, parts)
        Share of the potential energy; part of the damping ratio. NaN of motions without energy or frequency.
    kinetic : ndarray, shape (k, bodies)
        Share of the kinetic energy, of all bodies in the order of the modes' ``body_names``.
    strain : dict of str to ndarray, shape (k, modes of the body)
        Share of the energy in each modal coordinate of a body, in the order of its modes.
    states : dict of str to ndarray of complex, shape (k,)
        Changes of the states of elements, with an inertia x^H M x of 1 kg m^2 of the bodies.
    """

    names: list[str]
    energy: np.ndarray
    damping: np.ndarray
    kinetic: np.ndarray
    strain: dict[str, np.ndarray]
    states: dict[str, np.ndarray]

    @property
    def rest(self) -> np.ndarray:
        """Share of the energy that is in none of the parts, shape (k,)."""
        return 1.0 - self.energy.sum(axis=1)


def mode_parts(instant: Instant, motions: np.ndarray, eigenvalues: np.ndarray) -> ModeParts:
    """Return where the energy of modes is.

    Parameters
    ----------
    instant : Instant
        That they were linearised about.
    motions : ndarray of complex, shape (n, k)
        Changes of (R, theta, q_f).
    eigenvalues : ndarray of complex, shape (k,)
        s, rad/s; zero of what has none.
    """
    frequencies = np.abs(eigenvalues)
    matrix = instant.matrix(instant.y)
    mass = instant.mass_matrix(matrix)
    full = matrix.toarray()
    place, speed = instant.block("R", "lambda"), np.r_[instant.block("u", "p"), instant.block("eps", "R")]
    force, loads = instant.block("u", "eps"), instant.block("F", "z")
    # angular velocities stand for momenta by their own rows; at rest those are the rates of the angles
    names: list[str] = []
    owners = np.zeros(loads.size, dtype=int)
    for k, label in enumerate(instant.problem.names[row] for row in loads):
        name = label[label.index("(") + 1 : -1]
        if name not in names:
            names.append(name)
        owners[k] = names.index(name)
    followed = np.zeros((loads.size, place.size + speed.size))
    if loads.size:
        followed = np.linalg.solve(full[np.ix_(loads, loads)], full[np.ix_(loads, np.r_[place, speed])])
    moved, sped = followed[:, : place.size] @ motions, followed[:, place.size :] @ motions
    sources = instant.block("z", "mu")
    by_states = np.zeros((loads.size, sources.size))
    if loads.size and sources.size:
        by_states = np.linalg.solve(full[np.ix_(loads, loads)], full[np.ix_(loads, sources)])
    # what the states' rates have of coordinates, speeds and states, the loads put in
    own = full[np.ix_(sources, np.r_[place, speed, sources])]
    own = own - full[np.ix_(sources, loads)] @ np.hstack([followed, by_states])
    states = _states(instant, own, motions, eigenvalues)
    moved = moved + by_states @ states
    # work of the loads' action on each motion, by load
    work = (full[np.ix_(force, loads)].T @ motions.conj()) if loads.size else np.zeros((0, motions.shape[1]))
    bodies, counts = instant.system.body_names, instant.system.model.modes[1:]
    deforming = [name for name, count in zip(bodies, counts) if count]
    energy = np.zeros((motions.shape[1], len(names) + len(deforming)))
    damping = np.zeros_like(energy)
    np.add.at(energy.T, owners, -(work * moved).real)
    np.add.at(damping.T, owners, -(work * sped).real)
    strain, momenta = {}, instant.at["p_f"] - instant.at["u"]
    coordinates, rates = instant.at["q_f"] - instant.at["R"], instant.at["v_f"] - instant.at["eps"] + instant.at["p"]
    rates -= instant.at["u"]
    start, column = 0, len(names)
    for name, count in zip(bodies, counts):
        if not count:
            continue
        rows = force[momenta + start + np.arange(count)]
        q = motions[coordinates + start + np.arange(count)]
        stiff = full[np.ix_(rows, place[coordinates + start + np.arange(count)])]
        damped = full[np.ix_(rows, speed[rates + start + np.arange(count)])]
        strain[name] = (q.conj() * (stiff @ q)).real.T
        energy[:, column] = strain[name].sum(axis=1)
        damping[:, column] = (q.conj() * (damped @ q)).real.sum(axis=0)
        start, column = start + count, column + 1
    shared = (motions.conj() * (mass @ motions)).real
    kinetic = _by_body(instant, shared)
    inertia = shared.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        total = frequencies**2 * inertia
        scale = np.where(total > 0.0, 1.0 / total, np.nan)[:, None]
        labels = (instant.problem.names[row] for row in instant.block("z", "mu"))
        told = {label[label.index("(") + 1 : -1]: row for label, row in zip(labels, states / np.sqrt(inertia))}
        return ModeParts(
            names + deforming, energy * scale, 0.5 * damping * scale * frequencies[:, None], kinetic / inertia[:, None],
            {name: one * scale for name, one in strain.items()}, told,
        )  # fmt: skip


def _states(instant: Instant, own: np.ndarray, motions: np.ndarray, eigenvalues: np.ndarray) -> np.ndarray:
    """Return the changes of elements' states in modes, shape (states, k); zero of motions without a frequency.

    Parameters
    ----------
    own : ndarray, shape (states, 2 n + states)
        Derivatives of their equations by coordinates, speeds and states.
    motions, eigenvalues
        As of `mode_parts`.
    """
    rows, n = instant.block("z", "mu"), motions.shape[0]
    out = np.zeros((rows.size, motions.shape[1]), dtype=complex)
    if not rows.size:
        return out
    still, rated = (instant.matrix(instant.y, cj)[rows][:, rows].toarray() for cj in (0.0, 1.0))
    for k, s in enumerate(eigenvalues):
        if s != 0.0:
            driven = (own[:, :n] + s * own[:, n : 2 * n]) @ motions[:, k]
            matrix = own[:, 2 * n :] + s * (rated - still)
            try:
                out[:, k] = -np.linalg.solve(matrix, driven)
            except np.linalg.LinAlgError:
                # the least change, where a mode is a state's own
                out[:, k] = -np.linalg.lstsq(matrix, driven, rcond=None)[0]
    return out


def _by_body(instant: Instant, shared: np.ndarray) -> np.ndarray:
    """Return what is summed over the coordinates of each body, shape (k, bodies)."""
    model = instant.system.model
    count = len(instant.system.body_names)
    owner = np.concatenate([
        np.repeat(np.arange(count), 3), np.repeat(model.counts.turning, 3), np.repeat(np.arange(count), model.modes[1:])
    ])  # fmt: skip
    out = np.zeros((count, shared.shape[1]))
    np.add.at(out, owner, shared)
    return out.T
