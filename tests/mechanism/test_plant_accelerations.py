"""Accelerations of bodies that deform as outputs of plants: against simulated velocities and against their rates."""

from __future__ import annotations

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mode, ModelError, ShapeIntegrals
from tests.dae.equations.test_modal_body import cantilever, joined
from tests.says import says

OUTPUTS = [f"{function}{c}(I)" for function in ("ACC", "WDT") for c in "XYZ"]
RATES = [f"{function}{c}(I)" for function in ("V", "W") for c in "XYZ"]


@pytest.mark.filterwarnings("ignore:.*coefficients of the linearised equations vary")
def test_values_are_the_slopes_of_simulated_velocities():
    """Of a body that flies, tumbles and vibrates: fourth-order differences of a run's velocities."""
    h, t = 1e-4, 0.3
    sim = gm.Simulator(joined("spring"), 1.0, tol=1e-11)
    sim.advance(t)
    plant = joined("spring").linearize([("force", "block", "x")], [*OUTPUTS, "ACCX(I, J, J)"], at=sim.state())
    told = [sim.get("evaluate", name) for name in (*OUTPUTS, "ACCX(I, J, J)")]
    assert plant.point.outputs == pytest.approx(told, rel=1e-9)
    again, rows = gm.Simulator(joined("spring"), 1.0, tol=1e-11), []
    for k in (-2, -1, 1, 2):
        again.advance(t + k * h)
        rows.append([again.get("evaluate", name) for name in RATES])
    rows = np.array(rows)
    slope = (8.0 * (rows[2] - rows[1]) - (rows[3] - rows[0])) / (12.0 * h)
    np.testing.assert_allclose(plant.point.outputs[:6], slope, atol=1e-6 * np.abs(slope).max())


def spinning(w=20.0):
    """A mass on a radial spring of 900 N/m on a hub, both turning at a speed that is prescribed, deflected steadily."""
    hub, tip, r, k = 3.0, 0.4, 0.5, 900.0
    com = np.array([tip * r / (hub + tip), 0, 0])
    arms = np.array([[0, 0, 0], [r, 0, 0]]) - com
    inertia = 1e-3 * np.eye(3) + sum(m * ((s @ s) * np.eye(3) - np.outer(s, s)) for m, s in zip((hub, tip), arms))
    steady = tip * w**2 * r / (k - tip * w**2)
    m = gm.Mechanism("arm")
    body = m.modal_body(
        "arm", hub + tip, inertia, [Mode(stiffness=k, start=steady)],
        lambda p: ([[p[0] / r, 0, 0]], [[0, 0, p[0]]]), com=com,
        integrals=ShapeIntegrals.of_points([hub, tip], arms, np.array([[[0, 0, 0], [1.0, 0, 0]]])),
        angular_velocity=(0, 0, w),
    )  # fmt: skip
    body.marker((r, 0, 0), name="I")
    m.rotation("drive", m.revolute("pin", body, m.ground, at=(0, 0, 0), axis=(0, 0, 1)), f"{w}*TIME")
    return m, w, r + steady


@pytest.mark.slow
def test_where_a_body_spins_they_change_as_those_of_states_beside():
    """Against outputs of states with another deflection and rate, and -w^2 r, 2 w r' of a frame that turns."""
    m, w, reach = spinning()
    sim = gm.Simulator(m, 1.0, tol=1e-10)
    sim.advance(0.05)
    asked = [*OUTPUTS, 'MODAL("arm", 1)', 'MODAL1("arm", 1)']
    still = sim.state().changed({"v_f_1(arm)": 0.0})

    def outputs(name, by):
        return m.linearize([], asked, at=still.changed({name: still[name] + by})).point.outputs

    plant, angle = m.linearize([], asked, at=still), 0.05 * w
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    assert plant.point.outputs[:2] == pytest.approx(-reach * w**2 * along, rel=1e-5)
    # by the amount of the mode and its rate, whatever the coordinate is
    by_mode = plant.C[:6] @ np.linalg.inv(plant.C[6:])
    for name in ("q_f_1(arm)", "v_f_1(arm)"):
        moved = (outputs(name, 1e-5) - outputs(name, -1e-5)) / 2e-5
        np.testing.assert_allclose(by_mode @ moved[6:], moved[:6], atol=1e-6 * np.abs(by_mode).max(), err_msg=name)
    assert by_mode[:2, 1] @ across == pytest.approx(2.0 * w, rel=1e-6)


def test_at_rest_they_are_the_rates_of_velocities():
    """C_a = C_v A and D_a = C_v B, of a cantilever that is pushed at its end and deflected by a load."""
    m = cantilever(damping=0.05)
    end = m.bodies["bar"].markers[0]
    tip = m.body("tip", 0.2, (1e-4, 1e-4, 1e-4), position=(1, 0, 0))
    m.revolute("held", tip, m.bodies["bar"], at=(1, 0, 0))
    m.load("push", end, m.ground.marker((1, 0, 0)), rm=m.ground.marker(), fy=7.0)
    push = ("force", "tip", "y")
    fast = m.linearize([push], [("marker_acceleration", "end", "y"), "WDTZ(end)"], at="equilibrium")
    slow = m.linearize([push], [("marker_velocity", "end", "y"), "WZ(end)"], at="equilibrium")
    np.testing.assert_allclose(fast.C, slow.C @ slow.A, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(fast.D, slow.C @ slow.B, rtol=1e-9)
    assert abs(fast.D[0, 0]) > 0.1


@pytest.mark.filterwarnings("ignore:.*coefficients of the linearised equations vary")
def test_components_along_what_deforms_are_refused_and_those_along_a_rigid_body_are_not():
    m = joined("spring")
    with pytest.raises(ModelError, match=says("ACCX(I,J,K)", "cloud", "rigid body")):
        m.linearize([], ["ACCX(I,J,K)"])
    assert m.linearize([], ["ACCX(I,J,J)"]).C.shape[0] == 1
