"""From campaigns to the files of a data set, in an order of chance, and back to rows."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.campaign import Campaign
from gearmbs.campaigns.codes import code_counts, known_code
from gearmbs.campaigns.datasets.card import published_on, write_card, write_croissant
from gearmbs.campaigns.datasets.layers import SensorLayers, checked_layers
from gearmbs.campaigns.datasets.measuring import Measured, measured
from gearmbs.campaigns.datasets.source import source_of, states
from gearmbs.campaigns.datasets.splits import shared_groups, split_by_group, withhold
from gearmbs.campaigns.folder import digest_of
from gearmbs.campaigns.plans.factors import Specimens
from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.stored.exports import ROWS_A_FILE, check_card, place
from gearmbs.files import whole_file
from gearmbs.system import rename_over

if TYPE_CHECKING:
    import pandas as pd


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
        Range of severities that training specimens keep for the split "withheld", with all states of these points.
    url, published : str, optional
        Where and when it will be published, for the metadata; the same campaign gives the same files whenever they are
        written.

    Raises
    ------
    CampaignError
        If a campaign is not done, has no specimens or no crossed states, or holds a case of another one. Whatever is
        refused leaves a former data set in the folder as it is.
    """
    out, layers = place(out, None, title), checked_layers(layers, seed)
    check_card(out)
    given = [campaigns] if isinstance(campaigns, Campaign) else list(campaigns)
    _check_given(given)
    if published is not None:
        published_on(published)
    parts = [measured(campaign, layers, number) for number, campaign in enumerate(given)]
    rows = _split(given, [part.rows for part in parts], test, validation, withheld, seed)
    with _written_first(out) as new:
        files = _parquet(rows, new)
        facts = _facts(given, parts, rows)
        boxes = [str(part.rows["gearbox"].iloc[0]) for part in parts]
        codes = [f"{box}: {told}" for box, campaign in zip(boxes, given, strict=True) for told in _codes(campaign)]
        card = write_card(new, title, files, facts, layers.as_dict(), codes)
        beside = [card, *_sources(new, boxes, given), write_croissant(new, title, files, url, published)]
    return [out / path.relative_to(new) for path in (*files, *dict.fromkeys(beside))]


def _check_given(given: Sequence[Campaign]) -> None:
    """Refuse what is no sequence of campaigns that are done, each once, before anything is measured."""
    if not given or not all(isinstance(campaign, Campaign) for campaign in given):
        raise CampaignError(f"data set: campaigns = {given!r:.60}; give a Campaign, or a list of one a gearbox")
    paths = [campaign.path.resolve() for campaign in given]
    if doubled := sorted({str(path) for path in paths if paths.count(path) > 1}):
        raise CampaignError(f"data set: {', '.join(doubled)} is given more than once; give each campaign once")
    for campaign in given:
        source_of(campaign)
    met: dict[str, Campaign] = {}
    for campaign in given:
        for key in campaign.read(["id"], "status == 'done'")["id"]:
            if key in met:
                both = dict.fromkeys(str(one.path) for one in (met[key], campaign))
                raise CampaignError(
                    f"data set: {' and '.join(both)}: the case of id {key} is in them more than once, whose rows "
                    "might come into two splits; leave out the copy, or the specimens and points that are alike"
                )
            met[key] = campaign


def _split(
    given: Sequence[Campaign],
    tables: Sequence[pd.DataFrame],
    test: float,
    validation: float,
    withheld: tuple[float, float],
    seed: int,
) -> pd.DataFrame:
    """Return the rows of all campaigns with their splits, in an order of chance."""
    import pandas as pd

    # campaigns whose specimens are drawn alike have the same individuals, each of which is in one split
    alike: dict[str, list[pd.DataFrame]] = {}
    for number, (campaign, table) in enumerate(zip(given, tables, strict=True)):
        alike.setdefault(_individuals(campaign), []).append(table.assign(campaign=number))
    sizes = [name for one in given if (choice := states(one.plan)) is not None for name in choice.sized]
    groups, individuals = [], 0
    for members in alike.values():
        group = pd.concat(members, ignore_index=True)
        split = split_by_group(group["specimen"].to_numpy(), test=test, validation=validation, seed=seed)
        # states without a size have no severity, which stands as 0 in the rows
        severity = group["severity"].where(group["state"].isin(sizes)).to_numpy()
        points = group.groupby(["campaign", "point"]).ngroup().to_numpy()
        group["split"] = withhold(split, severity, *withheld, points)
        group["specimen"] += individuals
        individuals = int(group["specimen"].max()) + 1
        groups.append(group.drop(columns="campaign"))
    rows = pd.concat(groups, ignore_index=True)
    # the order of the cases is that of the states
    return rows.iloc[np.random.default_rng(seed).permutation(len(rows))].reset_index(drop=True)


def _facts(given: Sequence[Campaign], parts: Sequence[Measured], rows: pd.DataFrame) -> dict[str, Any]:
    """Return what the card counts."""
    clipped = rows.filter(like="clipped.").to_numpy() > 0
    counts = rows["split"].value_counts().sort_index().items()
    hours = sum(campaign.status().processor_seconds for campaign in given) / 3600.0
    shared = shared_groups(rows["split"].to_numpy(), rows["specimen"].to_numpy()).values()
    return {
        "signals": int(rows.filter(like="signal.").notna().to_numpy().sum()),
        "records (simulations)": len(rows),
        "gearboxes": ", ".join(rows["gearbox"].unique()),
        "specimens": rows["specimen"].nunique(),
        "states": ", ".join(sorted(rows["state"].unique())),
        "length of a record, s": ", ".join(f"{part.duration:.4g}" for part in parts),
        "sampling rate, Hz": ", ".join(f"{part.rate:g}" for part in parts),
        "full scale of the converters, m/s^2": ", ".join(f"{part.full_scale:.4g}" for part in parts),
        "signals with clipped samples": int(clipped.sum()),
        "operating points left out, since a state of theirs failed": sum(part.left_out for part in parts),
        "seeds of the points' sequences": ", ".join(str(campaign.plan.seed) for campaign in given),
        "records by split": ", ".join(f"{name} {count}" for name, count in counts),
        "specimens in two splits": max(shared, default=0),
        "processor time of the simulations, core hours": f"{hours:.3g}",
    }


def _sources(out: Path, boxes: Sequence[str], given: Sequence[Campaign]) -> list[Path]:
    """Copy the plans of the campaigns and the codes that they come from."""
    plans: list[Path] = []
    codes: list[Path] = []
    for box, campaign in zip(boxes, given, strict=True):
        name = re.sub(r"[^\w.]+", "-", box)
        free = (out / f"plan-{name}{again}.json" for again in ("", *(f"-{k + 2}" for k in range(len(plans)))))
        plans.append(next(path for path in free if path not in plans))
        shutil.copy(campaign.path / "plan.json", plans[-1])
        for digest in code_counts(campaign.folder):
            if known_code(campaign.folder, digest) is not None:
                codes.append(out / f"code-{digest}.json")
                shutil.copy(campaign.path / "codes" / f"{digest}.json", codes[-1])
    return [*plans, *codes]


OWN = re.compile(r"data/\w+-\d{5}-of-\d{5}\.parquet|README\.md|croissant\.json|plan-.+\.json|code-[0-9a-f]+\.json")
"""Files of a data set: those of a former one that a new one has not are removed."""

UNDER_WAY = ".writing-"
"""How the folder begins in which a data set is written before it takes its place."""


@contextmanager
def _written_first(out: Path) -> Iterator[Path]:
    """Yield a folder for the files of a data set, which take the places of a former one's when all are written.

    Whatever goes wrong before leaves the former one. Between the first and the last renaming files of both stand beside
    each other, which their digests tell a reader.
    """
    out.mkdir(parents=True, exist_ok=True)
    for litter in out.glob(f"{UNDER_WAY}*"):
        # of a process that was killed
        shutil.rmtree(litter, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=UNDER_WAY, dir=out) as folder:
        new = Path(folder)
        yield new
        found = [path.relative_to(new) for path in sorted(new.rglob("*")) if path.is_file()]
        former = [path for path in (*out.glob("data/*.parquet"), *out.glob("*.*")) if path.is_file()]
        for path in former:
            name = path.relative_to(out)
            if name not in found and OWN.fullmatch(name.as_posix()):
                path.unlink()
        for name in found:
            (out / name).parent.mkdir(exist_ok=True)
            rename_over(new / name, out / name)


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
                table = pa.Table.from_pandas(here, preserve_index=False)
                pq.write_table(table, file, compression="zstd", write_page_checksum=True)
            written.append(path)
    return written


def read_data_set(folder: str | Path, *, check: bool = True) -> pd.DataFrame:
    """Return the rows of a data set with the split of each.

    Parameters
    ----------
    folder : path-like
    check : bool
        Compare the SHA-256 of each file with that in croissant.json; without, files may have been changed or left out.

    Raises
    ------
    CampaignError
        If the folder has none, or a file is another one than was written, with its name.
    """
    import pandas as pd

    folder = Path(folder)
    files = sorted(folder.glob("data/*.parquet"))
    if not files:
        raise CampaignError(f"{folder}: no data/*.parquet; give the folder that write_data_set has written")
    if check:
        _check_digests(folder, files)
    tables = []
    for file in files:
        try:
            tables.append(pd.read_parquet(file).assign(split=file.name.split("-")[0]))
        except (OSError, ValueError) as error:
            raise CampaignError(f"{file}: cannot be read ({error}); {AGAIN}") from error
    return pd.concat(tables, ignore_index=True)


AGAIN = "fetch it again, or write the data set again from its campaigns"


def _check_digests(folder: Path, files: Sequence[Path]) -> None:
    """Compare files with the digests in croissant.json."""
    place = folder / "croissant.json"
    try:
        listed = json.loads(place.read_bytes())["distribution"]
        digests = {one["contentUrl"]: one["sha256"] for one in listed if "sha256" in one}
    except FileNotFoundError:
        raise CampaignError(
            f"{place} is not there, which holds the digests of the files; {AGAIN}, or read it unchecked, check=False"
        ) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CampaignError(f"{place} is damaged ({error}); {AGAIN}") from error
    names = {file.relative_to(folder).as_posix(): file for file in files}
    if missing := sorted(digests.keys() - names.keys()):
        raise CampaignError(
            f"{folder / missing[0]} is not there, which croissant.json lists; {AGAIN}, or read what there is, "
            "check=False"
        )
    for name, file in names.items():
        with file.open("rb") as content:
            found = hashlib.file_digest(content, "sha256").hexdigest()
        if found != digests.get(name):
            told = "is damaged or of another data set" if name in digests else "is none of the data set"
            raise CampaignError(f"{file} {told}: its SHA-256 is not in croissant.json; {AGAIN}")
