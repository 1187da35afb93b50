"""What the package says beside results, warnings and progress: the logger `gearmbs` of the standard library.

A part of the package logs under its name, `gearmbs.kernels`, `gearmbs.dae`, `gearmbs.mechanism`, `gearmbs.studies`,
`gearmbs.files`, `gearmbs.signals`:

* INFO: what takes time and why (kernels are compiled, a case begins and ends), what is taken over instead of computed;
* DEBUG: each run of an integrator with its counts, what SUNDIALS says, files that are read and written, processes that
  are started.

Nothing is shown unless somebody listens, but for lines that tell why a program waits (`tell`). The environment variable
``GEARMBS_LOG`` (``info`` or ``debug``) lets this process and those that it starts write to standard error.
"""

from __future__ import annotations

import logging
import os
import sys
from typing import Any, TextIO

VARIABLE = "GEARMBS_LOG"
LEVELS = {"info": logging.INFO, "debug": logging.DEBUG}
FORMAT = {
    "info": "gearmbs: %(message)s",
    "debug": "%(name)s, process %(process)d, %(relativeCreated).0f ms: %(message)s",
}

_ALL = logging.getLogger("gearmbs")
_ALL.addHandler(logging.NullHandler())


def logger(part: str) -> logging.Logger:
    """Return the logger of a part of the package."""
    return _ALL.getChild(part)


class _Standard(logging.StreamHandler):
    """Standard error as it is when something is written: notebooks and tests put others in its place."""

    def __init__(self) -> None:
        logging.Handler.__init__(self)

    @property
    def stream(self) -> TextIO:  # type: ignore[override]
        return sys.stderr


def listen(level: str) -> None:
    """Write messages of a level and above to standard error, here and in processes that are started from now on.

    Parameters
    ----------
    level : {"info", "debug"}

    Raises
    ------
    ValueError
        For another level.
    """
    if level not in LEVELS:
        raise ValueError(f"{VARIABLE} is {level!r}; choose one of {', '.join(LEVELS)}")
    os.environ[VARIABLE] = level
    for handler in [one for one in _ALL.handlers if isinstance(one, _Standard)]:
        _ALL.removeHandler(handler)
    handler = _Standard()
    handler.setFormatter(logging.Formatter(FORMAT[level]))
    _ALL.addHandler(handler)
    _ALL.setLevel(LEVELS[level])


def _heard(log: logging.Logger) -> bool:
    """Return whether a handler gets what is logged, and is no `logging.NullHandler`."""
    one: logging.Logger | None = log
    while one is not None:
        if any(not isinstance(handler, logging.NullHandler) for handler in one.handlers):
            return True
        one = one.parent if one.propagate else None
    return False


def tell(part: str, line: str) -> None:
    """Say why a program waits: to whoever listens at INFO, else on standard error.

    Somebody who has set the level of `gearmbs` above INFO is told nothing.
    """
    log = logger(part)
    if log.isEnabledFor(logging.INFO) and _heard(log):
        log.info(line)
    elif max(log.level, _ALL.level) <= logging.INFO and sys.stderr is not None:
        print(f"gearmbs: {line}", file=sys.stderr, flush=True)


def log_run(part: str, name: str, result: Any) -> None:
    """Log at DEBUG what a run of an integrator, a `gearmbs.dae.DAEResult`, has come to, and what it took."""
    stats = result.stats
    counts = (result.t_last, stats.steps, stats.residuals, stats.jacobians, stats.wall_time)
    text = "%s: up to %g s in %d steps, %d residuals, %d Jacobians, %.3g s; %s"
    logger(part).debug(text, name, *counts, result.message)


if os.environ.get(VARIABLE, "").strip().lower() in LEVELS:
    listen(os.environ[VARIABLE].strip().lower())
