"""``gearmbs adams``: decks of ADAMS from the command line."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearmbs._command import end_interrupted, fail, guarded

if TYPE_CHECKING:
    from gearmbs.adams import Script, ViewModel


ReadFrom = Annotated[
    list[Path] | None, typer.Option(help="Folder whose files the model may read, too; may be given again.")
]


def adams(
    model: Annotated[Path, typer.Argument(help="ADAMS/Solver deck (.adm), or command file of View (.cmd).")],
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
    simulation: Annotated[
        str | None,
        typer.Option(help="Which simulation of a .cmd; default: all that it runs itself, else its last script."),
    ] = None,
    variable: Annotated[
        list[str] | None, typer.Option(help="NAME=VALUE of a design variable of a .cmd; may be given again.")
    ] = None,
    read_from: ReadFrom = None,
    to_deck: Annotated[
        Path | None, typer.Option(help="Write the deck of a .cmd here, and its simulations beside; run nothing.")
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="With --to-deck: replace files that are not its own, too.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Prefix of the files written; default: the script's, or the model's name."),
    ] = None,
) -> None:
    """Run an ADAMS deck, or a command file of View; write .req, .res, .msg and NetCDF."""
    with guarded(), ExitStack() as stack:
        from gearmbs.adams import load_routines, read_script, reading_from

        stack.enter_context(reading_from(*(read_from or [])))
        if not model.is_file():
            fail(f"there is no file '{model}'")
        viewed = _viewed(model, variable or [], to_deck is not None or simulation is not None)
        if viewed is not None and to_deck is not None:
            _written(viewed, to_deck, skip_unsupported, overwrite)
            return
        if simulation is not None and (script is not None or end is not None):
            fail(f"--simulation {simulation} has its own commands and end; give it, or a script, or --end")
        held: dict[str, Script] = {}
        if viewed is not None and script is None and end is None:
            held = _held(viewed, simulation)
        if script is None and end is None and not held:
            fail(f"give a script (.acf), or --end and --steps: gearmbs adams {model} --end 5 --steps 500")
        commands = read_script(script) if script is not None else None
        prefix = out or (commands.output(model) if commands is not None else model.with_suffix(""))
        # what the file runs last, and it alone, has the name of the model
        last = next(reversed(held), "")
        for name in held or [""]:
            _run(
                model,
                prefix if name == last else prefix.with_name(f"{prefix.name}_{name}"),
                model if viewed is None else viewed,
                held.get(name, commands),
                end=end,
                steps=steps,
                tol=tolerance,
                allow_unsupported=skip_unsupported,
                progress=sys.stderr.isatty(),
                redundancy=redundancy,
                routines=None if routines is None else load_routines(routines),
                check=check,
            )


def _run(model: Path, prefix: Path, given: Path | ViewModel, commands: Script | None, **options: Any) -> None:
    """Run a deck by a script; say what there is to say, and what was written."""
    from gearmbs.adams import DeckError, run_deck

    try:
        result = run_deck(given, commands, prefix, **options)
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


def _viewed(model: Path, variable: list[str], needed: bool) -> ViewModel | None:
    """Return the model of a command file of View, None of a deck."""
    from gearmbs.adams import read_view
    from gearmbs.adams.parse.reader import is_view, read_file

    if not is_view(read_file(model)):
        if variable or needed:
            fail(f"{model} is a deck; --variable, --simulation and --to-deck are for command files of View (.cmd)")
        return None
    values: dict[str, float] = {}
    for one in variable:
        name, equals, value = one.partition("=")
        try:
            values[name.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            fail(f"--variable {one}: give NAME=VALUE with a number")
    return read_view(model, values)


def _written(viewed: ViewModel, path: Path, skip_unsupported: bool, overwrite: bool) -> None:
    """Write the deck of a command file; say what it lacks, and what else a run would remark."""
    from gearmbs.adams.errors import folded

    files = viewed.save(path, allow_unsupported=skip_unsupported, overwrite=overwrite)
    for remark in folded(viewed.deck.diagnostics):
        typer.echo(str(remark))
    for file in files:
        typer.echo(f"wrote {file}")


def _held(viewed: ViewModel, name: str | None) -> dict[str, Script]:
    """Return a simulation of a command file by its name, or those that the file runs itself, or its last script."""
    from gearmbs.adams import DeckError

    wanted = name if name is not None else next(reversed(viewed.refused), None) if not viewed.scripts else None
    if wanted in viewed.refused and wanted not in viewed.scripts:
        raise DeckError(viewed.refused[wanted])
    if name is None:
        names = viewed.own or tuple(viewed.scripts)[-1:]
        return {one: viewed.scripts[one] for one in names}
    if name not in viewed.scripts:
        there = ", ".join(viewed.scripts) or "none"
        fail(f"--simulation {name}: it is not among those of the file: {there}")
    return {name: viewed.scripts[name]}


def plant(
    model: Annotated[Path, typer.Argument(help="ADAMS/Solver deck (.adm) with PINPUT and POUTPUT.")],
    script: Annotated[Path | None, typer.Argument(help="Commands (.acf) to carry out before.")] = None,
    pinput: Annotated[int | None, typer.Option(help="Id of the PINPUT, where there are several.")] = None,
    poutput: Annotated[int | None, typer.Option(help="Id of the POUTPUT, where there are several.")] = None,
    equilibrium: Annotated[bool, typer.Option("--equilibrium", help="Look for an equilibrium first.")] = False,
    skip_unsupported: Annotated[bool, typer.Option(help="Leave out what is not supported.")] = False,
    routines: Annotated[Path | None, typer.Option(help="Python file with functions for USER(...).")] = None,
    read_from: ReadFrom = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File for A, B, C, D: .mat or .npz; default: MODEL_plant.mat.")
    ] = None,
) -> None:
    """Linearise an ADAMS deck from its PINPUT to its POUTPUT; write A, B, C and D."""
    with guarded(), ExitStack() as stack:
        from gearmbs.adams import linear_plant, load_routines, reading_from
        from gearmbs.dae.analyses.plant import check_format

        stack.enter_context(reading_from(*(read_from or [])))
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
