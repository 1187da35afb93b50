"""Which further measurement would tell most of what is unknown."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.identify.parameters import IdentifyError
from gearmbs.progress import staged

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.identify.cases import CaseProblem

EXPERIMENTS: dict[str, dict[str, Any]] = {
    "speed x 1.5": {"operation.speed": 1.5},
    "speed x 0.5": {"operation.speed": 0.5},
    "torque x 2": {"operation.torque": 2.0},
    "misaligned by 0.5 deg": {"fault.misalignment": "0.5 deg"},
    "centre distance + 0.3 mm": {"fault.centre_distance_error": "0.3 mm"},
}
"""What most benches can do: by field a factor for speed and torque, else the new value."""

FACTORS = ("operation.speed", "operation.torque")


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
