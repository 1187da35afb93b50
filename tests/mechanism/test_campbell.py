"""A Campbell diagram straight from a mechanism: modes against speed, and where the mesh orders meet them."""

import numpy as np
import pytest

from gearmbs.flexible import Rotor, Shaft, ShaftSection, Support
from gearmbs.mechanism import Mechanism, linear_modes
from gearmbs.signals import SignalError, campbell
from gearmbs.view import campbell_plot
from tests.generators import cases, seed
from tests.says import says
from tests.view.looking import assert_readable


def torsional(stiffness=2000.0):
    """Two discs of 0.02 and 0.05 kg m^2 on a torsion spring, free to turn together."""
    m = Mechanism("two discs")
    one = m.body("pinion", 1.0, (0.1, 0.1, 0.02))
    two = m.body("wheel", 2.0, (0.1, 0.1, 0.05), position=(0, 0, 0.2))
    m.revolute("bearing 1", one, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.revolute("bearing 2", two, m.ground, at=(0, 0, 0.2), axis=(0, 0, 1))
    m.bushing("shaft", one.marker(name="a"), two.marker((0, 0, -0.2), name="b"), torsional_stiffness=(0, 0, stiffness))
    return m


def natural(stiffness=2000.0):
    return np.sqrt(stiffness * (1 / 0.02 + 1 / 0.05)) / (2 * np.pi)


def test_mesh_orders_meet_the_mode_of_a_mechanism():
    """f = sqrt(k (1/J1 + 1/J2)) / 2 pi, met by order z at the speed f / z; the rigid turning is no mode to meet."""
    diagram = campbell(torsional(), ["0 rpm", "3000 rpm"], {"mesh": 29, "2 x mesh": 58})
    np.testing.assert_allclose(diagram["frequency"].values, natural(), rtol=1e-9)
    crossings = sorted(diagram["critical_speed"].values / (2 * np.pi))
    np.testing.assert_allclose(crossings, [natural() / 58, natural() / 29], rtol=1e-9)
    np.testing.assert_allclose(torsional().linear_modes().frequencies.max(), natural(), rtol=1e-9)


def test_a_range_below_the_lowest_mode_is_named():
    speeds = ["0 rpm", "3000 rpm"]
    with pytest.raises(SignalError, match=says("maximum", f"{0.9 * natural():.6g}", f"{natural():.6g}", "higher")):
        campbell(torsional(), speeds, (29,), maximum=0.9 * natural())
    assert campbell(torsional(), speeds, (29,), maximum=1.1 * natural()).sizes["mode"] == 1


def test_a_function_of_the_speed_may_return_mechanisms():
    diagram = campbell(lambda speed: torsional(2000.0 + 10.0 * speed), [0.0, 100.0, 200.0], (29,))
    np.testing.assert_allclose(
        diagram["frequency"].values[:, 0], [natural(k) for k in (2000.0, 3000.0, 4000.0)], rtol=1e-9
    )


@pytest.mark.parametrize("orders", [(29, 58), {"mesh": 29}])
def test_it_is_drawn_in_one_line(orders):
    figure = campbell_plot(torsional(), speeds=["0 rpm", "1000 rpm"], orders=orders)
    assert_readable(figure, overlap=0.3)


def spinning_disc(speed: float) -> Mechanism:
    """A disc in the middle of two equal bushings that spins about z; alike about x and y at rest."""
    m = Mechanism("spinning disc")
    disc = m.body("disc", 1.0, (0.01, 0.01, 0.02), angular_velocity=(0.0, 0.0, speed))
    for side in (-0.1, 0.1):
        m.bushing(f"at {side}", disc.marker((0, 0, side)), m.ground.marker((0, 0, side)), stiffness=(1e5, 1e5, 1e5))
    return m


def test_one_mechanism_for_all_speeds_is_warned_of_where_it_may_whirl(recwarn):
    """Of J_t s^2 - i J_p omega s + k_r = 0 the roots split with the speed; the modes at one speed do not."""
    with pytest.warns(UserWarning, match=says("'disc'")):
        flat = campbell(spinning_disc(100.0), [0.0, 500.0])
    recwarn.clear()
    diagram = campbell(spinning_disc, [0.0, 500.0])
    campbell(torsional(), [0.0, 500.0])
    assert not recwarn.list
    assert np.ptp(flat["frequency"].values, axis=0).max() == 0.0
    tilting, gyroscopic = np.sqrt(2e5 * 0.1**2 / 0.01), 0.02 / 0.01 * 500.0 / 2.0
    split = np.hypot(tilting, gyroscopic) + np.array([-1.0, 1.0]) * gyroscopic
    for frequency in split / (2.0 * np.pi):
        assert np.abs(diagram["frequency"].values[1] - frequency).min() < 1e-6 * frequency


def bushed(*ratios: float) -> Mechanism:
    """Bodies of 1 kg, each on a spring of its own along x, with damping by the critical one."""
    m = Mechanism("bushed")
    for k, ratio in enumerate(ratios):
        body = m.body(f"b{k}", 1.0, (0.1,) * 3, position=(0, k, 0))
        stiffness = 1e6 * (1 + k)
        m.translational(f"slide{k}", body, m.ground, axis=(1, 0, 0))
        m.bushing(f"bush{k}", body.marker(), m.ground.marker((0, k, 0)), stiffness=(stiffness, 0, 0),
                  damping=(2.0 * ratio * np.sqrt(stiffness), 0, 0))  # fmt: skip
    return m


@pytest.mark.slow
def test_what_is_over_damped_has_no_natural_frequency_and_no_critical_speed():
    rng = np.random.default_rng(seed())
    speeds = np.linspace(0.0, 3000.0, 7)
    for ratio in (1.0, 1.0 + 1e-9, 1.01, 5.0, *rng.uniform(1.001, 50.0, cases(10))):
        over = linear_modes(bushed(ratio))
        assert over.kinds == ["real", "real"], ratio
        assert np.all(np.isnan(over.frequencies))
        with pytest.raises(SignalError, match="damped beyond the critical"):
            campbell(bushed(ratio), speeds)
        # beside one that oscillates it is left out
        both = campbell(bushed(0.1, ratio), speeds)
        assert both.sizes["mode"] == 1
        assert both.critical_speed.values == pytest.approx([1000.0], rel=1e-9)
    for ratio in (0.95, *rng.uniform(0.0, 0.999, cases(10))):
        under = campbell(bushed(ratio), speeds)
        assert under.critical_speed.values == pytest.approx([1000.0], rel=1e-9), ratio
        assert under.damping.values == pytest.approx(ratio, abs=1e-9)


def test_a_motion_that_ceases_to_oscillate_leaves_the_others_their_lines():
    """Damping that grows with the speed: the line ends, and no crossing is made up between two modes."""

    def at(speed):
        return linear_modes(bushed(0.02 + speed / 1000.0, 0.05))

    diagram = campbell(at, [0.0, 300.0, 600.0, 900.0, 1100.0, 1400.0, 1700.0])
    lines = diagram.frequency.values * 2 * np.pi
    np.testing.assert_allclose(lines[:4], [[1e3, np.sqrt(2e6)]] * 4, rtol=1e-9)
    assert np.all(np.isnan(lines[4:, 0]))
    np.testing.assert_allclose(lines[4:, 1], np.sqrt(2e6), rtol=1e-9)
    assert diagram.critical_speed.values == pytest.approx([np.sqrt(2e6)], rel=1e-9)


def test_rotors_on_supports_damped_beyond_the_critical_have_no_critical_speed():
    shaft = Shaft([ShaftSection(0.1, 0.2)], seats={"A": 0.0, "B": 0.1}, elements=2)
    mass = shaft.model().mass_properties().mass
    critical = 2.0 * np.sqrt(1e5 * mass / 2)
    plain = Rotor(shaft, [Support(s, 1e5) for s in "AB"])
    first = np.sqrt(2e5 / mass)
    for ratio, count in ((5.0, 0), (0.95, 2)):
        rotor = Rotor(shaft, [Support(s, 1e5, ratio * critical) for s in "AB"])
        found = rotor.critical_speeds()
        assert np.sum(np.abs(found / first - 1.0) < 0.01) == count
        # tilting has its own ratio; nothing is there that the undamped rotor has not
        assert found.size <= plain.critical_speeds().size
        slow = rotor.modes(0.0).frequencies
        assert np.any(np.abs(slow / (first * np.sqrt(abs(1 - min(ratio, 0.999) ** 2))) - 1) < 0.01) == bool(count)
