"""Whirl of flexible bodies by the linear modes of a mechanism, against rotors with all their degrees of freedom."""

import warnings

import numpy as np
import pytest

from gearmbs.dae.analyses.turning import generator
from gearmbs.flexible import Disc, ElasticMaterial, Rotor, Shaft, ShaftSection, Support
from gearmbs.mechanism import Mechanism, linear_modes

STEEL = ElasticMaterial(youngs_modulus="211 GPa", shear_modulus="81.2 GPa", density=7810)
SHAFT = Shaft(
    [ShaftSection("1500 mm", "50 mm")],
    [
        Disc("0.5 m", outer="280 mm", width="70 mm", inner="50 mm"),
        Disc("1 m", outer="350 mm", width="70 mm", inner="50 mm"),
    ],
    {"left": 0, "right": "1500 mm"},
    STEEL,
)
"""Example 5.9.1 of M. Friswell and others, Dynamics of Rotating Machines (2010)."""

MODEL = SHAFT.modal_model()


def supported(model, spin, turn=None, **options):
    """The shaft on two springs, turning; in any direction of space and phase."""
    frame = np.eye(3) if turn is None else turn
    m = Mechanism("rotor", gravity=(0, 0, 0))
    body = model.add_to(m, orientation=frame, angular_velocity=frame @ [0, 0, spin], **options)
    for seat in ("left", "right"):
        place = model.place(seat)
        m.bushing(seat, body.marker(place, name=seat), m.ground.marker(frame @ place, frame), stiffness=(1e6, 1e6, 1e6))
    return m


def whirl(modes):
    return np.sort(modes.eigenvalues.imag[modes.eigenvalues.imag > 1.0])


def direction(seed):
    from scipy.spatial.transform import Rotation

    return Rotation.random(random_state=seed).as_matrix()


@pytest.mark.parametrize("turn", [None, direction(1)])
@pytest.mark.parametrize("rpm", [0.0, 4000.0, -4000.0, 9000.0])
def test_a_shaft_whirls_as_a_rotor_with_all_degrees_of_freedom(rpm, turn):
    spin = rpm * np.pi / 30
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        modes = linear_modes(supported(MODEL, spin, turn, damping=0.0))
    rotor = Rotor(SHAFT, [Support("left", "1 kN/mm"), Support("right", "1 kN/mm")])
    exact = np.sort(rotor.modes(abs(spin), 6).frequencies)
    found = whirl(modes)
    found = found[[int(np.argmin(np.abs(found - e))) for e in exact]]
    np.testing.assert_allclose(found[:4], exact[:4], rtol=1e-5)
    np.testing.assert_allclose(found, exact, rtol=3e-4)
    assert np.abs(modes.eigenvalues.real).max() < 1e-8 * found[-1]
    if rpm == 4000.0:
        np.testing.assert_allclose(found[:4], [85.39, 87.80, 251.78, 294.71], atol=0.006)
        # the split of each pair by gyroscopic moments, twenty times the tolerance of the frequencies and more
        np.testing.assert_allclose(found[1] - found[0], exact[1] - exact[0], rtol=1e-5)


@pytest.mark.slow
def test_damping_inside_a_shaft_drives_it_above_its_critical_speed():
    """What turns with the shaft damps it below the frequency of its forward whirl and drives it above."""
    rotor = Rotor(SHAFT, [Support("left", "1 kN/mm"), Support("right", "1 kN/mm")])
    critical = rotor.critical_speeds(2)[1]
    stable = [
        linear_modes(supported(MODEL, share * critical, damping=0.01)).stable for share in (0.0, 0.5, 0.98, 1.02, 2.0)
    ]
    assert stable == [True, True, True, False, False]


def test_the_generator_is_that_of_the_planes_of_bending():
    body = supported(MODEL, 100.0).bodies["shaft"]
    found = generator(body.modal, np.array([0.0, 0.0, 1.0]))
    assert found.known
    speeds = np.sort(np.abs(np.linalg.eigvals(found.matrix).imag))
    bending = int(np.sum((MODEL.moved[:, :, :2] ** 2).sum(axis=(1, 2)) > 1e-12))
    np.testing.assert_allclose(speeds, [0.0] * (MODEL.modes - bending) + [1.0] * bending, atol=1e-6)
    assert generator(body.modal, np.array([1.0, 0.0, 0.0])) is None


@pytest.mark.slow
def test_waves_round_a_ring_turn_by_their_number_as_far_as_integrals_tell():
    pytest.importorskip("skfem")
    from gearmbs.flexible import Interface, reduce_model, ring_mesh, solid_model

    model = solid_model(ring_mesh(0.16, 0.2, 0.02, (1, 16, 1)), name="ring")
    body = (
        reduce_model(model, [Interface("rim", list(model.ids), "average")], method="free")
        .slowest(8)
        .add_to(Mechanism("m"))
    )
    found = generator(body.modal, np.array([0.0, 0.0, 1.0]))
    assert not found.known
    speeds = np.abs(np.linalg.eigvals(found.matrix).imag)
    assert np.sum(np.abs(speeds - 2.0) < 1e-3) == 2
    # two waves across and three within the plane are told against each other alone
    assert body.modal.modes - np.sum(np.abs(speeds - np.round(speeds)) < 1e-3) == 4


@pytest.mark.parametrize("kind", ["one plane", "partial", "across"])
def test_what_is_not_alike_about_its_axis_is_warned_of(kind):
    model = MODEL.selected([0, 2]) if kind == "one plane" else MODEL
    m = supported(model, 100.0, coupling="partial" if kind == "partial" else "full")
    if kind == "across":
        m.bodies["shaft"].angular_velocity = np.array([100.0, 0.0, 0.0])
    reason = "gyroscopic" if kind == "partial" else "not alike"
    with pytest.warns(UserWarning, match=reason):
        linear_modes(m)


def test_unequal_damping_of_the_planes_is_not_alike():
    ratios = np.full(MODEL.modes, 0.01)
    ratios[0] = 0.03
    with pytest.warns(UserWarning, match="is not alike"):
        linear_modes(supported(MODEL, 100.0, damping=list(ratios)))
