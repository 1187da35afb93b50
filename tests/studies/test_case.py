"""Case files: units as text, unknown keys, impossible values."""

import json
from pathlib import Path

import numpy as np
import pytest

from gearmbs.studies import Case, CaseError, load_case, make_case, paper_cases

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


def test_name_defaults_to_the_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("[operation]\ntorque = 50.0\n")
    assert load_case(path).name == "mine"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[operation]\nspead = '10 rpm'", r"operation.spead: unknown key; known ones are speed"),
        ("[operation]\nspeed = '10 parsnips'", r"operation.speed = '10 parsnips'"),
        ("[operation]\nspeed = '10 mm'", r"operation.speed"),
        ("[operation]\nspeed = -1.0", r"operation.speed = -1.0"),
        ("[operation]\ntorque = nan", r"operation.torque"),
        ("[fault]\nbacklash = '-0.1 mm'", r"negative backlash"),
        ("[fault]\nplane = 'diagonal'", r"fault.plane = 'diagonal'"),
        ("[gears]\nface_width = 0.0", r"face_width"),
        ("[gears]\nteeth = [3, 29]", r"teeth"),
        ("[contact]\ndepth = '0 mm'", r"contact.depth"),
        ("[solver]\nsignal_rate = 1e6", r"signal_rate"),
        ("[engine]\npower = 1", r"engine: unknown key; known ones are name"),
        ("[operation\n", r"not a valid TOML file"),
    ],
)
def test_wrong_case_files(tmp_path, text, words):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(CaseError, match=words):
        load_case(path)


def test_missing_file():
    with pytest.raises(CaseError, match="cannot be read"):
        load_case(Path("nowhere.toml"))


def test_changed_keeps_the_rest():
    case = Case(operation={"torque": "200 N m"}).changed(fault={"misalignment": "1 deg"})
    assert case.operation.torque == 200.0
    assert case.fault.plane == "skew"


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
        ("chip", "kind 'chip' is unknown; known ones are chipped corner"),
        ({"kind": "pitting", "deep": 1}, "pitting: unknown key 'deep'; known ones are wheel, depth"),
        ({"kind": "pitting", "depth": "1 N"}, r"fault.teeth\[0\].depth: '1 N' is in N"),
        ({"lost": 0.3}, "write its name or a table with 'kind'"),
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
        ({"kind": "cumulative pitch error", "order": 20}, r"fault\.teeth\[1\]\.order is 20; give 1 up to 14"),
        ({"kind": "wear", "teeth": "some"}, r"fault\.teeth\[1\]\.teeth is 'some'; give 'all'"),
        ({"kind": "chipped corner", "length": "50 mm"}, r"fault\.teeth\[1\]\.length is 0\.05 m"),
        ({"kind": "pitting", "depth": "3 kg"}, r"fault\.teeth\[1\]\.depth"),
        ({"kind": "wear", "size": 1}, r"fault\.teeth\[1\]: wear: unknown key 'size'"),
    ],
)
def test_faults_that_do_not_fit_are_named_by_their_place(fault, words):
    with pytest.raises(CaseError, match=words):
        make_case({"fault": {"teeth": ["eccentricity", fault]}})
