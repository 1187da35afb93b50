"""``gearmbs bench``, ``gearmbs gearbox`` and ``gearmbs resonance``: whole studies on the command line."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from gearmbs._command import case_bars, check_kind, guarded, kind_of, stage_bar
from gearmbs.dae.methods import DEFAULT, INTEGRATORS
from gearmbs.signals.command_line import check_targets, hand_over, save_figures
from gearmbs.wording import any_of

if TYPE_CHECKING:
    from gearmbs.studies.presets.gearbox import GearboxStudy
    from gearmbs.studies.presets.paper_cases import Claim
    from gearmbs.studies.run.simulation import SimulationFailed

Out = Annotated[Path, typer.Option("--out", "-o", help="Folder for the results.")]


def carry_out(out: Path, names: list[str], run: Callable[..., Any], told: Callable[[Any], str]) -> None:
    """Carry out a study whose runs have these names, save it, and print what is told of it and its files."""
    from gearmbs.files import check_place

    check_place(out, 0)
    with case_bars(names) as move:
        study = run(progress=move)
    paths = study.save(out)
    typer.echo(told(study))
    typer.echo("\n".join(f"wrote {path}" for path in paths))


def claim_lines(claims: list[Claim], where: str = "") -> str:
    """Return which claims are held, with their numbers."""
    marks = {True: "held    ", False: "NOT HELD"}
    return "\n".join(f"{marks[c.held]}  {where}{c.name}\n          {c.numbers}" for c in claims)


def mode_line(study: GearboxStudy) -> str:
    """Return the natural frequencies of a gearbox."""
    return "modes, Hz: " + ", ".join(f"{f:.4g}" for f in study.campbell()["frequency"].values[0])


def bench(
    out: Out = Path("out/bench"),
    speed: Annotated[str, typer.Option(help='Speed of the motor, e.g. "1000 rpm".')] = "1000 rpm",
    duration: Annotated[str, typer.Option(help='Length of the record, e.g. "1 s".')] = "1 s",
    stiffness: Annotated[float, typer.Option(help="Radial, of each bearing, N/m.")] = 2e8,
    motor: Annotated[str, typer.Option(help="induction, or speed for a prescribed one.")] = "induction",
    phase: Annotated[float, typer.Option(help="Phase of the second mesh, pitches.")] = 0.0,
    pump_teeth: Annotated[int, typer.Option(help="Teeth of the pump; 0: no ripple.")] = 12,
    pair: Annotated[bool, typer.Option(help="Run the pair's study beside it.")] = True,
    workers: Annotated[int | None, typer.Option(help="Runs at a time; default: the cores.")] = None,
) -> None:
    """Judge the paper's claims on its test bench: motor, clutch, two pairs, pump; six runs, figures, report."""
    with guarded():
        from gearmbs.studies.presets.bench import PRESSURES, SENSORS, STATES, BenchSettings, bench_train, run_bench
        from gearmbs.studies.presets.paper_cases import paper_cases
        from gearmbs.studies.trains import RunSettings, check_record

        settings = BenchSettings(
            speed=speed, bearing_stiffness=stiffness, motor=motor, phase=phase, pump_teeth=pump_teeth
        )
        run = RunSettings(settling=0.2, duration=duration)
        check_record(bench_train(settings=settings), run)
        names = [f"bench, {state}, {load} load" for load in PRESSURES for state in STATES]
        if pair:
            names += [case.name for case in paper_cases()]
        study = partial(run_bench, settings, run, pair=pair, workers=workers)
        carry_out(out, names, study, lambda s: "\n".join(claim_lines(s.claims(name), f"{name}: ") for name in SENSORS))


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
        from gearmbs.studies.presets.resonance import DIRECTIONS, ResonanceSettings, run_resonance

        settings = ResonanceSettings(torque=torque, damping_ratio=damping, addendum=addendum, span=span, cycles=cycles)
        carry_out(out, list(DIRECTIONS), partial(run_resonance, settings), lambda study: study.report())


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
        from gearmbs.studies.presets.gearbox import GearboxSettings, industrial_gearbox, run_gearbox

        settings = GearboxSettings(speed=speed, power=power, helix_angle=helix)
        industrial_gearbox(settings)
        study = partial(run_gearbox, settings, duration=duration, run_up=run_up)
        carry_out(out, ["steady", "run-up"], study, mode_line)


# ``gearmbs paper`` and ``gearmbs run``: the study, and single cases, planetary sets and drivetrains from files.


def keep_partial(failure: SimulationFailed, path: Path) -> NoReturn:
    """Write what a run has computed before it stopped, and end: with status 130 if the user interrupted it."""
    from gearmbs.files import KeptElsewhere
    from gearmbs.studies.run.simulation import SimulationInterrupted
    from gearmbs.studies.run.store import keep_dataset

    computed = failure.partial()
    if computed is None:
        raise failure
    try:
        path = keep_dataset(path, computed)
    except KeptElsewhere as error:
        path = error.path
    except OSError as error:
        raise RuntimeError(f"{failure}\n{error}") from failure
    if isinstance(failure, SimulationInterrupted):
        end = float(computed.time[-1])
        typer.secho(f"gearmbs: interrupted at t = {end:.6g} s; what was computed until then is in {path}", err=True)
        raise typer.Exit(130) from None
    raise RuntimeError(f"{failure}\nWhat was computed until then is in {path}") from failure


def simulated(name: str, span: float, target: Path, run: Callable[..., Any], size: float = 0.0) -> Any:
    """Simulate with a bar over the time of a run (s) and write the record; of a run that fails what it computed."""
    from gearmbs.files import check_place
    from gearmbs.studies.run.simulation import SimulationFailed
    from gearmbs.studies.run.store import keep_dataset

    check_place(target.parent, size, "its record")
    with case_bars([name]) as move:
        try:
            data = run(progress=lambda t: move(name, min(t / span, 1.0)))
        except SimulationFailed as failure:
            keep_partial(failure, target.with_name(f"{target.stem}.partial.nc"))
    keep_dataset(target, data)
    return data


def paper(
    out: Out = Path("out/paper"),
    speed: Annotated[str | None, typer.Option(help='Speed of the driver, e.g. "1000 rpm".')] = None,
    duration: Annotated[str | None, typer.Option(help='Length of the record, e.g. "1 s".')] = None,
    torque: Annotated[str | None, typer.Option(help='Low load, e.g. "100 N m"; the high load is twice that.')] = None,
    depth: Annotated[str | None, typer.Option(help='Penetration d of full damping, e.g. "0.1 mm".')] = None,
    backlash: Annotated[str | None, typer.Option(help='Normal backlash, e.g. "0.1 mm".')] = None,
    face_width: Annotated[str | None, typer.Option(help='Face width, e.g. "20 mm".')] = None,
    friction: Annotated[bool, typer.Option(help="Coulomb friction between the flanks.")] = True,
    misalignment: Annotated[str, typer.Option(help='Plane of the misalignment: "skew" or "inclination".')] = "skew",
    angle: Annotated[str, typer.Option(help="Angle of the misalignment.")] = "1 deg",
    integrator: Annotated[str, typer.Option(help=f"{any_of(INTEGRATORS)}.")] = DEFAULT,
    tolerance: Annotated[float | None, typer.Option(help="Integrator tolerance.")] = None,
    component: Annotated[str, typer.Option(help="Force component of the figures.")] = "line_of_action",
    workers: Annotated[int | None, typer.Option(help="Cases at a time; default: the cores.")] = None,
) -> None:
    """Reproduce the paper: six cases, GMF table, figures 5 and 7, report."""
    with guarded():
        # on a busy machine imports alone take many seconds
        typer.secho("gearmbs: the paper's six cases; loading", err=True)
        # nothing that compiles is imported before all options are known to be right
        from gearmbs.signals import COMPONENTS
        from gearmbs.studies.case.case import CaseError, make_case
        from gearmbs.studies.case.limits import check_record
        from gearmbs.units import to_si

        if component not in COMPONENTS:
            raise CaseError(f"--component is {component!r}; choose one of {', '.join(COMPONENTS)}")
        data: dict = {"solver": {"integrator": integrator.upper()}, "fault": {"plane": misalignment}}
        for section, key, value in (
            ("operation", "speed", speed),
            ("operation", "duration", duration),
            ("contact", "depth", depth),
            ("fault", "backlash", backlash),
            ("gears", "face_width", face_width),
            ("solver", "tolerance", tolerance),
        ):
            if value is not None:
                data.setdefault(section, {})[key] = value
        data["friction"] = {"enabled": friction}
        if torque is not None:
            data.setdefault("operation", {})["torque"] = torque
        base = make_case(data, "options")
        low = base.operation.top_torque
        tilt = to_si(angle, "angle", "--angle")
        check_record(base.changed(operation={"torque": 2.0 * low}, fault={"misalignment": tilt}), "options", bands=True)

        from gearmbs.files import check_place, keep
        from gearmbs.studies.presets.paper import run_paper
        from gearmbs.studies.presets.paper_cases import paper_cases
        from gearmbs.studies.run.simulation import SimulationFailed
        from gearmbs.studies.run.store import file_stem, record_size, stored_record

        settings: dict[str, Any] = {"torques": (low, 2.0 * low), "misalignment": tilt}
        cases = paper_cases(base=base, **settings)
        names = [case.name for case in cases]
        single = out / "cases"
        finished = [case.name for case in cases if stored_record(single, case) is not None]
        # each record by itself, and all of them in one file
        check_place(out, record_size(base) * (2 * len(cases) - len(finished)), "the study")
        if finished:
            typer.echo(f"taking up {len(finished)} finished of {len(cases)} cases from {single}", err=True)
        with case_bars(names) as move:
            try:
                study = run_paper(
                    base,
                    component=component,
                    workers=workers,
                    progress=move,
                    folder=single,
                    **settings,
                )
            except SimulationFailed as failure:
                name = file_stem(failure.case.name) if failure.case is not None else "failed"
                keep_partial(failure, single / f"{name}.partial.nc")
        paths = keep(study.save, out)
        typer.echo(claim_lines(study.claims()))
        typer.echo("\n".join(f"wrote {path}" for path in paths))


def run(
    case_file: Annotated[Path, typer.Argument(help="Case in TOML.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="NetCDF file; default: beside the case.")] = None,
    lump: Annotated[
        bool,
        typer.Option("--lump", help="Integrate gear and shaft as one body, as [solver] lump = true does."),
    ] = False,
    accuracy: Annotated[
        str | None,
        typer.Option(help="How well mesh harmonics are to be known, such as '1 %'; their errors are told."),
    ] = None,
) -> None:
    """Simulate a case, a planetary set or a whole drivetrain, and write its record as NetCDF."""
    kind = kind_of(case_file)
    if kind == "planetary set":
        run_planetary_set(case_file, out, accuracy)
        return
    if kind == "drivetrain":
        run_drivetrain(case_file, out, accuracy)
        return
    with guarded():
        from gearmbs.studies.case.case import load_case
        from gearmbs.studies.case.limits import check_record, remarks

        case = load_case(case_file)
        if lump:
            case = case.changed(solver={"lump": True})
        check_record(case, str(case_file))

        from gearmbs.studies.run.simulation import run_case
        from gearmbs.studies.run.store import record_size

        target, operation = out or case_file.with_suffix(".nc"), case.operation
        span = operation.run_up + operation.settling + operation.longest
        data = simulated(case.name, span, target, partial(run_case, case, accuracy=accuracy), record_size(case))
        typer.echo(_level_table(data))
        told = data.attrs.get("record_length")
        known = data.attrs.get("accuracy_by")
        about = [f"record: {told}"] if told else []
        about += [f"accuracy: {known}"] if known else []
        for remark in [*about, *remarks(case)]:
            typer.echo(f"note: {remark}", err=True)
        speed, cycle = data.attrs["solver_real_time_factor"], 1e3 * data.attrs["solver_time_per_mesh_cycle"]
        typer.echo(f"solver: {speed:.3g} times real time, {cycle:.3g} ms a mesh cycle", err=True)
        typer.echo(f"wrote {target}")


def run_planetary_set(file: Path, out: Path | None, accuracy: str | None = None) -> None:
    """Simulate a planetary set; write its record and say how the load is shared."""
    with guarded():
        from gearmbs.studies.case.section import CaseError
        from gearmbs.studies.planetary import load_planetary, run_planetary

        found = load_planetary(file)
        try:
            # what does not go together is found when the mechanism is made
            found.mechanism()
        except ValueError as error:
            raise CaseError(f"{file.name}: {error}") from None
        target = out or file.with_suffix(".nc")
        span = found.run_up + found.settling + found.duration
        data = simulated(found.gears.name, span, target, partial(run_planetary, found, accuracy=accuracy))
        for planet in data.planet.values:
            one = data.sel(planet=planet)
            loads = "".join(f"{float(one['force'].sel(mesh=m).mean()):12.5g} N ({m})" for m in ("sun", "ring"))
            typer.echo(f"planet {planet}: {loads}, share {float(one['share'].mean()):.4f}")
        _tell_accuracy(data)
        names = ("mesh", "sun_fault", "planet_fault", "ring_fault", "planet_pass")
        typer.echo("Hz: " + ", ".join(f"{n.replace('_', ' ')} {data.attrs['frequency_' + n]:.5g}" for n in names))
        typer.echo(f"wrote {target}")


def _tell_accuracy(data: Any) -> None:
    """Say to what the mesh harmonics of a record are known, if an accuracy was asked for."""
    if (said := data.attrs.get("accuracy_by")) is not None:
        typer.echo(f"note: accuracy: {said}", err=True)


def run_drivetrain(file: Path, out: Path | None, accuracy: str | None = None) -> None:
    """Simulate a drivetrain; write its record, a report, a 3-D view and a spectrum with its lines named."""
    with guarded():
        from gearmbs.studies.trains import check_record, load_train

        found = load_train(file)
        train, settings = found.train, found.run
        check_record(train, settings)

        from gearmbs.files import write_whole
        from gearmbs.signals.files.simulated import holds_speed
        from gearmbs.studies.train_views import train_report, train_scene, train_spectrum
        from gearmbs.studies.trains import run_train
        from gearmbs.view import save_figure

        target = out or file.with_suffix(".nc")
        span = train.run_up + settings.settling + settings.duration
        data = simulated(train.name, span, target, partial(run_train, train, settings, accuracy=accuracy))
        report, scene = target.with_suffix(".md"), target.with_suffix(".html")
        write_whole(report, train_report(train, data))
        train_scene(train).save_html(scene)
        written = [target, report, scene]
        if "mesh_rms" in data and train.meshings and holds_speed(data):
            written += save_figure(train_spectrum(train, data), target.with_suffix(""))
        for mesh in data.mesh.values:
            if "mesh_track" in data:
                # of a run-up the report says where which harmonic is highest
                continue
            levels = data["mesh_rms"].sel(mesh=mesh, signal=f"force of {mesh}")
            shown = "".join(f"{v:10.4g}" for v in levels.values)
            if "mesh_rms_error" in data:
                errors = data["mesh_rms_error"].sel(mesh=mesh, signal=f"force of {mesh}").values
                shown = "".join(f"{v:10.4g} +/- {e:.2g}" for v, e in zip(levels.values, errors, strict=True))
            typer.echo(f"{mesh!s:<18}{float(levels.mesh_frequency):10.5g} Hz{shown}   RMS of the normal force, N")
        _tell_accuracy(data)
        if data.attrs.get("remarks", "none") != "none":
            typer.echo(data.attrs["remarks"])
        typer.echo("\n".join(f"wrote {path}" for path in written))


def _level_table(data: Any) -> str:
    """Return the levels of the mesh harmonics of a record as a table; of a run-up the highest, and where."""
    if "gmf_rms" in data:
        from gearmbs.studies.run.levels import told_way

        way = told_way([data])
        levels = data["gmf_rms"].sel(way=way)
        heads = "".join(f"{h:>4} x GMF" for h in levels.harmonic.values)
        lines = [f"{'component':<18}{heads}   RMS by {way}, m/s^2"]
        for component in levels.component.values:
            row = levels.sel(component=component).values
            lines.append(f"{component!s:<18}" + "".join(f"{v:10.4g}" for v in row))
            if "gmf_rms_error" in data:
                errors = data["gmf_rms_error"].sel(way=way, component=component).values
                lines.append(f"{'  +/- numerically':<18}" + "".join(f"{v:10.2g}" for v in errors))
        return "\n".join(lines)
    speed = data["speed"] * 30.0 / 3.141592653589793
    lines = [f"driver from {float(speed[0]):.4g} to {float(speed[-1]):.4g} rpm, at most {float(speed.max()):.4g} rpm"]
    levels, at = data["order_rms"], data["track_speed"] * 30.0 / 3.141592653589793
    heads = "".join(f"{int(h):>8} x GMF   at rpm" for h in levels.harmonic.values)
    lines.append(f"{'highest':<18}{heads}   RMS, m/s^2")
    for component in levels.component.values:
        row = levels.sel(component=component).transpose("harmonic", "track_time").values
        best = [int(v.argmax()) for v in row]
        lines.append(f"{component!s:<18}" + "".join(f"{v[k]:14.4g}{float(at[k]):9.4g}" for v, k in zip(row, best)))
        if "order_rms_error" in data:
            off = data["order_rms_error"].sel(component=component).transpose("harmonic", "track_time").values
            lines.append(f"{'  +/- numerically':<18}" + "".join(f"{v[k]:14.2g}{'':9}" for v, k in zip(off, best)))
    return "\n".join(lines)


# ``gearmbs sweep`` and ``gearmbs campbell``: a case over many values, and the modes of a drivetrain over its speed.


def sweep(
    case_file: Annotated[Path, typer.Argument(help="Case in TOML.")],
    field: Annotated[str, typer.Argument(help='Section and setting, e.g. "operation.speed".')],
    values: Annotated[list[str], typer.Argument(help='Its values, e.g. "600 rpm" "900 rpm"; two with --count.')],
    count: Annotated[int | None, typer.Option(help="So many values, evenly from the first to the second.")] = None,
    workers: Annotated[int | None, typer.Option(help="Cases at a time; default: the cores.")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for records, table and figure.")] = Path("sweep"),
) -> None:
    """Run a case over values of one setting, taken up again if interrupted; over speeds, draw a waterfall.

    Several settings at once, samples of distributions and work of days are campaigns: gearmbs campaign.
    """
    with guarded():
        check_kind(case_file, "case")
        from gearmbs.files import check_place
        from gearmbs.studies.case.case import load_case
        from gearmbs.studies.case.limits import check_record
        from gearmbs.studies.run.store import record_size
        from gearmbs.studies.run.sweep import between, cases_of_sweep
        from gearmbs.studies.run.sweep import sweep as run_sweep

        case = load_case(case_file)
        chosen = values if count is None else between(values, count, case, field)
        cases = cases_of_sweep(case, field, chosen)
        for one in cases:
            check_record(one, str(case_file))
        check_place(out, sum(record_size(one) for one in cases), "the sweep")
        with case_bars([one.name for one in cases]) as move:
            study = run_sweep(case, field, chosen, folder=out, workers=workers, progress=move, errors="keep")
        for name, error in study.failures.items():
            typer.echo(f"gearmbs: {name} failed: {error}", err=True)
        if not study.records:
            raise RuntimeError("no case of the sweep came to its end")
        paths = study.save(out)
        typer.echo(study.table().to_string(float_format="{:.5g}".format))
        typer.echo("\n".join(f"wrote {path}" for path in paths if path.suffix != ".nc"))
        typer.echo(f"wrote {len(study.records)} records to {out}")


def campbell(
    train: Annotated[Path, typer.Argument(help="Drivetrain (TOML).")],
    speeds: Annotated[
        list[str] | None, typer.Option(help='Lowest and highest speed of the first drive, e.g. "3000 rpm"; repeat.')
    ] = None,
    harmonics: Annotated[int, typer.Option(help="Mesh harmonics that excite.")] = 2,
    maximum: Annotated[str, typer.Option(help="Modes up to this frequency.")] = "2 kHz",
    record: Annotated[Path | None, typer.Option(help="Record of a run-up to lay beneath.")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the figure.")] = Path("campbell"),
) -> None:
    """Draw natural frequencies of a drivetrain over its speed, with what excites them; rank the critical speeds."""
    with guarded(), stage_bar(train.name) as move:
        check_kind(train, "drivetrain")
        if record is not None:
            check_kind(record, "record")
        check_targets(out=out)
        import numpy as np

        from gearmbs.drivetrain.description import read_description
        from gearmbs.studies.mode_names import ranked_crossings
        from gearmbs.studies.train_views import train_campbell
        from gearmbs.units import to_si
        from gearmbs.view import campbell_plot

        top = to_si(maximum, "frequency", "--maximum")
        limits = sorted(to_si(text, "angular speed", "--speeds") for text in speeds or [])
        if len(limits) > 2:
            raise ValueError(f"--speeds is given {len(limits)} times; give the highest, or the lowest and the highest")
        lowest, highest = (0.0, *limits)[-2:] if limits else (0.0, 1.0)
        if not 0.0 <= lowest < highest:
            raise ValueError(
                f"--speeds is {' and '.join(speeds or [])}; give one above 0 rpm, or two that differ and are not "
                "negative: the diagram is over the magnitude of the drive's speed"
            )
        turned = np.linspace(lowest, highest, 13).tolist() if limits else None
        move(0.1, "modes")
        diagram = train_campbell(read_description(train).train, turned, harmonics=harmonics, maximum=top)
        measured = None
        if record is not None:
            from gearmbs.signals import waterfall
            from gearmbs.signals.files.simulated import read_any

            measured = waterfall(read_any(record), maximum=top)
        move(0.8, "drawing")
        files = save_figures({"campbell": campbell_plot(diagram, measured=measured, maximum=top)}, out)
        table = ranked_crossings(diagram)
    hand_over(table.to_string(index=False, float_format="{:.5g}".format), None, files)
