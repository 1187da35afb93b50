import base64
import re

import numpy as np
import pytest

from gearmbs.campaigns.datasets import GEARBOXES
from gearmbs.drivetrain import Drivetrain
from gearmbs.gears import GearPair
from gearmbs.mechanism import Mechanism
from gearmbs.studies import make_case, simulate_case
from gearmbs.view import Scene, gear_scene, mechanism_scene, mesh_animation, solution_motion, solution_scene
from gearmbs.view.mesh import body_mesh, box, corner_normals, cylinder, feature_edges
from gearmbs.view.render import Camera, render
from gearmbs.view.scene import Part
from tests.browser import browsed, needs_browser
from tests.says import says
from tests.view.looking import assert_readable


@pytest.fixture(scope="module")
def solution():
    data = {"fault": {"misalignment": "1 deg"}, "operation": {"duration": 0.02, "run_up": 0.02, "settling": 0.0}}
    return simulate_case(make_case(data))


@pytest.fixture(scope="module")
def pendulum():
    m = Mechanism("double pendulum", gravity=(0, 0, -9.81))
    along_x = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    upper = m.body("upper", mass=1.0, inertia=(0.09, 0.09, 0.001), position=(0.5, 0, 0), orientation=along_x)
    lower = m.body("lower", mass=2.0, inertia=(0.005, 0.008, 0.01), position=(1.3, 0, 0))
    m.revolute("pin 1", upper, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.revolute("pin 2", upper, lower, at=(1, 0, 0), axis=(0, 1, 0))
    return m


@pytest.fixture(scope="module")
def scene():
    return gear_scene(GearPair.paper(misalignment="1 deg", backlash="0.4 mm"), frames=3)


def test_camera_looks_from_where_it_is_told():
    np.testing.assert_allclose(Camera(0, 0, (0, 0, 1)).axes, [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-15)
    # y up: from z at azimuth 0, from x at 90 degrees
    np.testing.assert_allclose(Camera(0, 0, (0, 1, 0)).axes, [[1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-15)
    np.testing.assert_allclose(Camera(90, 0, (0, 1, 0)).axes[2], [1, 0, 0], atol=1e-15)
    with pytest.raises(ValueError, match=says("up", "(0, 0, 0)", "give a direction")):
        Camera(0, 0, (0, 0, 0))


def test_renderer_draws_a_box_where_it_is():
    mesh = box(2.0, 1.0, 1.0)
    camera = Camera(0, 0, (0, 1, 0))
    camera.frame(np.array([[-2.0, -1.0, 0.0], [2.0, 1.0, 0.0]]), 400, 200, margin=1.0)
    image = render([mesh.corners], [corner_normals(mesh)], [(1.0, 0.0, 0.0)], camera, 400, 200)
    filled = image[..., 3] > 0.5
    # 4 x 2 m on 400 x 200 pixels: the box covers 200 x 100 of them in the middle
    assert filled.sum() == 200 * 100
    assert filled[50:150, 100:300].all()
    # facing the viewer: bright red, no green
    red, green, _, _ = image[100, 200]
    assert red > 0.7
    assert green == 0.0


def test_nearer_solids_hide_farther_ones():
    near, far = box(1, 1, 1).placed(np.array([0, 0, 2.0]), np.eye(3)), box(1, 1, 1)
    camera = Camera(0, 0, (0, 1, 0))
    camera.frame(far.vertices, 60, 60)
    solids = [[far, near], [near, far]]
    for order, colours in zip(solids, ([(1, 0, 0), (0, 0, 1)], [(0, 0, 1), (1, 0, 0)])):
        image = render([m.corners for m in order], [corner_normals(m) for m in order], colours, camera, 60, 60)
        assert image[30, 30, 2] > 0.5
        assert image[30, 30, 0] == 0.0


def test_shading_is_smooth_round_a_cylinder_and_sharp_at_its_rim():
    mesh = cylinder(1.0, 2.0, 48)
    normals = corner_normals(mesh).reshape(-1, 3)
    corners = mesh.corners.reshape(-1, 3)
    side = np.abs(normals[:, 2]) < 0.5
    radial = corners[side, :2] / np.linalg.norm(corners[side, :2], axis=1, keepdims=True)
    # true normals of the circle, within the turn of one chord weighed by unequal triangles
    assert (np.einsum("ij,ij->i", radial, normals[side, :2]) > np.cos(np.pi / 48)).all()
    np.testing.assert_allclose(np.abs(normals[~side, 2]), 1.0)
    assert len(feature_edges(mesh)) == 2 * 48
    assert len(feature_edges(box(1, 1, 1))) == 12


def test_scene_of_a_pair_shows_the_misalignment(scene):
    assert [p.name for p in scene.parts] == ["driver", "driven", "driver shaft", "driven shaft"]
    assert "1°" in scene.title
    first, second = (scene.parts[k].axes[0][:, 2] for k in (0, 1))
    assert np.degrees(np.arccos(first @ second)) == pytest.approx(1.0)
    lines = {name: ends for name, _, ends in scene.lines}
    assert set(lines) == {"axes", "aligned axis"}
    assert len(scene.forces) == 3
    # the sum of the forces holds the torque: F_n = T/r_b = 2394.9 N and more where both flanks bear
    assert np.linalg.norm(scene.forces[0][:, 1], axis=1).sum() > 2390.0


@pytest.mark.slow
def test_still_picture_is_readable(scene):
    figure = scene.still(dpi=60)
    assert_readable(figure)
    image = figure.axes[0].images[0].get_array()
    drawn = image[image[..., 3] > 0.99]
    blue = (drawn[:, 2] > 2 * drawn[:, 0]) & (drawn[:, 2] > drawn[:, 1])
    orange = (drawn[:, 0] > 3 * drawn[:, 2]) & (drawn[:, 1] > drawn[:, 2])
    assert min(blue.mean(), orange.mean()) > 0.05
    with pytest.raises(ValueError, match=says("instant", "7", "3")):
        scene.still(instant=7)


def test_bodies_have_their_inertia(pendulum):
    rod = body_mesh(pendulum.bodies["upper"])
    # I_z = m r^2/2 = 0.001 kg m^2: r = sqrt(0.002) m; I_x = m (3 r^2 + l^2)/12: l = sqrt(12 x 0.09 - 0.006) m
    assert np.hypot(*rod.vertices[:, :2].T).max() == pytest.approx(np.sqrt(0.002))
    assert np.ptp(rod.vertices[:, 2]) == pytest.approx(np.sqrt(12 * 0.09 - 0.006))
    block = body_mesh(pendulum.bodies["lower"])
    x, y, z = np.ptp(block.vertices, axis=0)
    moments = 2.0 / 12.0 * np.array([y**2 + z**2, x**2 + z**2, x**2 + y**2])
    np.testing.assert_allclose(moments, [0.005, 0.008, 0.01], rtol=1e-9)
    assert block.watertight


def test_mechanism_scene_still_and_in_motion(pendulum):
    scene = mechanism_scene(pendulum)
    assert scene.up == (0.0, 0.0, 1.0)
    assert [p.name for p in scene.parts] == ["upper", "lower", "pin 1 (revolute)", "pin 2 (revolute)"]
    assert_readable(scene.still(dpi=50, azimuth=-60))
    solution = pendulum.simulate(0.5, rate=100)
    moving = solution_scene(solution, start=0.0, joints=True, frames=20)
    assert len(moving) == 20
    # the pin between the rods is where both rods say it is
    pin = next(p for p in moving.parts if p.name.startswith("pin 2"))
    upper = next(p for p in moving.parts if p.name == "upper")
    ends = upper.origins + upper.axes @ [0.0, 0.0, 0.5]
    np.testing.assert_allclose(pin.origins, ends, atol=1e-6)
    with pytest.raises(ValueError, match="no body 'arm'"):
        mechanism_scene(pendulum, shapes={"arm": box(1, 1, 1)})
    own = mechanism_scene(pendulum, shapes={"upper": box(1, 1, 1)}, joints=False)
    assert own.parts[0].mesh.volume == pytest.approx(1.0)
    with pytest.raises(ValueError, match=says("element", "0 gear", "name one")):
        solution_motion(solution)


def test_simulated_shafts_are_drawn_as_simulated(solution):
    scene = solution_scene(solution, frames=3)
    shaft = next(p for p in scene.parts if p.name == "shaft 1").mesh
    # a solid cylinder of 15 mm radius and 200 mm length, from nothing but mass and moments
    assert np.hypot(*shaft.vertices[:, :2].T).max() == pytest.approx(0.015)
    assert np.ptp(shaft.vertices[:, 2]) == pytest.approx(0.2)
    assert len(scene.forces) == 3


def test_animation_shows_the_forces_of_the_simulation(solution, tmp_path):
    animation = mesh_animation(solution, frames=30)
    force = np.array([p.force.sum() for p in animation.points])
    at = [int(np.argmin(np.abs(solution.t - v))) for v in animation.motion.value]
    # 21 sections by the midpoint rule against the simulation's slices
    np.testing.assert_allclose(force, solution.contact("mesh")["normal_force"][at], rtol=1e-2)
    # three mesh cycles at 1000 rpm take 3/483.33 s
    assert np.ptp(animation.motion.value) == pytest.approx(3 / 483.333, rel=0.02)
    page = animation.save(tmp_path / "mesh.html").read_text()
    assert page.count("<script") == 2
    with pytest.raises(ValueError, match=r"\.html"):
        animation.save(tmp_path / "mesh.avi")
    with pytest.raises(ValueError, match="no gear contact"):
        mesh_animation(solution, element="other")


@pytest.mark.slow
def test_animation_as_gif(tmp_path):
    from PIL import Image

    path = mesh_animation(GearPair.paper(), frames=3).save(tmp_path / "mesh.gif")
    with Image.open(path) as image:
        assert image.n_frames == 3


def test_wrong_scenes_are_named():
    with pytest.raises(ValueError, match="at least one part"):
        Scene([])
    with pytest.raises(ValueError, match="poses"):
        Scene([Part("a", box(1, 1, 1), "red", np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)))])
    with pytest.raises(ValueError, match="shaft_radius"):
        gear_scene(GearPair.paper(), shaft_radius=-1.0)


@pytest.mark.slow
def test_pages_fetch_nothing_and_escape_titles(scene, tmp_path):
    scene = Scene(scene.parts, "</title><script>alert(1)</script>", "a", "b", scene.value)
    text = scene.save_html(tmp_path / "scene.html").read_text()
    assert not re.search(r"(?:src|href)\s*=|https?://|@import|url\(", text)
    assert "<script>alert" not in text
    assert scene._repr_html_().startswith("<iframe srcdoc=")


def unpacked(text, kind):
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def test_pages_hold_the_solids_within_a_step_of_their_grid(scene):
    """65535 steps a direction: half a step is 0.8 um of a wheel of 100 mm."""
    for part, held in zip(scene.parts, scene.page().data["parts"]):
        counting = f"<u{held['bytes']}"
        points = np.array(held["low"]) + unpacked(held["points"], "<u2").reshape(-1, 3) * np.array(held["step"])
        triangles = points[unpacked(held["index"], counting)].reshape(-1, 3, 3)
        half = 0.5 * np.ptp(part.mesh.vertices, axis=0) / 65535
        assert np.all(np.abs(triangles - part.mesh.corners) <= half * (1 + 1e-6) + 1e-9)
        ends = points[unpacked(held["ends"], counting)].reshape(-1, 2, 3)
        assert np.all(np.abs(ends - feature_edges(part.mesh)) <= half * (1 + 1e-6) + 1e-9)


@pytest.mark.slow
def test_a_page_of_four_wheels_is_small():
    train = Drivetrain.from_file(GEARBOXES["two stages"].file)
    page = mechanism_scene(train.build()).page()
    assert len(page.to_html()) < 1e6


@pytest.mark.slow
def test_plotly_figure(scene):
    pytest.importorskip("plotly", reason="plotly is not installed (extra 'view')")
    figure = scene.plotly(frames=2)
    assert len(figure.frames) == 2
    assert [t.name for t in figure.data if t.type == "mesh3d"] == [p.name for p in scene.parts]


def opened(page, tmp_path, query=""):
    """Return the page's document after its scripts ran, and a picture of it."""
    from PIL import Image

    shot = tmp_path / "shot.png"
    text, _ = (
        browsed(f"{page.as_uri()}{query}", action, tmp_path) for action in ("--dump-dom", f"--screenshot={shot}")
    )
    with Image.open(shot) as image:
        return text, np.asarray(image.convert("RGB")).astype(int)


@pytest.mark.slow
@needs_browser
@pytest.mark.parametrize("query", ["", "?plain"])
def test_scene_opens_in_a_browser(scene, tmp_path, query):
    page = scene.save_html(tmp_path / "scene.html")
    text, image = opened(page, tmp_path, query)
    ready = re.search(r'data-ready="(\w+)"', text)
    assert ready, "the script did not reach its end"
    if query:
        assert ready[1] == "plain"
    assert 'data-frame="' in text
    red, green, blue = np.moveaxis(image[60:520, 160:], -1, 0)
    assert ((blue > red + 60) & (blue > green + 20)).mean() > 0.02  # the driver
    assert ((red > blue + 90) & (green > blue + 50)).mean() > 0.02  # the driven wheel


@pytest.mark.slow
@needs_browser
def test_animation_opens_in_a_browser(tmp_path):
    page = mesh_animation(GearPair.paper(), frames=4).save(tmp_path / "mesh.html")
    text, image = opened(page, tmp_path)
    assert 'data-ready="transverse"' in text
    # the wheels' fills (driver #C9DDF0, driven #FBE3B5) cover most of the view
    for colour in ((0xC9, 0xDD, 0xF0), (0xFB, 0xE3, 0xB5)):
        assert (np.abs(image - colour).max(axis=-1) < 4).mean() > 0.1
