"""Descriptions: one reader of files, fields that say what they may hold, messages with place, value and remedy."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
import pytest
from pydantic import ValidationError

import gearmbs
from gearmbs.drivetrain.description import make_description
from gearmbs.gears import GearSpec
from gearmbs.schema.described import (
    Described,
    _hints,
    _readers,
    check_keys,
    chosen,
    make,
    measures_of,
    read_toml,
    toml_table,
)
from gearmbs.schema.quantities import Measure, OneOf, OverTime, counts
from gearmbs.studies import Case, CaseError
from gearmbs.studies.case.sections import Contact, FrictionSettings, Gears, Operation, Shafts, Solver
from gearmbs.units import Given, Quantity
from tests.generators import cases, seed
from tests.says import says

GREASES = {"mineral": 1}


class MachineError(ValueError):
    """The error of what is described here."""


@dataclass(frozen=True, kw_only=True)
class Machine(Described):
    """A description with a field of every kind."""

    error: ClassVar[type[ValueError]] = MachineError

    speed: Annotated[Quantity, Measure("angular speed")]
    length: Annotated[Quantity, Measure("length", above=0)] = "20 mm"
    tilt: Annotated[Quantity, Measure("angle", -10, 10, "deg")] = 0.0
    share: Annotated[Quantity, Measure(low=0, below=1, remedy="give a share such as 0.1")] = 0.0
    factor: Annotated[Quantity, Measure()] = 1.0
    count: Annotated[int, Measure(low=1, high=9, whole=True)] = 1
    gap: Annotated[Quantity, Measure("length", 0)] = None
    at: Annotated[tuple, Measure("length", several=3)] = (0.0, 0.0, 0.0)
    levels: Annotated[tuple, Measure("force", several=-2)] = (0.0, 1.0)
    grease: Annotated[str, OneOf(GREASES)] = "mineral"
    side: Literal["left", "right"] = "left"
    torque: Annotated[object, OverTime()] = 0.0
    wheel: GearSpec | None = None
    names: tuple[str, ...] = ()
    closed: bool = False


def test_one_place_reads_toml():
    root = Path(gearmbs.__file__).parent
    readers = {p.relative_to(root).as_posix() for p in root.rglob("*.py") if "tomllib" in p.read_text(encoding="utf-8")}
    assert readers == {"schema/described.py"}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, says("machine.toml", "No such file")),
        (b"\xff\xfe\x00a", "not a text file"),
        (b"[run\n", "not a valid TOML file"),
    ],
)
def test_files_that_cannot_be_read_are_named(tmp_path, content, words):
    path = tmp_path / "machine.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(MachineError, match=words) as caught:
        read_toml(path, MachineError)
    assert str(caught.value).startswith(f"{path}: ")
    path.write_bytes("\ufeffname = 'ö'".encode())
    assert read_toml(path) == {"name": "ö"}


def test_what_is_written_is_read_again():
    table = {"name": 'a "b" ö', "speed": "20 rpm", "at": (0.1, ["1 mm", True]), "none": None, "small": 1e-300}
    text = "\n".join(toml_table("[machine]", table))
    del table["none"]
    assert tomllib.loads(text)["machine"] == {**table, "at": [0.1, ["1 mm", True]]}
    assert toml_table("[empty]", {"none": None}) == []


def test_fields_are_read_by_what_they_say():
    machine = Machine(
        speed="60 rpm", tilt="10 deg", count=np.int64(3), gap=np.array(0.002), at=["1 mm", 0, np.float32(0.5)],
        names=["a"], torque="2*TIME", wheel=GearSpec(20, 2e-3), closed=np.True_,
    )  # fmt: skip
    assert machine.speed == pytest.approx(2.0 * math.pi)
    assert isinstance(machine.speed, Given)
    assert machine.at == (0.001, 0.0, 0.5)
    assert (machine.count, machine.gap, machine.names, machine.closed) == (3, 0.002, ("a",), True)
    assert machine.length == 0.02
    assert repr(Machine(speed="60 rpm", count=2.0)) == "Machine(speed='60 rpm', count=2)"
    assert replace(machine) == machine
    assert replace(machine, wheel=None, gap=None).gap is None
    assert measures_of(Machine)["tilt"].unit == "rad"
    # a plain number without a unit is stored as it was given, so that keys of stored cases stay
    assert type(Measure(low=0).as_given(3)) is int


WRONG = [
    ({"speed": "3 mm"}, says("Machine.speed", "'3 mm'", "rad/s")),
    ({"speed": None}, says("Machine.speed", "None", "give a number")),
    ({"speed": "inf rad/s"}, says("Machine.speed", "'inf rad/s'", "give", "finite")),
    ({"speed": math.inf}, says("Machine.speed", "inf", "give", "finite")),
    ({"length": 0}, says("Machine.length", "0 m", "positive")),
    ({"length": "-2 mm"}, says("Machine.length", "-0.002 m", "positive")),
    ({"gap": -1}, says("Machine.gap", "-1 m", "negative")),
    ({"tilt": 11}, r"tilt .*630\.\d+ deg; .*-10 to 10 deg"),
    ({"tilt": 5}, r"tilt is 286\.\d+ deg; .*write '5 deg'"),
    ({"share": 1}, says("share", "1", "0.1", "give")),
    ({"share": "much"}, says("share", "'much'", "0.1", "give")),
    ({"count": 2.5}, says("count", "2.5", "1 to 9", "give")),
    ({"count": True}, says("count", "True", "give", "whole")),
    ({"count": 10}, says("count", "10", "1 to 9", "give")),
    ({"at": [1, 2]}, says("at", "[1, 2]", "3 values", "give")),
    ({"at": "1 mm"}, says("at", "'1 mm'", "3 values", "give")),
    ({"levels": ["1 N"]}, says("levels", "['1 N']", "2 or more")),
    ({"factor": "3 mm"}, says("factor", "'3 mm'", "give a number")),
    ({"grease": "lard"}, r"grease .*'lard'; choose mineral$"),
    ({"side": "up"}, says("side", "'up'", "choose 'left'", "'right'")),
    ({"torque": "100"}, says("torque", "'100'", "unit")),
    ({"torque": True}, says("torque", "True", "give")),
    ({"torque": math.nan}, says("torque", "nan", "expression")),
    ({"wheel": "z1"}, says("wheel", "'z1'", "give", "GearSpec")),
    ({"names": [1]}, says("names[0]", "1", "give a text")),
]


@pytest.mark.parametrize(("changes", "words"), WRONG, ids=[str(k) for k in range(len(WRONG))])
def test_wrong_values_are_told_with_field_value_and_remedy(changes, words):
    with pytest.raises(MachineError, match=words) as caught:
        Machine(**{"speed": 1.0, **changes})
    assert "\n" not in str(caught.value)


def test_all_that_is_wrong_is_told_at_once():
    with pytest.raises(MachineError, match=r"length is 0 m.*; Machine\.side is 'up'"):
        Machine(speed=1.0, length=0, side="up")


def test_a_table_may_get_a_row(monkeypatch):
    monkeypatch.setitem(GREASES, "lithium", 2)
    assert Machine(speed=1.0, grease="lithium").grease == "lithium"
    with pytest.raises(MachineError, match="choose mineral or lithium"):
        Machine(speed=1.0, grease="lard")


def test_tables_of_files_become_objects():
    assert make(Machine, {"speed": "60 rpm"}, "[machine]", MachineError, side="right").side == "right"
    for table, words in (
        ({"sped": 1}, says("[machine]", "'sped'", "'speed'")),
        ({"speed": 1, "zzz": 1}, says("[machine]", "'zzz'", "speed, length")),
        ({}, r"^\[machine\]: 'speed' is missing"),
    ):
        with pytest.raises(MachineError, match=words):
            make(Machine, table, "[machine]", MachineError)
    with pytest.raises(MachineError, match=says("a", "'lathee'", "mill, lathe")):
        chosen({"mill": 1, "lathe": 2}, "lathee", "a: ", MachineError)
    with pytest.raises(MachineError, match=r"run\.x; .*y$"):
        check_keys({"x": 1}, ["y"], "", MachineError, form="unknown key run.{}")


@pytest.mark.parametrize("case", range(cases(20)))
def test_a_limit_is_within_and_what_is_beyond_is_not(case):
    rng = np.random.default_rng((seed(), case))
    low, high = np.sort(rng.uniform(-100.0, 100.0, 2)).tolist()
    measure = Measure("length", low, high, "mm")
    for limit, beyond in ((low, -1e-9), (high, 1e-9)):
        for value in (1e-3 * limit, f"{limit!r} mm"):
            assert measure.as_given(value) == pytest.approx(1e-3 * limit, rel=1e-12)
        with pytest.raises(ValueError, match=says("give", f"{1e3 * measure.as_given(1e-3 * limit):.6g}", "mm")):
            measure.as_given(1e-3 * (limit + beyond * abs(limit)))


def test_limits_of_a_case_are_within():
    assert Case(fault={"misalignment": "-10 deg"}).fault.misalignment == pytest.approx(-math.pi / 18.0)
    with pytest.raises(CaseError, match="give -10 to 10 deg"):
        Case(fault={"misalignment": "-10.1 deg"})


def _described(kind: type = Described) -> list[type]:
    """All classes of descriptions of the package whose fields are read."""
    found = [one for one in kind.__subclasses__() if one.__module__.startswith("gearmbs.")]
    return [*found, *(inner for one in found for inner in _described(one))]


def _fault_of(read: Callable, *values: float, **named: float) -> str:
    try:
        read(*values, **named)
    except ValueError as error:
        return str(error)
    return ""


def test_true_is_no_number_in_any_description():
    """Of every field that measures or counts; 1.0 is not refused for its kind."""

    tried = 0
    for kind in _described():
        for name, reader in _readers(kind).items():
            if name not in measures_of(kind) and not counts(_hints(kind)[name]):
                continue
            tried += 1
            for wrong in (True, False, [True, 1.0]):
                with pytest.raises(ValidationError):
                    reader.validate_python(wrong)
            assert "true or false" not in _fault_of(reader.validate_python, 1.0), (kind, name)
    assert tried > 100
    for kind in (Gears, Shafts, Operation, Contact, FrictionSettings, Solver):
        for name, field in kind.model_fields.items():
            if counts(field.annotation):
                for wrong in (True, False):
                    with pytest.raises(CaseError, match=says(f"{kind.section}.{name}", str(wrong), "give")):
                        kind(**{name: wrong})
                assert "true or false" not in _fault_of(kind, **{name: 1.0}), (kind, name)


def test_truth_in_trains_is_told_by_name():
    def refused(where: str, key: str, value: object, *words: str) -> None:
        table = tomllib.loads(TRAIN)
        place = table
        for part in filter(None, where.split(".")):
            place = place[part]
        place[key] = value
        with pytest.raises(gearmbs.drivetrain.DrivetrainError, match=says(key, str(value), *words)):
            make_description(table)

    make_description(tomllib.loads(TRAIN))
    refused("", "gravity", True, "give", "3 values")
    refused("", "run_up", True, "give")
    refused("", "running", 1, "give true or false")
    for key in ("damping_ratio", "stiffness", "backlash", "slices"):
        refused("meshes.m", key, True, "give")
    for key in ("teeth", "module", "profile_shift", "addendum", "poisson_ratio"):
        refused("wheels.p", key, True, "give")
    # values of another kind are refused on reading, not when the train is built
    refused("loads.l", "torque", "10 mm", "N*m")
    refused("loads.pump", "pressure", "20 N", "Pa")
    refused("loads.pump", "displacement", "300 cm^3/rad", "2 pi", "m^3")


TRAIN = """
gravity = [0, 0, "-9.81 m/s^2"]
run_up = 0.1
running = false
shafts = {a = {}, b = {}}
[wheels]
p = {shaft = "a", teeth = 20, module = "3 mm", internal = false}
g = {shaft = "b", teeth = 60, module = "3 mm"}
[meshes.m]
driver = "p"
driven = "g"
damping_ratio = 1
[bearings]
x = {kind = "ideal", shaft = "a"}
y = {kind = "ideal", shaft = "b"}
[drives]
d = {kind = "speed", shaft = "a", speed = "100 rpm"}
[loads]
l = {kind = "torque", shaft = "b", torque = "10 N m"}
t = {kind = "torque", shaft = "b", torque = "2*pi + 100*SIN(2*pi*TIME)"}
pump = {kind = "pump", shaft = "b", displacement = "300 cm^3", pressure = "20 bar"}
"""


def test_flags_are_true_or_false_alone():
    """Python takes the text "false" for true."""
    for wrong in ("false", "no", 0, 1, 1.0, np.array([True])):
        with pytest.raises(ValueError, match=says("gear.internal", "give true or false")):
            GearSpec(70, "3 mm", internal=wrong)
        with pytest.raises(ValueError, match=says("GearPair.root_contact", "give true or false")):
            gearmbs.GearPair(GearSpec(20, "3 mm"), GearSpec(40, "3 mm"), root_contact=wrong)
        with pytest.raises(MachineError, match=says("Machine.closed", "give true or false")):
            Machine(speed=1.0, closed=wrong)
    for wrong in ("false", 0, 1):
        with pytest.raises(CaseError, match=says("lump", "give true or false")):
            Case(solver={"lump": wrong}, friction={"enabled": wrong})
    for right in (True, False, np.bool_(True), np.bool_(False)):
        assert GearSpec(70, "3 mm", internal=right).internal is bool(right)
        assert Machine(speed=1.0, closed=right).closed is bool(right)
        assert Case(solver={"lump": right}).solver.lump is bool(right)
        pair = gearmbs.GearPair(GearSpec(20, "3 mm"), GearSpec(40, "3 mm"), root_contact=right)
        assert pair.root_contact == right


def test_truth_is_no_number():
    wheels = GearSpec(20, "3 mm"), GearSpec(40, "3 mm")
    for name in ("slices", "rotation"):
        with pytest.raises(ValueError, match=says(f"GearPair.{name}", "True")):
            gearmbs.GearPair(*wheels, **{name: True})
        assert getattr(gearmbs.GearPair(*wheels, **{name: 1}), name) == 1
    m = gearmbs.Mechanism("m")
    for number, at in enumerate(((True, 0, 0), [np.bool_(True), 0, 0], np.array([True, False, False]))):
        with pytest.raises(ValueError, match=says(f"'wrong{number}'", "at", "true", "numbers")):
            m.point_mass(f"wrong{number}", 1.0, at=at)
    assert m.point_mass("right", 1.0, at=(1, "10 mm", np.float64(0.0))).position[0] == 1.0


def test_values_over_time_are_numbers_texts_or_functions():
    class Day:
        """Anything else, as TOML's dates are."""

    torque = {"name": "l", "shaft": "out"}
    for wrong in (Day(), ["80 N m"], {"a": 1}, (1.0, 2.0), None, np.array([1.0, 2.0])):
        with pytest.raises(ValueError, match=says("'l'", "torque", "a finite number")):
            gearmbs.drivetrain.TorqueLoad(torque=wrong, **torque)
    for right in (80, 80.0, np.float64(80.0), np.array(80.0), "80 N m", "80*SIN(TIME)", gearmbs.mechanism.ramp(1.0)):
        gearmbs.drivetrain.TorqueLoad(torque=right, **torque)
