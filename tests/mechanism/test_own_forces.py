"""Forces given by a function of one's own: against closed forms, by formulation, integrator and analysis."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar
from weakref import WeakSet

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.sparse import csc_array

from gearmbs.adams import write_deck
from gearmbs.dae.equations.loads.forces import DERIVATIVES, FORCE_SIG
from gearmbs.mechanism import (
    Compiled,
    Diagnostic,
    ForceElement,
    Mechanism,
    ModelError,
    linear_modes,
    quasi_static,
    static_equilibrium,
)
from gearmbs.mechanism.forces import functions
from gearmbs.mechanism.forces import functions as derivatives
from gearmbs.mechanism.parts.joints import JOINTS, JointKind
from gearmbs.mechanism.parts.quantities import reader
from tests.says import says

UNIT = (0.1, 0.1, 0.1)


@pytest.fixture(autouse=True, scope="module")
def each_function_is_compiled_once():
    """And not for each of the models that are made with it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(functions, "_compiled", cache(functions._compiled))
        yield


def magnet(t, frames, states, parameters, wrench, rates, diagnostics):
    """Attraction c/r^2 along the line, with its energy -c/r."""
    apart = frames[0, 0:3] - frames[1, 0:3]
    r = np.sqrt(apart @ apart)
    wrench[0, 0:3] = -parameters[0] * apart / r**3
    diagnostics[0] = -parameters[0] / r
    diagnostics[1] = parameters[0] / r**2


@njit
def exact_magnet(t, frames, states, parameters, jac):
    apart = frames[0, 0:3] - frames[1, 0:3]
    r = np.sqrt(apart @ apart)
    for a in range(3):
        for b in range(3):
            jac[a, b] = parameters[0] * (3.0 * apart[a] * apart[b] / r**5 - (1.0 if a == b else 0.0) / r**3)
            jac[a, 12 + b] = -jac[a, b]


def maxwell(t, frames, states, parameters, wrench, rates, diagnostics):
    """Spring k and dashpot c in a row along x of the second marker; the state is the dashpot's stretch."""
    k, c = parameters[0], parameters[1]
    axis = np.array([frames[1, 3], frames[1, 6], frames[1, 9]])
    stretch = (frames[0, 0:3] - frames[1, 0:3]) @ axis
    force = k * (stretch - states[0])
    wrench[0, 0:3] = -force * axis
    rates[0] = force / c
    diagnostics[0] = 0.5 * k * (stretch - states[0]) ** 2
    diagnostics[1] = force**2 / c


def hardening(t, frames, states, parameters, wrench, rates, diagnostics):
    """A spring whose stretch z solves k z + h z^3 = x/s for the way x: z = (x/s - h z^3)/k."""
    k, h, s = parameters[0], parameters[1], parameters[2]
    x = frames[0, 0] - frames[1, 0]
    wrench[0, 0] = -states[0]
    rates[0] = (x / s - h * states[0] ** 3) / k


def drag(t, frames, states, parameters, wrench, rates, diagnostics):
    """Quadratic drag."""
    v = frames[0, 12:15]
    speed = np.sqrt(v @ v)
    for c in range(3):
        wrench[0, c] = -parameters[0] * speed * v[c]
    diagnostics[0] = parameters[0] * speed**3


def lever(t, frames, states, parameters, wrench, rates, diagnostics):
    """Three points: the middle one is drawn to the centre of the others, who take half of the reaction each."""
    way = frames[1, 0:3] - 0.5 * (frames[0, 0:3] + frames[2, 0:3])
    for c in range(3):
        wrench[1, c] = -parameters[0] * way[c]
        wrench[0, c] = wrench[2, c] = 0.5 * parameters[0] * way[c]


STORED = Diagnostic("magnet_energy", "J", "stored")


def magnets(**options) -> Mechanism:
    m = Mechanism("magnets")
    ball = m.body("ball", 0.5, UNIT, position=(0.3, 0.0, 0.0), velocity=(0.0, 0.7, 0.2))
    m.force(
        "magnet", magnet, ball.marker(name="i"), m.ground.marker(name="j"), parameters={"strength": 0.1},
        diagnostics=[STORED, ("pull", "N")], **options,
    )  # fmt: skip
    return m


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
@pytest.mark.parametrize("derivatives", [None, exact_magnet])
@pytest.mark.slow
def test_magnet_keeps_to_keplers_orbit(formulation, integrator, derivatives):
    """x'' = -(c/m) x/|x|^3, energy m v^2/2 - c/r."""
    solution = magnets(derivatives=derivatives).simulate(
        1.0, rate=500, formulation=formulation, integrator=integrator, tol=1e-9
    )
    assert solution.success, solution.message
    orbit = solve_ivp(
        lambda t, y: [*y[3:], *(-0.2 * y[:3] / np.linalg.norm(y[:3]) ** 3)],
        (0, 1), [0.3, 0, 0, 0, 0.7, 0.2], rtol=1e-11, atol=1e-12, method="DOP853",
    )  # fmt: skip
    np.testing.assert_allclose(solution.com_position("ball")[-1], orbit.y[:3, -1], atol=2e-6)
    told = solution.diagnostics("magnet")
    r = np.linalg.norm(solution.com_position("ball"), axis=1)
    np.testing.assert_allclose(told["magnet_energy"], -0.1 / r, rtol=1e-10)
    np.testing.assert_allclose(told["pull"], np.linalg.norm(solution.load("magnet")[0], axis=1), rtol=1e-10)
    balance = solution.energy_balance()
    assert np.ptp(balance.elastic.values) > 0.01
    assert float(np.abs(balance.work_applied).max()) == 0.0
    assert balance.attrs["relative_imbalance"] < 1e-5
    data = solution.to_dataset()
    np.testing.assert_array_equal(data.pull.sel(element="magnet"), told["pull"])
    assert data.magnet_energy.attrs["units"] == "J"


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
@pytest.mark.slow
def test_maxwell_element_creeps(formulation, integrator):
    """m x'' = f0 - k (x - z), c z' = k (x - z): linear, by its matrix exponential; energy goes into the dashpot."""
    mass, k, c, pull = 2.0, 300.0, 15.0, 4.0
    m = Mechanism("damper")
    block = m.body("block", mass, UNIT, position=(0.1, 0, 0))
    guide = m.translational("guide", block, m.ground, axis=(1, 0, 0))
    assert guide.kind == "translational"
    i, j = block.marker(name="i"), m.ground.marker((0.1, 0, 0), name="j")
    m.force(
        "strut", maxwell, i, j, parameters=(k, c), states={"creep": 0.002},
        diagnostics=[("spring", "J", "stored"), ("dashpot_power", "W", "dissipated")],
    )  # fmt: skip
    m.load("pull", i, j, fx=f"{pull}")
    solution = m.simulate(0.8, rate=1000, formulation=formulation, integrator=integrator, tol=1e-9)
    assert solution.success, solution.message

    def rates(t, y):
        return [y[1], (pull - k * (y[0] - y[2])) / mass, k * (y[0] - y[2]) / c]

    expected = solve_ivp(rates, (0, 0.8), [0, 0, 0.002], rtol=1e-11, atol=1e-13).y[:, -1]
    assert solution.com_position("block")[-1, 0] - 0.1 == pytest.approx(expected[0], abs=1e-6)
    assert solution.state("strut.creep")[-1] == pytest.approx(expected[2], abs=1e-6)
    balance = solution.energy_balance()
    assert float(balance.dissipated_dashpot[-1]) > 0.05
    assert balance.attrs["relative_imbalance"] < 1e-5
    assert "strut.creep" in solution.to_dataset().state


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
def test_algebraic_state_solves_its_equation_from_the_start(formulation, integrator):
    """The start of an algebraic state is a guess; here a fixed-point iteration from it would not converge."""
    k, h, s, x0 = 0.3, 2.0, 0.05, 0.2

    def force(x):
        return brentq(lambda z: k * z + h * z**3 - x / s, -10, 10)

    m = Mechanism("spring")
    block = m.body("block", 1.0, UNIT, position=(x0, 0, 0))
    m.translational("guide", block, m.ground, axis=(1, 0, 0))
    m.force("spring", hardening, block.marker(), m.ground.marker(), parameters=(k, h, s), algebraic={"load": 0.1})
    solution = m.simulate(1.0, rate=200, formulation=formulation, integrator=integrator, tol=1e-9)
    assert solution.success, solution.message
    assert solution.load("spring")[0][0, 0] == pytest.approx(-force(x0), rel=1e-10)
    # index 3 controls positions only; between steps the state is interpolated
    np.testing.assert_allclose(
        solution.state("spring.load"),
        [force(x) for x in solution.com_position("block")[:, 0]],
        atol=5e-3 if formulation == "I3" else 1e-5,
    )
    end = solve_ivp(lambda t, y: [y[1], -force(y[0])], (0, 1), [x0, 0], rtol=1e-10, atol=1e-12).y[0, -1]
    assert solution.com_position("block")[-1, 0] == pytest.approx(end, abs=2e-5 if formulation == "I3" else 5e-6)


def falling() -> Mechanism:
    m = Mechanism("fall", gravity=(0, 0, -9.81))
    ball = m.body("ball", 0.5, UNIT)
    m.force("air", drag, ball.marker(), parameters=[0.2], diagnostics=[("air_power", "W", "dissipated")])
    return m


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
def test_drag_on_one_marker(formulation, integrator):
    """v = v_inf tanh(g t/v_inf), v_inf = sqrt(m g/c)."""
    solution = falling().simulate(1.5, rate=500, formulation=formulation, integrator=integrator, tol=1e-9)
    limit = np.sqrt(0.5 * 9.81 / 0.2)
    np.testing.assert_allclose(
        solution.com_velocity("ball")[:, 2], -limit * np.tanh(9.81 * solution.t / limit), atol=2e-6
    )
    assert solution.energy_balance().attrs["relative_imbalance"] < 1e-6


@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
def test_three_markers_have_a_wrench_each(formulation):
    """The relative way w of the middle swings with (1/m + 1/(4 m) + 1/(4 m)) k = 1.5 k/m; the centre stays."""
    m = Mechanism("three")
    bodies = [m.body(n, 2.0, UNIT, position=(x, y, 0)) for n, x, y in (("a", 0, 0), ("b", 1, 0.1), ("c", 2, 0))]
    m.force("lever", lever, *(body.marker(name=f"at {body.name}") for body in bodies), parameters=[50.0])
    solution = m.simulate(1.0, rate=200, formulation=formulation, tol=1e-9)
    assert solution.success, solution.message
    way = solution.com_position("b") - 0.5 * (solution.com_position("a") + solution.com_position("c"))
    np.testing.assert_allclose(way[:, 1], 0.1 * np.cos(np.sqrt(1.5 * 50 / 2) * solution.t), atol=2e-6)
    np.testing.assert_allclose(sum(solution.com_position(n) for n in "abc")[-1], (3, 0.1, 0), atol=1e-9)
    middle, side = solution.load("lever[1]")[0], solution.load("lever[2]")[0]
    np.testing.assert_allclose(side, -0.5 * middle, atol=1e-9)
    assert np.abs(middle).max() > 4.0
    assert solution.energy_balance().attrs["relative_imbalance"] < 1e-5


def tilted(name: str) -> Mechanism:
    """A body with markers off its centre and a second one, moving at random, under one of the forces."""
    rng = np.random.default_rng(5)
    m = Mechanism(name)
    bodies = []
    for k in range(3):
        turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        bodies.append(m.body(f"b{k}", 1.0, UNIT, position=rng.standard_normal(3), orientation=turn))
    i, j, k = (body.marker(rng.standard_normal(3), rng.standard_normal(3)) for body in bodies)
    forces = {
        "magnet": lambda: m.force("f", magnet, i, j, parameters=[0.7], diagnostics=["a", "b"]),
        "exact magnet": lambda: m.force(
            "f", magnet, i, j, parameters=[0.7], diagnostics=["a", "b"], derivatives=exact_magnet
        ),
        "maxwell": lambda: m.force("f", maxwell, i, j, parameters=[3, 2], states={"z": 0.1}, diagnostics=["a", "b"]),
        "hardening": lambda: m.force("f", hardening, i, j, parameters=[3, 2, 1], algebraic={"z": 0.1}),
        "drag": lambda: m.force("f", drag, i, parameters=[0.3], diagnostics=["a"]),
        "lever": lambda: m.force("f", lever, i, j, k, parameters=[4.0]),
    }
    forces[name]()
    return m


@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
@pytest.mark.parametrize("name", ["magnet", "exact magnet", "maxwell", "hardening", "drag", "lever"])
@pytest.mark.slow
def test_jacobian_equals_differences_of_the_residual(name, formulation):
    from gearmbs.dae.equations.jacobian import jacobian
    from gearmbs.dae.equations.residual import residual

    problem = tilted(name).compile().problem(formulation)
    rng = np.random.default_rng(1)
    n, work, cj, t = problem.n, np.zeros(problem.work_size), 2.7, 0.3
    y, yp = problem.y0 + 0.3 * rng.standard_normal(n), rng.standard_normal(n)
    vals = np.zeros(problem.indices.size)
    jacobian(t, y, yp, cj, vals, problem.idata, problem.rdata, work)
    exact = csc_array((vals, problem.indices, problem.indptr), shape=(n, n)).toarray()

    def evaluate(dy):
        out = np.zeros(n)
        residual(t, y + dy, yp + cj * dy, out, problem.idata, problem.rdata, work)
        return out

    h, columns = 1e-3, []
    for k in range(n):
        e = np.zeros(n)
        e[k] = h
        columns.append((8 * (evaluate(e) - evaluate(-e)) - (evaluate(2 * e) - evaluate(-2 * e))) / (12 * h))
    np.testing.assert_allclose(exact, np.array(columns).T, atol=2e-8 * max(1.0, np.abs(exact).max()))


def hanging() -> Mechanism:
    """A mass between a magnet's repulsion below and its weight: c/r^2 = m g; it swings with 2 c/(m r^3)."""
    m = Mechanism("float", gravity=(0, 0, -10.0))
    ball = m.body("ball", 0.1, UNIT, position=(0, 0, 0.3))
    m.translational("rail", ball, m.ground, axis=(0, 0, 1))
    m.force("magnet", magnet, ball.marker(), m.ground.marker(), parameters=[-0.04], diagnostics=["energy", "pull"])
    return m


def test_statics_and_modes():
    rest = static_equilibrium(hanging())
    assert rest.com_position("ball")[2] == pytest.approx(0.2, rel=1e-8)
    assert rest.stable
    modes = linear_modes(hanging(), at="equilibrium")
    frequency = np.abs(modes.eigenvalues).max()
    assert frequency == pytest.approx(np.sqrt(2 * 0.04 / (0.1 * 0.2**3)), rel=1e-6)
    rows = quasi_static(hanging(), np.array([0.0, 1.0]))
    assert rows.diagnostics("magnet")["pull"][-1] == pytest.approx(-1.0, rel=1e-6)


def test_an_own_state_takes_part_in_modes():
    """Mass on a Maxwell element: m s^2 (1 + c s/k) + c s = 0; one of a pair of conjugate values is listed."""
    m = Mechanism("damper")
    block = m.body("block", 2.0, UNIT)
    m.translational("guide", block, m.ground, axis=(1, 0, 0))
    m.force("strut", maxwell, block.marker(), m.ground.marker(), parameters=(300.0, 15.0), states={"creep": 0.0},
            diagnostics=["a", "b"])  # fmt: skip
    found = linear_modes(m).eigenvalues
    expected = np.roots([2.0 * 15.0 / 300.0, 2.0, 15.0, 0.0])
    for value in expected[np.abs(expected) > 1e-9]:
        assert min(np.abs(found - value).min(), np.abs(found - np.conj(value)).min()) < 1e-6 * abs(value)


def test_decks_refuse_it_by_name():
    with pytest.raises(ModelError, match=says("'magnet'", "Mechanism.load")):
        write_deck(magnets())


def nothing(t, frames, states, parameters, wrench, rates, diagnostics):
    pass


def no_frames(t, states):
    pass


def too_far(t, frames, states, parameters, wrench, rates, diagnostics):
    wrench[1, 0] = 1.0


def column_too_far(t, frames, states, parameters, jac):
    jac[0, 24] = 1.0


def adds_text(t, frames, states, parameters, wrench, rates, diagnostics):
    wrench[0, 0] = "1" + parameters[0]


def answers(t, frames, states, parameters, wrench, rates, diagnostics):
    return 3.0


def uses_objects(t, frames, states, parameters, wrench, rates, diagnostics):
    wrench[0, 0] = float(Mechanism is not None)


def imports(t, frames, states, parameters, wrench, rates, diagnostics):
    import math

    wrench[0, 0] = math.sin(t)


def halved(x):
    return 0.5 * x


def calls_a_plain_function(t, frames, states, parameters, wrench, rates, diagnostics):
    wrench[0, 0] = halved(t)


def not_finite(t, frames, states, parameters, wrench, rates, diagnostics):
    wrench[0, 0] = np.log(parameters[0])


def rate_not_finite(t, frames, states, parameters, wrench, rates, diagnostics):
    rates[0] = np.sqrt(parameters[0])


@pytest.mark.parametrize(
    ("kernel", "options", "words"),
    [
        (no_frames, {}, r"kernel has to take 7 arguments \(t, frames, states, parameters, wrench, .*\), it takes "),
        (3.0, {}, "kernel = 3.0 is not a function"),
        (too_far, {}, r"its kernel fails with IndexError: index 1.*wrench \(1, 6\)"),
        (adds_text, {"parameters": [1.0]}, "its kernel fails with (UFunc|Type)"),
        (answers, {}, "its kernel returns 3.0; let it write"),
        (uses_objects, {}, "numba cannot compile kernel.*hand over what else it needs"),
        (imports, {}, "numba cannot compile kernel.*IMPORT_NAME"),
        (calls_a_plain_function, {}, "kernel.*halved.*numba.njit"),
        (nothing, {"parameters": {"stiffness": np.nan}}, "parameter stiffness = nan; give a finite number"),
        (nothing, {"parameters": ["a"]}, "give numbers, one a parameter"),
        (nothing, {"parameters": [[1.0]]}, r"parameters have the shape \(1, 1\)"),
        (nothing, {"states": ["flow"]}, r"state 'flow' has no start; give states=\{'flow': 0\.0\}"),
        (nothing, {"algebraic": "p"}, r"state 'p' has no start; give algebraic=\{'p': 0\.0\}"),
        (nothing, {"states": {"flow": np.inf}}, "state 'flow' starts at inf; give a finite number"),
        (nothing, {"states": {"z": 0.0}, "algebraic": {"z": 0.0}}, "state 'z' is given twice"),
        (nothing, {"diagnostics": [("heat", "W", "lost")]}, "'heat' has the role 'lost'; choose one of stored"),
        (nothing, {"diagnostics": [3]}, "diagnostic 3; give a name"),
        (nothing, {"derivatives": no_frames}, r"derivatives has to take 5 arguments \(t, frames, .*\), it takes "),
        (nothing, {"derivatives": column_too_far}, r"its derivatives fails with IndexError: index 24.*jac \(6, 24\)"),
        (nothing, {"steps": {"way": 1.0}}, "steps has no 'way'; there are length, angle"),
        (nothing, {"steps": {"length": 0.0}}, r"steps: length = 0\.0; it must be positive"),
    ],
)  # fmt: skip
def test_errors_name_the_force_and_a_remedy(kernel, options, words):
    m = Mechanism("m")
    i, j = m.body("b", 1.0, UNIT).marker(), m.ground.marker()
    with pytest.raises(ModelError, match=f"(?s)force 'own': .*{words}"):
        m.force("own", kernel, i, j, **options)


def test_markers_and_values_are_checked():
    m = Mechanism("m")
    body = m.body("b", 1.0, UNIT)
    with pytest.raises(ModelError, match=says("force 'own'", "give the markers")):
        m.force("own", nothing)
    with pytest.raises(ModelError, match="force 'own': 'tip' is not a marker"):
        m.force("own", nothing, "tip")
    with pytest.raises(ModelError, match=says("body 'other'", "mechanism 'm'")):
        m.force("own", nothing, Mechanism("n").body("other", 1.0, UNIT).marker())
    m.force("own", not_finite, body.marker(), parameters=[-1.0])
    with pytest.raises(ModelError, match=says("force 'own'", "t = 0 s", "finite")):
        m.simulate(0.1)
    m = Mechanism("m")
    m.force("own", rate_not_finite, m.body("b", 1.0, UNIT).marker(), parameters=[-1.0], states={"z": 0.0})
    with pytest.raises(ModelError, match=says("rate", "t = 0 s", "finite", "state 'own.z'")):
        m.simulate(0.1)


@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("strength", [0.0, 0.1])
def test_a_state_whose_equation_has_no_solution_ends_the_run(strength, integrator):
    """z^2 = 1 - t, whether the force is made of z or not: nothing beyond 1 s, and sqrt(1 - t) before."""

    def folded(t, frames, states, parameters, wrench, rates, diagnostics):
        z = states[0]
        rates[0] = z + z * z + t - 1.0
        wrench[0, 0] = parameters[0] * z

    m = Mechanism("m")
    body = m.body("b", 1.0, UNIT)
    m.force("valve", folded, body.marker(), m.ground.marker(), parameters=[strength], algebraic={"z": 1.0})
    beyond = m.simulate(2.0, rate=50.0, integrator=integrator)
    assert not beyond.success
    assert beyond.result.t_last == pytest.approx(1.0, abs=1e-4)
    assert "valve.z" in beyond.message
    assert "seems to end there" in beyond.message
    before = m.simulate(0.98, rate=50.0, integrator=integrator)
    assert before.success, before.message
    # x'' = strength sqrt(1 - t)
    left = 0.02
    place = strength * (4.0 / 15.0 * left**2.5 - 4.0 / 15.0 + 2.0 / 3.0 * 0.98)
    x = before.problem.names.index(next(name for name in before.problem.names if name.startswith("R_x")))
    assert before.result.y[-1, x] == pytest.approx(place, abs=1e-5)


@njit(FORCE_SIG, nogil=True, error_model="numpy")
def bumper(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Along global x: a one-sided spring, dry and quadratic friction; ``ints`` says which derivative is wrong."""
    k, c, dry, wrong = reals[0], reals[1], reals[2], ints[0]
    x, v = frames[0, 0] - frames[1, 0], frames[0, 12] - frames[1, 12]
    wrench[0, 0] = -k * max(x, 0.0) - c * abs(v) * v - dry * np.sign(v)
    if want & DERIVATIVES:
        jac[0, 0] = -k if x > 0.0 else 0.0
        jac[0, 6] = -2.0 * c * abs(v)
        if wrong == 1:
            jac[0, 6] *= -1.0
        elif wrong == 2:
            jac[0, 6] = 0.0
        elif wrong == 3:
            jac[0, 0] *= 1.01
        elif wrong == 4:
            jac[0, 4] = 0.01 * k
        jac[0, 12], jac[0, 18] = -jac[0, 0], -jac[0, 6] if wrong != 5 else 0.0


@dataclass(eq=False, repr=False)
class Bumper(ForceElement):
    """See `bumper`."""

    wrong: int = 0
    numbers: tuple[float, float, float] = (1e4, 3.0, 2.0)

    kind = "bumper"
    has_torque = False

    def compiled(self):
        if self.wrong < 0:
            raise KeyError("stiffness")
        return Compiled(bumper, integers=(self.wrong,), reals=self.numbers)


def bumped(wrong: int, place: float = 0.0, numbers: tuple[float, float, float] = (1e4, 3.0, 2.0)) -> Mechanism:
    m = Mechanism("bumped", gravity=(0, 0, 0))
    block = m.body("block", 1.0, UNIT, position=(place, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    m.add(Bumper("stop", block.marker(name="nose"), m.ground.marker(name="wall"), wrong, numbers))
    return m


@pytest.mark.parametrize(("wrong", "entry", "names"), [
    (1, "jac[0, 6]", "Fx by the velocity x of marker 'nose'"), (2, "jac[0, 6]", "is 0;"), (3, "jac[0, 0]", "place x"),
    (4, "jac[0, 4]", "rotation y"), (5, "jac[0, 18]", "marker 'wall'"),
])  # fmt: skip
def test_a_wrong_derivative_of_a_family_is_named(wrong, entry, names, monkeypatch):
    monkeypatch.setattr(derivatives, "_TRIED", WeakSet())
    with pytest.raises(ModelError, match=says("bumper 'stop'", entry, names, "differences")):
        bumped(wrong).compile()


@pytest.mark.parametrize("place", [-1.0, -1e-9, 0.0, 1e-9, 0.2])
def test_right_derivatives_beside_kinks_and_jumps_are_not_refused(place, monkeypatch):
    rng = np.random.default_rng([7, int(1e9 * abs(place))])
    for _ in range(20):
        monkeypatch.setattr(derivatives, "_TRIED", WeakSet())
        bumped(0, place, tuple(10.0 ** rng.uniform(-4, 9, 3))).compile()


@pytest.mark.slow
def test_derivatives_given_beside_a_function_are_compared_too():
    @njit
    def opposite(t, frames, states, parameters, jac):
        exact_magnet(t, frames, states, -parameters, jac)

    for given, fits in ((exact_magnet, True), (opposite, False)):
        m = Mechanism("m", gravity=(0, 0, 0))
        body = m.body("b", 1.0, UNIT, position=(1.0, 0.2, 0.3))
        m.force("magnet", magnet, body.marker(), m.ground.marker(), parameters=[2.0], derivatives=given,
                diagnostics=[("energy", "J", "stored"), ("size", "N")])  # fmt: skip
        if fits:
            m.compile()
        else:
            with pytest.raises(ModelError, match=says("force 'magnet'", "jac[", "differences")):
                m.compile()


@dataclass(eq=False, repr=False)
class Buffer(ForceElement):
    """A bumper with a stiffness of its own."""

    stiffness: float
    kernel: Any = bumper

    kind = "buffer"
    has_torque = False

    def compiled(self):
        return Compiled(self.kernel, integers=(0,), reals=(self.stiffness, 3.0, 2.0))


class ReadingBuffer(Buffer):
    """One that reads texts with units."""

    reads: ClassVar = {"stiffness": reader("N/m")}


def buffered(kind, *given) -> ForceElement:
    m = Mechanism("buffered")
    block = m.body("block", 1.0, UNIT, position=(0.1, 0.0, 0.0))
    m.add(kind("stop", block.marker(), m.ground.marker(), *given))
    m.compile()
    return m.elements["stop"]


def test_texts_with_units_are_read_or_named():
    with pytest.raises(ModelError, match=says("buffer 'stop'", "stiffness = '2 N/mm'", "reads", "reader")):
        buffered(Buffer, "2 N/mm")
    element = buffered(ReadingBuffer, "2 N/mm")
    assert element.stiffness == 2000.0
    element.stiffness = "3 N/mm"
    assert element.stiffness == 3000.0
    with pytest.raises(ModelError, match=says("ReadingBuffer 'stop'", "stiffness", "2 mm")):
        buffered(ReadingBuffer, "2 mm")
    with pytest.raises(ModelError, match=says("buffer 'stop'", "kernel", "TypeError")):
        buffered(Buffer, 2000.0, njit("void(float64)")(lambda x: None))


def test_failures_of_parts_that_a_user_wrote_name_the_part(monkeypatch):
    with pytest.raises(ModelError, match=says("bumper 'stop'", "compiled()", "stiffness")):
        bumped(-1).compile()
    monkeypatch.setitem(JOINTS, "broken", JointKind(lambda i, j: [i.no_such_thing]))
    m = bumped(0)
    with pytest.raises(ModelError, match=says("broken joint 'pin'", "JOINTS['broken']", "no_such_thing")):
        m.joint("broken", "pin", m.bodies["block"].marker(), m.ground.marker())
