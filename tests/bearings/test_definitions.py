"""Generated kernels of rolling elements against the laws, computed with numbers that carry derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearmbs.bearings import BearingError, definitions
from gearmbs.bearings import layout as B
from gearmbs.bearings.parameters_kernel import bearing_force_changed
from gearmbs.bearings.settings import pack, reals_by
from tests.bearings.probe import Probe
from tests.bearings.test_derivatives import CASES
from tests.jets import Jet, jets

CLOSE = 1e-10
WITHOUT = [name for name in CASES if "centrifugal" not in name]
"""Where elements have no centrifugal load a law is a formula."""
HELD = {
    B.CAGE,
    B.SPIN,
    B.EXPONENT,
    B.SLIP_TURNS,
    *range(B.INNER_AXIS, B.INNER_AXIS + 3),
    B.OUTER_TILT,
    B.OUTER_TILT + 1,
}
"""Reals on which forces at given coordinates and rates do not hang, and the exponent."""


def profile(reals, at, row, nodes, angle):
    """Return a spline at an angle."""
    if nodes == 0 or row < 0:
        return 0.0
    (k, part), scale = B.place_of(nodes, angle.value), nodes / (2.0 * np.pi)
    place = Jet(part, scale * angle.gradient, scale * angle.hessian)
    return B.profile_value.py_func(reals, at + row * (nodes + 3), k, place)


def missing(tables, reals, q, theta, j, path):
    ints, paths = tables.integers, tables.integers[B.PATHS]
    spin = ints[B.INTEGERS + 2 * paths + j]
    total = profile(reals, ints[B.AT_OUTER], ints[B.INTEGERS + path], ints[B.OUTER_NODES], theta)
    inner = ints[B.INTEGERS + paths + path]
    total += profile(reals, ints[B.AT_INNER], inner, ints[B.INNER_NODES], theta - q[B.THETA])
    if spin >= 0:
        total += profile(reals, ints[B.AT_SPIN], spin, ints[B.SPIN_NODES], q[B.BETA + spin])
    return total - reals[ints[B.AT_ELEMENTS] + B.ELEMENT_COLUMNS * j + B.ELEMENT_OVERSIZE]


def deflection(tables, reals, q, j, path):
    """Return delta, and the stiffness of the path."""
    ints = tables.integers
    theta = q[B.PSI] + tables.reals[ints[B.AT_ELEMENTS] + B.ELEMENT_COLUMNS * j + B.ELEMENT_PLACE]
    radial, axial, radius, height, share, gap = (reals[ints[B.AT_PATHS] + B.PATH_COLUMNS * path + k] for k in range(6))
    plane = definitions.in_plane(*q[:5], np.cos(theta), np.sin(theta))
    h = missing(tables, reals, q, theta, j, path)
    if ints[B.KIND] == B.BALL:
        approach = definitions.ball_approach(
            *definitions.groove_centres(*plane, radial, axial, radius, height), reals[B.DISTANCE]
        )
    else:
        x, y = definitions.groove_centres(*plane, 0.0, 0.0, radius, height)
        approach = definitions.roller_approach(x, y, radial, axial, gap)
    return approach - h, share * reals[B.STIFFNESS]


def by_jets(tables, motion, spins, changed):
    """Return the generalised forces and the sum of the normal forces, with derivatives by q, q' and along a change."""
    n = B.BETA + len(tables.spinning)
    *variables, step = jets([*motion, *spins, 0.0])
    q, rates = variables[:n], variables[n:]
    reals = [value + step * change if change else value for value, change in zip(tables.reals, changed)]
    total = [step * 0.0] * (n + 1)
    for j in range(tables.integers[B.ELEMENTS]):
        for path in range(tables.integers[B.PATHS]):
            delta, stiffness = deflection(tables, reals, q, j, path)
            width = reals[B.SMOOTH]
            if delta.value <= -Jet.as_jet(step, width).value:
                continue
            part = delta if delta.value >= Jet.as_jet(step, width).value else definitions.transition(delta, width)
            slopes = [delta.slope(k) for k in range(n)]
            rate = sum((slope * one for slope, one in zip(slopes, rates)), 0.0)
            force = definitions.hertz(stiffness, tables.reals[B.EXPONENT], part)
            pressed = definitions.damped(force, reals[B.DAMPING], rate)
            if pressed.value > 0.0:
                for k, slope in enumerate(slopes):
                    total[k] = total[k] - pressed * slope
                total[n] = total[n] + pressed
    return np.array([one.value for one in total]), np.array([one.gradient for one in total])


def some_change(tables, rng):
    """Return a change of all reals on which forces hang at given coordinates and rates."""
    changed = tables.reals * rng.normal(size=tables.reals.size)
    changed[list(HELD)] = 0.0
    ints, elements = tables.integers, tables.integers[B.AT_ELEMENTS]
    if ints[B.SLIP_NODES]:
        changed[ints[B.AT_SLIP] :] = 0.0
    paths = changed[ints[B.AT_PATHS] : elements].reshape(-1, B.PATH_COLUMNS)
    if ints[B.KIND] == B.ROLLER:
        # the normal keeps its length
        normals = tables.reals[ints[B.AT_PATHS] : elements].reshape(-1, B.PATH_COLUMNS)[:, :2]
        paths[:, :2] = rng.normal(size=(len(paths), 1)) * normals[:, ::-1] * (-1.0, 1.0)
    table = changed[elements : elements + B.ELEMENT_COLUMNS * ints[B.ELEMENTS]].reshape(-1, B.ELEMENT_COLUMNS)
    table[:, [B.ELEMENT_COSINE, B.ELEMENT_SINE, B.ELEMENT_PLACE]] = 0.0
    return changed


def coordinates(probe):
    """Return q and q' as the kernel has found them."""
    work, states = probe.work, probe.states
    q = [*work[B.S_MOTION : B.S_MOTION + 5], states[0], work[B.S_THETA], *states[1:]]
    rates = work[B.S_RATES : B.S_RATES + 8]
    return q, [*rates[:7], *[rates[7]] * (states.size - 1)]


@pytest.mark.parametrize("name", WITHOUT)
def test_forces_and_derivatives(name):
    bearing, settings = CASES[name]
    probe, rng = Probe(bearing, **settings), np.random.default_rng(7)
    reals = probe.tables.reals
    probe.shaken(rng, 2e-5, 3e-4, 300.0)
    probe()
    q, rates = coordinates(probe)
    changed = some_change(probe.tables, rng)
    value, slopes = by_jets(probe.tables, q, rates, changed)
    n = len(q)
    first = B.S_LOCAL + n + 1
    found = [
        probe.work[B.S_LOCAL : first],
        probe.work[first : first + (n + 1) * n].reshape(n + 1, n),
        probe.work[first + (n + 1) * n : first + 2 * (n + 1) * n].reshape(n + 1, n),
    ]
    bearing_force_changed(
        probe.tables.integers, reals, changed, probe.frames, probe.states, probe.work,
        np.zeros(6 + probe.states.size),
    )  # fmt: skip
    at = B.variations(n) + 2 * n
    found = [*(part.copy() for part in found), probe.work[at : at + n + 1]]
    for told, exact in zip(found, (value, slopes[:, :n], slopes[:, n : 2 * n], slopes[:, -1])):
        for row, right in zip(told, exact):
            # a moment that a bearing has not, as self-aligning ones, is what rounding leaves of forces at their arms
            least = n * np.finfo(float).eps * abs(np.asarray(exact)).max()
            assert row == pytest.approx(right, abs=CLOSE * abs(right).max() + least)


SETTINGS = {
    "all defects": ("stiffness", "damping", "pitch_diameter", "rolling_friction"),
    "friction": ("viscous_friction", "slow_speed", "element_diameter"),
    "smooth": ("smooth",),
    "other sense": ("preload", "cage_slip", "contact_angle", "clearance"),
    "four point": ("outer_curvature",),
    "tapered": ("stiffness", "preload", "roller_length", "clearance"),
    "random slip": ("slip_scatter",),
}


@pytest.mark.parametrize(("case", "parameter"), [(case, name) for case, names in SETTINGS.items() for name in names])
def test_wrench_by_parameter_against_differences(case, parameter):
    bearing, settings = CASES[case]
    probe = Probe(bearing.changed(clearance="3 um"), **settings)
    probe.shaken(np.random.default_rng(5), 2e-5, 3e-4, 300.0)
    element, own = probe.element, probe.element.settings
    exact = element.by_parameter(parameter, probe.frames, probe.states)
    holder = own if hasattr(own, parameter) else own.bearing
    value = element.bearing.stiffness if parameter == "stiffness" else getattr(holder, parameter)
    near, h = 0.0, 1e-4 * value
    for shift, weight in ((1, 8.0), (-1, -8.0), (2, -1.0), (-2, 1.0)):
        change = {parameter: value + shift * h}
        probe.tables = pack(
            replace(own, **change) if holder is own else replace(own, bearing=own.bearing.changed(**change))
        )
        near = near + weight * probe(want=0)[0] / (12.0 * h)
    whole = abs(probe(want=0)[0] / value)
    for part in (slice(0, 3), slice(3, 6), slice(6, None)):
        assert exact[part] == pytest.approx(near[part], abs=1e-6 * abs(near[part]).max() + 1e-10 * whole[part].max())


def test_tables_by_a_parameter():
    """Half of the clearance is taken from the distance of the groove centres, and from nothing else."""
    probe = Probe(CASES["other sense"][0].changed(clearance="10 um"))
    slopes = reals_by(probe.element.settings, "clearance")
    at = probe.tables.integers[B.AT_PATHS] + B.PATH_RADIAL
    assert slopes[at] == pytest.approx(-0.5, abs=1e-9)
    slopes[at] = 0.0
    assert abs(slopes).max() < 1e-9


def test_parameters_that_have_no_derivative():
    frames, states = np.zeros((2, 18)), np.zeros(1)
    bearing, settings = CASES["random slip"]
    element = Probe(bearing, **settings).element
    with pytest.raises(BearingError, match=r"slip_memory.*0\.3"):
        element.by_parameter("slip_memory", frames, states)
    with pytest.raises(BearingError, match=r"'slices'.*clearance"):
        element.by_parameter("slices", frames, states)
    with pytest.raises(BearingError, match=r"'b'.*centrifugal"):
        Probe(*CASES["centrifugal"][:1], centrifugal=True).element.by_parameter("damping", frames, states)
