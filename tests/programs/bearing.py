"""A bearing by its designation: frequencies, life and static deflection."""

from pathlib import Path

from gearmbs.bearings import Bearing, BearingStatics, rating_life


def main(folder: Path) -> float:
    """Return the deflection under 2 kN across, m."""
    bearing = Bearing.from_designation("6205/CN")
    state = BearingStatics(bearing).under([2000.0, 0.0, 0.0])
    (folder / "life.txt").write_text(f"{rating_life(bearing, 1400.0):.3g} turns, outer race {bearing.bpfo:.4f}\n")
    return float(state.displacement[0])
