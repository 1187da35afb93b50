"""Parameters of cases from measured mesh harmonics, and which further measurement would tell what those at hand cannot.

The residual is (ln model - ln measured) / sigma, so that all harmonics count by their relative deviations. Sensors
with unknown gains shift the logarithms of a channel by the same amount: such shifts are projected out, which is the fit
of a free gain without its being a parameter of the search.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack

import numpy as np

from gearmbs.identify.fit import SIMULATION_STEP, FitKeywords, central, fit, noise_of_columns
from gearmbs.identify.identifiability import LIMIT, Identifiability
from gearmbs.identify.parameters import Fit, Free, IdentifyError, Scale
from gearmbs.progress import staged
from gearmbs.units import to_si

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.studies import Case

TOLERANCE = 1e-8
"""Tolerance of the integrator, so that differences over a step of 1e-2 are right to a few percent."""

COLUMNS = ("case", "channel", "harmonic", "value", "sigma")
"""Columns of a table of harmonics: which case, channel or component, harmonic, RMS, relative standard deviation."""
WAYS = ("band", "orders")
"""How levels are taken."""

Gains = Literal["none", "one", "channel", "case", "line"]

EXPERIMENTS: dict[str, dict[str, Any]] = {
    "speed x 1.5": {"operation.speed": 1.5},
    "speed x 0.5": {"operation.speed": 0.5},
    "torque x 2": {"operation.torque": 2.0},
    "misaligned by 0.5 deg": {"fault.misalignment": "0.5 deg"},
    "centre distance + 0.3 mm": {"fault.centre_distance_error": "0.3 mm"},
}
"""What most benches can do: by field a factor for speed and torque, else the new value."""

FACTORS = ("operation.speed", "operation.torque")


class ProblemKeywords(TypedDict, total=False):
    """Keywords of `CaseProblem`, for type checkers."""

    gains: Gains
    channels: Mapping[str, str] | None
    way: str
    workers: int


class CaseProblem:
    """Measured harmonics, and cases that predict them.

    Parameters
    ----------
    measured : DataFrame
        Columns ``case``, ``channel``, ``harmonic``, ``value`` and ``sigma`` (relative); see `harmonic_table`.
    cases : Case or mapping of str to Case
        By the names in the column ``case``; one case stands for everything measured.
    free : sequence of Free or str
        Paths of fields with their starts and bounds in any unit; of a plain path the start is the first case's value.
        A path belongs to all cases, or to one whose name stands before it: "high:operation.torque".
    gains : {"none", "one", "channel", "case", "line"}
        Free gains: none, one for all, one for each channel, one for each channel of each case, or one for each harmonic
        of each channel, which stands for an unknown transfer path and leaves the changes from case to case.
    channels : mapping of str to str, optional
        Component of the force that stands for each measured channel; default the channel's own name.
    way : {"band", "orders"}
        How the levels were taken.
    workers : int
        Simulations side by side.

    Raises
    ------
    IdentifyError
        For unknown cases, channels, fields and units.
    """

    def __init__(
        self,
        measured: pd.DataFrame,
        cases: Mapping[str, Case] | Case,
        free: Sequence[Free | str],
        *,
        gains: Gains = "none",
        channels: Mapping[str, str] | None = None,
        way: str = "band",
        workers: int = 1,
    ) -> None:
        from gearmbs.studies import Case as CaseClass
        from gearmbs.studies.case.limits import HARMONICS

        self.table = check_table(measured)
        if isinstance(cases, CaseClass):
            cases = dict.fromkeys(self.table["case"], cases)
        if not isinstance(cases, Mapping) or not cases:
            raise IdentifyError("cases: give a Case, or cases by the names in the column case")
        if way not in WAYS:
            raise IdentifyError(f"way is {way!r}; choose one of {', '.join(WAYS)}")
        self.cases = {
            str(name): case.as_one_of_many().changed(solver={"tolerance": TOLERANCE}) for name, case in cases.items()
        }
        self.way, self.workers = way, workers
        self.free = [_in_si(item, self.cases) for item in ((free,) if isinstance(free, str | Free) else free)]
        paths = [path for item in self.free for path in (item.name, *item.also)]
        doubled = sorted({path for path in paths if paths.count(path) > 1})
        if doubled or not paths:
            raise IdentifyError(f"free: {', '.join(doubled)} more than once" if paths else "free: give a parameter")
        if (most := int(self.table["harmonic"].max())) > HARMONICS:
            raise IdentifyError(f"measured: harmonic {most}; cases give the first {HARMONICS}, leave the others out")
        unknown = set(self.table["case"]) - set(self.cases)
        if unknown:
            raise IdentifyError(f"measured: no case is given for {', '.join(sorted(unknown))}")
        from gearmbs.signals import COMPONENTS

        self.components = [str((channels or {}).get(c, c)) for c in self.table["channel"]]
        wrong = sorted(set(self.components) - set(COMPONENTS))
        if wrong:
            raise IdentifyError(
                f"channels: {', '.join(wrong)} is no component of the force; say which one it stands for, "
                f"channels={{...: "
                f"one of {', '.join(COMPONENTS)}}}"
            )
        self.gains, self.channels = gains, dict(channels or {})
        self.groups = _groups(self.table, gains)
        self._known: dict[tuple[str, tuple[float, ...]], dict[tuple[str, int], float]] = {}

    @property
    def lost(self) -> int:
        """Degrees of freedom that the gains use up."""
        return 0 if self.groups is None else int(self.groups.max()) + 1

    @property
    def simulations(self) -> int:
        """Simulations so far."""
        return len(self._known)

    def with_case(self, name: str, case: Case, like: str, known: Sequence[str] = ()) -> CaseProblem:
        """Return the problem with one more case, measured as another one was; its values stand for none yet.

        What is unknown of the other case alone is as unknown of this one, in the ratio of their values, unless its path
        is ``known``.
        """
        import pandas as pd

        more = self.table[self.table["case"] == like].assign(case=name, value=1.0)
        table = pd.concat([self.table, more], ignore_index=True)
        settings: dict[str, Any] = {"gains": self.gains, "channels": self.channels, "way": self.way}
        cases = {**self.cases, name: case}
        free = []
        for item in self.free:
            owned = {
                path: factor for path, factor in {item.name: 1.0, **item.also}.items() if path.startswith(f"{like}:")
            }
            tied = {}
            for path, factor in owned.items():
                place = path.removeprefix(f"{like}:")
                if place not in known:
                    ratio = _field(f"{name}:{place}", cases)[0] / _field(path, cases)[0]
                    tied[f"{name}:{place}"] = factor * ratio
            free.append(replace(item, also={**item.also, **tied}))
        found = CaseProblem(table, cases, free, workers=self.workers, **settings)
        found._known = dict(self._known)
        return found

    def case(self, name: str, p: Sequence[float]) -> Case:
        """Return a case with the parameters p."""
        sections: dict[str, Any] = {}
        for free, value in zip(self.free, p):
            for path, factor in {free.name: 1.0, **free.also}.items():
                owner, _, place = path.rpartition(":")
                if owner not in ("", name):
                    continue
                section, _, field = place.partition(".")
                sections.setdefault(section, {})[field] = factor * float(value)
        return self.cases[name].changed(**sections)

    def _own(self, name: str, p: Sequence[float] | np.ndarray) -> tuple[float, ...]:
        """Return p with the starts of what belongs to other cases, so that nothing is simulated twice."""
        found = []
        for free, value in zip(self.free, p):
            owners = {path.rpartition(":")[0] for path in (free.name, *free.also)}
            found.append(float(value) if owners & {"", name} else float(free.start))
        return tuple(found)

    def _simulate(self, key: tuple[str, tuple[float, ...]]) -> dict[tuple[str, int], float]:
        from gearmbs.studies import SimulationFailed, run_case

        name, p = key
        try:
            record = run_case(self.case(name, p), False, variables=["gmf_rms"])
            levels = record["gmf_rms"].sel(way=self.way)
        except (SimulationFailed, ValueError):
            return {}
        return {
            (str(c), int(h)): float(levels.sel(component=c, harmonic=h))
            for c in levels.component.values
            for h in levels.harmonic.values
        }

    def predictions(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the logarithms of the predicted values, gains left out, for several parameter vectors; NaN where it
        fails."""
        names = list(dict.fromkeys(self.table["case"]))
        lost = np.full(len(self.table), np.nan)
        keys = [(name, self._own(name, p)) for p in points if np.isfinite(p).all() for name in names]
        new = [key for key in dict.fromkeys(keys) if key not in self._known]
        if self.workers > 1 and len(new) > 1:
            with ThreadPoolExecutor(self.workers) as pool:
                self._known.update(zip(new, pool.map(self._simulate, new)))
        else:
            self._known.update((key, self._simulate(key)) for key in new)
        found = []
        for p in points:
            if not np.isfinite(p).all():
                found.append(lost)
                continue
            own = {name: self._known[name, self._own(name, p)] for name in names}
            rows = zip(self.table["case"], self.components, self.table["harmonic"])
            levels = [own[str(n)].get((c, int(h)), np.nan) for n, c, h in rows]
            with np.errstate(all="ignore"):
                found.append(self._without_gains(np.log(np.array(levels))))
        return found

    def _without_gains(self, logs: np.ndarray) -> np.ndarray:
        """Return logarithms less the weighted mean of their group."""
        if self.groups is None:
            return logs
        weight = 1.0 / self.table["sigma"].to_numpy() ** 2
        total = np.bincount(self.groups, weight)
        mean = np.bincount(self.groups, weight * logs) / total
        return logs - mean[self.groups]

    @property
    def measured(self) -> np.ndarray:
        """Logarithms of the measured values, gains left out."""
        return self._without_gains(np.log(self.table["value"].to_numpy()))

    @property
    def sigma(self) -> np.ndarray:
        """Standard deviations of the logarithms."""
        return self.table["sigma"].to_numpy()

    def derivatives(self, p: Sequence[float] | None = None) -> np.ndarray:
        """Return the derivatives of the predictions over their standard deviations, shape (m, n).

        They are those by the logarithm of each parameter; of one fitted as it is, times its magnitude, which is the
        same, or where that is zero half the distance of its bounds, if it has any.
        """
        return self._derivatives(p)[0]

    def _derivatives(self, p: Sequence[float] | None) -> tuple[np.ndarray, np.ndarray, Any]:
        scale = Scale(tuple(self.free))
        z = scale.z([f.start for f in self.free] if p is None else p)

        def many(points: Sequence[np.ndarray]) -> list[np.ndarray]:
            return [f / self.sigma for f in self.predictions([scale.p(q) for q in points])]

        h = SIMULATION_STEP * self._magnitudes(z)
        matrix = central(many, z, h)
        if not np.isfinite(matrix).all():
            raise IdentifyError("the simulations fail about the start; give another one")
        return matrix * self._magnitudes(z), h, many

    def _magnitudes(self, z: np.ndarray) -> np.ndarray:
        """Return by what derivatives in z become those by logarithms."""
        low, high = Scale(tuple(self.free)).bounds()
        reach = np.where(np.isfinite(high - low), 0.5 * (high - low), 1.0)
        return np.where([f.log for f in self.free], 1.0, np.where(z == 0.0, reach, np.abs(z)))

    def identifiability(
        self, p: Sequence[float] | None = None, *, noise: bool = True, limit: float = LIMIT
    ) -> Identifiability:
        """Return what the measured numbers can tell at p, default the starts: four simulations a parameter and case.

        Parameters
        ----------
        noise : bool
            Judge the noise of the differences, too, at half the step; else two simulations suffice.
        """
        matrix, h, many = self._derivatives(p)
        scale = Scale(tuple(self.free))
        z = scale.z([f.start for f in self.free] if p is None else p)
        size = self._magnitudes(z)
        floor = size * noise_of_columns(many, z, h, matrix / size) if noise else np.zeros(len(self.free))
        return Identifiability(scale.names, matrix, floor, limit)

    def fit(self, **settings: Unpack[FitKeywords]) -> Fit:
        """Find the parameters; see `gearmbs.identify.fit` for the settings.

        The step and the end of the search are those that fit the integrator's noise.
        """
        chosen: FitKeywords = {"step": SIMULATION_STEP, "tolerance": 1e-4, **settings}
        return fit(
            lambda p: self.predictions([p])[0],
            self.measured,
            self.free,
            sigma=self.sigma,
            many=self.predictions,
            lost=self.lost,
            **chosen,
        )


def identify(
    measured: pd.DataFrame,
    cases: Mapping[str, Case] | Case,
    free: Sequence[Free | str],
    *,
    check: bool = True,
    tell: Callable[[str], None] | None = None,
    starts: int = 1,
    progress: Callable[[float, str], None] | None = None,
    **settings: Unpack[ProblemKeywords],
) -> Fit:
    """Find parameters of cases from measured mesh harmonics.

    Parameters
    ----------
    measured : DataFrame
        See `CaseProblem`.
    cases : Case or mapping of str to Case
        One case stands for everything measured.
    free : sequence of Free or str
    check : bool
        Look first at what the numbers can tell, and refuse what they cannot.
    tell : callable, optional
        Is told the remarks, when they are not to be an error.
    starts : int
        Searches from different starts.
    progress : callable, optional
        As for `fit`.
    **settings
        Of `CaseProblem`.

    Raises
    ------
    IdentifyError
        If a combination of the parameters is not determined; the message names it. With ``tell``, or ``check=False``,
        the fit is made all the same.

    Examples
    --------
    >>> found = identify(table, case, ["contact.depth", "friction.static"], gains="one")  # doctest: +SKIP
    >>> print(found.report())  # doctest: +SKIP
    """
    problem = CaseProblem(measured, cases, free, **settings)
    if check:
        remarks = problem.identifiability(noise=tell is not None).remarks()
        if remarks and tell is None:
            raise IdentifyError("measured: not enough for these parameters. " + ". ".join(remarks))
        for line in remarks:
            assert tell is not None
            tell(line)
    return problem.fit(starts=starts, progress=progress)


def compare_models(problems: Mapping[str, CaseProblem], **settings: Unpack[FitKeywords]) -> pd.DataFrame:
    """Fit several models to the same data and compare them: skew or inclination, with or without friction.

    Returns
    -------
    DataFrame
        By model cost, chi-square over degrees of freedom, AIC, BIC, their differences from the best and Akaike's
        weights,
        best first; the fits are in ``attrs["fits"]``.
    """
    import pandas as pd

    fits = {name: problem.fit(**settings) for name, problem in problems.items()}
    rows = {n: {"cost": f.cost, "chi_square": f.chi_square, "aic": f.aic, "bic": f.bic} for n, f in fits.items()}
    table = pd.DataFrame.from_dict(rows, orient="index").sort_values("aic")
    table["delta_aic"] = table.aic - table.aic.min()
    weight = np.exp(-0.5 * table["delta_aic"])
    table["weight"] = weight / weight.sum()
    table.attrs["fits"] = fits
    return table


def _groups(table: pd.DataFrame, gains: str) -> np.ndarray | None:
    """Return which free gain each row has."""
    keys = {
        "none": None,
        "one": [],
        "channel": ["channel"],
        "case": ["case", "channel"],
        "line": ["channel", "harmonic"],
    }
    if gains not in keys:
        raise IdentifyError(f"gains is {gains!r}; choose one of {', '.join(keys)}")
    columns = keys[gains]
    if columns is None:
        return None
    rows = list(zip(*(table[c] for c in columns))) if columns else [()] * len(table)
    places = {row: k for k, row in enumerate(dict.fromkeys(rows))}
    return np.array([places[row] for row in rows])


def _in_si(item: Free | str, cases: Mapping[str, Case]) -> Free:
    """Return a parameter with its start and bounds in SI; a path starts at its case's value."""
    path = item if isinstance(item, str) else item.name
    value, unit = _field(path, cases)
    if isinstance(item, str):
        return Free(path, value, log=value > 0.0)
    for other in item.also:
        _field(other, cases)

    def number(given: Any) -> Any:
        try:
            return None if given is None else to_si(given, unit, path)
        except (ValueError, TypeError) as error:
            raise IdentifyError(str(error)) from None

    found = replace(item, start=number(item.start), low=number(item.low), high=number(item.high))
    # refused here rather than after the simulations that come first
    Scale((found,)).bounds()
    return found


def _field(path: str, cases: Mapping[str, Case]) -> tuple[float, str]:
    """Return the value and the SI unit of a number of a case, whose name may stand before the path."""
    from gearmbs.studies.case.sections import units_of_fields

    owner, _, place = path.rpartition(":")
    if owner and owner not in cases:
        raise IdentifyError(f"{path}: there is no case {owner!r}; the cases are {', '.join(cases)}")
    section, _, field = place.partition(".")
    holder = getattr(cases[owner] if owner else next(iter(cases.values())), section, None)
    if holder is None or field not in getattr(type(holder), "model_fields", {}):
        raise IdentifyError(f"{path}: a case has no such field; write section.field, for instance contact.depth")
    unit = units_of_fields(holder).get(field, "1")
    unit = "dimensionless" if unit == "1" else unit
    try:
        return to_si(getattr(holder, field), unit, path), unit
    except (ValueError, TypeError):
        raise IdentifyError(f"{path} is {getattr(holder, field)!r}, which is no number that could be fitted") from None


def check_table(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of harmonics with its columns checked; ``sigma`` is 2 % where it is missing.

    Raises
    ------
    IdentifyError
        For missing columns and values that have no logarithm.
    """
    import pandas as pd

    if not isinstance(table, pd.DataFrame):
        raise IdentifyError(f"measured is a {type(table).__name__}; give a DataFrame with {', '.join(COLUMNS)}")
    missing = [c for c in COLUMNS[:4] if c not in table.columns]
    if missing:
        raise IdentifyError(f"measured: columns {', '.join(missing)} are missing; give {', '.join(COLUMNS)}")
    if table.empty:
        raise IdentifyError("measured: the table has no rows")
    table = table.copy()
    for name in ("case", "channel"):
        if table[name].isna().any():
            raise IdentifyError(f"measured: {name} is missing in a row")
        table[name] = table[name].map(str)
    if "sigma" not in table.columns:
        table["sigma"] = 0.02
    for name in ("harmonic", "value", "sigma"):
        try:
            table[name] = pd.to_numeric(table[name])
        except (ValueError, TypeError) as error:
            raise IdentifyError(f"measured: column {name}: {error}") from None
    if not ((table["harmonic"] >= 1) & (table["harmonic"] % 1 == 0)).all():
        raise IdentifyError("measured: harmonic must be a whole number, 1 or more, in every row")
    finite = np.isfinite(table[["value", "sigma"]].to_numpy(dtype=float)).all()
    if not (finite and ((table["value"] > 0.0) & (table["sigma"] > 0.0)).all()):
        raise IdentifyError("measured: value and sigma must be positive and finite in every row; leave out the others")
    return table.reset_index(drop=True)


@staged("ranking experiments")
def rank_experiments(
    problem: CaseProblem,
    candidates: Mapping[str, Mapping[str, Any]] | None = None,
    *,
    of: str | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> pd.DataFrame:
    """Rank further measurements by how much better the worst known combination would be known.

    Each candidate is simulated about the starts and added to what was measured, with the same channels, harmonics,
    standard deviations and gains. What is unknown of the case that is changed is so of the candidate, too: twice an
    unknown torque is unknown. What a candidate gives as a value with its unit is known.

    Parameters
    ----------
    problem : CaseProblem
    candidates : mapping, optional
        By name what is changed of a case: fields with values in any unit, of speed and torque numbers are factors.
        Default `EXPERIMENTS`.
    of : str, optional
        Case that is changed; default the first.
    progress : callable, optional
        Called as progress(fraction, experiment); without it a bar is shown where somebody watches.

    Returns
    -------
    DataFrame
        By experiment, best first: ``worst``, the standard deviation of the worst known combination of logarithms with
        it; ``gain``, the factor by which that is better than without; ``together``, the largest of the parameters' own.
        Experiments that cannot be simulated are last, with NaN.

    Raises
    ------
    IdentifyError
        For fields that a case does not have.
    """
    import pandas as pd

    before = np.linalg.svd(problem.derivatives(), compute_uv=False)[-1]
    rows = {}
    asked = EXPERIMENTS if candidates is None else candidates
    for k, (name, changes) in enumerate(asked.items()):
        if progress is not None:
            progress((k + 1) / (len(asked) + 1), name)
        rows[name] = _worth(problem, name, changes, of or next(iter(problem.cases)), before)
    table = pd.DataFrame.from_dict(rows, orient="index").sort_values("worst", na_position="last")
    table.index.name = "experiment"
    return table


def _worth(problem: CaseProblem, name: str, changes: Mapping[str, Any], of: str, before: float) -> dict[str, float]:
    """Return what an experiment is worth."""
    from gearmbs.identify.parameters import errors_of

    given = [path for path, value in changes.items() if path not in FACTORS or isinstance(value, str)]
    joint = problem.with_case(name, _changed(problem, changes, of), like=of, known=given)
    try:
        matrix = joint.derivatives()
    except IdentifyError:
        return {"worst": float("nan"), "gain": float("nan"), "together": float("nan")}
    after = np.linalg.svd(matrix, compute_uv=False)[-1]
    with np.errstate(all="ignore"):
        largest = float(errors_of(matrix)[0].max())
        return {"worst": float(1.0 / after), "gain": float(after / before), "together": largest}


def _changed(problem: CaseProblem, changes: Mapping[str, Any], of: str) -> Any:
    case = problem.cases[of]
    sections: dict[str, Any] = {}
    for path, value in changes.items():
        section, _, field = path.partition(".")
        holder = getattr(case, section, None)
        if holder is None or field not in type(holder).model_fields:
            raise IdentifyError(f"experiment: a case has no field {path!r}; write section.field")
        if path in FACTORS and not isinstance(value, str):
            value = float(value) * float(getattr(holder, field))
        sections.setdefault(section, {})[field] = value
    # rates follow the mesh frequency unless they are given
    return case.changed(**sections)
