"""Remarks on points of contact that leave an open curve."""

from __future__ import annotations

import numpy as np

from gearmbs.adams.builders.model import AdamsModel
from gearmbs.dae.results.solution import Solution

OFF = 1e-9
"""Of a curve's length: beyond its end by less than it is at the end."""


def off_the_end(model: AdamsModel, solution: Solution) -> list[str]:
    """Return a remark on each point of contact that is beyond the end of its curve, with the first time of output."""
    remarks = []
    for runner, (statement, length) in model.runners.items():
        travel = solution.com_position(runner)[:, 2]
        beyond = np.flatnonzero((travel < -OFF * length) | (travel > (1.0 + OFF) * length))
        if beyond.size:
            time = solution.t[beyond[0]] / model.deck.units.time
            remarks.append(
                f"{statement.label()}: at TIME = {time:.9g} it is off the end of its curve, where the spline goes on "
                "beyond the points; give points further out, or a SENSOR that ends the analysis before"
            )
    return remarks
