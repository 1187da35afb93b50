"""The remark on seats that the reduction made too stiff against turning, and where there is none."""

import re
import warnings

import numpy as np
import pytest

from gearmbs.flexible import Disc, Shaft, ShaftSection, check_reduction
from gearmbs.mechanism import Mechanism, linear_modes, static_equilibrium

SEATS = {"left": 0.0, "wheel": 0.1, "right": 0.2}


def carrying(model, kind="fixed", **options):
    """A shaft in two bearings that let it tilt, with a wheel of its own on the seat in the middle."""
    m = Mechanism("carrying")
    body = model.add_to(m, damping=0.5, **options)
    m.joint("self_aligning", "first", body.marker(model.place("left")), m.ground.marker())
    m.joint("inline", "second", body.marker(model.place("right")), m.ground.marker((0, 0, 0.2)))
    wheel = m.body("disc", 2.0, (1e-3, 1e-3, 2e-3), position=(0, 0, 0.1))
    seat = body.marker(model.place("wheel"))
    if kind == "bushing":
        m.bushing("fit", seat, wheel.marker(), stiffness=(1e8,) * 3, damping=(1e3,) * 3)
    else:
        m.joint(kind, "fit", seat, wheel.marker())
    return m


def remarks(run):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run()
    return [str(w.message) for w in caught if "too stiff there" in str(w.message)]


def shaft(*discs):
    return Shaft([ShaftSection(0.2, 0.025)], discs, SEATS)


def test_a_wheel_on_a_seat_that_lost_its_flexibility_is_remarked():
    model = shaft().modal_model().slowest(8)
    exact = model.seats["wheel"].flexibility
    kept = (model.seats["wheel"].turned ** 2 / (2 * np.pi * model.frequencies[:, None]) ** 2).sum(axis=0)
    lost = 1.0 - kept / np.diag(exact)[3:]
    report = check_reduction(shaft().model(), model)
    assert report.turning["wheel"] == pytest.approx(1.0 - kept.sum() / np.trace(exact[3:, 3:]), rel=1e-9)
    for run in (
        lambda: carrying(model).simulate(1e-4, rate=1e4),
        lambda: linear_modes(carrying(model)),
        lambda: linear_modes(carrying(model, "revolute")),
    ):
        (text,) = remarks(run)
        share = float(re.search(r"lack (\d+) %", text).group(1))
        assert "8 modes" in text
        assert "'wheel'" in text
        assert "'fit'" in text
        assert "by_participation(torques=True)" in text
        assert any(share == pytest.approx(100 * x, abs=0.51) for x in lost)


@pytest.mark.slow
def test_the_remark_is_about_what_the_modes_do():
    """Eight modes hold the wheel so that its frequencies are wrong by more than five per cent."""
    found = {}
    for modes in (8, None):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model = shaft().modal_model()
            tilting = linear_modes(carrying(model.slowest(modes) if modes else model))
        found[modes] = tilting.frequencies[tilting.frequencies > 1.0][:6]
    assert np.abs(found[8] / found[None] - 1.0).max() > 0.05


@pytest.mark.parametrize(
    ("model", "kind", "options"),
    [
        (shaft().modal_model(), "fixed", {}),
        (shaft().modal_model().by_participation(torques=True), "fixed", {}),
        (shaft().modal_model().slowest(8), "spherical", {}),
        (shaft().modal_model().slowest(8), "bushing", {}),
        (shaft().modal_model().slowest(8), "fixed", {"coupling": "rigid"}),
    ],
    ids=["all modes", "modes that matter", "ball", "springs", "rigid"],
)
def test_silence_where_nothing_is_lost_or_nothing_turns(model, kind, options):
    assert remarks(lambda: linear_modes(carrying(model, kind, **options))) == []


@pytest.mark.slow
def test_silence_for_a_disc_of_the_shaft_and_for_seats_of_unknown_flexibility():
    from dataclasses import replace

    model = shaft().modal_model().slowest(8)
    unknown = replace(model, seats={k: replace(s, flexibility=None) for k, s in model.seats.items()})
    assert remarks(lambda: linear_modes(carrying(unknown))) == []
    own = shaft(Disc(0.1, mass=2.0, polar=2e-3, diametral=1e-3)).modal_model().slowest(16)
    m = Mechanism("own")
    body = own.add_to(m)
    m.joint("fixed", "hub", body.marker(own.place("wheel")), m.ground.marker((0, 0, 0.1)))
    assert remarks(lambda: static_equilibrium(m)) == []


@pytest.mark.parametrize(("slowest", "count"), [(4, 2), (None, 0)])
def test_teeth_turn_a_shaft_without_torsion(monkeypatch, slowest, count):
    from gearmbs.studies import Case
    from gearmbs.studies.run.rig import flexible_rig

    pair = Case().pair()
    whole = Shaft.modal_model
    if slowest:
        monkeypatch.setattr(Shaft, "modal_model", lambda self, modes: whole(self, modes).slowest(slowest))
    rig = flexible_rig(pair, speed=30.0)
    assert len(remarks(lambda: linear_modes(rig))) == count
