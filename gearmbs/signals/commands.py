"""``gearmbs analyse``, ``trend`` and ``compare``: records, measured or simulated, from the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gearmbs._command import guarded, stage_bar

Rate = Annotated[str | None, typer.Option(help='Sampling rate, Hz or "12.8 kHz", if the file does not name it.')]
Speed = Annotated[
    str | None,
    typer.Option(help='Shaft speed, e.g. "1780 rpm", or a file with the speed over time; default: from the GMF line.'),
]
Gaps = Annotated[str | None, typer.Option(help='Missing samples: "refuse", "interpolate" or "longest" stretch.')]
ReportFile = Annotated[Path | None, typer.Option("--out", "-o", help="Write the report here instead of printing it.")]


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
        if planetary is not None or (teeth is None and "planetary" in signal.attrs):
            own: dict[str, Any] = {"planetary": None}
            if planetary is not None:
                own = {"planetary": tooth_counts(planetary), "planets": planets, "member": member}
            of_set = analyse_signal(
                signal, speed=known, speed_channel=speed_channel, tacho=tacho, pulses_per_rev=pulses, **own
            )
            files = _save_tables(of_set.tables(), tables)
            if figures is not None:
                files += _save_figures({"planetary": of_set.plot()}, figures)
            _hand_over(of_set.to_markdown(), out, files)
            return
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
        if bearing or train is not None:
            from gearmbs.signals import diagnose_bearing, shaft_phase

            asked = bearings_asked(bearing or [], shaft, train)
            turns = known if isinstance(known, float) else report.speed
            if tacho is not None or speed_channel is not None or not isinstance(known, float | None):
                asked["phase"] = shaft_phase(
                    signal, known, tacho=tacho, pulses_per_rev=pulses, speed_channel=speed_channel
                )
            asked["speed"] = asked.get("speed") if turns is None else turns
            one = signal.sel(channel=report.levels["channel"].values)
            bearings = diagnose_bearing(one, band=None if band is None else pair_of(band), **asked)
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


def bearings_asked(texts: list[str], shafts: list[str] | None, train: Path | None) -> dict[str, Any]:
    """Return bearings, ratios of other shafts and, of a drivetrain, the speed, as `diagnose_bearing` takes them."""
    asked: dict[str, Any] = {"bearing": {}, "shafts": None}
    if train is not None:
        from gearmbs.drivetrain.description import read_description

        asked = read_description(train).train.kinematics.for_bearings()
    asked["bearing"] = {**asked["bearing"], **bearing_list(texts)}
    if shafts is not None:
        asked["shafts"] = [*(asked["shafts"] or ()), *shaft_ratios(shafts)]
    return asked


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
