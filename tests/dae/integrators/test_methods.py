"""The table of integrators is the only list of them: a row and a function make an integrator known everywhere."""

import ast
import importlib
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from typer.testing import CliRunner

import gearmbs as gm
from gearmbs.cli import app
from gearmbs.dae import Options, solve_dae
from gearmbs.dae.integrators.bdf import MAX_ORDER
from gearmbs.dae.integrators.wstiff import solve_wstiff
from gearmbs.dae.methods import (
    BDF,
    DEFAULT,
    FORMULATIONS,
    INTEGRATORS,
    Integrator,
    formulations_table,
    integrators_table,
)
from gearmbs.dae.problem import ModelError
from gearmbs.drivetrain.description import RunSettings
from gearmbs.drivetrain.part import DrivetrainError
from gearmbs.mechanism import Mechanism
from gearmbs.wording import any_of
from tests.docs.support import DOCS
from tests.says import says

PACKAGE = Path(gm.__file__).parent
CALLS = []


def solve(problem, t_eval, options, *, t_end=None):
    """Integrate as WSTIFF does, and note that it was asked for."""
    CALLS.append(options.method)
    settings = {name: getattr(options, name) for name in ("tol", "rtol", "max_step")}
    return solve_wstiff(problem, t_eval, method="WSTIFF", t_end=t_end, **settings)


@pytest.fixture
def another(monkeypatch):
    """Add an integrator as anybody would: a function, and a row."""
    row = Integrator(
        words="another",
        solver=f"{__name__}:solve",
        takes=("tol", "rtol", "max_step", "progress", "errors"),
        highest_order=3,
        tolerance=1e-6,
        largest_tolerance=1e-5,
    )
    monkeypatch.setitem(INTEGRATORS, "ANOTHER", row)
    CALLS.clear()


def decay(t, y, yp, out):
    out[0] = yp[0] + y[0]


def swinging():
    m = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", mass=1.0, inertia=(0.1, 0.1, 0.01), position=(0.5, 0, 0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    return m


@pytest.mark.usefixtures("another")
def test_a_row_and_a_function_make_an_integrator():
    result = solve_dae(decay, (0.0, 1.0), [1.0], method="ANOTHER", rtol=1e-8, t_eval=[1.0])
    assert result.y[-1, 0] == pytest.approx(np.exp(-1.0), rel=1e-6)
    m = swinging()
    expected = m.simulate(0.1, tol=1e-8).com_position("rod")[-1]
    np.testing.assert_allclose(
        m.simulate(0.1, tol=1e-8, integrator="another").com_position("rod")[-1], expected, atol=1e-6
    )
    assert CALLS == ["ANOTHER", "ANOTHER"]
    assert RunSettings(integrator="ANOTHER").integrator == "ANOTHER"


@pytest.mark.usefixtures("another")
def test_messages_and_documentation_know_it():
    with pytest.raises(ValueError, match="choose one of WSTIFF, GSTIFF, IDA, ANOTHER"):
        Options(method="EULER")
    with pytest.raises(ModelError, match="choose one of WSTIFF, GSTIFF, IDA, ANOTHER"):
        swinging().simulate(0.1, integrator="EULER")
    with pytest.raises(DrivetrainError, match="choose WSTIFF, GSTIFF, IDA or ANOTHER"):
        RunSettings(integrator="EULER")
    with pytest.raises(ModelError, match="the integrator ANOTHER takes rtol, max_step"):
        swinging().simulate(0.1, integrator="ANOTHER", max_order=2)
    with pytest.raises(ValueError, match=r"max_order \(KMAX\) must be 1 to 3"):
        Options(method="ANOTHER", max_order=4)
    with pytest.raises(ValueError, match=says("method='ANOTHER'", "dense output", "GSTIFF", "use WSTIFF")):
        solve_dae(decay, (0.0, 1.0), [1.0], method="ANOTHER", options=Options(dense_output=True))
    assert "| `ANOTHER` | another | 3 | no | yes | 1e-06, at most 1e-05 |" in integrators_table()


def test_cases_and_the_command_line_take_the_table():
    from gearmbs.studies.case.sections import Solver

    assert get_args(Solver.model_fields["integrator"].annotation) == tuple(INTEGRATORS)
    assert Solver().integrator == DEFAULT
    for name, known in INTEGRATORS.items():
        assert Solver(integrator=name).used_tolerance == known.tolerance
        with pytest.raises(ValueError, match=f"give 1e-12 to {known.largest_tolerance:g} with {name}"):
            Solver(integrator=name, tolerance=2.0 * known.largest_tolerance)
    told = " ".join(CliRunner().invoke(app, ["paper", "--help"], env={"COLUMNS": "400"}).output.split())
    assert any_of(INTEGRATORS) in told


def test_rows_say_what_integrators_do():
    fields = set(Options.__dataclass_fields__)
    for name, known in INTEGRATORS.items():
        assert callable(known.load()), name
        assert known.takes is None or set(known.takes) <= fields, name
        assert Options.names(name)
    assert {known.highest_order for known in INTEGRATORS.values() if known.solver == BDF} == {MAX_ORDER}


@pytest.mark.parametrize("known", [INTEGRATORS, FORMULATIONS], ids=["integrators", "formulations"])
def test_no_other_module_lists_integrators(known):
    """No list, set, table or text that is no docstring names two of them, or two formulations, elsewhere."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        where = path.relative_to(PACKAGE).as_posix()
        source = path.read_text(encoding="utf-8")
        if where == "dae/methods.py" or sum(name in source for name in known) < 2:
            continue
        tree = ast.parse(source)
        prose = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)}
        for node in ast.walk(tree):
            texts = []
            if isinstance(node, ast.Tuple | ast.List | ast.Set | ast.Dict):
                texts = [n.value for n in ast.walk(node) if isinstance(n, ast.Constant)]
            elif isinstance(node, ast.Constant) and id(node) not in prose:
                texts = re.findall(r"\w+", node.value) if isinstance(node.value, str) else []
            if len({text for text in texts if text in known}) > 1:
                found.append(f"{where}:{node.lineno}")
    # the statement of ADAMS has words of its own
    assert [place for place in found if not place.startswith("adams/parse/data_statements.py")] == []


def test_formulations_are_those_of_cases_decks_and_equations():
    from gearmbs.adams.parse.statements import Integrator as Statement
    from gearmbs.dae.equations import unknowns
    from gearmbs.studies.case.sections import Solver

    names = tuple(FORMULATIONS)
    assert get_args(Solver.model_fields["formulation"].annotation) == names
    assert Statement.__dataclass_fields__["formulation"].metadata["spec"].choices == names
    assert {name: getattr(unknowns, name) for name in names} == unknowns.FORMULATIONS
    with pytest.raises(ModelError, match="choose one of I3, SI2, SI1"):
        swinging().simulate(0.1, formulation="SI4")
    assert formulations_table().count("\n") == 1 + len(names)


def test_the_page_shows_the_table(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS / "scripts"))
    tables = importlib.import_module("tables")
    assert tables.integrators()._repr_markdown_() == integrators_table()
    page = (DOCS / "howto" / "integrators.md").read_text(encoding="utf-8")
    assert "tables.integrators()" in page
    assert "tables.formulations()" in page


def test_the_table_is_light():
    """No library of numbers is loaded for the help of the command line."""
    code = "import sys, gearmbs.dae.methods; print([m for m in ('numpy', 'numba', 'sksundae') if m in sys.modules])"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert told.stdout.strip() == "[]"
