"""From a campaign to measured signals, tacho and labels, a row a record."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.campaign import Campaign
from gearmbs.campaigns.datasets.gearboxes import SOURCE
from gearmbs.campaigns.datasets.layers import SensorLayers
from gearmbs.campaigns.datasets.source import Rotation, Source, rotation_of, source_of
from gearmbs.campaigns.settings import CampaignError
from gearmbs.signals.rotation.angular import interpolate

if TYPE_CHECKING:
    import pandas as pd

MESH_NUMBERS = ("normal_force.max", "normal_force.rms", "transmission_error.rms")
"""Of the mesh with the fault, what is kept as known."""


@dataclass(frozen=True)
class Measured:
    """The measured part of one campaign.

    Attributes
    ----------
    rows : DataFrame
        Labels, operating points, tacho and signals, a row a record.
    full_scale : float
        Of the converter, m/s^2.
    duration, rate : float
        Of the records, s and Hz.
    left_out : int
        Operating points of which a state failed.
    """

    rows: pd.DataFrame
    full_scale: float
    duration: float
    rate: float
    left_out: int


def measured(campaign: Campaign, layers: SensorLayers, number: int = 0) -> Measured:
    """Return the records of a campaign as sensors give them.

    Noise has the level of the operating point in all its states together, and the converter a range for the largest
    sample of all records, so that neither tells the state. Operating points are left out if one of their states failed:
    what fails would tell. ``number`` tells the campaigns of a data set apart, which share neither noise nor housings.

    Raises
    ------
    CampaignError
        If the campaign is not done, or has no specimens, states or signals of acceleration.
    """
    import pandas as pd

    source, table = source_of(campaign), campaign.table
    done = table[table["status"] == "done"]
    whole = done.groupby("point")["point"].transform("size") == campaign.plan.variants
    kept = done[whole].reset_index(drop=True)
    if kept.empty:
        raise CampaignError(f"{campaign.path}: no point is done in all its states; see failed()")
    data = campaign.open().sel(case=kept["index"].to_numpy())
    first = data[source.places[0][0]].isel(case=0).values[source.places[0][1]]
    duration = layers.longest(int(np.isfinite(first).sum()), source.rate)
    # records of equal number in several gearboxes have equal states, and must not have equal noise or drift
    other = zlib.crc32(f"{source.name} {number}".encode()) << 32
    owners, records = ([other + int(number) for number in kept[name]] for name in (source.group, "index"))
    clean = np.empty((len(kept), len(source.places), round(duration * source.rate)), dtype=np.float32)
    speeds, pulses = [], []
    # all states of a point turn alike
    turning: dict[int, Rotation] = {}
    for k, (specimen, record) in enumerate(zip(owners, records, strict=True)):
        here = data.isel(case=k)
        for j, (name, channel) in enumerate(source.places):
            x = here[name].values[channel].astype(float)
            clean[k, j] = layers.heard(x[np.isfinite(x)], source.rate, duration, specimen, record, j)
        turned = None if source.speed is None else here[source.speed].values[0].astype(float)
        point = int(kept["point"][k])
        if point not in turning:
            thing = campaign.case(int(kept["index"][k]))
            turning[point] = rotation_of(campaign.plan, thing, source.mesh, source.speed, source.name)
        found = _turning(turned, turning[point], source.rate, layers, duration, specimen, record)
        speeds.append(found[0])
        pulses.append(found[1])
    level = _levels(clean, kept["point"].to_numpy())
    noisy = np.empty_like(clean)
    for k, j in np.ndindex(level.shape):
        noisy[k, j] = layers.noisy(clean[k, j], float(level[k, j]), owners[k], records[k], j)
    full_scale = layers.full_scale(float(np.abs(noisy).max()))
    rows = _labels(kept, source, [turning[int(point)] for point in kept["point"]])
    for j in range(len(source.places)):
        samples, clipped = zip(*(layers.converted(x, full_scale) for x in noisy[:, j]), strict=True)
        rows[f"signal.sensor_{j + 1}"] = [x.astype(np.float32) for x in samples]
        rows[f"clipped.sensor_{j + 1}"] = clipped
        rows[f"clean.sensor_{j + 1}"] = list(clean[:, j])
    rows = pd.concat([rows, pd.DataFrame({"speed": speeds, "tacho": pulses})], axis=1)
    return Measured(rows, full_scale, duration, source.rate, table["point"].nunique() - kept["point"].nunique())


def _turning(
    speed: np.ndarray | None,
    rotation: Rotation,
    rate: float,
    layers: SensorLayers,
    duration: float,
    specimen: int,
    record: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the speed of the driver's shaft of a record, rad/s, and the times of its tacho's pulses, s.

    The mark is where the specimen has it: a share of a turn, from tooth 0 as the simulation begins. A pulse is where
    the turns pass a whole number, whichever way the shaft turns.

    Parameters
    ----------
    speed : ndarray or None, shape (n,)
        Of the sensor with the margins of the record, rad/s.
    """
    times = layers.times(rate, duration, record)
    before, _ = layers.margins(duration, rate)
    mark = float(np.random.default_rng([layers.seed, 6, specimen]).random())
    if speed is None:
        angle = rotation.turned(before / rate + times)
        w = np.gradient(angle, 1.0 / rate)
    else:
        w = rotation.ratio * interpolate(speed[np.isfinite(speed)], before + times * rate)
        w = w * np.gradient(times) * rate
        # by the trapezoidal rule from where the shaft is as the record begins
        angle = rotation.turned(np.array([before / rate]))[0]
        angle = angle + np.r_[0.0, np.cumsum(0.5 * (w[1:] + w[:-1]))] / rate
    turns = mark + angle / (2.0 * math.pi)
    whole = np.floor(turns)
    passed = np.flatnonzero(whole[1:] != whole[:-1])
    at = np.maximum(whole[passed], whole[passed + 1])
    share = (at - turns[passed]) / (turns[passed + 1] - turns[passed])
    return w.astype(np.float32), (passed + share) / rate


def _levels(heard: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the RMS of each sensor over all states of a record's operating point, shape (records, sensors)."""
    power = np.square(heard, dtype=float).mean(axis=-1)
    _, inverse = np.unique(points, return_inverse=True)
    count = np.bincount(inverse)
    return np.sqrt(np.array([np.bincount(inverse, column) / count for column in power.T]).T[inverse])


def _labels(kept: pd.DataFrame, source: Source, turning: list[Rotation]) -> pd.DataFrame:
    """Return what is known of each record beside its signals."""
    import pandas as pd

    sizes = {name: f"size.{name.removeprefix('state.')}" for name in kept.columns if name.startswith("state.")}
    severity = sizes.pop("state.severity", None)
    known = {f"{source.mesh}.{name}": f"known.{name}" for name in MESH_NUMBERS}
    known = {name: new for name, new in known.items() if name in kept}
    # what no factor varies stands in the case
    for name in ("speed", "torque"):
        if f"operation.{name}" not in kept:
            kept = kept.assign(**{f"operation.{name}": [getattr(one, name) for one in turning]})
    names = ["id", source.group, "point", "state", "operation.speed", "operation.torque"]
    sources = [name for name in kept.columns if name.startswith(SOURCE)]
    rows = kept[[*names, *sizes, *sources, *known]].rename(columns={**sizes, **known, source.group: "specimen"})
    fixed = {
        "gearbox": source.name,
        "severity": 0.0 if severity is None else kept["state.severity"],
        "sampling_rate": source.rate,
    }
    rows = pd.concat([rows, pd.DataFrame(fixed, index=kept.index)], axis=1)
    return rows.assign(teeth=[list(one.teeth) for one in turning])
