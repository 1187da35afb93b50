"""Planetary sets in three dimensions: what is drawn, in which colour, at rest and in motion."""

import numpy as np
import pytest

from gearmbs.gears import planetary, planetary_mechanism
from gearmbs.signals import PlanetaryModel, diagnose_planetary
from gearmbs.view import planetary_plot, planetary_scene
from gearmbs.view.scenes import carrier_mesh


@pytest.fixture(scope="module")
def gears():
    return planetary((24, 30, 84), "1.5 mm", 3, helix_angle="12 deg")


@pytest.mark.slow
def test_wheels_and_carrier_have_their_colours(gears, tmp_path):
    scene = planetary_scene(gears, planetary_mechanism(gears, speeds={"carrier": 1.0}, run_up=0))
    colours = {part.name: part.colour for part in scene.parts}
    assert set(colours) == {"sun", "carrier", "ring", "planet 1", "planet 2", "planet 3"}
    assert colours["planet 1"] == colours["planet 3"]
    assert len(set(colours.values())) == 4
    scene.save(tmp_path / "set.html")
    assert (tmp_path / "set.html").stat().st_size > 10_000


def test_the_carrier_keeps_clear_of_the_wheels(gears):
    points = carrier_mesh(gears).vertices
    radius = np.hypot(points[:, 0], points[:, 1])
    # beside the wheels only the pins, which stand inside the planets
    middle = np.abs(points[:, 2]) < 0.5 * gears.planet.face_width
    assert not middle.any() or radius[middle].min() > gears.sun.tip_radius
    assert radius.max() < gears.ring.root_radius
    assert points[:, 2].max() > 0.5 * gears.planet.face_width


@pytest.mark.slow
def test_a_simulated_set_moves(gears):
    rig = planetary_mechanism(gears, speeds={"carrier": 20.0, "sun": 90.0}, held=None, run_up=0)
    scene = planetary_scene(gears, rig.simulate(0.002, rate=2000), start=0.0, stop=0.002)
    carrier = next(part for part in scene.parts if part.name == "carrier")
    assert len(carrier.axes) > 1
    assert np.abs(carrier.axes[-1] - carrier.axes[0]).max() > 0.01


@pytest.mark.slow
def test_a_figure_needs_a_channel_of_the_report():
    report = diagnose_planetary(PlanetaryModel((23, 31, 85)).signal(10.0, 500.0, 1.0), (23, 31, 85), "60 rpm")
    assert len(planetary_plot(report).axes) == 3
    with pytest.raises(ValueError, match="there is no 'b'"):
        planetary_plot(report, "b")
