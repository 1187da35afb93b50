"""Modes of what spins, against closed forms: gyroscopic couples do not depend on how a body is described."""

import warnings

import numpy as np
import pytest
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism
from tests.generators import cases, seed
from tests.says import says

G = 9.81

STIFFNESS, POLAR, ACROSS = 4000.0, 0.05, 0.03


def whirl(spin: float) -> np.ndarray:
    """Return s of J_d s^2 - i J_p spin s + k = 0, frequencies of backward and forward whirl, rad/s, sorted."""
    root = np.sqrt((POLAR * spin) ** 2 + 4.0 * ACROSS * STIFFNESS)
    return np.sort(np.abs([(POLAR * spin + root) / (2 * ACROSS), (POLAR * spin - root) / (2 * ACROSS)]))


def disc(axis: np.ndarray, turned: float, spin: float) -> Mechanism:
    """Return a disc held by a spherical joint and two springs across its axis, in any direction and phase."""
    m = Mechanism("disc", gravity=(0, 0, 0))
    z = np.asarray(axis) / np.linalg.norm(axis)
    x = np.cross(z, [0.3, 0.5, 0.9])
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    x, y = np.cos(turned) * x + np.sin(turned) * y, np.cos(turned) * y - np.sin(turned) * x
    frame = np.column_stack([x, y, z])
    body = m.body("disc", 2.0, (ACROSS, ACROSS, POLAR), orientation=frame, angular_velocity=spin * z)
    still = np.column_stack([np.cross(z, [1.0, 0.2, 0.1]), z, z])
    still[:, 0] /= np.linalg.norm(still[:, 0])
    still[:, 1] = np.cross(z, still[:, 0])
    i = body.marker((0, 0, 0), name="centre")
    j = m.ground.marker((0, 0, 0), still, name="seat")
    m.joint("spherical", "ball", i, j)
    # springs without preload along the two directions across hold the tip of the axis: k = stiffness * arm^2
    tip = body.marker((0, 0, 0.5), name="tip")
    for k, direction in enumerate((still[:, 0], still[:, 1])):
        wall = m.ground.marker(0.5 * z + direction, name=f"wall{k}")
        m.spring_damper(f"spring{k}", tip, wall, stiffness=STIFFNESS / 0.25, length=1.0)
    return m


@pytest.mark.parametrize("spin", [0.0, 50.0, 300.0, -300.0, 2000.0])
@pytest.mark.parametrize(
    ("axis", "turned"), [((0, 0, 1), 0.0), ((0, 0, 1), 1.1), ((1, 0, 0), 0.4), ((0.3, -1, 0.5), 2.0)]
)
def test_a_disc_whirls_at_its_closed_form(axis, turned, spin):
    modes = disc(axis, turned, spin).linear_modes()
    found = np.sort(np.abs([s.imag for s, kind in zip(modes.eigenvalues, modes.kinds) if kind == "oscillating"]))
    np.testing.assert_allclose(found, whirl(spin), rtol=1e-7)
    assert modes.stable
    assert modes.kinds == ["rigid", "oscillating", "oscillating"]


def test_a_free_top_nods_at_its_closed_form():
    """A symmetric body free in space: its spin and its nutation (J_p/J_d) spin."""
    m = Mechanism("free", gravity=(0, 0, 0))
    m.body("top", 1.0, (ACROSS, ACROSS, POLAR), angular_velocity=(0, 0, 80.0))
    modes = m.linear_modes()
    assert modes.eigenvalues[-1].imag == pytest.approx(80.0 * POLAR / ACROSS, rel=1e-9)
    assert np.abs(modes.eigenvalues[:-1]).max() < 1e-6


def oscillating(m: Mechanism) -> np.ndarray:
    """Return the angular frequencies of the modes, rad/s, of a motion without remark."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        modes = m.linear_modes()
    return 2.0 * np.pi * modes.frequencies[modes.oscillating]


def frame(spin: float, driven: bool = True, gravity: float = 0.0) -> Mechanism:
    """Return a body of 0.1 kg m^2 that turns about z."""
    m = Mechanism("turning", gravity=(0, 0, -gravity))
    body = m.body("frame", 1.0, (0.1, 0.1, 0.1), angular_velocity=(0, 0, spin))
    pivot = m.revolute("pivot", body, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    if driven:
        m.rotation("drive", pivot, spin, level="velocity")
    return m


def carried(m: Mechanism, spin: float, place: np.ndarray, mass: float, inertia: tuple, name: str = "bob", turn=None):
    """Add a body that turns with the frame."""
    velocity = np.cross([0, 0, spin], place)
    axes = np.eye(3) if turn is None else turn
    return m.body(name, mass, inertia, position=place, orientation=axes, velocity=velocity,
                  angular_velocity=(0, 0, spin))  # fmt: skip


@pytest.mark.parametrize("driven", [True, False])
@pytest.mark.parametrize("spin", [6.0, 8.0, 12.0, -8.0])
def test_a_bead_on_a_turning_hoop(spin, driven):
    """With p = m (l sin a)^2, the hoop free has p' = 0 of J + p: 4 m l^2 cos^2 a p spin^2 / (m l^2 (J + p)) more."""
    length, mass = 0.5, 2.0
    cos = G / (spin**2 * length)
    sin = np.sqrt(1.0 - cos**2)
    m = frame(spin, driven, G)
    bob = carried(m, spin, np.array([length * sin, 0, -length * cos]), mass, (1e-12,) * 3)
    m.revolute("hinge", bob, m.bodies["frame"], at=(0, 0, 0), axis=(0, 1, 0))
    polar = mass * (length * sin) ** 2
    more = 0.0 if driven else 4.0 * cos**2 * polar / (0.1 + polar)
    assert oscillating(m) == pytest.approx([abs(spin) * np.sqrt(sin**2 + more)], rel=1e-8)


@pytest.mark.parametrize(("axis", "more"), [((0, 0, 1), 0.0), ((0, 1, 0), 1.0)])
def test_a_centrifugal_pendulum_in_plane_and_across(axis, more):
    m = frame(50.0)
    bob = carried(m, 50.0, np.array([0.25, 0, 0]), 0.3, (1e-12,) * 3)
    m.revolute("hinge", bob, m.bodies["frame"], at=(0.2, 0, 0), axis=axis)
    assert oscillating(m) == pytest.approx([50.0 * np.sqrt(0.2 / 0.05 + more)], rel=1e-8)


def test_a_slider_on_a_turning_frame_loses_the_square_of_its_speed():
    m = frame(20.0)
    mass, k, x = 2.0, 2000.0, 0.2
    block = carried(m, 20.0, np.array([x, 0, 0]), mass, (1e-3,) * 3)
    m.translational("guide", block, m.bodies["frame"], axis=(1, 0, 0))
    free = x - mass * 400.0 * x / k
    m.spring_damper("spring", block.marker(), m.bodies["frame"].marker(), stiffness=k, length=free)
    assert oscillating(m) == pytest.approx([np.sqrt(k / mass - 400.0)], rel=1e-8)


def test_a_conical_pendulum_nods():
    angle, length = 0.7, 1.0
    spin = np.sqrt(G / length / np.cos(angle))
    m = Mechanism("conical", gravity=(0, 0, -G))
    place = length * np.array([np.sin(angle), 0, -np.cos(angle)])
    bob = m.point_mass("bob", 1.0, at=place, velocity=np.cross([0, 0, spin], place))
    m.distance("rod", bob.marker(), m.ground.marker())
    assert oscillating(m) == pytest.approx([spin * np.sqrt(1 + 3 * np.cos(angle) ** 2)], rel=1e-8)


def test_a_rotor_off_its_axis_is_rigid():
    m = Mechanism("eccentric", gravity=(0, 0, 0))
    rotor = carried(m, 50.0, np.array([0.3, 0, 0]), 1.0, (0.01, 0.02, 0.03), "rotor")
    m.revolute("pivot", rotor, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    assert oscillating(m).size == 0
    assert m.linear_modes().kinds == ["rigid"]


def test_two_frames_that_turn_against_each_other_have_axes_of_their_own():
    m = Mechanism("two", gravity=(0, 0, 0))
    for name, spin in (("left", 50.0), ("right", -30.0)):
        one = m.body(name, 1.0, (0.1,) * 3, angular_velocity=(0, 0, spin))
        m.rotation(f"{name} drive", m.revolute(f"{name} pivot", one, m.ground, at=(0, 0, 0), axis=(0, 0, 1)), spin,
                   level="velocity")  # fmt: skip
        bob = carried(m, spin, np.array([0.25, 0, 0]), 0.3, (1e-12,) * 3, f"{name} bob")
        m.revolute(f"{name} hinge", bob, one, at=(0.2, 0, 0), axis=(0, 0, 1))
    assert np.sort(oscillating(m)) == pytest.approx([60.0, 100.0], rel=1e-8)


class Chain:
    """Hinged bodies on a frame that turns about z, by Lagrange's function of their angles."""

    def __init__(self, rng: np.random.Generator, count: int) -> None:
        self.spin = rng.uniform(3.0, 8.0)
        self.axes = rng.normal(size=(count, 3))
        self.axes /= np.linalg.norm(self.axes, axis=1)[:, None]
        self.arms, self.centres = rng.uniform(-0.3, 0.3, (count, 3)), rng.uniform(-0.3, 0.3, (count, 3))
        self.mass, self.inertia = rng.uniform(0.5, 2.0, count), 0.02 * rng.uniform(0.7, 1.0, (count, 3))

    def bodies(self, angles, rates):
        """Yield the hinge, centre, axes, velocity and angular velocity of each body."""
        turn, hinge, velocity, omega = np.eye(3), np.zeros(3), np.zeros(3), np.array([0, 0, self.spin])
        for k, angle in enumerate(angles):
            arm = turn @ self.arms[k]
            hinge, velocity = hinge + arm, velocity + np.cross(omega, arm)
            omega = omega + turn @ self.axes[k] * rates[k]
            turn = turn @ Rotation.from_rotvec(self.axes[k] * angle).as_matrix()
            out = turn @ self.centres[k]
            yield hinge, hinge + out, turn, velocity + np.cross(omega, out), omega

    def lagrangian(self, x):
        """Return kinetic less potential energy at angles and their rates."""
        total = 0.0
        for k, (_, centre, turn, v, w) in enumerate(self.bodies(*np.split(x, 2))):
            own = turn.T @ w
            total += 0.5 * self.mass[k] * v @ v + 0.5 * own @ (self.inertia[k] * own) - self.mass[k] * G * centre[2]
        return total

    def hessian(self, x, step=2e-4):
        """Return the second derivatives of the Lagrangian."""
        e = step * np.eye(x.size)
        f = self.lagrangian
        return np.array([
            [(f(x + a + b) - f(x + a - b) - f(x - a + b) + f(x - a - b)) / (4 * step**2) for b in e] for a in e
        ])  # fmt: skip

    def steady(self, rng):
        """Return angles at which the chain turns with the frame."""
        n = len(self.mass)

        def slope(angles):
            x, e = np.r_[angles, np.zeros(n)], 1e-6 * np.eye(2 * n)[:n]
            return [(self.lagrangian(x + a) - self.lagrangian(x - a)) / 2e-6 for a in e]

        found = root(slope, rng.uniform(-1, 1, n), tol=1e-10)
        return found.x if np.abs(slope(found.x)).max() < 1e-7 else None

    def mechanism(self, angles):
        """Return the chain as bodies and joints."""
        m = frame(self.spin, gravity=G)
        before = m.bodies["frame"]
        inner = np.eye(3)
        for k, (hinge, centre, turn, _, _) in enumerate(self.bodies(angles, 0.0 * angles)):
            body = carried(m, self.spin, centre, self.mass[k], tuple(self.inertia[k]), f"b{k}", turn)
            m.revolute(f"hinge {k}", body, before, at=hinge, axis=inner @ self.axes[k])
            before, inner = body, turn
        return m


@pytest.mark.slow
def test_chains_of_hinges_that_turn_steadily_have_the_modes_of_their_lagrangian():
    rng = np.random.default_rng(seed())
    done = 0
    while done < cases(6):
        chain = Chain(rng, int(rng.integers(1, 4)))
        angles = chain.steady(rng)
        if angles is None:
            continue
        done += 1
        n = angles.size
        second = chain.hessian(np.r_[angles, np.zeros(n)])
        mass, across, stiffness = second[n:, n:], second[n:, :n], -second[:n, :n]
        # both signs of a saddle count, by the square of s
        first = np.block([[np.zeros((n, n)), np.eye(n)],
                          [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, across - across.T)]])  # fmt: skip
        exact = np.linalg.eigvals(first)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            modes = chain.mechanism(angles).linear_modes()
        for s in modes.eigenvalues:
            assert np.abs(exact - s).min() < 1e-4 * chain.spin, (exact, modes.eigenvalues)
        assert sum(2 if s.imag else 1 for s in modes.eigenvalues) == 2 * n


@pytest.mark.parametrize("angle", [0.0, 0.8, np.pi / 2])
def test_a_motion_that_is_not_steady_is_remarked_on(angle):
    """A pendulum that swings, and at rest the same one."""
    for speed in (3.0, 0.0):
        m = Mechanism("swing", gravity=(0, 0, -G))
        place = np.array([np.sin(angle), 0, -np.cos(angle)])
        bob = m.body("bob", 1.0, (0.01, 0.02, 0.03), position=place, velocity=np.cross([0, speed, 0], place),
                     angular_velocity=(0, speed, 0))  # fmt: skip
        m.revolute("hinge", bob, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
        if speed:
            with pytest.warns(UserWarning, match=says("bob", "vary", "time")):
                m.linear_modes()
        else:
            assert oscillating(m).size <= 1


def unlike(spin: float, across: tuple[float, float]) -> Mechanism:
    """A rotor of unequal inertia across its axis, held by a ball and springs across."""
    m = Mechanism("unlike", gravity=(0, 0, 0))
    body = m.body("rotor", 2.0, (0.03, 0.04, 0.05), angular_velocity=(0, 0, spin))
    m.bushing("support", body.marker(), m.ground.marker(), stiffness=(1e5,) * 3, torsional_stiffness=(*across, 0.0))
    return m


def test_a_rotor_that_is_not_alike_has_modes_on_supports_that_are():
    """In axes that turn with it: J q'' + ..., by hand; on unlike supports there are none, and this is told."""
    spin, k = 100.0, 900.0
    a, b, c = 0.03, 0.04, 0.05
    stiffness = np.diag([k + (c - b) * spin**2, k + (c - a) * spin**2])
    gyroscopic = (a + b - c) * spin * np.array([[0, -1], [1, 0]])
    mass = np.diag([a, b])
    first = np.block(
        [[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, gyroscopic)]]
    )
    exact = np.linalg.eigvals(first).imag
    found = oscillating(unlike(spin, (k, k)))
    for value in exact[exact > 0]:
        assert np.abs(found - value).min() < 1e-5 * value
    with pytest.warns(UserWarning, match=says("rotor", "vary")):
        unlike(spin, (k, 3.0 * k)).linear_modes()


@pytest.mark.parametrize("coupled", [False, True])
def test_springs_between_what_turns_and_what_rests_are_looked_at(coupled):
    m = frame(20.0)
    block = carried(m, 20.0, np.array([0.2, 0, 0]), 2.0, (1e-3,) * 3, "block")
    m.translational("guide", block, m.bodies["frame"], axis=(1, 0, 0))
    m.spring_damper("own", block.marker(), m.bodies["frame"].marker(), stiffness=2000.0, length=0.12)
    other = m.point_mass("other", 1.0, at=(0, 0, 0.5))
    m.bushing("support", other.marker(), m.ground.marker((0, 0, 0.5)), stiffness=(1e4,) * 3)
    if coupled:
        m.spring_damper("between", block.marker(), other.marker(), stiffness=500.0, length=np.hypot(0.2, 0.5))
        with pytest.warns(UserWarning, match=says("block", "vary")):
            m.linear_modes()
    else:
        assert oscillating(m) == pytest.approx([np.sqrt(600.0), *[100.0] * 3], rel=1e-8)


@pytest.mark.parametrize("phase", np.linspace(0.0, 2.0, 6))
@pytest.mark.parametrize("carrier_first", [True, False])
def test_a_carrier_of_three_planets_whirls_as_a_disc(phase, carrier_first):
    """In axes at rest, by the angular momentum of all: J s^2 - i H s + k = 0, whatever is independent by pivots."""
    spin, k = 100.0, 1e4
    m = Mechanism("carrier", gravity=(0, 0, 0))

    def carrier_on_springs():
        carrier = m.body("carrier", 3.0, (0.1, 0.1, 0.2), angular_velocity=(0, 0, spin))
        m.bushing("s", carrier.marker(), m.ground.marker(), stiffness=(1e6,) * 3, torsional_stiffness=(k, k, 0))

    if carrier_first:
        carrier_on_springs()
    places = [0.1 * np.array([np.cos(phase + turn), np.sin(phase + turn), 0]) for turn in 2 * np.pi / 3 * np.arange(3)]
    for n, place in enumerate(places):
        m.body(f"p{n}", 0.5, (1e-3, 1e-3, 1.5e-3), position=place, velocity=np.cross([0, 0, spin], place),
               angular_velocity=(0, 0, -3 * spin))  # fmt: skip
    if not carrier_first:
        carrier_on_springs()
    for n, place in enumerate(places):
        m.revolute(f"pin {n}", m.bodies[f"p{n}"], m.bodies["carrier"], at=place, axis=(0, 0, 1))
    across, momentum = 0.1 + 3e-3 + 1.5 * 0.5 * 0.01, (0.2 + 3 * 0.5 * 0.01 - 9 * 1.5e-3) * spin
    whirls = np.abs(np.roots([across, -momentum, -k]))
    exact = np.sort([*whirls, *[np.sqrt(1e6 / 4.5)] * 3])
    np.testing.assert_allclose(np.sort(oscillating(m)), exact, rtol=1e-7)
