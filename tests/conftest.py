"""Numerical libraries run on one thread, so that timings do not depend on the machine; what is skipped has a reason."""

import gc
import os
import re
from pathlib import Path

import pytest

from tests import private_parts

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

if os.environ.get("GEARMBS_COMPILER") == "plain":
    # before any module of the package is imported
    private_parts.refuse()
    # what is asked of the own stages, and the wheel that is made with them
    collect_ignore = [
        "test_compile.py", "test_kernel_cache.py", "test_straight.py", "test_unasked_kernels.py", "test_wheel.py",
        "test_ship.py", "test_start.py", "dae/compiled/test_counted_arrays.py", "docs/test_asked_kernels.py",
        "native/test_ahead.py", "native/test_systems.py",
    ]  # fmt: skip

PAGE = Path(__file__).parent.parent / "docs" / "development.md"
SKIPPED: dict[str, str] = {}
"""Tests, and files, that were skipped, and why."""


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Keep what is imported and collected, which stays for the whole run, out of the collector's way."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def allowed_reasons() -> list[str]:
    """Return the words by which the table of docs/development.md knows the reasons of skips."""
    table = PAGE.read_text(encoding="utf-8").partition("## What is skipped")[2].partition("\n## ")[0]
    return re.findall(r"^\| `([^`]+)` \|", table, re.M)


def unknown_skips(skipped: dict[str, str]) -> list[str]:
    """Return a line for each skipped test whose reason is not in the table."""
    known = allowed_reasons()
    return [f"{test}: {reason}" for test, reason in skipped.items() if not any(words in reason for words in known)]


def pytest_runtest_logreport(report):
    """Note what is skipped; of several workers, in the process that they report to."""
    if report.skipped and not hasattr(report, "wasxfail"):
        SKIPPED[report.nodeid] = report.longrepr[2]


def pytest_collectreport(report):
    """Note the files that are skipped as a whole."""
    if report.skipped:
        SKIPPED[report.nodeid] = report.longrepr[2]


def pytest_sessionfinish(session):
    """Fail a run that skips what the table does not know, or more than ``GEARMBS_MOST_SKIPS``."""
    if hasattr(session.config, "workerinput"):
        return
    wrong = unknown_skips(SKIPPED)
    most = int(os.environ.get("GEARMBS_MOST_SKIPS", len(SKIPPED)))
    if len(SKIPPED) > most:
        wrong.append(f"{len(SKIPPED)} tests are skipped, at most {most} may be (GEARMBS_MOST_SKIPS)")
    if wrong:
        print("\n\nskipped for a reason that is not in docs/development.md:", *wrong, sep="\n  ")
        session.exitstatus = 1
