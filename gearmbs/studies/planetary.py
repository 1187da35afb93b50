"""Planetary sets from files: a set, how it runs, its faults; simulated to a record of meshes, speeds, a ring sensor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import xarray as xr

from gearmbs.dae import Status
from gearmbs.dae.methods import DEFAULT
from gearmbs.dae.results.solution import Solution
from gearmbs.drivetrain.members.pins import pin_bearing
from gearmbs.drivetrain.members.pins import rolling_pins as rolling_pins
from gearmbs.drivetrain.planetary import SET_KEYS, planetary_set
from gearmbs.gears import ElasticRim, PlanetarySet, Support, planetary_mechanism
from gearmbs.gears.planetary_mechanism import PinBearing
from gearmbs.mechanism import Mechanism
from gearmbs.schema.described import Described, check_keys, read_toml
from gearmbs.schema.quantities import Measure
from gearmbs.signals import fixed_sensor
from gearmbs.signals.analysis.bands import MIN_PERIODS, harmonic_amplitudes
from gearmbs.signals.resampling import monotone_cubic
from gearmbs.studies.case.limits import HARMONICS
from gearmbs.studies.case.section import CaseError
from gearmbs.studies.case.tooth_faults import tooth_fault
from gearmbs.studies.run.accuracy import asked_accuracy
from gearmbs.studies.run.recorder import TURN_BEFORE
from gearmbs.studies.run.refined import LEFT_TO_TWIN, Behind, keeping
from gearmbs.studies.train_accuracy import SMALLEST, Lines, Precise, accurate_lines, time_apart
from gearmbs.units import Quantity, QuantityLike, to_si

MEMBERS = ("sun", "carrier", "ring")
OVERSAMPLING = 4
WITH_PLAY, WITHOUT_PLAY = 1e-7, 3e-8
"""Tolerances of sets whose meshes all have play, and of others, whose teeth hit both flanks. Of ten sets with 20 to
100 um of play mesh harmonics are within 0.35 % of those at 1e-9; of one without 0.9 % off at 1e-7, 0.2 % at 3e-8."""
Time = Annotated[Quantity, Measure("time", 0)]
SECTIONS = ("planetary", "contact", "friction", "operation", "support", "pins", "rim", "fault")
SECTIONS_OF_SET = {"contact": "contact", "friction": "friction", "fault": "faults"}
"""Sections of a file that are keys of the set."""


@dataclass(frozen=True)
class PlanetaryRun(Described):
    """A planetary set and how it runs.

    Attributes
    ----------
    gears : PlanetarySet
    speeds, torques : dict of str to str or float
        Of the members, as for `planetary_mechanism`.
    held : str or None
    run_up, settling, duration : float
        s; the record begins when the set has settled.
    rate : float
        Hz.
    tolerance : float, optional
        Default `used_tolerance`: what mesh harmonics to 0.5 % need.
    supports : dict of str to Support
    pins : Support or callable, optional
        See `planetary_mechanism` and `rolling_pins`.
    rim : ElasticRim, optional
        Lets the ring's rim bend.
    """

    error: ClassVar[type[ValueError]] = CaseError
    section: ClassVar[str] = "operation"

    gears: PlanetarySet
    speeds: Mapping[str, Any] = field(default_factory=dict)
    torques: Mapping[str, Any] = field(default_factory=dict)
    held: str | None = "ring"
    run_up: Time = 0.02
    settling: Time = 0.03
    duration: Annotated[Quantity, Measure("time", above=0)] = 0.2
    rate: Annotated[Quantity, Measure("frequency", above=0)] = 12_800.0
    tolerance: Annotated[Quantity | None, Measure(above=0)] = None
    supports: Mapping[str, Any] = field(default_factory=dict)
    pins: Support | PinBearing | None = None
    rim: ElasticRim | None = None

    @property
    def used_tolerance(self) -> float:
        """The tolerance, or `WITH_PLAY` where all meshes have play and `WITHOUT_PLAY` where teeth hit both flanks."""
        if self.tolerance is not None:
            return self.tolerance
        plays = [to_si(play, "length", "backlash") for play in (self.gears.backlash_sun, self.gears.backlash_ring)]
        return WITH_PLAY if min(plays) > 0.0 else WITHOUT_PLAY

    def mechanism(self) -> Mechanism:
        """Return the mechanism that is simulated."""
        return planetary_mechanism(
            self.gears,
            speeds=self.speeds,
            torques=self.torques,
            held=self.held,
            run_up=self.run_up,
            supports=self.supports,
            pins=self.pins,
            rim=self.rim,
        )


def load_planetary(path: str | Path) -> PlanetaryRun:
    """Read a planetary set and its run from a TOML file.

    Raises
    ------
    CaseError
        For whatever is wrong with it; the message names the file's section and key, the value and the remedy.
    """
    try:
        return planetary_run(read_toml(path, CaseError))
    except (ValueError, TypeError) as error:
        raise CaseError(f"{Path(path).name}: {error}") from None


def planetary_run(data: Mapping[str, Any]) -> PlanetaryRun:
    """Return the set and its run that tables as of a TOML file describe.

    Raises
    ------
    ValueError
        For unknown sections and keys, and values that do not make a set.
    """
    check_keys(data, SECTIONS, "", ValueError, form="unknown section {}")
    if "planetary" not in data:
        raise ValueError("section [planetary] is missing; give teeth and module")
    table = dict(data["planetary"])
    known = [key for key in SET_KEYS if key not in ("contact", "friction", "faults")]
    check_keys(table, known, "", ValueError, form="unknown key planetary.{}")
    sections = {key: data[section] for section, key in SECTIONS_OF_SET.items() if section in data}
    gears = planetary_set({**table, **sections}, tooth_fault, contact="law")
    operation = dict(data.get("operation", {}))
    known = [item.name for item in fields(PlanetaryRun) if item.name not in ("gears", "supports", "pins", "rim")]
    check_keys(operation, known, "", ValueError, form="unknown key operation.{}")
    if operation.get("held") in ("none", ""):
        operation["held"] = None
    supports = {name: Support(**values) for name, values in data.get("support", {}).items()}
    pins = pin_bearing(data["pins"]) if "pins" in data else None
    rim = ElasticRim(**data["rim"]) if "rim" in data else None
    return PlanetaryRun(gears, supports=supports, pins=pins, rim=rim, **operation)


def run_planetary(
    run: PlanetaryRun, progress: Callable[[float], None] | None = None, *, accuracy: QuantityLike | None = None
) -> xr.Dataset:
    """Simulate a planetary set and return its record.

    Parameters
    ----------
    run : PlanetaryRun
    progress : callable, optional
        Called with the simulated time, s.
    accuracy : float or str, optional
        How well the mesh harmonics are to be known, such as "1 %" or 0.01, as a part of the largest of their mesh.
        Tolerance and slices of the faces are chosen for it; see `gearmbs.studies.train_accuracy`.

    Returns
    -------
    xarray.Dataset
        Over ``time``: ``speed`` (member), ``force`` of the meshes with the sun and the ring (mesh, planet), ``share``
        of the load, ``ring_sensor``, the forces on the ring weighted by the planets' path past a sensor at angle 0,
        ``carrier_angle``, and with a rim that bends ``rim_velocity``, its radial velocity at angle 0.
        Attributes hold the frequencies of `PlanetarySet.frequencies`, and ``record_apart``, the part of the time behind
        the run-up in which the flanks of a mesh were apart. With an accuracy ``mesh_rms``, the RMS of the
        first three mesh harmonics of each force, and ``mesh_rms_error``, their numerical errors, too.

    Raises
    ------
    RuntimeError
        If the integration does not reach its end.
    CaseError
        With an accuracy: if the run has a tolerance of its own, or half of its record is too short for harmonics.

    Warns
    -----
    UserWarning
        Of an accuracy that was not reached, and of flanks that came apart, so that other motions may exist.
    """
    if accuracy is None:
        return _run(run, progress)[0]
    wanted, gears = asked_accuracy(accuracy, smallest=SMALLEST), run.gears
    if run.tolerance is not None:
        raise CaseError(
            f"{gears.name}: accuracy = {accuracy!r}: the tolerance is chosen for it, but operation.tolerance is "
            f"{run.tolerance:g}; leave one of the two out"
        )
    pairs = (gears.pairs_sun[0], gears.pairs_ring[0])
    count = 1 if gears.ideal is not None else max(pair.face_slices for pair in pairs)
    slices = {} if count == 1 else {"set": count}

    rate = run.rate * OVERSAMPLING
    first, last = _samples(run)
    half = (last + 1 - first) // 2
    orders = np.arange(1, HARMONICS + 1)
    names = [f"force of {name}" for name in _meshes(gears)]

    behind: Behind | None = None

    def lines(precise: Precise) -> Lines:
        nonlocal behind
        sliced = precise.slices.get("set", count)
        one = run if sliced == count else replace(run, gears=replace(gears, slices=sliced))
        # one sample more than the half, lest rounding left one out
        duration = half / rate + 1.0 / rate if precise.half else run.duration
        one = replace(one, tolerance=precise.tolerance, duration=duration)
        start: dict[str, Any] = {}
        if run.rim is None and not precise.half:
            start = keeping(DEFAULT, run.run_up + LEFT_TO_TWIN * run.settling)
        elif behind is not None:
            start = behind.start(sliced)
        record, forces, made = _run(one, progress, start.pop("mechanism", None), **start)
        behind = replace(made, slices=sliced)
        frequency = abs(record.attrs["frequency_mesh"])
        if half * frequency < MIN_PERIODS * rate or not HARMONICS * frequency < 0.5 * rate:
            raise CaseError(
                f"{gears.name}: accuracy = {accuracy!r}: half of operation.duration = {run.duration:g} s has "
                f"{half * frequency / rate:.3g} mesh cycles of {frequency:.4g} Hz; give a duration of "
                f"{2.0 * (MIN_PERIODS + 1) / max(frequency, 1e-30):.3g} s or more, and a rate above "
                f"{2.1 * HARMONICS * frequency / OVERSAMPLING:.6g} Hz"
            )

        def levels(part: np.ndarray) -> np.ndarray:
            return np.abs(harmonic_amplitudes(part, rate, frequency, orders)).T[:, None, :] / np.sqrt(2.0)

        parts = [forces[:half]] if precise.half else [forces[:half], forces[half:]]
        whole = levels(forces)
        record["mesh_rms"] = (
            ("mesh", "planet", "harmonic"),
            whole.reshape(2, gears.planets, HARMONICS),
            {"units": "N", "long_name": "RMS of the mesh harmonics of the forces of the teeth"},
        )
        record.coords["harmonic"] = orders
        apart = time_apart(np.arange(half) / rate, forces[:half])
        return Lines(
            record, names, whole, np.stack([levels(one) for one in parts]), apart, record.attrs["record_apart"]
        )

    groups = np.zeros(2 * gears.planets, dtype=int)
    precise = Precise(run.used_tolerance, slices)
    return accurate_lines(lines, precise, wanted, groups, "mesh_rms", f"planetary set '{gears.name}'")


def _run(
    run: PlanetaryRun, progress: Callable[[float], None] | None, mechanism: Mechanism | None = None, **options: Any
) -> tuple[xr.Dataset, np.ndarray, Behind]:
    """Return the record of a planetary set, the forces of its meshes, (m, 2 planets), and what was simulated.

    Forces are at `OVERSAMPLING` times its rate, those with the sun first.
    """
    from scipy.signal import resample_poly

    gears = run.gears
    mechanism = run.mechanism() if mechanism is None else mechanism
    planets = range(1, gears.planets + 1)
    # mesh forces have corners: what the sensor hears is filtered before it is sampled
    time, told, apart, solution = _told(run, mechanism, progress, **options)
    kept = slice(None, None, OVERSAMPLING)
    both = {"sun": told["sun"], "ring": told["ring"]}
    motion: dict[str, Any] = {}
    if run.rim is not None:
        told_rate = resample_poly(told["rim"], 1, OVERSAMPLING, padtype="line")
        motion["rim_velocity"] = (
            "time",
            told_rate,
            {"units": "m/s", "long_name": "radial velocity of the rim at angle 0"},
        )
    turned = told["carrier angle"]
    heard = fixed_sensor(both["ring"], turned, [float(a) for a in gears.angles or ()])
    heard = resample_poly(heard, 1, OVERSAMPLING, padtype="line")
    at_meshes = np.concatenate([both["sun"], both["ring"]], axis=1)
    both = {mesh: force[kept] for mesh, force in both.items()}
    spin = {m: told[f"{m} speed"][kept] for m in MEMBERS}
    angle = turned[kept]
    total = both["sun"].sum(axis=1, keepdims=True)
    share = np.divide(both["sun"], total, out=np.zeros_like(both["sun"]), where=total != 0)
    mean = {m: float(w.mean()) for m, w in spin.items()}
    rates = gears.frequencies(sun=mean["sun"], carrier=mean["carrier"])
    # what `analyse` can tell faults of
    plain = gears.planet_at_ring is None and run.held == "ring"
    record = xr.Dataset(
        {
            "speed": (("time", "member"), np.column_stack([spin[m] for m in MEMBERS]), {"units": "rad/s"}),
            "force": (("time", "mesh", "planet"), np.stack([both["sun"], both["ring"]], axis=1), {"units": "N"}),
            "share": (("time", "planet"), share, {"units": "1"}),
            "ring_sensor": ("time", heard, {"units": "N", "long_name": "ring forces past the sensor"}),
            "carrier_angle": ("time", angle, {"units": "rad"}),
            **motion,
        },
        coords={
            "time": ("time", time[kept] - run.run_up - run.settling, {"units": "s"}),
            "member": list(MEMBERS),
            "mesh": ["sun", "ring"],
            "planet": list(planets),
        },
        attrs={
            "title": gears.name,
            "sampling_rate": run.rate,
            "record_apart": apart,
            **{f"law_{mesh}": gears.law(mesh) for mesh in ("sun", "ring")},
            "teeth": [gears.sun.teeth, gears.planet.teeth, gears.ring.teeth],
            **({"planet_angles": [float(a) for a in gears.angles or ()]} if plain else {}),
            **{f"frequency_{name}": value for name, value in rates.items()},
        },
    )
    return record, at_meshes, Behind(mechanism, solution)


def _told(
    run: PlanetaryRun, mechanism: Mechanism, progress: Callable[[float], None] | None, **options: Any
) -> tuple[np.ndarray, dict[str, np.ndarray], float, Solution]:
    """Simulate a set; return times of the record, `OVERSAMPLING` at its rate, and what it is made from there.

    The third is the part of the time behind the run-up in which the flanks of a mesh were apart, with a rim that bends
    of that of the record: the largest of all meshes. The last is how the run ended.

    Mesh forces and motions are those of the integrator's own steps, between which they are interpolated; a rim that
    bends has to be evaluated, which is done at these times alone.

    Raises
    ------
    RuntimeError
        If the integration does not reach its end.
    """
    fine, begin = run.rate * OVERSAMPLING, run.run_up + run.settling
    first, last = _samples(run)
    recorder = _Recorder(run, mechanism, first / fine - AHEAD / fine)
    options = {"tol": run.used_tolerance, **options}
    if run.rim is None:
        options |= {"every_step": True, "consumer": recorder.take, "watch": _watched(run)}
    else:
        options["rate"] = fine
    if progress is not None:
        options["progress"] = progress
    solution = mechanism.simulate(begin + run.duration, **options)
    if solution.status is not Status.SUCCESS:
        raise RuntimeError(f"{run.gears.name}: {solution.message}")
    if run.rim is None:
        time = np.arange(first, last + 1) / fine
        return time, recorder.at(time), recorder.apart, solution
    before = _rows_before(run, solution.t[:first])
    # all bodies and forces at all outputs would need far more memory than what is wanted of them
    for part in solution.parts(np.concatenate([before, np.arange(first, last + 1)])):
        recorder.take(part)
    told = {name: values[before.size :] for name, values in recorder.joined().items()}
    time = solution.t[first : last + 1]
    return time, told, time_apart(time, np.concatenate([told["sun"], told["ring"]], axis=1)), solution


def _samples(run: PlanetaryRun) -> tuple[int, int]:
    """Return the numbers of the first and the last sample of a record, `OVERSAMPLING` at its rate."""
    fine, begin = run.rate * OVERSAMPLING, run.run_up + run.settling
    return int(np.ceil(begin * fine - 0.5)), int(np.floor((begin + run.duration) * fine + 1e-6))


def _meshes(gears: PlanetarySet) -> list[str]:
    """Return the names of the meshes, those with the sun first."""
    planets = range(1, gears.planets + 1)
    return [name.format(k) for name in ("sun-planet {}", "planet {}-ring") for k in planets]


AHEAD = 4
"""Samples before a record of which steps are kept, for the slopes of what is interpolated."""


def _watched(run: PlanetaryRun) -> list[tuple[str, str]]:
    """Return what a record takes from the integrator's own steps."""
    spins = [("angular_velocity", member) for member in MEMBERS]
    return [*(("diagnostics", mesh) for mesh in _meshes(run.gears)), ("orientation", "carrier"), *spins]


class _Recorder:
    """Collects what a record is made from, of parts of a solution in the order of time.

    Parameters
    ----------
    run : PlanetaryRun
    mechanism : Mechanism
    begin : float
        Of parts that end before this time, s, the carrier's turns alone are kept: with a rim all are.
    """

    def __init__(self, run: PlanetaryRun, mechanism: Mechanism, begin: float) -> None:
        self._run, self._mechanism, self._begin = run, mechanism, begin
        self._times: list[np.ndarray] = []
        self._parts: list[dict[str, np.ndarray]] = []
        self._turned = 0.0
        self._apart = np.zeros(2 * run.gears.planets)
        self._carried = np.zeros(2 * run.gears.planets, dtype=bool)
        self._behind = 0.0
        self._last: np.ndarray | None = None

    @property
    def apart(self) -> float:
        """Part of the time behind the run-up in which the flanks of a mesh were apart, largest of those that carry."""
        return float(self._apart[self._carried].max(initial=0.0)) / self._behind if self._behind > 0.0 else 0.0

    def take(self, part: Solution) -> None:
        """Take the next part."""
        angle = np.unwrap(np.concatenate([[self._turned], _angle(part, "carrier")]))[1:]
        self._turned = float(angle[-1])
        if part.t[-1] < self._run.run_up and self._run.rim is None:
            return
        wanted = _wanted(self._run, self._mechanism, part)
        self._add_apart(part.t, np.concatenate([wanted["sun"], wanted["ring"]], axis=1))
        if part.t[-1] < self._begin and self._run.rim is None:
            return
        self._times.append(part.t.copy())
        self._parts.append({**wanted, "carrier angle": angle})

    def _add_apart(self, t: np.ndarray, forces: np.ndarray) -> None:
        """Count the times in which each mesh carries nothing."""
        steps = np.diff(t, prepend=self._last if self._last is not None else t[:1])
        steps[t <= self._run.run_up] = 0.0
        self._last = t[-1:].copy()
        self._behind += float(steps.sum())
        self._apart += steps @ (forces == 0.0)
        self._carried |= (forces > 0.0).any(axis=0)

    def joined(self) -> dict[str, np.ndarray]:
        """Return what was taken, by name."""
        return {name: np.concatenate([part[name] for part in self._parts]) for name in self._parts[0]}

    def at(self, time: np.ndarray) -> dict[str, np.ndarray]:
        """Return what was taken at other times, by a monotone cubic."""
        t = np.concatenate(self._times)
        told, inside = self.joined(), np.clip(time, t[0], t[-1])
        return {name: np.ascontiguousarray(monotone_cubic(t, values, inside)) for name, values in told.items()}


def _rows_before(run: PlanetaryRun, t: np.ndarray) -> np.ndarray:
    """Return the numbers of the output times before a record that are evaluated, to count turns from the start on.

    All of them where the speeds of the set follow from its loads.
    """
    known = {member: to_si(speed, "angular speed", member) for member, speed in run.speeds.items()}
    known |= {run.held: 0.0} if run.held else {}
    if len(known) != 2:
        return np.arange(t.size)
    fastest = max(abs(speed) for speed in run.gears.speeds(**known).values())
    interval = np.floor(t * fastest / (2.0 * np.pi * TURN_BEFORE))
    return np.flatnonzero(np.diff(interval, prepend=-1.0) > 0.0)


def _wanted(run: PlanetaryRun, mechanism: Mechanism, part: Solution) -> dict[str, np.ndarray]:
    """Return what the record is made from, of one part of a solution."""
    planets = range(1, run.gears.planets + 1)

    def forces(form: str) -> np.ndarray:
        return np.column_stack([part.diagnostics(form.format(k))["normal_force"] for k in planets])

    found = {"sun": forces("sun-planet {}")}
    found |= {f"{m} speed": part.angular_velocity(m)[:, 2].copy() for m in MEMBERS}
    if run.rim is None:
        return {**found, "ring": forces("planet {}-ring")}
    told = part.diagnostics("ring meshes")
    found["ring"] = np.column_stack([told[f"normal_force_{k}"] for k in planets])
    found["rim"] = mechanism.elements["ring meshes"].rim_motion(part, 0.0)["radial_velocity"].copy()
    return found


def _angle(solution: Any, body: str) -> np.ndarray:
    axes = solution.orientation(body)
    return np.arctan2(axes[:, 1, 0], axes[:, 0, 0])


def interaction(run: PlanetaryRun, backlash: Any, progress: Callable[[float], None] | None = None) -> xr.Dataset:
    """Simulate a set sound and faulty, without and with backlash: what a defect and backlash do together.

    Parameters
    ----------
    run : PlanetaryRun
        With its faults.
    backlash : float or str
        Normal backlash of all meshes, m, of the two runs that have it.
    progress : callable, optional

    Returns
    -------
    xarray.Dataset
        ``deviation``, the standard deviation of the ring sensor in N, over ``fault`` and ``backlash`` (no, yes), and
        ``excess``: by how much both together exceed the sum of what each does alone.
    """
    levels = np.zeros((2, 2))
    for i, faults in enumerate(((), run.gears.faults)):
        for j, play in enumerate((0.0, backlash)):
            gears = replace(run.gears, faults=faults, backlash_sun=play, backlash_ring=play)
            levels[i, j] = float(run_planetary(replace(run, gears=gears), progress)["ring_sensor"].std())
    base = levels[0, 0]
    excess = (levels[1, 1] - base) - (levels[1, 0] - base) - (levels[0, 1] - base)
    return xr.Dataset(
        {"deviation": (("fault", "backlash"), levels, {"units": "N"}), "excess": ((), excess, {"units": "N"})},
        coords={"fault": ["no", "yes"], "backlash": ["no", "yes"]},
        attrs={"backlash_m": float(to_si(backlash, "length", "backlash"))},
    )
