"""``gearmbs analyse``, ``trend`` and ``compare``: records, measured or simulated, from the command line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from gearmbs._command import check_kind, guarded, stage_bar
from gearmbs.signals.command_parts import (
    Gaps,
    Rate,
    ReportFile,
    Speed,
    Units,
    bearings_asked,
    check_targets,
    hand_over,
    pair_of,
    sample_units,
    save_figures,
    save_tables,
    tooth_counts,
)


def analyse(
    file: Annotated[Path, typer.Argument(help="CSV, MAT, UFF, WAV, TDMS, LVM, NPY, Parquet, NetCDF or HDF5.")],
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
    train: Annotated[
        Path | None, typer.Option(help="Drivetrain (TOML) whose bearings with rolling are looked for, with its shafts.")
    ] = None,
    planetary: Annotated[
        str | None, typer.Option(help='Planetary set, its ring at rest: teeth of sun, planets, ring, e.g. "17,19,55".')
    ] = None,
    planets: Annotated[int, typer.Option(help="How many planets.")] = 3,
    member: Annotated[str, typer.Option(help="Whose speed is given, of a planetary set: carrier or sun.")] = "carrier",
    gaps: Gaps = None,
    format: Annotated[str | None, typer.Option(help="Format of the file, if its name does not say.")] = None,
    tables: Annotated[Path | None, typer.Option(help="Folder for the tables as CSV.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Folder for spectrum and average as PNG and SVG.")] = None,
    out: ReportFile = None,
) -> None:
    """Analyse a record, measured or simulated: of gears, of bearings, of a planetary set, or of any machine."""
    with guarded(), stage_bar(file.name) as move:
        check_kind(file, "record")
        check_targets(out, tables=tables, figures=figures)
        from gearmbs.signals.simulated import read_any
        from gearmbs.signals.speed_file import parse_speed

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
        if planetary is not None or (teeth is None and "planetary" in signal.attrs):
            done = _of_set(signal, shaft, planetary, planets, member)
        else:
            done = _of_record(signal, shaft, wheel, harmonics, lambda f, s: move(0.3 + 0.7 * f, s))
        if not done.of_set and (bearing or train is not None):
            done = _with_bearings(done, bearings_asked(bearing or [], shaft_texts, train), band)
        try:
            files = save_tables(done.tables, tables)
            if figures is not None:
                files += save_figures(done.draw(), figures)
        except OSError:
            hand_over(done.text, out, [])
            raise
    hand_over(done.text, out, files)


@dataclass(frozen=True)
class Analysed:
    """What a record said: a report in words, its tables, and its figures, drawn when they are asked for."""

    signal: Any
    shaft: dict[str, Any]
    report: Any
    text: str
    tables: dict[str, Any]
    draw: Callable[[], dict[str, Any]]
    of_set: bool = False


def _of_record(
    signal: Any, shaft: dict[str, Any], wheel: int, harmonics: int, progress: Callable[[float, str], None]
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
    return Analysed(signal, shaft, report, report.to_markdown(), report.tables(), draw, True)


def _with_bearings(done: Analysed, asked: dict[str, Any], band: str | None) -> Analysed:
    """Put the diagnosis of bearings before the report of a record."""
    from gearmbs.signals import diagnose_bearing, shaft_phase

    known = done.shaft["speed"]
    turns = known if isinstance(known, float) else done.report.speed
    varies = done.shaft["tacho"] is not None or done.shaft["speed_channel"] is not None
    if varies or not isinstance(known, float | None):
        asked["phase"] = shaft_phase(done.signal, **done.shaft)
    asked["speed"] = asked.get("speed") if turns is None else turns
    one = done.signal.sel(channel=done.report.levels["channel"].values)
    bearings = diagnose_bearing(one, band=None if band is None else pair_of(band), **asked)
    draw = lambda: done.draw() | {"bearings": bearings.plot()}  # noqa: E731
    return replace(
        done, draw=draw, text=f"{bearings.to_markdown()}\n\n{done.text}", tables=done.tables | bearings.tables()
    )


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
        from gearmbs.signals import series, trend_table
        from gearmbs.signals import trend as follow
        from gearmbs.signals.speed_file import parse_speed
        from gearmbs.view.files import write_whole

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
                from gearmbs.signals.series import finished_files

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
    tables: Annotated[Path | None, typer.Option(help="Folder for the tables as CSV.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Folder for the bars as PNG and SVG.")] = None,
    out: ReportFile = None,
) -> None:
    """Compare measured states with each other and with the model, as in the paper's section 4."""
    with guarded(), stage_bar("comparison") as move:
        check_targets(out, tables=tables, figures=figures)
        from gearmbs.signals import compare as compare_signals
        from gearmbs.signals.simulated import parse_models, parse_states, read_any
        from gearmbs.signals.speed_file import parse_speed

        for item in (*experiment, *(model or ())):
            check_kind(Path(item.partition("=")[2] or item), "record")
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
        files = save_tables(report.tables(), tables)
        if figures is not None:
            from gearmbs.view import comparison_figures

            files += save_figures(comparison_figures(report), figures)
    hand_over(report.to_markdown(), out, files)
