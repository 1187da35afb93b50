"""``gearmbs analyse``, ``trend`` and ``compare``: records, measured or simulated, from the command line."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearmbs._command import check_kind, guarded, stage_bar
from gearmbs.signals.command_line import (
    Gaps,
    Rate,
    ReportFile,
    Speed,
    Units,
    bearings_asked,
    check_targets,
    hand_over,
    numbers,
    pair_of,
    parse_speed,
    sample_units,
    save_figures,
    save_tables,
    tooth_counts,
)
from gearmbs.signals.files.table import TABLE, titles

if TYPE_CHECKING:
    import xarray as xr


def analyse(
    file: Annotated[Path, typer.Argument(help=f"{titles()}.")],
    teeth: Annotated[str | None, typer.Option(help='Teeth of the wheel on the reference shaft; or "32,80".')] = None,
    rate: Rate = None,
    speed: Speed = None,
    speed_channel: Annotated[str | None, typer.Option(help="Channel that holds the speed.")] = None,
    units: Units = None,
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
    shaft_texts: Annotated[
        list[str] | None,
        typer.Option(
            "--shaft", help='Speed of another shaft by that given, e.g. 0.345; "none" if there is no other; repeat.'
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--speed-tolerance",
            help="Share by which the speed may be off in the diagnosis of bearings, e.g. 0.002; 0: exact.",
        ),
    ] = None,
    train: Annotated[
        Path | None, typer.Option(help="Drivetrain (TOML) whose bearings with rolling are looked for, with its shafts.")
    ] = None,
    planetary: Annotated[
        str | None, typer.Option(help='Planetary set, its ring at rest: teeth of sun, planets, ring, e.g. "17,19,55".')
    ] = None,
    planets: Annotated[int, typer.Option(help="How many planets.")] = 3,
    member: Annotated[str, typer.Option(help="Whose speed is given, of a planetary set: carrier or sun.")] = "carrier",
    gaps: Gaps = None,
    format: Annotated[
        str | None, typer.Option(help=f"Format of the file, if its name does not say: {', '.join(TABLE)}.")
    ] = None,
    tables: Annotated[Path | None, typer.Option(help="Folder for the tables as CSV.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Folder for spectrum and average as PNG and SVG.")] = None,
    out: ReportFile = None,
) -> None:
    """Analyse a record, measured or simulated: of gears, of bearings, of a planetary set, or of any machine."""
    with guarded(), stage_bar(file.name) as move:
        check_kind(file, "record")
        check_targets(out, tables=tables, figures=figures)
        if not bearing and train is None:
            _refuse_alone({"--band": band, "--shaft": shaft_texts, "--speed-tolerance": tolerance}, "--bearing 6205")
        from gearmbs.signals.files.simulated import read_any
        from gearmbs.signals.signal.labels import measured

        helpers = [name for name in (tacho, speed_channel) if name and name not in (channel or ())]
        signal = read_any(
            file,
            rate=rate,
            units=sample_units(units),
            channels=None if channel is None else [*channel, *helpers],
            gaps=gaps,
            format=format,
            teeth=None if teeth is None else tooth_counts(teeth),
            progress=lambda f, s: move(0.3 * f, s),
        )
        shaft = {
            "speed": parse_speed(speed),
            "tacho": tacho,
            "speed_channel": speed_channel,
            "pulses_per_rev": pulses,
        }
        told = any(shaft[name] is not None for name in ("speed", "tacho", "speed_channel"))
        signal, own_speed = measured(signal, channel or (), helpers, told)
        shaft["speed_channel"] = speed_channel if own_speed is None else own_speed
        if planetary is not None or (teeth is None and "planetary" in signal.attrs):
            if bearing or train is not None:
                raise ValueError(
                    "--bearing: bearings are not looked for beside a planetary set; leave --planetary out and give the "
                    "speed of the bearings' shaft with --speed"
                )
            done = _of_set(signal, shaft, planetary, planets, member)
        else:
            record = partial(_of_record, signal, wheel=wheel, harmonics=harmonics)
            done = record(shaft, progress=lambda f, s: move(0.3 + 0.7 * f, s))
            if bearing or train is not None:
                asked = bearings_asked(bearing or [], shaft_texts, train)
                asked |= {} if tolerance is None else {"tolerance": tolerance}
                done = _with_bearings(done, asked, band, record)
        try:
            files = save_tables(done.tables, tables)
            if figures is not None:
                files += save_figures(done.draw(), figures)
        except OSError:
            hand_over(done.text, out, [])
            raise
    hand_over(done.text, out, files)


def _refuse_alone(options: dict[str, Any], needed: str) -> None:
    """Refuse options that say something of another one which is not given."""
    for name, value in options.items():
        if value is not None:
            raise ValueError(f"{name}: {value} has no effect without {needed.split()[0]}; give {needed} with it")


@dataclass(frozen=True)
class Analysed:
    """What a record said: a report in words, its tables, and its figures, drawn when they are asked for."""

    signal: Any
    shaft: dict[str, Any]
    report: Any
    text: str
    tables: dict[str, Any]
    draw: Callable[[], dict[str, Any]]


def _of_record(
    signal: Any,
    shaft: dict[str, Any],
    wheel: int,
    harmonics: int,
    progress: Callable[[float, str], None] | None = None,
) -> Analysed:
    """Analyse a record of gears or of any machine."""
    from gearmbs.signals import analyse as analyse_signal

    report = analyse_signal(signal, wheel=wheel, harmonics=harmonics, progress=progress, **shaft)

    def draw() -> dict[str, Any]:
        from gearmbs.view import analysis_figures

        return analysis_figures(report, signal, **shaft)

    return Analysed(signal, shaft, report, report.to_markdown(), report.tables(), draw)


def _of_set(signal: Any, shaft: dict[str, Any], teeth: str | None, planets: int, member: str) -> Analysed:
    """Analyse the record of a planetary set, given by its teeth or known to the record."""
    from gearmbs.signals import analyse as analyse_signal

    own: dict[str, Any] = {"planetary": None}
    if teeth is not None:
        own = {"planetary": tooth_counts(teeth), "planets": planets, "member": member}
    report = analyse_signal(signal, **shaft, **own)
    draw = lambda: {"planetary": report.plot()}  # noqa: E731
    return Analysed(signal, shaft, report, report.to_markdown(), report.tables(), draw)


def _with_bearings(
    done: Analysed, asked: dict[str, Any], band: str | None, record: Callable[[dict[str, Any]], Analysed]
) -> Analysed:
    """Put the diagnosis of bearings before the report of a record, both at one speed.

    Where a told speed is wrong, the bearings' is that of the mesh line if no family of the shaft's orders tells it, and
    the record is analysed again at that of a family further off.
    """
    from gearmbs.signals import AnalysisReport, diagnose_bearing, shaft_phase
    from gearmbs.signals.rotation.shaft import speed_of_channel

    known = done.shaft["speed"]
    constant = isinstance(known, float) and done.shaft["tacho"] is None and done.shaft["speed_channel"] is None
    turns = known if isinstance(known, float) else done.report.speed
    asked["speed"] = asked.get("speed") if turns is None else turns
    if done.shaft["tacho"]:
        asked["phase"] = shaft_phase(done.signal, **done.shaft)
    elif done.shaft["speed_channel"]:
        asked["speed"] = speed_of_channel(done.signal, done.shaft["speed_channel"])
    elif not constant and known is not None:
        asked["speed"] = known
    asked["band"] = None if band is None else pair_of(band)
    one = done.signal.sel(channel=done.report.levels["channel"].values)
    bearings = diagnose_bearing(one, **asked)
    if constant and not bearings.speed_found and isinstance(done.report, AnalysisReport) and done.report.speed != known:
        bearings = diagnose_bearing(one, **asked | {"speed": done.report.speed})
    elif constant and bearings.speed_found and bearings.speed_remark and not isinstance(done.report, AnalysisReport):
        done = record(done.shaft | {"speed": math.tau * bearings.shaft})
    drawn = done.draw
    return replace(
        done, draw=lambda: drawn() | {"bearings": bearings.plot()},
        text=f"{bearings.to_markdown()}\n\n{done.text}", tables=done.tables | bearings.tables(),
    )  # fmt: skip


def trend(
    files: Annotated[
        list[Path], typer.Argument(help="A long record, or a folder, a pattern or many files as one series.")
    ],
    section: Annotated[str | None, typer.Option(help='Length of the pieces; default: "10 s" of one record.')] = None,
    teeth: Annotated[str | None, typer.Option(help='Teeth of the wheel on the reference shaft; or "32,80".')] = None,
    rate: Rate = None,
    speed: Speed = None,
    speed_channel: Annotated[str | None, typer.Option(help="Channel that holds the speed.")] = None,
    units: Units = None,
    channel: Annotated[list[str] | None, typer.Option(help="Channel to use; repeat for several; default: all.")] = None,
    harmonics: Annotated[int, typer.Option(help="Mesh harmonics to evaluate.")] = 3,
    gaps: Gaps = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="CSV file instead of the terminal.")] = None,
) -> None:
    """Follow features over time: of a long record piece by piece, or of many files, taken up again if interrupted."""
    with guarded(), stage_bar(files[0].name) as move:
        for file in files:
            check_kind(file, "record")
        check_targets(out)
        from gearmbs.files import write_whole
        from gearmbs.signals import series, trend_table
        from gearmbs.signals import trend as follow

        known: dict[str, Any] = {
            "teeth": None if teeth is None else tooth_counts(teeth),
            "rate": rate,
            "speed": parse_speed(speed),
            "units": sample_units(units),
            "channels": channel,
            "harmonics": harmonics,
            "gaps": gaps,
        }
        pattern = any(sign in str(files[0]) for sign in "*?[") and not files[0].exists()
        if len(files) > 1 or files[0].is_dir() or pattern:
            known["speed_channel"] = speed_channel
            chosen = files[0] if len(files) == 1 else files
            if out is not None:
                from gearmbs.signals.analysis.series import finished_files

                done, count = finished_files(chosen, out)
                if done:
                    typer.echo(f"taking up {done} finished of {count} files from {out.stem}.rows.jsonl", err=True)
            table = series(
                chosen,
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
    quantity: Annotated[
        str | None, typer.Option("--as", help="Convert the measured files: displacement, velocity or acceleration.")
    ] = None,
    band: Annotated[str | None, typer.Option(help='For it, e.g. "100 Hz, 5 kHz".')] = None,
    repair: Annotated[bool, typer.Option(help="Bridge drop-outs of a laser vibrometer.")] = False,
    full_scale: Annotated[str | None, typer.Option(help='With it: range of the laser, e.g. "0.5 m/s".')] = None,
    pixel: Annotated[str | None, typer.Option(help='Camera tracks: length of a pixel, e.g. "20 um".')] = None,
    tables: Annotated[Path | None, typer.Option(help="Folder for the tables as CSV.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Folder for the bars as PNG and SVG.")] = None,
    out: ReportFile = None,
) -> None:
    """Compare measured states with each other and with the model, as in the paper's section 4."""
    with guarded(), stage_bar("comparison") as move:
        check_targets(out, tables=tables, figures=figures)
        if not repair:
            _refuse_alone({"--full-scale": full_scale}, "--repair")
        from gearmbs.signals import compare as compare_signals
        from gearmbs.signals import point_track, repair_vibrometer
        from gearmbs.signals.files.simulated import parse_models, parse_states, read_any

        for item in (*experiment, *(model or ())):
            check_kind(Path(item.partition("=")[2] or item), "record")
        known = {
            "teeth": None if teeth is None else tooth_counts(teeth),
            "speed": parse_speed(speed),
            "rate": rate,
            "units": units,
            "gaps": gaps,
        }

        def record(path: Path) -> xr.DataArray:
            signal = read_any(path, **known)
            if pixel is not None:
                signal = point_track(signal, pixel)
            return repair_vibrometer(signal, full_scale=full_scale) if repair else signal

        measured = {
            load: {state: record(path) for state, path in states.items()}
            for load, states in parse_states(experiment).items()
        }
        report = compare_signals(
            measured,
            parse_models(model, component) if model else None,
            reference=reference,
            scope=scope,  # type: ignore[arg-type]
            channel=channel,
            wheel=wheel,
            quantity=quantity,  # type: ignore[arg-type]
            band=None if band is None else pair_of(band),
            progress=move,
        )
        files = save_tables(report.tables(), tables)
        if figures is not None:
            from gearmbs.view import comparison_figures

            files += save_figures(comparison_figures(report), figures)
    hand_over(report.to_markdown(), out, files)


# ``gearmbs waterfall``: what changes with the speed of records, as figures.


Orders = Annotated[str | None, typer.Option(help='Orders of the shaft to mark, e.g. "1,29,58".')]
Maximum = Annotated[str | None, typer.Option(help='Highest frequency shown, e.g. "6 kHz".')]
Folder = Annotated[Path, typer.Option("--out", "-o", help="Folder for the figures.")]


def waterfall(
    files: Annotated[list[Path], typer.Argument(help="One run-up or coast-down, or records of constant speed.")],
    speed: Annotated[
        list[str] | None,
        typer.Option(help='Speed, e.g. "1500 rpm", or a file with it over time; repeat, one for each file.'),
    ] = None,
    speed_channel: Annotated[str | None, typer.Option(help="Channel that holds the speed.")] = None,
    tacho: Annotated[str | None, typer.Option(help="Channel with the tacho pulses.")] = None,
    pulses: Annotated[float, typer.Option(help="Tacho pulses a revolution.")] = 1.0,
    channel: Annotated[str | None, typer.Option(help="Channel to draw; default: the first.")] = None,
    orders: Orders = None,
    steps: Annotated[int | None, typer.Option(help="Spectra over equal intervals of the speed of a run-up.")] = None,
    style: Annotated[str, typer.Option(help="lines or map.")] = "lines",
    maximum: Maximum = None,
    rate: Rate = None,
    units: Units = None,
    gaps: Gaps = None,
    out: Folder = Path("waterfall"),
) -> None:
    """Draw spectra over speed; of a run-up spectrogram, order map and tracked orders, too."""
    with guarded(), stage_bar(files[0].name) as move:
        for file in files:
            check_kind(file, "record")
        check_targets(out=out)
        from gearmbs.signals import waterfall as spectra_over_speed
        from gearmbs.signals.files.simulated import read_any
        from gearmbs.view import changing_speed_figures, waterfall_plot

        helpers = [name for name in (tacho, speed_channel) if name]
        chosen = None if channel is None else [channel, *helpers]
        known = [parse_speed(text) for text in speed or []]
        if steps is not None and len(files) > 1:
            raise ValueError(f"--steps divides the speed of one run-up; each of {len(files)} files gives one spectrum")
        if known and len(known) != len(files):
            raise ValueError(f"--speed is given {len(known)} times for {len(files)} files; give one for each")
        signals = []
        for k, file in enumerate(files):
            signals.append(read_any(file, rate=rate, units=sample_units(units), channels=chosen, gaps=gaps))
            move(0.5 * (k + 1) / len(files), "reading")
        marked = numbers(orders, "--orders")
        shown: dict[str, Any] = {"style": style, "maximum": maximum, "channel": channel}
        told: dict[str, Any] = {"tacho": tacho, "pulses_per_rev": pulses} if tacho else {}
        told |= {"speed_channel": speed_channel} if speed_channel else {}
        if len(signals) > 1:
            if helpers:
                signals, known = _with_mean_speeds(signals, known, helpers, told)
            data = spectra_over_speed(signals, known or None, maximum=maximum)
            figures = {"waterfall": waterfall_plot(data, orders=marked, **shown)}
        else:
            shaft: dict[str, Any] = {"speed": known[0]} if known else {}
            shaft |= told
            kept = _vibration(signals[0], helpers)
            if helpers:
                from gearmbs.signals import shaft_phase

                shaft = {"phase": shaft_phase(signals[0], **shaft)}
            data = spectra_over_speed(kept, steps=steps, maximum=maximum, **shaft)
            figures = changing_speed_figures(kept, orders=marked or None, title=files[0].name, **shaft)
            figures["waterfall"] = waterfall_plot(data, orders=marked, **shown)
        files_written = save_figures(figures, out)
    low, high = (float(data["speed"][k]) * 30.0 / math.pi for k in (0, -1))
    hand_over(f"{data.sizes['speed']} spectra from {low:.4g} to {high:.4g} rpm", None, files_written)


def _vibration(signal: xr.DataArray, helpers: list[str]) -> xr.DataArray:
    """Return a signal without the channels that tell its speed."""
    return signal.drop_sel(channel=[name for name in helpers if name in signal["channel"].values])


def _with_mean_speeds(
    signals: list[xr.DataArray], known: list[Any], helpers: list[str], told: dict[str, Any]
) -> tuple[list[xr.DataArray], list[float]]:
    """Return records without the channels that tell their speeds, and each record's mean speed, rad/s."""
    from gearmbs.signals import shaft_phase

    speeds = []
    for signal, given in zip(signals, known or [None] * len(signals), strict=True):
        phase = shaft_phase(signal, given, **told)
        span = float(phase["time"][-1] - phase["time"][0])
        speeds.append(float(phase[-1] - phase[0]) / span)
    return [_vibration(signal, helpers) for signal in signals], speeds
