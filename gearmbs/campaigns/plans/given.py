"""Plans made from what is given, in Python or in a file: checked, in SI."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from gearmbs.campaigns.plans import designs
from gearmbs.campaigns.plans.factors import (
    AnyFactor,
    Choice,
    Factor,
    Specimens,
    check_kinds,
    factor_from,
    number_in_si,
)
from gearmbs.campaigns.plans.plan import ALONG, TAKEN, Plan, PlanKeywords, crossed
from gearmbs.campaigns.settings import CampaignError, check_settings, texts, whole
from gearmbs.campaigns.subjects.base import Subject, check_keep, make_subject
from gearmbs.files import python_scalar
from gearmbs.schema.described import chosen, read_toml

if TYPE_CHECKING:
    from gearmbs.studies import Case

FILES = ("file", "script", "routines")
"""Settings of subjects that name files."""
FAILURE_POLICIES = ("record", "tighter", "stop")


def make_plan(
    base: Case | Subject | None = None,
    factors: AnyFactor | Iterable[AnyFactor] = (),
    design: str = "sobol",
    n: int = 0,
    *,
    keep: Sequence[str] | None = None,
    **settings: Unpack[PlanKeywords],
) -> Plan:
    """Return a checked plan.

    Parameters
    ----------
    base : Case or Subject, optional
        What is simulated, with everything that no factor changes; default the case of the preset.
    factors : iterable of Factor, Choice, Specimens
    design : str
        ``sobol``, ``halton``, ``random`` (these go on where they stopped), ``latin hypercube``, ``grid``, ``list``,
        ``one at a time``, ``factorial``, ``plackett burman``, ``central composite``, ``box behnken``, ``saltelli``,
        ``morris``.
    n : int
        Points of a sequence or a hypercube, base points of a Saltelli design, trajectories of a Morris design.
    keep : sequence of str, optional
        Default: the first of what the subject keeps.
    **settings
        Further attributes of `Plan`.

    Raises
    ------
    CampaignError
        For whatever is wrong with it. Corners are checked when a campaign is made.

    Examples
    --------
    >>> from gearmbs.campaigns import Factor
    >>> plan = make_plan(factors=[Factor("operation.torque", "50 N m", "200 N m")], n=8)
    >>> plan.columns(plan.points())["operation.torque"].size
    8
    """
    from gearmbs.campaigns.subjects.pair import PairSubject
    from gearmbs.studies import Case

    if not (base is None or isinstance(base, (Case, Subject))):
        raise CampaignError(f"base = {base!r:.60}; give a Case or a Subject, such as FunctionSubject(...)")
    subject = base if isinstance(base, Subject) else PairSubject(base)
    given = (factors,) if isinstance(factors, AnyFactor) else tuple(factors)
    for factor in given:
        if not isinstance(factor, AnyFactor):
            raise CampaignError(f"factors: {factor!r} is none; give Factor, Choice or Specimens")
    own = tuple(factor.in_si(subject) for factor in given)
    _check_units(subject, {f.path: (f.low, f.high, *f.values) for f in given if isinstance(f, Factor)}, _set_by(own))
    chosen(designs.DESIGNS, design, "", CampaignError, "design")
    counted = (*designs.SEQUENCES, *designs.ANALYSES, "latin hypercube")
    n = whole(n, "n", 0)
    if design in counted and n < 1:
        raise CampaignError(f"n = {n!r}: give the number of points of the {design} design")
    keep = subject.keeps[:1] if keep is None else texts(keep, "keep")
    check_keep(subject, keep)
    checked = check_settings(settings, Plan, design)
    plan = Plan(subject, own, design, n, keep=keep, **checked)
    if design == "list":
        plan = replace(plan, options={**plan.options, "rows": _rows_in_si(plan)})
    _consistent(plan)
    return plan


def _set_by(factors: Iterable[AnyFactor]) -> list[str]:
    """Return the paths of the fields that factors set."""
    return [path for f in factors for path in _paths(f)]


def _paths(factor: AnyFactor) -> Iterable[str]:
    if isinstance(factor, Specimens):
        return factor.errors
    return factor.sets if isinstance(factor, Choice) else (factor.path,)


def _check_units(subject: Subject, values: Mapping[str, Iterable[Any]], varied: Sequence[str]) -> None:
    """Refuse quantities with a unit that is another one for other values of what varies as well."""
    for path, given in values.items():
        if (other := subject.unit_follows(path)) in varied and any(isinstance(value, str) for value in given):
            raise CampaignError(
                f"{path}: its unit is {subject.unit_of(path)} for the base's {other} alone, which varies as well; give "
                "numbers in SI, or each pair by a plan of its own"
            )


def _rows_in_si(plan: Plan) -> list[dict[str, Any]]:
    """Return the rows of a list with texts in SI, numbers of one column all whole or all real."""
    rows = plan.options.get("rows")
    if not rows or not all(isinstance(row, Mapping) for row in rows):
        raise CampaignError("design list: give options={'rows': [{path: value, ...}, ...]}")
    units = {path: plan.subject.unit_of(path) for row in rows for path in row}
    _check_units(plan.subject, {path: [row.get(path) for row in rows] for path in units}, list(units))
    found = [{k: number_in_si(python_scalar(v), units[k], k) for k, v in row.items()} for row in rows]
    for path in units:
        column = [row.get(path) for row in found]
        if any(isinstance(v, float) for v in column):
            for row in found:
                if isinstance(row.get(path), int) and not isinstance(row[path], bool):
                    row[path] = float(row[path])
        if not any(isinstance(v, (list, tuple, dict)) for v in column):
            check_kinds(column, f"rows: {path}")
    return found


def _consistent(plan: Plan) -> None:
    """Refuse settings that contradict each other."""
    names = [name for f in plan.factors for name in f.columns(np.full((1, f.width), 0.5), *_variant(f))]
    rows = plan.options["rows"] if plan.design == "list" else []
    signals = [item.removeprefix("signal:") for item in plan.keep if item.startswith("signal:")]
    kept = [name + ending for name in signals for ending in ("", *ALONG)]
    taken = sorted({*names, *(name for row in rows for name in row)} & {*TAKEN, *kept})
    if taken:
        remedy = "rename the parameter" if rows else "give the factor another one, name='...'"
        raise CampaignError(f"factors: {', '.join(taken)} is the name of another column or of a signal; {remedy}")
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise CampaignError(
            f"factors: {', '.join(sorted(doubled))} stand for several columns; give them names of their own"
        )
    paths = _set_by(plan.factors)
    doubled = {path for path in paths if paths.count(path) > 1}
    if doubled:
        raise CampaignError(f"factors: {', '.join(sorted(doubled))} is set by several of them; give one")
    for together in (paths, *rows):
        for whole_of, part in itertools.permutations(together, 2):
            if part.startswith(f"{whole_of}."):
                raise CampaignError(
                    f"factors: {part} is a part of {whole_of}, which is set as a whole as well; give it in each of the "
                    f"values of {whole_of}, or leave one of the two out"
                )
    for f in plan.factors if plan.design in ("grid", "one at a time") else ():
        if isinstance(f, Factor):
            found = f.columns(designs.end_to_end(plan.count(f))[:, None])[f.name].tolist()
            if len(set(found)) < len(found):
                raise CampaignError(
                    f"factor {f.path!r}: its {len(found)} values are {', '.join(map(str, found))}, some of them twice; "
                    "give it fewer levels, or values that are different"
                )
    for f in plan.factors:
        _all_taken(f, plan)
    drawn = [f for f in plan.factors if isinstance(f, Specimens)]
    if alike := [f.name for f in drawn if [other.seed for other in drawn].count(f.seed) > 1]:
        raise CampaignError(
            f"specimens: {', '.join(alike)} have one seed, and would be drawn alike; give each a seed of its own"
        )
    if plan.design == "list" and plan.factors:
        raise CampaignError("factors: a list has its rows alone; leave the factors out, or take another design")
    if plan.design != "list" and not plan.factors:
        raise CampaignError("factors: give at least one")
    if plan.constraints and plan.design in designs.ANALYSES:
        raise CampaignError(
            f"constraints: points left out would break the {plan.design} design; narrow the ranges instead"
        )
    if plan.n and not plan.has_n:
        raise CampaignError(
            f"n = {plan.n}: the points of a {plan.design} design follow from factors and options; leave n out"
        )
    chosen(FAILURE_POLICIES, plan.on_failure, "", CampaignError, "on_failure")


def _all_taken(factor: AnyFactor, plan: Plan) -> None:
    """Refuse a factor of which a design of few levels would leave out alternatives, none of which is an end."""
    if isinstance(factor, Factor):
        alternatives: Sequence[Any] = factor.values
        ordered = all(isinstance(v, int | float) for v in alternatives)
    else:
        alternatives = list(factor.options) if isinstance(factor, Choice) else range(factor.draws)
        ordered = False
    count, most = len(alternatives), designs.MOST_LEVELS.get(plan.design)
    if ordered and plan.design in designs.TWO_LEVELS and count > 2:
        ends = alternatives[0], alternatives[-1]
        if sorted(ends) != [min(alternatives), max(alternatives)]:
            raise CampaignError(
                f"factor {factor.name!r}: a {plan.design} design takes the first and the last of its values, {ends[0]} "
                f"and {ends[1]}, which are not the least and the largest; give them in ascending order"
            )
    if ordered or crossed(factor):
        return
    if most is not None and count > most:
        raise CampaignError(
            f"factor {factor.name!r}: a {plan.design} design takes {most} of its {count} values, which have no order; "
            f"give it {most}, or take a grid"
        )
    if plan.design == "morris" and not isinstance(factor, Specimens):
        levels = int(plan.options.get("levels", 4))
        starts, delta = designs.morris_starts(levels)
        reached = np.minimum((np.r_[starts, starts + delta] * count).astype(int), count - 1)
        if np.unique(reached).size < count:
            raise CampaignError(
                f"factor {factor.name!r}: a morris design of {levels} levels never takes some of its {count} values, "
                f"which have no order; give it options={{'levels': {count + count % 2}}}"
            )


def _variant(factor: AnyFactor) -> tuple:
    return (np.zeros(1, dtype=int),) if crossed(factor) else ()


def load_plan(path: str | Path) -> Plan:
    """Read a plan in TOML: ``[subject]`` or ``[base]``, ``[[factor]]`` and the attributes of `Plan`.

    Raises
    ------
    CampaignError
        If it cannot be read or is wrong.
    """
    path = Path(path)
    tree = read_toml(path, CampaignError)
    subject = tree.pop("subject", {})
    tables = tree.pop("factor", [])
    if not (isinstance(subject, dict) and isinstance(tables, list) and all(isinstance(t, dict) for t in tables)):
        raise CampaignError(f"{path}: write [subject] once, and [[factor]] above each factor")
    kind = subject.pop("kind", "pair")
    factors = [factor_from(table) for table in tables]
    if "base" in tree:
        subject["case"] = tree.pop("base")
    if "factors" in tree:
        raise CampaignError(f"{path}: factors is no entry of a plan's file; write [[factor]] above each of them")
    for key in FILES:
        # a file beside the plan's, wherever the command is given
        if isinstance(subject.get(key), str) and (path.parent / subject[key]).is_file():
            subject[key] = str(path.parent / subject[key])
    if "reuse" in tree:
        # a folder beside the plan's file, wherever the command is given
        tree["reuse"] = [str(path.parent / folder) for folder in texts(tree["reuse"], "reuse")]
    try:
        return make_plan(make_subject(kind, subject), factors, **tree)
    except TypeError as error:
        raise CampaignError(f"{path}: {error}") from error
