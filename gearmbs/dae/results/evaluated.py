"""Output times with all that was evaluated at them, which energies and motions of frames are computed from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.dae.model.evaluator import Records
from gearmbs.dae.model.model import Model


class Evaluated(NamedTuple):
    """A model over time.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Output times, s.
    model : Model
    records : Records
        Poses, accelerations, multipliers, loads.
    """

    t: np.ndarray
    model: Model
    records: Records

    def modal(self, body: int) -> np.ndarray:
        """Return q_f, v_f and their accelerations of a modal body, shape (3, m, modes); the ground is body 0."""
        first = sum(self.model.modes[:body])
        return self.records.modal[:, :, first : first + self.model.modes[body]]
