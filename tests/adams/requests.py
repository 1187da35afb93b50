"""Request files read back."""

from __future__ import annotations

import numpy as np


def read_requests(text: str) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Read a request file back: times, and the six kept columns of every request.

    Raises
    ------
    ValueError
        If the file is cut off or not a request file.
    """
    lines = text.splitlines()
    try:
        count = int(lines[2].split()[0])
        ids = [int(lines[3 + 2 * k].split()[0]) for k in range(count)]
        numbers = np.array(" ".join(lines[3 + 2 * count :]).split(), dtype=float).reshape(-1, 1 + 6 * count)
    except (IndexError, ValueError) as error:
        raise ValueError("not a request file, or cut off") from error
    table = numbers[:, 1:].reshape(-1, count, 6)
    return numbers[:, 0], {number: table[:, k] for k, number in enumerate(ids)}
