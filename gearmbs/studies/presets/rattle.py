"""Rattle of a manual transmission's loose wheels: one description, four models, threshold, impacts and a map.

The input shaft turns with a mean speed and an angular acceleration alpha sin(2 pi f t). A loose wheel (inertia J, drag
T_D) stays on its flank while J alpha_2 + T_D >= 0: up to an amplitude of its own angular acceleration of T_D / J.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Drivetrain, ShaftTorque
from gearmbs.mechanism import Mechanism, static_equilibrium
from gearmbs.mechanism.parts.functions import constant
from gearmbs.progress import waiting
from gearmbs.studies.presets.backlash import BacklashOscillator
from gearmbs.studies.presets.files import preset_train, with_values

MODELS = ("equivalent", "torsional", "frequency", "multibody")
"""One degree of freedom; rigid wheels that only turn; linear, in the frequency domain; the whole mechanism."""
LOOSE, LOOSE_TEETH = "loose", (20, 25)
"""Shaft of the loose wheel, and the teeth of its pair, as ``rattle.toml`` has them."""
LINE_SAMPLES = 400


@dataclass(frozen=True)
class RattleSettings:
    """A transmission with one wheel in gear and one loose wheel.

    Parameters
    ----------
    level : float
        Amplitude of the loose wheel's angular acceleration over T_D/J; rattle begins at 1.
    frequency : float
        Of the fluctuation, Hz.
    speed : float
        Mean speed of the input, rad/s.
    inertia, drag : float
        Of the loose wheel: J (kg m^2) and T_D (N m).
    output_torque : float
        On the output shaft, N m.
    backlash : float
        m.
    stiffness : float
        Of a tooth pair, N/m.
    damping : float
        Of a tooth pair, N s/m, fully on at ``depth`` (m). The drag presses flanks by 0.07 um only: with a larger depth
        nothing damps them, and every change of tooth pairs shakes them apart.
    """

    level: float = 0.5
    frequency: float = 1.0
    speed: float = 0.0
    inertia: float = 1e-3
    drag: float = 0.5
    output_torque: float = 20.0
    backlash: float = 20e-6
    stiffness: float = 3e8
    damping: float = 5e3  # 0.1 of critical of the loose wheel on its flank
    depth: float = 5e-8

    @property
    def threshold(self) -> float:
        """T_D / J, rad/s^2."""
        return self.drag / self.inertia

    @property
    def acceleration(self) -> float:
        """Amplitude of the input's angular acceleration, rad/s^2."""
        return self.level * self.threshold * LOOSE_TEETH[1] / LOOSE_TEETH[0]


def rattle_train(settings: RattleSettings | None = None) -> Drivetrain:
    """Return the transmission: input shaft, output shaft in gear, and a loose wheel that runs on the output shaft."""
    s = settings or RattleSettings()
    train = preset_train("rattle")
    w = 2.0 * math.pi * s.frequency
    turned = f"{s.speed!r}*TIME - {s.acceleration / w**2!r}*SIN({w!r}*TIME)"
    own = s.inertia - train.part("l2").gear.inertia[2]
    if own <= 0.0:
        raise ValueError(f"inertia is {s.inertia:g} kg m^2, less than that of the bare wheel; give more")
    contact = {"kind": "linear", "stiffness": s.stiffness, "damping": s.damping, "depth": s.depth}
    mesh = {"settings": {"backlash": s.backlash, "friction": False, "contact": contact}}
    return with_values(train, {
        LOOSE: {"inertia": own},
        **dict.fromkeys(("geared", "loose mesh"), mesh),
        # at a mean speed of zero the senses are those of a small one
        "engine": {"speed": s.speed or 1.0, "function": turned},
        "car": {"torque": s.output_torque},
        "drag": {"torque": s.drag},
    })  # fmt: skip


@dataclass(frozen=True)
class RattleResult:
    """What one model says of the loose wheel.

    Attributes
    ----------
    model : str
    amplitude : float
        Of its angular acceleration at the fluctuation's frequency, rad/s^2.
    drive_hits, coast_hits : float
        Impacts a cycle on the drive and on the coast flank; NaN where the model knows none.
    """

    model: str
    amplitude: float
    drive_hits: float
    coast_hits: float


def rattle(model: str, settings: RattleSettings | None = None, cycles: int = 3, settling: int = 1) -> RattleResult:
    """Return what one of the four `MODELS` says of a transmission.

    Parameters
    ----------
    model : {"equivalent", "torsional", "frequency", "multibody"}
    settings : RattleSettings, optional
    cycles, settling : int
        Cycles of the fluctuation that are looked at, and before.

    Raises
    ------
    ValueError
        For an unknown model.
    """
    s = settings or RattleSettings()
    if model not in MODELS:
        raise ValueError(f"model is {model!r}; choose one of {', '.join(MODELS)}")
    ways = {"equivalent": _equivalent, "torsional": _torsional, "frequency": _frequency, "multibody": _multibody}
    return ways[model](s, cycles, settling)


@waiting("rattle")
def rattle_table(settings: RattleSettings, levels: Sequence[float], models: Sequence[str] = MODELS) -> xr.Dataset:
    """Return amplitudes over their level times T_D/J, and impacts a cycle, dims (model, level)."""
    found = [[rattle(model, replace(settings, level=level)) for level in levels] for model in models]
    scale = settings.threshold * np.asarray(levels, dtype=float)
    data: dict[str, Any] = {
        "amplitude": (("model", "level"), [[r.amplitude for r in row] / scale for row in found]),
        "drive_hits": (("model", "level"), [[r.drive_hits for r in row] for row in found]),
        "coast_hits": (("model", "level"), [[r.coast_hits for r in row] for row in found]),
    }
    return xr.Dataset(data, coords={"model": list(models), "level": list(levels)})


@waiting("rattle")
def rattle_map(
    settings: RattleSettings, levels: Sequence[float], frequencies: Sequence[float], cycles: int = 20
) -> xr.DataArray:
    """Return impacts a cycle on both flanks by the equivalent model, dims (level, frequency in Hz)."""

    def hits(level: float, frequency: float) -> float:
        one = _oscillator(replace(settings, level=level, frequency=frequency))
        return sum(_hits_of(one, _settled_run(one, frequency, cycles, cycles), cycles))

    return xr.DataArray(
        [[hits(level, frequency) for frequency in frequencies] for level in levels],
        coords={"level": list(levels), "frequency": list(frequencies)},
        dims=("level", "frequency"),
        attrs={"long_name": "impacts a cycle on both flanks"},
    )


def _oscillator(s: RattleSettings) -> BacklashOscillator:
    train = rattle_train(s)
    spring = next(spring for spring in train.torsional().springs if spring.name == "loose mesh")
    geometry = train.pairs["loose mesh"].geometry
    r1, r2 = geometry.driver.base_radius, geometry.driven.base_radius
    return BacklashOscillator(
        s.inertia / r2**2, spring.stiffness, geometry.normal_backlash, s.drag / r2, spring.damping,
        (0.0, r1 * s.acceleration),
    )  # fmt: skip


def _settled_run(one: BacklashOscillator, frequency: float, cycles: int, settling: int) -> np.ndarray:
    """Return the rows of so many cycles of the fluctuation after those that are left out."""
    samples = max(64, int(np.ceil(8.0 * one.frequency / frequency)))
    _, state = one.run((frequency, frequency), settling / frequency, samples=samples)
    return one.run((frequency, frequency), cycles / frequency, state, samples=samples)[0]


def _hits_of(one: BacklashOscillator, rows: np.ndarray, cycles: int) -> tuple[float, float]:
    """Return the impacts a cycle on the drive and on the coast flank."""
    return _impacts(rows[:, 1] > 0.0, cycles), _impacts(rows[:, 1] < -one.backlash, cycles)


def _impacts(touching: np.ndarray, cycles: int) -> float:
    return float(np.count_nonzero(np.diff(touching.astype(int)) > 0)) / cycles


def _equivalent(s: RattleSettings, cycles: int, settling: int) -> RattleResult:
    one = _oscillator(s)
    r2 = rattle_train(s).pairs["loose mesh"].geometry.driven.base_radius
    rows = _settled_run(one, s.frequency, cycles, settling)
    speed = (r2 * rows[:, 3] - s.drag) / s.inertia
    line = 2.0 * np.mean(speed * np.exp(-1j * rows[:, 0]))
    return RattleResult("equivalent", float(abs(line)), *_hits_of(one, rows, cycles))


def _line_of_speed(t: np.ndarray, speed: np.ndarray, frequency: float, cycles: int) -> float:
    """Return the amplitude of the acceleration at a frequency, from speeds over whole cycles at even times."""
    turning = np.exp(-2j * np.pi * frequency * t[:-1])
    return 2.0 * np.pi * frequency * 2.0 * abs(np.mean((speed[:-1] - speed.mean()) * turning))


def _torsional(s: RattleSettings, cycles: int, settling: int) -> RattleResult:
    train = rattle_train(s)
    model = train.torsional()
    senses = {name: -1.0 if speed < 0.0 else 1.0 for name, speed in train.speeds.items()}
    torques = {"output": -senses["output"] * s.output_torque, LOOSE: -senses[LOOSE] * s.drag}
    motion = {"input": (s.speed, s.acceleration / (2.0 * np.pi * s.frequency) ** 2, s.frequency)}
    samples = s.frequency * 2000.0 * max(1.0, np.ceil(10.0 / s.frequency))
    t, angles, speeds = model.simulate((cycles + settling) / s.frequency, torques, motion, samples=samples)
    spring = next(spring for spring in model.springs if spring.name == "loose mesh")
    x = spring.sense * angles @ spring.row(len(model.names))
    kept = t >= settling / s.frequency - 1e-12
    even = np.linspace(settling / s.frequency, (cycles + settling) / s.frequency, LINE_SAMPLES * cycles + 1)
    line = _line_of_speed(even, np.interp(even, t, speeds[:, model.names.index(LOOSE)]), s.frequency, cycles)
    hits = _impacts(x[kept] > 0.0, cycles), _impacts(x[kept] < -spring.backlash, cycles)
    return RattleResult("torsional", line, *hits)


def _frequency(s: RattleSettings, cycles: int, settling: int) -> RattleResult:
    model = rattle_train(s).torsional()
    w = 2.0 * np.pi * s.frequency
    found = model.response(np.array([s.frequency]), {"input": s.acceleration / w**2})[0, model.names.index(LOOSE)]
    return RattleResult("frequency", float(abs(found)) * w**2, math.nan, math.nan)


def _settled(s: RattleSettings, train: Drivetrain) -> Mechanism:
    """Return the mechanism as it runs: flanks pressed together by the loads, shafts at the engine's first speed.

    From rest, without load, the first steps throw the wheels against each other, and at light loads nothing damps that.
    """
    m = train.build()
    for load in train.loads:
        force = m.elements[load.name]
        assert isinstance(force, ShaftTorque)
        force.times = (constant(load.nominal(abs(train.speeds[load.shaft]))),)
    static_equilibrium(m, move=True)
    first = s.speed - s.acceleration / (2.0 * math.pi * s.frequency)
    for shaft in train.shafts:
        turning = first * train.kinematics.ratio(shaft.name, "input")
        m.bodies[shaft.name].angular_velocity = turning * train.layout.seats[shaft.name].axes[:, 2]
    return m


def _multibody(s: RattleSettings, cycles: int, settling: int) -> RattleResult:
    train = rattle_train(s)
    m = _settled(s, train)
    end = (cycles + settling) / s.frequency
    taken: list[tuple[np.ndarray, ...]] = []

    def take(part: Any) -> None:
        diagnostics = part.contact("loose mesh")
        taken.append(
            (
                part.t.copy(),
                part.angular_velocity(LOOSE)[:, 2].copy(),
                diagnostics["pairs_drive"].copy(),
                diagnostics["pairs_back"].copy(),
            )
        )

    solution = m.simulate(
        end, every_step=True, tol=1e-7, rate_scale=max(1e3, train.rate_scale), consumer=take
    )  # fmt: skip
    if not solution.success:
        raise RuntimeError(f"transmission at level {s.level:g}: {solution.message}")
    t, speed, drive, coast = (np.concatenate(column) for column in zip(*taken, strict=True))
    kept = t >= settling / s.frequency
    even = np.linspace(settling / s.frequency, end, LINE_SAMPLES * cycles + 1)
    line = _line_of_speed(even, np.interp(even, t, speed), s.frequency, cycles)
    return RattleResult("multibody", line, _impacts(drive[kept] > 0, cycles), _impacts(coast[kept] > 0, cycles))
