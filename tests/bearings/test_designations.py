"""Bearings as people name them: designations of makers' catalogues with boundary dimensions and ratings."""

import itertools
import math
import warnings

import pytest

from gearmbs.bearings import Bearing, BearingError
from gearmbs.bearings.designations.boundary import SAME, size_of, sizes
from gearmbs.bearings.rating import dynamic_rating, equivalent_load, rating_life
from tests.says import says

NAMED = """
6000 | deep groove | 10 26 8 | 4.6 | 4.75
6004 | deep groove | 20 42 12 | 9.4 | 9.95
6008 | deep groove | 40 68 15 | 16.8 | 17.8
6205 | deep groove | 25 52 15 | 14 | 14.8
6206-2RS1 | deep groove | 30 62 16 | 19.5 | 20.3
6208/C3 | deep groove | 40 80 18 | 32.6 | 32.5
6305 | deep groove | 25 62 17 | 20.6 | 23.4
6310 | deep groove | 50 110 27 | 61.8 | 65
6410 | deep groove | 50 130 31 | 87.1 | 87.1
61808 | deep groove | 40 52 7 | 4.5 | 4.49
61910 | deep groove | 50 72 12 | 14.5 | 14.6
16008 | deep groove | 40 68 9 | 13.3 | 13.8
6220 | deep groove | 100 180 34 | 124 | 127
6326 | deep groove | 130 280 58 | 229 | 229
6406 | deep groove | 30 90 23 | 47.3 | 43.6
1205 | self-aligning ball | 25 52 15 | 12.2 | 14.3
1210 K | self-aligning ball | 50 90 20 | 22.9 | 22.9
2206 | self-aligning ball | 30 62 20 | 15.3 | 23.8
1308 | self-aligning ball | 40 90 23 | 29.5 | 29.6
2310 | self-aligning ball | 50 110 40 | 64.4 | 63.7
2205-2RS1 | self-aligning ball | 25 52 18 | 12.5 | -
7205 BEP | angular contact | 25 52 15 | 15.5 | 15.6
7208 BECBP | angular contact | 40 80 18 | 32.1 | 36.5
7310 BEP | angular contact | 50 110 27 | 68.2 | 74.1
7214 B | angular contact | 70 125 24 | 69.1 | -
7010 CD/P4A | angular contact | 50 80 16 | - | 28.6
7204 B | angular contact | 20 47 14 | 14.1 | 14
3206 A | double row angular contact | 30 62 23.8 | 28.5 | 30
3308 A | double row angular contact | 40 90 36.5 | 62 | 64
3205 B-TVH | double row angular contact | 25 52 20.6 | 20.5 | -
QJ 208 | four point | 40 80 18 | 53.2 | -
QJ 210 MA | four point | 50 90 20 | 62.2 | 61.8
QJ 306 MA | four point | 30 72 19 | 50.4 | 53
QJ 314 | four point | 70 150 35 | 190 | -
NU 205 ECP | cylindrical roller | 25 52 15 | 29 | 32.5
NU 210 ECP | cylindrical roller | 50 90 20 | 64.4 | 73.5
NJ 310 ECP | cylindrical roller | 50 110 27 | 110 | 127
N 212 ECP | cylindrical roller | 60 110 22 | 95 | 108
NUP 208 ECP | cylindrical roller | 40 80 18 | 53.9 | 62
NU 2210 ECP | cylindrical roller | 50 90 23 | 78 | 90
NU 2310 ECP | cylindrical roller | 50 110 40 | 163 | 186
NU 1010 ECP | cylindrical roller | 50 80 16 | 36 | 46.8
NU 320 ECP | cylindrical roller | 100 215 47 | 380 | 450
NJ 2206 | cylindrical roller | 30 62 20 | 49 | 55
NCF 3008 CV | cylindrical roller | 40 68 21 | 65 | 57.2
SL182208 | cylindrical roller | 40 80 23 | 83 | -
NNU 4920 | double row cylindrical roller | 100 140 40 | 129 | -
NN 3010 K | double row cylindrical roller | 50 80 23 | 57 | 52.8
30205 | tapered roller | 25 52 16.25 | 30.1 | 33.6
30208 | tapered roller | 40 80 19.75 | 57.9 | 68
32008 X | tapered roller | 40 68 19 | 48.8 | 64.7
32210 | tapered roller | 50 90 24.75 | 79.1 | 100
30310 | tapered roller | 50 110 29.25 | 120 | 143
31310 | tapered roller | 50 110 29.25 | 102 | 122
32310 | tapered roller | 50 110 42.25 | 160 | 200
33208 | tapered roller | 40 80 32 | 105 | 132
32024 X | tapered roller | 120 180 38 | 238 | 292
33010 | tapered roller | 50 80 24 | 75 | 85
33110 | tapered roller | 50 85 26 | 86 | 108
32012 X | tapered roller | 60 95 23 | 78.5 | 98
22208 E | spherical roller | 40 80 23 | 88 | 96.5
22210 E | spherical roller | 50 90 23 | 100 | 104
22310 E | spherical roller | 50 110 40 | 190 | 220
23024 CC/W33 | spherical roller | 120 180 46 | 365 | -
23124 | spherical roller | 120 200 62 | 510 | -
22220 EK | spherical roller | 100 180 46 | 375 | 433
24030 CC/W33 | spherical roller | 150 225 75 | 620 | -
23220 CC/W33 | spherical roller | 100 180 60.3 | 495 | -
21310 E | spherical roller | 50 110 27 | 120 | 156
22316 E/C3 | spherical roller | 80 170 58 | 450 | 490
24124 CC | spherical roller | 120 200 80 | 630 | -
23934 | spherical roller | 170 230 45 | 339 | -
NA 4905 | needle roller | 25 42 17 | 22.2 | 24.2
NA 4910 | needle roller | 50 72 22 | 45 | 47.3
NKI 30/20 | needle roller | 30 45 20 | 24.8 | 35.2
RNA 4908 | needle roller | 48 62 22 | 38.7 | 43.2
HK 2520 | needle roller | 25 32 20 | 17.9 | 19
NA 6908 | needle roller | 40 62 40 | 63.8 | 67.1
K 25x30x17 | needle roller | 25 30 17 | - | 17.9
608-2Z | deep groove | 8 22 7 | 3.3 | 3.45
626 | deep groove | 6 19 6 | 2.2 | 2.34
6001-2Z | deep groove | 12 28 8 | 5.1 | 5.4
62/22 | deep groove | 22 50 14 | 12.9 | 14
6203-2RSH/C3 | deep groove | 17 40 12 | 9.6 | 9.95
4206 ATN9 | double row deep groove | 30 62 20 | 26 | 26
4310 | double row deep groove | 50 110 40 | 81.5 | -
"""
"""Designation, kind, then d, D and B in mm as the boundary plans have them, C in kN of the catalogue that the package
holds (-: none prints it, and it is estimated), and of another maker's newer one."""

ROWS = [[part.strip() for part in line.split("|")] for line in NAMED.strip().splitlines()]


def by_name(name, **changes):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return Bearing.from_designation(name, estimate=True, **changes)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_named_bearings(row):
    name, kind, plan, rating, other = row
    bearing = by_name(name)
    assert bearing.kind == kind
    found = (bearing.bore, bearing.outside_diameter, bearing.width)
    assert found == pytest.approx([1e-3 * float(part) for part in plan.split()], abs=1e-9)
    if rating == "-":
        assert not bearing.rating_source
    else:
        assert bearing.rating_source
        assert bearing.rating == pytest.approx(1e3 * float(rating))
        assert "dynamic_rating" not in bearing.estimated
        assert f"C and C0 of</th><td>{bearing.rating_source}" in bearing._repr_html_()
    if other != "-":
        # another steel, and of 2206 another design
        assert 0.6 < bearing.rating / (1e3 * float(other)) < 1.2
    # what makers do not publish is marked, but where it is known
    assert "elements" in bearing.estimated or not bearing.estimated
    assert rating_life(bearing, 0.1 * bearing.rating) == pytest.approx(1e6 * 10.0 ** (10 / 3 if bearing.rollers else 3))


NEWER = {"61808", "QJ 210 MA", "NU 205 ECP", "30205", "30208", "32008 X", "32210", "33208", "33010", "33110", "32012 X"}
"""Of which the maker named prints another C since 2008, and `NAMED` has that: up to a quarter more."""


def test_a_maker_that_is_named_has_its_own_ratings():
    """Of 43 of them C of the catalogue of 2008 is within 3 % of a newer one of the same maker, but for those known."""
    met = 0
    for name, _, _, _, other in ROWS:
        plain, own = by_name(name), by_name(f"SKF {name}")
        assert (own.bore, own.outside_diameter, own.width) == (plain.bore, plain.outside_diameter, plain.width)
        if own.rating_source == "SKF 2008":
            met += other != "-"
            newer = 1e3 * float(other) if other != "-" else own.rating
            assert own.rating == pytest.approx(newer, rel=0.26 if name in NEWER else 0.03), name
        elif own.rating_source:
            assert own.rating == plain.rating
    assert met == 43
    with pytest.warns(UserWarning, match=says("URB", "SKF", "not tabulated")):
        Bearing.from_designation("SKF 6326", estimate=True)


PRINTED = {
    "deep groove": (240, 0.84), "self-aligning ball": (80, 0.9), "angular contact": (50, 0.95), "four point": (24, 1.0),
    "double row angular contact": (34, 0.95), "double row deep groove": (30, 0.95), "cylindrical roller": (236, 1.0),
    "double row cylindrical roller": (38, 1.0), "tapered roller": (196, 1.0), "spherical roller": (120, 1.0),
    "needle roller": (104, 1.0), "thrust ball": (103, 0.98), "thrust cylindrical roller": (48, 1.0),
}  # fmt: skip
"""By kind how many sizes have a printed C, and the share of which that of estimated elements is within 3 %."""


@pytest.mark.slow
def test_estimated_elements_have_the_printed_rating():
    """C of ISO 281 of the elements that are estimated is the printed one, but of deep grooves at thin sections."""
    found: dict[str, list[float]] = {}
    for (series, code), size in sizes().items():
        letter = series[-1] if series in ("72A", "72B", "73A", "73B") else ""
        bearing = by_name(f"{series.removesuffix(letter)}{code} {letter}".strip())
        assert (bearing.bore, bearing.outside_diameter) == (size.bore, size.outside_diameter)
        if size.dynamic_rating is not None:
            assert bearing.rating == size.dynamic_rating
            found.setdefault(bearing.kind, []).append(dynamic_rating(bearing) / size.dynamic_rating)
    for kind, (count, share) in PRINTED.items():
        assert len(found[kind]) >= count
        assert sum(abs(ratio - 1.0) < 0.03 for ratio in found[kind]) >= share * len(found[kind]), kind


@pytest.mark.parametrize("name", ["618/8", "619/6-2Z", "618/5"])
def test_small_bores_of_thin_sections_stand_behind_a_stroke(name):
    assert by_name(name).bore == pytest.approx(1e-3 * int(name[4]))


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("NSK 22210 EK", "22210"),
        ("23024 CC/W33", "23024"),
        ("2206 E-2RS1TN9", "2206"),
        ("3206 ATN9", "3206 A"),
        ("FAG 6205-2RSR-C3", "6205"), ("NU 205 ECP", "NU205"), ("NJ205 ETN", "NU205"),
        ("7208 BECBP", "7208 B"), ("7208-B-JP", "7208 B"), ("32008 X/Q", "32008"), ("30205 J2/Q", "30205"),
        ("NUP 210 ECML", "NUP210"), ("NU 210 ECM/C3", "NU210/C3"),
        ("SL18 2208", "NCF 2208 V"), ("timken 33208", "33208"), ("nu 2210 ecp", "NU2210"),
    ],
)  # fmt: skip
def test_suffixes_and_makers_leave_the_plan_as_it_is(text, plain):
    found, expected = by_name(text), by_name(plain)
    for name in ("bore", "outside_diameter", "width", "kind", "dynamic_rating", "contact_angle"):
        assert getattr(found, name) == getattr(expected, name), name


def test_the_table_keeps_the_plans():
    """Bores follow from the codes, widths and diameters grow with the bore, and ratings are of one order."""
    table = sizes()
    assert len(table) > 1200
    small = {"00": 10, "01": 12, "02": 15, "03": 17}
    for (series, code), size in table.items():
        if series not in ("NKI", "HK"):
            bore = (
                small[code]
                if code in small
                else float(code[1:])
                if "/" in code
                else float(code) * (5 if len(code) == 2 else 1)
            )
            assert size.bore == pytest.approx(1e-3 * bore), (series, code)
        assert size.bore < size.outside_diameter, (series, code)
        if size.dynamic_rating is not None:
            assert size.maker, (series, code)
            assert 0.2 < size.static_rating / size.dynamic_rating < 6.0, (series, code)
    for series in {series for series, _ in table} - {"NKI", "HK"}:
        own = sorted(
            (size.bore, size.outside_diameter, size.width) for (name, _), size in table.items() if name == series
        )
        for here, further in itertools.pairwise(own):
            assert here[1] <= further[1], (series, further)
            assert here[2] <= 1.05 * further[2], (series, further)


def test_series_of_one_plan_agree():
    """A bearing of another kind has the dimensions of the dimension series that ISO 15 gives both."""
    table, met = sizes(), 0
    for (series, code), size in table.items():
        plain = series[:-1] if series in ("72A", "72B", "73A", "73B") else series
        other = table.get((SAME.get(plain, ""), code))
        if other is not None:
            met += 1
            assert size.boundary == other.boundary, (series, code)
    assert met > 200


def test_cages_are_named_by_their_raceways():
    bearing = by_name("K 25x30x17")
    assert (bearing.element_diameter, bearing.pitch_diameter) == pytest.approx((2.5e-3, 27.5e-3))
    assert bearing.estimated == ("elements", "roller_length")
    with pytest.raises(BearingError, match=says("K 30x25x17", "elements=")):
        Bearing.from_designation("K 30x25x17")


def test_needles_run_on_the_raceway_of_the_inner_ring():
    whole, bare = by_name("NA 4908"), by_name("RNA 4908")
    assert bare.bore > whole.bore
    for name in (
        "element_diameter",
        "pitch_diameter",
        "elements",
        "roller_length",
        "outside_diameter",
        "dynamic_rating",
    ):
        assert getattr(whole, name) == getattr(bare, name), name
    assert whole.pitch_diameter - whole.element_diameter == pytest.approx(48e-3)
    with pytest.raises(BearingError, match=says("NA 4908", "pitch_diameter=")):
        Bearing.from_designation("NA 4908")


def test_a_full_complement_has_more_rollers():
    assert by_name("NCF 2208 V").elements > by_name("NU2208").elements
    full = by_name("NCF 2208 V")
    assert full.elements <= math.pi / math.asin(full.element_diameter / full.pitch_diameter)


@pytest.mark.parametrize("name", ["30213", "32310", "33208", "31310"])
def test_contact_angles_follow_from_the_printed_limit(name):
    bearing = by_name(name)
    assert "contact_angle" in bearing.estimated
    assert 1.5 * math.tan(bearing.contact_angle) == pytest.approx(size_of(name[:3], name[3:]).limit)


def test_four_point_bearings_are_rated_as_two_rows():
    """As makers do: 56 kN by formula, and 62.2 and 61.8 kN in two catalogues."""
    bearing = by_name("QJ 210", dynamic_rating=None)
    single = bearing.changed(kind="angular contact")
    assert dynamic_rating(bearing) == pytest.approx(2.0**0.7 * dynamic_rating(single))
    assert by_name("QJ 210").rating == pytest.approx(62.2e3)
    assert dynamic_rating(bearing) == pytest.approx(62.2e3, rel=0.12)
    # so their load is that of two rows, as printed: 1.07 Fa, and Fr + 0.66 Fa up to Fa/Fr = 0.95
    assert equivalent_load(bearing, 0.0, 1000.0) == pytest.approx(1070.0)
    assert equivalent_load(bearing, 1000.0, 2000.0) == pytest.approx(0.6 * 1000.0 + 1.07 * 2000.0)
    assert equivalent_load(bearing, 1000.0, 900.0) == pytest.approx(1000.0 + 0.66 * 900.0)
    assert equivalent_load(single, 0.0, 1000.0) == pytest.approx(660.0)


def test_a_rating_that_is_given_counts():
    bearing = by_name("6305", dynamic_rating="23.4 kN")
    assert (bearing.rating, bearing.rating_source) == (23.4e3, "")


@pytest.mark.parametrize(
    ("name", "plan"),
    [("60/22", (22, 44, 12)), ("60/32-2Z/C3", (32, 58, 13)), ("62/28", (28, 58, 16)), ("63/22", (22, 56, 16))],
)
def test_odd_bores_stand_behind_a_stroke(name, plan):
    bearing = by_name(name)
    assert (bearing.bore, bearing.outside_diameter, bearing.width) == pytest.approx([1e-3 * part for part in plan])
    assert bearing.clearance == pytest.approx(20e-6 if "C3" in name else 0.0, abs=5e-6)
