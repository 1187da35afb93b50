"""Every class of force elements of the package: its derivatives against differences of its wrench and rates.

A new class gets a row in `ELEMENTS`: a mechanism compares the kernels of a user's own with differences, not these.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import gearmbs
from gearmbs.bearings import Bearing, RollingBearing
from gearmbs.bearings.clearance import ClearanceForce
from gearmbs.drivetrain.couplings.even_twist import EvenTwist
from gearmbs.drivetrain.torque_element import ACCOUNTS, ShaftTorque
from gearmbs.flexible import BeamSection, LargeBeam
from gearmbs.gears import ElasticRim, GearPair, IdealMesh, planetary_mechanism
from gearmbs.mechanism import Diagnostic, ForceElement, Mechanism, ModelError, constant
from gearmbs.mechanism.contacts import Coulomb, HalfSpace, Impact, Sphere
from gearmbs.mechanism.forces.functions import compare_derivatives
from gearmbs.mechanism.parts.elements import State
from tests.gears.test_elastic_ring import GEARS
from tests.mechanism.test_own_forces import exact_magnet, magnet
from tests.says import says

PACKAGE = Path(gearmbs.__file__).parent
BODY = (1.0, (1.0, 1.0, 1.0))
PAIR = GearPair.paper(backlash="0.1 mm")


def between(add, position=(0.3, 0.1, 0.2)):
    """Return what makes the element that ``add(m, i, j)`` adds as "x", between two bodies that are turned and move."""

    def made():
        m = Mechanism("two")
        a = m.body("a", *BODY, position=position, orientation=(0.4, 0.3, 0.2), velocity=(0.2, -0.1, 0.3))
        b = m.body("b", *BODY, orientation=(0.3, 0.2, 0.4), angular_velocity=(0.3, 0.2, 0.5))
        add(m, a.marker(name="i"), b.marker(name="j"))
        return m.elements["x"]

    return made


def meshing(wheels):
    """Return what makes the contact of two wheels, 50 um deep in each other."""

    def made():
        m = Mechanism("mesh")
        place = PAIR.frames(0.1, PAIR.driven_angle(0.1) + 50e-6 / PAIR.driven.base_radius)
        one = m.body("one", *BODY, position=place.origin_1, orientation=place.axes_1)
        two = m.body("two", *BODY, position=place.origin_2, orientation=place.axes_2)
        return m.add(wheels.contact_element("x", one.marker(), two.marker()))

    return made


def ring():
    return planetary_mechanism(GEARS, torques={"carrier": -200.0}, rim=ElasticRim(waves=2)).elements["ring meshes"]


def friction(m, i, j):
    joint = m.revolute("pin", i, j)
    m.friction("x", joint, 0.3, 0.2, stiction_transition_velocity=2.3, max_stiction_deformation=0.05, pin_radius=0.3)


def pump(name, i, j):
    numbers = (-1.0, 2.5e-1, 7.0, 0.1, 9.0, 3.0, 0.1, 0.1, 0.9, 0.08, -0.02)
    own = {"own_states": (State("x.z"),), "own_diagnostics": (*ACCOUNTS, Diagnostic("own", "1"))}
    return ShaftTorque(name, i, j, "pump", numbers, times=(constant(1.0),), counts_angle=True, **own)


STIFF = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 2.0]])
FULL = np.block([[10 * STIFF, STIFF], [STIFF.T, 5 * STIFF]])
SECTION = BeamSection(3e4, 20.0, (7.0, 11.0), (2e3, 3e3), 1.0, (1e-3, 1e-3, 2e-3))
SETTINGS = {"stiffness": 7.0, "damping": 1.3, "preload": 0.9}

ELEMENTS = {
    "AxisSpring": between(lambda m, i, j: m.torsion_spring("x", i, j, angle=0.4, **SETTINGS)),
    "Beam": between(
        lambda m, i, j: m.beam(
            "x", i, j, length=0.5, modulus=2e9, shear_modulus=8e8, area=1e-3, second_moments=(2e-6, 1e-6, 1e-6)
        )
    ),
    "Bushing": between(
        lambda m, i, j: m.bushing("x", i, j, stiffness=(10, 20, 30), damping=(1, 2, 3), torsional_stiffness=(4, 5, 6))
    ),
    "ClearanceForce": between(lambda m, i, j: m.add(ClearanceForce("x", i, j, (1e-4, 1e7, 1.5, 50.0, 1e-3)))),
    "EvenTwist": between(lambda m, i, j: m.add(EvenTwist("x", i, j, (40.0, 3.0, 7.0, 0.5)))),
    "Field": between(lambda m, i, j: m.field("x", i, j, stiffness=FULL, damping=0.1 * FULL, free=range(6))),
    "FrictionForce": between(friction),
    "FunctionForce": between(
        lambda m, i, j: m.force(
            "x", magnet, i, j, parameters=[2.0], derivatives=exact_magnet, diagnostics=[("energy", "J", "stored"), "n"]
        )
    ),
    "GearContact": meshing(PAIR),
    "IdealMeshForce": meshing(IdealMesh(PAIR, 4e8, 2e3)),
    "LargeBeam": between(lambda m, i, j: m.add(LargeBeam("x", i, j, 0.5, SECTION, 0.03))),
    "LineSpring": between(lambda m, i, j: m.spring_damper("x", i, j, length=0.4, **SETTINGS)),
    "RingMeshes": ring,
    "RollingBearing": between(
        lambda m, i, j: m.add(RollingBearing("x", i, j, bearing=Bearing.from_designation("6205"))), (3e-5, 2e-5, 1e-5)
    ),
    "ShaftTorque": between(lambda m, i, j: m.add(pump("x", i, j))),
    "SolidContact": between(
        lambda m, i, j: m.contact("x", i, Sphere(0.5), j, HalfSpace(), Impact(1e7, 1.5, 500.0), Coulomb(0.2, 0.1))
    ),
    "Torque": between(lambda m, i, j: m.torque("x", i, constant(5.0), axis=(1, 2, 3), reaction=j.body)),
}
"""By the name of each class of the package: what makes one that acts at the start."""


def classes(kind=ForceElement):
    """Yield all classes of force elements of the package but those from which others are derived."""
    own = [one for one in kind.__subclasses__() if one.__module__.startswith("gearmbs.")]
    for one in own:
        yield from classes(one)
    if not own:
        yield kind


def test_every_class_has_a_row():
    for path in PACKAGE.rglob("*.py"):
        if "ForceElement" in path.read_text(encoding="utf-8"):
            import_module(".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"))
    assert sorted(one.__name__ for one in classes()) == sorted(ELEMENTS)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name == "FunctionForce")) for name in ELEMENTS]
)
def test_derivatives_of_every_class(name):
    element = ELEMENTS[name]()
    assert type(element).__name__ == name
    made = element.compiled()
    compare_derivatives(element, made)

    def wrong(*arguments):
        made.kernel(*arguments)
        arguments[-2][:] *= 1.01

    with pytest.raises(ModelError, match=says(f"'{element.name}'", "jac[", "differences")):
        compare_derivatives(element, replace(made, kernel=wrong))
