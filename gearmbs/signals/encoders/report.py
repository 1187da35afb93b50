"""What two encoders said of a pair, in words and as a report."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from gearmbs.signals.analysis.report import markdown_table
from gearmbs.signals.encoders.cycle import unseen_in_words

LISTED = 4
"""Harmonics whose lengths a report names."""
SHAFTS = ("driver", "driven")


def verdict_of(result: Any) -> str:
    """Return what is sure, in a sentence."""
    mesh = result.harmonics()
    sure = mesh[mesh["low"] > 0.0]
    doubt = "" if result.doubt is None else f"{result.doubt} "
    several = len(result.loads) > 1
    at = f" at {result.loads[0]}" if several else ""
    changes = [_change(result, load) for load in result.loads[1:]]
    change = f" {' '.join(filter(None, changes))}" if any(changes) else ""
    if not len(mesh):
        return f"{doubt}These lines show no mesh harmonic, but orders of the shafts below the mesh order."
    if not len(sure):
        return (
            f"{doubt}No mesh harmonic stands clear of the marks: run the shafts free, or turn a disc, and give those "
            f"runs.{change}"
        )
    first = sure.iloc[0]
    open_ones = int((~mesh["calibrated"]).sum())
    rest = (
        f"; {open_ones} of {len(mesh)} harmonics have the interval that marks leave, which only runs that differ "
        "take away"
        if open_ones
        else ""
    )
    return (
        f"{doubt}Mesh harmonic {int(first['harmonic'])} of the transmission error{at} is "
        f"{_with_interval(first)}{rest}.{change}"
    )


def _change(result: Any, load: str) -> str | None:
    """Return what the marks are no part of: the largest harmonic of a load's difference from the first."""
    table = result.difference(load, result.loads[0])
    sure = table[table["low"] > 0.0]
    if not len(sure):
        return None
    most = sure.loc[sure["amplitude"].idxmax()]
    return f"From {result.loads[0]} to {load} harmonic {int(most['harmonic'])} changes by {_with_interval(most)}."


def _with_interval(row: pd.Series) -> str:
    return f"{1e6 * row['amplitude']:.4g} um ({1e6 * row['low']:.4g} to {1e6 * row['high']:.4g} um)"


def markdown_of(result: Any) -> str:
    """Return the report as Markdown text, lengths in micrometres."""
    parts = [
        f"# Transmission error from {result.source}", "",
        f"- Driver {result.speed * 30.0 / math.pi:.1f} rpm, ratio {result.gearing.ratio}, mesh order "
        f"{float(result.gearing.mesh):g}; lag of the driven shaft on the driver's base circle of "
        f"{1e3 * result.radius:.4g} mm",
        f"- Encoders of {' and '.join(map(str, result.lines_of))} lines; intervals of {100 * result.probability:g} %",
        *(f"- {note}" for note in result.notes), "",
        f"**{result.verdict}**",
    ]  # fmt: skip
    if result.teeth is not None and result.short is not None:
        parts += ["", result.short]
    for load in result.loads:
        title = f" ({load})" if len(result.loads) > 1 else ""
        parts += ["", f"## Mesh harmonics, peak amplitudes in um{title}", "", _micro(result.harmonics(load))]
        parts += ["", _lengths_in_words(result, load)]
        parts += ["", f"## Single-flank values, um{title}", "", _micro(result.single_flank(load))]
        lacking = unseen_in_words(result, load)
        parts += [] if lacking is None else ["", lacking]
        for shaft in SHAFTS if result.teeth is not None else ():
            teeth = result.tooth_errors(shaft, load)
            out = teeth[teeth["stands_out"]]
            words = ", ".join(f"{t} ({1e6 * e:+.2f} um)" for t, e in zip(out["tooth"], out["deviation"]))
            within = 1e6 * float(teeth["within"].iloc[0])
            at = SHAFTS.index(shaft)
            zero = "mark 0" if result.referenced[at] else "the first pulse"
            counted = f", 0 being the one in mesh at {zero} and 1 the next to mesh" * (result.tooth_at_zero[at] is None)
            parts += [
                "",
                f"Teeth of the {shaft} that stand out{title}{counted if words else ''}: {words or 'none'} "
                f"(known to {within:.2g} um).",
            ]
    for load in result.loads[1:]:
        title = f"## Mesh harmonics of the difference {load} - {result.loads[0]}, peak amplitudes in um"
        parts += ["", title, "", _micro(result.difference(load, result.loads[0]))]
    if result.refused:
        parts += ["", "## What these encoders cannot show", "", *(f"- {text}" for text in result.refused)]
    return "\n".join(parts)


def _lengths_in_words(result: Any, load: str) -> str:
    """Return which harmonics are known to what was asked, and what the others take."""
    table = result.record_lengths(load=load)
    if not len(table):
        return "No mesh harmonic is seen."
    known, unseen = table[table["known"]], table[~table["seen"]]
    rest = table[table["seen"] & ~table["known"]]
    marks, short = rest[np.isinf(rest["times"])], rest[np.isfinite(rest["times"])]
    words = [f"Known to {100 * result.accuracy:g} %: {_listed(known['harmonic']) if len(known) else 'no harmonic'}."]
    if len(short):
        each = [
            f"{r.harmonic} (to {100 * r.reach:.2g} %) takes {_rounded(r.times)} times the record, "
            f"{_rounded(r.seconds)} s in mesh"
            for r in short.itertuples()
        ]
        more = f" and {len(each) - LISTED} more, see record_lengths" if len(each) > LISTED else ""
        free = ", and as many times the free runs" if any(result.freed.values()) else ""
        words.append(f"Harmonic {'; '.join(each[:LISTED])}{more}{free}.")
    if len(marks):
        words.append(f"No length is enough for {_listed(marks['harmonic'])}: the marks are unknown.")
    if len(unseen):
        words.append(f"Not clear of the noise: {_listed(unseen['harmonic'])}.")
    return " ".join(words)


def _listed(harmonics: Iterable[int]) -> str:
    """Return whole numbers in words, neighbours together."""
    runs: list[list[int]] = []
    for h in harmonics:
        if runs and h == runs[-1][-1] + 1:
            runs[-1].append(h)
        else:
            runs.append([h])
    return ", ".join(str(r[0]) if len(r) == 1 else f"{r[0]}{' to ' if len(r) > 2 else ', '}{r[-1]}" for r in runs)


def _rounded(value: float) -> str:
    """Return a number with two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):g}" if value < 1e6 else f"{value:.1e}"


def _micro(table: pd.DataFrame) -> str:
    """Return a table in Markdown with lengths in micrometres."""
    out = table.copy()
    for column in out.columns.intersection(["amplitude", "low", "high", "F_i", "f_i", "f_l", "f_k", "within"]):
        out[column] = [f"{1e6 * value:.4g}" for value in out[column]]
    if "phase" in out:
        out["phase"] = out["phase"].round(3)
    return markdown_table(list(out.columns), out.to_numpy().tolist())
