"""What the diagnosis of bearings finds in public recordings: the tables of docs/howto/bearing_records.md.

``python docs/scripts/public_bearings.py --cwru FOLDER --other-end FOLDER --mfpt FOLDER --gears FOLDER`` judges the
recordings in these folders, those that are given, and stores what it found; the page shows what is stored. They are

* of Case Western Reserve University, one ``RPM_FAULT_DIAMETER_END.npz`` for each with the channels DE, FE and BA; with
  ``--other-end`` the bearing at the end that was not hurt is judged;
* of the Machinery Failure Prevention Technology society, as MATLAB files with the structure ``bearing``;
* of the Center for Intelligent Maintenance Systems (IMS), ``--ims``, the first hours of its first test: tables of eight
  channels, two of each of four new bearings; belts drive the shaft, so that other shafts are not known;
* of the University of Electronic Science and Technology of China (UESTC), ``--uestc``, as MATLAB files
  ``KIND_SPEED_NUMBER.mat`` of a pillow block without load;
* of a gearbox rig of SpectraQuest, tables of four channels at 12.8 kHz and 30 turns a second.

The true speed is that of the shaft's own lines in all channels of a recording together, and the nominal one where there
are none; each is judged from one channel, with the speed told right, off by 0.2, 0.5 and 3 %, and as the name plate
says. Those of IMS and UESTC are judged at their nominal speed alone.
"""

from __future__ import annotations

import argparse
import json
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy.io

STORED = Path(__file__).parents[1] / "data" / "public_bearings.json"
OFFSETS = (-0.03, -0.005, -0.002, 0.0, 0.002, 0.005, 0.03)
PARTS = {"IR": "inner race", "OR": "outer race", "B": "rolling element", "Normal": None}
BEARINGS = {
    # multiples of the shaft's turns as the rig's makers publish them
    "DE": {"name": "6205", "FTF": 0.39828, "BSF": 2.35675, "BPFO": 3.5848, "BPFI": 5.4152},
    "FE": {"name": "6203", "FTF": 0.3817, "BSF": 1.9937, "BPFO": 3.0530, "BPFI": 4.9469},
}
SOUND_PIECES = 3
GEAR_BEARINGS, GEAR_SPEED, GEAR_RATE = ("6205", "6206", "6208", "6308", "6010"), 30.0, 12800.0
G = 9.80665


class Recording(NamedTuple):
    """One recording to be judged: its channel, all channels that tell the speed, and what was done to the bearing."""

    group: str
    name: str
    values: np.ndarray
    beside: list[np.ndarray]
    rate: float
    nominal: float
    bearing: Any
    part: str | None


def cwru(folder: Path) -> Iterator[Recording]:
    """Yield the recordings at 12 and 48 kHz, and pieces of those without a fault."""
    for path in sorted(folder.rglob("*.npz")):
        speed, fault, *size = path.stem.split("_")
        channels = {name: G * values[:, 0] for name, values in np.load(path).items()}
        place, kind = fault.split("@")[0], "races" if fault[0] in "IO" else "balls"
        if not size:
            for name, values in channels.items():
                for k, piece in enumerate(np.array_split(values, SOUND_PIECES)):
                    yield Recording(
                        "CWRU without a fault", f"{path.stem} {name} {k + 1}", piece, [piece], 48000.0,
                        int(speed) / 60, BEARINGS[name], None,
                    )  # fmt: skip
        elif (end := size[1][:2]) in channels:
            name, rate = {"DE": "drive end", "FE": "fan end"}[end], 48000.0 if size[1] == "DE48" else 12000.0
            group = f"CWRU {name}{' at 48 kHz' if rate == 48000.0 else ''}, {kind}"
            yield Recording(
                group, path.stem, channels[end], list(channels.values()), rate,
                int(speed) / 60, BEARINGS[end], PARTS[place],
            )  # fmt: skip


def other_end(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield what is named of the bearing at the end of the motor that was not hurt, at the true speed."""
    from gearmbs.signals import diagnose_bearing, make_signal

    group = "CWRU, bearing at the end that was not hurt"
    for path in sorted(folder.rglob("*.npz")):
        speed, _, *size = path.stem.split("_")
        channels = {name: G * values[:, 0] for name, values in np.load(path).items()}
        end = {"DE12": "FE", "FE": "DE"}.get(size[1] if size else "")
        if end not in channels:
            continue
        one = Recording(
            group, f"{path.stem} {end}", channels[end], list(channels.values()), 12000.0, int(speed) / 60,
            BEARINGS[end], None,
        )  # fmt: skip
        turns = true_speed(one)
        signal = make_signal(one.values, one.rate, units="m/s^2")
        fault = diagnose_bearing(signal, one.bearing, math.tau * turns, shafts=()).fault
        yield {"group": group, "record": one.name, "part": None, "rpm": round(60 * turns, 1), "+0.0": fault}


def mfpt(folder: Path) -> Iterator[Recording]:
    """Yield the recordings of races; the shaft's turns are those in the files."""
    for path in sorted(folder.rglob("*Fault*.mat")):
        file = scipy.io.loadmat(path, struct_as_record=False, squeeze_me=True)
        record = file["bearing"]
        turns = float(record.rate)
        multiples = {name: float(file[name]) / turns for name in ("FTF", "BSF", "BPFO", "BPFI")}
        values = G * np.asarray(record.gs, dtype=float)
        part = "inner race" if path.stem.startswith("Inner") else "outer race"
        yield Recording("MFPT, races", path.stem, values, [values], float(record.sr), turns, multiples, part)


def true_speed(one: Recording) -> float:
    """Return the turns of the shaft by its own lines in all channels, the nominal ones without these, Hz."""
    from gearmbs.signals import make_signal
    from gearmbs.signals.diagnosis.bearing_speed import find_shaft
    from gearmbs.signals.diagnosis.bearings import channel_spectrum, envelope_spectra

    spectra = []
    for values in one.beside:
        signal = make_signal(values, one.rate, units="m/s^2")
        spectra += [channel_spectrum(values, one.rate, one.nominal)]
        spectra += envelope_spectra(signal, one.nominal, 6.0 * one.nominal)[1][-1:]
    return find_shaft(spectra, one.nominal).turns


def judged(one: Recording) -> dict[str, Any]:
    """Return what is named of a recording at each told speed."""
    from gearmbs.signals import diagnose_bearing, make_signal
    from gearmbs.signals.diagnosis.bearing_report import NOT_CERTAIN

    signal, true = make_signal(one.values, one.rate, units="m/s^2"), true_speed(one)
    told = {f"{100 * off:+.1f}": true * (1.0 + off) for off in OFFSETS} | {"nominal": one.nominal}
    row: dict[str, Any] = {"group": one.group, "record": one.name, "part": one.part, "rpm": round(60 * true, 1)}
    for name, turns in told.items():
        report = diagnose_bearing(signal, one.bearing, 2 * np.pi * turns, shafts=())
        open_ = any(finding.grade in NOT_CERTAIN for finding in report.findings)
        row[name] = report.fault or ("not certain" if open_ else None)
    return row


def gears(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield what is named of bearings that are not known to be there, in recordings of gears."""
    from gearmbs.signals import diagnose_bearing, make_signal

    for path in sorted(folder.glob("*.csv.gz")):
        for channel, values in pd.read_csv(path).items():
            signal = make_signal(values.to_numpy(), GEAR_RATE, units="m/s^2")
            for bearing in GEAR_BEARINGS:
                fault = diagnose_bearing(signal, bearing, f"{GEAR_SPEED} Hz").fault
                yield {"group": "gears", "record": f"{path.name} {channel} {bearing}", "part": None, "+0.0": fault}


def ims(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield what is named of new bearings at their nominal 2000 rpm; the first test ended five weeks later."""
    from gearmbs.signals import diagnose_bearing, make_signal

    share = 0.331 / 2.815 * math.cos(math.radians(15.17))
    multiples = {
        "name": "ZA-2115", "FTF": 0.5 * (1.0 - share), "BSF": 0.5 * (1.0 - share**2) * 2.815 / 0.331,
        "BPFO": 8.0 * (1.0 - share), "BPFI": 8.0 * (1.0 + share),
    }  # fmt: skip
    for path in sorted(folder.rglob("2003.10.22.*")):
        for channel, values in enumerate(np.loadtxt(path).T, start=1):
            fault = diagnose_bearing(make_signal(G * values, 20000.0, units="m/s^2"), multiples, "2000 rpm").fault
            yield {"group": "IMS, new bearings", "record": f"{path.name} {channel}", "part": None, "+0.0": fault}


def uestc(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield what is named of a pillow block at its nominal speed."""
    from gearmbs.signals import diagnose_bearing, make_signal
    from gearmbs.signals.diagnosis.bearing_report import NOT_CERTAIN

    parts = {"N": None, "I": "inner race", "O": "outer race", "B": "rolling element"}
    kinds = {"N": "sound", "I": "races", "O": "races", "B": "balls"}
    for path in sorted(folder.rglob("*_*_*.mat")):
        kind, speed, _ = path.stem.split("_")
        file = scipy.io.loadmat(path, squeeze_me=True)
        signal = make_signal(np.asarray(file["Data"], dtype=float), float(file["SampleFrequency"]), units="m/s^2")
        report = diagnose_bearing(signal, "6204", f"{speed} rpm", shafts=())
        open_ = any(finding.grade in NOT_CERTAIN for finding in report.findings)
        named = report.fault or ("not certain" if open_ and kind != "N" else None)
        row = {"group": f"UESTC, {kinds[kind]}", "record": path.stem, "part": parts[kind], "rpm": float(speed)}
        yield row | {"+0.0": named, "nominal": named}


def found() -> pd.DataFrame:
    """Return what is stored."""
    rows = pd.DataFrame(json.loads(STORED.read_text(encoding="utf-8"))).astype(object)
    return rows.where(rows.notna(), None)


def kind_of(named: Any, part: str | None) -> str:
    """Return as what an answer counts."""
    if named is None or named == "not certain":
        return "not named" if named is None else named
    if part is None:
        return "accused"
    return "named right" if named == part else "by the cage" if named == "cage" else "another part"


ONCE = ("UESTC, races", "UESTC, balls")
"""Groups that are judged at one speed."""
COUNTED = ("named right", "by the cage", "another part", "not certain", "not named")


def summary() -> str:
    """Return the table of groups by told speed."""
    rows = found()
    told = [f"{100 * off:+.1f}" for off in OFFSETS] + ["nominal"]
    lines = ["| recordings | number | told speed | " + " | ".join(COUNTED) + " |", "|---" * (3 + len(COUNTED)) + "|"]
    faulty = rows[rows["part"].notna()]
    for group, members in faulty.groupby("group"):
        for name in told[-1:] if group in ONCE else told:
            count = Counter(kind_of(named, part) for named, part in zip(members[name], members["part"], strict=True))
            words = name if name == "nominal" else f"{name} %"
            lines.append(
                f"| {group} | {len(members)} | {words} | " + " | ".join(str(count[c] or "") for c in COUNTED) + " |"
            )
    return "\n".join(lines)


def sound() -> str:
    """Return the table of recordings without a fault, and of bearings that are not there."""
    rows = found()
    lines = ["| recordings | judged | accused |", "|---|---|---|"]
    for group, members in rows[rows["part"].isna()].groupby("group"):
        columns = [c for c in members if (c[:1] in "+-n" and members[c].notna().any()) or c == "+0.0"]
        accused = max(int(members[c].isin([p for p in PARTS.values() if p] + ["cage"]).sum()) for c in columns)
        lines.append(f"| {group} | {len(members)} | {accused} |")
    return "\n".join(lines)


def hard() -> str:
    """Return the recordings that are not named right at their true speed, without those judged at one speed."""
    rows = found()
    rows = rows[~rows["group"].isin(ONCE)]
    lines = ["| recording | true speed, rpm | defect | here | at the nominal speed |", "|---|---|---|---|---|"]
    for row in rows[rows["part"].notna()].itertuples(index=False):
        named, nominal = row[rows.columns.get_loc("+0.0")], row.nominal
        if named != row.part:
            lines.append(f"| `{row.record}` | {row.rpm} | {row.part} | {named or '-'} | {nominal or '-'} |")
    return "\n".join(lines)


def main() -> None:
    """Judge the recordings in the folders given and store the outcome."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    sets = {"cwru": cwru, "mfpt": mfpt}
    alone = {"gears": gears, "other-end": other_end, "ims": ims, "uestc": uestc}
    for name in (*sets, *alone):
        parser.add_argument(f"--{name}", type=Path)
    asked = vars(parser.parse_args())
    rows = []
    for name, folder in asked.items():
        if folder is not None:
            new = map(judged, sets[name](folder)) if name in sets else alone[name.replace("_", "-")](folder)
            for row in new:
                print(row, flush=True)
                rows.append(row)
    groups = {row["group"] for row in rows}
    known = json.loads(STORED.read_text(encoding="utf-8")) if STORED.exists() else []
    kept = [row for row in known if row["group"] not in groups]
    text = ",\n".join(json.dumps(row) for row in kept + rows)
    STORED.write_text(f"[\n{text}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
