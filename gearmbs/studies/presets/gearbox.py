"""An industrial gearbox as a preset: two helical stages on parallel shafts, rigid shafts and wheels, elastic teeth.

Such a rigid-elastic model is what Kong et al. made of a big industrial gearbox. Teeth, modules and helix angles are
those published for the two parallel stages of a gearbox of 750 kW; what is not published is a choice, listed by
`gearbox_choices`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gearmbs.drivetrain import (
    Drivetrain,
    GearMesh,
    HousingMode,
    InductionMotor,
    RunSettings,
)
from gearmbs.gears import ContactLaw, GearPair, GearSpec
from gearmbs.signals.analysis.report import markdown_table
from gearmbs.studies.presets.files import BenchChoice, choices, on_mounts, preset_train, with_values
from gearmbs.studies.run.store import save_study
from gearmbs.studies.train_views import mesh_orders, train_modes, train_report
from gearmbs.studies.trains import run_trains
from gearmbs.units import Quantity, to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gearmbs.dae.analyses.modes import Modes

HELIX = math.radians(14.0)
SHAFTS = {"high": 1.0, "lay": 2.0, "low": 4.0}
"""Stiffness of each shaft's bearings over that of the high-speed shaft's."""
BOX = (1.0, 0.9, 0.7)
"""The housing, a box about the shafts, m."""
WALLS = {"front wall": 310.0, "rear wall": 420.0}
"""Frequencies of the housing's modes, Hz; in each the seats of one side move together."""


@dataclass(frozen=True)
class GearboxSettings:
    """What the industrial gearbox is made of; see `gearbox_choices` for why.

    Parameters
    ----------
    speed, power : float or str
        Of the motor.
    motor : {"speed", "induction"}
    curve : sequence of (time, speed), optional
        Of the motor at a prescribed speed: a run-up or coast-down.
    helix_angle : float or str
        0: spur wheels.
    bearing_stiffness : float
        Radial stiffness of the high-speed shaft's bearings, N/m; the lay shaft's are twice, the low-speed shaft's four
        times as stiff.
    housing_mass : float
        kg.
    mount_stiffness : float
        Of each of four mounts, N/m.
    damping_ratio : float
        Of the tooth contacts, of critical damping of each stage on its mesh.
    faults : mapping of str to sequence of Fault, optional
        Of the meshes "high stage" and "low stage".
    """

    speed: Quantity = "1793 rpm"
    power: Quantity = "750 kW"
    motor: str = "speed"
    curve: tuple[tuple[Quantity, Quantity], ...] | None = None
    helix_angle: Quantity = HELIX
    bearing_stiffness: float = 8.2e8
    housing_mass: float = 3000.0
    mount_stiffness: float = 8e7
    damping_ratio: float = 0.05
    faults: Any = None


def industrial_gearbox(settings: GearboxSettings | None = None) -> Drivetrain:
    """Return the gearbox between a motor and a machine whose torque grows with the square of its speed.

    Parameters
    ----------
    settings : GearboxSettings, optional

    Returns
    -------
    Drivetrain
        Shafts motor, high, lay, low and machine; meshes "high stage" and "low stage"; an accelerometer on the housing
        at every bearing's seat.

    Examples
    --------
    >>> train = industrial_gearbox()
    >>> round(train.kinematics.mesh_frequency("high stage"), 2), round(train.kinematics.ratio("high", "low"), 4)
    (657.43, 14.2609)
    """
    s = settings or GearboxSettings()
    speed, power = to_si(s.speed, "angular speed", "speed"), to_si(s.power, "power", "power")
    if s.motor not in ("speed", "induction"):
        raise ValueError(f"motor is {s.motor!r}; choose 'induction' or 'speed'")
    train = preset_train("gearbox")
    helix = to_si(s.helix_angle, "angle", "helix_angle")
    # the fillet that fits is that of the helix angle
    wheels = [replace(w, gear=replace(w.gear, helix_angle=helix, fillet_radius=None)) for w in train.wheels]
    drive: Any = {"speed": speed, "curve": s.curve}
    if s.motor == "induction":
        drive = InductionMotor(name="drive", shaft="motor", speed=speed, power=power, poles=4,
                               frequency=1.006 * speed / math.pi, breakdown=2.5)  # fmt: skip
    ratio = math.prod(wheels[k + 1].gear.teeth / wheels[k].gear.teeth for k in (0, 2))
    housing = on_mounts(train.housings[0], s.housing_mass, s.mount_stiffness, BOX)
    values: dict[str, Any] = {wheel.name: wheel for wheel in wheels}
    values |= {
        mesh.name: {"settings": _mesh(mesh, wheels[2 * k].gear, wheels[2 * k + 1].gear, s)}
        for k, mesh in enumerate(train.meshes)
    }
    for shaft, times in SHAFTS.items():
        k = times * s.bearing_stiffness
        # the left one also locates the shaft
        values |= {f"{shaft} {side}": {"stiffness": (k, k, axial * k)} for side, axial in (("a", 0.4), ("b", 0.1))}
    values |= {
        "housing": replace(housing, modes=tuple(_panel(mode, 0.1 * s.housing_mass) for mode in housing.modes)),
        "drive": drive,
        "machine load": {"torque": power / speed * ratio, "at_speed": speed / ratio},
    }
    return with_values(train, values)


def _mesh(mesh: GearMesh, driver: GearSpec, driven: GearSpec, s: GearboxSettings) -> dict[str, Any]:
    """Return the settings of a mesh: the stiffness of ISO 6336-1, damped as its two wheels on it, and its faults.

    The shaft in a wheel's bore moves with it: its inertia is that of the solid wheel.
    """
    k = GearPair(driver, driven).with_iso_stiffness().contact.stiffness
    solid = [replace(wheel, bore_radius=0.0) for wheel in (driver, driven)]
    mass = 1.0 / sum(wheel.base_radius**2 / wheel.inertia[2] for wheel in solid)
    contact = ContactLaw.linear(k, damping=2.0 * s.damping_ratio * math.sqrt(k * mass), depth="2 um")
    faults = {"faults": tuple(s.faults[mesh.name])} if s.faults and mesh.name in s.faults else {}
    return {**mesh.settings, "contact": contact, **faults}


def _panel(mode: HousingMode, mass: float) -> HousingMode:
    """Return the mode of a wall of another modal mass (kg) at the same frequency."""
    name = mode.name.removeprefix("housing ")
    return replace(mode, name=name, mass=mass, stiffness=mass * (2.0 * math.pi * WALLS[name]) ** 2)


def gearbox_choices(settings: GearboxSettings | None = None) -> list[BenchChoice]:
    """Return what is published of the gearbox, and every choice with its reason."""
    s = settings or GearboxSettings()
    gears = [wheel.gear for wheel in preset_train("gearbox").wheels]
    pairs = list(zip(gears[::2], gears[1::2], strict=True))
    teeth = ", ".join(f"{one.teeth}/{two.teeth}, m {1e3 * one.module:g} mm" for one, two in pairs)
    widths = " and ".join(f"{1e3 * one.face_width:g} mm" for one, _ in pairs)
    engine = "prescribed speed" if s.motor == "speed" else "induction motor, Kloss"
    known = {"stages": teeth, "widths": widths, "damping": 100 * s.damping_ratio, "engine": engine}
    return choices("gearbox", vars(s) | known)


# The industrial gearbox, studied: modes, Campbell diagram, steady state and run-up, bearing forces, housing.


HIGHEST = 2000.0
"""Modes up to this frequency are told, Hz."""
SETTLING = 0.3
"""Time from the load's coming on to the record, s: the clutches' modes have then lost all but a thousandth."""
HELD = 0.1
"""Share of the run-up at whose end the speed is held, so that windows of order tracking fit into the steady part."""
SLOWEST = 0.25
"""Speed at which the run-up begins, over the operating speed."""


@dataclass(frozen=True)
class GearboxStudy:
    """What was computed of the industrial gearbox.

    Attributes
    ----------
    train : Drivetrain
    modes : Modes
        Under load, see `gearmbs.studies.train_modes`.
    steady, run_up : Dataset
        Records at the operating speed and of a run-up to it, see `gearmbs.studies.run_train`.
    settings : GearboxSettings
    """

    train: Drivetrain
    modes: Modes
    steady: xr.Dataset
    run_up: xr.Dataset
    settings: GearboxSettings

    def campbell(self) -> xr.Dataset:
        """Return the Campbell diagram: modes under load, mesh harmonics, and where they meet."""
        from gearmbs.signals import campbell

        operating = float(self.train.drives[0].speed)
        found = campbell(self.modes, np.linspace(0.0, 1.2 * operating, 13), mesh_orders(self.train), maximum=HIGHEST)
        return found.assign_attrs(operating_speed=operating)

    def report(self) -> str:
        """Return the report in Markdown: modes, critical speeds, the steady state, the run-up, choices."""
        from gearmbs.signals.analysis.campbell import critical_speeds

        modes = self.modes.oscillating
        known = zip(self.modes.frequencies[modes], self.modes.damping_ratios[modes], strict=True)
        rows = [
            [k, f"{f:.5g}", f"{zeta:.3g}"]
            for k, (f, zeta) in enumerate((pair for pair in known if 0.1 < pair[0] < HIGHEST), 1)
        ]
        lines = ["# Industrial gearbox", "", "## Modes under load", ""]
        lines += [markdown_table(["mode", "Hz", "damping ratio"], rows), ""]
        found = critical_speeds(self.campbell())
        rows = [
            [f"{row.speed_rpm:.5g}", f"{row.frequency_hz:.5g}", row.mode, row.order]
            for row in found[found.speed_rpm > 0.5 * self.train.drives[0].speed * 30.0 / np.pi].itertuples()
        ]
        lines += ["## Critical speeds of the motor, from half of the operating speed on", ""]
        lines += [markdown_table(["rpm", "Hz", "mode", "mesh harmonic"], rows)]
        lines += ["", train_report(self.train, self.steady).replace("# industrial gearbox", "# Steady state", 1)]
        lines += [train_report(self.train, self.run_up).replace("# industrial gearbox", "# Run-up", 1)]
        lines += ["# Choices", "", markdown_table(BenchChoice._fields, gearbox_choices(self.settings))]
        return "\n".join(lines) + "\n"

    def figures(self) -> dict[str, Figure]:
        """Return the Campbell diagram, and housing and bearings along the run-up, by name."""
        from gearmbs.view import campbell_plot
        from gearmbs.view.figures.style import look, new_figure

        tracks = self.run_up["mesh_track"]
        rpm = tracks["track_speed"].values * 30.0 / np.pi
        with look():
            figure = new_figure(8.0, 6.0)
            upper, lower = figure.subplots(2, 1, sharex=True)
            for mesh in self.train.meshes:
                for shaft in SHAFTS:
                    row = tracks.sel(mesh=mesh.name, harmonic=1)
                    label = f"{shaft} b, {mesh.name}"
                    upper.plot(rpm, row.sel(signal=f"housing at {shaft} b").values, label=label, lw=1.0)
                    lower.plot(rpm, row.sel(signal=f"{shaft} b y").values, label=label, lw=1.0)
            upper.set_ylabel("housing, 1st mesh harmonic,\nm/s² RMS")
            upper.legend(frameon=False, ncols=2)
            lower.set(ylabel="bearing force y,\nN RMS", xlabel="motor, rpm", yscale="log")
        return {"campbell": campbell_plot(self.campbell(), title="industrial gearbox"), "run_up": figure}

    def save(self, folder: str | Path) -> list[Path]:
        """Write records, report and figures to a folder; return the paths."""
        records = {"steady.nc": self.steady, "run_up.nc": self.run_up}
        return save_study(folder, records, {"report.md": self.report}, self.figures)


def run_gearbox(
    settings: GearboxSettings | None = None,
    *,
    duration: float = 1.0,
    run_up: float = 4.0,
    tolerance: float = 1e-6,
    progress: bool | Callable[[str, float], None] | None = None,
) -> GearboxStudy:
    """Compute modes, steady state and a run-up of the industrial gearbox.

    Parameters
    ----------
    settings : GearboxSettings, optional
        Without ``curve``, at a prescribed speed.
    duration : float
        Of the record at the operating speed, s.
    run_up : float
        Time from a quarter of the operating speed to it, of which the last tenth holds it, s.
    tolerance : float
    progress : bool or callable, optional
        See `gearmbs.studies.run_trains`; the runs are "steady" and "run-up".

    Raises
    ------
    ValueError
        If the settings have a curve, or a motor whose speed is not prescribed.
    SimulationFailed
        If a run stops early.
    """
    s = settings or GearboxSettings()
    if s.curve is not None or s.motor != "speed":
        raise ValueError("settings: a run-up is added here; leave curve out, and motor 'speed'")
    train = industrial_gearbox(s)
    speed = to_si(s.speed, "angular speed", "speed")
    reached = SETTLING + (1.0 - HELD) * run_up
    points = ((SETTLING, SLOWEST * speed), (reached, speed), (SETTLING + run_up, speed))
    faster = industrial_gearbox(replace(s, curve=points))
    modes = train_modes(train)
    runs = {
        name: (one, RunSettings(settling=SETTLING, duration=length, tolerance=tolerance))
        for name, one, length in (("steady", train, duration), ("run-up", faster, run_up))
    }
    records = run_trains(runs, progress=progress)
    return GearboxStudy(train, modes, records["steady"], records["run-up"], s)
