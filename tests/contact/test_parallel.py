"""The lean form of wheels on fixed parallel axes against the general one: wrench, derivatives, diagnostics."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from gearmbs.contact import layout as L
from gearmbs.contact.parallel import derived as D
from gearmbs.contact.parallel.kernel import corner_at, parallel_at, parallel_axes, parallel_contact
from gearmbs.contact.records import pair_at
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec
from gearmbs.gears.faults import Eccentricity

from .probe_tools import Contact, moved, rotation

PAIRS = {
    "paper": GearPair.paper(backlash="0.1 mm"),
    "driven the other way": GearPair.paper(rotation=-1, backlash="0.1 mm"),
    "+3 mm": GearPair.paper(centre_distance_error="3 mm"),
    "rounded tips": GearPair.paper(driver=GearSpec(29, 95e-3 / 31, tip_rounding="0.3 mm"), backlash="0.1 mm"),
    "few teeth": GearPair(GearSpec(17, "2 mm"), GearSpec(38, "2 mm"), backlash="0.1 mm"),
    "jammed": GearPair.paper(backlash="5 um", centre_distance_error="-20 um"),
    "Hunt-Crossley, smooth friction": GearPair.paper(
        backlash="0.1 mm", contact=ContactLaw.hunt_crossley(), friction=FlankFriction(kind="smooth")
    ),
    "Kuwabara and Kono": GearPair.paper(
        contact=replace(ContactLaw.hunt_crossley(), kind="kuwabara-kono", damping=1e-4), backlash="0.1 mm"
    ),
    "no friction": GearPair.paper(friction=FlankFriction.none(), backlash="0.1 mm"),
}


class Both:
    """The two kernels of a pair whose wheels turn from a start about their axes."""

    def __init__(self, pair, rng, sense=(1.0, 1.0)) -> None:
        self.general = Contact(pair, 1)
        start = self.general.state(0.3, 0.0)
        start[4] = start[4] + 1e-3 * start[1][:, 2]
        self.start = moved(start, rotation(rng.normal(size=3)), rng.normal(size=3))
        self.axes = np.array([[self.start[k], s * self.start[k + 1][:, 2]] for k, s in zip((0, 4), sense)])
        frames = np.array([[*self.start[k], *self.start[k + 1].ravel(), *np.zeros(6)] for k in (0, 4)])
        self.own = parallel_axes(self.general.gi, self.general.gr, frames, self.axes)

    def __call__(self, turns):
        """Return (wrench, slopes, diagnostics) of the lean kernel, and of the general one."""
        ints = np.concatenate([np.zeros(1, dtype=np.int64), self.general.gi])
        lean = np.zeros(6), np.zeros((6, 4)), np.zeros(8)
        wrench, slopes, told = lean
        turns = np.array(turns)
        parallel_contact(ints, self.general.gr, self.own, turns, 1, np.zeros(32), wrench, slopes, told)
        alone = np.zeros(6)
        parallel_contact(ints, self.general.gr, self.own, turns, 0, np.zeros(32), alone, slopes, np.zeros(8))
        assert (alone == wrench).all()
        state = list(self.start)
        for k, axis in enumerate(self.axes[:, 1]):
            state[4 * k + 1] = rotation(turns[k] * axis) @ self.start[4 * k + 1]
            state[4 * k + 3] = turns[2 + k] * axis
        force = self.general(state, 1)
        along = [self.general.jac[:, at : at + 3] @ n for at in (3, 9) for at, n in zip((at, 12 + at), self.axes[:, 1])]
        return lean, (force, np.array(along).T, self.general.diag.copy())

    def grazes(self, turns):
        """Return whether a tooth pair comes or goes within 0.1 um."""
        counts = [self((turns[0], turns[1] + shift, *turns[2:]))[0][2][5:7] for shift in (-1e-6, 1e-6)]
        return bool((counts[0] != counts[1]).any())


def positions(pair, rng, sense):
    """Return turns and rates: light and deep contact on the drive flanks, none, contact on the coast flanks."""
    base = [wheel.base_radius for wheel in pair.wheels]
    for depth in (10e-6, 25e-6, 80e-6, 600e-6, -0.5 * pair.normal_backlash, -pair.normal_backlash - 20e-6):
        for _ in range(12):
            turn = rng.uniform(-9.0, 9.0)
            mate = (-turn * base[0] + pair.rotation * depth) / base[1]
            spin, slip = rng.uniform(-300.0, 300.0), rng.normal(scale=2.0)
            rates = (spin, -spin * base[0] / base[1] + slip)
            yield turn * sense[0], mate * sense[1], rates[0] * sense[0], rates[1] * sense[1]


@pytest.mark.parametrize("name", PAIRS)
def test_lean_and_general_form_agree(name):
    pair, rng = PAIRS[name], np.random.default_rng(5)
    sense = (1.0, -1.0) if name == "paper" else (1.0, 1.0)
    both = Both(pair, rng, sense)
    turns = [turns for turns in positions(pair, rng, sense) if not both.grazes(turns)]
    found = [both(one) for one in turns]
    wrench, slopes, told = (np.array(part) for part in zip(*(lean for lean, _ in found)))
    force, along, said = (np.array(part) for part in zip(*(general for _, general in found)))
    assert (np.abs(told - said) <= 1e-10 * np.abs(said).max(axis=0)).all()
    # an indentation is a difference of places as far as this from the origin, and is known to their rounding
    place = 4.0 * np.finfo(float).eps * max(np.abs(both.start[0]).max(), np.abs(both.start[4]).max())
    angle = place / min(wheel.base_radius for wheel in pair.wheels)
    for part in (slice(0, 3), slice(3, 6)):
        largest = np.abs(force[:, part]).max(axis=1, keepdims=True)
        rounding = angle * np.abs(along[:, part]).max(axis=(1, 2))[:, None]
        assert (np.abs(wrench[:, part] - force[:, part]) <= 1e-10 * largest + rounding).all()
        # elastic and damping parts of a slope may cancel: as parts of the largest one
        largest = np.abs(along[:, part]).max(axis=(0, 1))
        assert (np.abs(slopes[:, part] - along[:, part]) <= 1e-10 * largest).all()
    drive, coast = told[:, 5:7].T
    assert min(drive.max(), coast.max()) >= (1.0 if name == "+3 mm" else 2.0)
    if name == "jammed":
        assert (np.minimum(drive, coast) > 0.0).any()
    else:
        assert (drive + coast == 0.0).any()


STEP = 1e-30


def plain(name, *arguments):
    """Call a generated kernel as a function of Python, so that numbers may be complex."""
    return getattr(D, name).py_func(*arguments)


@pytest.mark.parametrize("wheel", [1, 2])
@pytest.mark.parametrize("kind", ["corner", "behind", "plane"])
def test_derivatives_of_contacts_by_complex_steps(kind, wheel):
    a, base, radius, rounding = 0.0889, 0.0417, 0.0461, 1e-4
    eta, start, before = -0.02, -0.06, 0.003

    def row(eta, start, a, slopes=""):
        out = np.zeros(17, dtype=complex)
        own = np.sin(eta), np.cos(eta), radius, rounding
        if kind == "plane":
            turned = start - before
            beside = 1.0 - before * base
            plain(f"plane_{wheel}{slopes}", a, np.sin(turned), np.cos(turned), base, beside, before, 1.0, *own, out)
            return out, -turned
        alpha = 0.3 + 0j
        for _ in range(12):
            still = a * np.cos(alpha) - radius * np.cos(alpha + eta) - base
            alpha += still / (a * np.sin(alpha) - radius * np.sin(alpha + eta))
        tip, bend = (0.0, 0.0) if kind == "corner" else (0.0065, 4e3)
        plain(f"corner_{wheel}{slopes}", a, alpha, np.sin(alpha), np.cos(alpha), start, base, tip, bend, *own, out)
        return out, alpha

    told = row(eta, start, a)[0].real
    bends = row(eta, start, a, "_slopes")[0].real[7:].reshape(5, 2)
    steps = [(1j * STEP, 0.0, 0.0), (0.0, 1j * STEP, 0.0)]
    for k, step in enumerate([(0.0, 0.0, 1j * STEP), *(steps if wheel == 1 else steps[::-1])]):
        moved, alpha = row(*(x + dx for x, dx in zip((eta, start, a), step)))
        assert told[1 + k] == pytest.approx(moved[0].imag / STEP, rel=1e-10, abs=1e-12)
        if k > 0:
            exact = np.array([alpha, *moved[[1, 2, 3, 6]]]).imag / STEP
            assert bends[:, k - 1] == pytest.approx(exact, rel=1e-10, abs=1e-12)


def test_derivatives_of_a_wrench_by_complex_steps():
    rng = np.random.default_rng(2)
    a, force, ratio, stiffness, damping, ratio_slope = 0.0889, 500.0, 0.3, 2e7, 3e3, -0.8
    rates = np.array([104.0, -97.0])
    contact = np.array([-1e-5, 0.35, -0.041, -0.042, 0.36, 0.93, 0.02, *rng.normal(size=10)])
    contact[7:9] *= 0.1
    slopes = np.zeros(15)
    plain("contact_slopes", a, force, stiffness, damping, ratio, ratio_slope, *rates, contact, slopes)
    approach, speed = plain("contact_rates", a, *rates, contact)
    for k in range(4):
        row, turning = contact.astype(complex), rates.astype(complex)
        if k < 2:
            by = contact[7:].reshape(5, 2)[:, k]
            change = [contact[2 + k], *by[1:4], contact[5] * by[0], -contact[4] * by[0], by[4]]
            row[:7] += 1j * STEP * np.array(change)
        else:
            turning[k - 2] += 1j * STEP
        nearer, sliding = plain("contact_rates", a, *turning, row)
        pressed = force - stiffness * (row[0] - contact[0]) - damping * (nearer - approach)
        friction = ratio + ratio_slope * speed * (sliding - speed)
        wrench = np.zeros(3, dtype=complex)
        plain("contact_wrench", a, pressed, friction, *turning, row, wrench)
        assert slopes[3 + k :: 4] == pytest.approx(wrench.imag / STEP, rel=1e-10)


def test_what_the_lean_form_is_not_for():
    rng = np.random.default_rng(1)
    assert Both(GearPair.paper(), rng).own is not None
    for pair in (
        GearPair.paper(faults=[Eccentricity()]),
        GearPair.paper(stiffness_curve="potential-energy"),
        GearPair(GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm"), backlash="0.2 mm"),
        GearPair.paper(misalignment="1 deg"),
    ):
        assert Both(pair, rng).own is None


def test_counts_of_references_are_behind_a_call_what_they_were_before():
    """Kernels that count none hold nothing and let nothing go."""
    both = Both(PAIRS["paper"], np.random.default_rng(0))
    general, handed = both.general, [np.zeros(6), np.zeros((6, 4)), np.zeros(8)]
    ints = np.concatenate([np.zeros(1, dtype=np.int64), general.gi])
    handed += [general.gi, general.gr, general.work, general.jac, general.diag, ints, both.own, *both.start]
    before = [sys.getrefcount(one) for one in handed]
    for _ in range(3):
        parallel_contact(ints, general.gr, both.own, np.zeros(4), 1, np.zeros(32), *handed[:3])
        general(both.start, 1)
    assert [sys.getrefcount(one) for one in handed] == before


@njit
def _corner(reals, own, first, roll_1, roll_2, contact):
    corner_at(pair_at(reals), parallel_at(own), first, roll_1, roll_2, contact, 0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "+3 mm", "rounded tips", "few teeth"])
def test_corners_are_left_out_by_a_bound_of_their_gaps(name):
    both = Both(PAIRS[name], np.random.default_rng(2))
    own, table = both.own.view(L.PARALLEL)[0], both.general.gr[: L.PAIR.itemsize // 8].view(L.PAIR)[0]
    assert own["curve"] > 0.9 * table["corner_bound"]
    contact = np.zeros(17)
    for first, wheel in ((True, "wheel_1"), (False, "wheel_2")):
        for gap in (-1e-8, -1e-5, -1e-4, -6e-4):
            for over in np.geomspace(1e-5, table["corner_reach"] - table["pitch"], 100):
                roll = table[wheel]["tip_roll"] + over
                rolls = (roll, own["length"] - gap - roll)
                _corner(both.general.gr, both.own, first, *(rolls if first else rolls[::-1]), contact)
                if contact[0] - gap < own["shallow"]:
                    assert contact[0] > gap + own["curve"] * over**2
