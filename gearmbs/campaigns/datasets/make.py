"""A labelled data set of a gear pair with faults: its plan, its campaign, its files, its card and metadata."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

import gearmbs
from gearmbs.campaigns.campaign import Campaign
from gearmbs.campaigns.datasets.layers import SensorLayers, shared_groups, split_by_group, withhold
from gearmbs.campaigns.factors import AnyFactor, Choice, Factor, Specimens
from gearmbs.campaigns.plan import Plan, make_plan
from gearmbs.campaigns.results import front_matter
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

TYPES = {
    "double": "sc:Float",
    "float": "sc:Float",
    "int64": "sc:Integer",
    "string": "sc:Text",
    "large_string": "sc:Text",
}
MEANINGS = {
    "index": "number of the case",
    "point": "number of the design's point; cases of one point differ in the fault only",
    "id": "content key of the case: equal cases have equal keys",
    "specimen": "number of the individual: a draw of manufacturing errors and of a housing; the group of every split",
    "state": "kind of fault",
    "severity": "where in its range the fault's size lies, 0 to 1; 0 if healthy",
    "split": "train, validation, test, or withheld (severities kept from training)",
    "signal.line_of_action": "clean signal: force on the driven gear along the line of action over its mass, m/s^2",
    "error.peak_to_peak": "transmission error, m",
    "operation.speed": "speed of the driver, rad/s",
    "operation.torque": "load torque on the driven wheel, N m",
}


CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "arrayShape": "cr:arrayShape",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isArray": "cr:isArray",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
"""Terms of the Croissant format, version 1.0."""


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


# The card (README.md) and the Croissant metadata.


def _meaning(name: str) -> str:
    if name.startswith("signal.sensor_"):
        place = name.removeprefix("signal.sensor_")
        return f"measured signal at place {place}: the clean one behind housing, noise, converter, m/s^2"
    return MEANINGS.get(name, "setting of the case or result, SI units")


def write_card(
    folder: Path, title: str, files: Sequence[Path], facts: Mapping[str, Any], layers: Mapping[str, Any]
) -> Path:
    """Write README.md with the front matter that hubs read."""
    from gearmbs.files import write_whole

    lines = ["---", "license: cc0-1.0", "task_categories:", "- time-series-classification", "tags:", "- vibration"]
    lines += ["- gears", "- simulation", *front_matter(files, int(facts["signals"]))]
    lines += [
        "---",
        "",
        f"# {title}",
        "",
        "Simulated vibration of a spur gear pair with faults of known kind, size and tooth.",
    ]
    lines += ["", "## What is in it", ""]
    lines += [f"* {name}: {value}" for name, value in facts.items()]
    lines += ["", "## Columns", "", "| column | meaning |", "|---|---|"]
    lines += [f"| `{name}` | {_meaning(name)} |" for name in _columns(files)]
    lines += [
        "",
        "## How it was made",
        "",
        f"Cases were simulated by gearmbs {gearmbs.__version__}, a multibody solver with contact of "
        f"involute flanks; `plan.json` holds the whole "
        "plan, from which the same command makes the same bits again. Clean signals are forces at the "
        "driven gear's seat over its mass. "
        "Between them and the measured ones are layers of their own: random modes of a housing, drawn by "
        "specimen, drift of the speed, "
        "noise, clipping and quantisation:",
        "",
        "```json",
        json.dumps(dict(layers), indent=1),
        "```",
        "",
        "## Splits",
        "",
        "Splits are by specimen: no specimen is in two of them. Windows of one record, or records of one "
        "specimen, in training and "
        "test make any classifier look better than it is. Severities of the split `withheld` are of "
        "training specimens and were kept "
        "out of training.",
        "",
        "## Limits",
        "",
        "One gear pair on rigid shafts and bearings; no lubricant film, no bearing faults, no neighbouring "
        "machines. Faults are changes of "
        "flanks and of tooth stiffness. The mixture of classes is that of a design, not of the field. A "
        "model trained on it alone has to be "
        "tested on recordings before anything is concluded.",
        "",
    ]
    return write_whole(folder / "README.md", "\n".join(lines))


def write_croissant(
    folder: Path, title: str, files: Sequence[Path], url: str | None = None, published: str | None = None
) -> Path:
    """Write croissant.json: files with their digests, and the columns as fields of a record set; where and when (year,
    month and day, as 2026-01-31) it is published, if it is."""
    from gearmbs.files import write_whole

    fields = []
    for name, kind in _columns(files).items():
        field: dict[str, Any] = {
            "@type": "cr:Field",
            "@id": f"records/{name}",
            "name": name,
            "description": _meaning(name),
            "dataType": TYPES.get(kind, "sc:Float"),
            "source": {"fileSet": {"@id": "parquet"}, "extract": {"column": name}},
        }
        if name.startswith("signal."):
            field |= {"isArray": True, "arrayShape": "-1", "repeated": True}
        fields.append(field)
    tree = {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "name": title.replace(" ", "-").lower(),
        "description": "Simulated vibration of a spur gear pair with faults of known kind, size and tooth.",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "license": "https://creativecommons.org/publicdomain/zero/1.0/",
        "version": gearmbs.__version__,
        "citeAs": "simulated by gearmbs",
        "distribution": [
            *(
                {
                    "@type": "cr:FileObject",
                    "@id": p.relative_to(folder).as_posix(),
                    "name": p.relative_to(folder).as_posix(),
                    "contentUrl": p.relative_to(folder).as_posix(),
                    "encodingFormat": "application/x-parquet",
                    "sha256": hashlib.sha256(p.read_bytes()).hexdigest(),
                }
                for p in files
            ),
            {
                "@type": "cr:FileSet",
                "@id": "parquet",
                "name": "parquet",
                "encodingFormat": "application/x-parquet",
                "includes": "data/*.parquet",
            },
        ],
        "recordSet": [{"@type": "cr:RecordSet", "@id": "records", "name": "records", "field": fields}],
    }
    if published is not None:
        try:
            tree["datePublished"] = date.fromisoformat(published).isoformat()
        except ValueError:
            raise CampaignError(f"published = {published!r}; write year-month-day, as 2026-01-31") from None
    if url is not None:
        tree["url"] = url
    return write_whole(folder / "croissant.json", json.dumps(tree, indent=1))


def _columns(files: Sequence[Path]) -> dict[str, str]:
    import pyarrow.parquet as pq

    schema = pq.ParquetFile(files[0]).schema_arrow
    return {f.name: str(f.type) for f in schema}
