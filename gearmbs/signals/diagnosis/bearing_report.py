"""What was found of rolling bearings in a record, as data, tables and words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from gearmbs._display import Shown
from gearmbs.signals.analysis.report import markdown_table, significant
from gearmbs.signals.errors import SignalError

# Kinematic lines of a rolling bearing: what a measurement needs to know of it.


OUTER, INNER, ELEMENT, CAGE = "outer race", "inner race", "rolling element", "cage"


@dataclass(frozen=True)
class BearingLines:
    """Frequencies of a bearing by turns of its shaft, the outer ring at rest.

    Attributes
    ----------
    name : str
    ftf, bsf, bpfo, bpfi : float
        Cage, spin of an element, passes of elements over a point of the outer and of the inner ring.
    ratio : float
        Speed of the bearing's shaft by the speed that is given.
    """

    name: str
    ftf: float
    bsf: float
    bpfo: float
    bpfi: float
    ratio: float = 1.0

    def __post_init__(self) -> None:
        for name in ("ftf", "bsf", "bpfo", "bpfi", "ratio"):
            value = getattr(self, name)
            if not (isinstance(value, (int, float)) and 0.0 < value < 1e4):
                raise SignalError(f"bearing {self.name!r}: {name} must be a positive number, got {value!r}")

    @property
    def orders(self) -> dict[str, float]:
        """Order of the fundamental line of each part: a defect of an element strikes twice a turn of its own."""
        return {OUTER: self.bpfo, INNER: self.bpfi, ELEMENT: 2.0 * self.bsf, CAGE: self.ftf}

    @property
    def sidebands(self) -> dict[str, float]:
        """Order of the spacing of each part's sidebands: how often it passes the load; 0 where it stands still."""
        return {OUTER: 0.0, INNER: 1.0, ELEMENT: self.ftf, CAGE: 0.0}

    def table(self, shaft: float, harmonics: int = 3) -> pd.DataFrame:
        """Return the kinematic lines at a shaft frequency in Hz: part, harmonic, Hz, spacing of sidebands."""
        turns = shaft * self.ratio
        rows = [
            (self.name, part, k, k * order * turns, self.sidebands[part] * turns)
            for part, order in self.orders.items()
            for k in range(1, harmonics + 1)
        ]
        return pd.DataFrame(rows, columns=["bearing", "part", "harmonic", "frequency", "sideband_spacing"])


def bearing_lines(bearing: Any, ratio: float = 1.0) -> BearingLines:
    """Return the lines of a bearing in whatever shape it is given.

    Parameters
    ----------
    bearing : BearingLines, Bearing, str or mapping
        A `gearmbs.bearings.Bearing`; its designation; or the multiples by name, FTF, BSF, BPFO and BPFI.
    ratio : float
        Speed of its shaft by the speed of the record.

    Raises
    ------
    SignalError
        If it cannot be read, or the designation is unknown; the message says what is missing.
    """
    if isinstance(bearing, BearingLines):
        return bearing
    if isinstance(bearing, str):
        from gearmbs.bearings import Bearing, BearingError

        try:
            bearing = Bearing.from_designation(bearing)
        except BearingError as error:
            raise SignalError(f"bearing: {error}") from None
    if isinstance(bearing, Mapping):
        given = {str(key).lower(): value for key, value in bearing.items()}
        missing = [name.upper() for name in ("ftf", "bsf", "bpfo", "bpfi") if name not in given]
        if missing:
            raise SignalError(
                f"bearing: {', '.join(missing)} missing; give FTF, BSF, BPFO and BPFI by turns of the shaft"
            )
        numbers = {name: float(given[name]) for name in ("ftf", "bsf", "bpfo", "bpfi")}
        return BearingLines(str(given.get("name", "bearing")), **numbers, ratio=ratio)
    try:
        name = bearing.designation or bearing.kind
        return BearingLines(name, bearing.ftf, bearing.bsf, bearing.bpfo, bearing.bpfi, ratio)
    except AttributeError:
        raise SignalError(
            f"bearing: {bearing!r} is none; give a designation such as '6205', a Bearing, or its multiples by name"
        ) from None


WORDS = {
    "outer race": "the outer race",
    "inner race": "the inner race",
    "rolling element": "a rolling element",
    "cage": "a rolling element or the cage",
}
SHOWN = 4
NOT_CERTAIN = ("uncertain", "shifted", "smooth")
"""Grades of lines that accuse no part and acquit none."""
MOST_OFF = 0.1
"""Share beyond which no speed is off by slip or load: a told one is looked for within 6.5 %."""
ENOUGH_TURNS = 60
"""Turns below which an acquittal says that it is of a short record: blows that four of four records of 40 turns show
one of four of 30 turns does."""


@dataclass(frozen=True)
class PartFinding:
    """Evidence for one part of one bearing in one channel.

    Attributes
    ----------
    bearing, part, channel : str
    kinematic, found : float
        Hz: where the fundamental should be and where the lines are that fit best.
    ratios : tuple of float
        Power of each harmonic by the mean power round it.
    log_chance : float
        Decimal logarithm of the probability of such lines by chance.
    sidebands : float
        Power of the first sidebands by that of the line; NaN for parts that have none.
    where : str
        Band in which they are clearest.
    grade : {"clear", "signs", "open", "faint", "multiples", "uncertain", "shifted", "quiet", "smooth", "none"}
        "open": lines that may also be another shaft's; "faint": hardly above noise, but as strong at no other place of
        the record; "multiples": no noise, and as strong at no other place, but without the fundamental; "uncertain":
        named at some of the speeds that the record leaves open, while at others another part is or none; "shifted":
        where they would be if the told speed were wrong; "quiet": as sound bearings make them, too; "smooth": without
        the harmonics of blows. None of these accuses.
    beside : bool
        Whether there are lines, but another part, or another cause, explains more of them.
    stronger, places : int
        At how many of the other places of the record a family of lines stands as strong, and how many places there are.
    fraction : (int, int), optional
        (k, m) if the lines are k/m of the shaft's turns and the other multiples of 1/m comparably strong.
    needed : float, optional
        If the level of the fundamental could not be measured, as it lies on a known shaft's line or at the lower end
        of the spectrum: the length of record that tells them apart, s; infinite if none does.
    modulated : float
        RMS, m/s^2, of what the lines modulate far above their own rate; NaN of parts that are not named, and of
        channels that are no acceleration.
    multiple : int, optional
        m if a family of m turns of the shaft stands where the part's lines would be.
    """

    bearing: str
    part: str
    channel: str
    kinematic: float
    found: float
    ratios: tuple[float, ...]
    log_chance: float
    sidebands: float
    where: str
    grade: str = "none"
    beside: bool = False
    stronger: int = 0
    places: int = 0
    fraction: tuple[int, int] | None = None
    needed: float | None = None
    modulated: float = math.nan
    multiple: int | None = None

    @property
    def slip(self) -> float:
        """found/kinematic - 1."""
        return self.found / self.kinematic - 1.0

    @property
    def level(self) -> float:
        """Level of the fundamental over its neighbourhood, dB; NaN if it could not be measured."""
        if self.needed is not None or not self.ratios:
            return math.nan
        return 10.0 * math.log10(max(self.ratios[0], 1e-3))

    def sentence(self) -> str:
        """Return what it means, with its grounds."""
        strength = "Clear lines" if self.grade == "clear" else "Signs"
        heard = sum(r >= 10.0 for r in self.ratios)
        text = (
            f"{strength} such as a defect of {WORDS[self.part]} of bearing {self.bearing} makes, in channel "
            f"{self.channel}: "
            f"{self.found:.2f} Hz, {100 * self.slip:+.2f} % beside the kinematic {self.kinematic:.2f} Hz, "
            f"{self.level:.0f} dB above its neighbourhood, {heard} of {len(self.ratios)} harmonics "
            f"({self.where}); in noise with a probability of {_chance(self.log_chance)}, and families as strong "
            f"stand at {self.stronger} of {self.places} other places"
        )
        if self.part in ("inner race", ELEMENT) and self.sidebands > 0.1:
            kind = "the shaft's turns, as an inner race has them" if self.part != ELEMENT else "the cage's turns"
            text += f"; sidebands at {kind}"
        return text + "."

    def remark(self) -> str | None:
        """Return what is to be told of lines that accuse nothing, if there is anything."""
        place = f"in channel {self.channel}"
        if self.grade == "open":
            return (
                f"A modulation at {self.found:.2f} Hz {place} is where the cage of bearing {self.bearing} turns "
                f"({self.kinematic:.2f} Hz), but so might another shaft, or a mating wheel: say which shafts there are "
                "(shafts=, --shaft) to have it judged."
            )
        if self.grade == "faint":
            return (
                f"A faint line at {self.found:.2f} Hz {place} is {100 * self.slip:+.2f} % beside that of "
                f"{WORDS[self.part]} of bearing {self.bearing} and stronger than at {self.places} other places, but "
                f"noise has such with a probability of {_chance(self.log_chance)}: take a longer record."
            )
        if self.grade == "multiples":
            return (
                f"Multiples of {self.found:.2f} Hz {place} stand out as those of {WORDS[self.part]} of bearing "
                f"{self.bearing} ({self.kinematic:.2f} Hz) do, in noise with a probability of "
                f"{_chance(self.log_chance)}, but {self.found:.2f} Hz itself does not, or is a known shaft's line: "
                "they name no part; another band (band=, --band), direction or speed may show it."
            )
        if self.grade == "uncertain":
            return (
                f"Not certain: lines at {self.found:.2f} Hz {place} are those of {WORDS[self.part]} of bearing "
                f"{self.bearing} at some of the speeds that the record leaves open, at others they are another part's "
                "or none's. Give a tacho, a measured speed (speed=, --speed; tolerance=0, --speed-tolerance 0 if it is "
                "exact) or a longer record."
            )
        if self.grade == "shifted" and abs(self.slip) > MOST_OFF:
            return (
                f"CHECK THE RATE: clear lines at {self.found:.2f} Hz {place} are those of {WORDS[self.part]} of "
                f"bearing {self.bearing} ({self.kinematic:.2f} Hz) if the sampling rate is told {1.0 + self.slip:.3g} "
                "times as high as it is, or the shaft turns so many times as fast as told. Not certain: look up the "
                "rate (rate=, --rate), or give a tacho of the same record."
            )
        if self.grade == "shifted":
            return (
                f"CHECK THE SPEED: clear lines at {self.found:.2f} Hz {place} are those of {WORDS[self.part]} of "
                f"bearing {self.bearing} ({self.kinematic:.2f} Hz) if the shaft turns {100 * abs(self.slip):.1f} % "
                f"{'faster' if self.slip > 0.0 else 'slower'} than told, and no family of its orders stands out. Not "
                "certain: give a tacho or a measured speed (speed=, --speed)."
            )
        if self.grade == "quiet":
            kind = "the stiffness that varies as elements pass through the load" if self.part == OUTER else "waves"
            return (
                f"Lines of {WORDS[self.part]} of bearing {self.bearing} stand {place} at {self.found:.2f} Hz, but what "
                f"they modulate is quiet, {self.modulated:.2g} m/s^2: a sound bearing makes as much by {kind}, and "
                "they name no part."
            )
        if self.grade == "smooth":
            return (
                f"Not certain: a modulation at {self.found:.2f} Hz {place} is where that by {WORDS[self.part]} of "
                f"bearing {self.bearing} would be ({self.kinematic:.2f} Hz), but without the harmonics of blows: fans, "
                "pumps and pulsating torques make such, too, or noise hides the harmonics. A longer record, another "
                "band (band=, --band), load or speed may show them."
            )
        if self.multiple is not None:
            return (
                f"Lines {place} at {self.multiple} times the shaft's turns, near those of {WORDS[self.part]} of "
                f"bearing {self.bearing} ({self.kinematic:.2f} Hz), are such as blades, the jaws of a coupling or a "
                "loose fit make; they name no part."
            )
        if self.fraction is not None:
            k, m = self.fraction
            return (
                f"Lines at {self.found:.2f} Hz {place}, near those of {WORDS[self.part]} of bearing {self.bearing} "
                f"({self.kinematic:.2f} Hz), are {k}/{m} of the shaft's turns, and other multiples of 1/{m} of these "
                "stand beside them: something is loose, or the cage runs in step with the shaft, and they name no part."
            )
        return None


def _chance(log_chance: float) -> str:
    return f"1e{log_chance:.0f}" if log_chance > -300 else "less than 1e-300"


@dataclass
class BearingReport(Shown):
    """What was found of bearings in one record.

    Attributes
    ----------
    source : str
    rate, duration, shaft : float
        Sampling rate (Hz), length (s), turns of the shaft a second.
    bearings : tuple of BearingLines
    findings : list of PartFinding
        All parts of all bearings in all channels.
    bands : dict
        Band in Hz by channel: the kurtogram's or the one given.
    spectra : dict of DataFrame
        Squared envelope spectrum by channel, that with the clearest lines: ``frequency`` and ``power`` by its
        neighbourhood, mean 1 in noise.
    levels : DataFrame
        RMS, crest factor and kurtosis by channel.
    shafts : tuple of float, optional
        Ratios of the other shafts; None: not known.
    notes : list of str
    stability : DataFrame
        What would be named of speeds told within the tolerance: told and used turns (Hz), whether these were found in
        the record, bearing, part and grade.
    speed_remark : str, optional
        What is wrong with the told speed.
    swept : list of str
        What is said where one speed is told and the lines of the record move.
    """

    source: str
    rate: float
    duration: float
    shaft: float
    bearings: tuple[BearingLines, ...]
    findings: list[PartFinding]
    bands: dict[str, tuple[float, float]]
    spectra: dict[str, pd.DataFrame]
    levels: pd.DataFrame
    shafts: tuple[float, ...] | None = None
    notes: list[str] = field(default_factory=list)
    stability: pd.DataFrame = field(default_factory=pd.DataFrame)
    speed_remark: str | None = None
    swept: list[str] = field(default_factory=list)

    @property
    def accused(self) -> list[PartFinding]:
        """Findings that name a part, the strongest first; a cage, whose turns also an element shows, last."""
        named = [f for f in self.findings if f.grade in ("clear", "signs")]
        return sorted(named, key=lambda f: (f.grade != "clear", f.part == CAGE, f.log_chance))

    @property
    def fault(self) -> str | None:
        """Part of the strongest finding: "outer race", "inner race", "rolling element", "cage"; None without."""
        return self.accused[0].part if self.accused else None

    @property
    def clear(self) -> bool:
        """Whether the strongest finding is clear, and not only a sign."""
        return bool(self.accused) and self.accused[0].grade == "clear"

    @property
    def verdict(self) -> str:
        """What the record says of the bearings, in words with grounds."""
        if not self.accused:
            names = " and ".join(lines.name for lines in self.bearings)
            if self.swept or any(finding.grade in NOT_CERTAIN for finding in self.findings):
                return " ".join([f"No part of bearing {names} is named for certain.{self._limits()}", *self.remarks])
            return (
                f"No lines of a defect of bearing {names} stand out. A defect of a rolling element often shows none, "
                "and an old, spread one may have lost its lines: this acquits the races of a fresh local defect only."
                + self._limits()
                + "".join(f" {remark}" for remark in self.remarks)
            )
        parts = [finding.sentence() for finding in self.accused]
        if self.accused[0].part == CAGE:
            parts.append(
                "Modulation at the cage's turns comes from the cage, elements that differ, or a shaft as fast."
            )
        return " ".join([*parts, *self.remarks])

    @property
    def speed_found(self) -> bool:
        """Whether a family of the shaft's orders told the speed that was used."""
        return len(self.stability) > 0 and bool(self.stability["found"].iloc[len(self.stability) // 2])

    @property
    def remarks(self) -> list[str]:
        """What stands in the record but accuses nothing, in words."""
        found = [remark for finding in self.findings if (remark := finding.remark()) is not None]
        return [*self.swept, *([] if self.speed_remark is None else [self.speed_remark]), *found]

    def _limits(self) -> str:
        """Return what limits an acquittal: few turns, and speeds at which nothing stands out if none is told."""
        turns, words = self.duration * self.shaft, ""
        if turns < ENOUGH_TURNS:
            words = (
                f" The record has {turns:.0f} turns, in which only strong lines stand out: take {ENOUGH_TURNS} or "
                f"more, {ENOUGH_TURNS / self.shaft:.2g} s."
            )
        if len(self.stability) < 2 or self.speed_found:
            return words
        low, told, high = (self.stability["told"].iloc[k] for k in (0, len(self.stability) // 2, -1))
        return (
            f"{words} No family of the shaft's orders tells its speed: this holds for speeds of {60 * low:.1f} to "
            f"{60 * high:.1f} rpm, +-{100 * (high / told - 1.0):.2g} % of the told one."
        )

    def tables(self) -> dict[str, pd.DataFrame]:
        """The numbers as tables: bearing_evidence, bearing_lines, bearing_levels, bearing_stability."""
        rows = [
            (f.bearing, f.channel, f.part, f.kinematic, f.found, 100 * f.slip, f.level, f.log_chance, f.sidebands,
             f.where, f.stronger, f.places, f.modulated, "beside" if f.beside else f.grade)
            for f in self.findings
        ]  # fmt: skip
        columns = ["bearing", "channel", "part", "kinematic", "found", "slip_percent", "level_db", "log10_chance",
                   "sidebands", "where", "stronger", "places", "modulated", "grade"]  # fmt: skip
        kinematic = pd.concat([lines.table(self.shaft) for lines in self.bearings], ignore_index=True)
        return {
            "bearing_evidence": pd.DataFrame(rows, columns=columns),
            "bearing_lines": kinematic,
            "bearing_levels": self.levels,
            "bearing_stability": self.stability,
        }

    def to_markdown(self) -> str:
        """The report as Markdown text."""
        parts = [
            f"# Bearings in {self.source}",
            "",
            f"- Record: {', '.join(self.bands)}; {self.duration:.3f} s at {self.rate:g} Hz",
            f"- Shaft: {60 * self.shaft:.1f} rpm ({self.shaft:.4f} Hz){self._speed_source()}",
            *(f"- {line}" for line in self._margin()),
            *(f"- Band for {name}: {low:.0f} to {high:.0f} Hz" for name, (low, high) in self.bands.items()),
            *(f"- {note}" for note in self.notes),
            "",
            f"**{self.verdict}**",
            "",
            "## Evidence",
            "",
            self._evidence(),
            "",
            *self._unmeasured(),
            "## Kinematic lines",
            "",
            self._lines(),
            "",
            "## Levels",
            "",
            markdown_table(
                ["channel", "RMS", "crest factor", "kurtosis"],
                [
                    [
                        f"{r.channel} [{r.units}]",
                        significant(r.rms),
                        significant(r.crest, 3),
                        significant(r.kurtosis, 3),
                    ]
                    for r in self.levels.itertuples()
                ],
            ),
        ]
        return "\n".join(parts)

    def _speed_source(self) -> str:
        """Return where the speed comes from, if it was looked for."""
        if len(self.stability) < 2:
            return ""
        told = self.stability.iloc[len(self.stability) // 2]
        if not self.speed_found:
            return ", as told: no family of its orders stands out near it"
        off = told["used"] / told["told"] - 1.0
        return f", from a family of its orders; told were {60 * told['told']:.1f} rpm, {100 * -off:+.2f} % beside"

    def _margin(self) -> list[str]:
        """Return for which told speeds the answer is the same, and what it would be at the others."""
        if len(self.stability) < 2:
            return []
        table = self.stability
        answers = [
            "none" if pd.isna(part) else f"{part} of {bearing}" for bearing, part in zip(table.bearing, table.part)
        ]
        own = answers[len(answers) // 2]
        others = [
            f"at {60 * told:.1f} rpm {answer}"
            for told, answer in zip(table.told, answers, strict=True)
            if answer != own
        ]
        low, high = 60 * table.told.iloc[0], 60 * table.told.iloc[-1]
        span = f"told speeds of {low:.1f} to {high:.1f} rpm"
        if not others:
            return [f"Margin: the answer is the same for {span}"]
        return [f"Margin: of {span} the part named first is {own}, but {'; '.join(others)}"]

    def _evidence(self) -> str:
        head = [
            "bearing",
            "channel",
            "part",
            "kinematic Hz",
            "found Hz",
            "slip %",
            "dB",
            "chance",
            "as strong",
            "verdict",
        ]
        shown = [
            [
                f.bearing, f.channel, f.part, f"{f.kinematic:.2f}", f"{f.found:.2f}", f"{100 * f.slip:+.2f}",
                "-" if math.isnan(f.level) else f"{f.level:.0f}", _chance(f.log_chance), f"{f.stronger} of {f.places}",
                "lines of another cause" if f.beside else f.grade,
            ]
            for f in self.findings
        ]  # fmt: skip
        return markdown_table(head, shown)

    def _unmeasured(self) -> list[str]:
        """Return for what lines there is no level, and which record would have it."""
        wanting: dict[tuple[str, str], float] = {}
        for f in self.findings:
            if f.needed is not None:
                key = f.bearing, f.part
                wanting[key] = max(f.needed, wanting.get(key, 0.0))
        if not wanting:
            return []
        words = [
            f"{part} of {bearing}: "
            + (f"{math.ceil(10.0 * s) / 10.0:.1f} s are needed" if math.isfinite(s) else "no length tells them apart")
            for (bearing, part), s in wanting.items()
        ]
        reason = "No level (-) where a line is not told from a known shaft's, or from the mean, in a record of"
        return [f"{reason} {self.duration:.2f} s. {'; '.join(words)}.", ""]

    def _lines(self) -> str:
        table = pd.concat([lines.table(self.shaft, SHOWN) for lines in self.bearings], ignore_index=True)
        rows = []
        for (bearing, part), group in table.groupby(["bearing", "part"], sort=False):
            spacing = group["sideband_spacing"].iloc[0]
            sides = f"{spacing:.2f}" if spacing else "-"
            rows.append([bearing, part, *(f"{f:.2f}" for f in group["frequency"]), sides])
        return markdown_table(["bearing", "part", *(f"{k} x" for k in range(1, SHOWN + 1)), "sidebands, Hz"], rows)

    def _repr_markdown_(self) -> str:
        return self.to_markdown()

    def __repr__(self) -> str:
        return f"<BearingReport of {self.source!r}: {self.verdict}>"
