"""Shafts by sections: published and closed-form frequencies, critical speeds, whirl, unbalance."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from gearmbs.flexible import (
    Disc,
    ElasticMaterial,
    FlexibleError,
    Rotor,
    Shaft,
    ShaftSection,
    Support,
    shear_coefficient,
)
from tests.generators import cases, seed
from tests.says import says

RPM = np.pi / 30
PINNED = 1e15


def friswell(kind: str = "lateral", elements: int = 48) -> Rotor:
    """Friswell, Penny, Garvey, Lees, Dynamics of Rotating Machines, example 5.9.1."""
    material = ElasticMaterial(2.11e11, 2.11 / (2 * 0.812) - 1, 7810, shear_modulus=8.12e10)
    discs = [Disc(0.5, outer=0.28, width=0.07, inner=0.05), Disc(1.0, outer=0.35, width=0.07, inner=0.05)]
    shaft = Shaft([ShaftSection(1.5, 0.05)], discs, {"A": 0.0, "B": 1.5}, material, elements)
    return Rotor(shaft, [Support("A", 1e6), Support("B", 1e6)], kind)


def plain(elements: int) -> Rotor:
    """A round bar between pins: 1 m long, 0.1 m thick."""
    shaft = Shaft([ShaftSection(1.0, 0.1)], (), {"A": 0.0, "B": 1.0}, ElasticMaterial(2.11e11, 0.3, 7810), elements)
    return Rotor(shaft, [Support("A", PINNED), Support("B", PINNED)])


@pytest.mark.slow
def test_example_of_friswell_at_rest_and_at_4000_rpm():
    """Rows of ROSS 2.3.0 with 48 elements; the book prints 86.66, 274.31, 716.78 and 85.39, 87.80, 251.78, 294.71."""
    rest = friswell().modes(0.0, 6).frequencies
    np.testing.assert_allclose(rest[::2], [86.658, 274.307, 716.565], rtol=1e-5)
    np.testing.assert_allclose(rest[1::2], rest[::2], rtol=1e-8)
    turning = friswell().modes("4000 rpm", 5)
    np.testing.assert_allclose(turning.frequencies, [85.389, 87.796, 251.781, 294.706, 600.082], rtol=1e-5)
    assert turning.directions == ["backward", "forward", "backward", "forward", "backward"]
    np.testing.assert_allclose(turning.damping_ratios, 0.0, atol=1e-9)
    np.testing.assert_allclose(friswell("torsional").modes(0.0, 1).frequencies, [650.407], rtol=1e-5)
    # with the book's six elements its printed numbers come out to their last digit
    coarse = friswell(elements=6)
    np.testing.assert_allclose(coarse.modes(0.0, 6).frequencies[::2], [86.66, 274.31, 716.78], atol=0.005)
    printed = [85.39, 87.80, 251.78, 294.71, 600.18]
    np.testing.assert_allclose(coarse.modes("4000 rpm", 5).frequencies, printed, atol=0.005)


@pytest.mark.slow
def test_critical_speeds_of_friswell_are_where_whirl_meets_the_speed():
    rotor = friswell()
    found = rotor.critical_speeds(5)
    np.testing.assert_allclose(found / RPM, [825.13, 829.87, 2487.7, 2756.0, 5378.9], rtol=1e-5)
    for speed in found:
        assert np.abs(rotor.modes(speed, 6).frequencies / speed - 1).min() < 1e-7
    response = rotor.unbalance_response(found[1] * np.array([0.9, 0.999, 1.1]), {0.5: 1e-4})
    peak = response.major_axis(0.5)
    assert peak[1] > 50 * max(peak[0], peak[2])


def test_timoshenko_beam_between_pins_converges_to_the_closed_form():
    """Timoshenko's bar with kappa of Cowper: 201.694, 780.091, 1669.414, 2792.946 Hz."""
    exact = np.array([201.694, 780.091, 1669.414, 2792.946])
    assert shear_coefficient(0.3) == pytest.approx(0.88636, abs=5e-6)
    rows = {
        8: [201.720, 781.565, 1683.5, 2857.2],
        16: [201.700, 780.43, 1672.7, 2807.9],
        32: [201.695, 780.17, 1670.2, 2796.6],
    }
    errors = []
    for elements, expected in rows.items():
        found = plain(elements).modes(0.0, 8).frequencies[::2] / (2 * np.pi)
        np.testing.assert_allclose(found, expected, rtol=4e-5)
        errors.append(found / exact - 1)
    assert np.all(np.array(errors) > 0)
    np.testing.assert_array_less(3.5, errors[0][1:] / errors[1][1:])


def test_whirl_of_a_bar_splits_at_10000_rpm():
    pair = plain(32).modes("10000 rpm", 2)
    np.testing.assert_allclose(pair.frequencies / (2 * np.pi), [200.710, 202.683], rtol=1e-5)
    assert pair.directions == ["backward", "forward"]


def test_jeffcott_rotor_and_its_unbalance():
    """A heavy disc at mid-span of a light shaft: k = 48 E I / l^3, and the closed response to an unbalance."""
    light = ElasticMaterial(2.1e11, 0.3, 1e-3, shear_modulus=1e20)
    disc = Disc(0.5, mass=10.0, polar=0.0, diametral=0.0)
    shaft = Shaft([ShaftSection(1.0, 0.02)], [disc], {"A": 0.0, "mid": 0.5, "B": 1.0}, light, 8)
    bearings = [Support("A", PINNED), Support("B", PINNED)]
    k = 48 * 2.1e11 * np.pi / 64 * 0.02**4
    assert k == pytest.approx(79168, abs=1)
    omega = np.sqrt(k / 10.0)
    np.testing.assert_allclose(Rotor(shaft, bearings).critical_speeds(1) / RPM, [849.66], rtol=1e-5)
    c = 2 * 0.05 * 10.0 * omega
    rotor = Rotor(shaft, [*bearings, Support("mid", damping=c)])
    speeds = omega * np.array([0.3, 1.0, 2.0])
    r = speeds / omega
    expected = 1e-3 * r**2 / np.abs(1 - r**2 + 2j * 0.05 * r)
    np.testing.assert_allclose(rotor.unbalance_response(speeds, {0.5: 1e-2}).major_axis(0.5), expected, rtol=1e-5)
    np.testing.assert_allclose(rotor.modes(0.0, 1).damping_ratios, [0.05], rtol=1e-5)


def test_unequal_bearings_give_planar_modes_at_rest_and_backward_orbits_between_them():
    shaft = friswell().shaft
    rotor = Rotor(shaft, [Support("A", (1e6, 2e6)), Support("B", (1e6, 2e6))])
    rest = rotor.modes(0.0, 2)
    assert rest.directions == ["planar", "planar"]
    assert rest.frequencies[1] > 1.01 * rest.frequencies[0]
    between = rest.frequencies.mean()
    shape = rotor.unbalance_response([between], {0.5: 1e-4}).displacements[0, 16, :2]
    assert (np.conj(shape[0]) * shape[1]).imag > 0


@pytest.mark.slow
def test_campbell_table():
    table = friswell().campbell([0.0, "2000 rpm", "4000 rpm"], 4)
    assert table.frequencies.shape == (3, 4)
    np.testing.assert_allclose(table.frequencies[2], [85.389, 87.796, 251.781, 294.706], rtol=1e-5)
    assert list(table.directions[2]) == ["backward", "forward"] * 2
    # at rest any orbit of a pair is a mode
    assert list(table.directions[0]) == ["planar"] * 4
    assert repr(table).splitlines()[3].split()[:3] == ["4000", "13.5901", "b"]


@pytest.mark.slow
def test_masses_of_sections_cones_and_discs():
    tube = Shaft(
        [ShaftSection("0.3 m", "60 mm", "20 mm"), ShaftSection(0.2, 0.06, 0.02, outer_end=0.03, inner_end=0.02)],
        [Disc(0.1, outer=0.2, width=0.02, inner=0.06)],
        elements=100,
    )
    found = tube.model().mass_properties()
    rho = 7850.0
    cylinder = rho * np.pi / 4 * (0.06**2 - 0.02**2) * 0.3
    cone = rho * np.pi / 12 * (0.06**2 + 0.06 * 0.03 + 0.03**2) * 0.2 - rho * np.pi / 4 * 0.02**2 * 0.2
    disc = rho * np.pi / 4 * (0.2**2 - 0.06**2) * 0.02
    np.testing.assert_allclose(found.mass, cylinder + cone + disc, rtol=1e-4)
    one = Shaft([ShaftSection(1.0, 0.1)]).model().mass_properties()
    m = rho * np.pi / 4 * 0.01
    across = m * (1 / 12 + 0.05**2 / 4)
    np.testing.assert_allclose(one.inertia, np.diag([across, across, m * 0.05**2 / 2]), atol=1e-12)
    np.testing.assert_allclose(one.com, [0, 0, 0.5], atol=1e-12)


def two_discs(kind, *supports):
    discs = [Disc(at, mass=5.0, polar=2 * j, diametral=j) for at, j in ((0.0, 0.025), (0.5, 0.05))]
    return Rotor(Shaft([ShaftSection(0.5, 0.03)], discs, {"A": 0.0, "B": 0.5}), supports, kind)


@pytest.mark.parametrize("kind", ["torsional", "axial"])
def test_free_rotors_are_critical_at_their_frequencies(kind):
    """What does not turn with the whirl has no gyroscopic moments, and rigid motions are no critical speeds."""
    rotor = two_discs(kind)
    frequencies = rotor.modes(0.0, 3).frequencies
    np.testing.assert_allclose(rotor.critical_speeds(3), frequencies, rtol=1e-6)
    np.testing.assert_allclose(rotor.critical_speeds(3, order=2.0), frequencies / 2, rtol=1e-6)
    with pytest.raises(FlexibleError, match=says("order", "-1.0", "give")):
        rotor.critical_speeds(order=-1.0)


@pytest.mark.parametrize("supports", [(), (Support("A", 1e8),), (Support("A", PINNED),)])
def test_critical_speeds_of_rotors_with_rigid_motions_are_where_whirl_meets_the_speed(supports):
    rotor = two_discs("lateral", *supports)
    found = rotor.critical_speeds(3)
    assert len(found) == 3
    for speed in found:
        assert np.abs(rotor.modes(speed, 8).frequencies / speed - 1.0).min() < 1e-6


@pytest.mark.parametrize("stiffness", [1e9, 1e12, PINNED])
def test_slow_modes_on_stiff_supports_are_there(stiffness):
    shaft = Shaft([ShaftSection(6.0, 0.02)], (), {"A": 0.0, "B": 6.0})
    rotor = Rotor(shaft, [Support("A", stiffness), Support("B", stiffness)])
    slowest = (np.pi / 6.0) ** 2 * 0.005 * np.sqrt(2.1e11 / 7850.0)
    np.testing.assert_allclose(rotor.modes(0.0, 2).frequencies, slowest, rtol=1e-4)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ShaftSection(0.0, 0.1), "length is 0.0 m"),
        (lambda: ShaftSection(1.0, 0.1, 0.2), "bore 0.2 m in 0.1 m"),
        (lambda: ShaftSection("3 kg", 0.1), "ShaftSection.length"),
        (lambda: ShaftSection(500, 30), says("length", "500 m", "outer", "30 m", "plain")),
        (lambda: Disc(0.1, outer=200, width="20 mm"), says("outer", "200 m", "plain")),
        (lambda: Support("A", float("nan")), says("support", "stiffness", "nan", "give", "N/m")),
        (lambda: Support("A", 1e8, damping=(np.inf, 1.0)), says("damping", "inf", "give", "N*s/m")),
        (lambda: Shaft([]), "no sections"),
        (lambda: Shaft([ShaftSection(1.0, 0.1)], seats={"A": 1.2}), "seat 'A' is at 1.2 m"),
        (lambda: Disc(0.1, outer=0.2), "give outer and width"),
        (lambda: ElasticMaterial(poisson_ratio=0.5), "poisson_ratio is 0.5"),
        (lambda: Rotor(Shaft([ShaftSection(1.0, 0.1)]), [Support("A", 1e6)]), "no such seat"),
        (
            lambda: Rotor(Shaft([ShaftSection(1.0, 0.1)]), kind="radial"),
            says("Rotor.kind", "'radial'", "lateral"),
        ),
        (lambda: friswell().unbalance_response([1.0], {2.0: 1e-3}), "unbalance at 2.0 m"),
        (lambda: Support("A", np.ones(3)).matrices(), says("give one number")),
    ],
)
def test_wrong_settings_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.slow
def test_an_unbalance_between_stations_is_one_with_a_station_there():
    """Anywhere on a stepped shaft, against the same shaft with a seat there; so is what is read off between."""
    rng = np.random.default_rng(seed())
    sections = [ShaftSection(0.5, 0.05), ShaftSection(0.4, 0.07, 0.02), ShaftSection(0.6, 0.05)]
    disc = Disc(0.9, outer=0.25, width=0.05, inner=0.05)
    supports = [Support("A", (1e7, 3e7), 500.0), Support("B", 2e7, 500.0)]

    def rotor(elements=20, **seats):
        return Rotor(Shaft(sections, [disc], {"A": 0.1, "B": 1.45, **seats}, elements=elements), supports)

    speeds = [30.0, 150.0, 280.0, 420.0]
    for at, read in rng.uniform(0.0, 1.5, (cases(6), 2)):
        size = 1e-4 * np.exp(1j * rng.uniform(0.0, 6.0))
        found = rotor().unbalance_response(speeds, {at: size})
        exact = rotor(here=at, there=read).unbalance_response(speeds, {at: size})
        # elements do not bend under what stands between their ends: by how much, a mesh four times as fine says
        finer = rotor(80).unbalance_response(speeds, {at: size})
        for place in (read, 0.9):
            mesh = 2.0 * np.abs(finer.at(place) - found.at(place))[:, :2].max()
            np.testing.assert_allclose(found.at(place)[:, :2], exact.at(place)[:, :2],
                                       atol=mesh + 1e-4 * np.abs(exact.displacements).max())  # fmt: skip
        mesh = 2.0 * np.abs(finer.major_axis(read) - found.major_axis(read)).max()
        assert mesh < 1e-2 * found.major_axis(read).max()
        assert found.major_axis(read) == pytest.approx(exact.major_axis(read), rel=2e-3, abs=mesh)


def test_unbalances_are_linear_in_their_place_for_a_stiff_shaft():
    """A rigid rotor far above its criticals turns about its principal axis: -U/m and -U a/(I_t - I_p)."""
    shaft = Shaft([ShaftSection(1.0, 0.1)], seats={"A": 0.0, "B": 1.0}, elements=3)
    stiff = replace(shaft, material=ElasticMaterial(2.1e17, density=7850.0))
    rotor = Rotor(stiff, [Support("A", 1e2), Support("B", 1e2)])
    mass = stiff.model().mass_properties()
    transverse, polar = mass.inertia[0, 0], mass.inertia[2, 2]
    for at in (0.0, 0.21, 0.5, 0.83):
        found = rotor.unbalance_response([3e3], {at: 1e-3}).at(0.5)[0]
        assert found[0].real == pytest.approx(-1e-3 / mass.mass, rel=1e-4)
        turned = -1e-3 * (at - 0.5) / (transverse - polar)
        assert found[4].real == pytest.approx(turned, rel=1e-3, abs=1e-9)
    with pytest.raises(FlexibleError, match="off the shaft"):
        rotor.unbalance_response([1.0], {1.2: 1e-3})


def test_unbalance_may_be_text_and_must_be_finite():
    rotor = friswell(elements=12)
    for size in (float("nan"), float("inf"), None, True, "3 mm"):
        with pytest.raises(ValueError, match=r"unbalance at 0\.5"):
            rotor.unbalance_response([50.0], {0.5: size})
    text, number = (rotor.unbalance_response([50.0], u) for u in ({"500 mm": "100 g*mm"}, {0.5: 1e-4}))
    assert text.displacements == pytest.approx(number.displacements, rel=1e-12)


def test_motions_that_grow_without_a_frequency_are_warned_of():
    shaft = Shaft([ShaftSection(1.0, 0.05)], seats={"A": 0.0, "B": 1.0}, elements=6)
    with pytest.warns(UserWarning, match=says("rotor", "unstable", "motion")):
        Rotor(shaft, [Support("A", -1e9), Support("B", 1e9)]).modes()
    for supports in ([Support("A", 1e9), Support("B", 1e9)], []):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            Rotor(shaft, supports).modes()


@pytest.mark.parametrize("modes", [2.5, True, "8", 0])
def test_a_number_of_modes_is_whole(modes):
    shaft = Shaft([ShaftSection(1.0, 0.05)], seats={"A": 0.0, "B": 1.0}, elements=6)
    with pytest.raises(FlexibleError, match=says("modes", "modal", "whole number")):
        shaft.modal_model(modes)
    assert shaft.modal_model(np.int64(2)).modes
