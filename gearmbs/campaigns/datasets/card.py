"""The card of a data set (README.md) and its Croissant metadata."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

import gearmbs
from gearmbs.campaigns.results import front_matter
from gearmbs.campaigns.settings import CampaignError

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
