"""How long encoders must record: tables of docs/theory/angle_measurement.md.

    python -m benchmarks.long_records --write docs/data/long_records.txt

Takes some minutes of one core, and 3 GB. The transmission error of a steady motion recurs mesh after mesh, and with the
marks of both encoders after as many turns as the wheels take to meet again. So the pulses of one meeting, exact, are
those of all; jitter and clock are new for each.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.interpolate
import xarray as xr

import gearmbs as gm
from benchmarks.instruments import COUNTER, LINES, MARKS, Box, boxes, planetary_rig
from benchmarks.markdown import table
from gearmbs import signals
from gearmbs.gears import GearPair, GearSpec
from gearmbs.gears.transmission import loaded_transmission_error
from gearmbs.mechanism import quasi_static

SHOWN = 4
"""Mesh harmonics whose errors are shown."""
HARMONICS = 24
"""Of the simulated motion: what is beyond is folded onto none of those shown."""
DRAWS, CURVES = 1, 2
"""Records of each gearbox and length, and of each static curve."""
POINTS = 1000
"""Samples of a mesh in which the shafts' angles are handed to the encoders, whose spline joins them."""
SETTLED = 0.06
"""s, when the set turns at its speed."""
STATIC = "<!-- static -->"
"""Before the table of static curves."""
LEAST, LONG = 0.05e-6, 0.02e-6
"""m: lines from the first on are asked for of all, down to the second where one record shall be long enough for it."""
ACCURACY, ALL, MOST = 0.02, 0.999, 0.95
"""Share of its height that a line is to be known to, with the probability of all of some dozens, and of most."""


class Steady(NamedTuple):
    """A gearbox in steady motion: lag of the driven shaft, m, over a mesh cycle, and its harmonics."""

    name: str
    speed: float
    radius: float
    gearing: dict[str, Any]
    ratio: Fraction
    mesh: Fraction
    curve: scipy.interpolate.CubicSpline

    @classmethod
    def of_box(cls, box: Box) -> Steady:
        """Return a simulated gearbox."""
        known = box.gearing
        ratio = Fraction(known["teeth"][1], known["teeth"][0]) if "teeth" in known else Fraction(known["ratio"])
        mesh = Fraction(known["teeth"][0]) if "teeth" in known else Fraction(known["mesh_order"])
        lines = box.lines(HARMONICS)
        phase = np.arange(40 * HARMONICS) / (40 * HARMONICS)
        lag = sum(np.real(line * np.exp(1j * math.tau * h * phase)) for h, line in enumerate(lines, 1))
        return cls(box.name, box.speed, box.radius, known, ratio, mesh, _closed(lag))

    @classmethod
    def of_pair(cls, name: str, pair: GearPair, torque: float, speed: float) -> Steady:
        """Return the loaded static curve of a pair, at a speed."""
        driver, driven = (spec.teeth for spec in (pair.geometry.driver, pair.geometry.driven))
        error = loaded_transmission_error(pair, torque=torque, points=2 * POINTS).error
        known = {"teeth": (driver, driven)}
        return cls(
            name, speed, pair.geometry.driver.base_radius, known, Fraction(driven, driver), Fraction(driver),
            _closed(error - error.mean()),
        )  # fmt: skip

    @classmethod
    def of_set(cls, name: str, points: int = POINTS) -> Steady:
        """Return the loaded static curve of a planetary set, sun to carrier, at the speed of the simulated one."""
        mechanism, radius, ratio, mesh, speed = planetary_rig()
        at = SETTLED + np.arange(points + 1) / points * math.tau / (speed * float(mesh))
        solution = quasi_static(mechanism, at)
        sun, carrier = (np.unwrap(solution.joint_angle(f"{n} seat")) for n in ("sun", "carrier"))
        lag = radius * (sun - float(ratio) * carrier)[:-1]
        known = {"ratio": ratio, "mesh_order": mesh}
        return cls(name, speed, radius, known, ratio, mesh, _closed(lag - lag.mean()))

    def exact(self, count: int) -> np.ndarray:
        """Return the amplitudes of the first mesh harmonics, m."""
        phase = np.arange(16 * POINTS) / (16 * POINTS)
        return np.abs(np.fft.rfft(self.curve(phase)))[1 : count + 1] / (8 * POINTS)

    def encoders(self) -> signals.EncoderPair:
        """Return what its encoders are."""
        return signals.EncoderPair(self.radius, self.speed, LINES, COUNTER["jitter"], COUNTER["clock"], self.ratio)

    def pulses(self, shaft: int, turns: float, disc: int | None, free: bool = False) -> signals.PulseTrain:
        """Return the exact pulses of an encoder in some turns of the driver and more; of a disc's marks or none."""
        ends = 3.0 * max(1.0, float(self.ratio))
        turned = np.arange(-ends, turns + ends, 1.0 / (POINTS * float(self.mesh)))
        angle = math.tau * turned
        if shaft:
            lag = 0.0 if free else self.curve(np.mod(float(self.mesh) * turned, 1.0))
            angle = (angle - lag / self.radius) / float(self.ratio)
        return signals.encoder(
            xr.DataArray(angle, dims=("time",), coords={"time": math.tau / self.speed * turned}), LINES,
            marks=None if disc is None else signals.mark_errors(LINES, MARKS, 2 * disc + shaft), mounted=0.3 * shaft,
            name=("driver", "driven")[shaft], **({"index": True} if shaft else {"lacking": [0]}),
        )  # fmt: skip

    def plain(self, shaft: int, seconds: float) -> signals.PulseTrain:
        """Return the pulses of an encoder whose marks have no errors, one of them missing, in some seconds."""
        return self.pulses(shaft, seconds * self.speed / math.tau, None)

    def train(self, shaft: int, seconds: float, disc: int, seed: int, free: bool) -> signals.PulseTrain:
        """Return the pulses of an encoder in as many meetings, or turns of the shaft running free, as fit."""
        turn = self.ratio if shaft else Fraction(1)
        period = turn if free else Fraction(self.ratio.numerator)
        one = self.pulses(shaft, float(period), disc, free)
        count, first = int(LINES * period / turn), one.numbers[np.searchsorted(one.times, 0.0)]
        kept = (one.numbers >= first) & (one.numbers < first + count)
        long = math.tau / self.speed * float(period)
        again = np.arange(max(1, round(seconds / long)))[:, None]
        rng = np.random.default_rng(seed)
        times = (one.times[kept] + long * again).ravel()
        times += gm.units.to_si(COUNTER["jitter"], "time") * rng.standard_normal(times.size)
        tick = gm.units.to_si(COUNTER["clock"], "time")
        numbers = (one.numbers[kept] + count * again).ravel()
        name = ("driver", "driven")[shaft]
        return signals.PulseTrain(np.sort(np.floor(times / tick) * tick), numbers, LINES, True, name)

    def measured(self, seconds: float, draw: int, **known: Any) -> Any:
        """Return the transmission error from a record of some seconds in mesh, and as many of each shaft free."""
        run = signals.CoupledRun(*(self.train(k, seconds, draw, 4 * draw + k, False) for k in (0, 1)))
        free = {n: self.train(k, seconds, draw, 4 * draw + 2 + k, True) for k, n in enumerate(("driver", "driven"))}
        return gm.transmission_error_from_pulses(run, base_radius=self.radius, free=free, **self.gearing, **known)


def _closed(lag: np.ndarray) -> scipy.interpolate.CubicSpline:
    phase = np.arange(lag.size + 1) / lag.size
    return scipy.interpolate.CubicSpline(phase, np.append(lag, lag[0]), bc_type="periodic")


def lengths() -> str:
    """Return what records make of small lines that are as long as these need."""
    rows = []
    for steady, height, probability, known in _asked():
        need = steady.encoders().needs(height, ACCURACY, probability)
        exact, off, inside, told, all_lines = steady.exact(HARMONICS), [], 0, [], 0
        for draw in range(DRAWS):
            found = steady.measured(need.seconds, 100 + draw, **known).harmonics()
            true = exact[found["harmonic"].to_numpy() - 1]
            inside += int(((found["low"] <= true) & (true <= found["high"])).sum())
            all_lines += len(found)
            off.append((found["amplitude"].to_numpy() - true)[:SHOWN])
            told.append(0.25 * (found["high"] - found["low"])[:SHOWN].mean())
        shown = exact[:SHOWN]
        seen = shown >= 0.999 * height
        errors = np.array(off)[:, seen] / shown[seen]
        rows.append([
            steady.name, f"{1e6 * height:.3f}, {100 * probability:g} %", f"{need.seconds:.0f}", f"{need.turns:.0f}",
            ", ".join(f"{1e6 * a:.3f}" for a in shown[seen]),
            ", ".join(f"{100 * e:.2f}" for e in np.sqrt(np.mean(errors**2, axis=0))),
            f"{100 * np.abs(errors).max():.2f}; {(np.abs(errors) <= ACCURACY).sum()} of {errors.size}",
            f"{inside} of {all_lines}",
            ", ".join(f"{1e9 * v:.2f}" for v in (
                np.sqrt(np.mean(np.square(off))), np.mean(told), steady.encoders().uncertainty(need.seconds)
            )),
        ])  # fmt: skip
        print(rows[-1], flush=True)
    return table(
        ["", "asked: 2 % of, µm, in", "s in mesh, and free", "turns of the driver", "harmonics, µm", "errors, RMS, %",
         "largest, %; within 2 %", "inside intervals of 95 %", "RMS error, told, formula, nm"], rows
    )  # fmt: skip


def _asked() -> Iterator[tuple[Steady, float, float, dict[str, int]]]:
    """Yield gearboxes with the height of line that is asked for, the probability, and how they are evaluated."""
    for box in boxes():
        steady = Steady.of_box(box)
        heights = steady.exact(SHOWN)
        least = heights[heights >= LEAST].min()
        yield steady, least, ALL, {}
        if LONG <= heights.min() < LEAST:
            yield steady, heights.min(), MOST, {}
        if steady.exact(HARMONICS)[SHOWN:].max() > heights[1]:
            # harmonics beyond half the lines are larger than most of those below
            yield steady._replace(name=f"the same, harmonics={HARMONICS}"), least, ALL, {"harmonics": HARMONICS}
        if heights.min() < LONG:
            slow = steady._replace(name="the same at a tenth of the speed", speed=0.1 * steady.speed)
            yield slow, heights.min(), MOST, {}


def curves() -> str:
    """Return how near the loaded static curves come back."""
    usual = {"module": "2.5 mm", "face_width": "20 mm"}
    leaning = {**usual, "helix_angle": "15 deg"}
    pairs = (
        ("paper's pair, 955 rpm, 100 N m", GearPair.paper(backlash="0.1 mm"), 100.0, 100.0, ((4.0, 160), (16.0, 160))),
        ("21 and 34 teeth, 1500 rpm, 60 N m", GearPair(GearSpec(21, **usual), GearSpec(34, **usual), backlash="0.1 mm"),
         60.0, 50 * math.pi, ((4.0, 160), (16.0, 160))),
        ("the same, 15° helical", GearPair(GearSpec(21, **leaning), GearSpec(34, **leaning, hand="left"),
                                           backlash="0.1 mm"), 60.0, 50 * math.pi, ((4.0, 64),)),
    )  # fmt: skip
    cases = [(Steady.of_pair(name, pair, torque, speed), tries) for name, pair, torque, speed, tries in pairs]
    cases.append(
        (Steady.of_set("planetary set 24, 30, 84, sun to carrier, 1350 rpm, 50 N m"), ((16.0, 64), (64.0, 128)))
    )
    rows = []
    for steady, tries in cases:
        whole = steady.curve(np.arange(2 * POINTS) / (2 * POINTS))
        lines = np.fft.rfft(whole)
        for seconds, count in tries:
            off, lost = [], []
            for draw in range(CURVES):
                found = steady.measured(seconds, 300 + draw, harmonics=count)
                accuracy = found.curve_accuracy()
                told = accuracy.loc[accuracy["within"].idxmin()]
                taken = int(told["harmonics"])
                seen = found.mesh_cycle(points=2 * POINTS, harmonics=taken)[1]
                # where a turn has no whole number of meshes, the phase is that of one of the turns
                turns = np.arange(steady.mesh.denominator) * float(steady.mesh)
                begins = (steady.curve(np.mod(np.arange(2 * POINTS) / (2 * POINTS) + t, 1.0)) for t in turns)
                off.append(1e6 * min(float(np.abs(seen - begin).max()) for begin in begins))
                lost = sorted({*range(1, taken + 1)} - {*found.harmonics()["harmonic"]})
            kept = np.zeros(lines.size, dtype=bool)
            kept[1 : taken + 1] = True
            kept[lost] = False
            without = 1e6 * np.abs(np.fft.irfft(np.where(kept, lines, 0.0), whole.size) - whole).max()
            rows.append([
                steady.name, f"{1e6 * np.ptp(whole):.2f}", f"{seconds:g}",
                f"{taken} of {count}, {len(lost)} of them not seen",
                f"{1e6 * told['noise']:.3f} + {1e6 * told['missing']:.3f}", f"{without:.3f}",
                ", ".join(f"{value:.3f}" for value in off),
            ])  # fmt: skip
            print(rows[-1], flush=True)
    return table(
        ["", "peak to peak, µm", "s in mesh, and free", "harmonics taken", "told: noise + missing, µm",
         "of what they lack, µm", "largest difference of each record, µm"], rows
    )  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path)
    parser.add_argument("--static", action="store_true", help="only the static curves; the rest stays as it is")
    given = parser.parse_args()
    before = given.write.read_text(encoding="utf-8").split(STATIC)[0].rstrip("\n") if given.static else lengths()
    page = f"{before}\n\n{STATIC}\n\n{curves()}"
    print(page)
    if given.write is not None:
        given.write.write_text(page, encoding="utf-8")
