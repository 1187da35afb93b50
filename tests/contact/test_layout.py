"""The records of the tables and of the scratch, and the rules the loops over sections rely on."""

import numpy as np
import pytest

from gearmbs.contact import gear_contact, layout
from gearmbs.contact.laws import power
from gearmbs.gears import GearPair

from .probe_tools import Contact

RECORDS = {name: value for name, value in vars(layout).items() if isinstance(value, np.dtype)}


@pytest.mark.parametrize("name", RECORDS)
def test_fields_do_not_overlap_and_fit(name):
    table = RECORDS[name]
    end = 0
    for kind, offset, *_ in table.fields.values():
        assert offset == end
        assert offset % 8 == 0
        end += kind.itemsize
    assert end <= table.itemsize < end + layout.CACHE_LINE
    assert table.itemsize % layout.CACHE_LINE == 0


def test_strips_fit_behind_the_scratch():
    for slices in (1, 7, 8, 11, 14, 15, 41, 161):
        strips = layout.strip_count(slices)
        assert (layout.LANES - 1) * (strips - 1) < slices <= (layout.LANES - 1) * strips
        end = layout.CACHE_LINE - 1 + layout.SCRATCH.itemsize + 2 * strips * layout.STRIP.itemsize
        assert end <= 8 * layout.work_size(slices)


def test_values_stand_before_derivatives_in_a_strip():
    names = list(layout.STRIP.names)
    values = names[: names.index("rate_x")]
    assert {"gap", "rate", "grad", "zeta", "alpha", "kind"} <= set(values)
    assert set(names) - set(values) == {"rate_x", "alpha_x", "hess"}


@pytest.mark.parametrize(
    "names",
    [("force_left", "force_right"), ("elastic_left", "elastic_right"), ("x_left", "x_right"), ("v_left", "v_right")],
)
def test_rows_read_from_one_lane_before_follow_one_whose_last_lane_is_empty(names):
    above, row = names
    kind, offset = layout.LOADS.fields[above][:2]
    assert layout.LOADS.fields[row][1] == offset + kind.itemsize


@pytest.mark.parametrize("slices", [1, 11, 41])
def test_scratch_needs_no_preparation_and_nothing_is_written_beyond_it(slices):
    pair = GearPair.paper(misalignment="1 deg", backlash="0.1 mm")
    contact = Contact(pair, slices)
    rng = np.random.default_rng(2)
    for _ in range(5):
        state = [np.ascontiguousarray(a) for a in contact.state(rng.uniform(0, 6), 4e-5, 100.0)]
        results = []
        for filling in (0.0, np.nan):
            work = np.full(contact.work.size + 64, filling)
            work[contact.work.size :] = 7.0
            wrench, jac, diag = np.zeros(6), np.zeros((6, 24)), np.zeros(layout.DIAGNOSTICS)
            gear_contact(contact.gi, contact.gr, *state, wrench, jac, diag, 1, work[: contact.work.size])
            assert (work[contact.work.size :] == 7.0).all()
            results.append(np.concatenate([wrench, jac.ravel(), diag]))
        assert results[0][:6].any()
        assert np.array_equal(*results)


@pytest.mark.slow
def test_powers_are_good_to_rounding():
    rng = np.random.default_rng(4)
    x = 10.0 ** rng.uniform(-12, 1, 4000)
    for e in (1.0, 10 / 9, 1.3, 1.5, 2.2, 3.0):
        mine = np.array([power(float(v), e) for v in x])
        assert mine == pytest.approx(x**e, rel=1e-14)
