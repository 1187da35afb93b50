"""``gearmbs bench``, ``gearmbs gearbox`` and ``gearmbs resonance``: whole studies on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearmbs._command import case_bars, guarded

Out = Annotated[Path, typer.Option("--out", "-o", help="Folder for the results.")]


def bench(
    out: Out = Path("out/bench"),
    speed: Annotated[str, typer.Option(help='Speed of the motor, e.g. "1000 rpm".')] = "1000 rpm",
    duration: Annotated[str, typer.Option(help='Length of the record, e.g. "1 s".')] = "1 s",
    stiffness: Annotated[float, typer.Option(help="Radial, of each bearing, N/m.")] = 2e8,
    motor: Annotated[str, typer.Option(help="induction, or speed for a prescribed one.")] = "induction",
    phase: Annotated[float, typer.Option(help="Phase of the second mesh, pitches.")] = 0.0,
    pump_teeth: Annotated[int, typer.Option(help="Teeth of the pump; 0: no ripple.")] = 12,
    pair: Annotated[bool, typer.Option(help="Run the pair's study beside it.")] = True,
    workers: Annotated[int | None, typer.Option(help="Cases of the pair at a time; default: the cores.")] = None,
) -> None:
    """Judge the paper's claims on its test bench: motor, clutch, two pairs, pump; six runs, figures, report."""
    with guarded():
        from gearmbs.studies.bench import PRESSURES, STATES, BenchSettings, bench_train
        from gearmbs.studies.store import check_place
        from gearmbs.studies.trains import RunSettings, check_record

        settings = BenchSettings(
            speed=speed, bearing_stiffness=stiffness, motor=motor, phase=phase, pump_teeth=pump_teeth
        )
        run = RunSettings(settling=0.2, duration=duration)
        check_record(bench_train(settings=settings), run)
        check_place(out, 0)

        from gearmbs.studies.bench_study import run_bench
        from gearmbs.studies.preset import paper_cases

        names = [f"bench, {state}, {load} load" for load in PRESSURES for state in STATES]
        if pair:
            names += [case.name for case in paper_cases()]
        with case_bars(names) as move:
            study = run_bench(settings, run, pair=pair, workers=workers, progress=move)
        paths = study.save(out)
        for sensor in ("laser", "support"):
            for claim in study.claims(sensor):
                mark = "held    " if claim.held else "NOT HELD"
                typer.echo(f"{mark}  {sensor}: {claim.name}\n          {claim.numbers}")
        typer.echo("\n".join(f"wrote {path}" for path in paths))


def resonance(
    out: Out = Path("out/resonance"),
    torque: Annotated[str, typer.Option(help='On the driven wheel, e.g. "30 N m".')] = "30 N m",
    damping: Annotated[float, typer.Option(help="Damping ratio of the film.")] = 0.11,
    addendum: Annotated[float, typer.Option(help="In modules; it sets the contact ratio.")] = 0.85,
    span: Annotated[
        tuple[float, float], typer.Option(help="Mesh frequencies from and to, over the natural frequency.")
    ] = (0.68, 0.88),
    cycles: Annotated[int, typer.Option(help="Mesh cycles of a sweep.")] = 4000,
) -> None:
    """Sweep a spur pair up and down through its mesh resonance: jumps, hysteresis, loads at which teeth part."""
    with guarded():
        from gearmbs.studies.resonance import DIRECTIONS, ResonanceSettings
        from gearmbs.studies.store import check_place

        settings = ResonanceSettings(torque=torque, damping_ratio=damping, addendum=addendum, span=span, cycles=cycles)
        check_place(out, 0)

        from gearmbs.studies.resonance_study import run_resonance

        with case_bars(list(DIRECTIONS)) as move:
            study = run_resonance(settings, progress=move)
        paths = study.save(out)
        typer.echo(study.report())
        typer.echo("\n".join(f"wrote {path}" for path in paths))


def gearbox(
    out: Out = Path("out/gearbox"),
    speed: Annotated[str, typer.Option(help='Of the motor, e.g. "1793 rpm".')] = "1793 rpm",
    power: Annotated[str, typer.Option(help='Of the motor, e.g. "750 kW".')] = "750 kW",
    helix: Annotated[str, typer.Option(help='Helix angle, e.g. "14 deg"; 0: spur wheels.')] = "14 deg",
    duration: Annotated[float, typer.Option(help="Length of the steady record, s.")] = 1.0,
    run_up: Annotated[float, typer.Option(help="Length of the run-up, s.")] = 4.0,
) -> None:
    """Study an industrial gearbox of two helical stages: modes, Campbell diagram, steady state, run-up, housing."""
    with guarded():
        from gearmbs.studies.gearbox import GearboxSettings, industrial_gearbox
        from gearmbs.studies.store import check_place

        settings = GearboxSettings(speed=speed, power=power, helix_angle=helix)
        industrial_gearbox(settings)
        check_place(out, 0)

        from gearmbs.studies.gearbox_study import run_gearbox

        with case_bars(["steady", "run-up"]) as move:
            study = run_gearbox(settings, duration=duration, run_up=run_up, progress=move)
        paths = study.save(out)
        typer.echo("modes, Hz: " + ", ".join(f"{f:.4g}" for f in study.campbell()["frequency"].values[0]))
        typer.echo("\n".join(f"wrote {path}" for path in paths))
