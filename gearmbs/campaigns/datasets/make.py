"""A labelled data set of a gear pair with faults: its plan, its campaign, its files."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.campaign import Campaign
from gearmbs.campaigns.datasets.card import write_card, write_croissant
from gearmbs.campaigns.datasets.layers import SensorLayers, shared_groups, split_by_group, withhold
from gearmbs.campaigns.factors import AnyFactor, Choice, Factor, Specimens
from gearmbs.campaigns.plan import Plan, make_plan
from gearmbs.campaigns.settings import CampaignError

STATES: dict[str, Any] = {
    "healthy": [],
    "broken": {"kind": "broken tooth", "lost": [0.1, 0.9], "tooth": [0, 28]},
    "chipped": {"kind": "chipped corner", "height": [3e-4, 4e-3], "length": [2e-3, 1e-2], "tooth": [0, 28]},
    "cracked": {"kind": "root crack", "depth": [3e-4, 3.5e-3], "tooth": [0, 28]},
    "pitted": {
        "kind": "pitting",
        "depth": [1e-5, 2e-4],
        "height": [1e-3, 3e-3],
        "width": [4e-3, 1.5e-2],
        "tooth": [0, 28],
    },
    "worn": {"kind": "wear", "depth": [5e-6, 1e-4]},
}
"""States of the pair: faults of the driver with ranges in SI; the first range is the severity."""

SLICES = 11
"""Slices along the face: enough for chipped corners and pits of the widths above, at a third of the time of the
default."""

TOLERANCE = 1e-6
"""Tolerance of the integrator: on twelve records harmonics within 1 %, RMS within 0.5 % and kurtosis within 0.4 % of
those at 1e-7, far below the noise that sensors add, in 0.54 of the time."""

GRADES = [
    {"kind": "manufacturing grade", "grade": 6, "lead": False, "seed": "drawn", "wheel": wheel}
    for wheel in ("driver", "driven")
]


def data_set_plan(
    signals: int,
    *,
    specimens: int = 200,
    duration: float = 0.5,
    sensors: int = 1,
    seed: int = 0,
    unit: int = 48,
) -> Plan:
    """Return the plan of a data set: every specimen and operating point in all states.

    Parameters
    ----------
    signals : int
        At least so many, up to a multiple of the number of states and of sensors.
    specimens : int
        Individuals: manufacturing errors of grade 6 on both wheels, backlash, eccentricities.
    duration : float
        Of a record, s.
    sensors : int
        Signals that `SensorLayers` will make of each record.

    Raises
    ------
    CampaignError
        If there are fewer points, each of which is simulated in all states, than specimens.
    """
    from gearmbs.studies import Case

    points = -(-signals // (len(STATES) * sensors))
    if points < specimens:
        raise CampaignError(
            f"data set: {signals} signals are {points} points of {len(STATES)} states and {sensors} sensors, too few "
            f"for {specimens} specimens; ask for {len(STATES) * sensors * specimens} signals or fewer specimens"
        )
    base = Case(
        operation={"duration": duration, "run_up": 0.05, "settling": 0.05},
        solver={"signal_rate": 12800, "output_rate": 51200, "tolerance": TOLERANCE, "lump": True},
        contact={"slices": SLICES},
    )
    eccentric = {"kind": "eccentricity", "amount": (0.0, 2e-5), "phase": (0.0, 6.283)}
    factors: list[AnyFactor] = [
        Factor("operation.torque", "60 N m", "200 N m"),
        Factor("operation.speed", "900 rpm", "1500 rpm"),
        Choice("fault.teeth", STATES, crossed=True, name="state"),
        Specimens(
            specimens,
            {"fault.backlash": ("60 um", "160 um"), "fault.centre_distance_error": ("-20 um", "60 um")},
            (*GRADES, {**eccentric, "wheel": "driver"}, {**eccentric, "wheel": "driven"}),
            seed=seed,
        ),
    ]
    return make_plan(
        base,
        factors,
        "sobol",
        n=points,
        seed=seed,
        keep=["contact", "signal:line_of_action"],
        unit=unit,
        time_limit=300.0,
    )


def write_data_set(
    campaign: Campaign,
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
    """Write a campaign as a data set: parquet by split, README.md, croissant.json, plan.json.

    Parameters
    ----------
    campaign : Campaign
        Of `data_set_plan`, or another with specimens, a choice named ``state`` and the signal of the line of action.
    layers : SensorLayers, optional
        From clean to measured signals.
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
        If the campaign is not done, or has no specimens.
    """
    out, layers = Path(out), layers or SensorLayers(seed=seed)
    group = campaign.plan.group
    if group is None or not campaign.folder.specs:
        raise CampaignError("data set: the plan needs Specimens and a signal to keep")
    if not campaign.status().complete:
        raise CampaignError(f"data set: {campaign.status()}; run the campaign to its end first")
    table = campaign.table
    groups = table[group].to_numpy()
    severity = table["severity" if "severity" in table else "state.severity"].to_numpy()
    split = withhold(split_by_group(groups, test=test, validation=validation, seed=seed), severity, *withheld)
    done = (table["status"] == "done").to_numpy()
    measured, full_scale = _sensor_signals(campaign, table, groups, done, layers)
    columns = {f"signal.sensor_{k + 1}": [None if x is None else x[k] for x in measured] for k in range(layers.sensors)}
    files = campaign.export(out, "parquet", split=split, add={"split": split, "severity": severity, **columns})
    spec = campaign.folder.specs[0]
    facts = {
        "signals": int(done.sum()) * layers.sensors,
        "records (simulations)": int(done.sum()),
        "sensors a record": layers.sensors,
        "specimens": int(np.unique(groups).size),
        "states": ", ".join(sorted(table["state"].unique())),
        "samples a signal": spec.samples,
        "sampling rate, Hz": spec.rate,
        "full scale of the converter, m/s^2": f"{full_scale:.4g}",
        "records by split": ", ".join(f"{n} {int((done & (split == n)).sum())}" for n in sorted(set(split))),
        "specimens in two splits": max(shared_groups(split, groups).values()),
        "processor time of the simulations, core hours": f"{campaign.status().processor_seconds / 3600:.3g}",
    }
    paths = [write_card(out, title, files, facts, layers.as_dict()), write_croissant(out, title, files, url, published)]
    shutil.copy(campaign.path / "plan.json", out / "plan.json")
    return [*files, *paths, out / "plan.json"]


def _sensor_signals(campaign: Campaign, table: Any, groups: np.ndarray, done: np.ndarray, layers: SensorLayers) -> Any:
    """Return the signals of all sensors by row, None for failed cases, and the full scale of the converter."""
    spec = campaign.folder.specs[0]
    clean = campaign.open()[spec.name]
    healthy = np.flatnonzero(done & (table["state"] == "healthy").to_numpy())[:50]
    levels = clean.isel(case=healthy if healthy.size else np.flatnonzero(done)[:50]).values.std(axis=-1)
    full_scale = float(4.0 * np.median(levels) * 4.0)
    sensors: list[np.ndarray | None] = []
    for k in range(len(table)):
        if not done[k]:
            sensors.append(None)
            continue
        x = clean.isel(case=k).values[0].astype(float)
        record = int(table["index"].iloc[k])
        heard = [layers.measured(x, spec.rate, int(groups[k]), record, full_scale, j) for j in range(layers.sensors)]
        sensors.append(np.array(heard, dtype=np.float32))
    return sensors, full_scale


def feature_table(
    campaign: Campaign, layers: SensorLayers, *, window: float = 0.25
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return features of the measured signals' windows, their states, specimens and severities."""
    from gearmbs.campaigns.datasets.baseline import features, windows

    table = campaign.table
    group = campaign.plan.group or "index"
    groups = table[group].to_numpy()
    done = (table["status"] == "done").to_numpy()
    sensors, _ = _sensor_signals(campaign, table, groups, done, layers)
    spec = campaign.folder.specs[0]
    teeth = campaign.plan.subject.base().get("gears", {}).get("teeth", (29, 29))[0]
    rows, labels, owners, sizes = [], [], [], []
    for k, x in enumerate(sensors):
        if x is None:
            continue
        shaft = float(table["operation.speed"].iloc[k]) / (2.0 * np.pi)
        for part in windows(x, int(window * spec.rate)).reshape(-1, int(window * spec.rate)):
            rows.append(features(part, spec.rate, shaft, teeth))
            labels.append(table["state"].iloc[k])
            owners.append(groups[k])
            sizes.append(table["severity"].iloc[k] if "severity" in table else table["state.severity"].iloc[k])
    return np.array(rows), np.array(labels), np.array(owners), np.array(sizes)
