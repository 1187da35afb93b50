"""Parameters of models of one's own: mechanisms, drivetrains and planetary sets made by a function of them.

Measured are harmonics of a steady motion, whose derivatives take no other motion (`gearmbs.steady_sensitivities`), or
signals over time, whose derivatives are followed along the run (`gearmbs.forward_sensitivities`).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from gearmbs.dae.orbits import NoOrbit
from gearmbs.dae.problem import ModelError
from gearmbs.drivetrain import Drivetrain
from gearmbs.identify.parameters import Free, IdentifyError, Scale, in_numbers
from gearmbs.identify.problem import Gains, LevelProblem, Problem
from gearmbs.identify.tables import check_table
from gearmbs.mechanism import Mechanism, forward_sensitivities, simulate, steady_motion, steady_sensitivities
from gearmbs.mechanism.solve.accuracy import chosen_accuracy
from gearmbs.mechanism.solve.sensitivities import TIGHTER
from gearmbs.units import QuantityLike, to_si

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism import Sensitivities
    from gearmbs.mechanism.solve.keywords import SensitivityOptions, SteadyOptions

Result = str | Callable[["Solution"], Any]
Build = Callable[..., Mechanism | Drivetrain]

TRIED = 2
"""How often derivatives along a run may be refused before they are no longer asked for: one value alone may leave out a
part of the model, as a damping of zero does of an expression."""

WHOLE = 1e-6
"""Part of a cycle by which a frequency times the period may miss a whole number: both are told to six digits."""


class _Models:
    """Models of the cases that were measured, each a function of all parameters."""

    def __init__(self, builds: Mapping[str, Build], free: Sequence[Free]) -> None:
        self.builds, self.free = dict(builds), list(free)
        if not self.free or not all(isinstance(item, Free) for item in self.free):
            raise IdentifyError("free: give parameters as Free(name, start), whose names are arguments of the model")
        self.free = [in_numbers(item) for item in self.free]
        if used := [item.name for item in self.free if item.also]:
            raise IdentifyError(f"free: {', '.join(used)}: also: belongs to cases; compute it inside the model")
        # refused here rather than after the simulations that come first
        Scale(tuple(self.free)).bounds()

    def parameters(self, p: Sequence[float]) -> dict[str, tuple[float, float]]:
        """Return values with scales by name."""
        found = {}
        for item, value in zip(self.free, p, strict=True):
            ends = [abs(end) for end in (item.low, item.high, item.start) if end]
            found[item.name] = float(value), abs(float(value)) or max(ends, default=1.0)
        return found

    def made(self, case: str, values: Mapping[str, float]) -> Mechanism | Drivetrain:
        """Return the model of a case."""
        found = self.builds[case](**values)
        if not isinstance(found, Mechanism | Drivetrain):
            raise IdentifyError(f"model of case {case!r}: it returned {found!r}; return a Mechanism or a Drivetrain")
        return found

    def build(self, case: str) -> Callable[..., Mechanism]:
        """Return what makes the mechanism of a case."""

        def mechanism(**values: float) -> Mechanism:
            made = self.made(case, values)
            return made.build() if isinstance(made, Drivetrain) else made

        return mechanism


def _by_case(model: Build | Mapping[str, Build], cases: Sequence[str]) -> dict[str, Build]:
    """Return the model of each case that was measured."""
    if callable(model):
        return dict.fromkeys(cases, model)
    if missing := sorted(set(cases) - set(model)):
        raise IdentifyError(f"measured: no model is given for {', '.join(missing)}; there is {', '.join(model)}")
    return dict(model)


def _check_channels(channels: Sequence[str], results: Mapping[str, Result]) -> None:
    if missing := sorted(set(channels) - set(results)):
        there = ", ".join(results) or "none"
        raise IdentifyError(f"results: channel {', '.join(missing)} has none, there is {there}; give what it measures")


class MotionProblem(LevelProblem):
    """Measured harmonics, and models whose steady motions predict them.

    Parameters
    ----------
    measured : DataFrame
        Columns ``case``, ``channel``, ``harmonic``, ``value`` (RMS) and ``sigma`` (relative); see `harmonic_table`, and
        `order_table` for spectra over orders.
    model : callable or mapping of str to callable
        ``model(**parameters)`` returns a mechanism or a drivetrain; of several cases by their names.
    free : sequence of Free
        Named as the model's arguments; in SI, or texts with units.
    results : mapping of str to str or callable
        By channel an expression in the function language of ADAMS, or what makes numbers of a solution, shape (m,).
    period : float or str, optional
        After which the motion repeats itself, s; of a drivetrain by default that of its teeth.
    frequency : float, str, or mapping of str to these, optional
        Of the first harmonic, Hz, for all channels or by channel; default 1/period. That of a mesh, or of a shaft whose
        orders were measured.
    gains : str
        As of `CaseProblem`.
    **settings
        As of `gearmbs.steady`; ``t_start`` of a drivetrain is by default the end of its run-up.

    Raises
    ------
    IdentifyError
        For channels and cases without a model or a result.
    """

    def __init__(
        self,
        measured: pd.DataFrame,
        model: Build | Mapping[str, Build],
        free: Sequence[Free],
        results: Mapping[str, Result],
        *,
        period: QuantityLike | None = None,
        frequency: Mapping[str, QuantityLike] | QuantityLike | None = None,
        gains: Gains = "none",
        **settings: Unpack[SteadyOptions],
    ) -> None:
        super().__init__(check_table(measured), gains)
        cases = list(dict.fromkeys(self.table["case"]))
        self._models = _Models(_by_case(model, cases), free)
        self.free, self.results, self.settings = self._models.free, dict(results), settings
        _check_channels(self.table["channel"], results)
        self._period = None if period is None else float(to_si(period, "time", "period"))
        self._frequency = _frequencies(frequency, list(results))
        self._known: dict[tuple[str, tuple[float, ...]], tuple[np.ndarray, np.ndarray | None]] = {}
        self._own = True
        self.motions = 0

    def predictions(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the logarithms of the predicted values, gains left out; NaN where there is no steady motion."""
        return [self.without_gains(self._joined(p)[0]) for p in points]

    def jacobian(self, p: np.ndarray) -> np.ndarray | None:
        """Return their derivatives, shape (m, n); None if a parameter leaves none but differences."""
        slopes = self._joined(p)[1]
        return None if slopes is None else self.without_gains(slopes)

    def _joined(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Return values and derivatives of all rows."""
        values = np.full(len(self.table), np.nan)
        slopes: np.ndarray | None = np.full((len(self.table), len(self.free)), np.nan)
        if not np.isfinite(p).all():
            return values, slopes
        for name in dict.fromkeys(self.table["case"]):
            key = name, tuple(map(float, p))
            if key not in self._known:
                self._known[key] = self._found(name, key[1])
            rows = (self.table["case"] == name).to_numpy()
            values[rows], own = self._known[key]
            if slopes is not None and own is not None:
                slopes[rows] = own
            else:
                slopes = None
        return values, slopes

    def _found(self, name: str, p: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray | None]:
        """Return logarithms of the rows of a case, and their derivatives."""
        parameters = self._models.parameters(p)
        made = self._models.made(name, {key: value for key, (value, _) in parameters.items()})
        period, settings = self._posed(name, made)
        build, rows = self._models.build(name), self.table[self.table["case"] == name]
        self.motions += 1
        try:
            if self._own:
                with warnings.catch_warnings():
                    # a parameter of another case has no part in this one
                    warnings.filterwarnings("ignore", message=".*changes no number of the model")
                    found = steady_sensitivities(build, parameters, period, **settings)
                values, by = self._lines(rows, period, found.motion.harmonics), found
                slopes = [self._lines(rows, period, lambda *a, key=key: by.harmonics(key, *a)) for key in parameters]
                return self._logs(values), np.stack([_relative(values, one) for one in slopes], axis=1)
        except NoOrbit as error:
            return self._none(name, error, rows)
        except ModelError as error:
            self._own = False
            self.notes.append(f"derivatives by differences: {error}")
        try:
            motion = steady_motion(build(**{key: value for key, (value, _) in parameters.items()}), period, **settings)
        except (NoOrbit, ModelError) as error:
            return self._none(name, error, rows)
        return self._logs(self._lines(rows, period, motion.harmonics)), None

    def _none(self, name: str, error: Exception, rows: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
        line = f"case {name!r} had no steady motion at some values: {error}"
        if not any(note.startswith(line[: line.index(":")]) for note in self.notes):
            self.notes.append(line)
        return np.full(len(rows), np.nan), np.full((len(rows), len(self.free)), np.nan)

    def _posed(self, name: str, made: Mechanism | Drivetrain) -> tuple[float, SteadyOptions]:
        """Return period and settings of a case."""
        if isinstance(made, Drivetrain):
            from gearmbs.studies.run.steady import mesh_period

            period = mesh_period(made) if self._period is None else self._period
            return period, {"t_start": made.run_up, **self.settings}
        if self._period is None:
            raise IdentifyError(f"model of case {name!r}: give the period of a mechanism, period = ... s")
        return self._period, self.settings

    def _lines(self, rows: pd.DataFrame, period: float, harmonics: Callable[..., np.ndarray]) -> np.ndarray:
        """Return the complex amplitudes of the rows of a case."""
        found = np.empty(len(rows), dtype=complex)
        channels = rows["channel"].to_numpy()
        numbers = rows["harmonic"].to_numpy(dtype=int)
        for channel in dict.fromkeys(channels):
            every = self._cycles(channel, period)
            of = channels == channel
            amplitudes = np.asarray(harmonics(self.results[channel], int(numbers[of].max()), every))
            if amplitudes.ndim != 1:
                raise IdentifyError(
                    f"results: {channel}: shape {amplitudes.shape[1:]} at each output; give one number, as a component"
                )
            found[of] = amplitudes[numbers[of]]
        return found

    def _cycles(self, channel: str, period: float) -> int:
        """Return how many cycles of a channel's first harmonic a period has."""
        frequency = self._frequency.get(channel)
        cycles = 1.0 if frequency is None else frequency * period
        if abs(cycles - round(cycles)) > WHOLE * max(1.0, cycles) or round(cycles) < 1:
            raise IdentifyError(
                f"frequency: {frequency:g} Hz of channel {channel} makes {cycles:.6g} cycles in the period of "
                f"{period:g} s; give one that makes a whole number, or the period after which it does"
            )
        return round(cycles)

    @staticmethod
    def _logs(lines: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.log(np.abs(lines) / np.sqrt(2.0))


def _frequencies(given: Any, channels: Sequence[str]) -> dict[str, float]:
    """Return the frequencies of first harmonics by channel, Hz; refuse those of channels that there are not."""
    if given is None:
        return {}
    table = given if isinstance(given, Mapping) else dict.fromkeys(channels, given)
    for name in table:
        if name not in channels:
            raise IdentifyError(
                f"frequency: there is no channel {name!r}; results has {', '.join(map(repr, channels))}"
            )
    return {name: float(to_si(value, "frequency", f"frequency[{name!r}]")) for name, value in table.items()}


def _relative(lines: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Return the derivatives of the logarithms of amounts."""
    with np.errstate(all="ignore"):
        return (np.conj(lines) * slopes).real / np.abs(lines) ** 2


class SignalProblem(Problem):
    """Measured signals over time, and models whose runs predict them.

    Parameters
    ----------
    signals : DataArray or mapping of str to DataArray
        Dimensions (time, channel), as of `gearmbs.signals.make_signal`; of several cases by their names. Times count
        from the start of the run.
    model : callable or mapping of str to callable
        ``model(**parameters)`` returns a mechanism or a drivetrain.
    free : sequence of Free
        Named as the model's arguments; in SI, or texts with units.
    results : mapping of str to str or callable
        By channel an expression in the function language of ADAMS, or what makes numbers of a solution, shape (m,), in
        the signal's unit.
    sigma : float or mapping of str to float
        Standard deviation of the noise, in the channel's unit, for all channels or by channel. Noise of neighbouring
        samples is taken to be independent: of a filtered or oversampled signal give fewer samples.
    **settings
        As of `gearmbs.forward_sensitivities`, such as ``tol`` and ``lump``.

    Raises
    ------
    IdentifyError
        For channels and cases without a model or a result.
    """

    def __init__(
        self,
        signals: xr.DataArray | Mapping[str, xr.DataArray],
        model: Build | Mapping[str, Build],
        free: Sequence[Free],
        results: Mapping[str, Result],
        *,
        sigma: Mapping[str, float] | float,
        tol: float | None = None,
        lump: bool | None = None,
        **settings: Unpack[SensitivityOptions],
    ) -> None:
        given = dict(signals) if isinstance(signals, Mapping) else {"measured": signals}
        for name, one in given.items():
            if not {"time", "channel"} <= {*getattr(one, "dims", ())}:
                raise IdentifyError(f"signals: {name} has no dimensions time and channel; make one by make_signal")
            if float(one["time"][0]) < 0.0 or not np.isfinite(one.values).all():
                raise IdentifyError(f"signals: {name}: times must not be negative, and all values finite")
            times = one["time"].values.astype(float)
            if not (np.diff(times) > 0.0).all():
                k = int(np.argmin(np.diff(times) > 0.0))
                raise IdentifyError(
                    f"signals: {name}: time {times[k + 1]:g} s comes behind {times[k]:g} s; give times in a row, each "
                    "later than the one before"
                )
            _check_channels([str(c) for c in one["channel"].values], results)
        self.signals = given
        self._models = _Models(_by_case(model, list(given)), free)
        self.free, self.results, self.notes = self._models.free, dict(results), []
        self._settings: dict[str, Any] = {"tol": tol, "lump": lump, **settings}
        by = (
            sigma
            if isinstance(sigma, Mapping)
            else {str(c): sigma for s in given.values() for c in s["channel"].values}
        )
        self._sigma = {name: float(value) for name, value in by.items()}
        self._known: dict[tuple[float, ...], tuple[np.ndarray, np.ndarray | None]] = {}
        self._refused = 0
        self.runs = 0

    @property
    def measured(self) -> np.ndarray:
        """All values, channel by channel, case by case."""
        return np.concatenate([s.transpose("channel", "time").values.ravel() for s in self.signals.values()])

    @property
    def sigma(self) -> np.ndarray:
        """Their standard deviations."""
        found = []
        for name, s in self.signals.items():
            for channel in map(str, s["channel"].values):
                if channel not in self._sigma:
                    raise IdentifyError(f"sigma: channel {channel} of {name} has none; give it")
                found.append(np.full(s.sizes["time"], self._sigma[channel]))
        return np.concatenate(found)

    def predictions(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the predicted values for several parameter vectors; NaN where a run fails."""
        return [self._found(p)[0] for p in points]

    def jacobian(self, p: np.ndarray) -> np.ndarray | None:
        """Return their derivatives, shape (m, n); None where a run has none but differences."""
        return self._found(p)[1]

    def _found(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        key = tuple(map(float, p))
        if key not in self._known:
            self._known[key] = self._run(key)
        return self._known[key]

    def _run(self, p: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray | None]:
        """Return predictions and derivatives from one run of each case; None where a run has no derivatives."""
        values: list[np.ndarray] = []
        slopes: list[np.ndarray] | None = []
        for name, signal in self.signals.items():
            t = signal["time"].values.astype(float)
            later = t > 0.0
            times = np.concatenate([[0.0], t[later]])
            kept = slice(0 if not later[0] else 1, None)
            try:
                found, solution = self._simulated(name, p, times)
            except ModelError as error:
                self._note(f"a run failed: {error}")
                values.append(np.full(signal.size, np.nan))
                if slopes is not None:
                    slopes.append(np.full((signal.size, len(self.free)), np.nan))
                continue
            if found is None:
                slopes = None
            for channel in map(str, signal["channel"].values):
                result = self.results[channel]
                at = solution.evaluate(result) if isinstance(result, str) else result(solution)
                values.append(np.asarray(at, dtype=float)[kept])
                if slopes is not None and found is not None:
                    slopes.append(np.stack([found.derivative(f.name, result)[kept] for f in self.free], axis=1))
        return np.concatenate(values), None if slopes is None else np.concatenate(slopes)

    def _simulated(self, name: str, p: tuple[float, ...], times: np.ndarray) -> tuple[Sensitivities | None, Solution]:
        """Return the run of a case with its derivatives; without them if they are refused, `TRIED` times or now.

        Raises
        ------
        ModelError
            If it fails without them, too.
        """
        if self._refused >= TRIED:
            return None, self._run_alone(name, p, times)
        self.runs += 1
        try:
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", message=".*changes no number of the model")
                found = forward_sensitivities(
                    self._models.build(name), self._models.parameters(p), times[-1], t_eval=times, **self._settings
                )
            return found, found.solution
        except ModelError as error:
            solution = self._run_alone(name, p, times)
            self._refused += 1
            self._note(f"derivatives by differences: {error}")
            return None, solution

    def _run_alone(self, name: str, p: tuple[float, ...], times: np.ndarray) -> Solution:
        """Return the run of a case without derivatives, at the tolerance that they would have.

        Raises
        ------
        ModelError
            If it fails.
        """
        mechanism = self._models.build(name)(**{key: value for key, (value, _) in self._models.parameters(p).items()})
        settings = dict(self._settings)
        given, scale = settings.pop("tol"), settings.pop("rate_scale", None)
        usual, scale = chosen_accuracy(mechanism, (0.0, times[-1]), given, scale)
        tol = TIGHTER * usual if given is None else usual
        self.runs += 1
        solution = simulate(mechanism, times[-1], t_eval=times, tol=tol, rate_scale=scale, **settings)
        if not solution.result.success:
            raise ModelError(solution.message)
        return solution

    def _note(self, line: str) -> None:
        """Note what kind of thing happened, once."""
        if not any(note.startswith(line[: line.index(":")]) for note in self.notes):
            self.notes.append(line)


def order_table(
    spectra: Mapping[str, xr.DataArray], orders: Sequence[float], *, first: float = 1.0, sigma: float = 0.02
) -> pd.DataFrame:
    """Return the lines of spectra over orders as a table of harmonics for `MotionProblem`.

    Parameters
    ----------
    spectra : mapping of str to DataArray
        By case, dimensions (order, channel), amplitudes or RMS, as of `gearmbs.signals.order_spectrum`.
    orders : sequence of float
        Which lines: the largest value within half a line of each is taken.
    first : float
        Order of the first harmonic; the others are multiples of it.
    sigma : float
        Relative standard deviation of all.

    Raises
    ------
    IdentifyError
        For orders that the spectrum does not reach, or that are no multiples of the first; scalings other than
        amplitude and RMS.
    """
    import pandas as pd

    rows = []
    for case, spectrum in spectra.items():
        scaling = spectrum.attrs.get("scaling", "amplitude")
        if scaling not in ("amplitude", "rms"):
            raise IdentifyError(f"spectra: {case} is scaled as {scaling!r}; make it with scaling 'amplitude' or 'rms'")
        share = np.sqrt(0.5) if scaling == "amplitude" else 1.0
        lines = spectrum["order"].values
        wide = 0.5 * (lines[1] - lines[0]) * (1.0 + WHOLE)
        for order in orders:
            number = order / first
            if abs(number - round(number)) > WHOLE * max(1.0, number) or round(number) < 1:
                raise IdentifyError(f"orders: {order:g} is no multiple of first = {first:g}")
            near = np.abs(lines - order) <= wide
            if not near.any():
                raise IdentifyError(f"orders: {order:g} is not within the {lines[-1]:g} orders of {case}")
            values = share * spectrum.transpose("order", "channel").values[near].max(axis=0)
            rows += [(case, str(c), round(number), float(v), sigma) for c, v in zip(spectrum["channel"].values, values)]
    return check_table(pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"]))
