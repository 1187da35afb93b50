"""Every fault and modification on every kind of wheel: it changes the mesh, and derivatives stay exact."""

import numpy as np
import pytest

from gearmbs.gears import FlankFriction, GearPair, GearSpec, faults
from gearmbs.gears.transmission import StaticMesh
from tests.contact.probe_tools import Contact, differences, shaken

HELIX = {"helix_angle": "15 deg"}
KINDS = {
    "external": (GearSpec(23, "3 mm"), GearSpec(37, "3 mm")),
    "internal": (GearSpec(23, "3 mm"), GearSpec.ring(70, "3 mm")),
    "helical": (GearSpec(23, "3 mm", **HELIX), GearSpec(37, "3 mm", hand="left", **HELIX)),
    "internal helical": (GearSpec(23, "3 mm", **HELIX), GearSpec.ring(70, "3 mm", **HELIX)),
}
FAULTS = {
    kind.__name__: kind
    for kind in vars(faults).values()
    if isinstance(kind, type) and issubclass(kind, faults.Fault) and kind is not faults.Fault
}
SETTINGS = {"Pit": {"width": "6 mm", "height": "1.5 mm"}, "RootRelief": {"amount": "30 um"}, "Waviness": {"waves": 46}}


def pair_with(kind, fault):
    one, two = KINDS[kind]
    pair = GearPair(one, two, backlash="0.4 mm", friction=FlankFriction.none(), faults=() if fault is None else [fault])
    if fault is not None and fault.label == "root crack":
        return pair.with_potential_energy_stiffness(damping="1 N s/mm")
    return pair


def torques(pair, angles, depth):
    """Torque on the driven wheel at a depth beyond where perfect wheels touch."""
    mesh = StaticMesh(pair, 12)
    turn = depth / pair.driven.base_radius
    return np.array([mesh.torque(a, mesh.ideal_angle(a) + mesh.turning * turn)[0] for a in angles])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("wheel", ["driver", pytest.param("driven", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", FAULTS)
def test_effect_and_derivatives(name, wheel, kind):
    fault = FAULTS[name](wheel=wheel, **SETTINGS.get(name, {}))
    pair = pair_with(kind, fault)
    plain = pair.with_changes(faults=())
    teeth = (pair.driver if wheel == "driver" else pair.driven).teeth
    # around the passage of tooth 0 of the faulty wheel, where all these faults show
    turns = np.linspace(0, 2 * np.pi / pair.driver.teeth * teeth, 12 * teeth, endpoint=False)
    depth = 4e-5
    change = abs(torques(pair, turns, depth) - torques(plain, turns, depth))
    load = abs(torques(plain, turns[:12], depth)).max()
    assert change.max() > 1e-3 * load
    at = float(turns[int(change.argmax())])
    contact = Contact(pair, 12)
    state = contact.state(at, 0.0, 50.0)
    place = pair.frames(at, contact.mesh.ideal_angle(at) + contact.mesh.turning * depth / pair.driven.base_radius)
    state[0], state[1], state[4], state[5] = place.origin_1, place.axes_1, place.origin_2, place.axes_2
    state = shaken(state, np.random.default_rng(4), shift=2e-6)
    contact(state, 1)
    exact = contact.jac.copy()
    scale = abs(exact).max(axis=0)
    # a quotient across a change of contact is no derivative: of several steps the best counts
    errors = [abs(differences(contact, state, share) - exact).max(axis=0) / scale for share in (0.5, 0.1, 0.02)]
    assert np.min(errors, axis=0).max() < 1e-6
