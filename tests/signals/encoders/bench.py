"""A test bench that is exact: two shafts whose transmission error is known, and encoders on them."""

import functools
import math

import numpy as np
import scipy.interpolate
import xarray as xr

from gearmbs.gears import GearPair
from gearmbs.gears.transmission import loaded_transmission_error
from gearmbs.signals import CoupledRun, encoder, mark_errors

COUNTER = {"clock": "50 ns", "jitter": "50 ns"}


@functools.cache
def paper_error(torque=100.0):
    """Loaded transmission error of the paper's pair, and the driver's base radius."""
    pair = GearPair.paper(backlash="0.1 mm")
    return loaded_transmission_error(pair, torque=torque, points=400), pair.geometry.driver.base_radius


def closed(error):
    """A curve over one mesh cycle, as a function of the cycle."""
    phase = np.arange(error.size + 1) / error.size
    spline = scipy.interpolate.CubicSpline(phase, np.append(error, error[0]), bc_type="periodic")
    return lambda cycle: spline(np.mod(cycle, 1.0))


def angle(values, times):
    return xr.DataArray(values, dims=("time",), coords={"time": times}, attrs={"units": "rad"})


def coupled(error, teeth, radius, turns=20, speed=100.0, rate=40e3):
    """Angles of both shafts for a lag error(driver's turns), m, at constant speed of the driver."""
    times = np.arange(round(turns * math.tau / speed * rate)) / rate
    driver = speed * times
    driven = (driver - error(driver / math.tau) / radius) * teeth[0] / teeth[1]
    return angle(driver, times), angle(driven, times)


def free(speed=100.0, braking=1.0, seconds=0.8, rate=20e3):
    """Angle of a shaft that runs down freely."""
    times = np.arange(round(seconds * rate)) / rate
    return angle(speed * times - braking * times**2, times)


class Discs:
    """Discs of both shafts, with their errors: pulses of coupled and of free runs."""

    def __init__(self, lines=1024, error=0.01, seed=0, **counter):
        self.lines, self.seed = lines, seed
        self.marks = [mark_errors(lines, error, 2 * seed + k) for k in (0, 1)]
        self.counter = {**COUNTER, **counter}

    def pulses(self, shaft, turned, run=0, mounted=None):
        """The driver's disc lacks a mark, the driven one has an index."""
        how = {"lacking": [0]} if shaft == 0 else {"index": True}
        return encoder(
            turned, self.lines, marks=self.marks[shaft], name=("driver", "driven")[shaft],
            seed=1000 + 10 * self.seed + 2 * run + shaft, mounted=0.3 * shaft if mounted is None else mounted,
            **how, **self.counter,
        )  # fmt: skip

    def run(self, angles, run=0, **told):
        return CoupledRun(*(self.pulses(k, angles[k], run) for k in (0, 1)), **told)

    def free(self, run=1, seconds=0.8):
        return {name: self.pulses(k, free(seconds=seconds), run) for k, name in enumerate(("driver", "driven"))}
