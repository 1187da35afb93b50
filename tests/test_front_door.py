"""``import gearmbs``: what most programs need, under one name, and nothing loaded before it is used."""

from __future__ import annotations

import ast
import importlib
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import gearmbs as gm

HEAVY = (
    "numba",
    "llvmlite",
    "numpy",
    "scipy",
    "xarray",
    "pandas",
    "pydantic",
    "pint",
    "matplotlib",
    "h5py",
    "typer",
    "rich",
)


def loaded(code: str) -> set[str]:
    """Return the packages that some code loads in a fresh process."""
    code += "; import sys; print(*{name.partition('.')[0] for name in sys.modules})"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    return set(subprocess.check_output([sys.executable, "-c", code], env=environment, text=True, cwd="/").split())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "without"),
    [
        ("import gearmbs; dir(gearmbs)", HEAVY),
        ("import gearmbs.dae, gearmbs.gears, gearmbs.mechanism, gearmbs.signals, gearmbs.studies, gearmbs.view", HEAVY),
        ("from gearmbs.units import to_si; to_si('1000 rpm', 'rad/s')", HEAVY),
        (
            "from gearmbs.studies import Case, make_case; make_case({})",
            ("numba", "scipy", "xarray", "pint", "matplotlib"),
        ),
        (
            "from gearmbs.studies import Case, run_case",
            ("pandas", "xarray", "pint", "matplotlib", "h5py", "sksundae", "typer", "rich"),
        ),
        ("from gearmbs.mechanism import Mechanism", ("pandas", "xarray", "pydantic", "pint", "matplotlib", "sksundae")),
        ("from gearmbs.dae import solve_dae", ("pandas", "xarray", "pydantic", "pint", "matplotlib", "sksundae")),
        ("import gearmbs.cli", ("numpy", "numba", "scipy", "xarray", "pydantic")),
    ],
)
def test_loads_what_is_used(code, without):
    assert not loaded(code) & set(without)


@pytest.mark.slow
def test_a_case_loads_nothing_of_scipy():
    """`scipy.signal` takes longer to load than many a case to run; sparse matrices are made when a model is."""
    code = "from gearmbs.studies import Case, run_case; import sys; "
    code += "print({'scipy.signal', 'scipy.sparse'} & {*sys.modules})"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.check_output([sys.executable, "-c", code], env=environment, text=True, cwd="/") == "set()\n"


def test_every_name():
    """Each name is what its package says it is, listed, and found by `dir`."""
    assert sorted(gm.__all__) == gm.__all__
    for name in gm.__all__:
        value = getattr(gm, name)
        assert name in dir(gm)
        assert f"`{name}`" in gm.__doc__, f"{name} is not in the description of the package"
        home = importlib.import_module(value.__name__ if isinstance(value, ModuleType) else value.__module__)
        assert home.__name__.startswith("gearmbs.")
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        gm.nothing  # noqa: B018


def test_packages_are_found_without_importing_them():
    names = (
        "adams bearings campaigns contact dae drivetrain flexible gears identify mechanism native signals studies "
        "units view"
    )
    code = f"import gearmbs as gm; print(*(getattr(gm, name).__name__ for name in {names.split()}))"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    found = subprocess.check_output([sys.executable, "-c", code], env=environment, text=True, cwd="/").split()
    assert found == [f"gearmbs.{name}" for name in names.split()]


@pytest.mark.slow
@pytest.mark.parametrize("module_first", [False, True])
@pytest.mark.parametrize("name", ["gears.planetary_mechanism", "identify.fit"])
def test_modules_do_not_take_the_place_of_functions(name, module_first):
    """`gearmbs.identify.fit` is a function and the module it lives in; importing the module changes nothing."""
    steps = [f"module = importlib.import_module('gearmbs.{name}')", f"function = gm.{name}"]
    code = ["import importlib, inspect", "import gearmbs as gm", *(reversed(steps) if not module_first else steps)]
    code.append(f"print(inspect.ismodule(module), inspect.isfunction(function), gm.{name} is function)")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    told = subprocess.check_output([sys.executable, "-c", "\n".join(code)], env=environment, text=True, cwd="/")
    assert told.split() == ["True", "True", "True"]


STUBS = sorted(Path(gm.__file__).parent.rglob("__init__.pyi"))


def named(stub: Path) -> list[str]:
    """Return the names that a stub gives a type checker; each is to be called the same where it comes from."""
    aliases = [a for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom) for a in node.names]
    assert all(alias.asname == alias.name for alias in aliases), "other imports are private to a stub (PEP 484)"
    return sorted(alias.name for alias in aliases)


@pytest.mark.parametrize("stub", STUBS, ids=lambda stub: stub.parent.name)
def test_type_checkers_see_the_same_names(stub):
    package = importlib.import_module(".".join(("gearmbs", *stub.parent.relative_to(STUBS[0].parent).parts)))
    assert named(stub) == package.__all__
    for name in package.__all__:
        assert hasattr(package, name), name


def test_every_front_has_a_stub():
    """Whatever calls ``late`` reads one, and a package that exports names does so by it."""
    inits = {path for path in STUBS[0].parent.rglob("__init__.py") if "__all__" in path.read_text()}
    assert inits == {stub.with_suffix(".py") for stub in STUBS}


UNUSED = {
    "scipy.linalg",
    "scipy.signal",
    "scipy.sparse",
    "sksundae",
    "matplotlib",
    "pint",
    "dask",
    "numpy.f2py",
    "gearmbs.bearings.bearing",
    "gearmbs.flexible.shaft",
}
"""Modules that no run of a rigid pair on joints has a use for."""


CASE = "make_case({'operation': {'duration': '0.06 s', 'settling': '0 s'}})"
CALLS = {
    "simulate_case": (
        f"from gearmbs.studies import make_case, simulate_case; simulate_case({CASE})",
        UNUSED | {"xarray", "pandas"},
    ),
    "run_case": (f"from gearmbs.studies import make_case, run_case; run_case({CASE})", UNUSED),
    "plain_record": (
        f"from gearmbs.studies import make_case, plain_record; plain_record({CASE}).values('gmf_rms')",
        UNUSED | {"xarray", "pandas"},
    ),
    "a campaign's case": (
        "from gearmbs.campaigns import PairSubject; s = PairSubject(); c = s.check(s.base(), 'a'); "
        "keep = ['harmonics', 'contact']; s.reduce(c, s.run(c, lambda f: None, keep), keep)",
        UNUSED | {"xarray", "pandas"},
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("call", CALLS)
def test_a_run_imports_only_what_it_uses(call):
    code, unused = CALLS[call]
    code += f"; import sys; print({unused!r} & {{*sys.modules}})"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    assert subprocess.check_output([sys.executable, "-c", code], env=environment, text=True, cwd="/") == "set()\n"


@pytest.mark.parametrize(
    ("owner", "name", "meant"),
    [
        (gm, "read_any", "read_signal"),
        (gm, "Gear", "GearPair"),
        (gm, "read", "read_deck"),
        (gm.signals, "spectrogramm", "spectrogram"),
        (gm.Mechanism(), "spring", "spring_damper or torsion_spring"),
        (gm.Mechanism(), "hinge", "revolute"),
        (gm.Mechanism(), "simulat", "simulate"),
        (gm.GearPair.paper(), "pressure_angle", "working_pressure_angle"),
        (gm.Shaft([gm.ShaftSection("200 mm", "30 mm")]), "reduce", "modal_model"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_guessed_name_is_answered_with_what_there_is(owner, name, meant):
    with pytest.raises(AttributeError) as told:
        getattr(owner, name)
    assert name in str(told.value)
    assert meant in str(told.value)
    assert told.value.name == name
    assert not hasattr(owner, name)
    assert str(pickle.loads(pickle.dumps(told.value))) == str(told.value)


@pytest.mark.parametrize("kind", [gm.Mechanism, gm.Shaft, gm.Solution, gm.Drivetrain])
def test_names_of_other_programs_are_none_here_and_what_is_named_instead_is(kind):
    for name, instead in kind.other_words.items():
        assert not hasattr(kind, name)
        # these two are set on the object
        assert any(hasattr(kind, word) or word in ("t", "result") for word in re.findall(r"\w+", instead))


def test_names_of_other_programs_are_none_at_the_front_door():
    from gearmbs._lazy import OTHER_WORDS

    for package, words in OTHER_WORDS.items():
        module = importlib.import_module(package)
        for name, instead in words.items():
            assert not hasattr(module, name)
            assert any(hasattr(module, word) or word == "plot" for word in re.findall(r"\w+", instead))
