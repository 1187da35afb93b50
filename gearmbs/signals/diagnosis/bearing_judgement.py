"""Which parts of a bearing the lines of a record accuse, and which lines have other causes.

That lines are no noise does not make them a bearing's: other shafts, gears and machines have families of lines, too,
and some of them lie where a bearing's would. So a part is named only if

* its lines are no noise, the number of parts and channels looked at considered;
* they are left when those of known shafts are taken out: multiples of each shaft and sums of these, to which all lines
  of a pair of gears and its sidebands belong in an envelope;
* hardly any other place of the record holds a family as strong: the orders from a third of a turn to beyond the highest
  line are looked at in windows as wide as slip makes the part's own. The share of places that beat it is the
  probability with which a family of any other cause would have been taken for the part;
* they are not just every second to sixth line of a slower family, nor the cage's multiple among its neighbours;
* they are not just some of the multiples of a half to a sixth of the shaft's turns. Loose parts answer every second to
  sixth turn only, and a cage may fall in step: at 2/5 of the turns an outer race with nine elements is passed 18/5
  times a turn, near its kinematic 3.58.

The strongest part is named first; its lines and sidebands are then taken out, and the rest is judged again.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.fft

from gearmbs.signals.diagnosis.bearing_report import CAGE, ELEMENT, OUTER, BearingLines

# How clearly the lines of a bearing stand in a spectrum of a squared envelope.
#
# Without a defect the envelope of a record is noise, and the power r at a line, by the mean power round it, is
# exponentially distributed. The sum over K harmonics of one frequency f, the same for all, then has a gamma
# distribution; its largest value over all f that slip allows is exceeded by chance with the probability
#
#     p = N P(gamma_K > max_f sum_k r(k f)),
#
# N being the number of independent frequencies looked at. The mean over several bands scatters less than that: there p
# is an upper limit.


HARMONICS = 4
SLIP = 0.015
"""Share by which a line may lie beside its kinematic place."""
AROUND = 0.4
"""Width of the neighbourhood that gives the mean power, in shaft turns."""
LEAST_BINS = 51
LINE_BINS = 2.5
"""Half width of what belongs to a line, in lines of the spectrum: the main lobe of a Hann window has two."""
LOWEST = 3
"""Lines at the bottom of a spectrum that the removed mean touches."""


@dataclass(frozen=True, eq=False)
class EnvelopeSpectrum:
    """Power of a squared envelope by its neighbourhood.

    Attributes
    ----------
    step : float
        Distance of its lines, Hz.
    ratio : ndarray, shape (m,)
        Power at k step by the mean power round it; 1 where it is not to count.
    where : str
        Which part of the record it shows, for reports.
    """

    step: float
    ratio: np.ndarray
    where: str = ""

    @classmethod
    def of(cls, power: np.ndarray, step: float, turns: float, where: str = "") -> EnvelopeSpectrum:
        """Return a spectrum by its neighbourhood, medians of which are not raised by single lines.

        Parameters
        ----------
        power : ndarray, shape (m,)
            Of the squared envelope, or the mean of several by their neighbourhoods.
        step : float
            Hz.
        turns : float
            Of the shaft, Hz.
        """
        width = min(max(round(AROUND * turns / step), LEAST_BINS), power.size)
        count = max(power.size // width, 1)
        blocks = power[: count * width].reshape(count, width)
        middle = (np.arange(count) + 0.5) * width - 0.5
        medians = np.median(blocks, axis=1) / math.log(2.0)
        level = np.interp(np.arange(power.size), middle, np.maximum(medians, 1e-300))
        return cls(step, power / level, where)

    @property
    def frequency(self) -> np.ndarray:
        """Hz, shape (m,)."""
        return self.step * np.arange(self.ratio.size)

    @property
    def top(self) -> float:
        """Highest frequency, Hz."""
        return self.step * (self.ratio.size - 1)

    def without(self, lines: Iterable[float], share: float) -> EnvelopeSpectrum:
        """Return the spectrum in which some lines do not count, nor what is within a share of them."""
        ratio = self.ratio.copy()
        for line in lines:
            half = LINE_BINS * self.step + share * line
            first, last = math.ceil((line - half) / self.step), math.floor((line + half) / self.step)
            if last >= 0 and first < ratio.size:
                ratio[max(first, 0) : last + 1] = 1.0
        return replace(self, ratio=ratio)


@dataclass(frozen=True)
class Evidence:
    """What was found of one family of lines.

    Attributes
    ----------
    kinematic, found : float
        Hz: where the fundamental should be, and where the lines are that fit best.
    ratios : tuple of float
        Power of each harmonic by the mean power round it.
    log_chance : float
        Decimal logarithm of the probability of such a family by chance.
    where : str
        The spectrum.
    """

    kinematic: float
    found: float
    ratios: tuple[float, ...]
    log_chance: float
    where: str = ""


def find_lines(
    spectrum: EnvelopeSpectrum,
    line: float,
    *,
    slip: float = SLIP,
    harmonics: int = HARMONICS,
) -> Evidence:
    """Return the evidence for a family of lines.

    Parameters
    ----------
    spectrum : EnvelopeSpectrum
    line : float
        Kinematic fundamental, Hz.
    slip : float
        Share that the fundamental may lie off.
    harmonics : int
        How many harmonics count.
    """
    step, size = spectrum.step, spectrum.ratio.size
    fits = [k for k in range(1, harmonics + 1) if round(k * line * (1 + slip) / step) < size]
    if not fits:
        return Evidence(line, line, (), 0.0, spectrum.where)
    spacing = step / (2.0 * fits[-1])
    half = max(slip * line, spacing)
    candidates = np.linspace(line - half, line + half, 2 * int(half / spacing) + 1)
    ratios = np.stack([ratio_at(spectrum, k * candidates) for k in fits])
    trials = max(1.0, 2.0 * half / step * sum(fits) / len(fits))
    total = ratios.sum(axis=0)
    best = int(np.argmax(total))
    chance = log_tail(float(total[best]), len(fits)) + math.log(trials)
    found = tuple(float(r) for r in ratios[:, best])
    return Evidence(line, float(candidates[best]), found, min(chance / math.log(10.0), 0.0), spectrum.where)


def chances_at(spectrum: EnvelopeSpectrum, lines: np.ndarray, *, slip: float, harmonics: int) -> np.ndarray:
    """Return the decimal logarithm of the chance of each of many families at once, as `find_lines` does of one."""
    step = spectrum.step
    fits = np.zeros(lines.size, dtype=int)
    for k in range(1, harmonics + 1):
        fits += np.rint(k * lines * (1 + slip) / step) < spectrum.ratio.size
    known = fits > 0
    out = np.zeros(lines.size)
    if not known.any():
        return out
    lines, fits = lines[known], fits[known]
    spacing = step / (2.0 * fits)
    half = np.maximum(slip * lines, spacing)
    counts = 2 * (half / spacing).astype(int) + 1
    starts = np.cumsum(counts) - counts
    place = np.arange(counts.sum()) - np.repeat(starts, counts)
    candidates = np.repeat(lines - half, counts) + place * np.repeat(2.0 * half / (counts - 1), counts)
    highest = np.repeat(fits, counts)
    total = np.zeros(candidates.size)
    for k in range(1, harmonics + 1):
        total += np.where(k <= highest, ratio_at(spectrum, k * candidates), 0.0)
    best = np.maximum.reduceat(total, starts)
    terms = np.ones(best.size)
    tail = terms.copy()
    for j in range(1, harmonics):
        terms = terms * best / j
        tail += np.where(j < fits, terms, 0.0)
    trials = np.maximum(1.0, half / step * (fits + 1))
    out[known] = np.minimum((np.log(tail) - best + np.log(trials)) / math.log(10.0), 0.0)
    return out


def ratio_at(spectrum: EnvelopeSpectrum, frequency: np.ndarray) -> np.ndarray:
    """Return the ratio at frequencies; 1 outside the spectrum."""
    place = np.rint(frequency / spectrum.step).astype(int)
    inside = (place >= LOWEST) & (place < spectrum.ratio.size)
    return np.where(inside, spectrum.ratio.take(place, mode="clip"), 1.0)


def log_tail(total: float, count: int) -> float:
    """Return ln P(gamma_K > x) for a whole number K, e^-x sum_(j < K) x^j/j!."""
    return -total + math.log(sum(total**j / math.factorial(j) for j in range(count)))


def squared_envelope(values: np.ndarray, rate: float, band: tuple[float, float] | None) -> np.ndarray:
    """Return the squared envelope of one channel in a band."""
    n = values.size
    line = scipy.fft.rfft(values - values.mean())
    if band is not None:
        f = scipy.fft.rfftfreq(n, 1.0 / rate)
        line[(f < band[0]) | (f > band[1])] = 0.0
    full = np.zeros(n, dtype=complex)
    full[: line.size] = line
    return np.abs(scipy.fft.ifft(full)) ** 2


def power_of(envelope: np.ndarray) -> np.ndarray:
    """Return the power of an envelope by frequency, its mean removed, Hann window."""
    return np.abs(scipy.fft.rfft((envelope - envelope.mean()) * np.hanning(envelope.size))) ** 2


CLEAR, SIGNS, OPEN, FAINT, MULTIPLES, NONE = "clear", "signs", "open", "faint", "multiples", "none"
UNCERTAIN, SHIFTED, QUIET, SMOOTH = "uncertain", "shifted", "quiet", "smooth"
CLEAR_CHANCE, SIGNS_CHANCE, FAINT_CHANCE = -12.0, -6.0, -2.0
"""Decimal logarithm of the chance from which lines are no noise; from the last on they are told but accuse nothing."""
SINE, BLOWS_CHANCE = 0.09, -4.0
"""Power of the strongest harmonic by the first line in squared envelopes. A sine that modulates a carrier fully makes
1/16, for (1 + m cos x)^2 has a second line of m/4 of the first, and no third; the races that are named in 91 recordings
(CWRU and MFPT) have 0.12 at least. And the decimal logarithm of the chance from which harmonics are no noise."""
LEAST_RATIO = 10.0
"""Least power of the fundamental by its neighbourhood, as rare as 5e-5 in noise."""
MOST_SHARE = 0.025
"""Share of places with a family as strong, the part's own counted, up to which a part is named."""
LOWEST_ORDER = 0.3
"""Places are looked at from this order of the shaft on: slightly below a cage's, 0.35 to 0.45."""
ABOVE = 1.1
"""Places are looked at up to so many times the highest fundamental."""
PARENTS = 6
"""Families are looked for whose second to so manieth multiple a family may be."""
OWN, HALF, COMPARABLE = 2 / 3, 1 / 2, 0.1
"""Share of a slower family's own lines that must stand out to make it the cause, of a cage's half of the four beside
the part's (families have gaps); and how strong by the part's."""
SIDEBANDS, MOST_SIDEBANDS = 2, 12
"""Sidebands on either side of a line that belong to it; how many more belong to it if each of them stands out."""
SUMS = 6
"""Multiples of two shafts are added up to so many turns in all."""
SPARSE = 25.0
"""Multiples of a shaft are taken out as a whole if they are so many lines of the spectrum apart, five widths of one."""
SPEED_SHARE = 3e-4
"""A speed is read to three or four digits."""
WIDTH_SHARE = 2e-3
"""Half width of a bearing's line that slip makes, as a share of its frequency."""


@dataclass(frozen=True)
class Judged:
    """One part of one bearing: its evidence, grade, and how many of the other places are as strong.

    `beside` tells lines of another cause; `fraction` is (k, m) if these are k/m of the shaft's turns.
    """

    lines: BearingLines
    part: str
    evidence: Evidence
    grade: str
    stronger: int
    places: int
    beside: bool = False
    fraction: tuple[int, int] | None = None


def without_shafts(spectrum: EnvelopeSpectrum, shafts: Sequence[float]) -> EnvelopeSpectrum:
    """Return a spectrum in which multiples of shafts, and sums of these, do not count.

    Parameters
    ----------
    spectrum : EnvelopeSpectrum
    shafts : sequence of float
        Turns of the known shafts, Hz.
    """
    return spectrum.without(shaft_lines(spectrum, shafts), SPEED_SHARE)


def shaft_lines(spectrum: EnvelopeSpectrum, shafts: Sequence[float]) -> list[float]:
    """Return the lines that `without_shafts` leaves out, Hz."""
    known = [turns for turns in shafts if turns > 0.0]
    lines: set[float] = set()
    for turns in known:
        # all multiples of a slow shaft would leave nothing
        most = int(spectrum.top / turns) if turns > SPARSE * spectrum.step else SUMS
        lines |= {k * turns for k in range(1, most + 1)}
    for a, first in enumerate(known):
        for second in known[a + 1 :]:
            for j in range(1, SUMS):
                for k in range(1, SUMS - j + 1):
                    lines |= {j * first + k * second, abs(j * first - k * second)}
    return sorted(lines)


def needed_length(evidence: Evidence, spectrum: EnvelopeSpectrum, shafts: Sequence[float]) -> float | None:
    """Return the length of record that tells the fundamental from the lines of shafts and from the mean, s.

    Parameters
    ----------
    evidence : Evidence
        Of the spectrum without the lines of shafts: where these were, its ratio is one.
    spectrum : EnvelopeSpectrum
    shafts : sequence of float
        Turns of the known shafts, Hz.

    Returns
    -------
    float or None
        None if the fundamental was measured, infinite if it is nearer to a shaft's line than that may move.
    """
    if not evidence.ratios or evidence.ratios[0] != 1.0:
        return None
    lines = shaft_lines(spectrum, shafts)
    # where the lines slipped on to a shaft's the kinematic place may be free
    for place in (evidence.kinematic, evidence.found):
        room = min((abs(place - line) - SPEED_SHARE * line for line in lines), default=math.inf)
        # a bin may lie half a bin beside the line
        length = max((LINE_BINS + 0.5) / room if room > 0.0 else math.inf, LOWEST / place)
        if length > 1.0 / spectrum.step:
            return length
    return math.inf


def judge(
    spectra: Sequence[EnvelopeSpectrum],
    bearings: Sequence[BearingLines],
    turns: float,
    shafts: Sequence[float] | None,
    *,
    slip: float,
    harmonics: int,
    looks: int = 1,
) -> list[Judged]:
    """Grade every part of every bearing in one channel.

    Parameters
    ----------
    spectra : sequence of EnvelopeSpectrum
    bearings : sequence of BearingLines
    turns : float
        Of the reference shaft, Hz.
    shafts : sequence of float, optional
        Ratios of all other shafts; None: not known, so that a cage's line may be another shaft's.
    slip, harmonics
        As of `find_lines`.
    looks : int
        How many channels are looked at.
    """
    ratios = {1.0, *(lines.ratio for lines in bearings), *(shafts or ())}
    spectra = [without_shafts(spectrum, [turns * ratio for ratio in sorted(ratios)]) for spectrum in spectra]
    parts = [(lines, part) for lines in bearings for part in lines.orders]
    trials = math.log10(len(parts) * looks * len(spectra))
    first = look = _Look(spectra, parts, turns, slip, harmonics)
    named: dict[tuple[BearingLines, str], Judged] = {}
    while True:
        # what is left of a part must stand where it stood before stronger ones were taken out
        left = [key for key in parts if key not in named and _same_place(look, first, key)]
        strong = [key for key in left if _stands_out(look.of(key), SIGNS_CHANCE - trials)]
        if not strong:
            break
        fit = [key for key in strong if not look.is_a_multiple(key) and _share(*look.rivals(key)) <= MOST_SHARE]
        if not fit:
            break
        key = min(fit, key=lambda k: look.of(k).log_chance)
        evidence, (stronger, places) = look.of(key), look.rivals(key)
        grade = CLEAR if stronger == 0 and _stands_out(evidence, CLEAR_CHANCE - trials) else SIGNS
        if key[1] == CAGE:
            grade = OPEN if shafts is None else SIGNS
        named[key] = Judged(*key, evidence, grade, stronger, places)
        spectra = [_without_family(s, key, evidence.found, turns) for s in spectra]
        look = _Look(spectra, parts, turns, slip, harmonics)
    return [named.get(key) or _not_named(first, key, trials) for key in parts]


def _not_named(first: _Look, key: tuple[BearingLines, str], trials: float) -> Judged:
    """Return what is told of a part that is not named."""
    evidence, (stronger, places) = first.of(key), first.rivals(key)
    if _stands_out(evidence, SIGNS_CHANCE - trials):
        return Judged(*key, evidence, NONE, stronger, places, True, first.fraction_of_turns(key))
    told = key[1] != CAGE and stronger == 0 and evidence.log_chance <= FAINT_CHANCE - trials
    # such lines are no noise, but among them the part's own is missing
    grade = MULTIPLES if evidence.log_chance <= SIGNS_CHANCE - trials else FAINT
    return Judged(*key, evidence, grade if told else NONE, stronger, places)


class _Look:
    """Evidence for parts, and at all places, in some spectra; each is looked at once."""

    def __init__(
        self, spectra: Sequence[EnvelopeSpectrum], parts: Sequence[tuple[BearingLines, str]], turns: float, slip: float,
        harmonics: int,
    ) -> None:  # fmt: skip
        self.spectra, self.turns, self.slip, self.harmonics = spectra, turns, slip, harmonics
        self.highest = max(lines.orders[part] * lines.ratio for lines, part in parts) * turns
        self._lines = {(lines, part): lines.orders[part] * lines.ratio * turns for lines, part in parts}
        places = np.array(list(self._lines.values()))
        chances = [chances_at(spectrum, places, slip=slip, harmonics=harmonics) for spectrum in spectra]
        self._clearest = dict(zip(self._lines, np.argmin(chances, axis=0), strict=True))
        self._parts: dict[tuple[BearingLines, str], Evidence] = {}
        self._places: dict[tuple[str, float], tuple[np.ndarray, np.ndarray]] = {}

    def of(self, key: tuple[BearingLines, str]) -> Evidence:
        """Return the evidence for a part, of the spectrum in which it is clearest."""
        if key not in self._parts:
            spectrum = self.spectra[self._clearest[key]]
            self._parts[key] = find_lines(spectrum, self._lines[key], slip=self.slip, harmonics=self.harmonics)
        return self._parts[key]

    def rivals(self, key: tuple[BearingLines, str]) -> tuple[int, int]:
        """Return at how many other places a family as strong stands, and how many places there are."""
        own, shaft = self.of(key), key[0].ratio * self.turns
        if (own.where, shaft) not in self._places:
            spectrum = next(s for s in self.spectra if s.where == own.where)
            lowest = LOWEST_ORDER * shaft
            count = int(math.log(max(ABOVE * self.highest / lowest, 2.0)) / (2.0 * self.slip))
            places = lowest * np.exp(2.0 * self.slip * np.arange(count))
            found = chances_at(spectrum, places, slip=self.slip, harmonics=self.harmonics)
            self._places[own.where, shaft] = places, found
        places, chances = self._places[own.where, shaft]
        # windows that hold the part's own lines, or families of their multiples, are no other places
        times = places / own.found
        nearest = np.clip(np.rint(times), 1, PARENTS)
        other = np.abs(np.log(times / nearest)) > 3.0 * self.slip
        return int(np.sum(chances[other] <= own.log_chance)), int(np.sum(other))

    def is_a_multiple(self, key: tuple[BearingLines, str]) -> bool:
        """Return whether the lines of a part are multiples of a slower family whose other lines stand out, too.

        Elements over the outer race are one of the cage's multiples: there its neighbours among these are looked at. Of
        other fractions those do not count that cage and elements make themselves.
        """
        own, elements = self.of(key), round(key[0].bpfo / key[0].ftf)
        spectrum = next(s for s in self.spectra if s.where == own.where)

        def heard(fractions: list[float], share: float) -> bool:
            places = [round(own.found * fraction / spectrum.step) for fraction in fractions]
            levels = [float(spectrum.ratio[max(k - 1, 0) : k + 2].max(initial=0.0)) for k in places]
            least = max(LEAST_RATIO, COMPARABLE * own.ratios[0])
            return len(levels) > 1 and sum(level >= least for level in levels) >= share * len(levels)

        if key[1] == OUTER and heard([(elements + k) / elements for k in (-2, -1, 1, 2)], HALF):
            return True
        if self.fraction_of_turns(key) is not None:
            return True
        counted = [m for m in range(2, PARENTS + 1) if math.gcd(m, elements) == 1 and (key[1] != ELEMENT or m % 2)]
        return any(heard([k / m for k in range(1, 2 * m) if k % m], OWN) for m in counted)

    def fraction_of_turns(self, key: tuple[BearingLines, str]) -> tuple[int, int] | None:
        """Return (k, m) if a part's lines are k/m of its shaft's turns and most multiples of 1/m comparably strong."""
        own, turns = self.of(key), key[0].ratio * self.turns
        if key[1] == CAGE:
            # one turn in two and a half is what a cage does
            return None
        spectrum = next(s for s in self.spectra if s.where == own.where)
        for m in range(2, PARENTS + 1):
            k = round(m * own.found / turns)
            if math.gcd(k, m) > 1 or abs(own.found - k * turns / m) > LINE_BINS * spectrum.step:
                continue
            # to one and a half times the part's fundamental; neither whole turns nor the part's own lines
            others = [j for j in range(1, math.ceil(1.5 * k)) if j % m and j % k]
            places = [round(j * turns / m / spectrum.step) for j in others]
            levels = [float(spectrum.ratio[max(p - 1, 0) : p + 2].max(initial=0.0)) for p in places]
            if levels and float(np.median(levels)) >= COMPARABLE * own.ratios[0]:
                return k, m
        return None


def _same_place(look: _Look, first: _Look, key: tuple[BearingLines, str]) -> bool:
    return abs(look.of(key).found - first.of(key).found) <= max(s.step for s in look.spectra)


def is_smooth(evidence: Evidence) -> bool:
    """Return whether a family is that of a smooth modulation: blows have harmonics, a sine has hardly any."""
    first, *higher = evidence.ratios
    if not higher:
        return False
    noise = log_tail(sum(higher), len(higher)) > BLOWS_CHANCE * math.log(10.0)
    return noise or max(higher) < SINE * first


def _share(stronger: int, places: int) -> float:
    return (1 + stronger) / (1 + places)


def _stands_out(evidence: Evidence, chance: float) -> bool:
    return bool(evidence.ratios) and evidence.log_chance <= chance and evidence.ratios[0] >= LEAST_RATIO


def _without_family(
    spectrum: EnvelopeSpectrum, key: tuple[BearingLines, str], found: float, turns: float
) -> EnvelopeSpectrum:
    """Return a spectrum in which a family, and its sidebands by shaft and cage, do not count."""
    lines, part = key
    if part == CAGE:
        # all its multiples would leave little
        return spectrum.without([k * found for k in range(1, PARENTS + 1)], WIDTH_SHARE)
    places = set()
    for k in range(1, int(spectrum.top / found) + 2):
        for spacing in (lines.ratio * turns, lines.ratio * lines.ftf * turns):
            for step in (spacing, -spacing):
                places |= {abs(k * found + m * step) for m in range(_sidebands_of(spectrum, k * found, step) + 1)}
    return spectrum.without(sorted(places), WIDTH_SHARE)


def _sidebands_of(spectrum: EnvelopeSpectrum, line: float, step: float) -> int:
    """Return how many sidebands belong to a line on one side: those next to it, and all that follow without a gap."""
    for m in range(SIDEBANDS + 1, MOST_SIDEBANDS + 1):
        place = round(abs(line + m * step) / spectrum.step)
        if spectrum.ratio[max(place - 1, 0) : place + 2].max(initial=0.0) < LEAST_RATIO:
            return m - 1
    return MOST_SIDEBANDS
