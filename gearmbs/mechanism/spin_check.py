"""Whether a slender modal body turned faster than modes without geometric stiffening allow."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np

from gearmbs.dae.results.solution import Solution
from gearmbs.mechanism.modal import ModalBody
from gearmbs.mechanism.parts import Body


def warn_of_spin(bodies: Mapping[str, Body], solution: Solution) -> None:
    """Warn where a slender modal body turned across its long axis faster than its ``spin_limit``."""
    for name, body in bodies.items():
        if not (isinstance(body, ModalBody) and body.long_axis is not None and np.isfinite(body.spin_limit)):
            continue
        turning = np.einsum("tij,ti->tj", solution.orientation(name), solution.angular_velocity(name))
        across = np.linalg.norm(turning - np.outer(turning @ body.long_axis, body.long_axis), axis=1)
        fastest = float(across.max(initial=0.0))
        if fastest > body.spin_limit:
            warnings.warn(
                f"body '{name}' turned at {fastest:.4g} rad/s across its long axis, more than {body.spin_limit:.4g}: "
                "its modes lack the stiffening by centrifugal force; reduce it with spin=, or take large beams "
                "(gearmbs.flexible.add_beam)",
                stacklevel=4,
            )
