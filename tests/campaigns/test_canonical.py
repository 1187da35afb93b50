"""Equal physics, equal key; other physics, another key."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.campaigns import CampaignError, PairSubject, canonical, content_key
from gearmbs.campaigns.settings import rounded
from gearmbs.campaigns.subjects.pair import canonical_case
from gearmbs.studies import Case


def key(**settings) -> str:
    return content_key("pair", canonical_case(Case(**settings)))


PLAIN = key()


@pytest.mark.parametrize(
    "same",
    [
        {"name": "another name"},
        {"operation": {"speed": "1000 rpm", "torque": "0.1 kN m"}},
        {"contact": {"stiffness": 2.9852e5 * 1e3**1.3}},
        {"contact": {"damping": "298.52 kN s/m", "depth": "100 um"}},
        {"solver": {"tolerance": 1e-7}},
        {"solver": {"signal_rate": "12.8 kHz", "output_rate": 51200}},
        {"gears": {"face_width": ["20 mm", 0.02], "teeth": [29, 29]}},
        {"gears": {"addendum": 95e-3 / 31}},
        {"gears": {"tip_radius": 47.5e-3}},
        {"fault": {"plane": "inclination"}},
        {"gears": {"hand": "left"}},
        {"fault": {"centre_distance_error": -0.0, "backlash": "0.1 mm"}},
    ],
    ids=str,
)
def test_the_same_in_other_words(same):
    assert key(**same) == PLAIN


@pytest.mark.parametrize(
    "other",
    [
        {"operation": {"torque": 100.001}},
        {"contact": {"exponent": 1.5, "stiffness": "2.9852e5 N/mm^1.5"}},
        {"fault": {"misalignment": "0.01 deg"}},
        {"fault": {"teeth": "broken tooth"}},
        {"friction": {"enabled": False}},
        {"friction": {"static": 0.0, "dynamic": 0.0}},
        {"solver": {"tolerance": 1e-8}},
        {"solver": {"lump": True}},
        {"gears": {"helix_angle": "10 deg"}},
        {"shafts": {"modes": 2}},
        {"shafts": {"bearings": "6206"}},
    ],
    ids=str,
)
def test_another_case(other):
    assert key(**other) != PLAIN


def test_settings_that_came_later_leave_the_keys_of_others():
    content = canonical_case(Case())
    assert content["shafts"].keys() == {"radius", "length", "density"}
    assert not {"helix_angle", "hand", "internal"} & content["gears"].keys()


def test_without_friction_its_coefficients_do_not_count():
    off = {"enabled": False}
    assert key(friction=off) == key(friction={**off, "static": 0.3})


def test_trees():
    assert canonical({"b": (1, 2.0), "a": np.float64(-0.0)}) == {"a": 0.0, "b": [1, 2.0]}
    assert rounded(0.1 + 0.2) == 0.3
    assert content_key("x", {"a": 1, "b": 2}) == content_key("x", {"b": 2, "a": 1})
    assert content_key("x", {"a": 1}) != content_key("y", {"a": 1})
    with pytest.raises(CampaignError, match="no canonical form"):
        canonical({"a": object()})


def test_a_subject_is_made_again_from_its_settings():
    subject = PairSubject(Case(fault={"teeth": {"kind": "broken tooth", "lost": 0.4}}, operation={"torque": "50 N m"}))
    again = PairSubject.from_settings(subject.settings())
    assert content_key("pair", canonical_case(again.case)) == content_key("pair", canonical_case(subject.case))
