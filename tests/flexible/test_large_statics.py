"""Statics of slender beams far from their given shape, against the closed forms of the elastica."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipkinc

from gearmbs.dae.problem import ModelError
from gearmbs.flexible import BeamSection, ElasticMaterial, add_beam
from gearmbs.mechanism import Mechanism, quasi_static, static_equilibrium

SECTION = BeamSection.ring(ElasticMaterial(), 0.004)
"""Of a rod 1 m long: its shear moves the end by less than 1e-5 of what bending does."""


def elastica(load):
    """Return x and deflection of the end, by its length, under a force load * EI / L^2 at right angles.

    K. E. Bisshopp, D. C. Drucker, Large deflection of cantilever beams, Quart. Appl. Math. 3 (1945) 272.
    """

    def rest(slope):
        m = 0.5 * (1.0 + np.sin(slope))
        start = np.arcsin(1.0 / np.sqrt(2.0 * m))
        return ellipkinc(np.pi / 2, m) - ellipkinc(start, m) - np.sqrt(load)

    slope = brentq(rest, 1e-9, np.pi / 2 - 1e-13)
    m = 0.5 * (1.0 + np.sin(slope))
    start = np.arcsin(1.0 / np.sqrt(2.0 * m))
    part = ellipeinc(np.pi / 2, m) - ellipeinc(start, m)
    return np.sqrt(2.0 * np.sin(slope) / load), 1.0 - 2.0 / np.sqrt(load) * part


def rod(elements):
    m = Mechanism("rod")
    beam = add_beam(m, "rod", SECTION, (0, 0, 0), (1, 0, 0), elements)
    m.fixed("clamp", beam.bodies[0], m.ground, at=(0, 0, 0))
    return m, beam


def pulled(load, elements):
    m, beam = rod(elements)
    m.load("pull", beam.last, m.ground.marker(), rm=m.ground.marker(), fz=f"-{load * SECTION.bending[0]}")
    return static_equilibrium(m)


@pytest.mark.slow
@pytest.mark.parametrize("load", [0.2, 1.0, 3.0, 10.0])
def test_a_cantilever_bends_as_the_elastica(load):
    found = pulled(load, 40)
    assert found.stable
    x, y, z = found.com_position("rod.40")
    np.testing.assert_allclose([x, -z], elastica(load), rtol=1e-3)
    assert abs(y) < 1e-9
    # the reaction is the whole load
    np.testing.assert_allclose(np.linalg.norm(found.reactions["clamp"][0]), load * SECTION.bending[0], rtol=1e-6)


@pytest.mark.slow
def test_errors_fall_with_the_square_of_the_elements():
    ends = [pulled(3.0, n).com_position(f"rod.{n}")[[0, 2]] * [1, -1] for n in (10, 20, 40)]
    errors = [np.abs(end - elastica(3.0)).max() for end in ends]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    np.testing.assert_allclose((4.0 * ends[2] - ends[1]) / 3.0, elastica(3.0), atol=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize("turns", [0.25, 1.0])
def test_a_torque_at_the_end_bends_a_rod_into_a_circle(turns):
    m, beam = rod(32)
    m.load("bend", beam.last, m.ground.marker(), rm=m.ground.marker(), ty=f"{turns * 2 * np.pi * SECTION.bending[0]}")
    place = static_equilibrium(m).com_position("rod.32")
    angle = 2 * np.pi * turns
    np.testing.assert_allclose(place, [np.sin(angle) / angle, 0.0, -(1.0 - np.cos(angle)) / angle], atol=2e-3)


@pytest.mark.slow
def test_the_way_by_steps_of_time_leads_to_the_same_place():
    m, beam = rod(12)
    m.load("pull", beam.last, m.ground.marker(), rm=m.ground.marker(), fz=f"-{3.0 * SECTION.bending[0]}*TIME")
    steps = quasi_static(m, np.linspace(0.0, 1.0, 5), tol=3e-6).marker_position(beam.last)[-1]
    np.testing.assert_allclose(pulled(3.0, 12).com_position("rod.12"), steps, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pulls", "turns"])
def test_what_has_no_equilibrium_is_still_named(kind):
    """A rod on a hinge, and one that a force follows round for ever."""
    m = Mechanism("rod")
    beam = add_beam(m, "rod", SECTION, (0, 0, 0), (1, 0, 0), 4)
    if kind == "pulls":
        m.fixed("clamp", beam.bodies[0], m.ground, at=(0, 0, 0))
        m.load("pull", beam.last, m.ground.marker(), rm=m.ground.marker(), fz="1+1E6*DZ(" + beam.last.name + ")**2")
    else:
        m.revolute("hinge", beam.bodies[0], m.ground, at=(0, 0, 0), axis=(0, 0, 1))
        m.load("pull", beam.last, m.ground.marker(), rm=beam.last, fx="1")
    with pytest.raises(ModelError, match="no equilibrium"):
        static_equilibrium(m)
