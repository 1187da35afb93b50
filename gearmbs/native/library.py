"""Models as shared libraries: what they are made of, compiled with the C compiler of the system."""

from __future__ import annotations

import hashlib
import math
import re
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

import gearmbs
from gearmbs.dae.problem import INPUT, PARAMETER, ModelError, Number
from gearmbs.files import write_whole
from gearmbs.kernels import PLAIN
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.bodies import markers_kept
from gearmbs.mechanism.solve.simulator import Simulator
from gearmbs.mechanism.solve.told import Begun
from gearmbs.native.asked import Told
from gearmbs.native.fmu import Description, range_of, variables_of, widths_of, write_fmu
from gearmbs.native.kernels import Kernels
from gearmbs.native.memory import Memory, Motions, memory_of
from gearmbs.native.outputs import chosen_outputs
from gearmbs.native.systems import SYSTEMS, System, c_compiler, check_processor, system_of
from gearmbs.wording import any_of, did_you_mean, warn

if TYPE_CHECKING:
    from gearmbs.mechanism.solve.keywords import SimulatorOptions
    from gearmbs.units import QuantityLike

TARGETS = {"so": None, "fmu2": "2.0", "fmu3": "3.0"}
"""What can be written: a library, or an FMU of a version of FMI."""
SOURCES = {"so": (), "fmu2": ("fmu.c", "fmi2.c"), "fmu3": ("fmu.c", "fmi3.c")}
"""Sources beside those of every library."""
HEADERS = ("gearmbs.h", "model.h", "fmu.h")
_BLOCK = {
    ".so": '__asm__(".section .rodata\\n.balign 64\\n.global gearmbs_block\\n.hidden gearmbs_block\\n"\n'
    '        "gearmbs_block:\\n.incbin \\"block.bin\\"\\n.previous\\n");',
    ".dll": '__asm__(".section .rdata,\\"dr\\"\\n.balign 64\\n.global gearmbs_block\\n"\n'
    '        "gearmbs_block:\\n.incbin \\"block.bin\\"\\n.text\\n");',
}
"""How the memory of a run gets into a library, by the ending of its name."""
FEWEST_ZEROS = 256
"""Zeros in a row that are not written to the library: a piece of memory takes 16 bytes in its list."""
MOTION_ORDERS = 2
"""Times that an input which prescribes a motion is integrated at most: an acceleration, to a position."""
FLAGS = ("-O2", "-std=c11", "-fvisibility=hidden", "-ffp-contract=off", "-Wall", "-Wextra")


@dataclass(frozen=True)
class Exported:
    """A library that was made.

    Attributes
    ----------
    folder, library : Path
        Where it is, and the library or FMU.
    libraries : dict of str to Path
        Libraries by the system they are for, or the FMU, which holds those of all.
    numbers, outputs : dict of str to str
        What can be set and what is told, with their units, in the order of the library.
    left_out : list of str
        Outputs of the mechanism that the library does not tell.
    held : list of str
        Inputs and parameters of the mechanism that cannot be set, and keep their values: they prescribe positions,
        which cannot jump, or motions of a run with breakpoints or of bodies that are lumped.
    processor : str
        What it runs on, of the first system.
    """

    folder: Path
    library: Path
    libraries: dict[str, Path]
    numbers: dict[str, str]
    outputs: dict[str, str]
    left_out: list[str]
    held: list[str]
    processor: str


def export(
    model: Mechanism | Simulator,
    folder: str | Path,
    *,
    target: str = "so",
    t_end: QuantityLike | None = None,
    name: str | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[Any] | str | None = None,
    processor: str | None = None,
    systems: Sequence[str] = ("linux",),
    compiler: str | None = None,
    arrays: bool = False,
    report: Callable[[str], None] | None = None,
    **options: Unpack[SimulatorOptions],
) -> Exported:
    """Write a model as a shared library with a C header, which needs neither Python nor a compiler where it is used.

    Parameters
    ----------
    model : Mechanism or Simulator
        A simulator is exported as it stands.
    folder : str or Path
        Where the library, its header and an example are written, or the FMU; it is made.
    target : {"so", "fmu2", "fmu3"}
        A shared library, or an FMU for Co-Simulation by FMI 2.0 or 3.0.
    t_end : float or str, optional
        Latest time that can be asked for, s; needed for a mechanism. The first step depends on it.
    name : str, optional
        Of the model and its library; default: that of the mechanism.
    inputs : sequence of str, optional
        Of an FMU, names of what can be set that are its inputs; all else are tunable parameters. Default: the inputs of
        the mechanism.
    outputs : sequence or str, optional
        Outputs of the mechanism by name, expressions, and quantities as `gearmbs.Mechanism.output` takes them, of one
        number each, or by the names that they have by default: "mesh.load.fx", "mesh.transmission_error".
        Default: the outputs of the mechanism, or if it has none all motions, loads, diagnostics, transmission errors
        and reactions. "all": both.
    processor : str, optional
        A name of LLVM's, or "native" for that of this machine. Default: any x86-64 with AVX2 and FMA, and of other
        machines this one.
    systems : sequence of {"linux", "windows", "linux-arm64"}
        What libraries are made for: this system, Windows on x86-64, Linux on 64-bit ARM processors. An FMU holds those
        of all.
    compiler : str, optional
        Command of the C compiler. Default: cc, gcc or clang, whichever there is, or that of the package ziglang; for
        other systems a GNU compiler for them, or ziglang.
    arrays : bool
        Whether an FMU of FMI 3.0 has components of vectors as arrays, and not one by one.
    report : callable, optional
        Called with the name of each kernel that is about to be compiled.
    **options
        Of `gearmbs.Simulator`, for a mechanism.

    Returns
    -------
    Exported

    Raises
    ------
    ModelError
        If there is no C compiler, something of the model is in Python, or an output cannot be told.

    Warns
    -----
    UserWarning
        If outputs that nobody has asked for by name are left out, with the reason for each.
    """
    if target not in TARGETS:
        raise ModelError(f"target = {target!r}; choose {any_of(list(TARGETS))}")
    if inputs is not None and TARGETS[target] is None:
        raise ModelError("inputs: a library takes all numbers alike; leave them out, or choose 'fmu2' or 'fmu3'")
    if arrays and target != "fmu3":
        raise ModelError(f"arrays: target {target!r} has none; leave it out, or choose 'fmu3'")
    if PLAIN:
        raise ModelError("export: libraries are made by the compiler's own mode; unset GEARMBS_COMPILER")
    if isinstance(model, Mechanism):
        if t_end is None:
            raise ModelError("t_end: an exported model has a latest time that can be asked for; give it, s")
        settings: SimulatorOptions = {"lump": False, **options}
        model = Simulator(model, t_end, records=False, **settings)
    elif t_end is not None or options:
        raise ModelError("a simulator has its end and options already; give t_end and options with a mechanism")
    asked = {name: system_of(name) for name in systems}
    if not asked or (target == "fmu2" and not all(one.folders[0] for one in asked.values())):
        raise ModelError(
            f"systems = {list(systems)!r}: target {target!r} is for others; choose of {any_of(list(SYSTEMS))}"
        )
    if processor is not None:
        for one in asked.values():
            check_processor(processor, one)
    commands = {name: c_compiler(compiler, one) for name, one in asked.items()}
    begun = model.begun()
    title = name or begun.system.mechanism.name
    numbers = {
        name: number
        for name, number in begun.problem.numbers.items()
        if _can_be_set(number, begun.run.state.stops.size > 0 or begun.members is not None)
    }
    kernels = Kernels(begun, any(number.prescribes for number in numbers.values()))
    m = begun.system.mechanism
    with markers_kept((m.ground, *m.bodies.values())):
        told, left = chosen_outputs(model, begun, list(numbers), outputs)
        names = ["time", *numbers, *(one.name for one in told)]
        for twice in {name for name in names if names.count(name) > 1}:
            raise ModelError(
                f"output {twice!r}: the name is given twice; leave one of the two out, or give it another name"
            )
        memory = memory_of(begun, numbers, told, kernels.number)
    kinds = _kinds(numbers, inputs)
    known = {
        key: (kinds[key], n.unit, n.value(begun.run.state.rdata, begun.point.t), n.allowed)
        for key, n in numbers.items()
    }
    variables = variables_of(known, told, arrays)
    processors = {name: processor or one.processor for name, one in asked.items()}
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    stem = re.sub(r"\W+", "_", title).strip("_") or "model"
    with tempfile.TemporaryDirectory(prefix="gearmbs-") as rooms:
        texts, token = _texts(begun, title, memory, numbers, told, model.t_end, widths_of(variables))
        made: dict[str, Path] = {}
        for name, system in asked.items():
            room = Path(rooms, name)
            room.mkdir()
            made[name] = _compile(
                room / f"{stem}{system.ending}", commands[name], SOURCES[target], kernels, processors[name], system,
                memory, texts, report or _silent,
            )  # fmt: skip
        version = TARGETS[target]
        if version is None:
            libraries = {
                name: write_whole(folder / f"{stem}{_ending(name, asked)}", one.read_bytes())
                for name, one in made.items()
            }
            for path in libraries.values():
                path.chmod(0o755)
            for file in ("gearmbs.h", "example.c", "example.cpp"):
                (folder / file).write_bytes(_source(file))
        else:
            described = Description(
                title, stem, token, f"gearmbs {gearmbs.__version__}", float(begun.point.t), model.t_end, variables
            )
            places = {
                f"{asked[name].folders[version == '3.0']}/{stem}{asked[name].ending}": made[name] for name in made
            }
            libraries = dict.fromkeys(made, write_fmu(folder / f"{stem}.fmu", described, version, places))
    if left:
        reasons = "; ".join(f"{one!r}: {why}" for one, why in left.items())
        warn(f"export: without outputs that a library cannot tell: {reasons}")
    units = {key: number.unit for key, number in numbers.items()}
    held = [key for key in begun.problem.numbers if key not in numbers]
    outputs_told = {one.name: one.unit for one in told}
    first = next(iter(libraries))
    return Exported(folder, libraries[first], libraries, units, outputs_told, list(left), held, processors[first])


def _kinds(numbers: dict[str, Number], inputs: Sequence[str] | None) -> dict[str, str]:
    """Return of each number whether it is an input or a parameter of an FMU."""
    if inputs is None:
        return {name: number.kind for name, number in numbers.items()}
    for name in inputs:
        if name not in numbers:
            meant = did_you_mean(name, numbers, shown=repr, otherwise=f"these can: {', '.join(numbers) or 'none'}")
            raise ModelError(f"inputs: {name!r} cannot be set; {meant}")
    return {name: INPUT if name in inputs else PARAMETER for name in numbers}


def _ending(name: str, asked: dict[str, System]) -> str:
    """Return the end of the name of a library: of one of two with the same ending it tells the system."""
    ending = asked[name].ending
    alone = [one.ending for one in asked.values()].count(ending) == 1
    return ending if alone or name == "linux" else f".{name}{ending}"


def _can_be_set(number: Number, holds_motions: bool) -> bool:
    """Return whether a library takes other values of a number: not of what is a position."""
    if not number.prescribes:
        return all(place.order == 0 for place in number.places)
    orders = [order for _, order in number.prescribes]
    return number.kind == INPUT and not holds_motions and all(0 < order <= MOTION_ORDERS for order in orders)


def _silent(name: str) -> None:
    """Tell nothing of a kernel."""


def _source(name: str) -> bytes:
    return resources.files("gearmbs.native").joinpath("source", name).read_bytes()


def _text(value: str) -> str:
    """Return a text as a literal of C."""
    return (
        '"' + "".join(chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}" for b in value.encode()) + '"'
    )


def _number(value: float) -> str:
    """Return a number as C writes it."""
    return repr(value) if math.isfinite(value) else f"{'-' if value < 0.0 else ''}HUGE_VAL"


def _array(kind: str, name: str, items: Sequence[Any]) -> str:
    """Return an array of C; one of nothing holds a zero."""
    return f"static {kind} {name}[] = {{{', '.join(map(str, items)) or '0'}}};"


def pieces_of(block: np.ndarray) -> np.ndarray:
    """Return the parts of a block of memory that are not zeros alone.

    Parameters
    ----------
    block : ndarray of uint8

    Returns
    -------
    ndarray of int64, shape (pieces, 2)
        Where each begins and ends.
    """
    at = np.flatnonzero(block)
    gaps = np.flatnonzero(np.diff(at) > FEWEST_ZEROS)
    first, last = at[np.append(0, gaps + 1)], at[np.append(gaps, len(at) - 1)]
    return np.stack([first, last + 1], axis=1).astype(np.int64)


def _texts(
    begun: Begun, title: str, memory: Memory, numbers: dict, told: list[Told], t_end: float, widths: list[int]
) -> tuple[str, str]:
    """Return the part of the model's description that does not depend on its objects, and a token for all of it."""
    layout = memory.layout
    digest = hashlib.sha256(layout.block.tobytes() + repr(memory[1:]).encode()).hexdigest()[:16]
    names = {
        "number_names": list(numbers), "number_units": [n.unit for n in numbers.values()],
        "output_names": [one.name for one in told], "output_units": [one.unit for one in told],
        "unknown_names": list(begun.problem.names),
    }  # fmt: skip
    lines = [_array("const char *const", key, [_text(text) for text in texts]) for key, texts in names.items()]
    lines.append(_array("const int64_t", "inside", layout.inside.tolist()))
    lines.append(_array("const int64_t", "functions", layout.functions.ravel().tolist()))
    pieces = pieces_of(layout.block)
    lines.append(_array("const int64_t", "pieces", pieces.ravel().tolist()))
    lines.append(_array("const int64_t", "widths", widths))
    ranges = [range_of(number) for number in numbers.values()]
    for key, bounds in (("least", [least for least, _ in ranges]), ("most", [most for _, most in ranges])):
        lines.append(_array("const double", key, [_number(bound) for bound in bounds]))
    token = hashlib.sha256("\n".join([digest, title, *lines]).encode()).hexdigest()[:32]
    fields = {
        "name": _text(title), "digest": _text(digest), "token": _text(token),
        "t_start": repr(float(begun.point.t)), "t_end": repr(float(t_end)),
        "block": layout.block.size, "state": layout.state, "size": layout.size,
        "piece_count": len(pieces), "pieces": "pieces", "widths": "widths",
        "inside_count": len(layout.inside), "function_count": len(layout.functions),
        "inside": "inside", "functions": "functions", "kernels": "kernels",
        "late_count": "LATE", "late_names": "late_names", "late": "late",
        **memory.structs, **memory.members,
        "counts": int(any(one.counted.starts for one in told)),
        "numbers": len(numbers), "outputs": len(told), "unknowns": begun.problem.n,
        **{key: key for key in names}, "least": "least", "most": "most",
        "motions": "0" if memory.motions is None else "&motions",
    }  # fmt: skip
    if memory.motions is not None:
        lines += _motions(begun, memory.motions, numbers)
    described = ",\n    ".join(f".{key} = {value}" for key, value in fields.items())
    return "\n".join(lines) + f"\n\nconst gearmbs_model gearmbs_this = {{\n    {described}\n}};\n", token


def _motions(begun: Begun, motions: Motions, numbers: dict[str, Number]) -> list[str]:
    """Return the tables of numbers of a model that an input may move."""
    own = [number.moved_to(begun.cells) for number in numbers.values()]
    places = [place for number in own for place in number.places]
    first = np.cumsum([0, *(len(number.places) for number in own)]).tolist()
    rows = [f"{{{p.at}, {p.size}, {p.order}, {float(p.factor)!r}, {float(p.offset)!r}}}" for p in places]
    fields = {
        "cells": len(begun.cells), "numbers": len(own), "cell": "motion_cell", "is_input": "motion_is_input",
        "prescribes": "motion_prescribes", "first": "motion_first", "places": "motion_places",
        "afresh": motions.afresh, "rdata": motions.rdata, "values": motions.values, "copies": len(motions.copies),
        "copy": "motion_copy", "t_first": repr(float(begun.problem.t0)),
    }  # fmt: skip
    described = ", ".join(f".{key} = {value}" for key, value in fields.items())
    return [
        _array("const int64_t", "motion_cell", begun.cells.tolist()),
        _array("const int64_t", "motion_is_input", [int(number.kind == INPUT) for number in own]),
        _array("const int64_t", "motion_prescribes", [int(bool(number.prescribes)) for number in own]),
        _array("const int64_t", "motion_first", first),
        _array("const motion_place", "motion_places", rows),
        _array("const int64_t", "motion_copy", [number for copy in motions.copies for number in copy]),
        f"static const motion_tables motions = {{{described}}};",
    ]


def _compile(
    library: Path, command: list[str], others: Sequence[str], kernels: Kernels, processor: str, system: System,
    memory: Memory, texts: str, report: Callable[[str], None],
) -> Path:  # fmt: skip
    """Compile kernels and sources in the folder of a library, and link them; return its path.

    A program for Windows asks for a library by the name that it had here.
    """
    room = library.parent
    called, numbered, late = kernels.objects(processor, system.triple, report)
    objects = {one.symbol: one.code for one in (*called.values(), *numbered, *late.values())}
    for symbol, code in objects.items():
        (room / f"{symbol}.o").write_bytes(code)
    block = memory.layout.block
    np.concatenate([block[first:end] for first, end in pieces_of(block).tolist()]).tofile(room / "block.bin")
    declared = sorted({one.symbol for one in (*numbered, *late.values())})
    head = [
        '#include "model.h"',
        "#include <math.h>",
        *(f"extern int {symbol}();" for symbol in declared),
        f"enum {{ LATE = {len(late)} }};",
        _array("void *const", "kernels", [f"(void *){one.symbol}" for one in numbered]),
        _array("void *const", "late", [f"(void *){one.symbol}" for one in late.values()]),
        _array("const char *const", "late_names", [_text(name) for name in late]),
        _BLOCK[system.ending],
    ]
    (room / "described.c").write_text("\n".join([*head, texts]), encoding="utf-8")
    sources = ["gearmbs.c", "runtime.c", *others, *(["afresh.c"] if memory.motions is not None else [])]
    for file in (*sources, *HEADERS):
        (room / file).write_bytes(_source(file))
    names = [f"-Dgearmbs_{name}={one.symbol}" for name, one in called.items()]
    made = [f"{symbol}.o" for symbol in objects]
    run = [
        *command,
        "-shared",
        *FLAGS,
        *system.flags,
        *names,
        *sources,
        "described.c",
        *made,
        "-lm",
        "-s",
        "-o",
        library.name,
    ]
    done = subprocess.run(run, cwd=room, capture_output=True, text=True)
    if done.returncode:
        if missing := sorted(set(re.findall(r"undefined (?:reference to|symbol:) [`']?([\w.$]+)", done.stderr))):
            raise ModelError(
                f"functions of one's own call {', '.join(missing)}, which numba takes from Python or numpy and a "
                "library has not; write what they do (sorting, gamma, complex powers, products of matrices) in loops"
            )
        raise ModelError(f"compiler: {' '.join(command)} could not link the library: {done.stderr.strip()[:2000]}")
    return library
