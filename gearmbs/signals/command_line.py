"""What commands on records share: options, readers of their texts, and how results are handed over."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gearmbs._command import guarded

Rate = Annotated[str | None, typer.Option(help='Sampling rate, Hz or "12.8 kHz", if the file does not name it.')]
Speed = Annotated[
    str | None,
    typer.Option(help='Shaft speed, e.g. "1780 rpm", or a file with the speed over time; default: from the GMF line.'),
]
Units = Annotated[
    str | None, typer.Option(help='Units of the samples, e.g. "m/s^2", or of channels, "acc=g, n=rpm"; default: known.')
]
Gaps = Annotated[str | None, typer.Option(help='Missing samples: "refuse", "interpolate" or "longest" stretch.')]
ReportFile = Annotated[Path | None, typer.Option("--out", "-o", help="Write the report here instead of printing it.")]


def bearings_asked(texts: list[str], shafts: list[str] | None, train: Path | None) -> dict[str, Any]:
    """Return bearings, ratios of other shafts and, of a drivetrain, the speed, as `diagnose_bearing` takes them."""
    asked: dict[str, Any] = {"bearing": {}, "shafts": None}
    if train is not None:
        from gearmbs.drivetrain.description import read_description

        asked |= read_description(train).train.kinematics.for_bearings()
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


def sample_units(text: str | None) -> str | dict[str, str] | None:
    """Return the unit of a text such as "m/s^2", or those of channels, given as "acc=g, n=rpm"."""
    if text is None or "=" not in text:
        return text
    found = {}
    for part in text.split(","):
        name, _, unit = (piece.strip() for piece in part.rpartition("="))
        if not (name and unit):
            raise ValueError(f"--units {text!r}: {part.strip()!r} names no channel; write for example acc=g, n=rpm")
        found[name] = unit
    return found


def parse_speed(text: str | None) -> Any:
    """The speed (rad/s) that a text such as "1500 rpm" means, or the curve in the file that it names.

    The file may be of any format that is read. Of several columns beside the times the one is taken that is called
    speed or rpm, in the unit that its label names.

    Raises
    ------
    SignalError
        If the file has no such column, or its unit is not one of rotation.
    ValueError
        If the text is no speed.
    """
    if text is None:
        return None
    if not Path(text).is_file():
        from gearmbs.units import to_si

        return to_si(text, "angular speed", "--speed")
    from gearmbs.signals import SignalError, read_signal
    from gearmbs.signals.rotation.shaft import speed_of_channel
    from gearmbs.signals.signal.labels import key_of, name_and_unit
    from gearmbs.signals.signal.record import SHAFT_FREQUENCIES, SPEED_NAMES

    signal = read_signal(text)
    names = [str(c) for c in signal["channel"].values]
    if len(names) > 1:
        keys = [key_of(name_and_unit(name)[0])[0] for name in names]
        found = [n for n, k in zip(names, keys) if k in SPEED_NAMES | SHAFT_FREQUENCIES or "speed" in k or "rpm" in k]
        if len(found) != 1:
            raise SignalError(f"speed: {text} holds {names}; leave the column of the speed and that of the times")
        names = found
    try:
        curve = speed_of_channel(signal, names[0])
    except SignalError:
        unit = str(signal["units"].sel(channel=names[0]).values)
        source = signal.attrs.get("source", "the file")
        raise SignalError(
            f"speed: {source} has {names[0]!r} in {unit!r}; write its unit, rpm, Hz or rad/s, into its label, "
            f"'{names[0]} [rpm]'"
        ) from None
    return curve.assign_coords(time=signal["time"].values)


def tooth_counts(text: str) -> tuple[int, ...]:
    """Return the counts of a text such as "32" or "32,80"."""
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"--teeth is {text!r}; give a count, or both with a comma, for instance 32,80") from None


def check_targets(report: Path | None = None, **folders: Path | None) -> None:
    """Refuse, before the work, a report or folders of figures and tables, by their options, that cannot be written."""
    from gearmbs.files import check_place

    if report is not None:
        check_place(report.parent, 0)
    for name, folder in folders.items():
        if folder is None:
            continue
        if folder.is_file():
            raise NotADirectoryError(f"{folder}: is a file; name a folder (--{name})")
        check_place(folder, 0, option=f"--{name}")


def save_tables(tables: dict[str, Any], folder: Path | None) -> list[Path]:
    """Write each table as CSV into the folder, if one is given."""
    from gearmbs.files import write_whole

    written = []
    for name, table in tables.items() if folder is not None else ():
        assert folder is not None
        path = folder / f"{name}.csv"
        write_whole(path, table.to_csv(index=False))
        written.append(path)
    return written


def save_figures(figures: dict[str, Any], folder: Path) -> list[Path]:
    """Write each figure as PNG and SVG into the folder."""
    from gearmbs.view import save_figure

    return [path for name, figure in figures.items() for path in save_figure(figure, folder / name.replace(" ", "_"))]


def hand_over(report: str, out: Path | None, files: list[Path]) -> None:
    """Print a report or write it, and name the files written; print it, too, where it cannot be written."""
    if out is None:
        typer.echo(report)
    else:
        from gearmbs.files import write_whole

        with guarded():
            try:
                write_whole(out, report)
            except OSError:
                typer.echo(report)
                raise
        files = [out, *files]
    if files:
        typer.echo("\n".join(f"wrote {path}" for path in files), err=out is None)


def numbers(text: str | None, option: str) -> list[float]:
    """Return the numbers of a text such as "1,29,58", none of None."""
    try:
        return [] if text is None else [float(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"{option} is {text!r}; give numbers with commas, for instance 1,29,58") from None
