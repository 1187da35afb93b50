"""Modes of a drivetrain under load, named by the part that has most of their energy, and what excites them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs.drivetrain import Drivetrain, DrivetrainError, Housing, Mount, Shaft
from gearmbs.drivetrain.couplings.misaligned import seat_of
from gearmbs.drivetrain.members.rim import rim_meshes, ring_meshes_of, with_rims
from gearmbs.drivetrain.plants import loaded
from gearmbs.drivetrain.torsional import warn_of_overdamped_meshes
from gearmbs.mechanism import linear_modes
from gearmbs.studies.mode_accuracy import accurate_modes
from gearmbs.units import to_si

if TYPE_CHECKING:
    from gearmbs.dae.analyses.modes import Modes
    from gearmbs.flexible import ModalModel
    from gearmbs.units import QuantityLike

KINDS = ("mesh", "ring", "wheel", "shaft", "carrier", "bearing", "coupling", "housing", "mount", "load", "other")
"""What parts are, in the order of tables; drives count as loads."""

MOTIONS = ("bending", "torsion", "stretching")
"""How a shaft deforms in one of its modal coordinates."""

RIGID = "rigid motion"


def train_modes(
    train: Drivetrain, *, accuracy: QuantityLike | None = None, below: QuantityLike | None = None,
    speed: QuantityLike | None = None,
) -> Modes:  # fmt: skip
    """Return the modes of a whole drivetrain about its position of rest under the operating torques.

    Tooth contacts have the stiffness of the pairs that touch there, and no friction. Shafts of prescribed speed are
    held; other drives hold the train while it comes to rest, and then give way to the torque they held it with. Where a
    corner of a tooth touches, the ratio of torques is another at the next angle: rigid rotation then has a frequency.

    Parameters
    ----------
    train : Drivetrain
    accuracy : float or str, optional
        To what part of itself each frequency is to be known, such as "1 %" or 0.01. Modes and elements of shafts and
        housings that deform are doubled until it is, and ``errors`` tells; see `gearmbs.studies.mode_accuracy`.
    below : float or str, optional
        Up to which frequency that is asked, Hz; default three times the highest mesh frequency.
    speed : float or str, optional
        Of the first drive, rad/s: all shafts turn as they do then, and bend with their gyroscopic moments, so that
        bending modes part into whirl forwards and backwards. The teeth stand as at rest. Default: nothing turns.

    Returns
    -------
    Modes
        See `gearmbs.mechanism.linear_modes`.

    Raises
    ------
    ModelError
        If no position of rest is found.
    DrivetrainError
        For ``below`` without an accuracy.

    Warns
    -----
    UserWarning
        Of meshes that are damped above critical: their modes do not oscillate; of an accuracy that is not reached.
    """
    warn_of_overdamped_meshes(train)
    turning = 0.0 if speed is None else to_si(speed, "angular speed", "speed")
    if accuracy is None:
        if below is not None:
            raise DrivetrainError(
                f"below = {below!r}: it is where an accuracy ends; give accuracy, too, or leave it out"
            )
        return _modes(train, turning)
    limit = None if below is None else to_si(below, "frequency", "below")
    return accurate_modes(partial(_modes, speed=turning), train, accuracy, limit)


def _modes(train: Drivetrain, speed: float = 0.0) -> Modes:
    m, after = loaded(train, speed)
    with warnings.catch_warnings():
        if not any(stage.speeds(train)["carrier"] for stage in train.planetary_stages):
            # shafts are round, but off their axes by the micrometres by which their loads bend them
            warnings.filterwarnings("ignore", message=".*coefficients of the linearised equations vary with time")
        return linear_modes(m, t=after)


MOVING = 0.15
"""Share of the kinetic energy from which on a body is told to move."""

CIRCULAR = 0.1
"""Area of an orbit, of that of a circle as long, from which on it goes one way: an ellipse of axes 20 : 1."""


def whirl_senses(train: Drivetrain, modes: Modes) -> list[str]:
    """Return how shafts go round in modes at speed: "forward", as they turn, "backward", or "" where they do not.

    Shafts count by how far their centres and ends move across their axes, each in the sense in which it turns.

    Parameters
    ----------
    train : Drivetrain
    modes : Modes
        At speed, as of `train_modes` with ``speed``. At rest the pairs of round shafts are of any sense.
    """
    area, size = np.zeros(len(modes)), np.zeros(len(modes))
    for shaft in train.shafts:
        moved = modes.shapes[:, modes.body_names.index(shaft.name)]
        axes, sense = train.layout.seats[shaft.name].axes, np.sign(train.speeds[shaft.name])
        for part in (moved[:, :3], 0.5 * shaft.length * moved[:, 3:]):
            x, y = (part @ axes)[:, :2].T
            area += sense * 2.0 * (np.conj(x) * y).imag
            size += np.abs(x) ** 2 + np.abs(y) ** 2
    round_about = np.divide(area, size, out=np.zeros(len(modes)), where=size > 0.0)
    # a mode of positive frequency: x cos wt - y sin wt with y = -i x goes from x to y
    return ["backward" if r > CIRCULAR else "forward" if r < -CIRCULAR else "" for r in round_about]


def part_kinds(train: Drivetrain) -> dict[str, str]:
    """Return what each part of a drivetrain that can hold energy is, one of `KINDS`, by name."""
    groups = {"mesh": train.meshes, "shaft": train.shafts, "bearing": train.bearings, "coupling": train.couplings,
              "housing": train.housings, "load": (*train.drives, *train.loads)}  # fmt: skip
    out = {part.name: kind for kind, parts in groups.items() for part in parts}
    out |= {mesh.name: "mesh" for mesh in train.meshings} | dict.fromkeys(train.pins, "bearing")
    out |= {seat_of(coupling): "coupling" for coupling in train.couplings}
    out |= {stage.carrier_name: "carrier" for stage in train.planetary_stages}
    out |= {wheel.name: "wheel" for wheel in train.wheels if wheel.flexible is not None}
    out |= {ring_meshes_of(stage.name): "ring" for stage in train.planetary_stages if stage.rim is not None}
    return out | {mount.name: "mount" for housing in train.housings for mount in housing.mounts}


def named_modes(train: Drivetrain, modes: Modes | None = None) -> xr.Dataset:
    """Return the modes of a drivetrain that oscillate, by name, with the shares of its parts.

    Parameters
    ----------
    train : Drivetrain
    modes : Modes, optional
        Of it; default: those under load, `gearmbs.studies.train_modes`.

    Returns
    -------
    Dataset
        Over ``mode``: ``frequency`` (Hz), ``damping_ratio``, ``name``, the largest part and what it does, and
        ``moves``, the bodies with most of the kinetic energy, their share and how shafts move; over
        ``mode`` and ``part``: ``energy``, the share of the potential energy, and ``damping``, the part of the damping
        ratio that it gives; over ``mode`` and ``body``: ``kinetic``, the share of the kinetic energy. ``kind`` is what
        a part is. Table it by `mode_table`.
    """
    if modes is None:
        modes = train_modes(train)
    chosen = modes.oscillating
    assert modes.parts is not None
    parts = with_rims(train, modes.parts, np.abs(modes.eigenvalues))
    known = part_kinds(train)
    kinds = [known.get(name, "other") for name in parts.names]
    names = [_name(train, parts, kinds, row, modes.body_names) for row in chosen]
    moves = [_movers(train, modes, parts.kinetic[row], row) for row in chosen]
    return xr.Dataset(
        {
            "frequency": ("mode", modes.frequencies[chosen], {"units": "Hz"}),
            "damping_ratio": ("mode", modes.damping_ratios[chosen], {"units": "1"}),
            "name": ("mode", np.asarray(names, dtype=str)),
            "moves": ("mode", np.asarray(moves, dtype=str)),
            "energy": (("mode", "part"), parts.energy[chosen], {"units": "1"}),
            "damping": (("mode", "part"), parts.damping[chosen], {"units": "1"}),
            "kinetic": (("mode", "body"), parts.kinetic[chosen], {"units": "1"}),
        },
        coords={"mode": np.arange(1, chosen.size + 1), "part": parts.names, "kind": ("part", kinds),
                "body": modes.body_names},
    )  # fmt: skip


def _movers(train: Drivetrain, modes: Modes, kinetic: np.ndarray, row: int) -> str:
    """Return the two bodies that have most of the kinetic energy of a mode, with what a shaft does as a whole."""
    told = []
    for k in np.argsort(-kinetic)[:2]:
        if kinetic[k] >= MOVING:
            name = modes.body_names[k]
            told.append(f"{name} {_way(train, name, modes.shapes[row, k])}{100.0 * kinetic[k]:.0f} %")
    return ", ".join(told)


def _way(train: Drivetrain, name: str, moved: np.ndarray) -> str:
    """Return how a shaft moves most, by what its ends and the rims of its wheels do; nothing of other bodies."""
    shaft = next((one for one in train.shafts if one.name == name), None)
    if shaft is None:
        return ""
    axes = train.layout.seats[name].axes
    centre, turned = np.abs(moved[:3] @ axes), np.abs(moved[3:] @ axes)
    rim = max(
        [wheel.gear.pitch_radius for wheel in train.wheels if wheel.shaft == name],
        default=max(r for _, r in shaft.cylinders),
    )
    ways = {
        "across": np.hypot(*centre[:2]), "along": centre[2], "tilts": 0.5 * shaft.length * np.hypot(*turned[:2]),
        "turns": rim * turned[2],
    }  # fmt: skip
    return f"{max(ways, key=lambda way: float(ways[way]))} "


def _name(train: Drivetrain, parts: Any, kinds: list[str], row: int, bodies: Sequence[str]) -> str:
    """Return what a mode is called: its largest part; mounts of a housing, and planets of a stage, taken together.

    Mounts count only if their housing moves more than any other body: where they give way to what a shaft does, its
    bearings count together.
    """
    first = bodies[int(np.argmax(parts.kinetic[row]))]
    groups = {mesh.name: mesh.group for mesh in train.meshings}
    groups |= {pin: f"{stage.name} pins" for pin, (stage, _) in train.pins.items()}
    shares: dict[tuple[str, str], float] = {}
    yielding = together = 0.0
    for name, kind, share in zip(parts.names, kinds, parts.energy[row]):
        together += float(share) if kind == "bearing" else 0.0
        owner = _housing_of(train, name) if kind == "mount" else groups.get(name, name)
        if kind == "mount" and owner != first:
            yielding += float(share)
            continue
        shares[kind, owner] = shares.get((kind, owner), 0.0) + float(share)
    if not shares or not max(shares.values()) > 0.0:
        return RIGID
    (kind, name), largest = max(shares.items(), key=lambda item: item[1])
    if yielding > largest and together > largest and any(shaft.name == first for shaft in train.shafts):
        return f"shaft '{first}' in its bearings"
    if kind == "mount":
        return f"housing '{name}' on its mounts"
    if kind == "shaft":
        return f"{_motion(train.modal_models[name], parts.strain[name][row])} of shaft '{name}'"
    return f"{kind} '{name}'"


def _housing_of(train: Drivetrain, mount: str) -> str:
    owners: list[tuple[Housing, Mount]] = [(h, m) for h in train.housings for m in h.mounts]
    return next(h.name for h, m in owners if m.name == mount)


def _motion(model: ModalModel, strain: np.ndarray) -> str:
    """Return how a shaft deforms most: round shafts bend, twist and stretch in modal coordinates of their own."""
    reach = float(np.abs(model.positions[:, 2]).max())
    moved, turned = model.moved, model.turned
    if turned is None:
        # of solids the seats of its parts have rotations
        moved, turned = (np.stack(one, axis=1) for one in zip(*((s.moved, s.turned) for s in model.seats.values())))
    sizes = np.column_stack([
        np.abs(moved[:, :, :2]).max(axis=(1, 2)), reach * np.abs(turned[:, :, 2]).max(axis=1),
        np.abs(moved[:, :, 2]).max(axis=1),
    ])  # fmt: skip
    sums = np.bincount(np.argmax(sizes, axis=1), strain, minlength=3)
    return MOTIONS[int(np.argmax(sums))]


def mode_table(named: xr.Dataset) -> pd.DataFrame:
    """Return named modes as a table: frequency, damping ratio, name, share of each kind of part, what moves."""
    kinds = np.asarray(named["kind"].values)
    rows = {
        "frequency_hz": named["frequency"].values,
        "damping_ratio": named["damping_ratio"].values,
        "name": named["name"].values,
    }
    energy = named["energy"].values
    sums = {kind: energy[:, kinds == kind].sum(axis=1) for kind in KINDS if (kinds == kind).any()}
    rest = 1.0 - energy.sum(axis=1)
    sums["other"] = sums.get("other", 0.0) + rest
    return pd.DataFrame({**rows, **sums, "moves": named["moves"].values}, index=named["mode"].values)


RANKINGS = ("gain", "response")
"""What crossings are ranked by."""
UNEXCITED = 1e-9
"""Share of a mode's energy that is none: rounding leaves 1e-12, and as little of the damping of a mode without any."""


def gain_of(share: float, ratio: float) -> float:
    """Return the gain at a crossing, by the share of the energy that is excited and the damping ratio."""
    if share <= UNEXCITED:
        return 0.0
    return share / (2.0 * ratio) if ratio > 0.0 else np.inf


def with_gains(train: Drivetrain, diagram: xr.Dataset, modes: Modes) -> xr.Dataset:
    """Return a Campbell diagram with the names of its modes, and gain and response of the housing of each crossing."""
    named = named_modes(train, modes)
    orders = dict(zip(diagram["order"].values.tolist(), diagram["order_name"].values.tolist()))
    gains, on_rims = [], rim_meshes(train)
    excited = []
    for k, order in zip(diagram["critical_mode"].values, diagram["critical_order"].values):
        one = named.sel(mode=int(k))
        part = orders[float(order)].split(" x ", 1)[1]
        # all planets of a stage, as if they meshed in the phase that moves the mode most
        meshes = [m.name for m in train.meshings if part in (m.name, m.group, m.stage)]
        excited.append(meshes)
        if isinstance(train.parts.get(part), Shaft):
            share = one["kinetic"].sel(body=part)
        else:
            # a ring whose rim bends is one part with its meshes
            told = {ring_meshes_of(on_rims[name][0]) if name in on_rims else name for name in meshes}
            share = one["energy"].sel(part=sorted(told)).sum()
        ratio = float(one["damping_ratio"])
        # the force that a mesh carries turns with its wheels, and may make a share that is all but none negative
        gains.append(gain_of(float(share), ratio))
    names = [str(named["name"].sel(mode=int(k)).values) for k in diagram["mode"].values]
    response = housing_response(train, diagram["critical_frequency"].values, excited)
    return diagram.assign(
        critical_gain=("crossing", np.array(gains, dtype=float), {"units": "1"}),
        critical_response=("crossing", response, {"units": "m s-2 um-1"}),
        mode_name=("mode", np.asarray(names, dtype=str)),
    )


MICROMETRE = 1e-6
"""Amplitude of the transmission error that responses of housings are told by, m."""


def housing_response(train: Drivetrain, frequencies: np.ndarray, excited: Sequence[Sequence[str]]) -> np.ndarray:
    """Return how housings answer transmission errors at frequencies: the acceleration of the seat that moves most.

    All modes answer together, at rest under load. Where several meshes excite, their answers are summed as if each came
    in the worst phase.

    Parameters
    ----------
    train : Drivetrain
    frequencies : ndarray, shape (n,)
        Hz.
    excited : sequence of sequences of str
        The meshes of each frequency that excite, by name.

    Returns
    -------
    ndarray, shape (n,)
        m/s^2 for a micrometre; NaN where no mesh excites, or no bearing is in a housing.
    """
    seats = [b.name for b in train.bearings if isinstance(train.parts.get(train.carrier(b)), Housing)]
    meshes = sorted({name for names in excited for name in names})
    out = np.full(len(frequencies), np.nan)
    if not seats or not meshes:
        return out
    motions = [("marker_velocity", f"{name}.J", axis) for name in seats for axis in "xyz"]
    plant = train.linearize([("transmission_error", name) for name in meshes], motions)
    for k, (frequency, names) in enumerate(zip(frequencies, excited)):
        if names:
            moved = plant.frequency_response(np.array([frequency]))[0][:, [meshes.index(name) for name in names]]
            along = np.abs(moved).sum(axis=1).reshape(-1, 3)
            out[k] = 2.0 * np.pi * frequency * MICROMETRE * np.linalg.norm(along, axis=1).max()
    return out


def ranked_crossings(diagram: xr.Dataset, by: str = "gain") -> pd.DataFrame:
    """Return the crossings of a drivetrain's Campbell diagram, those first that their excitation moves most.

    The gain of a mesh is the amplitude of its deflection over that of the harmonic of the transmission error, at the
    crossing and by this mode alone: the mesh's share of the energy over twice the damping ratio. Of a planetary stage
    it is that of all its planets, an upper bound, which phases of its meshes may lower to nothing. Of a shaft, where
    nothing meshes, it is its share of the kinetic energy over the same. The response is what a listener beside the
    housing asks for: how much the bearing seat in it that moves most accelerates for a micrometre of transmission
    error, by all modes together, m/s^2; there is none where no bearing is in a housing.

    Parameters
    ----------
    diagram : Dataset
        From `gearmbs.studies.train_campbell`.
    by : {"gain", "response"}
        What the crossings are ranked by.

    Raises
    ------
    ValueError
        For another ranking, and by a response where there is no housing.
    """
    if by not in RANKINGS:
        raise ValueError(f"by is {by!r}; choose one of {', '.join(map(repr, RANKINGS))}")
    orders = dict(zip(diagram["order"].values.tolist(), diagram["order_name"].values.tolist()))
    names = dict(zip(diagram["mode"].values.tolist(), diagram["mode_name"].values.tolist()))
    table = pd.DataFrame(
        {
            "speed_rpm": diagram["critical_speed"].values * 30.0 / np.pi,
            "frequency_hz": diagram["critical_frequency"].values,
            "order": [orders[float(k)] for k in diagram["critical_order"].values],
            "mode": diagram["critical_mode"].values,
            "name": [names[int(k)] for k in diagram["critical_mode"].values],
            "gain": diagram["critical_gain"].values,
            "response": diagram["critical_response"].values,
        }
    )
    if table["response"].isna().all():
        if by == "response":
            raise ValueError("by is 'response', but no bearing of the drivetrain is in a housing; rank by 'gain'")
        table = table.drop(columns="response")
    return table.sort_values(by, ascending=False, kind="stable").reset_index(drop=True)
