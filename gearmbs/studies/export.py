"""``gearmbs export``: cases, planetary sets and drivetrains of files as libraries that run without Python."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearmbs._command import guarded, kind_of
from gearmbs.wording import any_of, did_you_mean

if TYPE_CHECKING:
    from gearmbs.gears import GearPair
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
        return found.mechanism(), found.run_up + found.settling + found.duration, {"tol": found.used_tolerance}
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


TABLES = ("csv", "modelica")
"""Targets that are quasi-static tables of the meshes, and take no compiler."""


WHEELS = ("driver", "driven")
POINTS, POINTS_OF_TURNS = 100, 24
"""Phases over a mesh cycle of tables: of one cycle, and of the many of a turn, where faults are what counts."""


def described_pairs(path: Path) -> dict[str, GearPair]:
    """Return the gear pairs of the meshes that a file describes, by name.

    Raises
    ------
    ValueError
        For whatever is wrong with the file, and if its meshes are no tooth contact.
    """
    kind = kind_of(path)
    if kind == "planetary set":
        from gearmbs.studies.planetary import load_planetary

        gears = load_planetary(path).gears
        found: dict[str, Any] = {f"{path.stem}_{which}": gears.meshes(which)[0] for which in ("sun", "ring")}
    elif kind == "drivetrain":
        from gearmbs.studies.trains import load_train

        found = dict(load_train(path).train.pairs)
    else:
        from gearmbs.studies.case.case import load_case

        found = {path.stem: load_case(path).pair()}
    from gearmbs.gears import GearPair

    named: dict[str, GearPair] = {}
    known: dict[str, str] = {}
    for name, pair in found.items():
        if not isinstance(pair, GearPair):
            continue
        plain = re.sub(r"\W", "_", name)
        other = known.setdefault(plain.lower(), name)
        if other != name:
            raise ValueError(
                f"{path.name}: tables of the meshes {other!r} and {name!r} would be the same file, {plain!r}; rename "
                "one of them"
            )
        named[plain] = pair
    if not named:
        raise ValueError(f"{path.name} has no mesh of teeth in contact, of which tables could be made")
    return named


def write_tables(file: Path, folder: Path, target: str, torques: str | None) -> list[Path]:
    """Write the quasi-static tables of the meshes of a file; return the paths."""
    from gearmbs.gears import mesh_tables

    given = None if torques is None else [part.strip() for part in torques.split(",") if part.strip()]
    if given is None and kind_of(file) == "planetary set":
        raise ValueError(
            f"{file.name} is a planetary set, whose meshes share its torques as they run; give --torques of one mesh, "
            'on its driven wheel, such as "20 N m, 50 N m"'
        )
    written: list[Path] = []
    for name, pair in described_pairs(file).items():
        # faults come again after a turn of their wheel
        turns = {wheel.teeth for k, wheel in enumerate(pair.wheels) if any(f.wheel == WHEELS[k] for f in pair.faults)}
        cycles = math.lcm(*turns) if turns else 1
        tables = mesh_tables(pair, given, cycles=cycles, points=POINTS if cycles == 1 else POINTS_OF_TURNS)
        written += tables.to_csv(folder, name) if target == "csv" else [tables.to_modelica(folder, name)]
    return written


SHOW = "list"
"""Stands for a target or a processor where what there is is asked for."""
TARGETS = {
    "so": "a shared library with a C header",
    "fmu2": "an FMU for Co-Simulation by FMI 2.0",
    "fmu3": "the same by FMI 3.0",
    "csv": "tables of transmission error, stiffness and force of the meshes",
    "modelica": "a Modelica package of them",
}


def items_of(text: str | None) -> list[str] | None:
    """Return what stands between commas, those in brackets and quotes left alone.

    Examples
    --------
    >>> items_of('speed, mesh.load.fx, DX("a, b", G)')
    ['speed', 'mesh.load.fx', 'DX("a, b", G)']
    """
    if text is None:
        return None
    found = re.findall(r'(?:"[^"]*"|\([^()]*(?:\([^()]*\)[^()]*)*\)|[^,("])+', text)
    return [part.strip() for part in found if part.strip()]


def _listed(target: str, processor: str | None, systems: Sequence[str]) -> list[str]:
    """Return the lines of what there is, if targets or processors are asked for; refuse a target that there is not."""
    if target == SHOW:
        return [f"{name:<9} {what}" for name, what in TARGETS.items()]
    if target not in TARGETS:
        meant = did_you_mean(target, TARGETS, shown=repr, otherwise=f"choose {any_of(map(repr, TARGETS))}")
        raise ValueError(f"--target {target!r}: there is none of this name; {meant}")
    if processor != SHOW:
        return []
    from gearmbs.native.systems import NATIVE, processors_of, system_of

    return [NATIVE, *dict.fromkeys(one for name in systems for one in processors_of(system_of(name)))]


def export(
    file: Annotated[Path | None, typer.Argument(help="Case, planetary set or drivetrain in TOML.")] = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder; default: beside the file.")] = None,
    target: Annotated[
        str,
        typer.Option(
            help="so: a shared library with a C header; fmu2, fmu3: an FMU by FMI 2.0 or 3.0; csv, modelica: tables of "
            "transmission error, stiffness and force of the meshes; list: print these."
        ),
    ] = "so",
    t_end: Annotated[str | None, typer.Option(help='Latest time, e.g. "2 s"; default: the end of the record.')] = None,
    name: Annotated[str | None, typer.Option(help="Of the library; default: that of the mechanism.")] = None,
    inputs: Annotated[
        str | None, typer.Option(help="Of an FMU, what can be set that is an input, with commas between.")
    ] = None,
    outputs: Annotated[
        str | None,
        typer.Option(
            help='What is told, with commas between: outputs of the file, "mesh.transmission_error", "pin.reaction.fx" '
            "and their like, expressions; all: everything. Default: outputs of the file, without any everything."
        ),
    ] = None,
    processor: Annotated[
        str | None,
        typer.Option(help="A name of LLVM's, or native; default: any x86-64 with AVX2 and FMA; list: print them."),
    ] = None,
    systems: Annotated[
        str, typer.Option(help="linux, windows, linux-arm64, with commas between; an FMU is for all of them.")
    ] = "linux",
    arrays: Annotated[bool, typer.Option("--arrays", help="Of fmu3: vectors as arrays, not one by one.")] = False,
    lump: Annotated[
        bool, typer.Option("--lump", help="Integrate bodies that are fixed to each other as one, outputs are of all.")
    ] = False,
    fixed_pivots: Annotated[
        bool, typer.Option("--fixed-pivots", help="Last digits do not depend on where outputs have been looked at.")
    ] = False,
    torques: Annotated[
        str | None, typer.Option(help='Of tables, on the driven wheel, e.g. "20 N m, 50 N m"; default: about the load.')
    ] = None,
) -> None:
    """Write a model as a library or an FMU that runs without Python, or its meshes as tables.

    A C compiler is needed here alone, for tables none.
    """
    with guarded():
        if lines := _listed(target, processor, items_of(systems) or ()):
            typer.echo("\n".join(lines))
            return
        if file is None:
            raise ValueError("give a file that describes a case, a planetary set or a drivetrain")
        if target in TABLES:
            if lump or fixed_pivots:
                raise ValueError(f"--lump and --fixed-pivots are of libraries and FMUs; leave them out for {target}")
            if inputs is not None or outputs is not None:
                raise ValueError(f"--inputs and --outputs are of libraries and FMUs; leave them out for {target}")
            for path in write_tables(file, out or file.with_suffix(""), target, torques):
                typer.echo(f"wrote {path}")
            return
        if torques is not None:
            raise ValueError(f"--torques is of tables; give --target {' or '.join(TABLES)} with it, or leave it out")
        from gearmbs.native import export as exported
        from gearmbs.native.outputs import ALL

        mechanism, end, options = described_model(file)
        folder = out or file.with_suffix("")
        made = exported(
            mechanism, folder, target=target, t_end=t_end or end, name=name, inputs=items_of(inputs),
            outputs=ALL if outputs == ALL else items_of(outputs), processor=processor,
            systems=items_of(systems) or (), arrays=arrays, lump=lump, fixed_pivots=fixed_pivots, **options,
        )  # fmt: skip
        for what, named in (("set", made.numbers), ("told", made.outputs)):
            typer.echo(f"can be {what}: {len(named)}")
        if made.held:
            typer.echo(f"note: these prescribe motions and keep their values: {', '.join(made.held)}", err=True)
        for library in dict.fromkeys(made.libraries.values()):
            typer.echo(f"wrote {library}")
