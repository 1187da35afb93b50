"""Seed and number of the random cases of property tests; a reviewer sets others by the environment."""

import os


def seed(default: int = 20) -> int:
    """Return ``GEARMBS_SEED``, or the given one."""
    return int(os.environ.get("GEARMBS_SEED", default))


def cases(default: int) -> int:
    """Return ``GEARMBS_CASES``, or the given number."""
    return int(os.environ.get("GEARMBS_CASES", default))
