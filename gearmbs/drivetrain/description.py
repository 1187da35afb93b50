"""Descriptions of drivetrains, and of how they are run, as TOML files or nested tables.

Each kind of part is a table of named tables::

    name = "two stages"
    running = true

    [shafts.input]
    length = "200 mm"
    radius = "15 mm"

    [wheels.z1]
    shaft = "input"
    teeth = 21
    module = "3 mm"

    [meshes."stage 1"]
    driver = "z1"
    driven = "z2"
    backlash = "0.1 mm"
    stiffness = "iso"
    damping_ratio = 0.05

    [[meshes."stage 1".faults]]
    kind = "broken tooth"
    lost = 0.5

    [planetary_stages.low]
    sun = "high"
    carrier = "low"
    ring = "ground"
    teeth = [24, 30, 84]
    module = "2 mm"
    planets = 3
    pins = { radial = "5e8 N/m" }

    [bearings.a]
    kind = "elastic"
    shaft = "input"

    [couplings.clutch]
    kind = "clutch"

    [drives.motor]
    kind = "induction motor"

    [loads.pump]
    kind = "pump"

    [loads.brake]
    shaft = "output"
    torque = { input = "brake torque", unit = "N m", value = 20.0 }

    [sensors.laser]
    kind = "laser"

    [run]
    duration = "1 s"
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar

from gearmbs.dae.methods import DEFAULT, INTEGRATORS
from gearmbs.drivetrain.connections import BEARINGS
from gearmbs.drivetrain.couplings.misaligned import COUPLINGS
from gearmbs.drivetrain.drives import DRIVES
from gearmbs.drivetrain.drivetrain import KINDS, Drivetrain
from gearmbs.drivetrain.housing import Housing, HousingMode, Mount
from gearmbs.drivetrain.loads import LOADS
from gearmbs.drivetrain.on_shafts import with_parts_of_shafts
from gearmbs.drivetrain.part import DrivetrainError, Part, errors_named, require
from gearmbs.drivetrain.parts import SENSORS, GearMesh, Wheel
from gearmbs.drivetrain.planetary import SET_KEYS, STAGE_KEYS, PlanetaryStage, planetary_set
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.gears.pair import GearPair
from gearmbs.gears.spec import GearSpec, Material
from gearmbs.mechanism.parts.inputs import make_input
from gearmbs.schema.described import Described, check_keys, chosen, line, make, read_toml
from gearmbs.schema.quantities import Measure, OneOf
from gearmbs.units import Quantity

FaultReader = Callable[[Any], Any]
"""Makes a fault of a table."""

BY_KIND: dict[str, tuple[Mapping[str, type[Part]], str]] = {
    "bearings": (BEARINGS, "ideal"),
    "couplings": (COUPLINGS, "clutch"),
    "drives": (DRIVES, "speed"),
    "loads": (LOADS, "torque"),
    "sensors": (SENSORS, "speed"),
}
"""Kinds of parts by group, and the kind of a part that names none."""

PAIR_KEYS = tuple(
    f.name for f in fields(GearPair) if f.init and f.name not in ("driver", "driven", "rotation", "torque")
)
HARMONICS = Measure(low=1, whole=True, remedy="give a whole number of mesh harmonics from 1 up")
OF_WHEELS = ("shaft", "station", "angle", "body")
GEAR_KEYS = tuple(f.name for f in fields(GearSpec) if f.init and f.name != "name")


@dataclass(frozen=True)
class RunSettings(Described):
    """How a drivetrain is simulated and recorded.

    Parameters
    ----------
    settling, duration : float or str
        Time between the run-up and the record, and the record's length, s.
    tolerance : float
        Local error allowed a step.
    rate : float or str, optional
        Of the record, Hz; default: at least twenty samples in the shortest mesh period, 12 800 Hz or more.
    integrator : str
        One of `gearmbs.dae.methods.INTEGRATORS`.
    harmonics : int
        Mesh harmonics in the record's table, 1 or more.
    """

    error: ClassVar[type[ValueError]] = DrivetrainError
    section: ClassVar[str] = "run"

    settling: Annotated[Quantity, Measure("time", 0)] = 0.05
    duration: Annotated[Quantity, Measure("time", above=0)] = 1.0
    tolerance: Annotated[Quantity, Measure(low=1e-12, high=5e-6)] = 1e-7
    rate: Annotated[Quantity, Measure("frequency", above=0)] = None
    integrator: Annotated[str, OneOf(INTEGRATORS)] = DEFAULT
    harmonics: Annotated[int, HARMONICS] = 3

    def output_rate(self, train: Drivetrain) -> float:
        """Return the rate of the record, Hz."""
        if self.rate is not None:
            return float(self.rate)
        fastest = max((train.kinematics.mesh_frequency(m.name) for m in train.meshings), default=0.0)
        return max(12800.0, 100.0 * math.ceil(20.0 * fastest / 100.0))


@dataclass(frozen=True)
class Description:
    """A drivetrain and how it is run.

    Attributes
    ----------
    train : Drivetrain
    run : RunSettings
    """

    train: Drivetrain
    run: RunSettings


def read_description(path: str | Path, fault: FaultReader | None = None) -> Description:
    """Read a TOML file.

    Parameters
    ----------
    path : path-like
    fault : callable, optional
        Makes a fault of a table, see `gearmbs.studies.case.tooth_faults`; without it a file cannot hold faults.

    Raises
    ------
    DrivetrainError
        One line that names the file, the part, the key, the value and the remedy.
    """
    data = read_toml(path, DrivetrainError)
    data.setdefault("name", Path(path).stem)
    return make_description(data, str(path), fault, Path(path).parent)


def make_description(
    data: Mapping[str, Any], source: str = "drivetrain", fault: FaultReader | None = None, folder: Path | None = None
) -> Description:
    """Return the drivetrain that nested tables describe; see the top of this file for their form.

    Files that they name are looked for in ``folder``, the present one if there is none.
    """
    try:
        return _made(data, fault, folder or Path())
    except ValueError as error:
        raise DrivetrainError(f"{source}: {error}") from None


def _made(data: Mapping[str, Any], fault: FaultReader | None, folder: Path) -> Description:
    known = ("name", "gravity", "run_up", "running", "run", *KINDS)
    check_keys(data, known, "the file", DrivetrainError, shown=repr)
    parts: dict[str, Any] = {}
    groups = with_parts_of_shafts({group: data.get(group, {}) for group in KINDS})
    for group, tables in groups.items():
        require(isinstance(tables, Mapping), f"{group}: write a table for each, such as [{group}.a]")
        parts[group] = [_part(group, str(name), table, fault, folder) for name, table in tables.items()]
    others: dict[str, Any] = {key: data[key] for key in ("name", "running") if key in data}
    running = data.get("running", False)
    require(isinstance(running, bool), f"running is {running!r}; give true or false")
    if "gravity" in data:
        others["gravity"] = _measured(data, "gravity", Measure("acceleration", several=3))
    if "run_up" in data:
        others["run_up"] = _measured(data, "run_up", Measure("time", above=0))
    run = make(RunSettings, data.get("run", {}), "[run]", DrivetrainError)
    return Description(Drivetrain(**parts, **others), run)


def _measured(data: Mapping[str, Any], key: str, measure: Measure) -> Any:
    try:
        return measure.as_given(data[key])
    except ValueError as error:
        raise DrivetrainError(line(key, data[key], error)) from None


def _part(group: str, name: str, table: Any, fault: FaultReader | None, folder: Path) -> Part:
    where = f"{group}.{name}"
    require(isinstance(table, Mapping), f"{where}: write a table, such as [{where}]")
    settings = {key: _given(f"{where}.{key}", value) for key, value in table.items()}
    if group == "wheels":
        return _wheel(where, name, settings, folder)
    if group == "meshes":
        return _mesh(where, name, settings, fault)
    if group == "planetary_stages":
        return _stage(where, name, settings, fault, folder)
    if group == "housings":
        return _housing(where, name, settings, folder)
    if group == "shafts":
        if isinstance(settings.get("model"), Mapping):
            settings["model"] = _from_folder(where, settings["model"], folder)
        return _of_kind(where, Shaft, name, settings)
    kinds, usual = BY_KIND[group]
    return _of_kind(
        where, chosen(kinds, str(settings.pop("kind", usual)), f"{where}: ", DrivetrainError), name, settings
    )


def _given(where: str, value: Any) -> Any:
    """Return a value of a part: a list as a tuple, a table ``{ input = "load", unit = "N m" }`` as an input."""
    if isinstance(value, Mapping) and "input" in value:
        known = ("input", "unit", "value")
        check_keys(value, known, where, DrivetrainError, shown=repr)
        require(isinstance(value.get("unit"), str), f'{where}: unit is missing; give that of the input, such as "N m"')
        try:
            return make_input(value["input"], value["unit"], value.get("value", 0.0))
        except ValueError as error:
            raise DrivetrainError(f"{where}: {error}") from None
    return tuple(value) if isinstance(value, list) else value


def _of_kind(where: str, kind: type[Part], name: str, settings: Mapping[str, Any]) -> Any:
    with errors_named(where):
        return make(kind, settings, where, DrivetrainError, name=name)


def _wheel(where: str, name: str, settings: dict[str, Any], folder: Path) -> Wheel:
    own: dict[str, Any] = {key: settings.pop(key) for key in OF_WHEELS if key in settings}
    if isinstance(own.get("body"), Mapping) and isinstance(own["body"].get("model"), Mapping):
        own["body"] = {**own["body"], "model": _from_folder(f"{where}.body", own["body"]["model"], folder)}
    material = {key: settings.pop(key) for key in ("density", "youngs_modulus", "poisson_ratio") if key in settings}
    known = [*OF_WHEELS, *GEAR_KEYS, "tip_radius", "root_radius"]
    check_keys(settings, known, where, DrivetrainError, shown=repr)
    for key in ("teeth", "module"):
        require(key in settings, f"{where}: {key} is missing")
    with errors_named(where):
        if material:
            settings["material"] = Material(**material)
        radii = [key for key in ("tip_radius", "root_radius") if key in settings]
        if radii:
            require(len(radii) == 2, f"{where}: give tip_radius and root_radius, or addendum and dedendum")
            gear = GearSpec.from_radii(name=name, **settings)
        else:
            gear = GearSpec(name=name, **settings)
    return _of_kind(where, Wheel, name, {**own, "gear": gear})


def _mesh(where: str, name: str, settings: dict[str, Any], fault: FaultReader | None) -> GearMesh:
    own: dict[str, Any] = {
        key: settings.pop(key) for key in ("driver", "driven", "direction", "phase") if key in settings
    }
    known = ["driver", "driven", "direction", "phase", *PAIR_KEYS, "stiffness", "damping_ratio"]
    check_keys(settings, known, where, DrivetrainError, shown=repr)
    if "faults" in settings:
        require(fault is not None, f"{where}: faults cannot be read here; run the file with gearmbs run")
        assert fault is not None
        with errors_named(f"{where}.faults"):
            settings["faults"] = tuple(fault(table) for table in settings["faults"])
    return _of_kind(where, GearMesh, name, {**own, "settings": settings})


def _stage(where: str, name: str, settings: dict[str, Any], fault: FaultReader | None, folder: Path) -> PlanetaryStage:
    body = settings.get("carrier_body")
    if isinstance(body, Mapping) and isinstance(body.get("model"), Mapping):
        settings["carrier_body"] = {**body, "model": _from_folder(f"{where}.carrier_body", body["model"], folder)}
    own: dict[str, Any] = {key: settings.pop(key) for key in STAGE_KEYS if key in settings}
    check_keys(settings, [*STAGE_KEYS, *SET_KEYS], where, DrivetrainError, shown=repr)
    with errors_named(where):
        gears = planetary_set({"name": name, **settings}, fault, place=where)
    return _of_kind(where, PlanetaryStage, name, {**own, "gears": gears})


def _housing(where: str, name: str, settings: dict[str, Any], folder: Path) -> Housing:
    if isinstance(settings.get("model"), Mapping):
        settings["model"] = _from_folder(where, settings["model"], folder)
    for key, kind in (("mounts", Mount), ("modes", HousingMode)):
        tables = settings.pop(key, {})
        if key == "modes" and "model" in settings and not isinstance(tables, Mapping):
            settings[key] = tables
            continue
        require(isinstance(tables, Mapping), f"{where}.{key}: write a table for each, such as [{where}.{key}.a]")
        made = []
        for part, table in tables.items():
            fitted = {k: tuple(v) if isinstance(v, list) else v for k, v in table.items()}
            called = str(fitted.pop("name", f"{name} {part}"))
            made.append(_of_kind(f"{where}.{key}.{part}", kind, called, fitted))
        settings[key] = tuple(made)
    return _of_kind(where, Housing, name, settings)


BESIDE = ("assembly", "bulk")
"""Keys of a finite-element model that name a file beside the others."""


def _from_folder(where: str, model: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the table of a finite-element model with the files that it names, by their full paths."""
    table = dict(model)
    files = table.get("files", [])
    files = [files] if isinstance(files, str) else files
    texts = isinstance(files, list) and all(isinstance(file, str) for file in files)
    require(texts, f"{where}.model: files is {files!r}; give a list of texts")
    if files:
        table["files"] = [folder / file for file in files]
    return table | {key: folder / table[key] for key in BESIDE if isinstance(table.get(key), str)}
