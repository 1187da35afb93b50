"""Views of bodies that deform."""

import numpy as np
import pytest

from gearmbs.flexible import Rotor, Shaft, ShaftSection, Support, block_mesh, reduce_model, solid_model
from gearmbs.mechanism import Mechanism
from gearmbs.view import deformation_animation, deformed_plot, modal_energy_plot, mode_animation, whirl_plot

SHAFT = Shaft([ShaftSection("1 m", "100 mm")], seats={"A": 0.0, "B": 1.0})


@pytest.mark.slow
def test_a_mode_is_drawn_and_moves(tmp_path):
    model = SHAFT.modal_model().slowest(6)
    figure = deformed_plot(model, np.eye(model.modes)[0])
    axes = figure.axes[0]
    still, bent = (np.array(line.get_data_3d()) for line in axes.lines)
    moved = np.linalg.norm(bent - still, axis=0)
    # a tenth of the body's size
    np.testing.assert_allclose(moved.max(), 0.1, rtol=1e-9)
    film = mode_animation(model, 1)
    np.testing.assert_allclose(film.coordinates[0], -film.coordinates[len(film.coordinates) // 2], atol=1e-12)
    from PIL import Image

    short = type(film)(model, film.coordinates[:3], film.titles[:3], film.factor)
    with Image.open(short.save(tmp_path / "mode.gif")) as picture:
        assert picture.n_frames == 3
    with pytest.raises(ValueError, match=r"ends in \.gif or \.mp4"):
        film.save(tmp_path / "mode.avi")
    with pytest.raises(ValueError, match=r"mode is 7; .* has modes 1 to "):
        mode_animation(model, 7)


@pytest.mark.slow
def test_faces_are_coloured_by_their_deflection():
    pytest.importorskip("skfem")
    model = reduce_model(solid_model(block_mesh((0.3, 0.2, 0.02), (4, 3, 1))), [], modes=6, method="free")
    figure = deformed_plot(model, np.eye(6)[0], factor=1e-3, title="plate")
    assert figure.axes[0].get_title() == "plate"
    assert len(figure.axes[0].collections) == 2


def test_energy_by_mode_and_film_of_a_solution():
    model = SHAFT.modal_model().slowest(8)
    m = Mechanism("shaft")
    body = model.add_to(m, "shaft", damping=0.02)
    for seat in ("A", "B"):
        place = model.place(seat)
        m.bushing(seat, body.marker(place), m.ground.marker(place), stiffness=(1e8,) * 3)
    centre = body.marker((0, 0, 0.5), name="centre")
    m.load("strike", centre, m.ground.marker((0, 0, 0.5)), rm=m.ground.marker(), fx="1000*STEP(TIME,0,0,1E-3,1)")
    found = m.simulate(0.005, rate=10_000)
    panel = modal_energy_plot(model, found, "shaft", shown=2).axes[0]
    total = sum(np.asarray(line.get_ydata()) for line in panel.lines)
    np.testing.assert_allclose(total, model.strain_energies(found.modal_coordinates("shaft")).sum(axis=1), rtol=1e-12)
    film = deformation_animation(model, found, "shaft", every=10)
    assert len(film.titles) == len(film.coordinates) == 6
    largest = max(
        np.linalg.norm(model.displaced(q, film.factor) - model.positions, axis=1).max() for q in film.coordinates
    )
    np.testing.assert_allclose(largest, 0.1, rtol=1e-9)


def test_whirl_splits_with_the_speed():
    rotor = Rotor(SHAFT, [Support("A", 1e8), Support("B", 1e8)])
    diagram = rotor.campbell(["0 rpm", "5000 rpm", "10000 rpm"], 4)
    panel = whirl_plot(diagram, orders=(1, 2)).axes[0]
    shown = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in panel.lines])
    for frequency in diagram.frequencies.ravel() / (2 * np.pi):
        assert np.nanmin(np.abs(shown - frequency)) < 1e-9
    assert panel.get_xlabel().startswith("speed")
    marked = whirl_plot(diagram, operating=["4000 rpm", 500.0]).axes[0]
    upright = [line.get_xdata()[0] for line in marked.lines if len(set(line.get_xdata())) == 1]
    np.testing.assert_allclose(upright, [4000.0, 500.0 * 30 / np.pi])
