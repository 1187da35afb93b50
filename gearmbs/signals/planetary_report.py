"""What was found of a planetary set in a record, as data, tables and words."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from gearmbs._shown import Shown

from .planetary_lines import PLANET, PlanetaryLines
from .report import markdown_table


@dataclass(frozen=True, eq=False)
class PlanetaryFinding:
    """Evidence for a faulty tooth of one part in one channel.

    Attributes
    ----------
    part : {"sun", "planet", "ring"}
    channel : str
    kinematic, found : float
        Hz: how often a faulty tooth meets a mate, by the teeth, and where the record shows it best.
    share : float
        RMS of what was judged, by that of the record.
    peak : float
        Energy of the strongest place of the part's turn, by the mean.
    deviation : float
        How far that is above peaks by chance, in standard deviations of their logarithm.
    profile : ndarray
        Energy over a turn of the part, two places a tooth, 1 on the average.
    planet : int, optional
        Which planet, from 1, as far as the sensor's place tells it.
    grade : {"clear", "signs", "none"}
    """

    part: str
    channel: str
    kinematic: float
    found: float
    share: float
    peak: float
    deviation: float
    profile: np.ndarray
    planet: int | None = None
    grade: str = "none"

    def sentence(self) -> str:
        """Return what it means, with its grounds."""
        whose = f"planet {self.planet}" if self.part == PLANET and self.planet else f"the {self.part}"
        whose = "a planet" if whose == "the planet" else whose
        strength = "Clear lines" if self.grade == "clear" else "Signs"
        return (
            f"{strength} of a faulty tooth of {whose} in channel {self.channel}: {self.found:.3f} Hz, "
            f"{self.peak:.1f} times the mean energy at one place of its turn, {self.deviation:.1f} standard deviations "
            f"above what chance makes of this record; {20 * math.log10(max(self.share, 1e-15)):.0f} dB of the whole."
        )


@dataclass(eq=False)
class PlanetaryReport(Shown):
    """What was found of a planetary set in one record.

    Attributes
    ----------
    source : str
    rate, duration, carrier : float
        Sampling rate (Hz), length (s), turns of the carrier a second.
    turns : int
        Whole turns of the carrier that were used.
    lines : PlanetaryLines
    findings : list of PlanetaryFinding
        Sun, planets and ring in all channels.
    notes : list of str
    """

    source: str
    rate: float
    duration: float
    carrier: float
    turns: int
    lines: PlanetaryLines
    findings: list[PlanetaryFinding]
    notes: list[str] = field(default_factory=list)

    @property
    def accused(self) -> list[PlanetaryFinding]:
        """Findings that name a part, the strongest first."""
        named = [f for f in self.findings if f.grade != "none"]
        return sorted(named, key=lambda f: (f.grade != "clear", -f.deviation))

    @property
    def fault(self) -> str | None:
        """Part of the strongest finding: "sun", "planet 2", "planet", "ring"; None without."""
        if not self.accused:
            return None
        first = self.accused[0]
        return f"planet {first.planet}" if first.part == PLANET and first.planet else first.part

    @property
    def verdict(self) -> str:
        """What the record says of the set, in words with grounds."""
        if not self.accused:
            return "No lines of a faulty tooth of sun, planets or ring stand out. Wear of all teeth alike shows none."
        return " ".join(finding.sentence() for finding in self.accused)

    def tables(self) -> dict[str, pd.DataFrame]:
        """The numbers as tables: planetary_evidence, planetary_lines."""
        rows = [
            (f.channel, f.part, f.planet, f.kinematic, f.found, f.share, f.peak, f.deviation, f.grade)
            for f in self.findings
        ]
        columns = ["channel", "part", "planet", "kinematic", "found", "share", "peak", "deviation", "grade"]
        return {
            "planetary_evidence": pd.DataFrame(rows, columns=columns),
            "planetary_lines": self.lines.table(self.carrier),
        }

    def to_frame(self) -> pd.DataFrame:
        """Return one flat row: peak and deviation of each part in each channel, the verdict and the fault."""
        row: dict[str, object] = {"source": self.source, "carrier": self.carrier, "fault": self.fault}
        for f in self.findings:
            row[f"{f.channel}_{f.part}_peak"], row[f"{f.channel}_{f.part}_deviation"] = f.peak, f.deviation
        return pd.DataFrame([row])

    def to_markdown(self) -> str:
        """The report as Markdown text."""
        sun, own, ring = self.lines.teeth
        evidence = [
            [
                f.channel, f.part + (f" {f.planet}" if f.planet and f.grade != "none" else ""), f"{f.kinematic:.3f}",
                f"{f.found:.3f}", f"{20 * math.log10(max(f.share, 1e-15)):.0f}", f"{f.peak:.1f}", f"{f.deviation:.1f}",
                f.grade,
            ]
            for f in self.findings
        ]  # fmt: skip
        head = ["channel", "faulty tooth of", "kinematic Hz", "found Hz", "share dB", "peak", "deviations", "verdict"]
        table = self.lines.table(self.carrier)
        known = [[part, *(f"{f:.3f}" for f in group["frequency"])] for part, group in table.groupby("part", sort=False)]
        return "\n".join(
            [
                f"# Planetary set in {self.source}",
                "",
                f"- Record: {self.duration:.3f} s at {self.rate:g} Hz",
                f"- Teeth: sun {sun}, {self.lines.planets} planets of {own}, ring {ring}, at rest",
                f"- Carrier: {60 * self.carrier:.3f} rpm, {self.turns} turns",
                *(f"- {note}" for note in self.notes),
                "",
                f"**{self.verdict}**",
                "",
                "## Evidence",
                "",
                markdown_table(head, evidence),
                "",
                "## Kinematic lines, Hz",
                "",
                markdown_table(["line", "1 x", "2 x", "3 x"], known),
            ]
        )

    def _repr_markdown_(self) -> str:
        return self.to_markdown()

    def __repr__(self) -> str:
        return f"<PlanetaryReport of {self.source!r}: {self.verdict}>"
