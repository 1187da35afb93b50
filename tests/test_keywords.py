"""What type checkers and editors are told of keywords that are handed on is what is taken.

Of each table the names and types are those of what it stands for; tables of mechanisms are in `tests/mechanism`.
"""

import importlib
import inspect
import re

import pytest

from gearmbs._display import PLOTS, PlotKeywords
from gearmbs.bearings import Bearing, BearingStatics
from gearmbs.bearings.bearing import BearingFields, ChangedFields
from gearmbs.bearings.settings import BearingKeywords, BearingSettings
from gearmbs.bearings.statics import StaticsKeywords
from gearmbs.campaigns.plans.plan import Plan, PlanKeywords
from gearmbs.campaigns.stored import exports
from gearmbs.campaigns.subjects.deck import DeckKeywords, DeckSubject
from gearmbs.dae.integrators.options import OptionKeywords, Options
from gearmbs.dae.user_problem import EquationKeywords, as_problem
from gearmbs.drivetrain.drivetrain import Drivetrain, DrivetrainKeywords
from gearmbs.gears import GearPair, GearSpec, IdealMesh, PlanetarySet
from gearmbs.gears import ideal_mesh as im
from gearmbs.gears.pair import PairKeywords, PaperKeywords
from gearmbs.gears.planetary import PlanetaryKeywords
from gearmbs.gears.spec import OfRadiiKeywords, RingKeywords
from gearmbs.identify import fit
from gearmbs.identify.cases import CaseProblem, ProblemKeywords
from gearmbs.identify.fit import FitKeywords
from gearmbs.signals import (
    analyse,
    compare,
    gmf_rms,
    order_map,
    order_track,
    read_signal,
    shaft_phase,
    spectrogram,
    to_signal,
    waterfall,
)
from gearmbs.signals.analysis.analysis import AnalysisKeywords, AnalysisOptions, FileKeywords
from gearmbs.signals.analysis.bands import MeshKeywords
from gearmbs.signals.analysis.comparison import CompareKeywords
from gearmbs.signals.analysis.sections import ReadingKeywords
from gearmbs.signals.analysis.series import READING, SeriesKeywords
from gearmbs.signals.encoders.pulses import OfChannelKeywords, TrainKeywords, pulse_train
from gearmbs.signals.rotation.keywords import ShaftAndDataKeywords, ShaftKeywords, SpeedKeywords
from gearmbs.signals.rotation.order_tracking import OrderMapKeywords, OrderTrackKeywords
from gearmbs.signals.signal.arguments import GIVEN, DataKeywords
from gearmbs.signals.time_frequency import SpectrogramKeywords, SweepWaterfallKeywords, WaterfallKeywords
from gearmbs.studies import Case
from gearmbs.studies.case import keywords
from gearmbs.studies.case.case import CaseKeywords
from gearmbs.studies.case.section import measures_of, sections_of
from gearmbs.studies.run.rig import RigKeywords, gear_rig
from gearmbs.view import scenes, waterfall_plot
from gearmbs.view.scene import Scene, StillKeywords

QUANTITIES = r"\b(?:Length|Boundary|Force|Share|Quantity)\b"
"""Annotations of fields that take a number or a text with a unit, and hold the number."""
DATA = frozenset(DataKeywords.__annotations__)
SHAFT = frozenset(ShaftKeywords.__annotations__)


def told(table) -> dict[str, str]:
    """Return the types of a table by name, as they are written."""
    return {
        name: re.sub(r"^Required\[(.*)\]$", r"\1", kind.__forward_arg__) for name, kind in table.__annotations__.items()
    }


def taken(function, *but: str, lists: tuple[str, ...] = ()) -> dict[str, str]:
    """Return what a function, or the constructor of a class, takes by keyword, as it is given.

    Parameters
    ----------
    but : str
        Names of parameters left out.
    lists : sequence of str
        Names of fields that become tuples, of whatever sequence is given.
    """
    found = {}
    for name, p in inspect.signature(function).parameters.items():
        if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD) or name in ("self", *but):
            continue
        text = re.sub(r"^InitVar\[(.*)\]$", r"\1", str(p.annotation))
        text = re.sub(r"^Annotated\[(\w+), .*\]$", r"\1", text)
        text = re.sub(QUANTITIES, "QuantityLike", text)
        if name in lists:
            text = re.sub(r"^tuple\[(.*), \.\.\.\]$", r"Sequence[\1]", text)
        optional = p.default is None and "None" not in text and text != "Any"
        found[name] = f"{text} | None" if optional else text
    return found


HELD = {
    "bearings, settings": (BearingKeywords, taken(BearingSettings, "bearing")),
    "bearings, statics": (StaticsKeywords, taken(BearingSettings, "bearing") | {"speed": "QuantityLike"}),
    "bearings, fields": (ChangedFields, taken(Bearing, lists=("estimated",))),
    "bearings, by designation": (BearingFields, taken(Bearing, "designation", lists=("estimated",))),
    "gears, of radii": (OfRadiiKeywords, taken(GearSpec, "teeth", "module", "addendum", "dedendum")),
    "gears, rings": (RingKeywords, taken(GearSpec, "teeth", "module", "internal", "name")),
    "gears, pairs": (PairKeywords, taken(GearPair, lists=("faults",))),
    "gears, the paper's pair": (
        PaperKeywords,
        taken(GearPair, lists=("faults",)) | {"face_width": taken(GearSpec)["face_width"]},
    ),
    "gears, ideal meshes of contacts": (
        im.DampedKeywords, taken(IdealMesh, "pair", "stiffness", "stiffness_curve", "error"),
    ),
    "gears, ideal meshes of damping ratios": (im.CurveKeywords, taken(IdealMesh, "pair", "stiffness", "damping")),
    "gears, planetary sets": (PlanetaryKeywords, taken(PlanetarySet, "sun", "planet", "ring", "planets")),
    "dae, options": (OptionKeywords, taken(Options, "method", "rtol")),
    "dae, equations": (
        EquationKeywords, taken(as_problem, "fun", "t0", "y0", "yp0", "span", "atol", "events"),
    ),
    "signals, data": (DataKeywords, taken(to_signal, "data", "speed", "teeth")),
    "signals, reading": (
        ReadingKeywords,
        taken(to_signal, "data", "speed", "teeth") | {"format": taken(read_signal)["format"]},
    ),
    "signals, shafts": (ShaftKeywords, taken(shaft_phase, "signal", "speed", "needed_for")),
    "signals, shafts and speeds": (SpeedKeywords, taken(shaft_phase, "signal", "needed_for")),
    "signals, analysis": (AnalysisKeywords, taken(AnalysisOptions, "teeth", "planetary")),
    "signals, analysis of files": (
        FileKeywords,
        taken(AnalysisOptions) | taken(analyse, "signal") | {"format": taken(read_signal)["format"]},
    ),
    "signals, series": (
        SeriesKeywords, taken(AnalysisOptions, "teeth") | {name: told(ReadingKeywords)[name] for name in READING},
    ),
    "signals, comparison": (
        CompareKeywords, taken(compare, "experiment", "model", "rate", "units", "teeth", "speed"),
    ),
    "signals, meshes": (MeshKeywords, taken(gmf_rms, "signal", "harmonics", "half_width")),
    "signals, pulses": (TrainKeywords, taken(pulse_train, "times", "lines", "index")),
    "identify, fits": (FitKeywords, taken(fit, "model", "measured", "free", "sigma", "many", "jacobian", "lost")),
    "identify, problems": (ProblemKeywords, taken(CaseProblem, "measured", "cases", "free")),
    "studies, rigs": (RigKeywords, taken(gear_rig, "pair")),
    "drivetrain": (DrivetrainKeywords, taken(Drivetrain)),
    "view, stills": (StillKeywords, taken(Scene.still)),
    "view, mechanisms": (scenes.MechanismSceneKeywords, taken(scenes.mechanism_scene, "mechanism")),
    "view, solutions": (scenes.SolutionSceneKeywords, taken(scenes.solution_scene, "solution")),
    "campaigns, exports": (exports.ExportKeywords, taken(exports.export, "campaign", "target", "format")),
    "campaigns, decks": (
        DeckKeywords, taken(DeckSubject, "text", "parameters", "end", "steps", "script", "name"),
    ),
}  # fmt: skip
"""By what it is of: a table, and what is taken."""


@pytest.mark.parametrize("name", HELD)
def test_each_table_says_what_is_taken(name):
    table, own = HELD[name]
    assert told(table) == own


@pytest.mark.parametrize(
    ("table", "function", "but"),
    [
        (OrderTrackKeywords, order_track, ()),
        (OrderMapKeywords, order_map, ("maximum",)),
        (SpectrogramKeywords, spectrogram, ("maximum",)),
        (WaterfallKeywords, waterfall, ("maximum",)),
        (SweepWaterfallKeywords, waterfall, ()),
    ],
)
def test_tables_of_functions_of_a_shaft_add_what_is_known_of_it(table, function, but):
    """Those that take data of any shape are shown with its keywords, whose types stand in a table of their own."""
    own = taken(function, "signal", "signals", *but, *GIVEN)
    assert told(table) == own | told(ShaftAndDataKeywords)
    assert set(inspect.signature(function).parameters) >= set(GIVEN)


def test_functions_of_pulses_in_data_take_the_keywords_of_both():
    assert told(OfChannelKeywords) == told(TrainKeywords) | told(DataKeywords)


def test_fields_of_a_case_are_sections_or_tables_of_their_fields():
    kinds = sections_of(Case)
    tables = {name: kind.__name__.removesuffix("Settings") + "Keywords" for name, kind in kinds.items()}
    assert told(CaseKeywords) == {"name": "str"} | {
        name: f"{kind.__name__} | {tables[name]}" for name, kind in kinds.items()
    }
    assert set(told(CaseKeywords)) == set(Case.model_fields)
    for name, kind in kinds.items():
        fields = told(getattr(keywords, tables[name]))
        assert list(fields) == list(kind.model_fields), name
        for key, measure in measures_of(kind).items():
            # a share, which nobody writes with a unit, or a quantity
            one = "float" if measure.dimension == "dimensionless" else "QuantityLike"
            both = f"{one} | Sequence[{one}]" if one == "float" else "Each"
            wide = "Curve" if measure.curve else both if measure.each else one
            optional = kind.model_fields[key].default is None
            assert fields[key] == wide + " | None" * optional, f"{name}.{key}"


def test_settings_of_plans_are_fields_as_they_are_given():
    """Limits may be texts with units, one text or path stands for several."""
    several = {"constraints": "str | Sequence[str]", "reuse": "str | Sequence[str | Path]"}
    limits = dict.fromkeys(("time_limit", "wall_limit", "memory_limit"), "QuantityLike | None")
    own = taken(Plan, "subject", "factors", "design", "n", "keep")
    assert told(PlanKeywords) == own | several | limits


def test_objects_that_draw_themselves_take_what_their_figures_do():
    """Sweeps over speeds hand their keywords on to a waterfall, reports of a record what is known of its shaft."""
    found = told(SpeedKeywords) | {name: taken(waterfall_plot)[name] for name in ("style", "decibels", "maximum")}
    for place in set(PLOTS.values()):
        module, _, name = place.partition(":")
        _, *names = taken(drawer := getattr(importlib.import_module(module), name))
        # a study has a load to begin with, a report none
        found |= {key: taken(drawer)[key] for key in names if key not in found or "None" in taken(drawer)[key]}
    assert told(PlotKeywords) == found | dict.fromkeys(("place", "points"), "Any")


def test_statics_take_a_speed_of_their_own():
    assert taken(BearingStatics, "bearing") == {"speed": "QuantityLike"}
