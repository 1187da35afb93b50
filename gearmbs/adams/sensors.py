"""SENSORs of a deck during an analysis: when they fire, what they do then.

An analysis with sensors is carried out in parts. Each ends exactly where a sensor's function passes its value; the next
goes on from there, with its order, its pivots and its first step chosen anew. A sensor that has fired waits for its
function to come back, EQ for its next passage.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from gearmbs.adams.builders.control import quantities
from gearmbs.adams.builders.scopes import AdamsModel, sensor_state
from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.results.record import Segment
from gearmbs.adams.results.requests import RequestEvaluator
from gearmbs.adams.session import Session
from gearmbs.dae.analyses.statics import quasi_static
from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.language.syntax import Number, parse
from gearmbs.mechanism.solve.simulate import StopAt

DIRECTIONS = {"GE": 1, "LE": -1, "EQ": 0}
MOST = 10_000
"""Passages in one analysis after which a sensor is taken to chatter."""
AT_ONCE = 100
"""Passages at one time, besides one of each sensor, after which they are taken to go on there for ever."""
CROWD = 200
"""Passages between two outputs after which a sensor is taken to chatter, if they make up little of the analysis."""
LITTLE = 0.1
"""Of what was left of the analysis when they began: vibrations of a long analysis with few outputs go on beyond it."""
SAME = 1e-9
"""Of the span of an analysis: output times nearer to a passage are that time."""


@dataclass
class Watch:
    """What the sensors of one analysis wait for.

    Attributes
    ----------
    sensors : list of Sensor
    waits : dict of int to int
        By id of a sensor that has fired: the direction in which its function is expected to pass next.
    parts : int
        Carried out so far.
    at_once : int
        Parts in which time has not gone on, since the last in which it has.
    crowded : int
        Parts that have ended before their first output, since the last that has reached it.
    crowded_from : float
        When the first of these began, in the deck's unit.
    first_step : float or None
        That a STEPSIZE asks for, in the deck's unit.
    """

    sensors: list[st.Sensor]
    waits: dict[int, int] = field(default_factory=dict)
    parts: int = 0
    at_once: int = 0
    crowded: int = 0
    crowded_from: float = 0.0
    first_step: float | None = None

    def stops(self) -> list[StopAt]:
        """Return where the next part ends."""
        return [StopAt(sensor_state(s.id), s.value, self.waits.get(s.id, DIRECTIONS[s.relation])) for s in self.sensors]

    def silent(self, sensor: st.Sensor) -> bool:
        """Whether a sensor that passes does nothing, but is ready again."""
        return sensor.relation != "EQ" and sensor.id in self.waits

    def true_at_start(self, solution: Solution, evaluator: RequestEvaluator) -> list[st.Sensor]:
        """Return the sensors whose condition is met when the analysis starts."""
        if self.parts > 0:
            return []
        found = []
        for sensor in self.sensors:
            off = float(evaluator.state(sensor_state(sensor.id))[0]) - sensor.value
            met = {"GE": off >= 0.0, "LE": off <= 0.0, "EQ": abs(off) <= sensor.error}[sensor.relation]
            if met:
                found.append(sensor)
        return found

    def passed(self, solution: Solution) -> tuple[float, list[st.Sensor]]:
        """Return the time at which a run was stopped, s, and the sensors that did it."""
        last = [times[-1] if len(times) else -np.inf for times in solution.result.t_events]
        end = max(last)
        return float(end), [s for s, t in zip(self.sensors, last) if t == end]

    def crossing(self, evaluator: RequestEvaluator, k: int) -> list[st.Sensor]:
        """Return the sensors that pass between output ``k - 1`` and output ``k``."""
        found = []
        for stop, sensor in zip(self.stops(), self.sensors):
            before, now = evaluator.state(sensor_state(sensor.id))[k - 1 : k + 1] - sensor.value
            up, down = before < 0.0 <= now, before > 0.0 >= now
            if (up and stop.direction >= 0) or (down and stop.direction <= 0):
                found.append(sensor)
        return found

    def turned_round(self, evaluator: RequestEvaluator) -> bool:
        """Whether sensors that wait for their functions to come back find them back at once; they wait no longer.

        What a sensor evaluates may throw another's function back, or its own, without a passage.
        """
        found = False
        for sensor in self.sensors:
            waits = self.waits.get(sensor.id)
            if waits is None:
                continue
            off = float(evaluator.state(sensor_state(sensor.id))[0]) - sensor.value
            if off * waits > sensor.error:
                found = True
                if sensor.relation == "EQ":
                    self.waits[sensor.id] = -waits
                else:
                    del self.waits[sensor.id]
        return found

    def endless(self, times: np.ndarray, now: float) -> str:
        """Count a part that was to go through ``times`` and has ended at ``now``; say why there are too many, if so."""
        self.parts += 1
        self.at_once = self.at_once + 1 if now - times[0] <= SAME * (times[-1] - times[0]) else 0
        if now >= times[1] or self.crowded == 0:
            self.crowded, self.crowded_from = 0, float(times[0])
        self.crowded += now < times[1]
        if self.at_once > AT_ONCE + len(self.sensors):
            return (
                f"it fires again and again at TIME = {now:.9g}; what it evaluates there, or a jump of its function, "
                "puts the function back behind its VALUE"
            )
        if self.parts > MOST:
            return f"it fired {MOST} times in one analysis; its function chatters"
        if self.crowded > CROWD and now - self.crowded_from < LITTLE * (times[-1] - self.crowded_from):
            return (
                f"sensors fired {CROWD} times from TIME = {self.crowded_from:.9g} to {now:.9g} without an output; "
                "if no function chatters, as an angle does where it is not defined, ask for more STEPS"
            )
        return ""

    def note_passage(self, sensor: st.Sensor, evaluator: RequestEvaluator) -> None:
        """Expect a sensor's function back from where it went."""
        values = evaluator.state(sensor_state(sensor.id)) - sensor.value
        if self.silent(sensor):
            del self.waits[sensor.id]
            return
        came = -1.0 if values.size < 2 else float(np.sign(values[-2]))
        rising = DIRECTIONS[sensor.relation] or (1 if came < 0.0 else -1)
        self.waits[sensor.id] = -rising


def in_unit(time: float, scale: float) -> float:
    """Return a time, s, in the deck's unit of ``scale`` seconds: rounded so that it is not before that time again.

    A function that jumps has not passed yet a rounding error before it does.
    """
    found = time / scale
    return found if found * scale >= time else float(np.nextafter(found, np.inf))


def up_to(times: np.ndarray, end: float) -> np.ndarray:
    """Return the output times before a passage, and its own."""
    span = times[-1] - times[0]
    return np.append(times[times < end - SAME * span], end)


def after(times: np.ndarray, now: float, fired: Sequence[st.Sensor]) -> np.ndarray:
    """Return the output times from a passage on, in steps of the last DT that is given."""
    end, span = times[-1], times[-1] - times[0]
    if end - now <= SAME * span:
        return np.array([now])
    steps = [s.dt for s in fired if s.dt is not None]
    if steps:
        count = int(np.floor((end - now) / steps[-1] * (1.0 + 1e-12)))
        rest = now + steps[-1] * np.arange(1, count + 1)
        rest = rest if len(rest) and end - rest[-1] < SAME * span else np.append(rest, end)
    else:
        rest = times[times > now + SAME * span]
    return np.append(now, rest)


def act(
    session: Session, watch: Watch, segment: Segment, fired: Sequence[st.Sensor], evaluator: RequestEvaluator
) -> None:
    """Carry out what sensors do at the end of a part besides ending analyses: notes, values, steps."""
    notes = [] if segment.note is None else [segment.note]
    watch.first_step = None
    for sensor in fired:
        if watch.silent(sensor):
            continue
        actions = [word for word, on in actions_of(sensor) if on]
        notes.append(
            f"{sensor.label()}: {sensor.function} is {sensor.relation} {sensor.value:g} at TIME = {session.time:.9g}"
            + (f": {', '.join(actions)}" if actions else "")
        )
        if sensor.evaluate is not None:
            session.sensed[sensor.id] = float(evaluator.expression(sensor.evaluate)[-1])
            notes[-1] += f"; SENVAL({sensor.id}) = {session.sensed[sensor.id]:.9g}"
        if sensor.stepsize is not None:
            watch.first_step = sensor.stepsize
        if sensor.yydump:
            problem, y = segment.solution.problem, segment.solution.result.y[-1]
            notes.append("\n".join(f"   {name} = {value:.12g}" for name, value in zip(problem.names, y)))
    segment.note = "\n".join(notes) or None


def actions_of(s: st.Sensor) -> list[tuple[str, bool]]:
    """Return what a sensor does, by name."""
    return [
        ("CODGEN", s.codgen), ("DT", s.dt is not None), ("HALT", s.halt), ("PRINT", s.print_), ("RESTART", s.restart),
        ("RETURN", s.back), ("STEPSIZE", s.stepsize is not None), ("YYDUMP", s.yydump),
    ]  # fmt: skip


# Sequences of equilibria that sensors watch: where they end.


def equilibria_to_passage(
    watch: Watch, model: AdamsModel, times: np.ndarray, solution: Solution, tol: float
) -> tuple[Solution, list[st.Sensor]]:
    """Return a sequence of equilibria that ends where sensors fire, and these; the given one if none does.

    Parameters
    ----------
    watch : Watch
    model : AdamsModel
    times : ndarray
        Of the sequence, s.
    solution : Solution
        The whole sequence.
    tol : float
        As in :func:`quasi_static`.
    """
    from scipy.optimize import brentq

    found = RequestEvaluator(model, solution)
    after = next((k for k in range(1, times.size) if watch.crossing(found, k)), None)
    if after is None:
        return solution, []
    low, high = float(times[after - 1]), float(times[after])

    def sequence(until: np.ndarray) -> Solution:
        return quasi_static(model.mechanism.compile(float(times[0])), until, tol=tol)

    def when(sensor: st.Sensor) -> float:
        def off(t: float) -> float:
            if t == low or t == high:
                return float(found.state(sensor_state(sensor.id))[after - (t == low)]) - sensor.value
            there = RequestEvaluator(model, sequence(np.array([low, t])))
            return float(there.state(sensor_state(sensor.id))[-1]) - sensor.value

        return float(brentq(off, low, high, xtol=SAME * (high - low)))

    passages = [(when(sensor), sensor) for sensor in watch.crossing(found, after)]
    end = min(time for time, _ in passages)
    fired = [sensor for time, sensor in passages if time - end <= SAME * (high - low)]
    return sequence(up_to(times, end)), fired


# Discrete states of GSEs: held between samples, and renewed at them.
#
# With SAMPLE_PERIOD T and SAMPLE_OFFSET t0 the samples are at t_n = t0 + n T, and xd(n+1) = h(t_n, x_n, xd(n), u_n)
# holds from t_(n+1) on. An analysis is cut at the samples, so that each part of it is smooth.


CLOSE = 1e-9
"""Of an analysis: times so near count as one."""
AT_SAMPLE = 1e-6
"""Of a sampling period: a time so near to a sample is one."""


def sampled(session: Session) -> list[st.Gse]:
    """Return the GSEs with discrete states."""
    return [g for g in session.deck.of(st.Gse).values() if g.nd]


def period_of(session: Session, gse: st.Gse) -> float:
    """Return a GSE's sampling period in the deck's unit.

    Raises
    ------
    DeckError
        If it is missing, no number, or not positive.
    """
    node = parse(gse.sample_period) if gse.sample_period is not None else None
    if isinstance(node, Number) and node.value > 0.0:
        return node.value
    given = "is missing" if gse.sample_period is None else f"= {gse.sample_period}; it must be a positive number"
    message = f"{gse.label()}: SAMPLE_PERIOD {given}"
    raise DeckError([Diagnostic(ERROR, message, session.deck.file, gse.line)])


def parts(session: Session, times: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the output times of the parts of an analysis between samples."""
    marks: list[float] = []
    for gse in sampled(session):
        period = period_of(session, gse)
        first = np.ceil((times[0] - gse.sample_offset) / period - CLOSE)
        last = np.floor((times[-1] - gse.sample_offset) / period + CLOSE)
        marks += [gse.sample_offset + period * k for k in np.arange(first, last + 1)]
    if not marks:
        yield times
        return
    span = float(times[-1] - times[0])
    edges = [float(times[0])]
    for mark in sorted(marks):
        if edges[-1] + CLOSE * span < mark < times[-1] - CLOSE * span:
            edges.append(float(mark))
    edges.append(float(times[-1]))
    for start, end in pairwise(edges):
        between = times[(times > start + CLOSE * span) & (times < end - CLOSE * span)]
        yield np.r_[start, between, end]


def take_samples(session: Session, evaluator: RequestEvaluator, time: float) -> None:
    """At the first row of a part compute what discrete states will be after the next sample."""
    for gse in sampled(session):
        period = period_of(session, gse)
        n = (time - gse.sample_offset) / period
        if abs(n - round(n)) > AT_SAMPLE or round(n) < 0:
            continue
        caller = gse.callers["update"]
        inputs = session.deck.of(st.Array)[gse.u].variables if gse.u is not None else ()
        arguments = [float(evaluator.expression(t)[0]) for t in caller.arguments(quantities(gse, inputs))]
        session.pending[gse.id] = round(n) + 1, caller.results(arguments)


def renew(session: Session) -> None:
    """Let discrete states take their next values where the session's time is a sample."""
    for gse in sampled(session):
        if gse.id not in session.pending:
            continue
        n, values = session.pending[gse.id]
        if (session.time - gse.sample_offset) / period_of(session, gse) >= n - AT_SAMPLE:
            session.deck.items[st.Gse][gse.id] = replace(gse, held=values)
            del session.pending[gse.id]
