"""Pages of the API reference, written from what each package exports."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import gearmbs

PACKAGES = {
    "gearmbs.mechanism": "Mechanism: bodies, markers, joints, motions, forces",
    "gearmbs.mechanism.contacts": "Contact of solids: shapes and laws",
    "gearmbs.solids": "Solids: bodies of CAD files",
    "gearmbs.gears": "Gears: wheels, pairs, laws, static analyses",
    "gearmbs.drivetrain": "Drivetrains: gear trains by name, motors, clutches, pumps",
    "gearmbs.flexible": "Flexible bodies: shafts, finite elements, reduction",
    "gearmbs.bearings": "Bearings: rolling bearings, defects, statics, ratings",
    "gearmbs.contact": "Contact: compiled kernels",
    "gearmbs.dae": "DAE: equations, formulations, integrators, solutions",
    "gearmbs.signals": "Signals: files, features, comparison, sensors",
    "gearmbs.studies": "Studies: cases and the paper's study",
    "gearmbs.campaigns": "Campaigns: many cases",
    "gearmbs.campaigns.datasets": "Data sets: labelled signals",
    "gearmbs.identify": "Identification: parameters from measurements",
    "gearmbs.adams": "ADAMS: decks in, results out",
    "gearmbs.view": "View: figures",
    "gearmbs.native": "Native: models as libraries without Python",
    "gearmbs.units": "Units, descriptions, files, progress and compilation",
}

EVERYTHING = ["*"]
"""All public functions and classes that a module defines itself."""

EXPORTED = ["__all__"]
"""All names that a module lists as its own."""

CONSTANTS = {
    "gearmbs.signals": {
        "COMPONENTS": "gearmbs.signals.conversion",
        "EXPECTED": "gearmbs.signals.analysis.comparison_report",
        "FORMATS": "gearmbs.signals.files.formats",
        "INDICATORS": "gearmbs.signals.analysis.indicators",
    },
    "gearmbs.bearings": {"DEFECTS": "gearmbs.bearings.defects"},
    "gearmbs.campaigns.datasets": {"GEARBOXES": "gearmbs.campaigns.datasets.gearboxes"},
    "gearmbs.view": {"COLOURS": "gearmbs.view.figures.style"},
}
"""Exported values that are no functions or classes, with the module that defines and describes them."""

DESCRIBED = {
    "gearmbs.drivetrain": {
        "BEARINGS": "Classes of bearings by their ``kind`` in files.",
        "COUPLINGS": "Classes of couplings by their ``kind`` in files.",
        "DRIVES": "Classes of drives by their ``kind`` in files.",
        "LOADS": "Classes of loads by their ``kind`` in files.",
        "SENSORS": "Classes of sensors by their ``kind`` in files.",
    },
    "gearmbs.contact": {
        "GAP_COLUMNS": "Names of the columns of the rows that ``pair_gaps`` fills.",
        "GEAR_CONTACT_SIG": "Numba signature of ``gear_contact``.",
    },
}
"""Exported values of the kernels, described here."""

MORE = {
    "gearmbs.mechanism": {
        "gearmbs.mechanism.parts.curves": ["Curve", "point_on_curve", "curve_on_curve"],
        "gearmbs.mechanism.solve.simulate": ["StopAt"],
    },
    "gearmbs.gears": {
        "gearmbs.gears.modifications": EVERYTHING,
        "gearmbs.gears.faults": EVERYTHING,
        "gearmbs.gears.mesh": ["Mesh"],
        "gearmbs.gears.pattern": EVERYTHING,
        "gearmbs.gears.stiffness": EVERYTHING,
        "gearmbs.gears.iso6336": EVERYTHING,
    },
    "gearmbs.bearings": {
        "gearmbs.bearings.designations.catalogue": EVERYTHING,
        "gearmbs.bearings.rating": [
            "dynamic_rating",
            "static_rating",
            "load_factors",
            "life_exponent",
            "roller_length_for",
        ],
        "gearmbs.bearings.laws_kernel": EVERYTHING,
    },
    "gearmbs.contact": {
        "gearmbs.contact.laws": ["normal_law", "friction_law"],
    },
    "gearmbs.dae": {
        "gearmbs.dae.solve": ["solve_dae"],
        "gearmbs.dae.user_problem": ["as_problem"],
        "gearmbs.dae.equations.expressions": EXPORTED,
        "gearmbs.dae.integrators.wstiff": ["solve_wstiff", "resume"],
        "gearmbs.dae.integrators.ida": ["solve_ida"],
        "gearmbs.dae.result": ["DAEResult", "SolverStats", "Status", "DenseOutput"],
        "gearmbs.dae.problem": ["DAEProblem", "ModelError", "AssemblyError", "SingularModelError"],
        "gearmbs.dae.model.system": ["System"],
        "gearmbs.dae.equations.unknowns": ["Unknown"],
        "gearmbs.dae.results.solution": ["Solution"],
        "gearmbs.dae.results.energy": ["energy_balance"],
        "gearmbs.dae.model.initial": ["InitialReport", "assemble_position", "consistent_velocity", "independent_rows"],
        "gearmbs.dae.equations.residual": ["residual", "add_constraints", "add_load"],
        "gearmbs.dae.equations.jacobian": ["jacobian", "body_entries", "row_entries"],
        "gearmbs.dae.equations.accelerations": ["saddle"],
        "gearmbs.dae.equations.kinematics": ["hook", "rewrite_point"],
        "gearmbs.dae.equations.rotation": [
            "matrix_from_euler",
            "euler_from_matrix",
            "rotation_matrix",
            "axes_and_velocity",
            "best_reference",
            "momentum_from_conjugate",
        ],
        "gearmbs.dae.equations.constraints.terms": ["gradient", "quadratic_part", "hessian"],
        "gearmbs.dae.equations.loads.forces": ["impact", "friction_over_speed"],
    },
    "gearmbs.studies": {
        "gearmbs.studies.case.sections": [
            "Gears",
            "Shafts",
            "Operation",
            "FaultSettings",
            "Contact",
            "FrictionSettings",
            "Solver",
        ],
        "gearmbs.studies.run.simulation": ["record"],
        "gearmbs.studies.run.store": ["write_dataset"],
    },
    "gearmbs.campaigns": {
        "gearmbs.campaigns.plans.designs": EVERYTHING,
        "gearmbs.campaigns.plans.factors": EVERYTHING,
        "gearmbs.campaigns.cluster": ["DaskRunner", "batch_cluster", "job_script"],
        "gearmbs.campaigns.stored.exports": ["export"],
        "gearmbs.campaigns.sobol_bounds": EVERYTHING,
        "gearmbs.campaigns.surrogates": ["response_surface"],
        "gearmbs.campaigns.sensitivity": ["sensitivity", "campaign_chaos", "one_factor_studies"],
        "gearmbs.campaigns.subjects.pair": [
            "ClaimsSubject",
            "canonical_case",
            "contact_numbers",
            "harmonics",
            "indicators",
            "ratios",
        ],
    },
    "gearmbs.identify": {
        "gearmbs.identify.fit": EVERYTHING,
        "gearmbs.identify.identifiability": ["make_surrogate"],
        "gearmbs.identify.measured": ["load_problem"],
    },
    "gearmbs.units": {
        "gearmbs.units": ["to_si"],
        "gearmbs.schema.described": ["Described", "make", "measures_of", "read_toml"],
        "gearmbs.schema.quantities": ["Measure", "OneOf", "OverTime"],
        "gearmbs.kernels.ahead": ["compile_all"],
        "gearmbs.files": ["whole_file", "write_whole"],
        "gearmbs.saving": ["save"],
        "gearmbs.progress": EVERYTHING,
    },
}
"""Names worth a page that their package does not export; names that do not exist are an error."""


OBJECTS = "objects"
"""Folder of the pages of objects, in that of the pages of packages."""

NOT_SHOWN = (
    "model_config", "model_fields", "model_computed_fields", "model_post_init", "__init__", "__new__",
)  # fmt: skip
"""Members of classes that say nothing of them."""


def entries(package: str) -> list[str]:
    """Return the full names of the objects of a package that get a page."""
    module = importlib.import_module(package)
    names = [f"{package}.{name}" for name in getattr(module, "__all__", ()) if _documented(getattr(module, name))]
    for home, more in MORE.get(package, {}).items():
        source = importlib.import_module(home)
        for name in _own(source) if more is EVERYTHING else source.__all__ if more is EXPORTED else more:
            getattr(source, name)
            if _documented(getattr(source, name)):
                names.append(f"{home}.{name}")
    return names


def constants(package: str) -> list[str]:
    """Return where the exported constants of a package are defined, by their full names there."""
    return [f"{home}.{name}" for name, home in CONSTANTS.get(package, {}).items()]


def _own(module) -> list[str]:
    """Return the public functions and classes defined in a module, in their order there."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and _documented(value) and getattr(value, "__module__", "") == module.__name__
    ]


def _documented(value: object) -> bool:
    """True for functions and classes; constants are told by their values where they are used."""
    return callable(value) and not inspect.ismodule(value)


def write(folder: Path) -> None:
    """Write one page per package and per object; files whose text is the same are left alone.

    Pages of objects stand in no table of contents: a sidebar of all of them, in each of them, would be most of the
    site. Tables of packages, the search and cross-references lead there, and each leads back.
    """
    objects = folder / OBJECTS
    objects.mkdir(parents=True, exist_ok=True)
    wanted = set()
    for package, title in PACKAGES.items():
        about = (importlib.import_module(package).__doc__ or "").strip()
        lines = [title, "=" * len(title), "", f"Module ``{package}``.", "", about, ""]
        lines += [".. autosummary::", "   :nosignatures:", ""]
        page = package.rpartition(".")[2]
        for name in entries(package):
            lines.append(f"   {name}")
            wanted.add(objects / f"{name}.rst")
            _write(objects / f"{name}.rst", _object_page(name, page, title))
        if package in CONSTANTS or any(home in DESCRIBED for home in (package, *MORE.get(package, {}))):
            lines += ["", "Constants", "---------"]
        for name in constants(package):
            lines += ["", f".. autodata:: {name}", "   :no-value:"]
        for home in (package, *MORE.get(package, {})):
            for name, text in DESCRIBED.get(home, {}).items():
                lines += ["", f".. py:data:: {home}.{name}", "", f"   {text}"]
        _write(folder / f"{page}.rst", "\n".join(lines) + "\n")
    for path in {*objects.glob("*.rst")} - wanted:
        path.unlink()


def _object_page(name: str, page: str, title: str) -> str:
    """Return the page of an object, by its full name, that leads back to that of its package."""
    module, _, own = name.rpartition(".")
    value = getattr(importlib.import_module(module), own)
    kind = "function"
    if inspect.isclass(value):
        kind = "exception" if issubclass(value, BaseException) else "class"
    lines = [":orphan:", "", own, "=" * len(own), "", f":doc:`{title} </_generated/{page}>`", ""]
    lines += [f".. currentmodule:: {module}", "", f".. auto{kind}:: {own}"]
    if kind == "class":
        lines += ["   :members:", f"   :exclude-members: {', '.join(NOT_SHOWN)}"]
    return "\n".join(lines) + "\n"


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def unwrap_compiled() -> None:
    """Put the Python functions in the place of numba's dispatchers, for this process only."""
    names = [info.name for info in pkgutil.walk_packages(gearmbs.__path__, "gearmbs.")]
    # a module that runs when imported is nobody's reference
    names = [name for name in names if not name.endswith("__main__")]
    # all are imported first: compiling one needs the compiled others
    for module in [importlib.import_module(name) for name in names]:
        for name, value in list(vars(module).items()):
            if hasattr(value, "py_func"):
                setattr(module, name, value.py_func)


def escape_bars(app, what, name, obj, options, lines: list[str]) -> None:
    """Keep ``|x|`` and ``x_`` in docstrings from being read as substitutions and references, outside literals."""
    for k, line in enumerate(lines):
        pieces = re.split(r"(``[^`]*``)", line)
        pieces[::2] = [re.sub(r"(\w)_(?!\w)", r"\1\_", piece.replace("|", r"\|")) for piece in pieces[::2]]
        lines[k] = "".join(pieces)
