"""States that go on in mechanisms with other numbers: bodies keep positions and velocities, whatever their inertia."""

import pickle

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError
from tests.says import says

TORQUE = 3.0


def turning_disc(inertia, lump=False):
    """A disc under a constant torque."""
    m = Mechanism("disc")
    disc = m.body("disc", mass=1.0, inertia=(inertia,) * 3, angular_velocity=(0, 0, 1.0))
    m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    m.torque("drive", disc, TORQUE)
    m.lump = lump
    return m


def pendulum(mass=1.0, inertia=0.02, place=0.5):
    m = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", mass=mass, inertia=(inertia,) * 3, position=(place, 0, 0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    return m


@pytest.mark.parametrize("lump", [False, True])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
def test_another_inertia_has_the_same_speed(formulation, lump):
    """Exactly, w = w0 + T t / J of each disc: started from the state, restored to it, and with check_start=False."""
    sim = gm.Simulator(turning_disc(2.0, lump), 1.0, formulation=formulation)
    sim.advance(0.5)
    state = sim.state()
    speed = 1.0 + 0.5 * TORQUE / 2.0
    for inertia in (2.0, 5.0):
        m, wanted = turning_disc(inertia, lump), speed + 0.3 * TORQUE / inertia
        for options in ({}, {"check_start": False}):
            run = m.simulate(0.8, initial=state, formulation=formulation, **options)
            np.testing.assert_allclose(run.angular_velocity("disc")[[0, -1], 2], [speed, wanted], rtol=1e-5)
            assert "moved" not in run.message
        other = gm.Simulator(m, 1.0, formulation=formulation)
        other.restore(state)
        assert other.get("angular_velocity", "disc")[2] == pytest.approx(speed, rel=1e-6)
        other.advance(0.8)
        assert other.get("angular_velocity", "disc")[2] == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize("other", [{"mass": 3.0}, {"inertia": 0.4}])
def test_another_pendulum_goes_on_from_position_and_speed(other):
    """As one that is built there: same energy, same angle later."""
    state = pendulum().simulate(0.3).state_at(0.3)
    run = pendulum(**other).simulate(0.6, initial=state, tol=1e-8)
    start = pendulum().simulate(0.3)
    built = pendulum(**other)
    rod = built.bodies["rod"]
    rod.position, rod.orientation = start.com_position("rod")[-1], start.orientation("rod")[-1]
    rod.velocity, rod.angular_velocity = start.com_velocity("rod")[-1], start.angular_velocity("rod")[-1]
    pin = built.joints["pin"]
    pin.i.position = start.orientation("rod")[-1].T @ -start.com_position("rod")[-1]
    wanted = built.simulate(0.3, tol=1e-8)
    np.testing.assert_allclose(run.com_position("rod")[-1], wanted.com_position("rod")[-1], atol=1e-6)
    assert run.kinetic_energy[0] == pytest.approx(wanted.kinetic_energy[0], rel=1e-6)


def test_joints_elsewhere_are_refused_with_what_to_do():
    state = pendulum().simulate(0.3).state_at(0.3)
    told = says("0.3", "Joints", "centres", "make")
    assert pendulum(place=0.5 + 1e-6).simulate(0.4, initial=state).success
    run = pendulum(place=0.6).simulate(0.4, initial=state)
    assert not run.success
    assert "check_start" not in run.message
    with pytest.raises(ModelError, match=told):
        gm.Simulator(pendulum(place=0.6), 1.0, initial=state).advance(0.4)


def test_initial_values_have_names():
    """A speed and a state are others: w = w0 + T t / J, and the state decays from there; what is unknown is told."""
    m = turning_disc(2.0)
    m.differential_state("lag", "-4*DIF(lag)", start=1.0)
    state = gm.Simulator(m, 1.0).state()
    other = state.changed({"eps_psi(disc)": 7.0, "z(lag)": 3.0})
    assert (state["eps_psi(disc)"], other["eps_psi(disc)"], other["z(lag)"]) == (1.0, 7.0, 3.0)
    run = m.simulate(0.5, initial=other, tol=1e-9)
    assert run.angular_velocity("disc")[-1, 2] == pytest.approx(7.0 + 0.5 * TORQUE / 2.0, rel=1e-6)
    assert run.state("lag")[-1] == pytest.approx(3.0 * np.exp(-2.0), rel=1e-6)
    for values, words in (
        ({"eps_psi(disk)": 1.0}, ("'eps_psi(disk)'", "eps_psi(disc)")),
        ({"p_psi(disc)": 1.0}, ("'p_psi(disc)'", "velocities", "eps")),
        ({"z(lag)": np.nan}, ("'z(lag)'", "nan", "SI")),
        ({"z(lag)": "1 s"}, ("'z(lag)'", "'1 s'", "SI")),
    ):
        with pytest.raises(ModelError, match=says(*words)):
            state.changed(values)
    with pytest.raises(KeyError, match=says("'z(lug)'", "z(lag)")):
        state["z(lug)"]
    run = m.simulate(0.5, initial=state.changed({"R_x(disc)": 0.1}))
    assert not run.success
    assert "R_x(disc)" in run.message


@pytest.mark.slow
def test_a_file_with_one_bit_turned_is_whole_or_refused(tmp_path):
    """In headers of the archive and of its arrays, too, where zip and numpy find other things to complain of."""
    sim = gm.Simulator(turning_disc(2.0), 1.0)
    sim.advance(0.3)
    state, path = sim.state(), tmp_path / "s.npz"
    whole = np.frombuffer(state.save(path).read_bytes(), dtype=np.uint8)
    rng, told = np.random.default_rng(5), []
    headers = np.flatnonzero((whole[:-1] == ord("P")) & (whole[1:] == ord("K")))
    for place in [*rng.integers(whole.size, size=30), *(headers[:10] + 6), *(headers[-20:] + 8), *(headers[-20:] + 10)]:
        turned = whole.copy()
        turned[place] ^= np.uint8(1 << rng.integers(8))
        path.write_bytes(turned.tobytes())
        try:
            read = gm.State.load(path)
        except ModelError as error:
            told.append(str(error))
            continue
        np.testing.assert_array_equal(read.y, state.y)
        assert read.t == state.t
    assert len(told) > 40
    assert not any("\n" in text for text in told)


def sprung_disc(stiffness, torque):
    """A disc of 2 kg m^2 on a spring, both numbers with names."""
    m = turning_disc(2.0)
    pin = m.joints["pin"]
    m.torque("load", m.bodies["disc"], m.input("load", "N m", torque))
    m.parameter("k", "N m/rad", stiffness)
    m.axis_torque("spring", pin.i, pin.j, "-k*AZ(pin.I, pin.J)")
    return m


@pytest.mark.slow
def test_what_was_set_goes_with_a_state_though_it_is_what_the_model_had():
    """Into one that has other numbers of its own; what was not set, or only after the state, is that one's."""
    sim, other = gm.Simulator(sprung_disc(3.0, 4.0), 1.0), sprung_disc(9.0, 7.0)
    unset = sim.state()
    sim.set("load", 4.0)
    sim.set("k", 6.0)
    sim.advance(0.1)
    sim.set("k", 3.0)
    sim.advance(0.2)
    again = gm.Simulator(sprung_disc(3.0, 4.0), 1.0, initial=sim.state())
    again.advance(0.3)
    ran = sprung_disc(3.0, 4.0).simulate(0.3, t_eval=[0.0, 0.3], inputs={"load": 4.0, "k": 3.0})
    states = [sim.state(), sim.solution().state_at(0.2), again.state(), ran.state_at(0.3)]
    sim.restore(unset)
    for state, k, load in [(unset, 9.0, 7.0), (sim.state(), 9.0, 7.0), *((one, 3.0, 4.0) for one in states)]:
        on = gm.Simulator(other, 1.0, initial=state)
        assert (on.get("input", "k"), on.get("input", "load")) == (k, load)
        plant = other.linearize(["load"], [("joint_angle", "pin")], at=state)
        assert plant.point.inputs == [load]
        assert plant.dc_gain == pytest.approx(1.0 / k, rel=1e-9)


def test_looking_at_a_state_changes_nothing_and_writing_into_it_that_state_alone():
    """What a state tells is copied where somebody asks for it; its history stays what it was."""
    m = pendulum()
    m.torque("push", m.bodies["rod"], m.input("push", "N m"))
    sim = gm.Simulator(m, 1.0)
    sim.set("push", 0.5, 1)
    sim.advance(0.3)
    unseen, seen, written = sim.state(), sim.state(), sim.state()
    before = seen.y.copy()
    copied = pickle.loads(pickle.dumps(sim.state()))
    ends = []
    for state in (unseen, seen, copied, unseen):
        sim.restore(state)
        assert sim.get("input", "push") == 0.5
        sim.set("push", 0.2)
        sim.advance(0.7)
        ends.append(sim.state().y)
    for end in ends[1:]:
        np.testing.assert_array_equal(end, ends[0])
    np.testing.assert_array_equal(unseen.y, before)
    np.testing.assert_array_equal(unseen.reals[1], copied.reals[1])
    written.y[:] = before
    assert written.is_own
    written.yp[-1] += 1.0
    assert not written.is_own
    assert unseen.is_own
