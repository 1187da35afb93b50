import numpy as np
import pytest

from gearmbs.contact import gear_contact, layout
from gearmbs.gears import GearPair
from gearmbs.gears.faults import BrokenTooth
from gearmbs.view import ContactProbe, mesh_view, static_motion
from gearmbs.view.motion import chosen_times
from tests.says import says
from tests.view.looking import assert_readable

CASES = {
    "healthy": {},
    "reversed at +3 mm": {"centre_distance_error": "3 mm", "rotation": -1},
    "skew": {"backlash": "0.4 mm", "misalignment": "1 deg"},
    "inclination": {"backlash": "0.4 mm", "misalignment": "1 deg", "plane": "inclination", "rotation": -1},
    "jammed": {"backlash": "0.01 mm", "misalignment": "0.3 deg"},
}


@pytest.mark.parametrize("case", CASES)
def test_forces_in_space_are_those_of_the_simulation(case):
    pair = GearPair.paper(**CASES[case])
    motion = static_motion(pair, frames=4)
    single = pair.face_slices == 1
    probe = ContactProbe(pair, sections=161)
    gi, gr, size = pair.contact_tables(1 if single else 161)
    gi[layout.FRICTION] = layout.FRICTION_NONE
    still = np.zeros(3)
    for k in range(len(motion)):
        place = motion.placement(k)
        spins = (place.axes_1[:, 2] * 100.0, -place.axes_2[:, 2] * 100.2)
        wrench, diag = np.zeros(6), np.zeros(8)
        frames = [np.ascontiguousarray(a) for a in (place.origin_1, place.axes_1, place.origin_2, place.axes_2)]
        moving = (*frames[:2], still, spins[0], *frames[2:], still, spins[1])
        gear_contact(gi, gr, *moving, wrench, np.zeros((6, 24)), diag, 0, np.zeros(size))
        found = probe.at(place, (still, still), spins)
        force = -found.force @ found.normal
        torque = -np.cross(found.point - place.origin_1, found.force[:, None] * found.normal).sum(axis=0)
        # parallel: the same numbers; tilted: midpoint rule over 161 sections, and without the small axial force
        # that the ends of a loaded face exert, its elastic energy per length
        tolerance = 1e-9 if single else 5e-3
        scale = max(diag[7], 100.0)
        assert abs(found.force.sum() - diag[7]) < tolerance * scale
        assert np.abs(force - wrench[:3])[:2].max() < tolerance * scale
        assert abs(force[2] - wrench[2]) < 2 * tolerance * scale
        assert np.abs(torque - wrench[3:]).max() < tolerance * scale * 0.0475
        # without friction the pairs carry the same in sum
        assert sum(np.linalg.norm(f) for *_, f in found.pairs()) == pytest.approx(found.force.sum(), rel=1e-3, abs=1e-9)


def test_static_motion_carries_the_load():
    pair = GearPair.paper(torque="200 N m")
    motion = static_motion(pair, frames=5, pitches=1.0)
    for k, points in enumerate(ContactProbe(pair).over(motion)):
        place = motion.placement(k)
        moments = np.cross(points.point - place.origin_2, points.force[:, None] * points.normal).sum(axis=0)
        # the driver's force holds the load torque about the driven axis
        assert moments @ place.axes_2[:, 2] == pytest.approx(-200.0, rel=1e-9)
    # a pitch further the driver has turned by one tooth
    angle = [np.arctan2(motion.axes[0, k, 1, 0], motion.axes[0, k, 0, 0]) for k in (0, 1)]
    assert angle[1] - angle[0] == pytest.approx(2 * np.pi / 29 / 5)


@pytest.mark.slow
def test_mesh_view_draws_teeth_contacts_and_forces():
    pair = GearPair.paper(backlash="0.1 mm")
    figure = mesh_view(pair, title="Healthy pair, 100 N m")
    ax = figure.axes[0]
    texts = [t.get_text() for t in ax.texts if t.get_text()]
    # two pairs share F_n = T/r_b = 2394.9 N at this position
    assert texts == ["1.20 kN\nteeth 0/0", "1.20 kN\nteeth 28/1"]
    assert ax.get_aspect() == 1.0
    assert len(ax.patches) >= 2
    assert_readable(figure)


def test_outlines_touch_where_the_contacts_are():
    from scipy.spatial import cKDTree

    pair = GearPair.paper(backlash="0.1 mm")
    motion = static_motion(pair, frames=3)
    from gearmbs.view import gear_outline

    for k, points in enumerate(ContactProbe(pair).over(motion)):
        for w, wheel in enumerate(pair.wheels):
            outline = gear_outline(wheel, 1e-8) @ motion.axes[w, k][:2, :2].T + motion.origins[w, k][:2]
            distance, _ = cKDTree(outline).query(points.point[:, :2])
            # contacts stand half-way into the penetration (at most 24.4 um), outline points 30 um apart
            assert distance.max() < 35e-6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"width": -1.0}, says("width", "-1.0", "give a positive")),
        ({"torque": -5.0}, says("torque", "-5.0", "give 0")),
        ({"driver_angle": 0.1, "torque": -5.0}, says("torque", "-5.0", "give 0")),
    ],
)
def test_wrong_views_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        mesh_view(GearPair.paper(), **options)


@pytest.mark.slow
def test_views_of_tilted_faulty_and_unloaded_pairs():
    tilted = GearPair.paper(misalignment="1 deg", backlash="0.4 mm", centre_distance_error="3 mm", rotation=-1)
    assert_readable(mesh_view(tilted, title="tilted"))
    faulty = GearPair.paper(backlash="0.1 mm").with_faults(BrokenTooth(lost=0.5))
    assert_readable(mesh_view(faulty, driver_angle=0.03, exaggeration=5.0))
    free = mesh_view(GearPair.paper(backlash="0.1 mm"), torque=0.0)
    assert any("no contact" in t.get_text() for t in free.axes[0].texts)


def test_output_times_are_spread_evenly():
    t = np.linspace(0.0, 1.0, 1001)
    assert chosen_times(t, 0.5, 0.6, 11).tolist() == list(range(500, 601, 10))
    assert chosen_times(t, None, None, 5)[[0, -1]].tolist() == [900, 1000]
    with pytest.raises(ValueError, match=says("no output", "2", "3")):
        chosen_times(t, 2.0, 3.0, 5)
