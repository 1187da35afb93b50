"""A bearing by its designation: frequencies, life and static deflection."""

from pathlib import Path

import numpy as np

from gearmbs.bearings import Bearing, BearingStatics, rating_life, stiffness_matrix


def main(folder: Path) -> float:
    """Return the deflection under 2 kN across, m."""
    bearing = Bearing.from_designation("6205", clearance="8 um").changed(dynamic_rating="14.8 kN")
    state = BearingStatics(bearing, speed="1500 rpm", smooth="1 um").under([2000.0, 0.0, 0.0])
    stiffness: np.ndarray = stiffness_matrix(bearing, [2000.0, 0.0, 0.0], damping="10 us")
    np.savetxt(folder / "stiffness.txt", stiffness)
    (folder / "life.txt").write_text(f"{rating_life(bearing, 1400.0):.3g} turns, outer race {bearing.bpfo:.4f}\n")
    return float(state.displacement[0])
