"""Near resonance: a spur pair swept slowly through its mesh resonance, with tooth separation, jumps and hysteresis.

The rig is one in which only the motion along the line of action matters: the driver's rotation is prescribed, the
driven wheel turns in an ideal bearing under a constant torque, and an oil film resists the relative motion of the base
circles, apart or not. With x the lag of the driven wheel along the line of action, m = J_2/r_b2^2 and F = T/r_b2, the
classical model of one degree of freedom is

    m x'' + c x' + k(phi) g(x - e(phi)) = F,    c = 2 zeta sqrt(k_m m),

k the tangent stiffness of the loaded pair at rest over the mesh phase phi, k_m its mean, and e its transmission error
less F/k, so that both models rest in the same place at every phase.

References
----------
A. Kahraman, G. W. Blankenship, Experiments on nonlinear dynamic behavior of an oscillator with clearance and
periodically time-varying parameters, J. Appl. Mech. 64 (1997) 217-226.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Drivetrain
from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.transmission import TransmissionError, loaded_transmission_error
from gearmbs.mechanism import Mechanism
from gearmbs.schema.described import Described
from gearmbs.schema.quantities import Measure
from gearmbs.signals.analysis.report import markdown_table
from gearmbs.studies.presets.backlash import BacklashOscillator
from gearmbs.studies.presets.files import preset_train, with_values
from gearmbs.studies.run.parallel import run_named
from gearmbs.studies.run.store import save_study
from gearmbs.units import Quantity, to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Direction = Literal["up", "down"]
DIRECTIONS: tuple[Direction, ...] = ("up", "down")
MODELS = ("multibody", "one degree")
POINTS = 256
"""Phases of the mesh cycle at which the loaded pair is looked at."""
SAMPLES = 64
"""Samples of the lag in a mesh cycle."""
STEPS = 20
"""Steps of the multibody model in a mesh cycle, at least: a tooth that passes unseen excites nothing."""
JUMP = 0.1
"""Change of the logarithm of the amplitude from window to window from which it is a jump, and not a slope."""
SETTLING = 100
"""Mesh cycles at the first frequency that are left out."""


Length = Annotated[Quantity, Measure("length", above=0)]


@dataclass(frozen=True)
class ResonanceSettings(Described):
    """Two equal spur wheels, their load and damping, and how the mesh frequency is swept.

    Parameters
    ----------
    teeth : int
    module, face_width : float or str
        m.
    addendum : float
        In modules; it sets the contact ratio.
    torque : float or str
        On the driven wheel, N m.
    damping_ratio : float
        zeta of the film, with the mean stiffness under the load.
    backlash : float or str
        m.
    stiffness : float or str, optional
        Of a tooth pair, N/m; default that of ISO 6336-1.
    span : tuple of float
        Lowest and highest mesh frequency over the natural frequency.
    cycles : int
        Mesh cycles of a sweep.
    window : int
        Mesh cycles over which amplitudes are taken.
    tolerance : float
        Local error allowed a step of the multibody model.
    """

    teeth: int = 50
    module: Length = 3e-3
    face_width: Length = 20e-3
    addendum: float = 0.85
    torque: Annotated[Quantity, Measure("torque", above=0)] = 30.0
    damping_ratio: Annotated[Quantity, Measure(above=0)] = 0.11
    backlash: Length = 1e-4
    stiffness: Annotated[Quantity, Measure("stiffness", above=0)] = None
    span: Annotated[tuple[float, float], Measure(above=0, several=2)] = (0.68, 0.88)
    cycles: int = 4000
    window: int = 20
    tolerance: float = 1e-8

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.span[0] < self.span[1]:
            raise ValueError(f"span is {self.span}; give a lower and a higher ratio, both positive")
        if not (self.window >= 1 and self.cycles >= SETTLING + 10 * self.window):
            raise ValueError(f"cycles is {self.cycles}; give {SETTLING + 10 * self.window} or more")

    @cached_property
    def pair(self) -> GearPair:
        """The wheels, with a linear contact law without damping and without friction."""
        from gearmbs.gears import ContactLaw, FlankFriction

        gear = GearSpec(self.teeth, self.module, face_width=self.face_width, addendum=self.addendum * self.module,
                        dedendum=(max(self.addendum, 1.0) + 0.25) * self.module)  # fmt: skip
        bare = GearPair(gear, gear, backlash=self.backlash, torque=self.torque, friction=FlankFriction.none())
        if self.stiffness is None:
            return bare.with_iso_stiffness()
        return bare.with_changes(contact=ContactLaw.linear(self.stiffness))

    @cached_property
    def rest(self) -> TransmissionError:
        """The loaded pair at rest over a mesh cycle: lag and tangent stiffness."""
        return loaded_transmission_error(self.pair, points=POINTS)

    @property
    def force(self) -> float:
        """F, N."""
        return float(self.torque) / self.pair.driven.base_radius

    @property
    def mass(self) -> float:
        """m, kg."""
        return self.pair.driven.inertia[2] / self.pair.driven.base_radius**2

    @property
    def film(self) -> float:
        """c, N s/m."""
        return 2.0 * self.damping_ratio * math.sqrt(float(np.mean(self.rest.stiffness)) * self.mass)

    @property
    def frequency(self) -> float:
        """Natural frequency with the mean stiffness, without separation, Hz."""
        return math.sqrt(float(np.mean(self.rest.stiffness)) / self.mass) / (2.0 * math.pi)


class Chirp(NamedTuple):
    """A mesh frequency that changes evenly: f(t) = first + rate t, after ``settling`` seconds at ``first``."""

    first: float
    rate: float
    duration: float
    settling: float

    def cycles(self, t: np.ndarray) -> np.ndarray:
        """Return the mesh cycles from the start to a time."""
        swept = np.maximum(t - self.settling, 0.0)
        return self.first * t + 0.5 * self.rate * swept**2

    def frequency(self, t: np.ndarray) -> np.ndarray:
        """Return the mesh frequency at a time, Hz."""
        return self.first + self.rate * np.maximum(t - self.settling, 0.0)


def chirp(s: ResonanceSettings, direction: Direction) -> Chirp:
    """Return how the mesh frequency goes in one direction."""
    if direction not in DIRECTIONS:
        raise ValueError(f"direction is {direction!r}; choose 'up' or 'down'")
    first, last = (s.frequency * r for r in (s.span if direction == "up" else s.span[::-1]))
    settling = SETTLING / first
    swept = s.cycles / (0.5 * (first + last))
    return Chirp(first, (last - first) / swept, swept + settling, settling)


def resonance_train(settings: ResonanceSettings | None = None, direction: Direction = "up") -> Drivetrain:
    """Return the rig as a drivetrain, without its film; `resonance_rig` adds that."""
    s = settings or ResonanceSettings()
    law = chirp(s, direction)
    turn = 2.0 * math.pi / s.teeth
    swept = f"MAX(TIME - {law.settling!r}, 0)"
    turned = f"{turn * law.first!r}*TIME + {0.5 * turn * law.rate!r}*{swept}**2"
    train = with_values(preset_train("resonance"), {
        "driver": {"gear": s.pair.driver},
        "driven": {"gear": s.pair.driven},
        "mesh": {"settings": {"backlash": s.backlash, "contact": s.pair.contact, "friction": False}},
        "drive": {"speed": turn * law.first, "function": turned},
        "load": {"torque": s.torque},
    })  # fmt: skip
    return replace(train, run_up=10.0 / law.first)


def resonance_rig(settings: ResonanceSettings | None = None, direction: Direction = "up") -> Mechanism:
    """Return the rig: two wheels in ideal bearings, the driver swept, the driven one loaded, a film between them."""
    s = settings or ResonanceSettings()
    m = resonance_train(s, direction).build()
    r = s.pair.driven.base_radius
    speeds = [f"WZ({j}.I, {j}.J, {j}.J)" for j in ("left", "right")]
    for joint in ("left", "right"):
        ends = m.joints[joint]
        m.axis_torque(f"film {joint}", ends.i, ends.j, f"-{s.film * r * r!r}*({speeds[0]} + {speeds[1]})")
    return m


def one_degree(settings: ResonanceSettings | None = None) -> BacklashOscillator:
    """Return the classical model of one degree of freedom, with stiffness and error of the loaded pair at rest."""
    s = settings or ResonanceSettings()
    k = s.rest.stiffness
    return BacklashOscillator(s.mass, k, s.pair.normal_backlash, s.force, error=s.rest.error - s.force / k, film=s.film)


def _lag_of_rig(s: ResonanceSettings, direction: Direction, progress: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    train = resonance_train(s, direction)
    law = chirp(s, direction)
    axes = train.layout.seats["out"].axes
    taken: list[tuple[np.ndarray, np.ndarray]] = []

    def take(part: Any) -> None:
        x = part.orientation("out")[:, :, 0] @ axes[:, :2]
        taken.append((part.t.copy(), np.arctan2(x[:, 1], x[:, 0])))

    solution = resonance_rig(s, direction).simulate(
        law.duration, every_step=True, tol=s.tolerance, rate_scale=2.0 * math.pi * s.frequency, consumer=take,
        progress=progress, max_step=1.0 / (STEPS * s.span[1] * s.frequency),
    )  # fmt: skip
    if not solution.success:
        raise RuntimeError(f"sweep {direction} at {s.torque:g} N m: {solution.message}")
    t, angle = (np.concatenate(column) for column in zip(*taken, strict=True))
    cycles = law.cycles(t)
    angle = np.unwrap(angle)
    # equal wheels: the driven one turns back as far as the driver turns
    lag = s.pair.driven.base_radius * (angle - angle[0] + 2.0 * math.pi / s.teeth * cycles)
    return t, cycles, lag


def _lag_of_oscillator(s: ResonanceSettings, direction: Direction) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    law = chirp(s, direction)
    model = one_degree(s)
    _, state = model.run((law.first, law.first), law.settling, samples=SAMPLES)
    last = float(law.frequency(np.array(law.duration)))
    rows, _ = model.run((law.first, last), law.duration - law.settling, state, samples=SAMPLES)
    cycles = rows[:, 0] / (2.0 * math.pi)
    # from the cycles of the law back to its time
    swept = cycles - law.first * law.settling
    root = np.sqrt(law.first**2 + 2.0 * law.rate * swept)
    return law.settling + 2.0 * swept / (law.first + root), cycles, rows[:, 1]


def sweep_resonance(
    settings: ResonanceSettings | None = None,
    direction: Direction = "up",
    model: str = "multibody",
    *,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Sweep the mesh frequency through the resonance in one direction.

    Parameters
    ----------
    settings : ResonanceSettings, optional
    direction : {"up", "down"}
    model : {"multibody", "one degree"}
    progress : bool or callable, optional
        Of the multibody model, see `gearmbs.mechanism.simulate`.

    Returns
    -------
    Dataset
        Over ``window``: ``frequency`` (mean mesh frequency, Hz), ``rms`` (of the lag about its mean, m), ``lowest`` lag
        (m; below zero the teeth part).

    Raises
    ------
    ValueError
        For an unknown direction or model.
    """
    s = settings or ResonanceSettings()
    law = chirp(s, direction)
    if model not in MODELS:
        raise ValueError(f"model is {model!r}; choose one of {', '.join(MODELS)}")
    ways = {"multibody": lambda: _lag_of_rig(s, direction, progress),
            "one degree": lambda: _lag_of_oscillator(s, direction)}  # fmt: skip
    t, cycles, lag = ways[model]()
    first = math.ceil(SETTLING / s.window)
    count = s.cycles // s.window - 1
    even = (first + np.arange(count * s.window * SAMPLES) / (s.window * SAMPLES)) * s.window
    values = np.interp(even, cycles, lag).reshape(count, -1)
    middle = np.interp((first + 0.5 + np.arange(count)) * s.window, cycles, t)
    data: dict[str, Any] = {
        "frequency": ("window", law.frequency(middle), {"units": "Hz", "long_name": "mesh frequency"}),
        "rms": ("window", values.std(axis=1), {"units": "m", "long_name": "RMS of the dynamic transmission error"}),
        "lowest": ("window", values.min(axis=1), {"units": "m", "long_name": "lowest lag"}),
    }
    return xr.Dataset(data, attrs={"direction": direction, "model": model, "natural_frequency": s.frequency})


def jump_frequency(sweep: xr.Dataset) -> float:
    """Return the mesh frequency at which a sweep's amplitude changes most between windows, Hz; NaN without a jump."""
    a, f = sweep["rms"].values, sweep["frequency"].values
    steps = np.abs(np.diff(np.log(a)))
    k = int(np.argmax(steps))
    return float(0.5 * (f[k] + f[k + 1])) if steps[k] > JUMP else math.nan


# The study of a mesh resonance: sweeps up and down by both models, their jumps, and the load at which teeth part.


LOADS = (1.0, 1000.0)
"""Between these a study looks for the load of separation, N m."""
AROUND = (0.6, 1.5)
"""Where the multibody model's is looked for, over that of the model of one degree of freedom."""


class SeparationLoad(NamedTuple):
    """The load at which teeth begin, or cease, to part near resonance.

    Attributes
    ----------
    torque : float
        N m.
    parted_above : bool
        Whether they part above it; else below.
    """

    torque: float
    parted_above: bool

    def __str__(self) -> str:
        side, other = ("above", "below") if self.parted_above else ("below", "above")
        return f"teeth part {side} {self.torque:.4g} N m, none {other}"


def lowest_lag(settings: ResonanceSettings, torque: Quantity, model: str = MODELS[1]) -> float:
    """Return the lowest lag of a sweep up through the natural frequency under another load, m; negative: teeth part."""
    span = (min(settings.span[0], 0.9), max(settings.span[1], 1.1))
    loaded = replace(settings, torque=torque, span=span)
    return float(sweep_resonance(loaded, "up", model)["lowest"].min())


def separation_load(
    settings: ResonanceSettings | None = None,
    between: tuple[Quantity, Quantity] = LOADS,
    *,
    steps: int = 12,
    model: str = MODELS[1],
) -> SeparationLoad | None:
    """Return the load at which separation begins or ceases, by bisection.

    Until teeth part, the equation is linear in x and so is every amplitude in the load: only what the load changes of
    the stiffness curve makes a threshold. Deflection prolongs the contact of each pair of teeth. Where that raises the
    excitation, as with a contact ratio of a whole number, teeth do not part below a load; where it lowers it, not above
    one.

    Parameters
    ----------
    settings : ResonanceSettings, optional
    between : tuple of float or str
        Two loads, N m, at one of which teeth part and at the other not.
    steps : int
        Halvings of the ratio of the two.
    model : {"one degree", "multibody"}

    Returns
    -------
    SeparationLoad or None
        None if teeth part at both loads, or at neither.
    """
    s = settings or ResonanceSettings()
    low, high = (to_si(torque, "torque", "between") for torque in between)
    parted = [lowest_lag(s, torque, model) < 0.0 for torque in (low, high)]
    if parted[0] == parted[1]:
        return None
    for _ in range(steps):
        middle = math.sqrt(low * high)
        if (lowest_lag(s, middle, model) < 0.0) == parted[0]:
            low = middle
        else:
            high = middle
    return SeparationLoad(math.sqrt(low * high), parted[1])


def separation_loads(settings: ResonanceSettings) -> dict[str, SeparationLoad | None]:
    """Return the load of separation of both models, that of the multibody one to 0.7 %; None where there is none."""
    whole, classical = MODELS
    found = separation_load(settings)
    if found is None:
        return {classical: None}
    low, high = (factor * found.torque for factor in AROUND)
    return {classical: found, whole: separation_load(settings, (low, high), steps=7, model=whole)}


@dataclass(frozen=True)
class ResonanceStudy:
    """Sweeps up and down by both models.

    Attributes
    ----------
    settings : ResonanceSettings
    sweeps : dict of (str, str) to Dataset
        By model and direction; see `sweep_resonance`.
    thresholds : dict of str to (SeparationLoad or None)
        By model; see `separation_loads`.
    """

    settings: ResonanceSettings
    sweeps: dict[tuple[str, str], xr.Dataset]
    thresholds: dict[str, SeparationLoad | None] = field(default_factory=dict)

    def jumps(self) -> dict[str, dict[str, float]]:
        """Return the mesh frequencies at which amplitudes jump, Hz, by model and direction."""
        return {m: {d: jump_frequency(self.sweeps[m, d]) for d in DIRECTIONS} for m in MODELS}

    def report(self) -> str:
        """Return the report in Markdown: jumps of both models, their difference, the load of separation."""
        s, jumps = self.settings, self.jumps()
        lines = [
            "# Mesh resonance", "",
            f"{s.teeth}/{s.teeth} teeth, contact ratio {s.pair.contact_ratio:.4g}, {s.torque:g} N m, damping ratio "
            f"{s.damping_ratio:g}, natural frequency {s.frequency:.5g} Hz.", "",
        ]  # fmt: skip
        rows = []
        for d in DIRECTIONS:
            whole, classical = (jumps[m][d] for m in MODELS)
            lowest = 1e6 * float(self.sweeps[MODELS[0], d]["lowest"].min())
            cells = [f"{whole:.5g}", f"{classical:.5g}", f"{100.0 * (whole / classical - 1.0):+.2f}", f"{lowest:.3g}"]
            rows.append([d, *(cell.replace("+nan", "-").replace("nan", "no jump") for cell in cells)])
        header = ["sweep", "multibody, Hz", "one degree, Hz", "difference, %", "lowest lag, um"]
        lines.append(markdown_table(header, rows))
        return "\n".join(lines) + "\n" + self.thresholds_text()

    def thresholds_text(self) -> str:
        """Return the load of separation of each model, a paragraph each."""
        none = f"no load from {LOADS[0]:g} to {LOADS[1]:g} N m at which teeth begin or cease to part"
        return "".join(f"\n{model.capitalize()}: {found or none}.\n" for model, found in self.thresholds.items())

    def figure(self) -> Figure:
        """Return amplitude over mesh frequency of both models in both directions, and the lowest lag below it."""
        from gearmbs.view.figures.style import look, new_figure

        with look():
            figure = new_figure(7.0, 6.0)
            upper, lower = figure.subplots(2, 1, sharex=True)
            for (model, direction), sweep in self.sweeps.items():
                f = sweep["frequency"].values / self.settings.frequency
                style: dict[str, Any] = {"lw": 2.0 if model == MODELS[0] else 0.9, "label": f"{model}, {direction}",
                                         "ls": "-" if direction == "up" else "--"}  # fmt: skip
                upper.plot(f, 1e6 * sweep["rms"].values, **style)
                lower.plot(f, 1e6 * sweep["lowest"].values, **style)
            upper.set_ylabel("RMS of the lag, µm")
            upper.legend(frameon=False)
            lower.axhline(0.0, color="0.5", lw=0.8)
            lower.set(ylabel="lowest lag, µm", xlabel="mesh frequency over natural frequency")
        return figure

    def save(self, folder: str | Path) -> list[Path]:
        """Write the sweeps, the report and the figure to a folder; return the paths."""
        sweeps = {f"{model.replace(' ', '_')}_{way}.nc": sweep for (model, way), sweep in self.sweeps.items()}
        return save_study(folder, sweeps, {"report.md": self.report}, lambda: {"resonance": self.figure()})


def run_resonance(
    settings: ResonanceSettings | None = None, *, progress: bool | Callable[[str, float], None] | None = None
) -> ResonanceStudy:
    """Sweep a pair up and down through its mesh resonance, by the multibody and by the classical model.

    Parameters
    ----------
    settings : ResonanceSettings, optional
    progress : bool or callable, optional
        Bars, see `gearmbs.progress`; a callable is told "up" or "down" and the part of that multibody sweep that is
        done.
    """
    s = settings or ResonanceSettings()

    def work(direction: Any, report: Callable[[float], None]) -> xr.Dataset:
        span = chirp(s, direction).duration
        return sweep_resonance(s, direction, MODELS[0], progress=lambda t: report(min(t / span, 1.0)))

    sweeps: dict[tuple[str, str], xr.Dataset] = {}
    for direction, whole in run_named(work, DIRECTIONS, progress=progress).items():
        sweeps[MODELS[0], direction] = whole
        sweeps[MODELS[1], direction] = sweep_resonance(s, direction, MODELS[1])  # type: ignore[arg-type]
    return ResonanceStudy(s, sweeps, separation_loads(s))
