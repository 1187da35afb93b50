"""``gearmbs sweep`` and ``gearmbs campbell``: a case over many values, and the modes of a drivetrain over its speed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearmbs._command import case_bars, check_kind, guarded, stage_bar
from gearmbs.signals.command_parts import check_targets, hand_over, save_figures


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
        from gearmbs.studies.case import load_case
        from gearmbs.studies.limits import check_record
        from gearmbs.studies.store import check_place, record_size
        from gearmbs.studies.sweep import between, cases_of_sweep
        from gearmbs.studies.sweep import sweep as run_sweep

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
    """Draw natural frequencies of a drivetrain over its speed, with what excites them; list the critical speeds."""
    with guarded(), stage_bar(train.name) as move:
        check_kind(train, "drivetrain")
        if record is not None:
            check_kind(record, "record")
        check_targets(out=out)
        import numpy as np

        from gearmbs.drivetrain.description import read_description
        from gearmbs.signals import critical_speeds
        from gearmbs.studies.train_modes import train_campbell
        from gearmbs.units import to_si
        from gearmbs.view import campbell_plot

        top = to_si(maximum, "frequency", "--maximum")
        limits = sorted(to_si(text, "angular speed", "--speeds") for text in speeds or [])
        if len(limits) > 2:
            raise ValueError(f"--speeds is given {len(limits)} times; give the highest, or the lowest and the highest")
        turned = np.linspace(0.0 if len(limits) == 1 else limits[0], limits[-1], 13).tolist() if limits else None
        move(0.1, "modes")
        diagram = train_campbell(read_description(train).train, turned, harmonics=harmonics, maximum=top)
        measured = None
        if record is not None:
            from gearmbs.signals import waterfall
            from gearmbs.signals.simulated import read_any

            measured = waterfall(read_any(record), maximum=top)
        move(0.8, "drawing")
        files = save_figures({"campbell": campbell_plot(diagram, measured=measured, maximum=top)}, out)
        table = critical_speeds(diagram)
    hand_over(table.to_string(index=False, float_format="{:.5g}".format), None, files)
