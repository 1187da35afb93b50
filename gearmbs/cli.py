"""Command line: a thin layer over the library's public calls."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from gearmbs._command import case_bars, fail, guarded
from gearmbs.campaigns.commands import app as campaign_app
from gearmbs.identify.commands import identify as identify_command
from gearmbs.studies.commands import bench as bench_command
from gearmbs.studies.commands import gearbox as gearbox_command
from gearmbs.studies.commands import resonance as resonance_command

if TYPE_CHECKING:
    from gearmbs.studies.simulation import SimulationFailed

app = typer.Typer(
    name="gearmbs",
    help="Multibody gear dynamics: simulate gear pairs and mechanisms, evaluate and compare vibration signals.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

app.add_typer(campaign_app)
app.command("identify")(identify_command)
app.command("bench")(bench_command)
app.command("gearbox")(gearbox_command)
app.command("resonance")(resonance_command)

Out = Annotated[Path, typer.Option("--out", "-o", help="Folder for the results.")]
Rate = Annotated[str | None, typer.Option(help='Sampling rate, Hz or "12.8 kHz", if the file does not name it.')]
Speed = Annotated[
    str | None,
    typer.Option(help='Shaft speed, e.g. "1780 rpm", or a file with the speed over time; default: from the GMF line.'),
]
Gaps = Annotated[str | None, typer.Option(help='Missing samples: "refuse", "interpolate" or "longest" stretch.')]
ReportFile = Annotated[Path | None, typer.Option("--out", "-o", help="Write the report here instead of printing it.")]


@contextmanager
def stage_bar(name: str) -> Iterator[Callable[[float, str], None]]:
    """Show one bar with the stage it is in, on a terminal; yield the function that moves it."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (TextColumn("{task.description:>24}"), BarColumn(), TextColumn("{task.fields[stage]}"))
    with Progress(
        *columns, TimeElapsedColumn(), console=console, transient=True, disable=not console.is_terminal
    ) as progress:
        task = progress.add_task(name, total=1.0, stage="reading")
        yield lambda fraction, stage: progress.update(task, completed=fraction, stage=stage)


def keep_partial(failure: SimulationFailed, path: Path) -> NoReturn:
    """Write what a run has computed before it stopped, and end: with status 130 if the user interrupted it."""
    from gearmbs.studies.simulation import SimulationInterrupted
    from gearmbs.studies.store import KeptElsewhere, keep_dataset

    partial = failure.partial()
    if partial is None:
        raise failure
    try:
        path = keep_dataset(path, partial)
    except KeptElsewhere as error:
        path = error.path
    except OSError as error:
        raise RuntimeError(f"{failure}\n{error}") from failure
    if isinstance(failure, SimulationInterrupted):
        end = float(partial.time[-1])
        typer.secho(f"gearmbs: interrupted at t = {end:.6g} s; what was computed until then is in {path}", err=True)
        raise typer.Exit(130) from None
    raise RuntimeError(f"{failure}\nWhat was computed until then is in {path}") from failure


def _interrupt(*_args) -> None:
    """Take a request to end like Ctrl-C, also where Ctrl-C is ignored, as in a background job."""
    if signal.getsignal(signal.SIGINT) in (signal.SIG_IGN, None):
        raise KeyboardInterrupt
    signal.raise_signal(signal.SIGINT)


@app.callback(invoke_without_command=True)
def main(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    """Multibody gear dynamics."""
    # many small products: threads of the linear algebra library double the time; numpy is not loaded yet
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    signal.signal(signal.SIGTERM, _interrupt)
    # a command makes many objects and drops few: looking for cycles at every 700 of them costs a tenth of its start,
    # looking for them once more at the end, among all modules, half a second
    gc.set_threshold(50_000, 20, 20)
    atexit.register(gc.freeze)
    if version:
        import gearmbs

        typer.echo(f"gearmbs {gearmbs.__version__}")
        raise typer.Exit


@app.command()
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
    integrator: Annotated[str, typer.Option(help="WSTIFF, GSTIFF or IDA.")] = "WSTIFF",
    tolerance: Annotated[float | None, typer.Option(help="Integrator tolerance.")] = None,
    component: Annotated[str, typer.Option(help="Force component of the figures.")] = "line_of_action",
    workers: Annotated[int | None, typer.Option(help="Cases at a time; default: the cores.")] = None,
) -> None:
    """Reproduce the paper: six cases, GMF table, figures 5 and 7, report."""
    with guarded():
        # nothing that compiles is imported before all options are known to be right
        from gearmbs.signals import COMPONENTS
        from gearmbs.studies.case import CaseError, make_case
        from gearmbs.studies.limits import check_record
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
        check_record(base.changed(operation={"torque": 2.0 * low}, fault={"misalignment": tilt}), "options")

        from gearmbs.studies.paper import run_paper
        from gearmbs.studies.preset import paper_cases
        from gearmbs.studies.simulation import SimulationFailed
        from gearmbs.studies.store import check_place, file_stem, keep, record_size, stored_record

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
        for claim in study.claims():
            mark = "held    " if claim.held else "NOT HELD"
            typer.echo(f"{mark}  {claim.name}\n          {claim.numbers}")
        typer.echo("\n".join(f"wrote {path}" for path in paths))


@app.command()
def run(
    case_file: Annotated[Path, typer.Argument(help="Case in TOML.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="NetCDF file; default: beside the case.")] = None,
    lump: Annotated[
        bool,
        typer.Option("--lump", help="Integrate gear and shaft as one body, as [solver] lump = true does."),
    ] = False,
) -> None:
    """Simulate a case, a planetary set or a whole drivetrain, and write its record as NetCDF."""
    if holds_planetary(case_file):
        run_planetary_set(case_file, out)
        return
    if holds_drivetrain(case_file):
        run_drivetrain(case_file, out)
        return
    with guarded():
        from gearmbs.studies.case import load_case
        from gearmbs.studies.limits import check_record, remarks

        case = load_case(case_file)
        if lump:
            case = case.changed(solver={"lump": True})
        check_record(case, str(case_file))

        from gearmbs.studies.simulation import SimulationFailed, run_case
        from gearmbs.studies.store import check_place, keep_dataset, record_size

        target = out or case_file.with_suffix(".nc")
        check_place(target.parent, record_size(case), "its record")
        operation = case.operation
        span = operation.run_up + operation.settling + operation.duration
        with case_bars([case.name]) as move:
            try:
                data = run_case(case, lambda t: move(case.name, min(t / span, 1.0)))
            except SimulationFailed as failure:
                keep_partial(failure, target.with_name(f"{target.stem}.partial.nc"))
        keep_dataset(target, data)
        typer.echo(_level_table(data))
        for remark in remarks(case):
            typer.echo(f"note: {remark}", err=True)
        speed, cycle = data.attrs["solver_real_time_factor"], 1e3 * data.attrs["solver_time_per_mesh_cycle"]
        typer.echo(f"solver: {speed:.3g} times real time, {cycle:.3g} ms a mesh cycle", err=True)
        typer.echo(f"wrote {target}")


def holds_drivetrain(path: Path) -> bool:
    """Return whether a file describes a drivetrain; whatever else is wrong with it is found by who reads it."""
    import tomllib

    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return False
    # the shafts of a case are two, with one size
    return "meshes" in data or "wheels" in data


def holds_planetary(path: Path) -> bool:
    """Return whether a file describes a planetary set."""
    import tomllib

    try:
        return "planetary" in tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return False


def run_planetary_set(file: Path, out: Path | None) -> None:
    """Simulate a planetary set; write its record and say how the load is shared."""
    with guarded():
        from gearmbs.studies.planetary import load_planetary, run_planetary
        from gearmbs.studies.store import check_place, keep_dataset

        found = load_planetary(file)
        target = out or file.with_suffix(".nc")
        check_place(target.parent, 0, "its record")
        span = found.run_up + found.settling + found.duration
        with case_bars([found.gears.name]) as move:
            data = run_planetary(found, lambda t: move(found.gears.name, min(t / span, 1.0)))
        keep_dataset(target, data)
        for planet in data.planet.values:
            one = data.sel(planet=planet)
            loads = "".join(f"{float(one['force'].sel(mesh=m).mean()):12.5g} N ({m})" for m in ("sun", "ring"))
            typer.echo(f"planet {planet}: {loads}, share {float(one['share'].mean()):.4f}")
        names = ("mesh", "sun_fault", "planet_fault", "ring_fault", "planet_pass")
        typer.echo("Hz: " + ", ".join(f"{n.replace('_', ' ')} {data.attrs['frequency_' + n]:.5g}" for n in names))
        typer.echo(f"wrote {target}")


def run_drivetrain(file: Path, out: Path | None) -> None:
    """Simulate a drivetrain; write its record, a report and a 3-D view."""
    with guarded():
        from gearmbs.studies.trains import check_record, load_train

        found = load_train(file)
        train, settings = found.train, found.run
        check_record(train, settings)

        from gearmbs.studies.simulation import SimulationFailed
        from gearmbs.studies.store import check_place, keep_dataset, write_text
        from gearmbs.studies.train_report import train_report, train_scene
        from gearmbs.studies.trains import run_train

        target = out or file.with_suffix(".nc")
        check_place(target.parent, 0, "its record")
        span = train.run_up + settings.settling + settings.duration
        with case_bars([train.name]) as move:
            try:
                data = run_train(train, settings, progress=lambda t: move(train.name, min(t / span, 1.0)))
            except SimulationFailed as failure:
                keep_partial(failure, target.with_name(f"{target.stem}.partial.nc"))
        keep_dataset(target, data)
        report, scene = target.with_suffix(".md"), target.with_suffix(".html")
        write_text(report, train_report(train, data))
        train_scene(train).save_html(scene)
        for mesh in data.mesh.values:
            if "mesh_track" in data:
                # of a run-up the report says where which harmonic is highest
                continue
            levels = data["mesh_rms"].sel(mesh=mesh, signal=f"force of {mesh}")
            shown = "".join(f"{v:10.4g}" for v in levels.values)
            typer.echo(f"{mesh!s:<18}{float(levels.mesh_frequency):10.5g} Hz{shown}   RMS of the normal force, N")
        typer.echo("\n".join(f"wrote {path}" for path in (target, report, scene)))


def _level_table(data: Any) -> str:
    """Return the levels of the mesh harmonics of a record as a table; of a run-up the highest, and where."""
    if "gmf_rms" in data:
        levels = data["gmf_rms"].sel(way="band")
        lines = [f"{'component':<18}" + "".join(f"{h:>4} x GMF" for h in levels.harmonic.values) + "   RMS, m/s^2"]
        for component in levels.component.values:
            row = levels.sel(component=component).values
            lines.append(f"{component!s:<18}" + "".join(f"{v:10.4g}" for v in row))
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
    return "\n".join(lines)


@app.command()
def analyse(
    file: Annotated[Path, typer.Argument(help="CSV, MAT, UFF, WAV, TDMS, LVM, NPY, Parquet, NetCDF or HDF5.")],
    teeth: Annotated[str | None, typer.Option(help='Teeth of the wheel on the reference shaft; or "32,80".')] = None,
    rate: Rate = None,
    speed: Speed = None,
    speed_channel: Annotated[str | None, typer.Option(help="Channel that holds the speed.")] = None,
    units: Annotated[str | None, typer.Option(help='Units of the samples, e.g. "m/s^2".')] = None,
    channel: Annotated[list[str] | None, typer.Option(help="Channel to use; repeat for several; default: all.")] = None,
    tacho: Annotated[str | None, typer.Option(help="Channel with the tacho pulses.")] = None,
    pulses: Annotated[float, typer.Option(help="Tacho pulses a revolution.")] = 1.0,
    wheel: Annotated[int, typer.Option(help="Whose shaft the averages follow: 1, or 2 for the mate.")] = 1,
    harmonics: Annotated[int, typer.Option(help="Mesh harmonics to evaluate.")] = 3,
    bearing: Annotated[
        list[str] | None,
        typer.Option(help='Bearing, e.g. 6205; "6205@0.345" on a shaft of 0.345 times the speed; repeat for several.'),
    ] = None,
    band: Annotated[
        str | None, typer.Option(help='Band of the envelope, e.g. "1 kHz, 5 kHz"; default: kurtogram.')
    ] = None,
    shaft: Annotated[
        list[str] | None,
        typer.Option(help='Speed of another shaft by that given, e.g. 0.345; "none" if there is no other; repeat.'),
    ] = None,
    gaps: Gaps = None,
    format: Annotated[str | None, typer.Option(help="Format of the file, if its name does not say.")] = None,
    tables: Annotated[Path | None, typer.Option(help="Folder for the tables as CSV.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Folder for spectrum and average as PNG and SVG.")] = None,
    out: ReportFile = None,
) -> None:
    """Analyse a record, measured or simulated: of gears (--teeth), of bearings (--bearing), or of any machine."""
    with guarded(), stage_bar(file.name) as move:
        from gearmbs.signals import analyse as analyse_signal
        from gearmbs.signals.simulated import read_any
        from gearmbs.signals.speed_file import parse_speed

        helpers = [name for name in (tacho, speed_channel) if name and name not in (channel or ())]
        signal = read_any(
            file,
            rate=rate,
            units=units,
            channels=None if channel is None else [*channel, *helpers],
            gaps=gaps,
            format=format,
            teeth=None if teeth is None else tooth_counts(teeth),
            progress=lambda f, s: move(0.3 * f, s),
        )
        known = parse_speed(speed)
        report = analyse_signal(
            signal,
            speed=known,
            speed_channel=speed_channel,
            tacho=tacho,
            pulses_per_rev=pulses,
            wheel=wheel,
            harmonics=harmonics,
            progress=lambda f, s: move(0.3 + 0.7 * f, s),
        )
        found = report.tables()
        text = report.to_markdown()
        if bearing:
            from gearmbs.signals import diagnose_bearing

            one = signal.sel(channel=report.levels["channel"].values)
            turns = known if isinstance(known, float) else report.speed
            bearings = diagnose_bearing(
                one,
                bearing_list(bearing),
                turns,
                band=None if band is None else pair_of(band),
                shafts=None if shaft is None else shaft_ratios(shaft),
            )
            found |= bearings.tables()
            text = f"{bearings.to_markdown()}\n\n{text}"
        try:
            files = _save_tables(found, tables)
            if figures is not None:
                from gearmbs.view import analysis_figures

                files += _save_figures(analysis_figures(report, signal), figures)
        except OSError:
            typer.echo(text)
            raise
    _hand_over(text, out, files)


@app.command()
def trend(
    files: Annotated[
        list[Path], typer.Argument(help="A long record, or a folder, a pattern or many files as one series.")
    ],
    section: Annotated[str | None, typer.Option(help='Length of the pieces; default: "10 s" of one record.')] = None,
    teeth: Annotated[str | None, typer.Option(help='Teeth of the wheel on the reference shaft; or "32,80".')] = None,
    rate: Rate = None,
    speed: Speed = None,
    speed_channel: Annotated[str | None, typer.Option(help="Channel that holds the speed.")] = None,
    units: Annotated[str | None, typer.Option(help='Units of the samples, e.g. "m/s^2".')] = None,
    channel: Annotated[list[str] | None, typer.Option(help="Channel to use; repeat for several; default: all.")] = None,
    harmonics: Annotated[int, typer.Option(help="Mesh harmonics to evaluate.")] = 3,
    gaps: Gaps = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="CSV file instead of the terminal.")] = None,
) -> None:
    """Follow features over time: of a long record piece by piece, or of many files, taken up again if interrupted."""
    with guarded(), stage_bar(files[0].name) as move:
        from gearmbs.signals import series, trend_table
        from gearmbs.signals import trend as follow
        from gearmbs.signals.speed_file import parse_speed
        from gearmbs.view.files import write_whole

        known: dict[str, Any] = {
            "teeth": None if teeth is None else tooth_counts(teeth),
            "rate": rate,
            "speed": parse_speed(speed),
            "units": units,
            "channels": channel,
            "harmonics": harmonics,
            "gaps": gaps,
        }
        pattern = any(sign in str(files[0]) for sign in "*?[") and not files[0].exists()
        if len(files) > 1 or files[0].is_dir() or pattern:
            known["speed_channel"] = speed_channel
            table = series(
                files[0] if len(files) == 1 else files,
                section=section,
                store=out,
                progress=lambda name, fraction: move(fraction, name),
                **known,
            )
        else:
            if speed_channel is not None:
                known["speed_channel"] = speed_channel
            table = trend_table(follow(files[0], section or "10 s", progress=move, **known))
            if out is not None:
                write_whole(out, table.to_csv(index=False))
    if out is None:
        typer.echo(table.to_csv(index=False, float_format="%.5g"), nl=False)
    else:
        typer.echo(f"wrote {out}")


@app.command()
def compare(
    experiment: Annotated[list[str], typer.Option(help="Measured file as load:state=path; repeat.")],
    model: Annotated[
        list[str] | None,
        typer.Option(help="paper.nc of `gearmbs paper`, or load:state=path of `gearmbs run` records; repeat."),
    ] = None,
    component: Annotated[str, typer.Option(help="Force component of the model.")] = "line_of_action",
    teeth: Annotated[str | None, typer.Option(help='Teeth of the measured wheel; or both, "32,80".')] = None,
    rate: Rate = None,
    speed: Annotated[
        str | None, typer.Option(help="Shaft speed of the measured files; default: from the line.")
    ] = None,
    units: Annotated[str | None, typer.Option(help="Units of the measured samples.")] = None,
    gaps: Gaps = None,
    channel: Annotated[str | None, typer.Option(help="Measured channel.")] = None,
    reference: Annotated[str, typer.Option(help="State the others are held against.")] = "healthy",
    scope: Annotated[str, typer.Option(help="What sets the scaling: load, all or each.")] = "load",
    wheel: Annotated[int, typer.Option(help="Whose shaft the indicators follow: 1, or 2 for the mate.")] = 1,
    tables: Annotated[Path | None, typer.Option(help="Folder for the tables as CSV.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Folder for the bars as PNG and SVG.")] = None,
    out: ReportFile = None,
) -> None:
    """Compare measured states with each other and with the model, as in the paper's section 4."""
    with guarded(), stage_bar("comparison") as move:
        from gearmbs.signals import compare as compare_signals
        from gearmbs.signals.simulated import parse_models, parse_states, read_any
        from gearmbs.signals.speed_file import parse_speed

        known = {
            "teeth": None if teeth is None else tooth_counts(teeth),
            "speed": parse_speed(speed),
            "rate": rate,
            "units": units,
            "gaps": gaps,
        }
        measured = {
            load: {state: read_any(path, **known) for state, path in states.items()}
            for load, states in parse_states(experiment).items()
        }
        report = compare_signals(
            measured,
            parse_models(model, component) if model else None,
            reference=reference,
            scope=scope,  # type: ignore[arg-type]
            channel=channel,
            wheel=wheel,
            progress=move,
        )
        files = _save_tables(report.tables(), tables)
        if figures is not None:
            from gearmbs.view import comparison_figures

            files += _save_figures(comparison_figures(report), figures)
    _hand_over(report.to_markdown(), out, files)


def bearing_list(texts: list[str]) -> dict[str, tuple[str, float]]:
    """Return bearings and the ratios of their shafts, given as "6205" or "6205@0.345"."""
    found: dict[str, tuple[str, float]] = {}
    for text in texts:
        name, _, ratio = text.partition("@")
        try:
            value = float(ratio) if ratio else 1.0
        except ValueError:
            raise ValueError(f"--bearing {text!r}: {ratio!r} is no number; write for example 6205@0.345") from None
        key = name.strip() if name.strip() not in found else text
        found[key] = (name.strip(), value)
    return found


def shaft_ratios(texts: list[str]) -> list[float]:
    """Return the ratios of other shafts, none for the word "none"."""
    try:
        return [] if [text.strip().lower() for text in texts] == ["none"] else [float(text) for text in texts]
    except ValueError:
        raise ValueError(f"--shaft {' '.join(texts)!r}: give ratios such as 0.345, or none") from None


def pair_of(text: str) -> tuple[float, float]:
    """Return a band in Hz given as "1000, 5000" or "1 kHz, 5 kHz"."""
    from gearmbs.units import to_si

    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 2:
        raise ValueError(f"--band {text!r}: give two frequencies such as '1 kHz, 5 kHz'")
    low, high = (
        to_si(p if any(c.isalpha() for c in p.replace("e", "")) else f"{p} Hz", "frequency", "--band") for p in parts
    )
    return low, high


def tooth_counts(text: str) -> tuple[int, ...]:
    """Return the counts of a text such as "32" or "32,80"."""
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"--teeth is {text!r}; give a count, or both with a comma, for instance 32,80") from None


def _save_tables(tables: dict[str, Any], folder: Path | None) -> list[Path]:
    """Write each table as CSV into the folder, if one is given."""
    from gearmbs.view.files import write_whole

    written = []
    for name, table in tables.items() if folder is not None else ():
        assert folder is not None
        path = folder / f"{name}.csv"
        write_whole(path, table.to_csv(index=False))
        written.append(path)
    return written


def _save_figures(figures: dict[str, Any], folder: Path) -> list[Path]:
    """Write each figure as PNG and SVG into the folder."""
    from gearmbs.view import save_figure

    return [path for name, figure in figures.items() for path in save_figure(figure, folder / name.replace(" ", "_"))]


def _hand_over(report: str, out: Path | None, files: list[Path]) -> None:
    """Print a report or write it, and name the files written; print it, too, where it cannot be written."""
    if out is None:
        typer.echo(report)
    else:
        from gearmbs.view.files import write_whole

        with guarded():
            try:
                write_whole(out, report)
            except OSError:
                typer.echo(report)
                raise
        files = [out, *files]
    if files:
        typer.echo("\n".join(f"wrote {path}" for path in files), err=out is None)


@app.command()
def adams(
    model: Annotated[Path, typer.Argument(help="ADAMS/Solver deck (.adm).")],
    script: Annotated[Path | None, typer.Argument(help="Commands (.acf).")] = None,
    end: Annotated[float | None, typer.Option(help="End time, when there is no script.")] = None,
    steps: Annotated[int | None, typer.Option(help="Output steps, when there is no script; default: 100.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Local error instead of INTEGRATOR/ERROR.")] = None,
    skip_unsupported: Annotated[bool, typer.Option(help="Leave out what is not supported.")] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Prefix of the files written; default: the script's, or the model's name."),
    ] = None,
) -> None:
    """Run an ADAMS deck; write .req, .res, .msg and NetCDF."""
    with guarded():
        from gearmbs.adams import DeckError, read_script, run_deck

        if script is None and end is None:
            fail(f"give a script (.acf), or --end and --steps: gearmbs adams {model} --end 5 --steps 500")
        commands = read_script(script) if script is not None else None
        prefix = out or (commands.output(model) if commands else model.with_suffix(""))
        try:
            result = run_deck(
                model,
                commands,
                prefix,
                end=end,
                steps=steps,
                tol=tolerance,
                allow_unsupported=skip_unsupported,
                progress=sys.stderr.isatty(),
            )
        except DeckError as error:
            if error.result is not None and error.result.segments:
                typer.echo(f"wrote what was computed to {prefix}.req, .res, .msg, .nc")
            raise
        for message in result.messages:
            typer.echo(str(message))
        if not result.success:
            fail(f"{model}: the analysis did not finish; see {prefix}.msg")
        typer.echo(f"wrote {prefix}.req, .res, .msg, .nc")


if __name__ == "__main__":
    sys.exit(app())
