"""Lives of a drivetrain's bearings from its record, and what a record says of bearings that do not carry."""

import numpy as np
import pytest

from gearmbs.bearings import Bearing, RollingBearing, equivalent_load, mean_load, rating_life
from gearmbs.drivetrain import Housing, Mount, RunSettings
from gearmbs.studies import run_train, train_page
from gearmbs.studies.train_bearings import bearing_lives, bearing_remarks
from tests.drivetrain.test_senses import sense, stage
from tests.says import says

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:designation")]

RUN = RunSettings(settling=0.02, duration=0.02, tolerance=1e-6)


def elastic(kind, **more):
    return {"kind": "elastic", "rolling": kind, **more}


def lives_of(train, record):
    return {one.name: one for one in bearing_lives(train, record)}


def test_pairs_that_are_springs_have_the_induced_thrust():
    train = stage((elastic("30206"), elastic("30206")), (elastic("7208B", sense=1), elastic("7208B")))
    record = run_train(train, RUN)
    assert record.attrs["remarks"] == "none"
    found, page = lives_of(train, record), train_page(train, record)
    mean = {name: record.bearing_force.sel(bearing=name).values @ train.layout.seats[name[0]].axes for name in found}
    radial = {name: float(np.hypot(f[:, 0], f[:, 1]).mean()) for name, f in mean.items()}
    outer = -float(mean["i1"][:, 2].mean() + mean["i2"][:, 2].mean())
    rolling = train.parts["i2"].rolling
    # the shaft is pushed towards the less loaded bearing, which carries the thrust of the other one, too
    y = 0.4 / np.tan(rolling.contact_angle)
    assert outer > 0.0
    load = 0.4 * radial["i2"] + y * (radial["i1"] / (2.0 * y) + outer)
    assert found["i2"].load == pytest.approx(load, rel=5e-3)
    assert found["i2"].turns == pytest.approx(rating_life(rolling, load), rel=2e-2)
    assert found["i1"].load == pytest.approx(radial["i1"], rel=5e-3)
    assert train.senses == {"i1": -1, "i2": 1, "o1": 1, "o2": -1}
    assert "thrust" in found["o1"].note
    told = "\n".join(page._life())
    assert "'i' stand face to face (X), as none" in told
    assert "'o' stand back to back (O)." in told
    assert "| URB |" in told
    assert page.lives[0].source == "URB"


def test_one_bearing_without_a_life_says_why_beside_the_others():
    train = stage((elastic("NU206"), elastic("7206C")), ("6208", {"rolling": "NU208"}), gravity=(0.0, -9.81, 0.0))
    record = run_train(train, RUN)
    found = lives_of(train, record)
    assert np.isnan(found["i1"].hours)
    assert "no axial load" in found["i1"].note
    assert "both ways" in found["i2"].note
    assert found["i2"].source == "formula of ISO 281"
    assert all(np.isfinite(found[name].hours) for name in ("i2", "o1", "o2"))
    row = next(line for line in train_page(train, record)._life()[2].splitlines() if line.startswith("| i1 "))
    assert row.count("| - ") == 3


def test_rollers_whose_axis_tilts_have_the_life_of_their_radial_load():
    feet = [Mount(name=f"foot {k}", at=at, stiffness=(2e7,) * 3, damping=(2e3,) * 3)
            for k, at in enumerate(((-0.1, -0.1, 0.0), (0.2, -0.1, 0.0), (0.1, -0.1, 0.3)))]  # fmt: skip
    case = Housing(name="case", mass="60 kg", inertia=(2.0, 2.0, 1.5), at=(0.05, 0.0, 0.12), mounts=feet)
    tilts = stage(("6206", "NU206"), ("6208", "NU208"), housings=[case])
    record = run_train(tilts, RUN)
    force = record.bearing_force.sel(bearing="i2").values @ tilts.layout.seats["i"].axes
    across, along = np.hypot(force[:, 0], force[:, 1]), np.abs(force[:, 2])
    assert along.max() > 1e-6 * across.max()
    found = lives_of(tilts, record)["i2"]
    rolling = tilts.parts["i2"].rolling
    # a housing that rocks moves the speeds by which instants weigh
    assert found.load == pytest.approx(mean_load(rolling, across), rel=1e-6)
    assert equivalent_load(rolling, across[0], along[0]) == across[0]


def test_a_shaft_that_has_left_its_bearings_is_warned_of():
    def rollers(name, i, j):
        return RollingBearing(name, i, j, Bearing.from_designation("NU206", estimate=True))

    loose = {"kind": "element", "element": rollers, "rolling": None}
    with pytest.warns(UserWarning, match=says("m", "200", "i1", "senses")):
        record = run_train(stage((loose, loose)), RUN)
    assert "'i'" in record.attrs["remarks"]
    assert run_train(stage(("6206", "NU206")), RUN).attrs["remarks"] == "none"


def test_bearings_loaded_against_their_sense_are_named():
    train = stage((sense("7206B", -1), sense("7206B", 1), "6206"))
    record = run_train(train, RUN)
    assert bearing_remarks(train, record) == []
    # the same forces in bearings that stand the other way round
    turned = train.changed("i1", sense=1).changed("i2", sense=-1)
    told = bearing_remarks(turned, record)
    assert len(told) >= 1
    assert all("against its sense" in one for one in told)
    assert {one.name for one in bearing_lives(turned, record) if "shoulder" in one.note} <= {"i1", "i2"}


def test_lives_of_a_record_with_an_accuracy_have_errors():
    train = stage((elastic("6206"), elastic("6206")), (elastic("NU206"), elastic("6206")))
    run = RunSettings(settling=0.03, duration=0.04)
    record = run_train(train, run, accuracy="2 %")
    found = lives_of(train, record)
    exact = lives_of(train, run_train(train, RunSettings(settling=0.03, duration=0.04, tolerance=1e-10)))
    known = {name for name, one in found.items() if np.isfinite(one.turns)}
    assert known == {name for name, one in exact.items() if np.isfinite(one.turns)} >= {"i1", "i2", "o2"}
    for name in known:
        assert abs(found[name].turns / exact[name].turns - 1.0) <= found[name].error < 0.05
    told = train_page(train, record)._life()[2]
    assert "numerical error of L10" in told
    assert not np.isfinite(exact["i1"].error)
