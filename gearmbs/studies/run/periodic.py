"""Records as long as the question: how long a motion must be followed until it repeats itself, measured on the way.

Wheels without faults of single teeth repeat their motion each mesh period, with such faults each turn of the faulty
wheel, with faults on both when the same teeth meet again. That is what the geometry allows; whether the motion does it
depends on damping, backlash and resonances. A record at ``duration = "auto"`` is therefore watched while it is made. Of
each mesh period n the complex amplitudes c_n of the mesh harmonics of every component of the force are taken.

* Periodic by mesh: two neighbouring stretches of h periods each, the later half of which comes after 2 h others, have
  the same mean amplitudes. Long-lived oscillations and wheels that hop off their flanks shift the means; a motion that
  repeats itself every second or third period is seen, too, once h is a multiple of that.
* Periodic by p mesh periods: amplitudes of the last mesh periods are those of p, or 2 p, periods before, so that the
  motion has come back to where it was.

The largest difference, of the harmonics' own levels, is the record's *deviation*. An oscillation that has decayed to a
part d of its beginning after the settling, and by a factor q in each mesh period, leaves of the stretches a difference
of d (1 - q^h)^2 / (h (1 - q)), of their mean an error of d (1 - q^2h) / (2 h (1 - q)): half of it for fast ones, twice
as much at q^h = 0.6.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from gearmbs.dae.methods import INTEGRATORS
from gearmbs.dae.results.solution import Solution
from gearmbs.signals.conversion import COMPONENTS, component_values
from gearmbs.signals.resampling import MARGIN, monotone_cubic
from gearmbs.studies.case.case import Case
from gearmbs.studies.case.limits import HARMONICS, geometric_period
from gearmbs.studies.run.levels import bands_of_lines
from gearmbs.studies.run.recorder import COUNTS, SMOOTH, Measured, Recorder, Span, to_mesh
from gearmbs.studies.run.refined import Behind

SAMPLES = 1024
"""Samples of a mesh period, ten of a contact that lasts a hundredth of it; means over each lower the first harmonics by
less than 2e-5."""

HOLDS = 1e-3
"""Deviation up to which a motion is said to repeat itself: the noise of a mean over four mesh periods, and a fifth of
what a harmonic may be off, 0.5 %, which it is at q^h = 0.8 of the module's text."""

SCATTERS = 5e-3
"""Part of its level by which a harmonic of single mesh periods may scatter about what repeats itself before it is told:
what one may be off. Means settle all the same, on values that hang on what scatters: chaos, or the tolerance."""

LEAST_LEVEL = 0.01
"""Levels below this part of the component's largest harmonic are judged as if they had it: they are differences of
large numbers."""

HALVES = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)
"""Lengths of a stretch that are tried, in mesh periods: multiples of two and of three."""

OVERLAP = 6
"""Mesh periods over which a motion must have come back to that of a turn before, and settles at least before it."""

RETURNS = (1, 2)
"""After how many of its periods a motion with faulty teeth is looked at for a return."""

SIGNAL_TURNS = 5
"""Turns of the driver over which the acceleration is told, by repetition: what is made of it, such as synchronous
averages and lines between whole turns, takes four and the ends of its filters."""

KEPT = 64
"""Mesh periods of a motion that has not repeated itself yet whose samples are kept, 2 MB; the samples of later ones are
made again when the motion has been found to do so."""

BEYOND = 0.02
"""Part of a mesh period by which a run goes beyond the end of one before it is looked at: the interpolation needs a
step there."""


class Found(NamedTuple):
    """How long a record turned out to be.

    Attributes
    ----------
    start, periods : int
        Its first mesh period, counted from the end of the run-up, and their number; no periods if the motion does not
        repeat itself up to the longest record.
    """

    start: int
    periods: int


class Precision(NamedTuple):
    """What is asked of a record besides its case.

    Attributes
    ----------
    holds : float
        Deviation up to which a motion is said to repeat itself.
    like : Found or None
        The record is to be this one of another run of the motion, whether the motion repeats itself or not.
    behind : Behind or None
        Another run of the motion, to start from a state of it behind the run-up; default rest.
    is_twin : bool
        Whether the record is that part of another run's by which the two are held against each other.
    """

    holds: float = HOLDS
    like: Found | None = None
    behind: Behind | None = None
    is_twin: bool = False


class PeriodicRecorder:
    """Collects what the record of a case needs, and ends the run when its motion repeats itself.

    Parameters
    ----------
    case : Case
        At constant speed, with the duration "auto".
    known_period : bool
        Whether the wheels alone decide the period, as they do not where bearings have defects: else the record has its
        longest length.
    begin : float, optional
        Time from which its mesh periods are counted, s; default the end of the run-up.
    precision : Precision, optional
        How well the motion must repeat itself, or that the record is to be that of another run.
    """

    def __init__(
        self, case: Case, known_period: bool = True, begin: float | None = None, precision: Precision | None = None
    ) -> None:
        self.case = case
        self._precision = precision or Precision()
        operation = case.operation
        self.period = geometric_period(case) if known_period else 0
        self._gmf, self._begin = case.mesh_frequency, operation.run_up if begin is None else begin
        self._longest = int((operation.settling + operation.longest) * self._gmf)
        self.recorder = Recorder(case, self._begin - (MARGIN + 1) / case.output_rate)
        pair = case.pair()
        self._components = partial(
            component_values,
            pressure_angle=pair.working_pressure_angle,
            centre_line=to_mesh(pair),
            sense=pair.rotation,
        )
        self._amplitudes = np.empty((0, HARMONICS, len(COMPONENTS)), dtype=complex)
        self._samples = np.empty((0, SAMPLES, len(COMPONENTS)))
        self._watched = False
        self.found: Found | None = None
        self.deviation = self.scatter = math.nan

    def take(self, part: Solution) -> None:
        """Take the next steps of a run."""
        self.recorder.take(part)

    def repeat(self, period: Solution, copies: Sequence[tuple[np.ndarray, float]]) -> None:
        """Take a period of a motion that is known to repeat itself; see `Recorder.repeat`."""
        self.recorder.repeat(period, copies)

    @property
    def settled(self) -> float:
        """Time, s, from which the run of a twin may start: it settles within the mesh periods that are left to it."""
        return self._begin + (OVERLAP / self._gmf if self.period > 1 else 0.0)

    def pause(self, t: float) -> float | None:
        """Return when to look at the motion again, or None if it repeats itself; see `gearmbs.dae.Options`."""
        self._watched = True
        like = self._precision.like
        if like is not None:
            end = self._begin + (like.start + like.periods + BEYOND) / self._gmf if like.periods else math.inf
            if t < end:
                return end
            self.found = like
            return None
        whole = math.floor((t - self._begin) * self._gmf - 0.5 * BEYOND)
        if whole > 0:
            self._add(whole)
            self.found = self._judged()
            if self.found is not None:
                return None
        following = next((n for n in self._looks() if n > whole), 0)
        return self._begin + (following + BEYOND) / self._gmf if 0 < following <= self._longest else math.inf

    def _looks(self) -> Any:
        """Yield the numbers of mesh periods after which the motion is looked at."""
        if self.period == 1:
            yield from (3 * half for half in HALVES)
        elif self.period > 1:
            n = self.period + 2 * OVERLAP
            while n <= self._longest:
                yield n
                # a little longer each time, and where a second return is seen
                n += max(OVERLAP, n // 8)

    def _values(self, first: int, stop: int) -> np.ndarray:
        """Return the components of the force on the driven gear over mesh periods, (periods SAMPLES, 4), N.

        They are means over each sample: values at equal places of all mesh periods would put a jump, as of friction at
        the pitch point, at the same wrong place in each. Resultants are those of the steps: of means they would be too
        small where forces vanish and come back.
        """
        columns = self.recorder.tail(self._begin + (first - 1.0) / self._gmf)
        t, components = columns.t, self._components(columns.forces[:, 3:6])
        edges = self._begin + (first + np.arange((stop - first) * SAMPLES + 1) / SAMPLES) / self._gmf
        between = slice(*np.searchsorted(t, edges[[0, -1]]))
        steps = t[between]
        # where both stand among all
        at_steps = np.searchsorted(edges, steps) + np.arange(steps.size)
        is_edge = np.ones(edges.size + steps.size, dtype=bool)
        is_edge[at_steps] = False
        (at_edges,) = np.nonzero(is_edge)
        times = np.empty(is_edge.size)
        times[at_steps], times[at_edges] = steps, edges
        means = np.empty((len(COMPONENTS), edges.size - 1))
        column, integral = np.empty(is_edge.size), np.zeros(is_edge.size)
        half = 0.5 * np.diff(times)
        for mean, of_steps, of_edges in zip(means, components[between].T, monotone_cubic(t, components, edges).T):
            column[at_steps], column[at_edges] = of_steps, of_edges
            np.cumsum(half * (column[1:] + column[:-1]), out=integral[1:])
            mean[:] = np.diff(integral[at_edges])
        return means.T * (SAMPLES * self._gmf)

    def _add(self, whole: int) -> None:
        """Take the amplitudes of mesh periods that are complete."""
        known = len(self._amplitudes)
        if whole > known:
            values = self._values(known, whole).reshape(whole - known, SAMPLES, len(COMPONENTS))
            if whole <= KEPT:
                self._samples = np.concatenate([self._samples, values])
            lines = np.fft.rfft(values, axis=1)[:, 1 : HARMONICS + 1]
            self._amplitudes = np.concatenate([self._amplitudes, lines * (2.0 / SAMPLES)])

    def _judged(self) -> Found | None:
        """Return the record if the motion repeats itself."""
        c, n, p = self._amplitudes, len(self._amplitudes), self.period
        if p == 1:
            half = max((h for h in HALVES if 3 * h <= n), default=0)
            tried = [(2 * half, c[n - half :], c[n - 2 * half : n - half])] if half else []
        else:
            spans = [k * p for k in RETURNS if k * p + 2 * OVERLAP <= n]
            tried = [(s, c[n - OVERLAP :], c[n - OVERLAP - s : n - s]) for s in spans]
        for span, late, early in tried:
            levels = np.abs(c[n - span :].mean(axis=0))
            levels = np.maximum(levels, LEAST_LEVEL * levels.max(axis=0))
            shift, noise = np.abs((late - early).mean(axis=0)), (late - early).std(axis=0) / math.sqrt(2.0)
            self.scatter = float((noise / levels).max())
            # of a turn the record is off by what its beginning is, as part of it
            weight = 1.0 if p == 1 else len(late) / span
            shift, noise = weight * shift, noise / math.sqrt(span)
            self.deviation = float((np.maximum(shift, noise) / levels).max())
            if self.deviation <= self._precision.holds:
                return Found(n - span, span)
        return None

    @property
    def span(self) -> Span:
        """Start and end of the record, s."""
        operation = self.case.operation
        if self.found is None:
            start = operation.run_up + operation.settling
            return Span(start, start + operation.longest)
        start = self._begin + self.found.start / self._gmf
        return Span(start, start + self.found.periods / self._gmf)

    def measured(self, beyond: float) -> Measured:
        """Return what the record is made from, repeated so that it reaches some seconds beyond both of its ends.

        In its last mesh period it goes over to what was one record earlier, so that the repetition has no seams.
        """
        known = self.recorder.measured()
        start, stop = self.span
        inside = slice(*np.searchsorted(known.t, (start, stop)))
        length = stop - start
        number = math.ceil(beyond / length)
        copies = np.arange(-number, number + 1)
        t = known.t[inside]
        last = int(np.searchsorted(t, stop - 1.0 / self._gmf))
        share = 0.5 - 0.5 * np.cos(np.pi * ((t[last:] - stop) * self._gmf + 1.0))

        def repeated(values: np.ndarray) -> np.ndarray:
            piece = values[inside].copy()
            earlier = monotone_cubic(known.t, np.ascontiguousarray(values), t[last:] - length)
            piece[last:] += (share * (earlier - piece[last:]).T).T
            return np.concatenate([piece] * copies.size)

        contact = {name: repeated(known.contact[name]) for name in SMOOTH}
        contact |= {name: np.concatenate([known.contact[name][inside]] * copies.size) for name in COUNTS}
        return Measured((t + length * copies[:, None]).ravel(), repeated(known.forces), repeated(known.error), contact)

    @property
    def part(self) -> Found:
        """The part of the record by which another run is held against it: half, but all periods of faulty teeth."""
        assert self.found is not None
        if self._precision.is_twin:
            return self.found
        return Found(self.found.start, max(self.period, self.found.periods // 2))

    def levels(self, part: Found | None = None) -> np.ndarray:
        """Return the RMS of the mesh harmonics' acceleration, shape (2, harmonics, components): by band and by orders.

        The band-passes of other records let through, of the lines of this one, what they would of a long repetition.

        Parameters
        ----------
        part : Found, optional
            Mesh periods of the record; default all.
        """
        found = part or self.found
        assert found is not None
        first, periods = found
        last = first + periods
        if last <= len(self._samples):
            values = self._samples[first:last].reshape(-1, len(COMPONENTS))
        else:
            values = self._values(first, last)
        lines = np.fft.rfft(values, axis=0)
        levels = np.abs(lines) * (math.sqrt(2.0) / (periods * SAMPLES))
        orders = levels[periods * np.arange(1, HARMONICS + 1)]
        bands = bands_of_lines(self.case, periods, levels.__getitem__)
        return np.stack([bands, orders]) / self.case.pair().wheels[1].mass

    def _apart(self) -> float:
        """Return the part of the time behind the run-up in which no drive flanks touch."""
        known = self.recorder.measured()
        steps = np.diff(known.t)
        later, separated = known.t[1:] > self._begin, known.contact["pairs_drive"][1:] == 0.0
        return float(steps[later & separated].sum() / steps[later].sum())

    def _why_longest(self, period: str, length: float) -> str:
        """Return what is said of a record that has its longest length, s."""
        least = 3 * HALVES[0] if self.period == 1 else self.period + 2 * OVERLAP
        if self.period == 0:
            return f"the record has {length:g} s, the longest: its mechanism has periods besides the mesh's"
        if not self._watched:
            able = " or ".join(name for name, one in INTEGRATORS.items() if one.can("pause"))
            return (
                f"the record has {length:g} s, the longest: whether the motion repeats itself was not looked at, since "
                f"{self.case.solver.integrator} cannot be stopped for it between its steps; take {able}"
            )
        if least > self._longest:
            short = "is shorter than its period" if self.period > 1 else "is too short to tell its period"
            need = (self.period if self.period > 1 else least) / self._gmf
            return (
                f"the record of {length:g} s, the longest, {short}, {period}; give a duration of {need:.3g} s or more"
            )
        return (
            f"the motion does not repeat itself by {period} within {length:g} s, the longest record: its mesh "
            "harmonics depend on its length"
        )

    def attributes(self) -> dict[str, Any]:
        """Return what a record says of its length."""
        start, stop = self.span
        turn = {self.case.gears.teeth[k]: f"turn of the {name}" for k, name in ((1, "driven wheel"), (0, "driver"))}
        names = {0: "unknown", 1: "mesh", **turn}
        period = names.get(self.period, f"{self.period} mesh periods")
        if self.found is None:
            said = self._why_longest(period, stop - start)
        else:
            n, off = self.found.periods, self.deviation
            said = f"{n} mesh periods, after which the motion repeats itself to {off:.1e} of its mesh harmonics"
        apart = self._apart()
        if apart > 0.0:
            said += (
                f"; the flanks were apart in {100 * apart:.2g} % of the time behind the run-up: other motions may "
                "exist beside this one, and how it begins may decide between them"
            )
        if self.found is not None and self.scatter > SCATTERS:
            said += (
                f"; its harmonics scatter by {100 * self.scatter:.2g} % from mesh period to mesh period, and their "
                f"means may hang on what makes them do so: compare a tolerance of {0.1 * self.case.tolerance:.1g}"
            )
        return {
            "operation_settling": start - self._begin,
            "operation_duration": stop - start,
            "record_status": "at the limit" if self.found is None else "periodic",
            "record_period": period,
            "record_mesh_periods": (stop - start) * self._gmf,
            "record_deviation": self.deviation,
            "record_scatter": self.scatter,
            "record_apart": apart,
            "record_length": said,
        }


def signal_stop(case: Case, span: Span) -> float:
    """Return until when the acceleration of a record that repeats itself is told, s.

    These are whole records, lest one fault more than its share were among them, and whole turns of the driver too where
    that takes no more than twice as many.
    """
    teeth, length = case.gears.teeth[0], max(1, round((span.stop - span.start) * case.mesh_frequency))
    meshes, both = (math.ceil(SIGNAL_TURNS * teeth / step) * step for step in (length, math.lcm(length, teeth)))
    return span.start + (both if both <= 2 * meshes else meshes) / case.mesh_frequency


def reach(case: Case, span: Span) -> float:
    """Return how far beyond its ends a record must be known for its filters and the whole acceleration, s."""
    return signal_stop(case, span) - span.stop + case.edge + (MARGIN + 4) / case.output_rate
