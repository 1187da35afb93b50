"""The report of a drivetrain for whoever decides."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import gearmbs as gm
from gearmbs.bearings import Bearing, mean_load, rating_life
from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    ElasticBearing,
    GearMesh,
    IdealBearing,
    PlanetaryStage,
    RunSettings,
    Shaft,
    SpeedDrive,
    TorqueLoad,
)
from gearmbs.drivetrain.static.rest import Rest
from gearmbs.gears import GearSpec, planetary
from gearmbs.gears.faults import Crowning, RootCrack
from gearmbs.studies import run_train, train_page
from gearmbs.studies.train_page import TrainPage
from tests.drivetrain.test_closed_chains import split
from tests.says import says

pytestmark = pytest.mark.slow


def gearbox():
    """A stage with rolling bearings on its pins and on its output shaft."""
    gears = planetary((24, 30, 84), "1.5 mm", 3, pin_errors={1: (0.0, 5e-6)})
    spring = {"stiffness": (3e8, 3e8, 3e8), "rolling": "6206"}
    return Drivetrain(
        "gearbox",
        shafts=[Shaft(name="in", length="100 mm", diameter="10 mm"), Shaft(name="out", length="100 mm")],
        bearings=[IdealBearing(name="a", shaft="in"), ElasticBearing(name="c", shaft="out", station="20 mm", **spring),
                  ElasticBearing(name="d", shaft="out", station="80 mm", **spring)],
        planetary_stages=[PlanetaryStage(name="low", gears=gears, sun="in", carrier="out", ring="ground",
                                         pins="6203")],
        drives=[SpeedDrive(name="motor", shaft="in", speed="3000 rpm")],
        loads=[TorqueLoad(name="brake", shaft="out", torque="60 N m")],
        run_up=0.01,
    )  # fmt: skip


@pytest.fixture(scope="module")
def page():
    train = gearbox()
    record = run_train(train, RunSettings(settling=0.01, duration=0.05, tolerance=1e-6))
    return train_page(train, record, maximum=20e3)


def table(text, heading):
    """Return the rows of the first table below a heading."""
    rows = [line for line in text.partition(f"## {heading}")[2].splitlines() if line.startswith("|")]
    first = next((k for k, line in enumerate(rows[2:], 2) if line.startswith("|---")), len(rows) + 1)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in rows[2 : first - 1]]


def test_figures_come_first_and_nothing_is_fetched(page, tmp_path):
    target = gm.save(page, tmp_path / "gearbox.html")
    text = target.read_text()
    captions = re.findall(r'<img alt="([^"]+)"', text)
    assert [caption.split()[0] for caption in captions] == ["The", "Spectrum", "Modes", "Contact", "Contact"]
    assert text.rindex("<img") < text.index("<h1>gearbox</h1>")
    assert 'src="http' not in text
    assert len(text) < 3e6
    assert text.count("<h2>") >= 10


def test_powers_of_what_turns_and_of_what_holds_it_are_in_balance(page):
    rows = table(page.to_markdown(), "Power flow")
    powers = {(row[0], row[1]): float(row[5]) for row in rows}
    assert powers["drive", "motor"] == pytest.approx(60.0 * page.train.speeds["out"] / 1e3, rel=1e-4)
    assert powers["load", "brake"] == pytest.approx(-powers["drive", "motor"], rel=1e-4)
    stage = [power for (kind, _), power in powers.items() if kind == "planetary stage"]
    assert sum(stage) == pytest.approx(0.0, abs=1e-6)


def test_lives_are_those_of_the_forces_on_the_planets(page):
    lives = {row[0]: row for row in page.lives}
    assert set(lives) == {"c", "d", *(f"low planet {k} pin" for k in (1, 2, 3))}
    bearing = Bearing.from_designation("6203", estimate=True)
    force = page.record.bearing_force.sel(bearing="low planet 2 pin").values
    load = mean_load(bearing, np.hypot(force[:, 0], force[:, 1]), np.abs(force[:, 2]))
    found = lives["low planet 2 pin"]
    assert found[3] == pytest.approx(load, rel=1e-3)
    assert found[4] == pytest.approx(rating_life(bearing, load), rel=1e-2)
    turns = abs(page.train.turning["low planet 2"] - page.train.speeds["out"]) / (2 * np.pi)
    assert found[5] == pytest.approx(found[4] / turns / 3600.0, rel=1e-2)
    # the planet whose pin is ahead carries least
    assert max(row[4] for row in page.lives if "pin" in row[0]) == found[4]


def test_loads_at_rest_carry_the_torque(page):
    text = page.to_markdown().partition("## Loads at rest")[2].partition("## ")[0]
    rows = [line.strip("| ").split(" | ") for line in text.splitlines()]
    meshes = {row[0]: float(row[1]) for row in rows if row[0].startswith("low sun-planet")}
    base = page.train.planetary_stages[0].gears.sun.base_radius
    assert sum(meshes.values()) * base == pytest.approx(60.0 * 24 / 108, rel=1e-3)


def test_it_is_saved_as_a_page_or_as_text_alone(page, tmp_path):
    text = gm.save(page, tmp_path / "gearbox.md").read_text()
    assert text.startswith("# gearbox\n")
    assert "ISO 281" in text
    with pytest.raises(ValueError, match=says("gearbox.pdf", ".html", ".md")):
        gm.save(page, tmp_path / "gearbox.pdf")


def test_a_record_of_another_drivetrain_is_refused(page):
    others = [replace(page.train.shafts[0], name="spare"), page.train.shafts[1]]
    bearings = [replace(page.train.bearings[0], shaft="spare"), *page.train.bearings[1:]]
    other = replace(page.train, shafts=others, bearings=bearings, drives=[replace(page.train.drives[0], shaft="spare")],
                    planetary_stages=[replace(page.train.planetary_stages[0], sun="spare")])  # fmt: skip
    with pytest.raises(DrivetrainError, match=says("spare", "record")):
        train_page(other, page.record)
    assert train_page(page.train, page.record).maximum == 2000.0


def one_stage(station, diameter="30 mm", modes=None, settings=None):
    """A spur stage 21/52 in ball bearings, 400 N m; its wheels at a station, the left bearing of the input behind."""
    wheels = [GearSpec(z, "3 mm", face_width="25 mm", bore_radius=bore) for z, bore in ((21, "15 mm"), (52, "20 mm"))]
    first = "80 mm" if station == "20 mm" else "26 mm"
    return Drivetrain(
        "stage",
        shafts=[
            Shaft(name="i", length="240 mm", diameter="30 mm", modes=modes, wheels={"z1": (station, wheels[0])},
                  bearings={"ia": (first, "6206"), "ib": ("214 mm", "6206")}),
            Shaft(name="o", length="240 mm", diameter="40 mm", modes=modes, wheels={"z2": (station, wheels[1])},
                  bearings={"oa": ("26 mm", "6208"), "ob": ("214 mm", "6208")}),
        ],
        meshes=[GearMesh(name="m", driver="z1", driven="z2", settings=settings or {})],
        drives=[SpeedDrive(name="d", shaft="i", speed=157.0)],
        loads=[TorqueLoad(name="l", shaft="o", torque=400.0)],
        running=True,
    )  # fmt: skip


def page_of(train):
    """Return the page with a record that has names and frequencies only."""
    return TrainPage(train, xr.Dataset())


def test_patterns_are_of_wheels_as_they_stand_under_load():
    """Overhung: rigid shafts give 19.5 um over the face, bent ones 95; c_gamma of 19.7 N/(mm um) says K = 1.88, 4.2."""
    rigid, bent, straight = (
        page_of(one_stage("20 mm")), page_of(one_stage("20 mm", modes=6)), page_of(one_stage("120 mm"))
    )  # fmt: skip
    width = 0.025
    assert abs(rigid.train.at_rest.openings["m"]) * width == pytest.approx(19.5e-6, rel=2e-3)
    assert abs(bent.train.at_rest.openings["m"]) * width == pytest.approx(95.1e-6, rel=2e-3)
    assert rigid.patterns["m"].face_load_factor == pytest.approx(1.942, abs=2e-3)
    assert rigid.patterns["m"].pressure.max() == pytest.approx(330.9e3, rel=1e-3)
    assert bent.patterns["m"].face_load_factor == pytest.approx(4.234, abs=0.01)
    # the input gives way to the left: the right ends of the teeth carry
    assert rigid.patterns["m"].section[rigid.patterns["m"].pressure.max(axis=0).argmax()] > 0.0
    assert straight.patterns["m"].face_load_factor == pytest.approx(1.0, abs=1e-9)
    assert table("\n".join(rigid._pattern()), "Contact patterns")[0][-1] == "19.54"


def test_teeth_with_faults_have_patterns_of_their_own():
    """Cracks in a tooth of each wheel, crowning of all teeth: one pattern more for each tooth."""
    faults = [RootCrack(depth="3 mm", tooth=5), RootCrack(depth="3 mm", wheel="driven", tooth=40),
              Crowning(amount="5 um")]  # fmt: skip
    found = page_of(one_stage("120 mm", settings={"faults": faults}))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        patterns = found.patterns
    driver, driven = "m, tooth 5 of the driver wheel: root crack", "m, tooth 40 of the driven wheel: root crack"
    assert list(patterns) == ["m", driver, driven]
    assert all(patterns[name].force.sum() < 0.98 * patterns["m"].force.sum() for name in (driver, driven))
    assert [row[0] for row in table("\n".join(found._pattern()), "Contact patterns")] == list(patterns)


def test_a_page_without_a_position_of_rest_says_so():
    page = page_of(one_stage("20 mm"))
    page.train.__dict__["at_rest"] = Rest(trouble="shaft 'i' is free")
    assert "No position of rest was found: shaft 'i' is free." in page._static()
    text = "\n".join(page._pattern())
    assert "no position of rest was found (shaft 'i' is free)" in text
    assert table(text, "Contact patterns")[0][2] == "1.000"
    assert "no position of rest" not in "\n".join(page_of(one_stage("20 mm"))._pattern())


def test_power_that_splits_is_told_as_it_splits():
    train = split(backlash="0.1 mm")
    page = page_of(train)
    text = "\n".join(page._power())
    powers = {row[1]: float(row[5]) for row in table(text, "Power flow")}
    assert powers["m3 on d"] == powers["m4 on d"] == 5.0
    assert "m1, m2, m3, m4, which close a chain: they are the means of loaded positions of rest" in text
    rows = {row[0]: float(row[1]) for row in table("\n".join(page._pattern()), "Contact patterns")}
    assert rows == {"m1": 70.95, "m2": 70.95, "m3": 141.9, "m4": 141.9}
    train = split(backlash="0.1 mm")
    train.__dict__["at_rest"] = Rest(trouble="it slips")
    with pytest.warns(UserWarning, match=says("closed chain", "it slips", "equally stiff teeth")):
        text = "\n".join(page_of(train)._power())
    assert "those of equally stiff teeth without backlash, as no position of rest was found" in text
