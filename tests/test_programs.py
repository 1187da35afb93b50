"""Programs as users write them run; `make types` checks that they pass a strict type checker."""

import importlib
import math
from pathlib import Path

import pytest

PROGRAMS = sorted(path.stem for path in (Path(__file__).parent / "programs").glob("[a-z]*.py"))


@pytest.mark.slow
@pytest.mark.parametrize("name", PROGRAMS)
def test_programs_of_users_run_and_leave_what_they_write(name, tmp_path):
    result = importlib.import_module(f"tests.programs.{name}").main(tmp_path)
    assert math.isfinite(result)
    assert any(tmp_path.iterdir())
