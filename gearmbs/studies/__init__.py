"""Studies: pure functions from a validated case to a result."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.signals.simulated import record_signal
    from gearmbs.studies.bearing_rig import bearing_rig, housing_signal, rolling_rig
    from gearmbs.studies.bench import BenchSettings, bench_choices, bench_train
    from gearmbs.studies.bench_study import BenchStudy, run_bench
    from gearmbs.studies.case import Case, CaseError, CaseWarning, load_case, make_case
    from gearmbs.studies.claims import Claim
    from gearmbs.studies.crank_slider import CrankSlider
    from gearmbs.studies.flexible_rig import flexible_rig
    from gearmbs.studies.gearbox import GearboxSettings, gearbox_choices, industrial_gearbox
    from gearmbs.studies.gearbox_study import GearboxStudy, run_gearbox
    from gearmbs.studies.paper import PaperStudy, run_paper
    from gearmbs.studies.parallel import run_cases
    from gearmbs.studies.preset import paper_cases
    from gearmbs.studies.rattle import RattleSettings, rattle, rattle_map, rattle_table, rattle_train
    from gearmbs.studies.resonance import ResonanceSettings, resonance_rig, sweep_resonance
    from gearmbs.studies.resonance_study import ResonanceStudy, run_resonance, separation_load
    from gearmbs.studies.rig import gear_rig
    from gearmbs.studies.simulation import (
        SimulationFailed,
        SimulationInterrupted,
        case_mechanism,
        run_case,
        simulate_case,
    )
    from gearmbs.studies.sweep import Sweep, sweep
    from gearmbs.studies.train_figure import train_spectrum
    from gearmbs.studies.train_modes import train_campbell, train_modes
    from gearmbs.studies.train_report import train_report, train_scene
    from gearmbs.studies.trains import load_train, run_train, train_signal

__all__ = [
    "BenchSettings",
    "BenchStudy",
    "Case",
    "CaseError",
    "CaseWarning",
    "Claim",
    "CrankSlider",
    "GearboxSettings",
    "GearboxStudy",
    "PaperStudy",
    "RattleSettings",
    "ResonanceSettings",
    "ResonanceStudy",
    "SimulationFailed",
    "SimulationInterrupted",
    "Sweep",
    "bearing_rig",
    "bench_choices",
    "bench_train",
    "case_mechanism",
    "flexible_rig",
    "gear_rig",
    "gearbox_choices",
    "housing_signal",
    "industrial_gearbox",
    "load_case",
    "load_train",
    "make_case",
    "paper_cases",
    "rattle",
    "rattle_map",
    "rattle_table",
    "rattle_train",
    "record_signal",
    "resonance_rig",
    "rolling_rig",
    "run_bench",
    "run_case",
    "run_cases",
    "run_gearbox",
    "run_paper",
    "run_resonance",
    "run_train",
    "separation_load",
    "simulate_case",
    "sweep",
    "sweep_resonance",
    "train_campbell",
    "train_modes",
    "train_report",
    "train_scene",
    "train_signal",
    "train_spectrum",
]

late(
    __name__,
    {
        "CrankSlider": ".crank_slider",
        "RattleSettings": ".rattle",
        "ResonanceSettings": ".resonance",
        "ResonanceStudy": ".resonance_study",
        "resonance_rig": ".resonance",
        "run_resonance": ".resonance_study",
        "separation_load": ".resonance_study",
        "sweep_resonance": ".resonance",
        "rattle": ".rattle",
        "rattle_map": ".rattle",
        "rattle_table": ".rattle",
        "rattle_train": ".rattle",
        "run_train": ".trains",
        "load_train": ".trains",
        "train_signal": ".trains",
        "train_report": ".train_report",
        "train_spectrum": ".train_figure",
        "train_scene": ".train_report",
        "bench_train": ".bench",
        "BenchSettings": ".bench",
        "bench_choices": ".bench",
        "BenchStudy": ".bench_study",
        "run_bench": ".bench_study",
        "Case": ".case",
        "CaseError": ".case",
        "CaseWarning": ".case",
        "Claim": ".claims",
        "PaperStudy": ".paper",
        "SimulationFailed": ".simulation",
        "SimulationInterrupted": ".simulation",
        "Sweep": ".sweep",
        "bearing_rig": ".bearing_rig",
        "flexible_rig": ".flexible_rig",
        "GearboxSettings": ".gearbox",
        "GearboxStudy": ".gearbox_study",
        "gearbox_choices": ".gearbox",
        "industrial_gearbox": ".gearbox",
        "run_gearbox": ".gearbox_study",
        "train_campbell": ".train_modes",
        "train_modes": ".train_modes",
        "gear_rig": ".rig",
        "housing_signal": ".bearing_rig",
        "load_case": ".case",
        "make_case": ".case",
        "paper_cases": ".preset",
        "record_signal": "gearmbs.signals.simulated",
        "rolling_rig": ".bearing_rig",
        "case_mechanism": ".simulation",
        "run_case": ".simulation",
        "run_cases": ".parallel",
        "run_paper": ".paper",
        "simulate_case": ".simulation",
        "sweep": ".sweep",
    },
)
