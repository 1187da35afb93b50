"""Bodies with modes as FLEX_BODY with neutral files beside the deck: written, read and run again."""

import numpy as np
import pytest

from gearmbs.adams import parse_script, read_deck, run_deck, write_deck
from gearmbs.adams.builders.flexible import modal_ratios
from gearmbs.adams.write.elements import damping_text
from gearmbs.flexible import Shaft, ShaftSection, mnf_of, read_mnf, write_mnf
from gearmbs.mechanism import Mechanism, ModelError, add_modal_force
from tests.says import says

SHAFT = Shaft([ShaftSection(0.6, 0.02)], seats={"A": 0.0, "B": 0.6}, elements=6, name="shaft")
END, STEPS = 0.02, 20


def running(model, coupling):
    """A shaft that spins on two bushings and starts bent, pulled at a place between nodes off its axis."""
    m = Mechanism("rotor", gravity=(0, -9.81, 0))
    start = np.zeros(model.modes)
    start[0] = 2e-5
    body = model.add_to(
        m, "shaft", damping=[0.01] * 2 + [0.03] * (model.modes - 2), coupling=coupling, start=start,
        position=(0.1, 0.2, 0.0), velocity=(0.0, 0.1, 0.0), angular_velocity=(1.0, 0.0, 100.0),
    )  # fmt: skip
    body.rate[1] = 1e-3
    for seat in ("A", "B"):
        place = model.place(seat) if seat in model.seats else model.place(f"node {1 if seat == 'A' else 7}")
        at = place + (0.1, 0.2, 0.0)
        m.bushing(seat, body.marker(place), m.ground.marker(at), stiffness=(1e6,) * 3, damping=(100.0,) * 3)
    return m, body


def again(m, path):
    write_deck(m, path)
    deck = read_deck(path)
    result = run_deck(deck, parse_script(f"SIMULATE/DYNAMICS,END={END},STEPS={STEPS}\n"), tol=1e-9)
    assert result.success, result.messages
    return result.segments[0].solution


@pytest.mark.parametrize("coupling", ["full", "partial", "constant"])
def test_a_body_of_a_neutral_file_moves_as_before(tmp_path, coupling):
    write_mnf(tmp_path / "a.mnf", mnf_of(SHAFT.modal_model().slowest(6)))
    m, _ = running(read_mnf(tmp_path / "a.mnf").modal_model("shaft"), coupling)
    expected = m.simulate(END, t_eval=np.linspace(0, END, STEPS + 1), tol=1e-9)
    found = again(m, tmp_path / "deck.adm")
    name = found.system.body_names[0]
    q = expected.modal_coordinates("shaft")
    np.testing.assert_allclose(found.modal_coordinates(name), q, atol=1e-6 * np.abs(q).max())
    np.testing.assert_allclose(found.com_position(name), expected.com_position("shaft"), atol=1e-8)
    np.testing.assert_allclose(found.modal_velocities(name)[0, 1], 1e-3, rtol=1e-9)


@pytest.mark.slow
def test_markers_off_the_nodes_become_nodes_without_mass(tmp_path):
    """A neutral file has masses at nodes, so that the inertia is off by what falls with the square of their number."""
    errors = []
    for elements in (12, 24):
        shaft = Shaft([ShaftSection(0.6, 0.02)], seats={"A": 0.0, "B": 0.6}, elements=elements, name="shaft")
        m, body = running(shaft.modal_model().slowest(6), "full")
        edge = body.marker((0.01, 0.0, 0.26), name="edge")
        m.load("pull", edge, m.ground.marker((0.1, 0.2, 0.26)), rm=m.ground.marker(), fx="200*SIN(1000*TIME)")
        expected = m.simulate(END, t_eval=np.linspace(0, END, STEPS + 1), tol=1e-9)
        found = again(m, tmp_path / "deck.adm")
        mnf = read_mnf(tmp_path / "deck_shaft.mnf")
        assert mnf.ids.tolist() == list(range(1, elements + 3))
        assert mnf.nodal_masses[-1] == 0.0
        np.testing.assert_allclose(mnf.positions[-1], [0.01, 0.0, 0.26])
        q = expected.modal_coordinates("shaft")
        errors.append(np.abs(found.modal_coordinates(found.system.body_names[0]) - q).max() / np.abs(q).max())
    assert errors[1] < 0.02
    assert 3.0 < errors[0] / errors[1] < 5.0


def test_a_body_without_markers_gets_one_in_the_deck_alone(tmp_path):
    m = Mechanism("free")
    body = SHAFT.modal_model().slowest(6).add_to(m, "shaft", damping=0.01, angular_velocity=(0.0, 2.0, 0.0))
    spun = again(m, tmp_path / "deck.adm")
    assert not body.markers
    np.testing.assert_allclose(spun.angular_velocity(spun.system.body_names[0])[0], [0.0, 2.0, 0.0], atol=1e-12)


def test_damping_of_each_mode_is_an_expression():
    ratios = np.array([0.01, 0.01, 0.02, 0.5, 0.5, 1.0])
    text = damping_text(ratios)
    assert text.count("IF(") == 3
    np.testing.assert_array_equal(modal_ratios(text, np.ones(6), np.arange(7, 13)), ratios)
    assert damping_text(ratios[:2]) == "0.01"


@pytest.mark.slow
def test_what_no_neutral_file_holds_is_named(tmp_path):
    m, body = running(SHAFT.modal_model().slowest(6), "full")
    with pytest.raises(ModelError, match=says("path", "give the deck's")):
        write_deck(m)
    m.load(
        "back", m.ground.marker(), body.marker(SHAFT.modal_model().slowest(6).place("A")), rm=m.ground.marker(), fx="1"
    )
    with pytest.raises(ModelError, match=says("body 'shaft'", "force", "marker")):
        write_deck(m, tmp_path / "deck.adm")
    m, body = running(SHAFT.modal_model().slowest(6), "full")
    add_modal_force(m, "wind", body, np.eye(12)[6], "1")
    with pytest.raises(ModelError, match=says("modal", "shapes", "forces", "own")):
        write_deck(m, tmp_path / "deck.adm")
    spun, _ = running(SHAFT.modal_model(spin="A").slowest(6), "full")
    with pytest.raises(ModelError, match="no stiffening by spin"):
        write_deck(spun, tmp_path / "deck.adm")
