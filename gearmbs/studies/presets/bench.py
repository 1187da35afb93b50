"""The test bench of the paper's Fig. 2: motor, elastic clutch, two pairs of wheels, shafts, hydraulic pump.

Nothing of the bench but its wheels is published: every other number is a choice, listed by `bench_choices`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gearmbs._display import Written
from gearmbs.drivetrain import Drivetrain, IdealBearing, RunSettings, Shaft, SpeedDrive
from gearmbs.gears import ContactLaw
from gearmbs.signals import convert
from gearmbs.signals.analysis.bands import harmonic_amplitudes
from gearmbs.signals.analysis.report import markdown_table
from gearmbs.signals.files.simulated import holds_speed
from gearmbs.studies.case.case import Case
from gearmbs.studies.presets.files import BenchChoice, choices, on_mounts, preset_train, with_values
from gearmbs.studies.presets.paper import PaperStudy, run_paper, verdict_table
from gearmbs.studies.presets.paper_cases import Claim, judge
from gearmbs.studies.run.record import flank_shares
from gearmbs.studies.run.store import save_study
from gearmbs.studies.trains import run_trains, train_signal
from gearmbs.units import Quantity, to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PRESSURES = {"low": 1e6, "high": 5e6}
"""Pa, as the paper has them."""
STATES = {
    "healthy": {},
    "misaligned": {"misalignment": math.radians(1.0)},
    "distance": {"centre_distance_error": 3e-3},
}
"""The three states of the first pair."""
SEATS = ("one", "two", "three", "four")
BOX = (0.3, 0.3, 0.6)
"""The housing, a box about the shafts, m."""

DISPLACEMENT = 2.0 * math.pi * (200.0 - 100.0) / (5e6 - 1e6)
IDLE = 75.0
"""The one displacement (m^3) and idle torque (N m) with which 1 and 5 MPa are the paper's 100 and 200 N m."""


@dataclass(frozen=True)
class BenchSettings(Written):
    """What the bench is made of; see `bench_choices` for why.

    Parameters
    ----------
    speed : float or str
    motor : {"induction", "speed"}
    motor_inertia, pump_inertia : float
        kg m^2.
    clutch, shafts : float
        Torsional stiffnesses, N m/rad.
    clutch_damping : float
        Relative damping of the clutch.
    bearings : {"elastic", "ideal"}
        Ideal: joints on the ground, shafts that do not twist and no housing: four bodies; nothing for a laser to see.
    bearing_stiffness : float
        Radial, N/m.
    housing_mass : float
        kg.
    mount_stiffness : float
        Of each of four mounts, N/m.
    backlash : float or str
    phase : float
        Of the second mesh, pitches.
    pump_teeth : int
        0: no ripple.
    displacement, idle : float
        Of the pump, m^3 and N m.
    """

    speed: Quantity = "1000 rpm"
    motor: str = "induction"
    motor_inertia: float = 0.030
    pump_inertia: float = 0.004
    clutch: float = 3000.0
    shafts: float = 20000.0
    clutch_damping: float = 0.8
    bearings: str = "elastic"
    bearing_stiffness: float = 2e8
    housing_mass: float = 60.0
    mount_stiffness: float = 5e6
    backlash: Quantity = "0.1 mm"
    phase: float = 0.0
    pump_teeth: int = 12
    displacement: float = DISPLACEMENT
    idle: float = IDLE


def bench_train(
    pressure: Quantity = "1 MPa", state: str = "healthy", settings: BenchSettings | None = None
) -> Drivetrain:
    """Return the bench at a pressure, its first pair in one of three states.

    Parameters
    ----------
    pressure : float or str
        At the pump, Pa.
    state : {"healthy", "misaligned", "distance"}
    settings : BenchSettings, optional

    Returns
    -------
    Drivetrain
        Shafts motor, one, two, three, four, pump; meshes "pair 1" and "pair 2"; sensors laser, support, speed, torque.

    Examples
    --------
    >>> train = bench_train("5 MPa")
    >>> round(train.power.torques["pair 1"][1], 3)
    -200.0
    """
    s = settings or BenchSettings()
    if state not in STATES:
        raise ValueError(f"state is {state!r}; choose one of {', '.join(STATES)}")
    if s.motor not in ("induction", "speed"):
        raise ValueError(f"motor is {s.motor!r}; choose 'induction' or 'speed'")
    if s.bearings not in ("elastic", "ideal"):
        raise ValueError(f"bearings is {s.bearings!r}; choose 'elastic' or 'ideal'")
    speed = to_si(s.speed, "angular speed", "speed")
    # the paper's law, whatever the wheels are
    law = {"backlash": s.backlash, "contact": ContactLaw.impact()}
    motor: Any = SpeedDrive(name="drive", shaft="motor", speed=speed)
    if s.motor == "induction":
        # 22 kW on an inverter that holds 1.026 of the speed as synchronous speed
        motor = {"speed": speed, "power": 22e3 * speed / to_si("1000 rpm", "angular speed", ""),
                 "frequency": 1.026 * speed / math.pi}  # fmt: skip
    values: dict[str, Any] = {
        "motor": {"inertia": s.motor_inertia},
        "pair 1": {"settings": {**law, **STATES[state]}},
        "pair 2": {"settings": law, "phase": s.phase},
        "clutch": {"stiffness": s.clutch, "relative_damping": s.clutch_damping},
        "drive": motor,
        "pump load": {"displacement": s.displacement, "pressure": pressure, "idle": s.idle, "teeth": s.pump_teeth},
    }
    train = preset_train("bench")
    if s.bearings == "ideal":
        train = _on_joints(train, s.pump_inertia)
    else:
        k = s.bearing_stiffness
        values |= {
            "pump": {"inertia": s.pump_inertia},
            "middle": {"stiffness": s.shafts},
            "end": {"stiffness": s.shafts},
            **{f"{shaft} {side}": {"stiffness": (k, k, 0.5 * k)} for shaft in SEATS for side in "ab"},
            "housing": on_mounts(train.housings[0], s.housing_mass, s.mount_stiffness, BOX),
        }
    return replace(with_values(train, values), name=f"bench, {state}")


def _on_joints(train: Drivetrain, pump: float) -> Drivetrain:
    """Return the bench in joints on the ground, with wheels of both meshes on one shaft and no housing: four bodies.

    Parameters
    ----------
    train : Drivetrain
    pump : float
        Moment of inertia of the pump, which the last shaft takes on, kg m^2.
    """
    one, two, four = (train.part(name, Shaft) for name in ("one", "two", "four"))
    z1, z2, z3, z4 = train.wheels
    return replace(
        train,
        shafts=[train.part("motor"), one, replace(two, length=0.40), replace(four, inertia=four.body()[2] + pump)],
        wheels=[z1, z2, replace(z3, shaft="two", station=0.3), z4],
        couplings=[train.part("clutch")],
        bearings=[
            train.part("motor bearing"),
            *(IdealBearing(name=f"{s.name} a", shaft=s.name, station=0.02, on="ground") for s in (one, two, four)),
        ],
        housings=[],
        loads=[replace(train.part("pump load"), shaft="four")],
        sensors=[train.part("speed"), train.part("torque")],
    )


def bench_choices(settings: BenchSettings | None = None) -> list[BenchChoice]:
    """Return every choice of the bench that the paper leaves open, with its reason."""
    s = settings or BenchSettings()
    usual = BenchSettings()
    changed = [f.name for f in fields(s) if getattr(s, f.name) != getattr(usual, f.name)]
    low, high = (s.displacement / (2.0 * math.pi) * p + s.idle for p in PRESSURES.values())
    found = choices("bench", {
        **vars(s), "volume": 1e6 * s.displacement, "low": low, "high": high, "law": ContactLaw.impact(),
        "ripple": f"{s.pump_teeth} teeth, ideal external gear pump" if s.pump_teeth else "none",
        "engine": "induction motor of 22 kW by Kloss's formula on an inverter" if s.motor == "induction" else
                  "prescribed speed",
        "seats": s.bearings + (f", {s.bearing_stiffness:.3g} N/m radially" if s.bearings == "elastic" else ""),
    })  # fmt: skip
    if changed:
        found.append(BenchChoice("changed here", ", ".join(f"{n} = {getattr(s, n)}" for n in changed), "by the user"))
    return found


# The paper's three claims judged on the bench, beside the pair's.


SENSORS = ("laser", "support")
LOW_BAND = 100.0
"""Hz; below, integration and differentiation of the laser's signal are cut off."""


@dataclass(frozen=True)
class BenchStudy:
    """Results of the bench's six runs, and of the pair's.

    Attributes
    ----------
    table : DataArray
        RMS of the acceleration at the first three mesh harmonics, dims (sensor, load, state, harmonic), m/s^2.
    records : dict of (str, str) to Dataset
        By load and state; see `gearmbs.studies.run_train`.
    settings : BenchSettings
    pair : PaperStudy or None
    """

    table: xr.DataArray
    records: dict[tuple[str, str], xr.Dataset]
    settings: BenchSettings
    pair: PaperStudy | None = None

    def claims(self, sensor: str) -> list[Claim]:
        """Judge the three claims by a sensor, "laser" or "support"."""
        return judge(self.table.sel(sensor=sensor), sensor)

    def judged(self) -> dict[str, list[Claim]]:
        """Return the three claims as the bench's sensors, and the pair if it was run, have them."""
        out = {f"bench, {name}": self.claims(name) for name in SENSORS}
        if self.pair is not None:
            out[f"pair, {self.pair.component.replace('_', ' ')}"] = self.pair.claims()
        return out

    def report(self) -> str:
        """Return the report in Markdown: verdicts of bench and pair side by side, tables, choices."""
        judged = self.judged()
        lines = ["# The test bench of Fig. 2", "", "## The three claims", "", verdict_table(judged)]
        for name, claims in judged.items():
            lines += ["", f"{name}:", ""]
            lines += [f"* {c.name}: **{'held' if c.held else 'not held'}** ({c.rule}). {c.numbers}." for c in claims]
        rows = [
            [*place, *(f"{v:.4g}" for v in self.table.sel(dict(zip(("sensor", "load", "state"), place))).values)]
            for place in product(SENSORS, PRESSURES, STATES)
        ]
        header = ["sensor", "load", "state", "1 x", "2 x", "3 x"]
        lines += ["", "## RMS of the mesh harmonics, m/s^2", "", markdown_table(header, rows)]
        rows = []
        for at, record in self.records.items():
            for mesh in record.mesh.values:
                one = record.sel(mesh=mesh)
                rows.append([*at, mesh, f"{float(one.normal_force.mean()):.5g}", flank_shares(one)[0]])
        header = ["load", "state", "mesh", "mean normal force, N", "both flanks, % of time"]
        lines += ["", "## Meshes", "", markdown_table(header, rows)]
        lines += ["", "## Choices", "", markdown_table(BenchChoice._fields, bench_choices(self.settings))]
        return "\n".join(lines) + "\n"

    def figure(self, load: str) -> Figure:
        """Return the bars of both sensors, and of the pair, at a load: a panel each."""
        from gearmbs.view import gmf_bars
        from gearmbs.view.figures.style import look, new_figure

        panels = [(f"bench, {name}", self.table.sel(sensor=name, load=load)) for name in SENSORS]
        if self.pair is not None:
            panels.append(("pair, scaled", self.pair.table().sel(load=load)))
        with look():
            figure = new_figure(4.6 * len(panels), 4.2)
            axes = figure.subplots(1, len(panels))
            for ax, (title, table) in zip(np.atleast_1d(axes), panels, strict=True):
                gmf_bars(
                    table.drop_vars(["sensor"], errors="ignore"), title=f"{title}, {load} load", ax=ax, values=False
                )
        return figure

    def verdict_figure(self) -> Figure:
        """Return the verdicts on the three claims with their numbers: a row a claim, a column a place of judgement."""
        from textwrap import fill

        from matplotlib.patches import Rectangle

        from gearmbs.view.figures.style import look, new_figure

        judged = self.judged()
        with look():
            figure = new_figure(3.4 * len(judged) + 2.0, 4.6)
            ax = figure.subplots()
            for column, claims in enumerate(judged.values()):
                for row, claim in enumerate(claims):
                    word, colour = ("held", "#d5e8d4") if claim.held else ("not held", "#f8cecc")
                    ax.add_patch(Rectangle((column, row), 1.0, 1.0, facecolor=colour, edgecolor="white", lw=3.0))
                    ax.text(column + 0.5, row + 0.2, word, ha="center", va="center", fontweight="bold")
                    ax.text(column + 0.5, row + 0.62, fill(claim.numbers, 44), ha="center", va="center", fontsize=7)
            names = [fill(claim.name, 22) for claim in next(iter(judged.values()))]
            ax.set(xlim=(0, len(judged)), ylim=(len(names), 0))
            ax.set_xticks(np.arange(len(judged)) + 0.5, list(judged))
            ax.set_yticks(np.arange(len(names)) + 0.5, names)
            ax.xaxis.tick_top()
            ax.tick_params(length=0)
            ax.grid(visible=False)
            for spine in ax.spines.values():
                spine.set_visible(False)
        return figure

    def figures(self) -> dict[str, Figure]:
        """Return the bars at each load and the verdicts, by name."""
        return {f"{load}_load": self.figure(load) for load in PRESSURES} | {"verdicts": self.verdict_figure()}

    def save(self, folder: str | Path) -> list[Path]:
        """Write records, table, figures and report to a folder; return the paths."""
        records = {f"records/{load}_{state}.nc": record for (load, state), record in self.records.items()}
        records["bench.nc"] = self.table.to_dataset(name="gmf_rms")
        return save_study(folder, records, {"report.md": self.report}, self.figures)


def run_bench(
    settings: BenchSettings | None = None,
    run: RunSettings | None = None,
    *,
    pair: bool = True,
    workers: int | None = None,
    progress: bool | Callable[[str, float], None] | None = None,
) -> BenchStudy:
    """Simulate the bench in its three states at 1 and 5 MPa, and the pair of the paper's model beside it.

    Parameters
    ----------
    settings : BenchSettings, optional
    run : RunSettings, optional
        Default: 0.2 s of settling, 1 s of record.
    pair : bool
        Whether to run the pair's study, too, with a record of the same length.
    workers : int, optional
        Runs at a time; default the cores.
    progress : bool or callable, optional
        See `gearmbs.studies.run_trains`.

    Raises
    ------
    SimulationFailed
        If a run stops early.
    """
    settings = settings or BenchSettings()
    if settings.bearings == "ideal":
        raise ValueError("bearings is 'ideal': a laser sees nothing move in rigid bearings; give 'elastic'")
    run = run or RunSettings(settling=0.2, duration=1.0)
    places = list(product(PRESSURES, STATES))
    runs = {
        f"bench, {state}, {load} load": (bench_train(PRESSURES[load], state, settings), run) for load, state in places
    }
    with warnings.catch_warnings():
        # the paper's law over-damps the meshes; the choices and the report say so
        warnings.filterwarnings("ignore", r"mesh '.*' is damped .* times critically")
        records = dict(zip(places, run_trains(runs, workers=workers, progress=progress).values(), strict=True))
    rows = [[[levels(records[load, state], sensor) for state in STATES] for load in PRESSURES] for sensor in SENSORS]
    table = xr.DataArray(
        np.array(rows), dims=("sensor", "load", "state", "harmonic"),
        coords={"sensor": list(SENSORS), "load": list(PRESSURES), "state": list(STATES), "harmonic": [1, 2, 3]},
        attrs={"units": "m/s^2", "long_name": "RMS of the gear mesh frequency harmonics"},
    )  # fmt: skip
    beside = None
    if pair:
        base = Case(
            operation={"duration": run.duration, "speed": settings.speed}, fault={"backlash": settings.backlash}
        )
        beside = run_paper(base, workers=workers, progress=progress)
    return BenchStudy(table, records, settings, beside)


def levels(record: xr.Dataset, sensor: str, harmonics: int = 3) -> np.ndarray:
    """Return the RMS of a sensor's acceleration at the mesh harmonics, m/s^2, at the mean speed of the record.

    NaN where that speed is not steady. A velocity is differentiated to acceleration as a laser's is, in a band from
    `LOW_BAND` on.
    """
    if not holds_speed(record):
        return np.full(harmonics, np.nan)
    signal = train_signal(record, sensor, "pair 1")
    rate = float(record.attrs["run_rate"])
    if str(record.sensor_units.sel(sensor=sensor).item()) == "m/s":
        signal = convert(signal, "acceleration", band=(LOW_BAND, 0.45 * rate))
    frequency = float(record["mesh_rms"].mesh_frequency.sel(mesh="pair 1"))
    orders = np.arange(1, harmonics + 1)
    return np.abs(harmonic_amplitudes(signal.values, rate, frequency, orders))[:, 0] / np.sqrt(2.0)
