"""Wheels with a thin web and rim in trains, beside closed forms and rigid wheels."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import DrivetrainError, FlexibleWheel, RunSettings, Shaft, Wheel
from gearmbs.drivetrain.plants import resting
from gearmbs.flexible import thin_rimmed_wheel
from gearmbs.gears import Material
from gearmbs.mechanism.solve.analyses import static_equilibrium
from gearmbs.studies import mode_table, named_modes, run_train, train_modes, train_page, train_scene
from gearmbs.studies.train_record import TrainRecorder
from tests.drivetrain.test_finite_element_shafts import SECTIONS, train
from tests.says import says

THIN = {"hub": "60 mm", "rim": "130 mm", "web": "5 mm", "around": 16}
LAY = Shaft(name="lay", sections=SECTIONS, modes=4)
GEAR = train(LAY).part("z2").gear


def frequencies(one, count=12):
    modes = train_modes(one)
    return np.sort(modes.frequencies[modes.oscillating])[:count]


def turns_apart(body, axis=2):
    """Return by how much rim and bore of a body turn against each other under a torque of 1 N m between them, rad."""
    rim, bore = body.seats["rim"], body.seats["bore"]
    apart = (rim.turned - bore.turned)[:, axis]
    return float(np.sum((apart / (2.0 * np.pi * body.frequencies)) ** 2))


def test_a_web_twists_as_a_plate_in_shear():
    """By T / (4 pi G t) (1 / r_1^2 - 1 / r_2^2) of each ring: all of a wheel whose web is as wide as its face.

    A thin web gives more: what it carries enters hub and rim in its own width.
    """
    shear = GEAR.material.youngs_modulus / (2.0 * (1.0 + GEAR.material.poisson_ratio))

    def rings(web):
        radii, widths = (0.020, 0.030, 0.065, GEAR.root_radius), (GEAR.face_width, web, GEAR.face_width)
        parts = [(1.0 / a**2 - 1.0 / b**2) / w for (a, b), w in zip(pairwise(radii), widths)]
        return sum(parts) / (4.0 * math.pi * shear)

    found = {w: turns_apart(FlexibleWheel.of({**THIN, "web": w}).body("z2", GEAR)) for w in (0.0249, 0.01, 0.005)}
    assert found[0.0249] == pytest.approx(rings(0.0249), rel=0.04)
    for web in (0.01, 0.005):
        assert 1.05 < found[web] / rings(web) < 1.2


@pytest.mark.slow
def test_a_web_tilts_as_the_wheel_of_the_flexible_package_does():
    """Of the same dimensions, meshed with corners on the circles."""
    mine = FlexibleWheel.of(THIN).body("z2", GEAR)
    other = thin_rimmed_wheel("40 mm", "60 mm", "130 mm", 2.0 * GEAR.root_radius, GEAR.face_width, "5 mm", around=16)
    for axis in (0, 2):
        assert turns_apart(mine, axis) == pytest.approx(turns_apart(other, axis), rel=0.03)


def test_its_mass_is_that_of_what_is_left():
    one = Wheel(name="z2", shaft="lay", gear=GEAR, body=THIN)
    mass, moments = one.weight
    body = one.flexible.body("z2", GEAR)
    cut = GEAR.material.density * math.pi * (0.065**2 - 0.030**2) * (GEAR.face_width - 0.005)
    assert mass == pytest.approx(GEAR.mass - cut, rel=0.01)
    assert body.properties.mass == pytest.approx(mass, rel=2e-3)
    assert moments[2] == pytest.approx(GEAR.inertia[2] - 0.5 * cut * (0.065**2 + 0.030**2), rel=1e-9)
    np.testing.assert_allclose(np.diag(body.properties.inertia), moments, rtol=5e-3)
    chain = dict(zip(train(LAY).torsional().names, train(LAY).torsional().inertias))
    thin = dict(zip(train(LAY).torsional().names, train(LAY, body=THIN).torsional().inertias))
    assert chain["lay"] - thin["lay"] == pytest.approx(GEAR.inertia[2] - moments[2], rel=1e-9)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*waves")
def test_a_stiff_wheel_without_a_web_to_speak_of_is_rigid():
    stiff = replace(GEAR, material=Material("2.1e15 Pa", 0.3, "7850 kg/m^3"))
    settings = {"stiffness": "3e8 N/m", "damping_ratio": 0.05}
    plain = train(LAY).changed("stage", settings=settings)
    one = plain.changed("z2", gear=stiff, body={**THIN, "web": "24.99 mm"})
    np.testing.assert_allclose(frequencies(one), frequencies(plain), rtol=2e-3)


def test_a_thin_web_softens_what_its_wheel_does():
    plain, thin = train(LAY), train(LAY, body=THIN)
    table = mode_table(named_modes(thin))
    assert "wheel 'z2'" in set(table["name"])
    assert table["wheel"].max() > 0.9
    # the teeth carry what they carried, and open otherwise
    one, other = plain.at_rest, thin.at_rest
    assert other.trouble == ""
    assert other.forces["stage"] == pytest.approx(one.forces["stage"], rel=1e-3)
    assert abs(other.openings["stage"] - one.openings["stage"]) > 0.05 * abs(one.openings["stage"])
    assert thin.power.on_driven("stage") == pytest.approx(300.0)


@pytest.mark.slow
def test_it_runs_and_is_reported_and_shown(tmp_path):
    one = train(LAY, body=THIN)
    record = run_train(one, RunSettings(settling="10 ms", duration="20 ms", tolerance=1e-6))
    rest = one.at_rest.forces["stage"]
    assert float(record.normal_force.mean("time")[0]) == pytest.approx(rest, rel=0.05)
    assert "wheel 'z2'" in train_page(one, record).to_markdown()
    assert "z2" in [part.name for part in train_scene(one).parts]


@pytest.mark.slow
@pytest.mark.parametrize("lay", [LAY, replace(LAY, modes=None)])
def test_the_angle_of_its_teeth_has_how_far_its_rim_turns(lay):
    """By the torque of the load, against the place of its bore on the shaft, at rest."""
    still = resting(train(lay, body=THIN))
    mechanism = still.build()
    rest = static_equilibrium(mechanism, t=2.0 * still.run_up).solution
    turned = float(TrainRecorder(still, mechanism).columns(rest).twisted[-1, 0])
    bore = 0.0 if lay.modes is None else float(rest.deflection("z2.I")[1][-1, 2])
    more = 300.0 * turns_apart(FlexibleWheel.of(THIN).body("z2", GEAR))
    assert abs(turned - bore) == pytest.approx(more, rel=1e-3)


def test_a_file_says_the_same(tmp_path):
    one = train(LAY, body={**THIN, "modes": 12})
    gm.save(one, tmp_path / "box.toml")
    again = gm.Drivetrain.from_file(tmp_path / "box.toml")
    assert again.part("z2").flexible == one.part("z2").flexible
    np.testing.assert_allclose(again.modal_models["z2"].frequencies, one.modal_models["z2"].frequencies)
    made = train(LAY, body=FlexibleWheel(hub=0.06, rim=0.13, web=0.005, around=16, modes=12))
    gm.save(made, tmp_path / "made.toml")
    assert gm.Drivetrain.from_file(tmp_path / "made.toml").part("z2").flexible == one.part("z2").flexible


def test_a_model_of_it_is_taken():
    """Of finite elements, and reduced ahead."""
    reduced = train(LAY, body=FlexibleWheel(model=FlexibleWheel.of(THIN).body("z2", GEAR)))
    np.testing.assert_allclose(frequencies(reduced), frequencies(train(LAY, body=THIN)), rtol=1e-9)


def test_a_pinion_cut_from_its_shaft_has_no_mass_of_its_own():
    one = train(LAY, body="shaft")
    two = train(LAY)
    inertias = [dict(zip(t.torsional().names, t.torsional().inertias))["lay"] for t in (one, two)]
    assert inertias[1] - inertias[0] == pytest.approx(GEAR.inertia[2], rel=1e-9)
    assert one.modal_models["lay"].properties.mass == pytest.approx(LAY.body()[0], rel=1e-6)


@pytest.mark.parametrize(("body", "words"), [
    ({"hub": "60 mm", "web": "5 mm"}, says("'z2'", "rim missing")),
    ({**THIN, "hub": "140 mm"}, says("'z2'", "hub", "130 mm")),
    ({**THIN, "hub": "30 mm"}, says("'z2'", "bore", "must rise")),
    ({**THIN, "web": "30 mm"}, says("'z2'", "web", "25 mm")),
    ({**THIN, "ribs": 4}, says("'z2'", "ribs")),
    ({"hub": "60 mm", "model": {"program": "box"}}, says("'z2'", "hub", "model")),
    ("hub", says("'z2'", "body", "table")),
])  # fmt: skip
def test_bodies_that_are_none_are_refused(body, words):
    with pytest.raises(DrivetrainError, match=words):
        Wheel(name="z2", shaft="lay", gear=GEAR, body=body)


def test_models_that_do_not_go_round_the_axis_are_refused():
    """A disc that stands across it, and one beside it."""
    model, _ = FlexibleWheel.of(THIN)._of_dimensions("z2", GEAR)
    across = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    for axes, at in ((across, 0.0), (np.eye(3), 0.005)):
        with pytest.raises(ValueError, match=says("bore", "axis")):
            FlexibleWheel(model=model.placed(axes, np.array([at, 0.0, 0.0]))).body("z2", GEAR)


@pytest.mark.parametrize("idle", [{"around": 48}, {"faces": "average"}, {"rim": "100 mm"}])
def test_what_a_body_with_modes_has_is_not_told_again(idle):
    with pytest.raises(ValueError, match=says(*idle, "beside model")):
        FlexibleWheel(model=FlexibleWheel.of({**THIN, "around": 8, "modes": 1}).body("z2", GEAR), **idle)


def test_an_internal_wheel_has_no_web():
    ring = gm.GearSpec.ring(90, "3 mm")
    with pytest.raises(DrivetrainError, match=says("'r'", "internal", "rim_thickness")):
        Wheel(name="r", shaft="lay", gear=ring, body=THIN)
