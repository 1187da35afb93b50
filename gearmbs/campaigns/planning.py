"""Plans made from what is given, in Python or in a file: checked, in SI."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns import designs
from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.factors import AnyFactor, Choice, Specimens, factor_from, number_in_si, plain
from gearmbs.campaigns.plan import Plan
from gearmbs.campaigns.settings import check_settings, texts, whole
from gearmbs.campaigns.subjects.base import Subject, check_keep, make_subject

FILES = ("file", "script", "routines")
"""Settings of subjects that name files."""
FAILURE_POLICIES = ("record", "tighter", "stop")


def make_plan(
    base: Any = None,
    factors: Iterable[AnyFactor] = (),
    design: str = "sobol",
    n: int = 0,
    *,
    keep: Sequence[str] | None = None,
    **settings: Any,
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
    if design not in designs.DESIGNS:
        raise CampaignError(f"design {design!r} is unknown; choose one of {', '.join(designs.DESIGNS)}")
    counted = (*designs.SEQUENCES, *designs.ANALYSES, "latin hypercube")
    n = whole(n, "n", 0)
    if design in counted and n < 1:
        raise CampaignError(f"n = {n!r}: give the number of points of the {design} design")
    keep = subject.keeps[:1] if keep is None else texts(keep, "keep")
    check_keep(subject, keep)
    settings = check_settings(settings, Plan, design)
    plan = Plan(subject, own, design, n, keep=keep, **settings)
    if design == "list":
        plan = replace(plan, options={**plan.options, "rows": _rows_in_si(plan)})
    _consistent(plan)
    return plan


def _rows_in_si(plan: Plan) -> list[dict[str, Any]]:
    """Return the rows of a list with texts in SI, numbers of one column all whole or all real."""
    rows = plan.options.get("rows")
    if not rows or not all(isinstance(row, Mapping) for row in rows):
        raise CampaignError("design list: give options={'rows': [{path: value, ...}, ...]}")
    units = {path: plan.subject.unit_of(path) for row in rows for path in row}
    found = [{k: number_in_si(plain(v), units[k], k) for k, v in row.items()} for row in rows]
    for path in units:
        column = [row.get(path) for row in found]
        if any(isinstance(v, float) or v is None for v in column):
            for row in found:
                if isinstance(row.get(path), int) and not isinstance(row[path], bool):
                    row[path] = float(row[path])
    return found


def _consistent(plan: Plan) -> None:
    """Refuse settings that contradict each other."""
    names = [name for f in plan.factors for name in f.columns(np.full((1, f.width), 0.5), *_variant(f))]
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise CampaignError(
            f"factors: {', '.join(sorted(doubled))} stand for several columns; give them names of their own"
        )
    paths = [f.path for f in plan.factors if not isinstance(f, Specimens)]
    doubled = {path for path in paths if paths.count(path) > 1}
    if doubled:
        raise CampaignError(f"factors: {', '.join(sorted(doubled))} is set by several of them; give one")
    if plan.design != "list" and not plan.factors:
        raise CampaignError("factors: give at least one")
    if plan.constraints and plan.design in designs.ANALYSES:
        raise CampaignError(
            f"constraints: points left out would break the {plan.design} design; narrow the ranges instead"
        )
    if plan.on_failure not in FAILURE_POLICIES:
        raise CampaignError(f"on_failure = {plan.on_failure!r}; choose one of {', '.join(FAILURE_POLICIES)}")


def _variant(factor: AnyFactor) -> tuple:
    return (np.zeros(1, dtype=int),) if isinstance(factor, Choice) and factor.crossed else ()


def load_plan(path: str | Path) -> Plan:
    """Read a plan in TOML: ``[subject]`` or ``[base]``, ``[[factor]]`` and the attributes of `Plan`.

    Raises
    ------
    CampaignError
        If it cannot be read or is wrong.
    """
    path = Path(path)
    try:
        tree = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise CampaignError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CampaignError(f"{path}: not a valid TOML file ({error})") from error
    subject = tree.pop("subject", {})
    kind = subject.pop("kind", "pair")
    if "base" in tree:
        subject["case"] = tree.pop("base")
    factors = [factor_from(table) for table in tree.pop("factor", [])]
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
