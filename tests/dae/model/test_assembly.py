"""Which constraint rows are removed, and assembly from a pose where others are redundant than in the end."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from benchmarks.iftomm import models
from gearmbs.dae.equations.unknowns import I3
from gearmbs.dae.model import initial
from gearmbs.mechanism import Mechanism, ModelError, static_equilibrium


def scaled_jacobian(mechanism: Mechanism) -> csc_array:
    """Rows of length 1."""
    system = mechanism.compile()
    jacobian, _, _ = system.constraint_jacobian(system.pose, 0.0)
    scaled = csc_array(jacobian.sparse() @ diags_array(1.0 / np.sqrt(system.coordinate_weights())))
    norms = np.sqrt(np.asarray(scaled.multiply(scaled).sum(axis=1)).ravel())
    return csc_array(diags_array(1.0 / norms) @ scaled)


@pytest.mark.parametrize("mechanism", [models.four_bars(12), models.andrews(), models.bricard()], ids=lambda m: m.name)
def test_sparse_and_dense_search_agree(mechanism):
    """Gram-Schmidt through the rows in order is what the sparse search must find."""
    scaled = scaled_jacobian(mechanism)
    dense = scaled.toarray()
    rank = np.linalg.matrix_rank(dense, tol=1e-6)
    np.testing.assert_array_equal(initial._sparse_rows(scaled), initial._greedy_rows(dense, rank))


def test_pivots_that_rounding_has_blurred_are_looked_at_again(monkeypatch):
    """Where rows lie close together rounding lifts pivots of dependent rows: to 3e-5 in a robot of 566 rows."""
    scaled = scaled_jacobian(models.four_bars(12))
    expected = initial._sparse_rows(scaled)
    pivots = initial._pivots
    dependent = np.setdiff1d(np.arange(scaled.shape[0]), expected)[[3, 20]]

    def blurred(gram, order):
        found = pivots(gram, order)
        if order == "NATURAL":
            found[dependent] = 3e-5
        return found

    monkeypatch.setattr(initial, "_pivots", blurred)
    np.testing.assert_array_equal(initial._sparse_rows(scaled), expected)


@pytest.mark.slow
def test_long_chain_has_no_redundant_rows():
    """A squared distance between rows falls with the cube of the length; it is not taken for zero."""
    m = Mechanism("chain", gravity=(0, 0, -9.81))
    last, count = m.ground, 2500
    for k in range(count):
        link = m.body(f"link {k}", 1.0, (0.01, 0.1, 0.1), position=(k + 0.5, 0, 0))
        m.revolute(f"pin {k}", link, last, at=(k, 0, 0), axis=(0, 1, 0))
        last = link
    report = m.compile().initialise()
    assert report.degrees_of_freedom == count
    assert not report.redundant


def test_hundreds_of_redundant_rows():
    report = models.four_bars(120).compile().initialise()
    assert report.degrees_of_freedom == 1
    assert len(report.redundant) == 360


def test_other_rows_are_redundant_where_the_bar_ends_up():
    """Welded 0.3 rad away from where it can be: at the start x is needed to close it, at the end it is redundant."""
    m = Mechanism("welded bar")
    axes = np.array([[np.cos(0.3), 0, -np.sin(0.3)], [0, 1, 0], [np.sin(0.3), 0, np.cos(0.3)]])
    bar = m.body("bar", 1.0, (0.1, 0.1, 0.1), orientation=axes)
    m.revolute("pin", bar, m.ground, axis=(0, 1, 0))
    tip, place = bar.marker((1, 0, 0)), m.ground.marker((1, 0, 0))
    m.joint("fixed", "weld", tip, place)
    system = m.compile()
    report = system.initialise()
    assert report.degrees_of_freedom == 0
    assert report.violation < 1e-9
    np.testing.assert_allclose(system.pose[0, 3:12].reshape(3, 3), np.eye(3), atol=1e-7)
    place.position[2] = 0.01
    with pytest.raises(ModelError, match="conflicting constraints: weld"):
        m.compile().initialise()


@pytest.mark.parametrize("angle", ["80 deg", "120 deg", "180 deg", "-170 deg", "300 deg", "7 rad", "2 + TIME"])
@pytest.mark.parametrize("lump", [False, True])
def test_a_joint_starts_at_the_angle_prescribed(angle, lump):
    """From a quarter of a turn on the nearest zero of the sine of what the angle lacks is the one half a turn off."""
    number, unit = angle.split()[0], angle.split()[1]
    exact = float(number) * (np.pi / 180.0 if unit == "deg" else 1.0)
    m = Mechanism("arm")
    arm = m.body("arm", 1.0, (1, 1, 1), position=(0.5, 0, 0))
    pin = m.revolute("pin", arm, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.rotation("motion", pin, angle)
    place = m.simulate(0.01, rate=100, lump=lump).com_position("arm")[0]
    np.testing.assert_allclose(place, [0.5 * np.cos(exact), 0.5 * np.sin(exact), 0.0], atol=1e-9)
    start = static_equilibrium(m).pose[0, :3]
    np.testing.assert_allclose(start, place, atol=1e-9)


def test_a_linkage_follows_its_crank_to_the_angle_prescribed():
    """A slider crank drawn with its crank at 0 keeps its branch: the slider stays on its side."""
    m = Mechanism("slider crank")
    crank = m.body("crank", 1.0, (1, 1, 1), position=(0.05, 0, 0))
    rod = m.body("rod", 1.0, (1, 1, 1), position=(0.2, 0, 0))
    slider = m.body("slider", 1.0, (1, 1, 1), position=(0.3, 0, 0))
    pin = m.revolute("pin", crank, m.ground, at=(0, 0, 0))
    m.revolute("big end", rod, crank, at=(0.1, 0, 0))
    m.revolute("small end", rod, slider, at=(0.3, 0, 0))
    m.translational("guide", slider, m.ground, at=(0.3, 0, 0), axis=(1, 0, 0))
    m.rotation("motion", pin, "140 deg")
    angle = np.radians(140.0)
    expected = 0.1 * np.cos(angle) + np.sqrt(0.2**2 - (0.1 * np.sin(angle)) ** 2)
    found = m.simulate(0.01, rate=100)
    assert found.com_position("slider")[0, 0] == pytest.approx(expected, abs=1e-9)
    assert "the assembly" in str(m.compile().initialise())


def test_markers_drawn_opposite_each_other_stay():
    """Where x axes are drawn opposite and the motion begins at 0, nothing is turned."""
    m = Mechanism("opposite")
    wheel = m.body("wheel", 1.0, (1, 1, 1))
    turned = np.diag([-1.0, -1.0, 1.0])
    pin = m.revolute("pin", wheel.marker((0, 0, 0), turned), m.ground.marker())
    m.rotation("motion", pin, "TIME")
    solution = m.simulate(0.5, rate=10)
    np.testing.assert_allclose(solution.orientation("wheel")[0], np.eye(3), atol=1e-9)
    assert np.ptp(solution.joint_angle("pin")) == pytest.approx(0.5)


def test_tables_for_the_kernels_are_packed_once_and_handed_out_as_copies():
    m = Mechanism("pendulum")
    bar = m.body("bar", 1.0, (1e-2, 1e-2, 1e-2), position=(0.1, 0.0, 0.0))
    m.revolute("hinge", bar, m.ground, at=(0.0, 0.0, 0.0))
    model = m.compile().model
    idata, rdata, size = model.pack(I3)
    kept = idata.copy(), rdata.copy()
    idata[:], rdata[:] = -1, np.nan
    again = model.pack(I3)
    assert np.array_equal(again[0], kept[0])
    assert np.array_equal(again[1], kept[1])
    assert again[2] == size
    codes = np.array([0, 1])
    assert (model.pack(I3, codes=codes)[0] != kept[0]).sum() == 1
    # of fewer rows everything is counted anew
    assert model.with_rows(np.arange(4)).counts.rows == 4
    assert model.counts.rows == 5
