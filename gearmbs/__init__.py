"""gearmbs: an open, ADAMS-style multibody DAE solver for gear dynamics.

``import gearmbs as gm`` gives what most programs need; everything is loaded when it is first used::

    import gearmbs as gm

    data = gm.run_case(gm.Case(operation={"speed": "1000 rpm"}))
    report = gm.analyse(gm.read_signal("gearbox.csv", rate=12800.0), teeth=29)

Studies
    `Case`, `CaseError`, `load_case`, `make_case`, `run_case`, `run_cases`, `run_paper`, `steady`, `steady_branch`,
    `sweep`, `record_signal`, `run_train`, `run_bench`, `run_gearbox`, `run_resonance`, `gear_rig`
Gears
    `GearPair`, `GearSpec`, `Material`, `ContactLaw`, `FlankFriction`, `faults`, `IdealMesh`, `planetary`,
    `planetary_mechanism`, `diagnose_planetary`
Drivetrains
    `Drivetrain`, `DrivetrainError`; the parts are in `gearmbs.drivetrain`
Flexible bodies
    `Shaft`, `ShaftSection`, `Rotor`, `reduce_model`
Rolling bearings
    `Bearing`, `RollingBearing`
Mechanisms
    `Mechanism`, `JointFriction`, `simulate`, `Simulator`, `State`, `static_equilibrium`, `quasi_static`,
    `force_law`, `Wrench`, `choose`, `linear_modes`, `linearize`, `forward_sensitivities`, `steady_sensitivities`,
    `Solution`
Differential-algebraic equations
    `solve_dae`, `DAEProblem`, `DAEResult`, `Status`
Signals
    `read_signal`, `write_signal`, `make_signal`, `to_signal`, `analyse`, `compare`, `trend`, `series`, `features`,
    `spectrum`, `envelope_spectrum`, `spectrogram`, `waterfall`, `order_map`, `order_track`, `campbell`,
    `diagnose_bearing`, `read_pulses`, `CoupledRun`, `transmission_error_from_pulses`
ADAMS decks
    `read_deck`, `run_deck`, `write_deck`
Views
    `gear_scene`, `mechanism_scene`, `solution_scene`, `mesh_animation`, `average_plot`, `spectrogram_plot`,
    `waterfall_plot`, `order_map_plot`, `order_track_plot`, `campbell_plot`
Units and files
    `to_si`, `save`

Packages, which hold the rest, as ``gm.signals.power_cepstrum``
    `adams`, `bearings`, `campaigns`, `contact`, `dae`, `drivetrain`, `flexible`, `gears`, `identify`, `mechanism`,
    `native`, `signals`, `studies`, `units`, `view`
"""

from gearmbs._lazy import late

__version__ = "0.1.0"

__all__ = late(__name__)
