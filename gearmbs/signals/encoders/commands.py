"""``gearmbs transmission-error``: from the pulses of two encoders, on the command line."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearmbs._command import check_kind, guarded, stage_bar
from gearmbs.signals.command_line import ReportFile, check_targets, hand_over, save_figures, save_tables, tooth_counts
from gearmbs.signals.files.table import titles

if TYPE_CHECKING:
    from gearmbs.signals.encoders.pulses import PulseTrain


def transmission_error(
    runs: Annotated[
        list[str],
        typer.Argument(
            help='Pulses of both shafts, a column of times or counts each; "load=path" where loads differ, "@10 deg,0 '
            f'deg" behind the path where discs have been turned on their shafts. {titles()}.'
        ),
    ],
    base_radius: Annotated[str, typer.Option(help='Base radius of the driver, e.g. "41.76 mm".')],
    teeth: Annotated[str | None, typer.Option(help='Teeth of driver and driven, "29,29".')] = None,
    ratio: Annotated[
        str | None, typer.Option(help='Instead of teeth: speed of driver by that of driven, "108/24".')
    ] = None,
    mesh_order: Annotated[str | None, typer.Option(help='With it: meshes during a turn of the driver, "56/3".')] = None,
    lines: Annotated[
        str | None, typer.Option(help='Lines of the encoders, "1024,1024"; default: as the file says.')
    ] = None,
    columns: Annotated[
        str | None, typer.Option(help='Columns of driver and driven, "A,B"; default: the first two encoders.')
    ] = None,
    clock: Annotated[str | None, typer.Option(help='Clock of columns that count ticks, "20 MHz".')] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of times in columns that name none: s, ms, us or ns.")] = None,
    rate: Annotated[str | None, typer.Option(help="Sampling rate of sampled voltages, if the file is silent.")] = None,
    free_driver: Annotated[list[Path] | None, typer.Option(help="Pulses of the driver running free; repeat.")] = None,
    free_driven: Annotated[list[Path] | None, typer.Option(help="Pulses of the driven shaft alone; repeat.")] = None,
    mark_error: Annotated[
        float | None, typer.Option(help="RMS of the marks' errors by their pitch; default: from the record.")
    ] = None,
    probability: Annotated[float, typer.Option(help="Of the intervals.")] = 0.95,
    harmonics: Annotated[
        int | None, typer.Option(help="Highest mesh harmonic, also beyond half the lines where teeth are alike.")
    ] = None,
    accuracy: Annotated[
        float, typer.Option(help="Share of themselves that harmonics are wanted to; says how long others take.")
    ] = 0.02,
    tables: Annotated[Path | None, typer.Option(help="Folder for the tables as CSV.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Folder for the figures as PNG and SVG.")] = None,
    out: ReportFile = None,
) -> None:
    """Transmission error of two shafts from the pulses of their encoders, with what the marks leave open."""
    with guarded(), stage_bar("transmission error") as move:
        check_targets(out, tables=tables, figures=figures)
        from gearmbs.signals.encoders.transmission import CoupledRun, transmission_error_from_pulses

        texts = [_run(text) for text in runs]
        for path in [*(path for _, path, _ in texts), *(free_driver or ()), *(free_driven or ())]:
            check_kind(path, "record")
        known = {"lines": lines, "columns": columns, "clock": clock, "unit": unit, "rate": rate}
        coupled = []
        for k, (load, path, shift) in enumerate(texts):
            coupled.append(CoupledRun(*_both(path, **known), load=load, shift=shift))
            move(0.6 * (k + 1) / len(texts), "reading")
        free = {
            name: [_one(path, name, k, **known) for path in files or ()]
            for k, (name, files) in enumerate((("driver", free_driver), ("driven", free_driven)))
        }
        move(0.7, "transmission error")
        found = transmission_error_from_pulses(
            coupled,
            None if teeth is None else tooth_counts(teeth),
            base_radius=base_radius,
            ratio=_exact(ratio, "--ratio"),
            mesh_order=_exact(mesh_order, "--mesh-order"),
            free=free,
            mark_error=mark_error,
            probability=probability,
            harmonics=harmonics,
            accuracy=accuracy,
        )
        files = save_tables(found.tables(), tables)
        if figures is not None:
            drawn = {
                "transmission_error" + (f"_{load}" if len(found.loads) > 1 else ""): found.plot(load=load)
                for load in found.loads
            }
            files += save_figures(drawn, figures)
    hand_over(found.to_markdown(), out, files)


def _run(text: str) -> tuple[str, Path, tuple[Any, Any]]:
    """Return load, file and angles of the discs of a text "load=path@10 deg,0 deg"."""
    load, equals, rest = text.rpartition("=")
    path, at, angles = rest.partition("@")
    parts = [part.strip() for part in angles.split(",")] if at else [0.0, 0.0]
    if len(parts) != 2 or not path:
        raise ValueError(f"{text!r}: write load=path@10 deg,0 deg, with an angle for the disc of each shaft")
    return load if equals else "load", Path(path), (parts[0], parts[1])


def _exact(text: str | None, option: str) -> Fraction | None:
    try:
        return None if text is None else Fraction(text.replace(" ", ""))
    except (ValueError, ZeroDivisionError):
        raise ValueError(f"{option} is {text!r}; give a fraction of whole numbers, for instance 108/24") from None


def _split(text: str | None, option: str) -> list[str] | None:
    if text is None:
        return None
    parts = [part.strip() for part in text.split(",")]
    if len(parts) != 2:
        raise ValueError(f"{option} is {text!r}; give one for driver and driven each, with a comma")
    return parts


def _read(path: Path, lines: Any, columns: Any, **known: Any) -> dict[str, PulseTrain]:
    from gearmbs.signals.encoders.files import read_pulses
    from gearmbs.signals.encoders.result import SHAFTS

    counts, names = _split(lines, "--lines"), _split(columns, "--columns")
    try:
        whole = None if counts is None else [int(count) for count in counts]
    except ValueError:
        raise ValueError(f"--lines is {lines!r}; give whole numbers, for instance 1024,1024") from None
    if whole is not None and names is not None:
        return read_pulses(path, dict(zip(names, whole)), **known)
    if whole is not None:
        if whole[0] == whole[1]:
            return read_pulses(path, whole[0], **known)
        # the columns of the file, in the order of driver and driven
        own = list(read_pulses(path, whole[0], faults="keep", **known))
        own = list(SHAFTS) if set(SHAFTS) <= set(own) else own
        if len(own) != 2:
            raise ValueError(
                f"--lines {lines}: {path} has the columns {own}; say which have them with --columns {','.join(own[:2])}"
            )
        return read_pulses(path, dict(zip(own, whole)), **known)
    found = read_pulses(path, **known)
    return found if names is None else {name: found[name] for name in names if name in found}


def _both(path: Path, **known: Any) -> tuple[PulseTrain, PulseTrain]:
    from gearmbs.signals.encoders.result import SHAFTS

    trains = _read(path, **known)
    if known.get("columns") is None and set(SHAFTS) <= trains.keys():
        return trains[SHAFTS[0]], trains[SHAFTS[1]]
    if len(trains) != 2:
        raise ValueError(
            f"{path}: holds {len(trains)} columns of pulses, {list(trains)}; name the driver's and the driven shaft's "
            "with --columns A,B"
        )
    first, second = trains.values()
    return first, second


def _one(path: Path, name: str, shaft: int, **known: Any) -> PulseTrain:
    """Return the train of a shaft in a file of one that runs free: the only one, or that of its column."""
    columns = _split(known.pop("columns"), "--columns")
    trains = _read(path, columns=None, **known)
    wanted = columns[shaft] if columns is not None else name
    if len(trains) == 1:
        return next(iter(trains.values()))
    if wanted not in trains:
        raise ValueError(
            f"{path}: has the columns {list(trains)}; name that of the {name} with --columns driver,driven"
        )
    return trains[wanted]
