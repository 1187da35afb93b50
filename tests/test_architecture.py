"""The direction of imports: which package may know which, and no circles among modules.

Read from the source of every module and the stub of every package: imports at the top, in functions and for type
checkers alike, and the names of modules in strings.
"""

import ast
import importlib.util
import re
from functools import cache
from pathlib import Path

import pytest

import gearmbs

ROOT = Path(gearmbs.__file__).parent
PAGE = Path(__file__).parent.parent / "docs" / "architecture.md"

SUPPORT = {
    "_command", "_lazy", "_display", "compile", "files", "logs", "progress", "saving", "schema", "system", "units",
    "wording",
}  # fmt: skip
"""Modules of the top that any package may use: lazy imports, how objects show themselves and are saved, files that
appear when they are whole, progress, logs, units, what systems do differently, how descriptions are read and checked,
parts of messages, and the command that compiles ahead."""

MAY_KNOW = {
    "kernels": {"dae"},
    "dae": {"dae.integrators", "dae.linalg"},
    "dae.linalg": set(),
    "dae.integrators": {"dae", "dae.linalg"},
    "dae.equations": {"dae"},
    "dae.model": {"dae", "dae.equations", "dae.linalg"},
    "dae.results": {"dae", "dae.equations", "dae.model"},
    "dae.analyses": {"dae", "dae.equations", "dae.model", "dae.results"},
    "mechanism": {"dae", "dae.equations", "dae.model", "dae.results", "dae.analyses", "solids"},
    "solids": {"dae"},
    "contact": set(),
    "gears": {"contact", "mechanism", "dae"},
    "bearings": {"mechanism"},
    "flexible": {"mechanism"},
    "drivetrain": {"bearings", "flexible", "gears", "mechanism"},
    "native": {"dae", "dae.equations", "dae.integrators", "dae.linalg", "dae.model", "mechanism"},
    "signals": set(),
    "view": {"contact", "flexible", "gears", "mechanism", "signals", "dae.results"},
    "adams": {"dae", "dae.equations", "dae.model", "dae.analyses", "dae.results", "mechanism"},
    "studies": {
        "bearings",
        "dae",
        "dae.results",
        "drivetrain",
        "flexible",
        "gears",
        "mechanism",
        "native",
        "signals",
        "view",
    },
    "campaigns": {"adams", "bearings", "drivetrain", "signals", "studies", "view"},
    "identify": {"dae", "drivetrain", "mechanism", "signals", "studies"},
    "cli": {"adams", "campaigns", "identify", "signals", "studies"},
}
"""What a package may import, besides itself, ``kernels`` and what `SUPPORT` names. ``dae`` alone is what integrators
and equations share: the problem, results, errors, and the function that solves a user's DAE."""

EXCEPTIONS = {
    ("contact", "dae.equations"): "the signature that every force element's kernel has, and IMPACT",
    ("gears", "dae.equations"): "the interface of force elements: a pair hands its kernel to the mechanism",
    (
        "flexible",
        "dae.equations",
    ): "the interface of force elements: beams of large motion hand their kernel to the mechanism",
    ("flexible", "dae"): "the error of models, of which its own is one",
    ("bearings", "dae.equations"): "the interface of force elements: a bearing hands its kernel to the mechanism",
    ("signals", "view"): "its commands draw figures and write files",
    ("signals", "bearings"): "the kinematic lines of a bearing by its designation",
    ("signals", "drivetrain"): "its commands take bearings and shafts from the description of a drivetrain",
    ("bearings", "dae.results"): "lives of bearings follow from the loads of a run",
    ("drivetrain", "dae"): "the table of integrators: names that a description may give",
    ("drivetrain", "dae.equations"): "the interface of force elements: torques about an axis hand their kernels to it",
    ("mechanism", "dae.integrators"): "simulate() chooses an integrator and passes its options on",
    ("adams", "gears"): "pairs are written as the contact forces of a deck, and read from the gears of command files",
    ("adams", "flexible"): "FLEX_BODY is read from its modal neutral file",
    (
        "adams",
        "view",
    ): "wheels written as solids are those of the 3-D scenes, and files that appear when they are whole",
    ("adams", "solids"): "the bodies of Parasolid files: of a deck's the type alone, of a command file's their masses",
    ("studies", "gearmbs"): "a result says which version made it",
    ("studies", "dae.analyses"): "the modes of a drivetrain, the type alone",
    ("studies", "dae.model"): "kernels of a run whose bodies turn about fixed axes, imported ahead of it",
    ("native", "gearmbs"): "an FMU says which version made it",
    ("native", "contact"): "kernels of contact that are compiled ahead for exports go by their signature",
    ("native", "drivetrain"): "so do laws of torques",
    ("campaigns", "gearmbs"): "the card of a data set says which version made it",
    ("cli", "gearmbs"): "the version",
    ("identify", "dae.results"): "what a result is asked of, the type alone",
}
"""Further arrows, and why."""

CIRCLES = {
    ("kernels.ahead", "kernels.cache", "kernels.calls", "kernels.jit", "kernels.kinds", "kernels.library",
     "kernels.own.jit", "kernels.own.views", "kernels.plain.jit", "kernels.plain.views", "kernels.structs",
     "kernels.views"):
        "a kernel that is not there is compiled when it is called, by what knows numba and is imported then",
    ("bearings.bearing", "bearings.rating"):
        "properties of Bearing, and the functions that carry them out",
    ("drivetrain.bodies", "drivetrain.build", "drivetrain.description", "drivetrain.drivetrain",
     "drivetrain.kinematics", "drivetrain.members.carrier", "drivetrain.on_shafts", "drivetrain.placement",
     "drivetrain.planetary", "drivetrain.plants", "drivetrain.static.doubts", "drivetrain.static.flow",
     "drivetrain.static.holding", "drivetrain.static.rest", "drivetrain.torsional"):
        "methods of Drivetrain, and the functions that carry them out",
    ("mechanism.compile", "mechanism.lumping", "mechanism.checks", "mechanism.forces.friction",
     "mechanism.mechanism", "mechanism.solve.analyses", "mechanism.solve.measures", "mechanism.solve.plant_names",
     "mechanism.solve.plants", "mechanism.solve.points", "mechanism.solve.simulate", "mechanism.solve.simulator",
     "mechanism.solve.led", "mechanism.solve.accuracy"):
        "methods of Mechanism, and the functions that carry them out",
    ("campaigns.campaign", "campaigns.figures", "campaigns.report", "campaigns.sensitivity", "campaigns.stored.exports",
     "campaigns.surrogates"):
        "methods of Campaign, and the functions that carry them out",
}  # fmt: skip
"""Groups of modules that may know each other, and why."""


def module_files() -> dict[str, Path]:
    """Return the file of each module by its name."""
    found = {}
    for path in sorted(ROOT.rglob("*.py")):
        parts = ["gearmbs", *path.relative_to(ROOT).with_suffix("").parts]
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def room(module: str) -> str:
    """Return the package of a module, of dae the room; of a module of the top its own name."""
    parts = module.split(".")[1:]
    if not parts:
        return "gearmbs"
    if parts[0] == "dae" and len(parts) > 1 and (ROOT / "dae" / parts[1]).is_dir():
        return f"dae.{parts[1]}"
    return parts[0]


def _named(node: ast.AST, package: str, modules: dict[str, Path]) -> list[str]:
    """Return the modules that one node of a syntax tree names."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom):
        base = node.module or ""
        if node.level:
            parts = package.split(".")
            base = ".".join([*parts[: len(parts) - node.level + 1], *([node.module] if node.module else [])])
        return [f"{base}.{a.name}" if f"{base}.{a.name}" in modules else base for a in node.names]
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and "." in node.value:
        return [node.value] if node.value in modules else []
    return []


@cache
def arrows() -> dict[str, frozenset[str]]:
    """Return which modules of the package each module names."""
    modules = module_files()
    found = {}
    for name, path in modules.items():
        package = name if path.name == "__init__.py" else name.rpartition(".")[0]
        stub = path.with_suffix(".pyi")
        texts = [p.read_text() for p in (path, stub) if p.exists()]
        named = {n for text in texts for node in ast.walk(ast.parse(text)) for n in _named(node, package, modules)}
        found[name] = frozenset(n for n in named if n in modules and n != name)
    return found


@pytest.mark.parametrize("package", sorted(MAY_KNOW))
@pytest.mark.slow
def test_packages_know_only_what_they_may(package):
    allowed = MAY_KNOW[package] | SUPPORT | {package, "kernels"} | {b for a, b in EXCEPTIONS if a == package}
    wrong = [
        f"{name} imports {target}"
        for name, targets in arrows().items()
        if room(name) == package
        for target in targets
        if room(target) not in allowed
    ]
    assert not wrong


def test_every_package_has_its_place():
    rooms = {room(name) for name in module_files()} - SUPPORT - {"gearmbs", "__main__"}
    assert rooms == set(MAY_KNOW)


@pytest.mark.slow
def test_every_exception_is_needed():
    used = {(room(name), room(target)) for name, targets in arrows().items() for target in targets}
    assert set(EXCEPTIONS) <= used


def test_the_page_has_the_same_table():
    """Its columns: package, what it imports, and single purposes as "`package`: purpose"."""
    rows = re.findall(r"^\| `([\w.]+)` \|([^|]*)\|([^|]*)\|$", PAGE.read_text(encoding="utf-8"), re.M)
    told = {package: (imports, purposes) for package, imports, purposes in rows if package in MAY_KNOW}
    assert set(told) == set(MAY_KNOW)
    for package, (imports, purposes) in told.items():
        assert set(re.findall(r"`([\w.]+)`", imports)) == MAY_KNOW[package], package
        assert set(re.findall(r"`([\w.]+)`: ", purposes)) == {b for a, b in EXCEPTIONS if a == package}, package


def test_the_page_is_up_to_date():
    path = PAGE.parent / "scripts" / "architecture.py"
    spec = importlib.util.spec_from_file_location("architecture_page", path)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert script.page() == PAGE.read_text(encoding="utf-8"), f"run python {path}"
    assert script.page().count("| `gearmbs.") == len(MAY_KNOW)


def test_dae_does_not_know_gears_by_name():
    """No word of gears in the names, strings and prose of dae."""
    words = ("gear", "tooth", "teeth", "flank", "involute")
    wrong = []
    for path in sorted((ROOT / "dae").rglob("*.py")):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            rest = line.lower().replace("gearmbs", "")
            if any(word in rest for word in words):
                wrong.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()}")
    assert not wrong


@pytest.mark.slow
def test_no_circles_among_modules():
    """A package and its own modules apart: a package's list of what it exports names them."""
    modules = module_files()
    packages = {name for name, path in modules.items() if path.name == "__init__.py"}
    graph = {
        name: {t for t in targets if t not in packages} for name, targets in arrows().items() if name not in packages
    }
    allowed = [{f"gearmbs.{name}" for name in group} for group in CIRCLES]
    circles = [group for group in _components(graph) if len(group) > 1]
    assert not [group for group in circles if not any(set(group) <= known for known in allowed)]


def _components(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the strongly connected components of a graph."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    names = sorted(graph)
    place = {name: k for k, name in enumerate(names)}
    pairs = [(place[a], place[b]) for a, targets in graph.items() for b in targets if b in place]
    rows, columns = zip(*pairs)
    matrix = csr_array(([1] * len(pairs), (rows, columns)), shape=(len(names), len(names)))
    _, label = connected_components(matrix, connection="strong")
    return [[name for name, k in zip(names, label) if k == c] for c in range(max(label) + 1)]
