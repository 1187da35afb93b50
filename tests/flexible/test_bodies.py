"""Wheels, carriers and housings made of few dimensions."""

import warnings

import numpy as np
import pytest

from gearmbs.bearings import Bearing, RollingBearing
from gearmbs.flexible import ElasticMaterial, FlexibleError, box_housing, planet_carrier, thin_rimmed_wheel
from gearmbs.mechanism import Mechanism, static_equilibrium
from tests.says import says

pytest.importorskip("skfem")

RHO = 7850.0


def prism(around: int) -> float:
    """Area of a regular polygon as a share of its circle."""
    return around / (2 * np.pi) * np.sin(2 * np.pi / around)


@pytest.mark.slow
def test_a_wheel_has_the_mass_of_its_section_and_a_web_that_gives_way():
    def wheel(web):
        return thin_rimmed_wheel("20 mm", "40 mm", "90 mm", "100 mm", "20 mm", web, modes=8, around=16)

    thin, thick = wheel("4 mm"), wheel("12 mm")
    squares = np.array([0.02, 0.04, 0.09, 0.1]) ** 2
    area = np.diff(squares) @ np.array([0.02, 0.004, 0.02])
    np.testing.assert_allclose(thin.properties.mass, RHO * np.pi / 4 * area * prism(16), rtol=1e-9)
    np.testing.assert_allclose(thin.properties.com, 0, atol=1e-12)
    np.testing.assert_allclose(thin.place("rim"), 0, atol=1e-12)
    # the rim tilts against the hub on its web: the stiffness of a plate grows like the third power, of the whole less
    ratio = thick.frequencies[0] / thin.frequencies[0]
    assert 1.5 < ratio < 3.0


@pytest.mark.slow
def test_hub_and_rim_of_a_wheel_are_seats_of_their_own():
    """A torque between them twists hub, web and rim, each T / (4 pi G t) (1/a^2 - 1/b^2) between its radii a and b."""
    steel = ElasticMaterial()
    web = 0.018
    wheel = thin_rimmed_wheel("20 mm", "40 mm", "90 mm", "100 mm", "20 mm", web, around=24)
    m = Mechanism("wheel")
    body = wheel.add_to(m)
    bore = wheel.seat_marker(body, "bore")
    m.fixed("shaft", bore, m.ground.marker())
    rim = wheel.seat_marker(body, "rim")
    m.load("teeth", rim, m.ground.marker(), rm=m.ground.marker(), tz=100.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = static_equilibrium(m).solution
    radii, widths = np.array([0.01, 0.02, 0.045, 0.05]), np.array([0.02, web, 0.02])
    exact = 100.0 / (4 * np.pi * steel.shear_modulus) * (-np.diff(radii**-2.0) / widths).sum()
    assert found.deflection(rim)[1][0, 2] - found.deflection(bore)[1][0, 2] == pytest.approx(exact, rel=0.08)
    with pytest.raises(FlexibleError, match=r"bore, rim are at one place.*seat_marker"):
        wheel.shapes(wheel.place("rim"))
    with pytest.raises(FlexibleError, match="no seat 'tooth'"):
        wheel.seat_marker(body, "tooth")


@pytest.mark.slow
def test_a_carrier_is_twisted_by_its_planets():
    """With the slowest modes alone it is rigid in torsion, and says so; all of the reduction have it."""
    twist = {}
    for modes in (12, None):
        carrier = planet_carrier("30 mm", "120 mm", "12 mm", 3, "80 mm", "24 mm")
        carrier = carrier.slowest(modes) if modes else carrier
        m = Mechanism("carrier")
        body = carrier.add_to(m)
        m.fixed("shaft", body.marker(carrier.place("bore")), m.ground.marker())
        for k in range(3):
            turn = 2 * np.pi * k / 3
            pin = body.marker(carrier.place(f"pin {k + 1}"), name=f"pin {k + 1}")
            m.load(f"push {k}", pin, m.ground.marker(), rm=m.ground.marker(), fx=float(-1000 * np.sin(turn)),
                   fy=float(1000 * np.cos(turn)))  # fmt: skip
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = static_equilibrium(m).solution
        assert any("seat 'bore'" in str(w.message) for w in caught) == (modes == 12)
        twist[modes] = found.marker_position("pin 1")[0, 1]
    assert twist[12] < 1e-3 * twist[None]
    assert twist[None] > 1e-7


@pytest.mark.slow
def test_a_carrier_twists_by_its_pins_as_it_is_round():
    carrier = planet_carrier("30 mm", "120 mm", "12 mm", 3, "80 mm", "24 mm", modes=12)
    assert list(carrier.seats) == ["bore", "pin 1", "pin 2", "pin 3"]
    np.testing.assert_allclose(carrier.place("pin 2"), [-0.02, 0.02 * np.sqrt(3), 0], atol=1e-12)
    m = Mechanism("carrier")
    body = carrier.add_to(m, damping=0.02)
    m.fixed("shaft", body.marker(carrier.place("bore")), m.ground.marker())
    markers = [body.marker(carrier.place(f"pin {k}"), name=f"pin {k}") for k in (1, 2, 3)]
    for k, marker in enumerate(markers):
        turn = 2 * np.pi * k / 3
        m.load(f"push {k}", marker, m.ground.marker(), rm=m.ground.marker(), fz=1000.0, fx=float(100 * np.cos(turn)),
               fy=float(100 * np.sin(turn)))  # fmt: skip
    found = static_equilibrium(m).solution
    lifted = [found.marker_position(marker)[0, 2] for marker in markers]
    assert lifted[0] > 1e-8
    np.testing.assert_allclose(lifted, lifted[0], rtol=1e-6)


@pytest.mark.slow
def test_a_housing_of_a_hundred_modes_runs_between_its_bearings_and_mounts():
    """A shaft on two bearings in the end walls, four mounts below: weight and load come out at the mounts."""
    housing = box_housing(
        ("300 mm", "200 mm", "250 mm"), "12 mm", [("150 mm", "110 mm")], "60 mm", divisions=(4, 3, 3), modes=70
    )
    assert housing.modes == 100
    x, y, z, t = 0.3, 0.2, 0.25, 0.012
    inside = (x - 2 * t) * (y - t) * (z - 2 * t)
    np.testing.assert_allclose(housing.properties.mass, RHO * (x * y * z - inside), rtol=1e-9)
    m = Mechanism("gearbox", gravity=(0, -9.81, 0))
    body = housing.add_to(m, damping=0.05)
    for k in range(1, 5):
        place = housing.place(f"mount {k}")
        m.bushing(f"mount {k}", body.marker(place), m.ground.marker(place), stiffness=(5e7,) * 3, damping=(5e3,) * 3)
    shaft = m.body("shaft", 4.0, (0.02, 0.02, 0.001), position=(0.15, 0.11, 0.125), angular_velocity=(0, 0, 150.0))
    ball_bearing = Bearing.from_designation("6206")
    for side in ("front", "back"):
        place = housing.place(f"bearing 1 {side}")
        inner = shaft.marker(place - [0.15, 0.11, 0.125], name=f"{side} inner")
        outer = body.marker(place, name=f"{side} outer")
        m.add(RollingBearing(side, inner, outer, ball_bearing))
    m.load("mesh", shaft.marker((0, 0, 0)), m.ground.marker(), rm=m.ground.marker(),
           fy="-2000*STEP(TIME,0,0,2E-3,1)")  # fmt: skip
    solution = m.simulate(0.03, rate=2000)
    assert solution.success
    carried = sum(solution.load(f"mount {k}")[0][-20:, 1].mean() for k in range(1, 5))
    weight = (housing.properties.mass + 4.0) * 9.81
    np.testing.assert_allclose(abs(carried), 2000 + weight, rtol=0.02)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: thin_rimmed_wheel(0.05, 0.04, 0.09, 0.1, 0.02, 0.004), "diameters must rise"),
        (lambda: thin_rimmed_wheel(0.02, 0.04, 0.09, 0.1, 0.02, 0.03), "web is thinner"),
        (lambda: planet_carrier(0.03, 0.1, 0.01, 3, 0.09, 0.02), says("planet_carrier", "fit between")),
        (lambda: box_housing((0.1, 0.1, 0.1), 0.06, [(0.05, 0.05)], 0.02), says("0.06 m", "walls")),
        (lambda: box_housing((0.1, 0.1, 0.1), 0.01, [(0.02, 0.05)], 0.04), says("box_housing", "inside the end")),
    ],
)
def test_dimensions_that_do_not_fit_are_named(make, message):
    with pytest.raises(FlexibleError, match=message):
        make()
