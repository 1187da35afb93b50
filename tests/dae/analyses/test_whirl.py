"""Modes of what spins, against closed forms: gyroscopic couples do not depend on how a body is described."""

import numpy as np
import pytest

from gearmbs.mechanism import Mechanism

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
