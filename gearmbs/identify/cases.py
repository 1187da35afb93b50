"""Parameters of cases from measured mesh harmonics, and which further measurement would tell what those at hand cannot.

The residual is (ln model - ln measured) / sigma, so that all harmonics count by their relative deviations. Sensors
with unknown gains shift the logarithms of a channel by the same amount: such shifts are projected out, which is the fit
of a free gain without its being a parameter of the search.

Harmonics of a steady motion have derivatives without a run beside it (`gearmbs.studies.run.steady_levels`); where there
is no such motion, or a field changes its period, they are differences.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack

import numpy as np

from gearmbs.identify.fit import SIMULATION_STEP, FitKeywords
from gearmbs.identify.parameters import Fit, Free, IdentifyError
from gearmbs.identify.problem import COARSER, Gains, LevelProblem
from gearmbs.identify.stored import Levels, Stored
from gearmbs.identify.tables import check_table, field_of, in_si

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.studies import Case
    from gearmbs.studies.run.steady_levels import SteadyLevels

TOLERANCE = 1e-8
"""Tolerance of the integrator, so that differences over a step of 1e-2 are right to a few percent."""

WAYS = ("band", "orders")
"""How levels are taken."""

DERIVATIVES = ("steady", "differences")
"""Where derivatives come from."""

ALIKE = 0.02
"""Part of the largest harmonic of its component that a record's may differ from the steady motion's, if that motion's
derivatives are to stand for the record's: they are then off by as little, which a search does not notice."""

KEPT = 16
"""Motions that are kept for their derivatives: a search asks for those of the last ones."""

Key = tuple[str, tuple[float, ...]]


class ProblemKeywords(TypedDict, total=False):
    """Keywords of `CaseProblem`, for type checkers."""

    gains: Gains
    channels: Mapping[str, str] | None
    way: str
    workers: int
    derivatives_by: Literal["steady", "differences"]
    store: str | Path | None


class CaseProblem(LevelProblem):
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
    derivatives_by : {"steady", "differences"}
        Of the steady motion, with one motion for residuals and Jacobian: a case at ``duration = "auto"`` is then that
        motion, one with a duration is simulated as it is. Or differences of simulations, two for each parameter.
    store : path-like, optional
        A folder in which what was simulated is kept: a fit that was interrupted goes on from there, and another one of
        the same cases, or its profiles, simulate nothing twice.

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
        derivatives_by: Literal["steady", "differences"] = "steady",
        store: str | Path | None = None,
    ) -> None:
        from gearmbs.studies import Case as CaseClass
        from gearmbs.studies.case.limits import HARMONICS

        super().__init__(check_table(measured), gains)
        if isinstance(cases, CaseClass):
            cases = dict.fromkeys(self.table["case"], cases)
        if not isinstance(cases, Mapping) or not cases:
            raise IdentifyError("cases: give a Case, or cases by the names in the column case")
        for name, value, choices in (("way", way, WAYS), ("derivatives_by", derivatives_by, DERIVATIVES)):
            if value not in choices:
                raise IdentifyError(f"{name} is {value!r}; choose one of {', '.join(choices)}")
        self.cases = {
            str(name): case.as_one_of_many().changed(solver={"tolerance": TOLERANCE}) for name, case in cases.items()
        }
        self.way, self.workers = way, workers
        self.free = [in_si(item, self.cases) for item in ((free,) if isinstance(free, str | Free) else free)]
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
        self.channels = dict(channels or {})
        self.derivatives_by, self.store = derivatives_by, None if store is None else Stored(Path(store))
        self._known: dict[Key, Levels] = {}
        self._slopes: dict[Key, np.ndarray] = {}
        self._motions: dict[Key, SteadyLevels] = {}
        self._without: dict[str, str] = {}
        self.simulations = 0

    def __getstate__(self) -> dict[str, Any]:
        """Return what copies take: motions stay, and are found again where they are asked for."""
        return self.__dict__ | {"_motions": {}}

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
                    ratio = field_of(f"{name}:{place}", cases)[0] / field_of(path, cases)[0]
                    tied[f"{name}:{place}"] = factor * ratio
            free.append(replace(item, also={**item.also, **tied}))
        found = CaseProblem(table, cases, free, workers=self.workers, derivatives_by=self.derivatives_by, **settings)
        found.store = self.store
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

    def _simulate(self, key: Key) -> Levels:
        """Return the levels of a case with parameters; none where it fails."""
        case = self.case(*key)
        if self.store is not None and (stored := self.store.levels(case, self.derivatives_by, self.way)) is not None:
            return stored
        self.simulations += 1
        found = self._of_motion(key, case) if case.is_auto and self.derivatives_by == "steady" else None
        if found is None:
            found = self._of_run(case)
        if self.store is not None:
            self.store.keep_levels(case, self.derivatives_by, self.way, found)
        return found

    def _of_run(self, case: Case) -> Levels:
        from gearmbs.studies.run.record import values_of
        from gearmbs.studies.run.simulation import SimulationFailed, plain_record

        try:
            record = plain_record(case, False, variables=["gmf_rms"])
        except (SimulationFailed, ValueError):
            return {}
        levels, ways = values_of(record, "gmf_rms"), values_of(record, "way")
        (found,) = levels[ways == self.way]
        return {
            (str(c), int(h)): float(found[i, j])
            for i, h in enumerate(values_of(record, "harmonic"))
            for j, c in enumerate(values_of(record, "component"))
        }

    def _of_motion(self, key: Key, case: Case) -> Levels | None:
        """Return the levels of a case's steady motion, which is kept for its derivatives; None if it has none."""
        from gearmbs.studies.run.steady_levels import levels_or_reason

        found = levels_or_reason(case)
        if isinstance(found, str):
            self._without.setdefault(key[0], found)
            return None
        self._motions[key] = found
        while len(self._motions) > max(KEPT, len(self.cases)):
            self._motions.pop(next(iter(self._motions)))
        return found.levels(self.way)

    def predictions(self, points: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return the logarithms of the predicted values, gains left out, for several parameter vectors; NaN where it
        fails."""
        names = list(dict.fromkeys(self.table["case"]))
        lost = np.full(len(self.table), np.nan)
        self._find([(name, self._own(name, p)) for p in points if np.isfinite(p).all() for name in names])
        found = []
        for p in points:
            if not np.isfinite(p).all():
                found.append(lost)
                continue
            own = {name: self._known[name, self._own(name, p)] for name in names}
            rows = zip(self.table["case"], self.components, self.table["harmonic"])
            levels = [own[str(n)].get((c, int(h)), np.nan) for n, c, h in rows]
            with np.errstate(all="ignore"):
                found.append(self.without_gains(np.log(np.array(levels))))
        return found

    def _find(self, keys: Sequence[Key]) -> None:
        """Simulate what is not known yet."""
        new = [key for key in dict.fromkeys(keys) if key not in self._known]
        if self.workers > 1 and len(new) > 1:
            with ThreadPoolExecutor(self.workers) as pool:
                self._known.update(zip(new, pool.map(self._simulate, new)))
        else:
            self._known.update((key, self._simulate(key)) for key in new)

    def jacobian(self, p: np.ndarray) -> np.ndarray | None:
        """Return the derivatives of the predictions by the parameters, shape (m, n); NaN where a simulation fails."""
        if self.derivatives_by == "differences":
            return None
        p = np.asarray(p, dtype=float)
        keys = {name: (name, self._own(name, p)) for name in dict.fromkeys(self.table["case"])}
        self._find(list(keys.values()))
        new = [key for key in keys.values() if key not in self._slopes]
        if self.workers > 1 and len(new) > 1:
            with ThreadPoolExecutor(self.workers) as pool:
                self._slopes.update(zip(new, pool.map(self._slopes_of, new)))
        else:
            self._slopes.update((key, self._slopes_of(key)) for key in new)
        rows = np.empty((len(self.table), len(self.free)))
        for name, key in keys.items():
            places = np.flatnonzero((self.table["case"] == name).to_numpy())
            rows[places] = self._slopes[key]
        return self.without_gains(rows)

    def _slopes_of(self, key: Key) -> np.ndarray:
        """Return the derivatives of the logarithms of a case's rows of the table by the parameters."""
        name, p = key
        case, rows, store = self.case(name, p), self._rows_of(name), self.store
        free = {k: own for k, item in enumerate(self.free) if (own := self._as_of(item, name)) is not None}
        known: dict[int, Levels] = {}
        if store is not None:
            stored = {k: store.slopes(case, item, self.way) for k, item in free.items()}
            known = {k: found for k, found in stored.items() if found is not None}
        new = [k for k in free if k not in known]
        found = self._slopes_of_motion(key, new)
        found |= {k: self._difference(key, k) for k in new if k not in found}
        if store is not None:
            for k, one in found.items():
                store.keep_slopes(case, free[k], self.way, one)
        slopes = np.zeros((len(rows), len(self.free)))
        for k, one in (known | found).items():
            slopes[:, k] = [one.get(row, np.nan) for row in rows]
        return slopes

    def _as_of(self, item: Free, name: str) -> Free | None:
        """Return a parameter as that of one case, None if it has no part in it."""
        paths = {path: factor for path, factor in {item.name: 1.0, **item.also}.items()}
        own = {path: f for path, f in paths.items() if path.rpartition(":")[0] in ("", name)}
        return Free(item.name, 1.0, also=own) if own else None

    def _rows_of(self, name: str) -> list[tuple[str, int]]:
        """Return component and harmonic of the rows of the table that belong to a case."""
        rows = zip(self.table["case"], self.components, self.table["harmonic"])
        return [(c, int(h)) for n, c, h in rows if n == name]

    def _slopes_of_motion(self, key: Key, own: list[int]) -> dict[int, Levels]:
        """Return derivatives of the logarithms of all levels by the steady motion, by the numbers of the parameters."""
        name, p = key
        known = self._known[key]
        if name in self._without or not known or not own:
            return {}
        if key not in self._motions:
            self.simulations += 1
            found = self._of_motion(key, self.case(name, p))
            if found is None:
                return {}
            self._check_alike(name, known, found)
            if name in self._without:
                return {}
        motion = self._motions[key]

        def changed(**values: float) -> Case:
            return self.case(name, [values.get(f"p{k}", old) for k, old in enumerate(p)])

        sizes = {k: self._size(k, p[k]) for k in own}
        found_by, refused = motion.derivatives(changed, {f"p{k}": (p[k], sizes[k]) for k in own})
        for k in own:
            if (reason := refused.get(f"p{k}")) is not None:
                self._note(f"{self.free[k].name}: derivatives by differences: {reason}")
        return {k: motion.slopes(self.way, found_by[f"p{k}"]) for k in own if f"p{k}" in found_by}

    def _check_alike(self, name: str, known: Levels, motion: Levels) -> None:
        """Note if the record of a case is not the steady motion whose derivatives would stand for its own."""
        for component in {c for c, _ in known}:
            largest = max(v for (c, _), v in motion.items() if c == component)
            apart = max(abs(known[row] - v) for row, v in motion.items() if row[0] == component)
            if not apart <= ALIKE * largest:
                part = apart / largest if largest > 0.0 else float("inf")
                self._without[name] = (
                    f"its record differs from its steady motion by {100 * part:.2g} % of the largest {component}"
                )

    def _size(self, k: int, value: float) -> float:
        """Return of what size a parameter is."""
        item = self.free[k]
        if item.log or value != 0.0:
            return abs(value)
        ends = [end for end in (item.low, item.high) if end is not None]
        return 0.5 * (max(ends) - min(ends)) if len(ends) == 2 else 1.0

    def _difference(self, key: Key, k: int) -> Levels:
        """Return the derivatives of the logarithms of a case's levels by one parameter, as central differences."""
        name, p = key
        if name in self._without:
            self._note(f"case {name!r}: derivatives by differences: {self._without[name]}")
        by = SIMULATION_STEP * self._size(k, p[k])
        sides = [(name, tuple(v + way * by * (j == k) for j, v in enumerate(p))) for way in (1.0, -1.0)]
        self._find(sides)
        above, below = (self._known[side] for side in sides)
        with np.errstate(all="ignore"):
            return {
                row: float((np.log(above[row]) - np.log(below[row])) / (2.0 * by))
                for row in above.keys() & below.keys()
            }

    def _note(self, line: str) -> None:
        if line not in self.notes:
            self.notes.append(line)

    def coarser(self) -> CaseProblem:
        """Return the same problem at a tolerance ten times as large."""
        cases = {name: one.changed(solver={"tolerance": COARSER * TOLERANCE}) for name, one in self.cases.items()}
        found = CaseProblem(
            self.table, cases, self.free, gains=self.gains, channels=self.channels, way=self.way, workers=self.workers,
            derivatives_by=self.derivatives_by,
        )  # fmt: skip
        found.cases, found.store = cases, self.store
        return found


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
