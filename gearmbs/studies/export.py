"""``gearmbs export``: cases, planetary sets and drivetrains of files as libraries that run without Python."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearmbs._command import guarded, kind_of

if TYPE_CHECKING:
    from gearmbs.mechanism import Mechanism


def described_model(path: Path) -> tuple[Mechanism, float, dict[str, Any]]:
    """Return the mechanism that a file describes, when its record ends, s, and how accurately it is simulated.

    Raises
    ------
    ValueError
        For whatever is wrong with the file.
    """
    kind = kind_of(path)
    if kind == "planetary set":
        from gearmbs.studies.planetary import load_planetary

        found = load_planetary(path)
        return found.mechanism(), found.run_up + found.settling + found.duration, {"tol": found.tolerance}
    if kind == "drivetrain":
        from gearmbs.studies.trains import load_train

        described = load_train(path)
        train, run = described.train, described.run
        options = {"tol": run.tolerance, "rate_scale": train.rate_scale}
        return train.build(), train.run_up + run.settling + run.duration, options
    from gearmbs.studies.case.case import load_case
    from gearmbs.studies.run.simulation import case_mechanism

    case = load_case(path)
    operation = case.operation
    options = {"tol": case.tolerance, "rate_scale": operation.top_speed * case.gears.teeth[0]}
    return case_mechanism(case), operation.run_up + operation.settling + operation.longest, options


def export(
    file: Annotated[Path, typer.Argument(help="Case, planetary set or drivetrain in TOML.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder; default: beside the file.")] = None,
    target: Annotated[
        str, typer.Option(help="so: a shared library with a C header; fmu2, fmu3: an FMU by FMI 2.0 or 3.0.")
    ] = "so",
    t_end: Annotated[str | None, typer.Option(help='Latest time, e.g. "2 s"; default: the end of the record.')] = None,
    name: Annotated[str | None, typer.Option(help="Of the library; default: that of the mechanism.")] = None,
    processor: Annotated[
        str | None, typer.Option(help="A name of LLVM's, or native; default: any x86-64 with AVX2 and FMA.")
    ] = None,
) -> None:
    """Write a model as a library or an FMU that runs without Python; a C compiler is needed here alone."""
    with guarded():
        from gearmbs.native import export as exported

        mechanism, end, options = described_model(file)
        folder = out or file.with_suffix("")
        made = exported(mechanism, folder, target=target, t_end=t_end or end, name=name, processor=processor, **options)
        for what, given in (("set", made.numbers), ("told", made.outputs)):
            typer.echo(f"can be {what}: {len(given)}")
        if made.left_out:
            why = "they count angles or look at frames of bodies that deform"
            typer.echo(f"note: left out, for {why}: {', '.join(made.left_out)}", err=True)
        typer.echo(f"wrote {made.library}")
