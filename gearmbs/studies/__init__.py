"""Studies: pure functions from a validated case to a result."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.signals.files.simulated import record_signal
    from gearmbs.studies.case.case import Case, CaseError, CaseWarning, load_case, make_case
    from gearmbs.studies.paper.paper import PaperStudy, run_paper
    from gearmbs.studies.paper.preset import Claim, paper_cases
    from gearmbs.studies.presets.bench import BenchSettings, BenchStudy, bench_choices, bench_train, run_bench
    from gearmbs.studies.presets.crank_slider import CrankSlider
    from gearmbs.studies.presets.gearbox import (
        GearboxSettings,
        GearboxStudy,
        gearbox_choices,
        industrial_gearbox,
        run_gearbox,
    )
    from gearmbs.studies.presets.rattle import RattleSettings, rattle, rattle_map, rattle_table, rattle_train
    from gearmbs.studies.presets.resonance import (
        ResonanceSettings,
        ResonanceStudy,
        resonance_rig,
        run_resonance,
        separation_load,
        sweep_resonance,
    )
    from gearmbs.studies.run.flexible_rig import flexible_rig
    from gearmbs.studies.run.parallel import run_cases
    from gearmbs.studies.run.rig import bearing_rig, gear_rig, housing_signal, rolling_rig
    from gearmbs.studies.run.simulation import (
        SimulationFailed,
        SimulationInterrupted,
        case_mechanism,
        run_case,
        simulate_case,
    )
    from gearmbs.studies.run.sweep import Sweep, sweep
    from gearmbs.studies.trains.modes import train_campbell, train_modes
    from gearmbs.studies.trains.report import train_report, train_scene, train_spectrum
    from gearmbs.studies.trains.trains import load_train, run_train, train_signal

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
        "CrankSlider": ".presets.crank_slider",
        "RattleSettings": ".presets.rattle",
        "ResonanceSettings": ".presets.resonance",
        "ResonanceStudy": ".presets.resonance",
        "resonance_rig": ".presets.resonance",
        "run_resonance": ".presets.resonance",
        "separation_load": ".presets.resonance",
        "sweep_resonance": ".presets.resonance",
        "rattle": ".presets.rattle",
        "rattle_map": ".presets.rattle",
        "rattle_table": ".presets.rattle",
        "rattle_train": ".presets.rattle",
        "run_train": ".trains.trains",
        "load_train": ".trains.trains",
        "train_signal": ".trains.trains",
        "train_report": ".trains.report",
        "train_spectrum": ".trains.report",
        "train_scene": ".trains.report",
        "bench_train": ".presets.bench",
        "BenchSettings": ".presets.bench",
        "bench_choices": ".presets.bench",
        "BenchStudy": ".presets.bench",
        "run_bench": ".presets.bench",
        "Case": ".case.case",
        "CaseError": ".case.case",
        "CaseWarning": ".case.case",
        "Claim": ".paper.preset",
        "PaperStudy": ".paper.paper",
        "SimulationFailed": ".run.simulation",
        "SimulationInterrupted": ".run.simulation",
        "Sweep": ".run.sweep",
        "bearing_rig": ".run.rig",
        "flexible_rig": ".run.flexible_rig",
        "GearboxSettings": ".presets.gearbox",
        "GearboxStudy": ".presets.gearbox",
        "gearbox_choices": ".presets.gearbox",
        "industrial_gearbox": ".presets.gearbox",
        "run_gearbox": ".presets.gearbox",
        "train_campbell": ".trains.modes",
        "train_modes": ".trains.modes",
        "gear_rig": ".run.rig",
        "housing_signal": ".run.rig",
        "load_case": ".case.case",
        "make_case": ".case.case",
        "paper_cases": ".paper.preset",
        "record_signal": "gearmbs.signals.files.simulated",
        "rolling_rig": ".run.rig",
        "case_mechanism": ".run.simulation",
        "run_case": ".run.simulation",
        "run_cases": ".run.parallel",
        "run_paper": ".paper.paper",
        "simulate_case": ".run.simulation",
        "sweep": ".run.sweep",
    },
)
