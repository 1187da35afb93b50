"""What is assigned to a mechanism or its parts after they are made has its effect, or is refused by name."""

import copy
import pickle

import numpy as np
import pytest

from gearmbs.adams import write_deck
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism, Simulator
from gearmbs.mechanism.language.syntax import Units
from gearmbs.mechanism.parts.bodies import OwnAttributes
from gearmbs.mechanism.parts.elements import Compiled, ForceElement
from tests.says import says


def built(units=None):
    m = Mechanism("rig", gravity=(0, 0, -9.81))
    if units is not None:
        m.units = units
    rotor = m.body("rotor", 2.0, (0.1, 0.2, 0.3))
    slider = m.body("slider", 1.0, (1.0, 1.0, 1.0), position=(2.0, 0, 0))
    m.revolute("pin", rotor, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.translational("guide", slider, m.ground, at=(2.0, 0, 0), axis=(1, 0, 0))
    m.axis_torque("load", rotor.marker(), m.ground.marker(), "-0.1*TIME")
    m.torque("motor", rotor, 1.0)
    m.spring_damper("spring", slider.marker(), m.ground.marker((3, 0, 0)), stiffness=10.0, damping=0.5)
    m.bushing("bushing", slider.marker(), m.ground.marker((2, 0, 0)), stiffness=(1.0, 1.0, 1.0))
    return m


PARTS = {
    "the mechanism": lambda m: m, "body": lambda m: m.bodies["rotor"], "joint": lambda m: m.joints["pin"],
    "marker": lambda m: m.joints["pin"].i, "load": lambda m: m.elements["load"],
    "torque": lambda m: m.elements["motor"], "spring": lambda m: m.elements["spring"],
    "bushing": lambda m: m.elements["bushing"],
    "simulator": lambda m: Simulator(m, 1.0), "state": lambda m: m.algebraic_state("power", "2*TIME"),
}  # fmt: skip


@pytest.mark.parametrize("part", PARTS)
def test_a_name_that_is_none_is_refused(part):
    one = PARTS[part](built())
    for name in ("frction", "torqe", "a2"):
        with pytest.raises(ModelError, match=says(f"'{name}'", "0.2", "nothing")):
            setattr(one, name, 0.2)
        assert not hasattr(one, name)
    # copies and pickles remember that they are made
    if part in ("body", "joint", "marker", "load", "state"):
        for other in (copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
            with pytest.raises(ModelError, match="'frction'"):
                setattr(other, "frction", 0.2)  # noqa: B010


@pytest.mark.parametrize(
    ("part", "name", "meant"),
    [("body", "mas", "mass"), ("the mechanism", "gravty", "gravity"), ("spring", "stifness", "stiffness"),
     ("joint", "prescribd", "prescribed"), ("torque", "functon", "function")],
)  # fmt: skip
def test_what_was_meant_is_asked(part, name, meant):
    with pytest.raises(ModelError, match=says(name, f"did you mean {meant}?")):
        setattr(PARTS[part](built()), name, 1.0)


@pytest.mark.parametrize(
    ("part", "name", "value", "words"),
    [
        ("body", "mass", -1, ("mass", "-1.0", "positive")),
        ("body", "mass", "2 mm", ("mass", "2 mm")),
        ("body", "inertia", (1, 1, -1), ("inertia", "negative")),
        ("body", "velocity", (0, 1), ("velocity", "(0, 1)", "three")),
        ("body", "orientation", 2 * np.eye(3), ("orientation", "not a rotation")),
        ("body", "is_ground", True, ("is_ground", "True", "make another")),
        ("body", "name", "shaft", ("name", "shaft", "make another")),
        ("marker", "position", (0, "1 kg", 0), ("position", "1 kg")),
        ("joint", "i", None, ("i", "None", "make another")),
        ("joint", "kind", "fixed", ("kind", "fixed", "make another")),
        ("load", "expressions", ("5",), ("expressions", "5", "make another")),
        ("bushing", "stiffness", np.eye(6), ("stiffness", "make another")),
        ("spring", "stiffness", "10 mm", ("stiffness", "10 mm")),
        ("torque", "function", "5 mm", ("function", "5 mm")),
        ("the mechanism", "gravity", 9.81, ("gravity", "9.81", "three")),
    ],
)
def test_a_value_that_would_go_wrong_is_refused(part, name, value, words):
    m = built()
    with pytest.raises(ModelError, match=says(*words)):
        setattr(PARTS[part](m), name, value)


def test_values_that_fit_have_their_effect():
    m = built()
    before = m.simulate(0.1, rate=100)
    m.bodies["rotor"].mass = "4 kg"
    m.bodies["rotor"].inertia = ("0.2 kg m^2", 0.4, 0.6)
    m.elements["motor"].function = "3 N m"
    m.elements["spring"].preload = "20 N"
    m.gravity = ("1 m/s^2", 0, 0)
    after = m.simulate(0.1, rate=100)
    # alpha = (M - 0.1 t) / I
    assert before.angular_acceleration("rotor")[0, 2] == pytest.approx(1.0 / 0.3, rel=1e-9)
    assert after.angular_acceleration("rotor")[0, 2] == pytest.approx(3.0 / 0.6, rel=1e-9)
    # a positive preload pushes the slider away from the wall, at three metres; gravity pulls to it
    assert before.com_acceleration("slider")[0, 0] == pytest.approx(0.0, abs=1e-9)
    assert after.com_acceleration("slider")[0, 0] == pytest.approx(1.0 - 20.0, rel=1e-9)


@pytest.mark.parametrize("factor", [1.0, 1e-3])
def test_a_deck_has_the_spring_as_it_is_now(factor):
    m = built(Units(length=factor, force=1.0))
    assert ", K = 10\n" in write_deck(m)
    m.elements["spring"].stiffness = 20.0 / factor
    assert ", K = 20\n" in write_deck(m)


def test_a_class_of_the_user_sets_what_it_likes_until_it_is_made():
    class Pull(ForceElement):
        def __init__(self, name, i, j, strength):
            super().__init__(name, i, j)
            self.strength = strength

        def compiled(self):
            return Compiled(None)

    class Rig(Mechanism):
        def __init__(self):
            super().__init__("rig")
            self.rotor = self.body("rotor", 1.0, (1, 1, 1))

    rig = Rig()
    pull = Pull("pull", rig.rotor.marker(), rig.ground.marker(), 3.0)
    pull.strength = 4.0
    pull._kept = 1
    with pytest.raises(ModelError, match=says("strenght", "did you mean strength?")):
        setattr(pull, "strenght", 5.0)  # noqa: B010
    with pytest.raises(ModelError, match="roter"):
        setattr(rig, "roter", None)  # noqa: B010
    assert isinstance(pull, OwnAttributes)
