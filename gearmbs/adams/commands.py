"""``gearmbs adams``: decks of ADAMS from the command line."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from gearmbs._command import end_interrupted, fail, guarded


def adams(
    model: Annotated[Path, typer.Argument(help="ADAMS/Solver deck (.adm).")],
    script: Annotated[Path | None, typer.Argument(help="Commands (.acf).")] = None,
    end: Annotated[float | None, typer.Option(help="End time, when there is no script.")] = None,
    steps: Annotated[int | None, typer.Option(help="Output steps, when there is no script; default: 100.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Local error instead of INTEGRATOR/ERROR.")] = None,
    skip_unsupported: Annotated[bool, typer.Option(help="Leave out what is not supported.")] = False,
    routines: Annotated[
        Path | None, typer.Option(help="Python file with functions for USER(...), such as sfosub(call).")
    ] = None,
    redundancy: Annotated[
        str, typer.Option(help="Redundant constraints: keep what ADAMS keeps (adams), or what stands first (declared).")
    ] = "adams",
    check: Annotated[
        bool | None,
        typer.Option(help="Solve motions again at a hundredth of ERROR and compare; default: if that is quick."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Prefix of the files written; default: the script's, or the model's name."),
    ] = None,
) -> None:
    """Run an ADAMS deck; write .req, .res, .msg and NetCDF."""
    with guarded():
        from gearmbs.adams import DeckError, load_routines, read_script, run_deck

        if not model.is_file():
            fail(f"there is no file '{model}'")
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
                redundancy=redundancy,
                routines=None if routines is None else load_routines(routines),
                check=check,
            )
        except DeckError as error:
            if error.result is not None and error.result.segments:
                typer.echo(f"wrote what was computed to {', '.join(map(str, error.result.files(prefix)))}")
            raise
        except KeyboardInterrupt as interrupt:
            partial = getattr(interrupt, "result", None)
            if partial is None:
                end_interrupted(f"the simulation of {model} was interrupted; files that were not whole are not there")
            result = partial
        for message in result.messages:
            typer.echo(str(message))
        if result.interrupted:
            end_interrupted(f"wrote {', '.join(str(path) for path in result.files(prefix))}")
        if not result.success:
            fail(f"{model}: the analysis did not finish; see {prefix}.msg")
        typer.echo(f"wrote {prefix}.req, .res, .msg, .nc")


def plant(
    model: Annotated[Path, typer.Argument(help="ADAMS/Solver deck (.adm) with PINPUT and POUTPUT.")],
    script: Annotated[Path | None, typer.Argument(help="Commands (.acf) to carry out before.")] = None,
    pinput: Annotated[int | None, typer.Option(help="Id of the PINPUT, where there are several.")] = None,
    poutput: Annotated[int | None, typer.Option(help="Id of the POUTPUT, where there are several.")] = None,
    equilibrium: Annotated[bool, typer.Option("--equilibrium", help="Look for an equilibrium first.")] = False,
    skip_unsupported: Annotated[bool, typer.Option(help="Leave out what is not supported.")] = False,
    routines: Annotated[Path | None, typer.Option(help="Python file with functions for USER(...).")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File for A, B, C, D: .mat or .npz; default: MODEL_plant.mat.")
    ] = None,
) -> None:
    """Linearise an ADAMS deck from its PINPUT to its POUTPUT; write A, B, C and D."""
    with guarded():
        from gearmbs.adams import linear_plant, load_routines
        from gearmbs.dae.analyses.plant import check_format

        path = check_format(out or model.with_name(f"{model.stem}_plant.mat"))
        found = linear_plant(
            model,
            script,
            pinput=pinput,
            poutput=poutput,
            at="equilibrium" if equilibrium else "initial",
            allow_unsupported=skip_unsupported,
            routines=None if routines is None else load_routines(routines),
        )
        typer.echo(found.table())
        typer.echo(f"wrote {found.save(path)}")
