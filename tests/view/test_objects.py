"""Objects that show themselves: figures one can read, tables with what the user gave."""

import json
import re

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import gearmbs as gm
from gearmbs.gears import GearPair, GearSpec
from gearmbs.mechanism import Mechanism
from gearmbs.studies import Case, gear_rig
from gearmbs.view import mechanism_plot, solution_plot
from gearmbs.view.figures.drawings import edges_of, layers
from tests.view.looking import assert_readable


def four_bar():
    m = Mechanism("four bar", gravity=(0, 0, -9.81))
    crank, rod, rocker = (m.body(name, 1.0, (0.1, 0.1, 0.1), position=(k, 0, 0)) for k, name in enumerate("abc"))
    pin = m.revolute("pin A", crank, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    m.revolute("pin B", crank, rod, at=(0, 0, 1), axis=(0, 1, 0))
    m.revolute("pin C", rod, rocker, at=(2, 0, 1.5), axis=(0, 1, 0))
    m.revolute("pin D", rocker, m.ground, at=(2, 0, 0), axis=(0, 1, 0))
    m.rotation("motor", pin, "0.5*TIME")
    return m


@pytest.mark.parametrize(
    "thing",
    [
        GearSpec(20, "2 mm", bore_radius="6 mm"),
        GearSpec.ring(60, "2 mm"),
        GearSpec(23, "2 mm", helix_angle="15 deg"),
        GearPair.paper(backlash="0.1 mm"),
        four_bar(),
        gear_rig(GearPair.paper(), speed="1000 rpm"),
        Case(operation={"speed": [["0 s", "0 rpm"], ["1 s", "3000 rpm"]]}),
    ],
    ids=["wheel", "ring", "helical wheel", "pair", "four bar", "rig", "case"],
)
@pytest.mark.slow
def test_things_draw_themselves(thing):
    figure = thing.plot()
    assert isinstance(figure, Figure)
    assert_readable(figure, overlap=0.3)
    assert "<table>" in thing._repr_html_()


def test_the_topology_is_that_of_the_mechanism():
    rig = gear_rig(GearPair.paper(), speed="1000 rpm")
    found = {(edge.name, frozenset((edge.first, edge.second)), edge.style) for edge in edges_of(rig)}
    assert found == {
        ("bearing 1", frozenset(("shaft 1", "ground")), "joint"),
        ("bearing 2", frozenset(("shaft 2", "ground")), "joint"),
        ("drive", frozenset(("shaft 1", "ground")), "motion"),
        ("load", frozenset(("shaft 2", "ground")), "force"),
        ("mesh", frozenset(("gear 1", "gear 2")), "force"),
        ("seat 1", frozenset(("gear 1", "shaft 1")), "joint"),
        ("seat 2", frozenset(("gear 2", "shaft 2")), "joint"),
    }
    places = layers(["ground", *rig.bodies], edges_of(rig))
    assert [places[name][1] for name in ("ground", "shaft 1", "shaft 2", "gear 1", "gear 2")] == [0, 1, 1, 2, 2]
    assert len(set(places.values())) == 5
    assert mechanism_plot(rig).axes[0].get_title(loc="left").endswith("4 bodies, 1 degree of freedom")


def test_couplers_free_bodies_and_long_names_are_drawn():
    m = Mechanism("planets")
    names = ["a sun wheel with a very long name", "planet", "free body"]
    bodies = [m.body(name, 1.0, (1, 1, 1), position=(k, 0, 0)) for k, name in enumerate(names)]
    pins = [m.revolute(f"pin {k}", body, m.ground, axis=(0, 0, 1)) for k, body in enumerate(bodies[:2])]
    m.gear("mesh", *pins, ratio=-2.0)
    m.torque("push", bodies[2], 1.0)
    edges = {(edge.name, edge.style) for edge in edges_of(m)}
    assert ("mesh", "constraint") in edges
    assert ("push", "force") in edges
    assert_readable(m.plot(), overlap=0.3)


def test_a_mechanism_that_cannot_be_assembled_is_drawn_all_the_same():
    m = Mechanism("nothing yet")
    assert mechanism_plot(m).axes[0].get_title(loc="left") == "nothing yet: 0 bodies"


@pytest.mark.slow
def test_a_solution_shows_what_moves():
    solution = four_bar().simulate(0.2)
    figure = solution.plot()
    assert_readable(figure)
    labels = [ax.get_ylabel() for ax in figure.axes]
    assert labels == ["displacement, m", "angular speed, rad/s", "joint force, N"]
    html = solution._repr_html_()
    assert "Solution of four bar" in html
    assert "success" in html
    still = Mechanism("still")
    still.fixed("hold", still.body("b", 1.0, (1, 1, 1)), still.ground)
    assert solution_plot(still.simulate(0.01)).axes


@pytest.mark.slow
def test_reports_draw_and_save_themselves(tmp_path):
    t = np.arange(51200) / 12800.0
    teeth, shaft = 30, 10.0
    wave = np.sin(2 * np.pi * teeth * shaft * t) + 0.1 * np.random.default_rng(1).normal(size=t.size)
    signal = gm.make_signal(wave, 12800.0, units="m/s^2", speed=2 * np.pi * shaft)
    geared, plain = gm.analyse(signal, teeth=teeth), gm.analyse(signal)
    for figure in (geared.plot(), geared.plot(signal=signal), plain.plot(title="plain")):
        assert_readable(figure, overlap=0.4)
    geared.average = None
    assert geared.plot().axes[0].get_ylabel() == "RMS, m/s²"
    both = gm.compare({"low": {"healthy": signal, "worn": 2.0 * signal}}, teeth=teeth)
    assert_readable(both.plot(), overlap=0.4)
    for k, report in enumerate((geared, plain, both)):
        shown = report._repr_html_()
        assert shown.count("<table>") == len(re.findall(r"^\|-", report.to_markdown(), re.MULTILINE))
        assert "data:image/svg+xml" in shown
        assert "<html" not in shown
        assert report._repr_markdown_()
        assert report.save(tmp_path / f"{k}.md").read_text() == report.to_markdown()
        page = report.save(tmp_path / f"{k}.html").read_text()
        assert page.count("<table>") == len(re.findall(r"^\|-", report.to_markdown(), re.MULTILINE))
        assert "data:image/svg+xml" in page
        found = json.loads(report.save(tmp_path / f"{k}.json").read_text())
        assert found["kind"] == type(report).__name__
        assert set(found["tables"]) == set(report.tables())
        paths = report.save(tmp_path / f"{k}.csv")
        assert [path.name for path in paths] == [f"{k}_{name}.csv" for name in report.tables()]
        table = next(iter(report.tables().values()))
        pd.testing.assert_frame_equal(pd.read_csv(paths[0]), table.reset_index(drop=True), check_dtype=False)


def test_tables_tell_what_the_user_gave():
    case = Case(name="<mine>", operation={"speed": "1500 rpm"}, fault={"teeth": "wear"})
    html = case._repr_html_()
    assert "Case &lt;mine&gt;" in html
    assert '<td style="text-align:left">1500 rpm</td>' in html
    # what was not given, in the unit people use
    assert "100 N m" in html
    assert "15 mm" in html
    assert "wear: wheel driver" in html
    assert "Mesh frequency 725 Hz; signals at 12800 Hz" in html
    wheel = GearSpec(20, "2 mm", name="sun")._repr_html_()
    assert "Wheel sun" in wheel
    assert "20.0000 mm" in wheel
    table = four_bar()._repr_html_()
    assert "four bar: 18 coordinates, 21 constraint rows" in table
    assert np.all([name in table for name in ("pin A", "motor", "revolute")])
