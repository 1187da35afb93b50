"""What editors are told of keywords that are handed on is what is taken."""

import inspect

import pytest

from gearmbs.dae.integrators.options import Options
from gearmbs.mechanism import JointFriction, Mechanism, Simulator, forward_sensitivities, simulate, steady_motion
from gearmbs.mechanism.forces.friction import DIMENSIONS
from gearmbs.mechanism.parts.joints import JOINTS
from gearmbs.mechanism.parts.keywords import BodyKeywords, FrictionKeywords
from gearmbs.mechanism.solve.keywords import (
    IntegratorOptions,
    OrbitOptions,
    RunOptions,
    SensitivityOptions,
    SimulateOptions,
    SimulatorOptions,
    SteadyOptions,
)
from gearmbs.mechanism.solve.orbit_sensitivities import steady_sensitivities
from gearmbs.mechanism.solve.sensitivities import WITHOUT

OF_SIMULATIONS = {
    "tol", "progress", "consumer", "history", "errors", "event_direction", "event_action", "event_count",
}  # fmt: skip
"""Options of integrators that a simulation has under its own names, or sets itself."""
OF_CASES = {
    "rate", "every_step", "integrator", "formulation", "tol", "rate_scale", "lump", "progress", "advice",
}  # fmt: skip
"""What `gearmbs.studies.simulate_case` takes from the case, or has of its own."""


def told(table) -> dict[str, str]:
    return {name: kind.__forward_arg__ for name, kind in table.__annotations__.items()}


def keywords(function, *but: str) -> dict[str, str]:
    parameters = inspect.signature(function).parameters.values()
    return {p.name: str(p.annotation) for p in parameters if p.kind is p.KEYWORD_ONLY and p.name not in but}


def test_options_of_integrators_are_those_of_the_table():
    known = set(Options.names("WSTIFF")) - OF_SIMULATIONS
    assert set(IntegratorOptions.__annotations__) == known
    own = {name: str(p.annotation) for name, p in inspect.signature(Options).parameters.items()}
    assert told(IntegratorOptions) == {name: own[name] for name in known}


def test_keywords_of_simulate_are_those_of_the_function():
    own = keywords(simulate)
    assert own == {name: kind for name, kind in told(SimulateOptions).items() if name not in told(IntegratorOptions)}


def test_simulations_of_cases_take_what_is_left():
    """Outputs are the case's: times of one's own would be beside its rate."""
    left = {name: kind for name, kind in told(SimulateOptions).items() if name not in OF_CASES | {"t_eval"}}
    assert told(RunOptions) == left


def test_runs_to_be_derived_take_what_is_left():
    own = keywords(forward_sensitivities)
    left = {
        name: kind
        for name, kind in told(SimulateOptions).items()
        if name not in WITHOUT and name not in own
    }  # fmt: skip
    assert told(SensitivityOptions) == left


def test_keywords_of_the_simulator_are_those_of_the_class():
    assert told(SimulatorOptions) == keywords(Simulator.__init__, "records") | told(IntegratorOptions)


def test_keywords_of_steady_motions_are_those_of_the_function():
    assert told(SteadyOptions) == keywords(steady_motion)
    own = keywords(steady_sensitivities)
    assert told(OrbitOptions) == {name: kind for name, kind in told(SteadyOptions).items() if name not in own}


def test_keywords_of_bodies_are_those_of_the_method():
    assert told(BodyKeywords) == keywords(Mechanism.body)


@pytest.mark.parametrize("name", sorted(told(FrictionKeywords)))
def test_parameters_of_friction_are_those_of_the_class(name):
    kind = str(inspect.signature(JointFriction).parameters[name].annotation)
    assert (name in DIMENSIONS) == ("float" in kind)
    assert told(FrictionKeywords)[name] == kind.replace("float", "QuantityLike")


def test_friction_has_no_other_parameters():
    assert set(told(FrictionKeywords)) == set(inspect.signature(JointFriction).parameters) - {"mu_static", "mu_dynamic"}


def test_methods_of_joints_take_what_joint_takes():
    own = {name: p.annotation for name, p in inspect.signature(Mechanism.joint).parameters.items() if name != "kind"}
    for kind in ("revolute", "spherical", "cylindrical", "translational", "planar", "universal", "fixed"):
        assert kind in JOINTS
        taken = inspect.signature(getattr(Mechanism, kind)).parameters
        # what is none of these is refused by `joint`, which knows the kinds that take it, and by type checkers
        told = {name: p.annotation for name, p in taken.items() if name != "more"}
        assert told == {name: own[name] for name in told}
        assert "more" not in taken or taken["more"].annotation == "Never"
