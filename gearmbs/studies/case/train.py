"""A case as a drivetrain: two shafts with a wheel each, a mesh, a drive and a load.

A case whose shafts bend, or stand in rolling bearings, is simulated as these parts, built by `gearmbs.drivetrain`; its
wheels are bodies of their own, fixed to their shafts, so that its record has the forces between them as that of any
case. Shafts that bend turn in a ball joint on the driving side and in a sliding one on the other where no rolling
bearings are given. Stations are measured from a shaft's left end; the wheel is in its middle, the drive at its left end
and the load at its right. Cases are told by their fields alone here: a case asks for its parts when it is made.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    GearMesh,
    IdealBearing,
    RollingContactBearing,
    Shaft,
    SpeedDrive,
    TorqueLoad,
    Wheel,
)
from gearmbs.drivetrain.build import build
from gearmbs.drivetrain.part import Attached
from gearmbs.mechanism.parts.elements import Torque
from gearmbs.mechanism.parts.functions import TimeFunction
from gearmbs.studies.case.drive import load_torque
from gearmbs.studies.case.section import CaseError
from gearmbs.studies.run import rig

if TYPE_CHECKING:
    from gearmbs.drivetrain.connections import Bearing
    from gearmbs.mechanism import Mechanism


def parts_of(case: Any, settings: Mapping[str, Any] | None = None, each: Mapping[str, Any] | None = None) -> Drivetrain:
    """Return the drivetrain of a case at its largest torque, with settings of all or of single rolling bearings."""
    operation, shafts = case.operation, case.shafts
    sense, curve = case.pair().rotation, operation.speed_curve
    runs = None if curve is None else tuple((operation.settling + t, sense * w) for t, w in curve)
    try:
        return Drivetrain(
            case.name,
            shafts=[
                Shaft(
                    name=name, length=shafts.length, radius=shafts.radius, density=shafts.density, modes=shafts.modes,
                    position=(0.0, 0.0, -0.5 * shafts.length) if name == rig.SHAFTS[0] else None,
                )
                for name in rig.SHAFTS
            ],
            wheels=[
                Wheel(name=name, shaft=shaft, gear=gear)
                for name, shaft, gear in zip(rig.GEARS, rig.SHAFTS, case.gears.wheels, strict=True)
            ],
            meshes=[GearMesh(name=rig.MESH, driver=rig.GEARS[0], driven=rig.GEARS[1], settings=_mesh(case))],
            bearings=_bearings(case, settings or {}, each or {}),
            drives=[SpeedDrive(name=rig.DRIVE, shaft=rig.SHAFTS[0], speed=sense * operation.top_speed, curve=runs)],
            loads=[TorqueLoad(name=rig.LOAD, shaft=rig.SHAFTS[1], torque=operation.top_torque)],
            run_up=operation.run_up,
        )  # fmt: skip
    except DrivetrainError as error:
        raise CaseError(f"case '{case.name}': shafts: {error}") from None


@dataclass(frozen=True, kw_only=True)
class OwnTorque(TorqueLoad):
    """The torque of a case, which may follow a curve and be an input: ``torque`` is the largest.

    Parameters
    ----------
    over : TimeFunction
        About the axis of the shaft, N m.
    """

    over: TimeFunction

    def add(self, at: Attached) -> None:
        at.mechanism.add(Torque(self.name, at.i, at.j, at.j, self.over))


def _mesh(case: Any) -> dict[str, Any]:
    """Return the settings of the pair of a case."""
    pair = case.pair()
    same = ("centre_distance_error", "misalignment", "plane", "pivot", "axial_shift", "backlash", "contact", "friction")
    return {name: getattr(pair, name) for name in (*same, "slices", "faults")}


def _bearings(case: Any, settings: Mapping[str, Any], each: Mapping[str, Any]) -> list[Bearing]:
    """Return two bearings on each shaft; of rigid shafts without designations, one joint."""
    shafts = case.shafts
    length = shafts.length
    half = 0.5 * (length if shafts.bearing_distance is None else shafts.bearing_distance)
    out: list[Bearing] = []
    for k, (name, shaft) in enumerate(zip(rig.BEARINGS, rig.SHAFTS, strict=True)):
        if not shafts.are_parts:
            out.append(IdealBearing(name=name, shaft=shaft))
            continue
        for end, station in zip(rig.ENDS, (0.5 * length - half, 0.5 * length + half), strict=True):
            place: dict[str, Any] = {"name": f"{name} {end}", "shaft": shaft, "station": station}
            if shafts.bearings is None:
                out.append(IdealBearing(**place))
            else:
                own = {**settings, **each.get(place["name"], {})}
                out.append(RollingContactBearing(**place, rolling=shafts.bearings[k], settings=own))
    return out


def mechanism_of_parts(case: Any, settings: Mapping[str, Any], each: Mapping[str, dict[str, Any]] | None) -> Mechanism:
    """Return the mechanism of a case whose shafts bend or stand in rolling bearings; see `case_mechanism`.

    Raises
    ------
    CaseError
        For settings of bearings that it does not have.
    """
    operation = case.operation
    train = parts_of(case, settings, each)
    known = [bearing.name for bearing in train.bearings if bearing.kind == RollingContactBearing.kind]
    if settings and not known:
        raise CaseError(f"{next(iter(settings))}: case '{case.name}' has no rolling bearings; give shafts.bearings")
    for name in each or {}:
        if name not in known:
            told = f"choose among {', '.join(known)}" if known else "give shafts.bearings"
            raise CaseError(f"each: there is no rolling bearing {name!r}; {told}")
    start = operation.run_up + operation.settling
    over = load_torque(operation.torque, operation.run_up, start, rig.resisting(case.pair()))
    load = OwnTorque(name=rig.LOAD, shaft=rig.SHAFTS[1], torque=operation.top_torque, over=over)
    m = build(train.of_same_bodies(loads=[load]), dict(zip(rig.GEARS, rig.SEATS, strict=True)))
    m.aliases["operation.torque"] = f"{rig.LOAD}.torque"
    return m
