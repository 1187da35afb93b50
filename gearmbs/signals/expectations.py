"""What each fault is expected to do to the mesh harmonics and the indicators."""

from __future__ import annotations

# What each fault is expected to do, by harmonic or indicator: +1 rises, 0 stays, by name of the state.
# Misalignment and centre distance after the paper; local tooth faults after the usual reading: a short disturbance once
# a revolution spreads over many sidebands and leaves the mesh harmonics, averages over all teeth, much as they were.
EXPECTED: dict[str, dict[int | str, int]] = {
    "misaligned": {2: 1},
    "distance": {1: 1, 2: 1, 3: 1},
    "broken": {1: 0, 2: 0, 3: 0, "sideband_level": 1, "energy_ratio": 1, "fm4": 1, "kurtosis": 1},
    "chipped": {1: 0, 2: 0, 3: 0, "sideband_level": 1, "energy_ratio": 1, "fm4": 1, "kurtosis": 1},
}
"""What each fault is expected to do; see `ComparisonReport.expectations`."""
