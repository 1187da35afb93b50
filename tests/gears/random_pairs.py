"""Pairs of wheels at random: external ones and internal ones with 8 to 70 teeth of difference, spur and helical."""

import warnings

import numpy as np

from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec

ELASTIC = {"contact": ContactLaw.impact(damping=0.0), "friction": FlankFriction.none()}


def any_pair(rng: np.random.Generator, internal: bool, apart: float = 0.1, helices=(0, 0, 10, 20, 30)) -> GearPair:
    """Wheels with any teeth, profile shifts, addenda and backlash, up to ``apart`` modules farther than nominal.

    Raises
    ------
    ValueError
        For numbers that make no pair.
    """
    module = float(rng.choice([1, 2, 3, 5])) * 1e-3
    kind = {"helix_angle": f"{rng.choice(helices)} deg"}
    shifts = rng.uniform((-0.2, -0.6), (0.6, 0.4))
    addenda = (rng.uniform((0.7, 0.6), (1.1, 1.1)) + shifts) * module
    z1 = int(rng.integers(14, 61))
    z2 = z1 + int(rng.integers(8, 71)) if internal else int(rng.integers(14, 80))
    mate = {"internal": True} if internal else {"hand": "left"}
    one = GearSpec(z1, module, profile_shift=shifts[0], addendum=addenda[0], **kind)
    two = GearSpec(z2, module, profile_shift=shifts[1], addendum=addenda[1], **mate, **kind)
    farther, backlash = rng.uniform(-0.1, apart) * module, rng.uniform(0, 0.3e-3)
    return GearPair(one, two, centre_distance_error=farther, backlash=backlash, **ELASTIC)


def pairs(rng: np.random.Generator, count: int, internal: bool, **settings):
    """Yield so many pairs; at the end print the share of those that were refused."""
    refused = made = 0
    while made < count:
        try:
            with warnings.catch_warnings():
                # tight ones are remarked on, and belong here
                warnings.simplefilter("ignore")
                pair = any_pair(rng, internal, **settings)
        except ValueError:
            refused += 1
            continue
        made += 1
        yield pair
    print(f"{refused} of {refused + made} {'internal' if internal else 'external'} pairs were refused")
