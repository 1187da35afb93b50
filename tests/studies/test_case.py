"""Case files: units as text, unknown keys, impossible values."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from gearmbs.schema.quantities import counts
from gearmbs.studies import Case, CaseError, load_case, make_case, paper_cases
from gearmbs.studies.case import case as case_module
from gearmbs.studies.case.section import CaseWarning, sections_of
from gearmbs.studies.case.sections import Gears, Operation
from tests.generators import cases, seed
from tests.says import says

FILE = """
name = "tilted"
[operation]
speed = "1500 rpm"
torque = "0.15 kN m"
duration = "200 ms"
[fault]
misalignment = "0.5 deg"
plane = "inclination"
backlash = "0.2 mm"
[contact]
stiffness = "2.9852e5 N/mm^1.3"
depth = "10 um"
[solver]
integrator = "IDA"
"""


def test_case_file_with_units(tmp_path):
    path = tmp_path / "tilted.toml"
    path.write_text(FILE)
    case = load_case(path)
    assert case.operation.speed == pytest.approx(1500 * 2 * np.pi / 60)
    assert case.operation.torque == pytest.approx(150.0)
    assert case.fault.misalignment == pytest.approx(np.deg2rad(0.5))
    assert case.contact.depth == pytest.approx(1e-5)
    # 29 teeth at 25 turns a second
    assert case.mesh_frequency == pytest.approx(725.0)
    pair = case.pair()
    # N/mm^1.3 to N/m^1.3: times 1000^1.3
    assert pair.contact.stiffness == pytest.approx(2.9852e5 * 1e3**1.3, rel=1e-12)
    again = make_case(json.loads(case.model_dump_json()))
    assert again == case


def test_case_file_with_a_byte_order_mark(tmp_path):
    (tmp_path / "a.toml").write_text('[operation]\nspeed = "600 rpm"\n', encoding="utf-8-sig")
    assert load_case(tmp_path / "a.toml").operation.speed == pytest.approx(62.83185307179586)


def test_name_defaults_to_the_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("[operation]\ntorque = 50.0\n")
    assert load_case(path).name == "mine"
    path.write_text("[operation]\ntorque = 60.0\n", encoding="utf-8-sig")
    assert load_case(path).operation.torque == 60.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[operation]\nspead = '10 rpm'", says("operation.spead", "speed")),
        ("[operation]\nspeed = '10 parsnips'", r"operation.speed = '10 parsnips'"),
        ("[operation]\nspeed = '10 mm'", says("operation.speed", "'10 mm'", "write", "'1 rpm'")),
        ("[operation]\nspeed = -1.0", r"operation.speed = -1.0"),
        ("[operation]\ntorque = nan", says("operation.torque", "NaN", "give a finite")),
        (
            "[fault]\nbacklash = '-0.1 mm'",
            says("GearPair.backlash", "-0.1 mm", "give 0 or more", "centre_distance_error"),
        ),
        ("[fault]\nplane = 'diagonal'", r"fault.plane = 'diagonal'"),
        ("[gears]\nface_width = 0.0", r"face_width"),
        ("[gears]\nteeth = [3, 29]", says("driver.teeth", "3", "give", "5 or more")),
        ("[contact]\ndepth = '0 mm'", says("contact.depth", "'0 mm'", "give 1e-06 to 10 mm")),
        (
            "[solver]\nsignal_rate = 1e6\noutput_rate = 51200.0",
            says("solver.signal_rate", "1e+06", "51200", "raise output_rate"),
        ),
        ("[engine]\npower = 1", says("engine", "ones are name")),
        ("[operation\n", r"not a valid TOML file"),
    ],
)
def test_wrong_case_files(tmp_path, text, words):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(CaseError, match=words):
        load_case(path)


def test_missing_file():
    with pytest.raises(CaseError, match=says("nowhere.toml", "No such file")):
        load_case(Path("nowhere.toml"))


def test_changed_keeps_the_rest():
    case = Case(operation={"torque": "200 N m"}).changed(fault={"misalignment": "1 deg"})
    assert case.operation.torque == 200.0
    assert case.fault.plane == "skew"


def test_changed_shares_the_other_sections_and_what_was_made_of_them():
    case = Case(gears={"module": "3 mm"}, operation={"torque": "200 N m"})
    other = case.changed(operation={"torque": "150 N m"})
    assert other.gears is case.gears
    assert other.pair().driver is case.pair().driver
    assert (other.pair().torque, case.pair().torque) == (150.0, 200.0)
    assert other == Case(gears={"module": "3 mm"}, operation={"torque": "150 N m"})
    assert other.settings()["gears"]["module"] == "3 mm"


def test_a_copy_with_other_values_has_what_follows_from_these():
    case = Case(gears={"module": "3 mm"}, operation={"speed": "1000 rpm"})
    assert case.mesh_frequency == pytest.approx(29 * 1000 / 60)
    wheel = case.pair().driver
    gears = case.gears.model_copy(update={"module": 0.004})
    assert gears.wheels[0].module == 0.004
    assert gears.written == {}
    fast = case.model_copy(update={"gears": gears, "operation": Case(operation={"speed": "2000 rpm"}).operation})
    assert fast.pair().driver.module == 0.004
    assert fast.mesh_frequency == pytest.approx(29 * 2000 / 60)
    assert case.pair().driver is wheel


def test_the_pair_is_built_once_and_anew_for_a_changed_case():
    case = Case()
    pair = case.pair()
    assert case.pair() is pair
    assert case == Case()
    tilted = case.model_copy(update={"fault": Case(fault={"misalignment": "1 deg"}).fault})
    assert tilted.pair().misalignment == pytest.approx(np.pi / 180)
    assert case.pair().misalignment == 0.0


def test_paper_cases():
    cases = paper_cases()
    assert [c.name for c in cases][:3] == ["healthy, low load", "misaligned, low load", "distance, low load"]
    assert {c.operation.torque for c in cases} == {100.0, 200.0}
    with pytest.raises(CaseError, match="low and a high torque"):
        paper_cases(torques=(200.0, 100.0))


def test_faults_of_teeth_by_name_table_and_file(tmp_path):
    from gearmbs.gears.faults import BrokenTooth, Pit

    path = tmp_path / "broken.toml"
    path.write_text(
        '[[fault.teeth]]\nkind = "broken tooth"\nlost = 0.4\n[[fault.teeth]]\nkind = "Pit"\ndepth = "30 um"\n'
    )
    case = load_case(path)
    assert case.pair().faults == (BrokenTooth(lost=0.4), Pit(depth="30 um"))
    assert make_case(json.loads(case.model_dump_json())) == case
    assert Case(fault={"teeth": Pit(depth="30 um")}).fault.teeth == case.fault.teeth[1:]
    changed = Case().changed(fault={"teeth": "chipped corner"})
    assert [fault.label for fault in changed.pair().faults] == ["chipped corner"]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("chip", says("kind 'chip'")),
        ({"kind": "pitting", "deep": 1}, says("pitting", "'deep'", "depth")),
        ({"kind": "pitting", "depth": "1 N"}, r"fault.teeth\[0\].depth: '1 N' is in N"),
        ({"lost": 0.3}, says("'kind'", "write its name")),
        (3, "3 is no fault"),
    ],
)
def test_wrong_faults_of_teeth(fault, words):
    with pytest.raises(CaseError, match=words):
        make_case({"fault": {"teeth": fault}})


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"kind": "broken tooth", "lost": 1.5}, r"fault\.teeth\[1\]\.lost is 1\.5; give"),
        ({"kind": "broken tooth", "tooth": 1.5}, r"fault\.teeth\[1\]\.tooth is 1\.5; give"),
        ({"kind": "cumulative pitch error", "order": 20}, says("fault.teeth[1]", "order", "20", "14", "give 1")),
        ({"kind": "wear", "teeth": "some"}, r"fault\.teeth\[1\]\.teeth is 'some'; give 'all'"),
        ({"kind": "chipped corner", "length": "50 mm"}, r"fault\.teeth\[1\]\.length is 0\.05 m"),
        ({"kind": "pitting", "depth": "3 kg"}, r"fault\.teeth\[1\]\.depth"),
        ({"kind": "wear", "size": 1}, r"fault\.teeth\[1\]: wear: unknown key 'size'"),
    ],
)
def test_faults_that_do_not_fit_are_named_by_their_place(fault, words):
    with pytest.raises(CaseError, match=words):
        make_case({"fault": {"teeth": ["eccentricity", fault]}})


WRONG = [
    ({"bogus": 1}, "case: bogus: unknown"),
    ({"operation": {"speed": "10 N m"}}, "case: operation.speed = '10 N m': '10 N m' is in"),
    ({"gears": {"modul": "3 mm"}}, says("gears.modul", "module")),
    ({"speed": "1000 rpm"}, says("operation.speed", "unknown key")),
    ({"operation": "1000 rpm"}, says("'1000 rpm'", "give its keys")),
    ({"gears": {"teeth": 20.5}}, r"^\S+: gears.teeth = 20.5: give a whole number$"),
    ({"gears": {"teeth": [20, 21, 22]}}, "gears.teeth = .*3 values; give"),
    ({"contact": {"depth": 0.01}}, says("contact.depth", "10 mm", "m")),
    ({"fault": {"teeth": {"kind": "broken tooth", "lost": 1.5}}}, says("fault.teeth[0]", "1.5", "give a share")),
    ({"fault": {"teeth": {"kind": "root crack", "depth": "50 mm"}}}, r"fault.teeth\[0\]: crack depth is 50.0000 mm"),
    (
        {"fault": {"teeth": {"kind": "broken tooth", "tooth": 99}}},
        says("0", "99", "28", "wheel has teeth"),
    ),
    (
        {"fault": {"teeth": {"kind": "wear", "teeth": [3, 77]}}},
        says("0", "77", "28", "wheel has teeth"),
    ),
    ({"fault": {"teeth": {"kind": "pitting", "depth": "30 mm"}}}, says("fault.teeth[0].depth", "30 mm", "3.065 mm")),
    ({"fault": {"teeth": "root cracks"}}, says("teeth", "root crack")),
    ({"fault": {"teeth": {"kind": "wear", "deptt": 1}}}, says("deptt", "depth")),
    (
        {"operation": {"speed": [["0 s", "0 rpm"], ["0 s", "5 rpm"]]}},
        says("2", "0 s", "give times"),
    ),
    ({"operation": {"speed": [["0 s", "0 rpm"], ["1 s", "5 mm"]]}}, says("2", "'5 mm'", "speed")),
    ({"operation": {"speed": [["0 s", "0 rpm"]]}}, says("case", "needs two points")),
    ({"operation": {"speed": ["0 rpm", "5 rpm"]}}, says("value", "list of points")),
]


@pytest.mark.parametrize(("data", "words"), WRONG)
def test_every_way_in_has_one_error_of_one_line(tmp_path, data, words):
    """Constructor, dictionary, change of a case and pydantic's own methods; a file in the same words."""
    ways = (
        lambda: Case(**data),
        lambda: make_case(data),
        lambda: Case.model_validate(data),
        lambda: Case.model_validate_json(json.dumps(data)),
        lambda: Case().changed(**data),
    )
    for way in ways:
        with pytest.raises(CaseError, match=words) as caught:
            way()
        assert len(str(caught.value).splitlines()) == 1
        assert "pydantic" not in str(caught.value)


def test_sections_raise_the_same_error():
    with pytest.raises(CaseError, match=r"case: gears.teeth = \[3\]: 1 values") as caught:
        Gears(teeth=[3])
    assert len(str(caught.value).splitlines()) == 1
    with pytest.raises(CaseError, match=says("name", "give its fields")):
        Operation(3)
    case = Case()
    for change, words in (
        (lambda: setattr(case, "name", "x"), "case.name"),
        (lambda: setattr(case.operation, "speed", 1.0), "operation.speed"),
    ):
        with pytest.raises(CaseError, match=rf"{words}: .* does not change .*changed\(\.\.\.\)") as caught:
            change()
        assert len(str(caught.value).splitlines()) == 1


def test_one_count_of_teeth_is_for_both_wheels(tmp_path):
    path = tmp_path / "twenty.toml"
    path.write_text("[gears]\nteeth = 20\nprofile_shift = 0.2\n[solver]\nintegrator = 'gstiff'\n")
    case = load_case(path)
    assert case.gears.teeth == (20, 20)
    assert case.gears.profile_shift == (0.2, 0.2)
    assert case.solver.integrator == "GSTIFF"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"operation": {"speed": 1000}}, says("9549.3 rpm", "'1000 rad/s'", "write '1000 rpm'")),
        ({"shafts": {"radius": 1.0}}, says("shafts.radius = 1.0", "m", "1000 mm")),
    ],
)
def test_plain_numbers_that_look_like_another_unit_are_remarked(data, words):
    with pytest.warns(CaseWarning, match=words):
        Case(**data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Case(operation={"speed": "1000 rad/s"}, shafts={"radius": "1 m"})
        Case(operation={"speed": 104.71975511965977})


def test_quantities_are_kept_as_the_user_wrote_them():
    case = Case(operation={"speed": "1500 rpm", "torque": 80.0}, gears={"face_width": ["22 mm", "20 mm"]})
    assert case.operation.written == {"speed": "1500 rpm"}
    assert case.gears.written == {"face_width": ["22 mm", "20 mm"]}
    changed = case.changed(operation={"torque": "90 N m"})
    assert changed.operation.written == {"speed": "1500 rpm", "torque": "90 N m"}
    assert changed == make_case(json.loads(changed.model_dump_json()))


def test_speed_and_torque_as_curves(tmp_path):
    path = tmp_path / "up.toml"
    path.write_text(
        '[operation]\nspeed = [["0 s", "0 rpm"], ["2 s", "3000 rpm"]]\ntorque = [[0.0, "50 N m"], [1.5, 100.0]]\n'
    )
    case = load_case(path)
    assert case.operation.speed_curve == ((0.0, 0.0), (2.0, pytest.approx(100 * np.pi)))
    assert case.operation.torque_curve == ((0.0, 50.0), (1.5, 100.0))
    assert case.operation.duration == 2.0
    assert case.mesh_frequency == pytest.approx(29 * 50.0)
    # a STEP covers half the way of its end speed
    assert case.angle_turned == pytest.approx(100 * np.pi, rel=1e-12)
    assert case.pair().torque == 100.0
    assert make_case(json.loads(case.model_dump_json())) == case
    assert case.changed(operation={"speed": [[0, 0], [3, "3000 rpm"]]}).operation.duration == 3.0


def test_a_duration_that_a_new_curve_replaces_is_named():
    """One that is given beside the curve, one that was never given, and one beside a new constant speed are not."""
    curve, case = [[0, "500 rpm"], ["0.3 s", "1500 rpm"]], Case(operation={"duration": "0.2 s"})
    with pytest.warns(CaseWarning, match=says("operation.duration", "'0.2 s'", "give", "curve")):
        assert case.changed(operation={"torque": [[0, 10.0], [0.4, 50.0]]}).operation.duration == 0.4
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert case.changed(operation={"speed": curve, "duration": "0.2 s"}).operation.duration == 0.2
        assert case.changed(operation={"speed": "1500 rpm"}).operation.duration == 0.2
        up = Case().changed(operation={"speed": curve})
        assert up.operation.duration == 0.3
        assert up.changed(operation={"speed": [[0, "500 rpm"], [0.5, "900 rpm"]]}).operation.duration == 0.5


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"name": 3}, "case: name = 3: give a text"),
        ({"solver": {"integrator": "X"}}, "solver.integrator = 'X': choose 'WSTIFF', 'GSTIFF' or 'IDA'"),
        ({"solver": {"tolerance": "abc"}}, "solver.tolerance = 'abc': give a number"),
        ({"solver": {"lump": "maybe"}}, "solver.lump = 'maybe': give true or false"),
        ({"fault": {"plane": "up"}}, "fault.plane = 'up': choose 'skew' or 'inclination'"),
        ({"operation": {"speed": None}}, "operation.speed = None: give a number or a list"),
        ({"gears": {"teeth": {}}}, "gears.teeth = {}: give a whole number"),
        ({"gears": {"teeth": 20.5}}, "give a whole number"),
    ],
)
def test_faults_are_told_in_our_own_words_in_one_line(data, words):
    with pytest.raises(CaseError) as found:
        Case(**data)
    assert words in str(found.value)
    assert "\n" not in str(found.value)


def test_names_that_are_no_fields_are_refused_like_keys():
    case = Case()
    with pytest.raises(CaseError, match=says("case.bogus")):
        setattr(case, "bogus", 3)  # noqa: B010
    with pytest.raises(CaseError, match=says("gears.tooth", "teeth")):
        setattr(case.gears, "tooth", 3)  # noqa: B010


@pytest.mark.parametrize("case", range(cases(20)))
def test_what_a_case_shows_is_what_differs_and_makes_it_again(case):
    """Changed and changed back, with units or in SI: the text has no default and is a program for the same case."""
    rng = np.random.default_rng((seed(), case))
    pool = [
        ("operation", "speed", "1500 rpm"), ("operation", "torque", 73.0), ("fault", "backlash", "0.2 mm"),
        ("fault", "misalignment", 0.002), ("gears", "teeth", (21, 33)), ("solver", "tolerance", 1e-6),
        ("shafts", "radius", "12 mm"), ("contact", "damping", "300 N s/mm"), ("friction", "enabled", False),
        ("fault", "teeth", {"kind": "broken tooth", "tooth": 3}),
    ]  # fmt: skip
    changed, wanted = Case(name="one"), set()
    for k in rng.choice(len(pool), int(rng.integers(1, 5)), replace=False):
        section, field, value = pool[k]
        changed = changed.changed(**{section: {field: value}})
        wanted.add(field)
    text = repr(changed)
    assert eval(text, vars(case_module)) == changed
    for name in ("exponent", "density", "settling", "lump", "youngs_modulus"):
        assert name not in text
    assert all(f"{field}=" in text for field in wanted)


def test_a_changed_case_keeps_what_does_not_change():
    """Sections that stay are the same objects, a plain number is remarked once, and the case file stays short."""
    with pytest.warns(CaseWarning, match="shafts.length"):
        case = Case(name="a", shafts={"length": 0.5}, operation={"torque": "60 N m"})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        other = case.changed(name="b", operation={"torque": "70 N m"})
    assert other.shafts is case.shafts
    assert (other.operation.torque, case.operation.torque) == (70.0, 60.0)
    assert other.settings() == {**case.settings(), "name": "b", "operation": other.operation.settings()}
    assert "[gears]" not in case_module.case_toml(other)
    with pytest.raises(CaseError, match=r"operation.torque = '70 m'"):
        case.changed(operation={"torque": "70 m"})


def test_a_section_that_has_been_changed_unchecked_is_checked_again():
    gears = Case().gears.model_copy(update={"tip_radius": (0.001, 0.001)})
    with pytest.raises(CaseError, match=says("gears.tip_radius", "1.0000 mm", "[driver, driven]")):
        Case(gears=gears)


COUNTING = [
    (section, name)
    for section, kind in sections_of(Case).items()
    for name, field in kind.model_fields.items()
    if counts(field.annotation)
]


@pytest.mark.parametrize(("section", "name"), COUNTING)
def test_true_is_no_number_of_any_field(section, name):
    with pytest.raises(CaseError, match=says(f"{section}.{name}", "True", "give")):
        Case(**{section: {name: True}})
