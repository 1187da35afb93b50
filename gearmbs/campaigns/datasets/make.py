"""From campaigns to the files of a data set: measured signals, tacho and labels by row, in an order of chance."""

from __future__ import annotations

import math
import re
import shutil
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.campaign import Campaign
from gearmbs.campaigns.codes import code_counts, known_code
from gearmbs.campaigns.datasets.card import write_card, write_croissant
from gearmbs.campaigns.datasets.gearboxes import SOURCE
from gearmbs.campaigns.datasets.layers import SensorLayers
from gearmbs.campaigns.datasets.splits import shared_groups, split_by_group, withhold
from gearmbs.campaigns.folder import digest_of
from gearmbs.campaigns.plans.factors import Choice, Specimens
from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.stored.exports import ROWS_A_FILE, check_card, place, remove_former
from gearmbs.files import whole_file
from gearmbs.signals.rotation.angular import interpolate

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.campaigns.plans.plan import Plan

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

    source, table = _source(campaign), campaign.table
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
    for k, (specimen, record) in enumerate(zip(owners, records, strict=True)):
        here = data.isel(case=k)
        for j, (name, channel) in enumerate(source.places):
            x = here[name].values[channel].astype(float)
            clean[k, j] = layers.heard(x[np.isfinite(x)], source.rate, duration, specimen, record, j)
        turned = None if source.speed is None else here[source.speed].values[0].astype(float)
        nominal = float(kept["operation.speed"][k])
        found = _turning(turned, nominal, source, layers, duration, specimen, record)
        speeds.append(found[0])
        pulses.append(found[1])
    level = _levels(clean, kept["point"].to_numpy())
    noisy = np.empty_like(clean)
    for k, j in np.ndindex(level.shape):
        noisy[k, j] = layers.noisy(clean[k, j], float(level[k, j]), owners[k], records[k], j)
    full_scale = layers.headroom * float(np.abs(noisy).max())
    rows = _labels(kept, source)
    for j in range(len(source.places)):
        samples, clipped = zip(*(layers.converted(x, full_scale) for x in noisy[:, j]), strict=True)
        rows[f"signal.sensor_{j + 1}"] = [x.astype(np.float32) for x in samples]
        rows[f"clipped.sensor_{j + 1}"] = clipped
        rows[f"clean.sensor_{j + 1}"] = list(clean[:, j])
    rows = pd.concat([rows, pd.DataFrame({"speed": speeds, "tacho": pulses})], axis=1)
    return Measured(rows, full_scale, duration, source.rate, table["point"].nunique() - kept["point"].nunique())


@dataclass(frozen=True)
class _Source:
    """Where a campaign has what a data set takes."""

    name: str
    group: str
    places: list[tuple[str, int]]
    speed: str | None
    rate: float
    teeth: tuple[int, int]
    mesh: str
    start: float


def _states(plan: Plan) -> Choice | None:
    """Return the choice of the states."""
    return next((f for f in plan.factors if isinstance(f, Choice) and f.name == "state"), None)


def _source(campaign: Campaign) -> _Source:
    plan, specs, group = campaign.plan, campaign.folder.specs, campaign.plan.group
    places = [(spec.name, c) for spec in specs if spec.units == "m/s^2" for c in range(len(spec.channels))]
    choice = _states(plan)
    if group is None or choice is None or not places:
        raise CampaignError(
            f"{campaign.path}: a data set needs Specimens, a choice named state, and signals of accelerations to keep"
        )
    if not campaign.status().complete:
        raise CampaignError(f"data set: {campaign.status()}; run the campaign to its end first")
    base = plan.subject.base()
    kind, _, mesh = choice.path.removesuffix(".faults").partition(".")
    speed = next((spec.name for spec in specs if spec.units == "rad/s"), None)
    rate = next(spec.rate for spec in specs if spec.name == places[0][0])
    if kind != "meshes":
        return _Source(
            "pair", group, places, speed, rate, (base["gears"]["teeth"][0], base["gears"]["teeth"][1]), "", 0.0
        )
    driver, driven = (int(base["wheels"][base["meshes"][mesh][role]]["teeth"]) for role in ("driver", "driven"))
    found, name = campaign.case(0), str(base.get("name", campaign.path.stem))
    start = float(found.train.run_up + found.run.settling)
    return _Source(name, group, places, speed, rate, (driver, driven), mesh, start)


def _turning(
    speed: np.ndarray | None,
    nominal: float,
    source: _Source,
    layers: SensorLayers,
    duration: float,
    specimen: int,
    record: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the speed of a record, rad/s, and the times of its tacho's pulses, s.

    The mark is where the specimen has it; tooth 0 is where the simulation begins, at full speed.
    """
    times = layers.times(source.rate, duration, record)
    before, _ = layers.margins(duration, source.rate)
    mark = float(np.random.default_rng([layers.seed, 6, specimen]).random())
    w = np.full(times.size, nominal)
    if speed is not None:
        w = interpolate(speed[np.isfinite(speed)], before + times * source.rate)
    w = w * np.gradient(times) * source.rate
    turns = mark + nominal * (source.start + before / source.rate) / (2.0 * math.pi)
    turns = turns + np.r_[0.0, np.cumsum(0.5 * (w[1:] + w[:-1]))] / (2.0 * math.pi * source.rate)
    whole = np.arange(math.ceil(turns[0]), math.floor(turns[-1]) + 1)
    return w.astype(np.float32), np.interp(whole, turns, np.arange(turns.size) / source.rate)


def _levels(heard: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the RMS of each sensor over all states of a record's operating point, shape (records, sensors)."""
    power = np.square(heard, dtype=float).mean(axis=-1)
    _, inverse = np.unique(points, return_inverse=True)
    count = np.bincount(inverse)
    return np.sqrt(np.array([np.bincount(inverse, column) / count for column in power.T]).T[inverse])


def _labels(kept: pd.DataFrame, source: _Source) -> pd.DataFrame:
    """Return what is known of each record beside its signals."""
    import pandas as pd

    sizes = {name: f"size.{name.removeprefix('state.')}" for name in kept.columns if name.startswith("state.")}
    sizes.pop("state.severity")
    known = {f"{source.mesh}.{name}": f"known.{name}" for name in MESH_NUMBERS}
    known = {name: new for name, new in known.items() if name in kept}
    names = ["id", source.group, "point", "state", "operation.speed", "operation.torque"]
    sources = [name for name in kept.columns if name.startswith(SOURCE)]
    rows = kept[[*names, *sizes, *sources, *known]].rename(columns={**sizes, **known, source.group: "specimen"})
    fixed = {"gearbox": source.name, "severity": kept["state.severity"], "sampling_rate": source.rate}
    rows = pd.concat([rows, pd.DataFrame(fixed, index=kept.index)], axis=1)
    return rows.assign(teeth=[list(source.teeth)] * len(rows))


def write_data_set(
    campaigns: Campaign | Sequence[Campaign],
    out: str | Path,
    *,
    title: str = "Simulated gear faults",
    layers: SensorLayers | None = None,
    test: float = 0.2,
    validation: float = 0.1,
    withheld: tuple[float, float] = (0.45, 0.6),
    seed: int = 0,
    url: str | None = None,
    published: str | None = None,
) -> list[Path]:
    """Write campaigns as one data set: parquet by split, README.md, croissant.json, plans.

    Parameters
    ----------
    campaigns : Campaign or sequence of Campaign
        Of `data_set_plan`, one a gearbox, or others with specimens, a crossed choice named ``state`` and signals of
        acceleration.
    layers : SensorLayers, optional
        From clean to measured signals; those that the plan was made with.
    test, validation : float
        Parts of the specimens.
    withheld : tuple of float
        Range of severities that training specimens keep for the split "withheld".
    url, published : str, optional
        Where and when it will be published, for the metadata; the same campaign gives the same files whenever they are
        written.

    Raises
    ------
    CampaignError
        If a campaign is not done, or has no specimens.
    """
    import pandas as pd

    out, layers = place(out, None, title), layers or SensorLayers(seed=seed)
    check_card(out)
    given = [campaigns] if isinstance(campaigns, Campaign) else list(campaigns)
    paths = [campaign.path.resolve() for campaign in given]
    if doubled := sorted({str(path) for path in paths if paths.count(path) > 1}):
        raise CampaignError(f"data set: {', '.join(doubled)} is given more than once; give each campaign once")
    parts = [measured(campaign, layers, number) for number, campaign in enumerate(given)]
    # campaigns whose specimens are drawn alike have the same individuals, each of which is in one split
    alike: dict[str, list[pd.DataFrame]] = {}
    for campaign, part in zip(given, parts, strict=True):
        alike.setdefault(_individuals(campaign), []).append(part.rows)
    sizes = [name for one in given if (choice := _states(one.plan)) is not None for name in choice.sized]
    groups, individuals = [], 0
    for tables in alike.values():
        group = pd.concat(tables, ignore_index=True)
        split = split_by_group(group["specimen"].to_numpy(), test=test, validation=validation, seed=seed)
        # states without a size have no severity, which stands as 0 in the rows
        sized = group["state"].isin(sizes)
        group["split"] = withhold(split, group["severity"].where(sized).to_numpy(), *withheld)
        group["specimen"] += individuals
        individuals = int(group["specimen"].max()) + 1
        groups.append(group)
    rows = pd.concat(groups, ignore_index=True)
    # the order of the cases is that of the states
    rows = rows.iloc[np.random.default_rng(seed).permutation(len(rows))].reset_index(drop=True)
    files = _parquet(rows, out)
    signals = rows.filter(like="signal.").notna().to_numpy().sum()
    clipped = rows.filter(like="clipped.").to_numpy() > 0
    counts = rows["split"].value_counts().sort_index().items()
    hours = sum(campaign.status().processor_seconds for campaign in given) / 3600.0
    facts = {
        "signals": int(signals),
        "records (simulations)": len(rows),
        "gearboxes": ", ".join(rows["gearbox"].unique()),
        "specimens": rows["specimen"].nunique(),
        "states": ", ".join(sorted(rows["state"].unique())),
        "length of a record, s": ", ".join(f"{part.duration:.4g}" for part in parts),
        "sampling rate, Hz": ", ".join(f"{part.rate:g}" for part in parts),
        "full scale of the converters, m/s^2": ", ".join(f"{part.full_scale:.4g}" for part in parts),
        "signals with clipped samples": int(clipped.sum()),
        "operating points left out, since a state of theirs failed": sum(part.left_out for part in parts),
        "records by split": ", ".join(f"{name} {count}" for name, count in counts),
        "specimens in two splits": max(shared_groups(rows["split"].to_numpy(), rows["specimen"].to_numpy()).values()),
        "processor time of the simulations, core hours": f"{hours:.3g}",
    }
    boxes = [str(part.rows["gearbox"].iloc[0]) for part in parts]
    codes = [f"{box}: {told}" for box, campaign in zip(boxes, given, strict=True) for told in _codes(campaign)]
    card = write_card(out, title, files, facts, layers.as_dict(), codes)
    paths = [card, write_croissant(out, title, files, url, published)]
    plans: list[Path] = []
    for box, campaign in zip(boxes, given, strict=True):
        name = re.sub(r"[^\w.]+", "-", box)
        free = (out / f"plan-{name}{again}.json" for again in ("", *(f"-{k + 2}" for k in range(len(plans)))))
        plans.append(next(path for path in free if path not in plans))
        paths.append(plans[-1])
        shutil.copy(campaign.path / "plan.json", paths[-1])
        for digest in code_counts(campaign.folder):
            if known_code(campaign.folder, digest) is not None:
                paths.append(out / f"code-{digest}.json")
                shutil.copy(campaign.path / "codes" / f"{digest}.json", paths[-1])
    return [*files, *dict.fromkeys(paths)]


def _individuals(campaign: Campaign) -> str:
    """Return what the individuals of a campaign are drawn from, but for how many they are.

    Gearboxes of the same wheels and meshes share them, whatever they are called and however they are driven.
    """
    plan = campaign.plan
    drawn = [asdict(replace(factor, draws=1)) for factor in plan.factors if isinstance(factor, Specimens)]
    base = plan.subject.base()
    return digest_of([plan.subject.kind, base.get("wheels"), base.get("meshes"), *drawn])


def _codes(campaign: Campaign) -> list[str]:
    """Return the codes that a campaign's results come from, each with its part of the units and its setting."""
    found, counts = [], code_counts(campaign.folder)
    for digest, units in counts.most_common():
        code = known_code(campaign.folder, digest)
        setting = "" if code is None else ", ".join(f"{name} {value}" for name, value in code.setting.items())
        found.append(f"`{digest}`, {units} of {counts.total()} units ({setting or 'not noted'})")
    return found


def _parquet(rows: pd.DataFrame, out: Path) -> list[Path]:
    """Write rows with their signals as lists, some thousand a file, by split."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    written = []
    for name, part in rows.groupby("split"):
        count = -(-len(part) // ROWS_A_FILE)
        for k in range(count):
            path = out / "data" / f"{name}-{k:05d}-of-{count:05d}.parquet"
            here = part.iloc[k * ROWS_A_FILE : (k + 1) * ROWS_A_FILE].drop(columns="split")
            with whole_file(path) as file:
                pq.write_table(pa.Table.from_pandas(here, preserve_index=False), file, compression="zstd")
            written.append(path)
    remove_former(out / "data", written)
    return written


def read_data_set(folder: str | Path) -> pd.DataFrame:
    """Return the rows of a data set with the split of each.

    Raises
    ------
    CampaignError
        If the folder has none.
    """
    import pandas as pd

    files = sorted(Path(folder).glob("data/*.parquet"))
    if not files:
        raise CampaignError(f"{folder}: no data/*.parquet; give the folder that write_data_set has written")
    return pd.concat([pd.read_parquet(file).assign(split=file.name.split("-")[0]) for file in files], ignore_index=True)
