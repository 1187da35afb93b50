"""Bodies that deform in scenes: where their surfaces are, and what the page makes of them."""

import numpy as np
import pytest

from gearmbs.flexible import Disc, Shaft, ShaftSection, block_mesh, reduce_model, solid_model
from gearmbs.flexible.interfaces import outward
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.view import Deflection, Mesh, mechanism_scene, solution_scene, stress_plot
from gearmbs.view.mesh import box
from tests.says import says

SHAFT = Shaft(
    [ShaftSection(0.3, 0.02), ShaftSection(0.2, 0.04, outer_end=0.03), ShaftSection(0.3, 0.02)],
    [Disc(0.4, outer=0.16, width=0.03, inner=0.03)],
    {"left": 0.0, "disc": 0.4, "right": 0.8},
)


@pytest.fixture(scope="module")
def run():
    """Return model and solution of a struck shaft on two bushings."""
    model = SHAFT.modal_model().slowest(8)
    m = Mechanism("rotor")
    body = model.add_to(m, "shaft", damping=0.02, angular_velocity=(0, 0, 50.0))
    for seat in ("left", "right"):
        place = model.place(seat)
        m.bushing(seat, body.marker(place), m.ground.marker(place), stiffness=(1e7,) * 3, damping=(1e3,) * 3)
    disc = body.marker((0, 0, 0.4), name="disc")
    m.load("strike", disc, m.ground.marker((0, 0, 0.4)), rm=m.ground.marker(), fx="3000*STEP(TIME,0,0,1E-3,1)")
    return model, m.simulate(0.02, rate=2000)


def test_the_surface_of_a_shaft_is_closed_and_holds_its_volume():
    surface = SHAFT.modal_model().slowest(4).surface()
    mesh = Mesh(surface.vertices, surface.triangles)
    assert mesh.watertight
    outline = SHAFT.outline()
    z, r = outline.T
    exact = np.pi / 3 * np.sum(np.diff(z) * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2))
    # a prism of 32 sides has sin(2 pi / 32) / (2 pi / 32) of a circle's area
    np.testing.assert_allclose(mesh.volume, exact * np.sinc(1 / 16), rtol=1e-12)
    assert r.max() == 0.08


def test_discs_by_moments_have_the_size_of_the_plain_disc_with_them():
    plain = Disc(0.4, outer=0.16, width=0.03)
    mass, polar, diametral = plain.properties(SHAFT.material)
    by_moments = Shaft(SHAFT.sections, [Disc(0.4, mass=mass, polar=polar, diametral=diametral)])
    np.testing.assert_allclose(by_moments.outline(), Shaft(SHAFT.sections, [plain]).outline(), atol=1e-9)


@pytest.mark.slow
def test_facets_are_turned_outwards():
    pytest.importorskip("skfem")
    model = reduce_model(solid_model(block_mesh((0.3, 0.2, 0.02), (4, 3, 1))), [], modes=6, method="free")
    surface = model.surface()
    mesh = Mesh(surface.vertices, surface.triangles)
    assert mesh.watertight
    np.testing.assert_allclose(mesh.volume, 0.3 * 0.2 * 0.02, rtol=1e-12)
    cube = box(1.0, 1.0, 1.0)
    mixed = cube.triangles.copy()
    mixed[::2] = mixed[::2, ::-1]
    two = np.concatenate([mixed, mixed + 8])
    turned = outward(np.concatenate([cube.vertices, cube.vertices + 3.0]), two)
    for part in (turned[:12], turned[12:] - 8):
        np.testing.assert_allclose(Mesh(cube.vertices, part).volume, 1.0)


def test_a_bent_body_is_drawn_where_its_markers_are(run):
    _, solution = run
    scene = solution_scene(solution, start=0.0, frames=400, factor=1.0)
    part = next(p for p in scene.parts if p.name == "shaft")
    marker = solution.system.mechanism.bodies["shaft"].marker(np.array([0.08, 0.0, 0.385]))
    path = solution.marker_position(marker)
    nearest = np.argmin(np.linalg.norm(part.mesh.vertices - [0.08, 0.0, 0.385], axis=1))
    drawn = np.array([part.placed(k).vertices[nearest] for k in range(len(scene))])
    moved = np.linalg.norm(path - path[0], axis=1).max()
    assert moved > 1e-4
    # small deflections: markers turn exactly, surfaces to first order
    np.testing.assert_allclose(drawn, path, atol=2e-2 * moved)
    assert "deflections" not in scene.title


@pytest.mark.slow
def test_the_default_factor_makes_bending_visible(run):
    _, solution = run
    scene = solution_scene(solution, start=0.0, frames=20)
    part = next(p for p in scene.parts if p.name == "shaft")
    largest = max(np.linalg.norm(part.deflection.at(k), axis=1).max() for k in range(len(scene)))
    np.testing.assert_allclose(largest, 0.1 * 0.8, rtol=5e-3)
    assert ", deflections " in scene.title
    assert scene.title.endswith(" times")
    page = scene.page()
    shown = next(p for p in page.data["parts"] if p["name"] == "shaft")
    assert {"shapes", "coordinates", "ends"} <= set(shown)
    assert scene.still(instant=3).axes
    with pytest.raises(ValueError, match="factor is -1"):
        solution_scene(solution, factor=-1)


def test_fewer_shapes_draw_nearly_the_same():
    rng = np.random.default_rng(3)
    waves = rng.normal(size=(30, 2)) @ rng.normal(size=(2, 12))
    bend = Deflection(rng.normal(size=(12, 50, 3)), waves)
    reduced = bend.reduced()
    assert len(reduced.shapes) == 2
    np.testing.assert_allclose(reduced.at(7), bend.at(7), atol=1e-9)
    still = Deflection(bend.shapes, np.zeros((30, 12))).reduced()
    np.testing.assert_array_equal(still.at(0), np.zeros((50, 3)))


def test_a_mechanism_shows_the_start():
    model = SHAFT.modal_model().slowest(4)
    m = Mechanism("bent")
    model.add_to(m, "shaft", start=[1e-3, 0, 0, 0])
    scene = mechanism_scene(m)
    assert len(scene.parts[0].deflection.shapes) == 4
    # the undeformed seat at the origin: the frame of the nodes is where it was put
    straight = mechanism_scene(m, factor=0.0).parts[0].placed(0).vertices
    bent = mechanism_scene(m, factor=1.0).parts[0].placed(0).vertices
    np.testing.assert_allclose(bent - straight, 1e-3 * (model.surface().moved[0] - model_mean(m)), atol=1e-12)


def model_mean(mechanism):
    """Return the mean displacement of the first mode."""
    return mechanism.bodies["shaft"].mean[0]


def test_deflections_at_a_node(run):
    model, solution = run
    moved, turned = solution.deflection("disc")
    body = solution.system.mechanism.bodies["shaft"]
    arm = np.array([0.0, 0.0, 0.4]) - body.com + moved
    place = solution.com_position("shaft") + np.einsum("mij,mj->mi", solution.orientation("shaft"), arm)
    np.testing.assert_allclose(place, solution.marker_position("disc"), atol=1e-15)
    assert np.abs(turned).max() > 0.0
    later = body.marker(model.place(5))
    assert solution.deflection(later)[0].shape == (solution.t.size, 3)
    with pytest.raises(ModelError, match=says("bodies", "deflect", "rigid")):
        solution.deflection(solution.system.mechanism.ground.marker((0, 0, 0)))


@pytest.mark.slow
def test_stresses_are_drawn(run):
    model, solution = run
    q = solution.modal_coordinates("shaft")
    instant = model.stress_modes().peak(q).instant
    panel = stress_plot(model, q[instant]).axes[0]
    largest = model.stress_modes().von_mises(q[instant]).max() / 1e6
    np.testing.assert_allclose(max(panel.lines[0].get_ydata()), largest)
    pytest.importorskip("skfem")
    plate = reduce_model(solid_model(block_mesh((0.3, 0.2, 0.02), (4, 3, 1))), [], modes=6, method="free")
    figure = stress_plot(plate, 1e-6 * np.eye(6)[0])
    assert "MPa" in figure.axes[0].get_title()
