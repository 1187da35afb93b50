"""What a data set says of itself: its card (README.md) and its Croissant metadata."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

import gearmbs
from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.stored.exports import front_matter

ABOUT = "Simulated vibration of gearboxes with faults of teeth of known kind, size and tooth."

TYPES = {
    "double": "sc:Float",
    "float": "sc:Float",
    "int64": "sc:Integer",
    "string": "sc:Text",
    "large_string": "sc:Text",
}
MEANINGS = {
    "id": "content key of the case: equal cases have equal keys",
    "gearbox": "which gearbox",
    "specimen": "number of the individual: a draw of manufacturing errors and of a housing; the group of every split",
    "point": "number of the operating point of a specimen; rows of one point differ in the state only",
    "state": "label: kind of fault",
    "severity": "label: where in its range the fault's size lies, 0 to 1; 0 if healthy",
    "split": "train, validation, test, or withheld (severities kept from training)",
    "operation.speed": "speed asked of the drive, rad/s; not a number if it changes",
    "operation.torque": "torque of the load, N m; not a number if it changes",
    "teeth": "teeth of the pair with the fault, driver and driven",
    "sampling_rate": "of all signals of the row, Hz",
    "speed": "speed of the shaft of the driver about its axis, rad/s, negative backwards; of a sensor at another shaft "
    "by the ratio of the teeth",
    "tacho": "times of the pulses, one a turn of the driver's shaft either way, s from the first sample; the mark is "
    "where the specimen has it",
}
"""Meanings of columns; those of others follow from the beginnings of their names."""

BEGINNINGS = {
    "signal.": "measured signal of the accelerometer: the clean one with drift, noise and converter, m/s^2",
    "clean.": "the same of the simulation, band-limited, without noise and converter, m/s^2",
    "clipped.": "samples of the signal that the converter has clipped",
    "size.": "label: size of the fault, SI units, or its tooth; not a number where the state has none",
    "source.": "of a bearing, alike in all states of a point: sound, or where its spall is; width, m, and angle, rad",
    "known.": "of the simulation, which no measurement knows: mesh with the fault, SI units",
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


def _meaning(name: str) -> str:
    begun = (text for beginning, text in BEGINNINGS.items() if name.startswith(beginning))
    return MEANINGS.get(name) or next(begun, "setting of the case or result, SI units")


def write_card(
    folder: Path,
    title: str,
    files: Sequence[Path],
    facts: Mapping[str, Any],
    layers: Mapping[str, Any],
    codes: Sequence[str],
) -> Path:
    """Write README.md with the front matter that hubs read; ``codes`` say what computed it."""
    from gearmbs.files import write_whole

    bearings = "" if any(name.startswith("source.") for name in _columns(files)) else "no bearing fault, "
    path = "a transfer path, " if layers["modes"] or layers["paths"] else ""
    lines = ["---", "license: cc0-1.0", "task_categories:", "- time-series-classification", "tags:", "- vibration"]
    lines += ["- gears", "- simulation", *front_matter(files, int(facts["signals"]))]
    lines += [
        "---",
        "",
        f"# {title}",
        "",
        ABOUT,
    ]
    lines += ["", "## What is in it", ""]
    lines += [f"* {name}: {value}" for name, value in facts.items()]
    lines += ["", "## Columns", "", "| column | meaning |", "|---|---|"]
    lines += [f"| `{name}` | {_meaning(name)} |" for name in _columns(files)]
    lines += [
        "",
        "## How it was made",
        "",
        f"Gearboxes were simulated by gearmbs {gearmbs.__version__}, a multibody solver with contact of involute "
        "flanks; `plan-*.json` hold the plans, from which the same code makes the same bits again. Clean signals "
        "are accelerations of a housing that bends, with the modes of its specimen, at seats of bearings. "
        f"Between them and the measured ones are layers of their own, drift of the speed, {path}noise and converter, "
        "none of which knows the state; records are cut out of longer ones, so that filters leave no edges:",
        "",
        "```json",
        json.dumps(dict(layers), indent=1),
        "```",
        "",
        "What computed it, by fingerprints of sources, libraries and processor, which `code-*.json` hold in full:",
        "",
        *(f"* {code}" for code in codes),
        "",
        "## Splits",
        "",
        "Splits are by specimen: no specimen is in two of them. Windows of one record, or records of one "
        "specimen, in training and "
        "test make any classifier look better than it is. Points of the split `withheld` are of training "
        "specimens, and were kept out of training in all their states for the severity of one.",
        "",
        "`croissant.json` holds the SHA-256 of each file, which `read_data_set` of gearmbs compares; pages of the "
        "parquet files have checksums.",
        "",
        "## Limits",
        "",
        f"Shafts are rigid; there is no lubricant film, {bearings}no neighbouring machine. Faults are changes "
        "of flanks and of tooth stiffness. The mixture of classes is that of a design, not of the field. A model "
        "trained on it alone has to be tested on recordings before anything is concluded.",
        "",
    ]
    return write_whole(folder / "README.md", "\n".join(lines))


def published_on(published: str) -> str:
    """Return a date of publication, as 2026-01-31.

    Raises
    ------
    CampaignError
        If it is none.
    """
    try:
        return date.fromisoformat(published).isoformat()
    except (TypeError, ValueError):
        raise CampaignError(f"published = {published!r}; write year-month-day, as 2026-01-31") from None


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
            "dataType": TYPES.get(kind.removeprefix("list<element: ").removesuffix(">"), "sc:Float"),
            "source": {"fileSet": {"@id": "parquet"}, "extract": {"column": name}},
        }
        if kind.startswith("list"):
            field |= {"isArray": True, "arrayShape": "-1", "repeated": True}
        fields.append(field)
    tree = {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "name": title.replace(" ", "-").lower(),
        "description": ABOUT,
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
        tree["datePublished"] = published_on(published)
    if url is not None:
        tree["url"] = url
    return write_whole(folder / "croissant.json", json.dumps(tree, indent=1))


def _columns(files: Sequence[Path]) -> dict[str, str]:
    import pyarrow.parquet as pq

    schema = pq.ParquetFile(files[0]).schema_arrow
    return {f.name: str(f.type) for f in schema}
