"""Routines of the user: USER(...) in the functions of a deck, bound to Python functions."""

from __future__ import annotations

import ast
import importlib
import inspect
import runpy
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.adams.builders.forces import bind_mforce
from gearmbs.adams.builders.machinery import is_gear_force, is_pair
from gearmbs.adams.builders.routine_calls import Caller, Routine, RoutineCall, callable_with_call
from gearmbs.adams.errors import ERROR, UNSUPPORTED, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck, without_refused
from gearmbs.mechanism.language.syntax import Call, Negative, Node, Number, parse
from gearmbs.mechanism.language.user_functions import UserFunction

# What routines of the user are to COUPLER, FIELD, CURVE and GSE.


SAMPLES = 201
"""Points at which a curve by a routine is taken; a cubic spline through them errs by some 1e-9 of a smooth curve."""
LINEAR = 1e-12
"""Deviation from a linear function, of the largest term, below which a coupler is linear."""
SHARE = 0.1
"""Displacement over which a coupler by a routine may change much, of the largest coordinate in the deck."""
DRAWS = 4
"""Places at which implicit equations are asked on which rates they depend."""
PARTS = ("deriv", "output", "update")
"""Parts of a GSE's routines, in the order of INTERFACE."""


def bind_field(deck: Deck, s: st.Field, parameters: tuple[float, ...], found: Mapping[str, Routine]) -> st.Field:
    """FIELD by FIESUB: the six components of what acts on I, in the frame of J."""
    caller = Caller(deck, s, parameters, found[""], 6, {"displacement": 6, "velocity": 6})
    moved = [f"D{axis}({s.i},{s.j},{s.j})" for axis in "XYZ"] + [f"A{axis}({s.i},{s.j})" for axis in "XYZ"]
    rates = [f"V{axis}({s.i},{s.j},{s.j},{s.j})" for axis in "XYZ"] + [f"W{axis}({s.i},{s.j},{s.j})" for axis in "XYZ"]
    texts = caller.texts(deck.functions, f"USER_FIELD_{s.id}", [*moved, *rates])
    return replace(s, function=None, components=tuple(texts))


def bind_curve(
    deck: Deck, s: st.CurveStatement, parameters: tuple[float, ...], found: Mapping[str, Routine]
) -> st.CurveStatement:
    """CURVE by CURSUB: points for parameters from MINPAR to MAXPAR."""
    low = -1.0 if s.minpar is None else s.minpar
    high = 1.0 if s.maxpar is None else s.maxpar
    if not low < high:
        raise ValueError(f"has no range: MINPAR = {low:g}, MAXPAR = {high:g}")
    routine = callable_with_call(found[""])
    rows = []
    for alpha in np.linspace(low, high, SAMPLES):
        call = RoutineCall(s.id, s.label(), parameters, alpha=float(alpha), _deck=deck)
        try:
            point = np.asarray(routine(call), dtype=float)
        except Exception as error:
            # whatever a user's function raises is told with its statement
            raise ValueError(f"fails at alpha = {alpha:g}: {type(error).__name__}: {error}") from error
        if point.shape != (3,) or not np.isfinite(point).all():
            raise ValueError(f"returns {point}; it must return x, y and z")
        rows.append((float(alpha), *(float(v) for v in point)))
    return replace(s, function=None, sampled=tuple(rows))


def gse_parts(s: st.Gse) -> list[tuple[str, list[str]]]:
    """Return the parts of its routines that a GSE needs, each with the names it is looked for under."""
    named = [one.strip("\"' ").rpartition("::")[2].upper() for one in (s.interface or "").split(",")]
    out = []
    for k, (part, size) in enumerate(zip(PARTS, (s.ns, s.no, s.nd))):
        if size:
            own = named[k : k + 1] if named != [""] else []
            out.append((part, [f"{s.label()}.{part}".upper(), *own, f"GSE_{part}".upper()]))
    return out


def bind_gse(deck: Deck, s: st.Gse, parameters: tuple[float, ...], found: Mapping[str, Routine]) -> st.Gse:
    """GSE: rates of its states, outputs, and the next values of its discrete states."""
    inputs = deck.of(st.Array)[s.u].variables if s.u in deck.of(st.Array) else ()
    sizes = {"x": s.ns, "xd": s.nd, "u": len(inputs)}
    counts = dict(zip(PARTS, (s.ns, s.no, s.nd)))
    callers = {}
    for part, routine in found.items():
        more = {"xdot": s.ns} if s.implicit and part == "deriv" else {}
        callers[part] = Caller(deck, s, parameters, routine, counts[part], sizes | more)
    for part in ("deriv", "output"):
        if part in callers:
            # the expressions are put together where the discrete states are known
            given = sum(callers[part].quantities.values())
            callers[part].texts(deck.functions, f"USER_GSE_{s.id}_{part.upper()}", [""] * given)
    held = deck.of(st.Array)[s.icd].numbers if s.icd in deck.of(st.Array) else (0.0,) * s.nd
    rated = _rated(callers["deriv"], s.ns) if s.implicit and s.ns else ()
    return replace(s, function=None, callers=callers, held=tuple(held), rated=rated)


def _rated(caller: Caller, n: int) -> tuple[bool, ...]:
    """Return of each state whether implicit equations depend on its rate, by draws."""
    draw = np.random.default_rng(2)
    sizes = list(caller.quantities.values())
    first = 1 + sum(sizes[:-1])
    found = np.zeros(n, dtype=bool)
    for _ in range(DRAWS):
        arguments = draw.uniform(0.1, 1.0, 1 + sum(sizes) + len(caller.asked))
        before = caller.results(arguments.tolist())
        for k in range(n):
            moved = arguments.copy()
            moved[first + k] += draw.uniform(0.1, 1.0)
            found[k] |= caller.results(moved.tolist()) != before
    return tuple(found.tolist())


def bind_coupler(deck: Deck, s: st.Coupler, parameters: tuple[float, ...], found: Mapping[str, Routine]) -> st.Coupler:
    """COUPLER by COUSUB: what it returns stays zero; a linear function becomes its slopes."""
    n = len(s.joints)
    caller = Caller(deck, s, parameters, found[""], 1, {"q": n})
    if caller.asked:
        raise ValueError(f"asks for {caller.asked[0]}; a coupler depends on the displacements of its joints only")

    def residual(*q: float) -> float:
        return caller.results((0.0, *q))[0]

    places = [f"{{{k}}}" for k in range(n)]
    slopes = _slopes(residual, n)
    if slopes is not None:
        terms = [f"({slope!r})*({place})" for slope, place in zip(slopes, places)]
        return replace(s, function=None, expression=" + ".join([*terms, f"({residual(*[0.0] * n)!r})"]))
    key = f"COUSUB_COUPLER_{s.id}"
    sizes = [_size(deck, ref) for ref in s.joints]
    deck.functions[key] = UserFunction(f"{s.label()}: USER", residual, count=n, sizes=sizes)
    return replace(s, function=None, expression=f"{key}({', '.join(places)})")


def _size(deck: Deck, joint: int) -> float:
    """Return over which displacement of a joint a coupler may change much: a radian, or a share of the model."""
    statement = deck.of(st.Joint).get(joint)
    if statement is None or statement.type not in ("TRANSLATIONAL", "CYLINDRICAL"):
        return 1.0
    places = [abs(v) for part in deck.of(st.Part).values() for v in part.qg]
    places += [abs(v) for marker in deck.of(st.Marker).values() for v in marker.qp]
    return SHARE * (max(places, default=0.0) or 1.0)


def _slopes(residual: Callable[..., float], n: int) -> list[float] | None:
    """Return the slopes of a linear function of several numbers, None of one that is not linear."""
    draw = np.random.default_rng(1)
    try:
        rest = residual(*[0.0] * n)
        slopes = [residual(*[float(i == k) for i in range(n)]) - rest for k in range(n)]
        for q in draw.uniform(-10.0, 10.0, (8, n)):
            terms = [rest, *(slope * one for slope, one in zip(slopes, q))]
            if not abs(residual(*q.tolist()) - sum(terms)) <= LINEAR * max(map(abs, terms)):
                return None
    except (ArithmeticError, ValueError):
        # it has no value everywhere
        return None
    return slopes


BINDERS: dict[type, Callable] = {
    st.Coupler: bind_coupler,
    st.Field: bind_field,
    st.CurveStatement: bind_curve,
    st.Gse: bind_gse,
    st.Mforce: bind_mforce,
}
"""What makes of a routine what a statement needs, where that is not expressions in place of its arguments."""

EVALUATED = "SEVSUB"
"""That of what a SENSOR evaluates when it fires."""


def bound(deck: Deck, routines: Mapping[str, Any] | None = None, allow_missing: bool = False) -> Deck:
    """Return a deck in which the functions USER(...) call Python functions, without what is not supported.

    What uses functions that are not supported, and what reads it, is taken out, and remarked in the deck's diagnostics:
    a run refuses these unless it is asked to leave them out.

    Parameters
    ----------
    deck : Deck
    routines : mapping, optional
        By statement ("SFORCE/3"), by the name in ROUTINE= or INTERFACE= behind any library's, or by ADAMS's name
        (SFOSUB, ...). Those of a GSE also as one mapping of "deriv", "output" and "update".
    allow_missing : bool
        Leave out statements whose routine is missing, and those that read them or what is not supported, instead of
        refusing.

    Raises
    ------
    DeckError
        Naming all routines that are missing, with what else is not supported, and what is wrong with the others.
    """
    known = {name.upper(): routine for name, routine in (routines or {}).items()}
    users = [use for s in deck for use in _uses(s)]
    made = replace(deck, items={kind: dict(group) for kind, group in deck.items.items()})
    made.diagnostics, made.functions = list(deck.diagnostics), dict(deck.functions)
    made.left_out = set(deck.left_out)
    problems = []
    gone: list[st.Statement] = []
    for use in users:
        statement, group = use.statement, made.items[type(use.statement)]
        refused = f"{statement.label()}: FUNCTION is not supported"
        made.diagnostics = [d for d in made.diagnostics if not d.message.startswith(refused)]
        try:
            with warnings.catch_warnings(record=True) as warned:
                warnings.simplefilter("always")
                found, missing = _found(use, known)
        except ValueError as error:
            problems.append(_wrong(deck, statement, error))
            continue
        for told in (str(one.message) for one in warned):
            # a command file has said it at a line of its own
            if not any(d.message.endswith(told) for d in made.diagnostics):
                made.diagnostics.append(Diagnostic(WARNING, f"{statement.label()}: {told}", deck.file, statement.line))
        if missing:
            word, are = ("routine", "is") if len(missing) == 1 else ("routines", "are")
            message = f"{statement.label()}: its {word} {', '.join(missing)} {are} missing; give it in routines"
            if is_gear_force(statement):
                message += f', as a gear force of ADAMS/Machinery its wheels: {{"{statement.label()}": GearPair(...)}}'
            problems.append(Diagnostic(UNSUPPORTED, message, deck.file, statement.line))
            if group.pop(statement.id, None) is not None:
                gone.append(statement)
            continue
        if statement.id not in group:
            # another routine of it is missing
            continue
        try:
            group[statement.id] = _with_function(made, group[statement.id], use, found)
        except ValueError as error:
            problems.append(_wrong(deck, statement, error))
    if any(d.severity == ERROR for d in problems):
        raise DeckError(problems)
    made.diagnostics.extend([*problems, *without_refused(made, gone, readers=allow_missing)])
    if not users and made.left_out == deck.left_out:
        # as it was: remarks on the run are to be found in the user's own deck
        return deck
    if problems and not allow_missing:
        raise DeckError(sorted(made.unsupported, key=lambda d: d.line))
    return made


def _wrong(deck: Deck, statement: st.Statement, error: ValueError) -> Diagnostic:
    return Diagnostic(ERROR, f"{statement.label()}: its routine {error}", deck.file, statement.line)


def load_routines(path: str | Path) -> dict[str, Any]:
    """Return what a Python file defines for USER(...), by name: functions, and pairs for gear forces.

    It may import what stands beside it, which is read anew where it was written since, or where routines of another
    folder have loaded modules of the same names.

    Raises
    ------
    ValueError
        If it cannot be read or run, or defines none.
    """
    path = Path(path)
    beside = str(path.resolve().parent)
    _forget_outdated(beside)
    before = set(sys.modules)
    sys.path.insert(0, beside)
    try:
        space = runpy.run_path(str(path))
    except Exception as error:
        raise ValueError(f"{path}: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(beside)
        _note_beside(beside, set(sys.modules) - before)
    found = {k: v for k, v in space.items() if k[0] != "_" and (_defined_here(v) or is_pair(v))}
    if not found:
        raise ValueError(f"{path}: it defines no functions; write for example def sfosub(call): ...")
    return found


_beside: dict[str, tuple[str, Path, tuple[int, int]]] = {}
"""Modules that routines have loaded from beside them, by name: the folder, the file, and how that looked."""


def _looks(path: Path) -> tuple[int, int]:
    try:
        about = path.stat()
    except OSError:
        return 0, -1
    return about.st_mtime_ns, about.st_size


def _note_beside(folder: str, names: Iterable[str]) -> None:
    """Note which of the modules that were loaded stand in a folder."""
    for name in names:
        file = getattr(sys.modules[name], "__file__", None)
        if file and Path(folder) in Path(file).resolve().parents:
            _beside[name] = folder, Path(file), _looks(Path(file))


def _forget_outdated(folder: str) -> None:
    """Forget modules of other folders; and all of this one if one was written since, for they use each other."""
    mine = [name for name, (home, _, _) in _beside.items() if home == folder]
    written = any(_looks(_beside[name][1]) != _beside[name][2] for name in mine)
    for name in list(_beside):
        if written or name not in mine:
            del _beside[name]
            sys.modules.pop(name, None)
    importlib.invalidate_caches()


def files_of_routines(path: str | Path) -> list[Path]:
    """Return a file of routines and those beside it whose modules it imports, of packages all files.

    Raises
    ------
    OSError
        If one cannot be read.
    """
    path = Path(path).resolve()
    found, waiting = list[Path](), [path]
    while waiting:
        file = waiting.pop()
        if file in found:
            continue
        found.append(file)
        for name in _imported_names(file):
            module, package = path.parent / f"{name}.py", path.parent / name
            waiting += sorted(package.rglob("*.py")) if package.is_dir() else [module] if module.is_file() else []
    return found


def _imported_names(file: Path) -> set[str]:
    """Return the first parts of the names of the modules that a file imports, anywhere in it."""
    try:
        tree = list(ast.walk(ast.parse(file.read_bytes())))
    except SyntaxError:
        # refused where it is run
        return set()
    names = [alias.name for node in tree if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module for node in tree if isinstance(node, ast.ImportFrom) and node.module and not node.level]
    return {name.partition(".")[0] for name in names}


def _defined_here(value: Any) -> bool:
    """Whether a file that is run defines a function itself, plain or compiled by numba."""
    value = getattr(value, "py_func", value)
    return inspect.isfunction(value) and value.__module__ == "<run_path>"


@dataclass(frozen=True)
class _Use:
    """One USER(...) of a statement: ADAMS's name of its routine, where its results go, where the user's name stands."""

    statement: st.Statement
    call: Call
    routine: str
    fields: tuple[str, ...]
    given: str | None

    def names(self) -> list[str]:
        """Return the names under which the routine is looked for."""
        own = [self.given.strip("\"' ").rpartition("::")[2].upper()] if self.given else []
        label = self.statement.label()
        if self.routine == EVALUATED:
            return [f"{label}/EVALUATE", *own, self.routine]
        return [label, *own, self.routine, label.replace("/", "_")]


def _uses(s: st.Statement) -> Iterator[_Use]:
    """Yield what a statement calls of the user."""
    if s.subroutine:
        call = _user_call(getattr(s, "function", None)) or _user_call(getattr(s, "force", None))
        if call is not None:
            yield _Use(s, call, s.subroutine, s.results, getattr(s, "routine", None))
    if isinstance(s, st.Sensor):
        call = _user_call(s.evaluate)
        if call is not None:
            yield _Use(s, call, EVALUATED, ("evaluate",), s.evaluate_routine)


def calls_routine(statement: st.Statement) -> bool:
    """Whether a statement, or a command that changes one, calls a routine of the user."""
    return any(True for _ in _uses(statement))


def _user_call(text: str | None) -> Call | None:
    if not isinstance(text, str):
        return None
    try:
        node = parse(text)
    except ValueError:
        return None
    return node if isinstance(node, Call) and node.name == "USER" else None


def _found(use: _Use, known: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Return the routines of a statement by part ("" for the only one), and the names of those that are missing."""
    found: dict[str, Any] = {}
    missing = []
    s = use.statement
    wanted: Iterable[tuple[str, list[str]]] = [("", use.names())]
    own = known.get(s.label())
    if isinstance(s, st.Gse):
        wanted = gse_parts(s)
        if isinstance(own, Mapping):
            known = {**known, **{f"{s.label()}.{part}".upper(): routine for part, routine in own.items()}}
    for part, names in wanted:
        routine = next((known[name] for name in names if name in known), None)
        if routine is None and isinstance(s, st.Gforce) and s.pair:
            from gearmbs.adams.write.contacts import pair_of

            routine = pair_of(s.pair)
        if isinstance(s, st.Gforce) and is_pair(routine):
            return {"": routine}, []
        if routine is not None and not callable(routine):
            raise ValueError(f"is {routine!r}, which cannot be called")
        if routine is not None:
            found[part] = routine
        else:
            missing.append(names[1])
    return found, missing


def _with_function(deck: Deck, s: st.Statement, use: _Use, found: Mapping[str, Any]) -> Any:
    """Return a statement whose results are calls of functions that the deck then has."""
    if isinstance(s, st.Gforce) and is_pair(found[""]):
        return replace(s, function=None, fx="0", gears=found[""])
    parameters = tuple(_number(a) for a in use.call.args)
    if type(s) in BINDERS:
        return BINDERS[type(s)](deck, s, parameters, found)
    caller = Caller(deck, s, parameters, found[""], len(use.fields))
    if isinstance(s, st.Motion) and caller.asked:
        raise ValueError(f"asks for {caller.asked[0]}; a motion depends on TIME only")
    texts: dict[str, str | None] = {} if use.routine == EVALUATED else {"function": None}
    texts |= dict(zip(use.fields, caller.texts(deck.functions, f"{use.routine}_{s.label().replace('/', '_')}")))
    return replace(s, **texts)  # type: ignore[arg-type]


def _number(node: Node) -> float:
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Negative) and isinstance(node.operand, Number):
        return -node.operand.value
    raise ValueError("has parameters that are no numbers")
