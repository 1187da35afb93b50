"""gearmbs: an open, ADAMS-style multibody DAE solver for gear dynamics.

``import gearmbs as gm`` gives what most programs need; everything is loaded when it is first used::

    import gearmbs as gm

    data = gm.run_case(gm.Case(operation={"speed": "1000 rpm"}))
    report = gm.analyse(gm.read_signal("gearbox.csv", rate=12800.0), teeth=29)

Studies
    `Case`, `CaseError`, `load_case`, `make_case`, `run_case`, `run_cases`, `run_paper`, `sweep`, `record_signal`,
    `run_train`, `run_bench`, `run_gearbox`, `run_resonance`, `gear_rig`
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
    `Mechanism`, `JointFriction`, `simulate`, `static_equilibrium`, `quasi_static`, `linear_modes`,
    `Solution`
Differential-algebraic equations
    `solve_dae`, `DAEProblem`, `DAEResult`, `Status`
Signals
    `read_signal`, `write_signal`, `make_signal`, `to_signal`, `analyse`, `compare`, `trend`, `series`, `features`,
    `spectrum`, `envelope_spectrum`, `spectrogram`, `waterfall`, `order_map`, `order_track`, `campbell`,
    `diagnose_bearing`
ADAMS decks
    `read_deck`, `run_deck`, `write_deck`
Views
    `gear_scene`, `mechanism_scene`, `solution_scene`, `mesh_animation`, `average_plot`, `spectrogram_plot`,
    `waterfall_plot`, `order_map_plot`, `order_track_plot`, `campbell_plot`
Units and files
    `to_si`, `save`

The subpackages hold the rest, as ``gm.signals.cepstrum``: `gearmbs.studies`, `gearmbs.gears`, `gearmbs.drivetrain`,
`gearmbs.flexible`, `gearmbs.bearings`, `gearmbs.mechanism`, `gearmbs.dae`, `gearmbs.signals`, `gearmbs.adams`,
`gearmbs.campaigns`, `gearmbs.identify`, `gearmbs.view`.
"""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.adams import read_deck, run_deck, write_deck
    from gearmbs.bearings import Bearing, RollingBearing
    from gearmbs.dae import DAEProblem, DAEResult, Status, solve_dae
    from gearmbs.dae.results.solution import Solution
    from gearmbs.drivetrain import Drivetrain, DrivetrainError
    from gearmbs.flexible import Rotor, Shaft, ShaftSection, reduce_model
    from gearmbs.gears import (
        ContactLaw,
        FlankFriction,
        GearPair,
        GearSpec,
        IdealMesh,
        Material,
        faults,
        planetary,
        planetary_mechanism,
    )
    from gearmbs.mechanism import JointFriction, Mechanism, linear_modes, quasi_static, simulate, static_equilibrium
    from gearmbs.saving import save
    from gearmbs.signals import (
        analyse,
        campbell,
        compare,
        diagnose_bearing,
        diagnose_planetary,
        envelope_spectrum,
        features,
        make_signal,
        order_map,
        order_track,
        read_signal,
        series,
        spectrogram,
        spectrum,
        to_signal,
        trend,
        waterfall,
        write_signal,
    )
    from gearmbs.studies import (
        Case,
        CaseError,
        gear_rig,
        load_case,
        make_case,
        record_signal,
        run_bench,
        run_case,
        run_cases,
        run_gearbox,
        run_paper,
        run_resonance,
        run_train,
        sweep,
    )
    from gearmbs.units import to_si
    from gearmbs.view import (
        average_plot,
        campbell_plot,
        gear_scene,
        mechanism_scene,
        mesh_animation,
        order_map_plot,
        order_track_plot,
        solution_scene,
        spectrogram_plot,
        waterfall_plot,
    )

__version__ = "0.1.0"

__all__ = [
    "Bearing",
    "Case",
    "CaseError",
    "ContactLaw",
    "DAEProblem",
    "DAEResult",
    "Drivetrain",
    "DrivetrainError",
    "FlankFriction",
    "GearPair",
    "GearSpec",
    "IdealMesh",
    "JointFriction",
    "Material",
    "Mechanism",
    "RollingBearing",
    "Rotor",
    "Shaft",
    "ShaftSection",
    "Solution",
    "Status",
    "analyse",
    "average_plot",
    "campbell",
    "campbell_plot",
    "compare",
    "diagnose_bearing",
    "diagnose_planetary",
    "envelope_spectrum",
    "faults",
    "features",
    "gear_rig",
    "gear_scene",
    "linear_modes",
    "load_case",
    "make_case",
    "make_signal",
    "mechanism_scene",
    "mesh_animation",
    "order_map",
    "order_map_plot",
    "order_track",
    "order_track_plot",
    "planetary",
    "planetary_mechanism",
    "quasi_static",
    "read_deck",
    "read_signal",
    "record_signal",
    "reduce_model",
    "run_bench",
    "run_case",
    "run_cases",
    "run_deck",
    "run_gearbox",
    "run_paper",
    "run_resonance",
    "run_train",
    "save",
    "series",
    "simulate",
    "solution_scene",
    "solve_dae",
    "spectrogram",
    "spectrogram_plot",
    "spectrum",
    "static_equilibrium",
    "sweep",
    "to_si",
    "to_signal",
    "trend",
    "waterfall",
    "waterfall_plot",
    "write_deck",
    "write_signal",
]

late(
    __name__,
    {
        "Bearing": ".bearings",
        "Case": ".studies",
        "CaseError": ".studies",
        "ContactLaw": ".gears",
        "DAEProblem": ".dae",
        "DAEResult": ".dae",
        "Drivetrain": ".drivetrain",
        "DrivetrainError": ".drivetrain",
        "FlankFriction": ".gears",
        "GearPair": ".gears",
        "GearSpec": ".gears",
        "IdealMesh": ".gears",
        "JointFriction": ".mechanism",
        "Material": ".gears",
        "Mechanism": ".mechanism",
        "RollingBearing": ".bearings",
        "Rotor": ".flexible",
        "Shaft": ".flexible",
        "ShaftSection": ".flexible",
        "Solution": ".dae.results.solution",
        "Status": ".dae",
        "analyse": ".signals",
        "average_plot": ".view",
        "campbell": ".signals",
        "campbell_plot": ".view",
        "compare": ".signals",
        "diagnose_bearing": ".signals",
        "diagnose_planetary": ".signals",
        "envelope_spectrum": ".signals",
        "faults": ".gears",
        "features": ".signals",
        "gear_rig": ".studies",
        "gear_scene": ".view",
        "linear_modes": ".mechanism",
        "load_case": ".studies",
        "make_case": ".studies",
        "make_signal": ".signals",
        "mechanism_scene": ".view",
        "mesh_animation": ".view",
        "order_map": ".signals",
        "order_map_plot": ".view",
        "order_track": ".signals",
        "order_track_plot": ".view",
        "planetary": ".gears",
        "planetary_mechanism": ".gears",
        "quasi_static": ".mechanism",
        "read_deck": ".adams",
        "read_signal": ".signals",
        "record_signal": ".studies",
        "reduce_model": ".flexible",
        "run_case": ".studies",
        "run_cases": ".studies",
        "run_deck": ".adams",
        "run_bench": ".studies",
        "run_paper": ".studies",
        "run_gearbox": ".studies",
        "run_resonance": ".studies",
        "run_train": ".studies",
        "save": ".saving",
        "simulate": ".mechanism",
        "solution_scene": ".view",
        "solve_dae": ".dae",
        "series": ".signals",
        "spectrogram": ".signals",
        "spectrogram_plot": ".view",
        "spectrum": ".signals",
        "static_equilibrium": ".mechanism",
        "sweep": ".studies",
        "to_si": ".units",
        "to_signal": ".signals",
        "trend": ".signals",
        "waterfall": ".signals",
        "waterfall_plot": ".view",
        "write_deck": ".adams",
        "write_signal": ".signals",
    }
    | {
        package: f".{package}:"
        for package in (
            "adams bearings campaigns contact dae drivetrain flexible gears identify mechanism signals studies units "
            "view"
        ).split()
    },
)
