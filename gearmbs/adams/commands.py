"""``gearmbs adams``: decks of ADAMS from the command line."""

from __future__ import annotations

import dataclasses
import json
import sys
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from gearmbs._command import end_interrupted, fail, guarded
from gearmbs.dae.problem import ModelError
from gearmbs.gears import FlankFriction, GearPair
from gearmbs.mechanism.contacts import Coulomb, Impact

# Gear pairs in decks: as comments, from which the very pair is built again, and as the laws of a CONTACT.
#
# The comments stand before the CONTACT of the pair's wheels. Other programs pass over them.


MARK = "gearmbs pair:"
"""What such a comment begins with."""
WIDTH = 100
KIND = "kind of object"


@cache
def known() -> dict[str, type]:
    """Return the classes that a pair is made of, by name."""
    import gearmbs.gears as gears
    from gearmbs.gears import faults, modifications

    found: dict[str, type] = {}
    for module in (gears, faults, modifications):
        names = getattr(module, "__all__", None) or dir(module)
        things = (getattr(module, name) for name in names)
        found |= {t.__name__: t for t in things if isinstance(t, type) and is_dataclass(t)}
    return found


def pair_comments(pair: GearPair) -> list[str]:
    """Return a pair as the texts of comments.

    Raises
    ------
    ValueError
        If it holds an object of a class that is not the package's own.
    """
    # blanks at the end of a line would not survive every editor
    text = json.dumps(_held(pair), separators=(",", ":")).replace(" ", "\\u0020")
    return [f"{MARK}{text[k : k + WIDTH]}" for k in range(0, len(text), WIDTH)]


def pair_of(text: str) -> GearPair:
    """Return the pair that comments describe; ``text`` is what they hold behind their marks.

    Raises
    ------
    ValueError
        If they are not whole.
    """
    try:
        pair = _built(json.loads(text))
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"the gear pair in the comments before it is not whole: {error}") from error
    if not isinstance(pair, GearPair):
        raise ValueError(f"the comments before it describe a {type(pair).__name__}, not a gear pair")
    return pair


def _held(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        name = type(value).__name__
        if known().get(name) is not type(value):
            raise ValueError(f"{name} is a class of your own, which a deck cannot hold")
        return {KIND: name} | {f.name: _held(getattr(value, f.name)) for f in fields(value) if f.init}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (tuple, list)):
        return [_held(one) for one in value]
    if isinstance(value, (bool, int, str)) or value is None:
        return value
    return float(value)


def _built(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_built(one) for one in value)
    if not isinstance(value, dict):
        return value
    name = value.pop(KIND)
    if name not in known():
        raise ValueError(f"{name} is not known")
    return known()[name](**{key: _built(one) for key, one in value.items()})


def normal_law_of(name: str, pair: GearPair) -> Impact:
    """Return the normal law of a pair of teeth as that of solids.

    Raises
    ------
    ModelError
    """
    law = pair.contact
    if law.kind == "hunt-crossley":
        raise ModelError(f"gear contact '{name}': the law {law.kind!r} has no form in ADAMS; use ContactLaw.impact")
    return Impact(float(law.stiffness), law.exponent, float(law.damping), float(law.depth))


def friction_of(friction: FlankFriction) -> Coulomb | None:
    """Return the friction of flanks as that of solids; the smooth law by its coefficient and speed."""
    if friction.kind == "none":
        return None
    if friction.kind == "smooth":
        return Coulomb(friction.dynamic, friction.dynamic, friction.static_speed, friction.static_speed)
    return Coulomb(friction.static, friction.dynamic, friction.static_speed, friction.dynamic_speed)


def with_laws(pair: GearPair, normal: Impact, friction: Coulomb | None) -> GearPair:
    """Return a pair with the laws of a CONTACT where they are no longer those that were written."""
    written = normal_law_of("", pair)
    if not _alike(dataclasses.astuple(written), dataclasses.astuple(normal)):
        law = dataclasses.replace(
            pair.contact, kind="impact", stiffness=normal.stiffness, exponent=normal.exponent, damping=normal.damping,
            depth=normal.full_depth,
        )  # fmt: skip
        pair = pair.with_changes(contact=law)
    old = friction_of(pair.friction)
    same = (old is None) == (friction is None)
    if same and old is not None and friction is not None:
        same = _alike(tuple(old.reals()), tuple(friction.reals()))
    if not same:
        changed = FlankFriction.none()
        if friction is not None:
            static, dynamic, stick, slip = friction.reals()
            changed = FlankFriction(static, dynamic, stick, slip)
        pair = pair.with_changes(friction=changed)
    return pair


def _alike(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Whether numbers differ by no more than their way through the deck's units makes them."""
    return all(abs(x - y) <= 1e-12 * max(abs(x), abs(y)) for x, y in zip(a, b))


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
