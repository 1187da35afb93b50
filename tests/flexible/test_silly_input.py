"""Input that no body has: refused or warned of by name, whatever the number; near twins run without a word."""

import math
import warnings

import numpy as np
import pytest

from gearmbs.drivetrain import DrivetrainError, ElasticBearing, Housing, Mount
from gearmbs.drivetrain import Shaft as RigidShaft
from gearmbs.flexible import Disc, ElasticMaterial, FlexibleError, Shaft, ShaftSection, box_housing, planet_carrier
from gearmbs.gears import GearSpec
from gearmbs.gears.spec import Material
from gearmbs.mechanism import Mechanism
from gearmbs.signals import SignalError, make_signal
from gearmbs.units import doubt_of_material
from tests.generators import cases, seed
from tests.says import says

REFUSED = (ValueError, TypeError)


def shaft(**settings):
    return Shaft([ShaftSection(0.4, 0.03)], seats={"A": 0.1, "B": 0.3}, **settings)


GOOD = {
    "material": (ElasticMaterial, {"youngs_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}),
    "section": (ShaftSection, {"length": 0.2, "outer": 0.03, "inner": 0.01, "outer_end": 0.04, "inner_end": 0.02}),
    "disc": (Disc, {"at": 0.1, "outer": 0.2, "width": 0.02, "inner": 0.03}),
    "rotor": (Disc, {"at": 0.1, "mass": 3.0, "polar": 0.02, "diametral": 0.011}),
    "shaft": (shaft, {"elements": 4, "shear": 0.9}),
    "rigid shaft": (RigidShaft, {"name": "s", "length": 0.1, "radius": 0.02, "density": 7850.0}),
    "given shaft": (RigidShaft, {"name": "s", "length": 0.1, "mass": 1.0, "inertia": 1e-3}),
    "housing": (Housing, {"name": "h", "mass": 50.0, "inertia": (1.0, 1.0, 1.0)}),
    "mount": (Mount, {"name": "m", "at": (0.0, 0.0, 0.0), "stiffness": (1e7,) * 3, "damping": (1e3,) * 3}),
    "bearing": (
        ElasticBearing,
        {"name": "b", "shaft": "s", "stiffness": (1e8,) * 3, "tilting": (1e5,) * 2, "damping": (1e3,) * 3},
    ),
    "wheel": (GearSpec, {"teeth": 20, "module": 0.002, "face_width": 0.02, "bore_radius": 0.005}),
    "body": (lambda **k: Mechanism("m").body("b", **k), {"mass": 1.0, "inertia": (0.1, 0.1, 0.1)}),
    "signal": (lambda **k: make_signal(np.zeros(9), **k), {"rate": 1e3, "speed": 10.0, "teeth": 20}),
}
NEVER = (math.nan, math.inf, -math.inf, "nan m", "three", True, [], {}, -1.0)
"""What none of the quantities above can be."""
SIGNED = {("mount", "at")}


def outcome(make, settings):
    """Whether a constructor refuses by name, warns, or is silent."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            make(**settings)
        except REFUSED as error:
            return str(error)
    return str(said[0].message) if said else None


@pytest.mark.parametrize("kind", GOOD)
def test_good_input_runs_without_a_word(kind):
    assert outcome(*GOOD[kind]) is None


@pytest.mark.parametrize(("kind", "field"), [(k, f) for k, (_, s) in GOOD.items() for f, v in s.items() if v != str(v)])
def test_what_no_quantity_can_be_is_named(kind, field):
    make, settings = GOOD[kind]
    value = settings[field]
    if isinstance(value, str):
        return
    for silly in NEVER:
        if isinstance(silly, float) and isinstance(value, tuple):
            silly = (silly, *value[1:])
        if (kind, field) in SIGNED and silly == (-1.0, *np.ravel(value)[1:].tolist()):
            continue
        assert outcome(make, {**settings, field: silly}) is not None, f"{kind}: {field} = {silly!r}"


@pytest.mark.parametrize("case", range(cases(20)))
def test_materials_in_other_units_are_warned_of(case):
    """Any metal with its modulus or density by a thousand or more off; solids from rubber to diamond are silent."""
    rng = np.random.default_rng((seed(), case))
    metal = {"youngs_modulus": rng.uniform(4e10, 4e11), "density": rng.uniform(5100.0, 2e4)}
    assert doubt_of_material(*metal.values()) is None
    for field, value in metal.items():
        for factor in (1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9):
            wrong = {**metal, field: value * factor}
            with pytest.warns(UserWarning, match=says("ElasticMaterial 'steel'", "kg/m^3")):
                ElasticMaterial(**wrong)
            with pytest.warns(UserWarning, match=says("Material 'steel'", "kg/m^3")):
                Material(**wrong)
    solids = {
        "rubber": (2e6, 1100.0), "PTFE": (4e8, 2200.0), "lead": (1.6e10, 11340.0), "diamond": (1.1e12, 3510.0),
        "beryllium": (2.9e11, 1850.0), "foam": (2e7, 60.0), "osmium": (5.5e11, 22600.0), "no mass": (2e11, 0.0),
    }  # fmt: skip
    name, solid = list(solids.items())[case % len(solids)]
    assert doubt_of_material(*solid) is None, name


def test_the_likely_meaning_is_said():
    assert "is 2.1e+11 Pa meant ('210 GPa')?" in (doubt_of_material(210.0, 7850.0) or "")
    assert "is 7850 kg/m^3 meant ('g/cm^3')?" in (doubt_of_material(2.1e11, 7.85) or "")
    assert "is 7850 kg/m^3 meant ('t/mm^3')?" in (doubt_of_material(2.1e11, 7.85e-9) or "")


@pytest.mark.parametrize("case", range(cases(20)))
def test_moments_of_a_disc_are_those_of_a_body(case):
    rng = np.random.default_rng((seed(), case))
    diametral = 10.0 ** rng.uniform(-6, 2)
    assert Disc(0.1, mass=3.0, polar=2.0 * diametral, diametral=diametral).polar == 2.0 * diametral
    over = diametral * (2.0 + 10.0 ** rng.uniform(-2, 3))
    with pytest.raises(FlexibleError, match=says("diametral", "disc", "polar = 2")):
        Disc(0.1, mass=3.0, polar=over, diametral=diametral)
    with pytest.warns(UserWarning, match=says("body", "largest exceeds")):
        Mechanism("m").body("b", 1.0, (diametral, diametral, over))


def test_bores_that_overlap_are_refused():
    carrier = {"bore": 0.04, "outer": 0.2, "width": 0.02, "pin_circle": 0.12}
    with pytest.raises(FlexibleError, match=says("12 pins", "0.04 m", "circle", "0.12 m", "0.03106 m")):
        planet_carrier(pins=12, pin=0.04, **carrier)
    box = ("0.4 m", "0.3 m", "0.2 m")
    with pytest.raises(FlexibleError, match=says("0.08 m", "0.24", "0.15", "0.2", "bearings")):
        box_housing(box, 0.01, [(0.1, 0.15), (0.2, 0.15), (0.24, 0.15)], 0.08)
    with pytest.raises(FlexibleError, match=r"ShaftSection: bore 0.03 m in 0.03 m"):
        ShaftSection(0.1, 0.03, 0.03)


def test_lengths_in_millimetres_are_doubted():
    with pytest.warns(UserWarning, match=says("shaft 's'", "length", "120 m")):
        RigidShaft(name="s", length=120.0)
    with pytest.warns(UserWarning, match=says("7.85", "3", "density", "7850")):
        RigidShaft(name="s", length=0.1, density=7.85)
    with pytest.raises(DrivetrainError, match=says("bearing 'b'", "stiffness", "diagonal", "negative")):
        ElasticBearing(name="b", shaft="s", stiffness=np.diag([1e8, 1e8, -1e8, 0, 0, 0]).tolist())
    with pytest.raises(SignalError, match=says("teeth", "True")):
        make_signal(np.zeros(9), 1e3, teeth=True)
