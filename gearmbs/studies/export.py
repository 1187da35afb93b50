"""``gearmbs export``: cases, planetary sets and drivetrains of files as libraries that run without Python."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearmbs._command import guarded, kind_of

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


def export(
    file: Annotated[Path, typer.Argument(help="Case, planetary set or drivetrain in TOML.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Folder; default: beside the file.")] = None,
    target: Annotated[
        str,
        typer.Option(
            help="so: a shared library with a C header; fmu2, fmu3: an FMU by FMI 2.0 or 3.0; csv, modelica: tables of "
            "transmission error, stiffness and force of the meshes."
        ),
    ] = "so",
    t_end: Annotated[str | None, typer.Option(help='Latest time, e.g. "2 s"; default: the end of the record.')] = None,
    name: Annotated[str | None, typer.Option(help="Of the library; default: that of the mechanism.")] = None,
    processor: Annotated[
        str | None, typer.Option(help="A name of LLVM's, or native; default: any x86-64 with AVX2 and FMA.")
    ] = None,
    systems: Annotated[
        str, typer.Option(help="linux, windows, linux-arm64, with commas between; an FMU is for all of them.")
    ] = "linux",
    arrays: Annotated[bool, typer.Option("--arrays", help="Of fmu3: vectors as arrays, not one by one.")] = False,
    torques: Annotated[
        str | None, typer.Option(help='Of tables, on the driven wheel, e.g. "20 N m, 50 N m"; default: about the load.')
    ] = None,
) -> None:
    """Write a model as a library or an FMU that runs without Python, or its meshes as tables.

    A C compiler is needed here alone, for tables none.
    """
    with guarded():
        if target in TABLES:
            for path in write_tables(file, out or file.with_suffix(""), target, torques):
                typer.echo(f"wrote {path}")
            return
        if torques is not None:
            raise ValueError(f"--torques is of tables; give --target {' or '.join(TABLES)} with it, or leave it out")
        from gearmbs.native import export as exported

        mechanism, end, options = described_model(file)
        folder = out or file.with_suffix("")
        made = exported(
            mechanism, folder, target=target, t_end=t_end or end, name=name, processor=processor,
            systems=[part.strip() for part in systems.split(",") if part.strip()], arrays=arrays, **options,
        )  # fmt: skip
        for what, named in (("set", made.numbers), ("told", made.outputs)):
            typer.echo(f"can be {what}: {len(named)}")
        if made.held:
            typer.echo(f"note: these prescribe motions and keep their values: {', '.join(made.held)}", err=True)
        if made.left_out:
            typer.echo(f"note: left out, which a library does not tell: {', '.join(made.left_out)}", err=True)
        for library in dict.fromkeys(made.libraries.values()):
            typer.echo(f"wrote {library}")
