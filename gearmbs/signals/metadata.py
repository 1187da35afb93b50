"""What headers say, by the names that real files use: sampling rates and speeds, and which to believe."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .errors import SignalFileError

RATE_NAMES = frozenset(
    (
        "samplingrate samplerate samplingfrequency samplefrequency samplingfreq samplefreq sampfreq samprate fs fsamp "
        "fsample fsampling sr sf scanrate acquisitionrate daqrate samplespersecond samplespersec sps abtastrate "
        "abtastfrequenz frequencysampling samplehz samplerateinhz ratehz hz"
    ).split()
)
WEAK_RATE_NAMES = frozenset({"rate"})
"""Names that mean the sampling rate in some files and the shaft's in others: a better name beside them wins."""
STEP_NAMES = frozenset(
    (
        "xinc xincrement xincr xdelta dx deltax dt deltat deltatime timestep timeincrement timeinterval wfincrement "
        "sampleinterval samplinginterval sampleperiod samplingperiod samplingtime tsample tsamp abtastintervall"
    ).split()
)
SPEED_NAMES = frozenset(
    "speed rpm shaftspeed rotationalspeed rotationspeed rotatingspeed motorspeed inputspeed drehzahl n shaftrpm".split()
)
SHAFT_FREQUENCIES = frozenset(
    "shaftrate shaftfrequency rotationfrequency rotationalfrequency rotfreq fr shafthz".split()
)
PER_SECOND = {
    "": 1.0, "hz": 1.0, "khz": 1e3, "mhz": 1e6, "1/s": 1.0, "s/s": 1.0, "ks/s": 1e3, "samples/s": 1.0, "sa/s": 1.0,
    "samples/sec": 1.0, "samples/second": 1.0, "sps": 1.0, "ksps": 1e3, "s^-1": 1.0,
}  # fmt: skip
SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
NUMBER = re.compile(r"^\s*([-+]?\d+(?:[.,]\d*)?(?:[eE][-+]?\d+)?)\s*[\[(]?\s*([A-Za-zµ/^\-0-9]*)")
BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]")
AGREE = 1e-3
PLAUSIBLE_RPM = (1.0, 200_000.0)
STEM = re.compile(r"[_.\s-]*(header|data|info|signal|values|samples|properties)$", re.IGNORECASE)


@dataclass(frozen=True)
class RateCandidate:
    """A sampling rate that a file may mean: the name it stands under, Hz, and whether the name may mean another."""

    name: str
    rate: float
    weak: bool = False

    def __str__(self) -> str:
        return f"{self.name} = {self.rate:g} Hz"


def key_of(name: str) -> tuple[str, str]:
    """A header's name without case, blanks and path, and the unit in its brackets ("" without one)."""
    last = re.split(r"[./\\]", name.strip().rstrip(":"))[-1] if not BRACKETS.search(name) else name
    unit = BRACKETS.search(last)
    bare = re.sub(r"[^a-z0-9äöü]", "", BRACKETS.sub("", last).lower())
    return bare, unit.group(1).strip() if unit else ""


def number_of(value: Any) -> tuple[float, str] | None:
    """A header's value as a number and its unit; None for what is no number."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, (int, float, np.number)):
        return float(value), ""
    if isinstance(value, np.ndarray):
        return number_of(value.reshape(-1)[0].item()) if value.size == 1 and value.dtype.kind in "fiuSU" else None
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="replace")
    if not isinstance(value, str):
        return None
    found = NUMBER.match(value.strip(" \t\"',;:="))
    if found is None:
        return None
    digits = found.group(1)
    if re.fullmatch(r"[-+]?\d{1,3}(,\d{3})+", value.strip(" \t\"';:=").split(" ")[0]):
        digits = value.strip(" \t\"';:=").split(" ")[0].replace(",", "")
    return float(digits.replace(",", ".")), found.group(2)


def rate_candidates(header: Mapping[str, Any]) -> list[RateCandidate]:
    """The sampling rates that a header may mean, better names first."""
    found = []
    for name, value in header.items():
        key, unit = key_of(str(name))
        number = number_of(value)
        if number is None or not math.isfinite(number[0]) or number[0] <= 0.0:
            continue
        unit = (number[1] or unit).lower()
        if key in RATE_NAMES or key in WEAK_RATE_NAMES:
            if unit in PER_SECOND:
                found.append(RateCandidate(str(name), number[0] * PER_SECOND[unit], key in WEAK_RATE_NAMES))
            elif unit in SECONDS:
                found.append(RateCandidate(str(name), 1.0 / (number[0] * SECONDS[unit]), True))
        elif key in STEP_NAMES and unit in SECONDS:
            found.append(RateCandidate(str(name), 1.0 / (number[0] * SECONDS[unit])))
    return sorted(found, key=lambda candidate: candidate.weak)


def chosen_rate(
    path: Path, candidates: Sequence[RateCandidate], given: float | None = None
) -> tuple[float | None, list[str]]:
    """The sampling rate that a file means, and what is to be said about it.

    Raises
    ------
    SignalFileError
        If the file names two that disagree and the caller (`given`, Hz) none of them.
    """
    if not candidates:
        return None, []
    sure = [candidate for candidate in candidates if not candidate.weak] or list(candidates)
    distinct: list[RateCandidate] = []
    for candidate in sure:
        if all(abs(candidate.rate / other.rate - 1.0) > AGREE for other in distinct):
            distinct.append(candidate)
    if len(distinct) > 1:
        listed = " and ".join(str(candidate) for candidate in distinct[:4])
        if given is None:
            raise SignalFileError(
                path, f"names two sampling rates that disagree, {listed}; say which: rate=... (--rate)"
            )
        return given, [f"The file names {listed}; the rate given, {given:g} Hz, is used."]
    first = distinct[0]
    if given is not None and first.weak and abs(given / first.rate - 1.0) > AGREE:
        return given, [
            f"The file's {first.name} = {first.rate:g} is not taken for the sampling rate; {given:g} Hz is given."
        ]
    others = [c for c in candidates if c.weak and c not in sure and abs(c.rate / first.rate - 1.0) > AGREE]
    notes = [
        f"The sampling rate is {first}; {other.name} = {other.rate:g} is something else. If it is the shaft's speed in "
        f"Hz, say so: speed='{other.rate:g} Hz' (--speed \"{other.rate:g} Hz\")."
        for other in others
    ]
    return first.rate, notes


def own_header(header: Mapping[str, Any], channel: str) -> dict[str, Any]:
    """The part of a header that speaks of a channel: what stands beside it or above it, or else all of it."""
    beside = {k: v for k, v in header.items() if k.rpartition(".")[0] == channel}
    if rate_candidates(beside):
        return beside
    prefix = channel.rpartition(".")[0]
    above = {k: v for k, v in header.items() if prefix == k.rpartition(".")[0] or not k.rpartition(".")[0]}
    if rate_candidates(above):
        return above
    above = {k: v for k, v in header.items() if prefix.startswith(k.rpartition(".")[0])}
    if rate_candidates(above):
        return above
    stem = STEM.sub("", channel)
    beside = {k: v for k, v in header.items() if STEM.sub("", k.rpartition(".")[0]) == stem}
    return beside if rate_candidates(beside) else dict(header)


def speed_of(header: Mapping[str, Any]) -> tuple[float | None, list[str]]:
    """The shaft's speed (rad/s) that a header names with its unit, and what is to be said about it."""
    found: list[tuple[str, float]] = []
    unclear = []
    for name, value in header.items():
        key, unit = key_of(str(name))
        number = number_of(value)
        if number is None or not math.isfinite(number[0]) or number[0] <= 0.0:
            continue
        unit = (number[1] or unit).lower()
        if key in SHAFT_FREQUENCIES and unit in ("", "hz", "1/s"):
            found.append((str(name), number[0] * math.tau))
        elif key.endswith("rpm") or (key in SPEED_NAMES and unit in ("rpm", "1/min", "u/min", "r/min", "rev/min")):
            found.append((str(name), number[0] * math.pi / 30.0))
        elif key in SPEED_NAMES and unit in ("hz", "1/s"):
            found.append((str(name), number[0] * math.tau))
        elif key in SPEED_NAMES and unit == "rad/s":
            found.append((str(name), number[0]))
        elif key in SPEED_NAMES and key != "n" and str(name) != "speed":
            unclear.append(f"{name} = {number[0]:g} has no unit; pass speed='{number[0]:g} rpm' if it is in rpm.")
    found = [(n, s) for n, s in found if PLAUSIBLE_RPM[0] <= s * 30.0 / math.pi <= PLAUSIBLE_RPM[1]]
    if not found:
        return None, unclear
    name, speed = found[0]
    if any(abs(other / speed - 1.0) > AGREE for _, other in found):
        listed = ", ".join(f"{n} ({s * 30 / math.pi:g} rpm)" for n, s in found)
        return None, [f"The file names several speeds: {listed}; say which with speed=... (--speed)."]
    return speed, [f"The speed, {speed * 30.0 / math.pi:.6g} rpm, is the file's {name}."]


def same_rate(path: Path, rates: Mapping[str, float | None]) -> float | None:
    """The one rate of all channels; SignalFileError that lists them where they differ."""
    known: Iterable[float] = {rate for rate in rates.values() if rate is not None}
    distinct: list[float] = []
    for rate in known:
        if all(abs(rate / other - 1.0) > AGREE for other in distinct):
            distinct.append(rate)
    if len(distinct) > 1:
        listed = ", ".join(f"{name} {rate:g} Hz" for name, rate in rates.items() if rate is not None)
        raise SignalFileError(
            path, f"its channels have different sampling rates: {listed}; choose with channels=[...] (--channel)"
        )
    return next((rate for rate in rates.values() if rate is not None), None)
