"""What virtual encoders, a laser and a camera make of simulated gearboxes: tables of two pages.

    python -m benchmarks.instruments encoders --write docs/data/encoders.txt
    python -m benchmarks.instruments optical --write docs/data/optical.txt

Either takes some minutes of one core.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.interpolate
import xarray as xr

import gearmbs as gm
from benchmarks.markdown import table
from gearmbs import signals
from gearmbs.gears import GearPair, GearSpec, planetary, planetary_mechanism
from gearmbs.mechanism import Mechanism, ramp, step

LINES, MARKS = 1024, 0.01
COUNTER: dict[str, Any] = {"clock": "50 ns", "jitter": "50 ns"}
FREE = 4.0
"""Seconds of the shafts running free."""
HARMONICS = 4
RATE = 50e3
"""Hz, of what is simulated."""


class Box(NamedTuple):
    """A gearbox whose shafts' angles are known."""

    name: str
    angles: tuple[xr.DataArray, xr.DataArray]
    radius: float
    gearing: dict[str, Any]
    ratio: float
    mesh: float

    @property
    def speed(self) -> float:
        """Mean speed of the driver, rad/s."""
        values = self.angles[0]
        return float((values[-1] - values[0]) / (values["time"][-1] - values["time"][0]))

    def lag(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the driver's turns, and the lag of the driven wheel, m."""
        driver, driven = (a.values - a.values[0] for a in self.angles)
        return driver / math.tau, self.radius * (driver - self.ratio * driven)

    def lines(self, count: int) -> np.ndarray:
        """Return the first mesh harmonics, m, over all whole meshes: peaks, with the phase at the driver's angle 0."""
        turned, lag = self.lag()
        cycles = math.floor(turned[-1] * self.mesh)
        even = np.arange(64 * cycles) / (64 * self.mesh)
        found = np.fft.rfft(scipy.interpolate.make_interp_spline(turned, lag, k=5)(even)) / (32 * cycles)
        return found[cycles : (count + 1) * cycles : cycles]

    def exact(self) -> np.ndarray:
        """Return the amplitudes of the mesh harmonics, m."""
        return np.abs(self.lines(HARMONICS))

    def measured(self, seed: int, free: float = 0.0, **known: Any) -> Any:
        """Return the transmission error through encoders, one of which lacks a mark; shafts free for some seconds."""
        marks = [signals.mark_errors(LINES, MARKS, 2 * seed + k) for k in (0, 1)]
        t = np.arange(round(free * 20e3)) / 20e3
        down = _angle(self.speed * t - t**2, t)

        def pulses(shaft: int, angle: xr.DataArray, number: int) -> Any:
            how: dict[str, Any] = {"index": True} if shaft else {"lacking": [0]}
            return signals.encoder(
                angle, LINES, marks=marks[shaft], seed=4 * seed + number + shaft, mounted=0.3 * shaft,
                name=("driver", "driven")[shaft], **how, **COUNTER,
            )  # fmt: skip

        run = signals.CoupledRun(*(pulses(k, angle, 0) for k, angle in enumerate(self.angles)))
        alone = {name: pulses(k, down, 2) for k, name in enumerate(("driver", "driven"))} if free else None
        return gm.transmission_error_from_pulses(run, base_radius=self.radius, free=alone, **self.gearing, **known)


def _angle(values: np.ndarray, times: np.ndarray) -> xr.DataArray:
    return xr.DataArray(values, dims=("time",), coords={"time": times}, attrs={"units": "rad"})


def boxes() -> Iterator[Box]:
    """Yield the gearboxes, simulated."""
    gears = {"teeth": (21, 34), "module": "2.5 mm", "face_width": "20 mm"}
    for name, wheels, speed, torque in (
        ("paper's pair, 1000 rpm, 100 N m", {}, "1000 rpm", "100 N m"),
        ("21 and 34 teeth, 1500 rpm, 60 N m", gears, "1500 rpm", "60 N m"),
    ):
        case = gm.Case(gears=wheels, operation={"speed": speed, "torque": torque, "duration": 4.3})
        teeth = tuple(case.gears.teeth)
        angles = signals.shaft_angles(gm.run_case(case))
        radius = case.pair().geometry.driver.base_radius
        yield Box(name, angles, radius, {"teeth": teeth}, teeth[1] / teeth[0], teeth[0])
    helical = {"module": "2.5 mm", "helix_angle": "15 deg", "face_width": "20 mm"}
    pair = GearPair(GearSpec(21, **helical), GearSpec(34, **helical, hand="left"), backlash="0.1 mm")
    m, place = Mechanism("helical pair"), pair.placement()
    bodies = [
        m.body(n, wheel.mass, wheel.inertia, position=at, orientation=axes)
        for n, wheel, at, axes in zip(("driver", "driven"), pair.wheels, (place.origin_1, place.origin_2),
                                      (place.axes_1, place.axes_2))
    ]  # fmt: skip
    seats = [
        m.revolute(b.name + " seat", b, m.ground, at=at) for b, at in zip(bodies, (place.origin_1, place.origin_2))
    ]
    m.rotation("drive", seats[0], ramp(math.tau * 25.0, over=0.03))
    m.torque("load", bodies[1], step(0, 0, 0.03, 60.0))
    m.gear_contact("mesh", *bodies, pair)
    yield _turned("the same, 15° helical", m, [s.name for s in seats], pair.geometry.driver.base_radius,
                  {"teeth": (21, 34)}, 34 / 21, 21.0)  # fmt: skip
    rig, radius, ratio, mesh, _ = planetary_rig()
    name, known = "planetary set 24, 30, 84, sun to carrier, 1350 rpm, 50 N m", {"ratio": ratio, "mesh_order": mesh}
    yield _turned(name, rig, ["sun seat", "carrier seat"], radius, known, float(ratio), float(mesh))


def planetary_rig() -> tuple[Mechanism, float, Fraction, Fraction, float]:
    """Return a planetary set, its sun's base radius, m, ratio and mesh order, sun to carrier, and speed, rad/s."""
    rig = planetary_mechanism(
        planetary((24, 30, 84), "1.5 mm", backlash_sun="0.05 mm", backlash_ring="0.05 mm"),
        speeds={"sun": "1350 rpm"}, torques={"carrier": "-50 N m"}, run_up="50 ms",
    )  # fmt: skip
    radius = 0.5 * 24 * 1.5e-3 * math.cos(math.radians(20.0))
    return rig, radius, Fraction(108, 24), Fraction(56, 3), 1350.0 * math.tau / 60.0


def _turned(name: str, m: Mechanism, seats: list[str], *known: Any) -> Box:
    """Return a mechanism as a gearbox, from when it runs steadily."""
    solution = m.simulate(4.3, rate=RATE)
    kept = solution.t > 0.2
    angles = (_angle(np.abs(solution.joint_angle(seat)[kept]), solution.t[kept]) for seat in seats)
    return Box(name, (next(angles), next(angles)), *known)


def encoders() -> str:
    """Return what encoders make of four gearboxes."""
    rows = []
    micro = "{:.3f}, {:.3f}".format
    for box in boxes():
        exact, found = 1e6 * box.exact(), box.measured(1, FREE).harmonics()[:HARMONICS]
        alone = box.measured(1).harmonics()[:HARMONICS]
        widths = 1e6 * (alone["high"] - alone["low"])
        inside = (1e6 * alone["low"] <= exact) & (exact <= 1e6 * alone["high"])
        turns = box.lag()[0][-1]
        reach = 0.5e6 * (found["high"] - found["low"]).mean()
        rows.append([
            box.name, f"{turns:.0f}", *map(micro, exact, 1e6 * found["amplitude"]), f"{reach:.4f}",
            f"{widths.min():.1f} to {widths.max():.1f}; {inside.sum()} of {HARMONICS}",
        ])  # fmt: skip
        print(rows[-1], flush=True)
    head = ["", "turns", *(f"harmonic {k}" if k == 1 else str(k) for k in range(1, HARMONICS + 1)), "interval ±",
            "without free runs: width; truth inside"]  # fmt: skip
    return table(head, rows)


# The paper's comparison.

STATES: dict[str, dict[str, Any]] = {
    "healthy": {}, "misaligned": {"misalignment": "1 deg"}, "distance": {"centre_distance_error": "3 mm"},
}  # fmt: skip
LOADS = {"low": 100.0, "high": 200.0}
SHAFT = math.tau * 1000 / 60
DROP_OUTS = {"per_second": 30, "longest": 0.7e-3, "full_scale": 0.2}
PIXEL = 20e-6
"""m."""


AS_ACCELERATION: dict[str, dict[str, Any]] = {
    "force": {},
    "laser": {"quantity": "acceleration", "band": ("100 Hz", "5 kHz")},
    "as it came": {"quantity": "acceleration", "band": ("100 Hz", "5 kHz")},
    "camera": {"quantity": "acceleration", "band": ("100 Hz", "2.4 kHz")},
}
"""How records of each instrument are compared: the band ends below half the rate of the laser, and of the film."""


def rig(torque: float, seconds: float = 1.26, **changes: Any) -> dict[str, xr.DataArray]:
    """Return velocity and place of the driven wheel on springs of 50 N/um, and the force on them over its mass."""
    pair, m = GearPair.paper(backlash="0.1 mm", **changes), Mechanism("gears on an elastic bearing")
    place = pair.placement()
    driver, driven = (
        m.body(name, wheel.mass, wheel.inertia, position=origin, orientation=axes)
        for name, wheel, origin, axes in zip(
            ("driver", "driven"), pair.wheels, (place.origin_1, place.origin_2), (place.axes_1, place.axes_2)
        )
    )
    bearing = m.revolute("bearing", driver, m.ground, at=place.origin_1)
    m.rotation("drive", bearing, ramp(SHAFT, over=0.03))
    m.bushing(
        "support", driven.marker_at(place.origin_2, np.eye(3)), m.ground.marker(place.origin_2),
        stiffness=(5e7, 5e7, 5e7), damping=(3e3, 3e3, 3e3),
        torsional_stiffness=(1e5, 1e5, 0), torsional_damping=(10, 10, 0),
    )  # fmt: skip
    m.torque("load", driven, step(0, 0, 0.03, torque))
    m.gear_contact("mesh", driver, driven, pair)
    run = m.simulate(seconds, rate=51_200)

    def signal(values: np.ndarray, units: str) -> xr.DataArray:
        known = {"units": units, "channels": ["x", "y", "z"], "speed": SHAFT, "teeth": (29, 29)}
        return signals.trim(signals.make_signal(values, 51_200, **known), 0.06)

    force = signals.joint_force(signal(run.load("support")[0], "N"), (0, 1, 0))
    return {
        "velocity": signals.laser_vibrometer(signal(run.com_velocity("driven"), "m/s"), (0, 1, 0)),
        "place": signal(run.com_position("driven"), "m")[:, [1]],
        "force": signals.force_to_acceleration(force, pair.wheels[1].mass),
    }


def seen_by(run: dict[str, xr.DataArray], seed: int) -> dict[str, xr.DataArray]:
    """Return what the force, a laser, bridged and as it came, and a camera show of a run of the rig."""
    laser = signals.sample(run["velocity"], 12_800.0)
    angle = xr.DataArray(SHAFT * laser["time"].values, dims=("time",))
    laser = signals.speckle(laser, angle, rms=2e-4, seed=seed, recurring=0.9)
    laser = signals.drop_outs(signals.add_noise(laser, seed=seed, rms=1e-5), seed=seed, **DROP_OUTS)
    film = signals.camera(run["place"], 6000.0, scale=PIXEL, noise=0.02, seed=seed)
    return {
        "force": signals.sample(run["force"], 12_800.0),
        "laser": signals.repair_vibrometer(laser, full_scale=DROP_OUTS["full_scale"]),
        "as it came": laser,
        "camera": signals.point_track(film, PIXEL),
    }


def optical() -> str:
    """Return the changes of mesh harmonics by the force, a laser and a camera, and where these say otherwise."""
    seen: dict[str, dict[str, dict[str, xr.DataArray]]] = {
        by: {load: {} for load in LOADS} for by in ("force", "laser", "as it came", "camera")
    }
    for number, (load, state) in enumerate((load, state) for load in LOADS for state in STATES):
        run = rig(LOADS[load], **STATES[state])
        for by, record in seen_by(run, number).items():
            seen[by][load][state] = record
    found = {by: signals.compare(records, **AS_ACCELERATION[by]) for by, records in seen.items()}
    rows = []
    for load in LOADS:
        for state in list(STATES)[1:]:
            for by in ("force", "laser", "camera"):
                change = found[by].changes().sel(load=load, state=state).values.ravel()
                name = {"distance": "+3 mm"}.get(state, state)
                rows.append([f"{load}, {name}" if by == "force" else "", by, *(f"{c:+.1f}" for c in change)])
    right = found["force"].expectations()
    told_otherwise = [f"\nOf {len(right)} verdicts:\n"]
    for by in ("laser", "camera", "as it came"):
        other = found[by].expectations()
        wrong = other[other["as_expected"] != right["as_expected"]]
        words = "; ".join(f"{r.feature}, {r.state}, {r.load}: {r.found}" for r in wrong.itertuples())
        name = "the laser as it came, drop-outs and all" if by == "as it came" else f"the {by}"
        told_otherwise.append(f"* other than by the force, by {name}: {words or 'none'}")
        if by != "as it came":
            told_otherwise += [f"* not certain, by {name}: {text}" for text in found[by].uncertain()]
    return table(["load, state", "", *(f"{k} × GMF" for k in (1, 2, 3))], rows) + "\n".join(told_otherwise) + "\n"


PARTS: dict[str, Callable[[], str]] = {"encoders": encoders, "optical": optical}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--write", type=Path)
    given = parser.parse_args()
    page = PARTS[given.part]()
    print(page)
    if given.write is not None:
        given.write.write_text(page, encoding="utf-8")
