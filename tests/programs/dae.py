"""Equations of one's own, G(t, y, y') = 0."""

from pathlib import Path

import numpy as np

from gearmbs.dae import solve_dae


def robertson(t: float, y: np.ndarray, yp: np.ndarray, out: np.ndarray) -> None:
    """Write the residual of three species."""
    net = 0.04 * y[0] - 1e4 * y[1] * y[2]
    out[0] = yp[0] + net
    out[1] = yp[1] - net + 3e7 * y[1] ** 2
    out[2] = y[0] + y[1] + y[2] - 1.0


def main(folder: Path) -> float:
    """Return the first species at 40 s."""
    result = solve_dae(
        robertson, (0.0, 40.0), [1.0, 0.0, 0.0], rtol=1e-6, atol=np.array([1e-8, 1e-12, 1e-8]), max_order=4,
        names=["a", "b", "c"],
    )  # fmt: skip
    np.save(folder / "robertson.npy", result.y)
    return float(result.y[-1, 0])
