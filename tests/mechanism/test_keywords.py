"""What editors are told of keywords that are handed on is what is taken."""

import inspect

from gearmbs.dae.integrators.options import Options
from gearmbs.mechanism import Mechanism, simulate
from gearmbs.mechanism.parts.joints import JOINTS
from gearmbs.mechanism.solve.keywords import IntegratorOptions, SimulateOptions

OF_SIMULATIONS = {
    "tol", "progress", "consumer", "history", "errors", "event_direction", "event_action", "event_count",
}  # fmt: skip
"""Options of integrators that a simulation has under its own names, or sets itself."""


def test_options_of_integrators_are_those_of_the_table():
    known = set(Options.names("WSTIFF")) - OF_SIMULATIONS
    assert set(IntegratorOptions.__annotations__) == known


def test_keywords_of_simulate_are_those_of_the_function():
    parameters = inspect.signature(simulate).parameters.values()
    own = {p.name: str(p.annotation) for p in parameters if p.kind is p.KEYWORD_ONLY}
    told = {name: kind.__forward_arg__ for name, kind in SimulateOptions.__annotations__.items()}
    assert own == {name: kind for name, kind in told.items() if name not in IntegratorOptions.__annotations__}


def test_methods_of_joints_take_what_joint_takes():
    own = {name: p.annotation for name, p in inspect.signature(Mechanism.joint).parameters.items() if name != "kind"}
    for kind in ("revolute", "spherical", "cylindrical", "translational", "planar", "universal", "fixed"):
        assert kind in JOINTS
        taken = inspect.signature(getattr(Mechanism, kind)).parameters
        # what is none of these is refused by `joint`, which knows the kinds that take it, and by type checkers
        told = {name: p.annotation for name, p in taken.items() if name != "more"}
        assert told == {name: own[name] for name in told}
        assert "more" not in taken or taken["more"].annotation == "Never"
