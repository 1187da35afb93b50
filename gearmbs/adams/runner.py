"""Run a deck, by its script or for a given time: ``run_deck``; and its linear plant: ``linear_plant``."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from gearmbs.adams.analysis import failed, linear, simulate
from gearmbs.adams.builders.routines import bound
from gearmbs.adams.doors import read_model
from gearmbs.adams.errors import ERROR, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Change, Command, Linear, Script, Simulate, Stop, Switch, read_script
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.results.result import AdamsResult
from gearmbs.adams.session import Session, change, check_script, switch
from gearmbs.adams.view.reader import ViewModel
from gearmbs.dae.analyses.plant import LinearPlant
from gearmbs.dae.problem import ModelError


def run_deck(
    adm: str | Path | Deck | ViewModel,
    acf: str | Path | Script | None = None,
    out: str | Path | None = None,
    *,
    end: float | None = None,
    steps: int | None = None,
    dtout: float | None = None,
    tol: float | None = None,
    allow_unsupported: bool = False,
    progress: bool | Callable[[float], None] | None = None,
    redundancy: str = "adams",
    routines: Mapping[str, Callable] | None = None,
    check: bool | None = None,
) -> AdamsResult:
    """Run an ADAMS deck.

    Parameters
    ----------
    adm : path, Deck or ViewModel
        The model; a path may be that of a command file of View.
    acf : path or Script, optional
        Commands; without them one dynamic analysis is run up to ``end``, or, without that, the simulation that a
        command file of View holds. One of the ``scripts`` of a ViewModel is run with the model as it was then.
    out : path, optional
        Prefix of the files to write (.req, .res, .msg, .nc).
    end : float, optional
        End time in the deck's unit, when there is no script.
    steps, dtout : int or float, optional
        Number of output steps or their size in the deck's unit; default 100 steps.
    tol : float, optional
        Local error instead of INTEGRATOR's ERROR.
    allow_unsupported : bool
        Leave out what is not supported instead of refusing to run.
    progress : bool or callable
        As in :func:`gearmbs.mechanism.simulate`.
    redundancy : {"adams", "declared"}
        Which of redundant constraint rows are kept: as in ADAMS, as far as that is known, or those that stand first.
    routines : mapping, optional
        Python functions for the deck's USER(...), by statement ("SFORCE/3"), the name in ROUTINE=, or ADAMS's name
        (SFOSUB, ...); each takes a `gearmbs.adams.RoutineCall`.
    check : bool, optional
        Whether dynamic analyses are solved again at a hundredth of their error, and remarked if parts then go other
        ways; without it those are for which this takes about a second, see `gearmbs.adams.results.remarks.CHEAP`.

    Returns
    -------
    AdamsResult
        Also when an integration failed or was interrupted by Ctrl-C: see its ``success`` and ``messages``. A
        KeyboardInterrupt elsewhere, as between two analyses, goes on to the caller and has it as its ``result``.

    Raises
    ------
    DeckError
        Naming file and line of what is wrong or not supported. Most of it is found before anything is run; what only
        a run can tell (a position without equilibrium, for instance) comes with the ``result`` of the commands before,
        whose files are written.
    """
    model = read_model(Path(adm)) if isinstance(adm, (str, Path)) else adm
    several: Diagnostic | None = None
    if isinstance(model, ViewModel):
        if acf is None and (end, steps, dtout) == (None, None, None):
            acf = model.script
            several = _several(model)
        model = model.deck_for(acf if isinstance(acf, Script) else None)
    deck = bound(model, routines, allow_unsupported)
    if several is not None:
        deck = replace(deck, diagnostics=[*deck.diagnostics, several])
    script = _script(acf, end, steps, dtout)
    if script.unsupported and not allow_unsupported:
        raise DeckError(script.unsupported)
    result = AdamsResult(deck, script)
    session = Session.of(deck, routines)
    session.redundancy, session.check = redundancy, check
    session.tol, session.allow_unsupported, session.progress = tol, allow_unsupported, progress
    with _errors_recorded(result, session, out):
        _without_unasked(result, session)
        for command in script:
            if isinstance(command, Stop) or not _carry_out(command, session, result):
                break
        if result.segments and result.segments[-1].interrupted:
            result.interrupted = _interruption(result)
    return result


def _several(view: ViewModel) -> Diagnostic | None:
    """Return a remark if a command file runs several analyses, of which the last is run."""
    if len(view.own) < 2:
        return None
    which = f"this is the last, {view.own[-1]}; before it: {', '.join(view.own[:-1])}"
    message = f"the file runs {len(view.own)} analyses, each from the design; {which}: scripts[...] of the model"
    return Diagnostic(WARNING, message, view.deck.file, 0)


@contextmanager
def _errors_recorded(result: AdamsResult, session: Session, out: str | Path | None) -> Iterator[None]:
    """Write down what ends a script, and write what it has computed, whatever ends it."""
    try:
        yield
    except DeckError as error:
        result.errors.extend(error.diagnostics)
        if error.kept is not None:
            result.log[-1] = (result.command, error.kept)
        error.result = result
        raise
    except ModelError as error:
        # what only shows when results are made
        told = failed(session, result.command, None, error)
        result.errors.extend(told.diagnostics)
        told.result = result
        raise told from error
    except KeyboardInterrupt as interrupt:
        result.interrupted = _interruption(result)
        interrupt.result = result  # type: ignore[attr-defined]
        raise
    except BaseException as error:
        message = str(error) or type(error).__name__
        result.errors.append(Diagnostic(ERROR, message, result.command.file, result.command.line))
        raise
    finally:
        if out is not None:
            result.write(out)


def _without_unasked(result: AdamsResult, session: Session) -> None:
    """Check the script before anything is run; leave out the REQUESTs of what is left out."""
    deck = result.deck
    unasked = check_script(deck, result.script, session.allow_unsupported, session.routines)
    if unasked:
        requests = {n: request for n, request in deck.of(st.Request).items() if n not in unasked}
        result.deck = replace(deck, items={**deck.items, st.Request: requests})
        session.deck = Session.of(result.deck).deck


def _interruption(result: AdamsResult) -> str:
    """Return a sentence on where a run was interrupted."""
    deck, command = result.deck, result.command
    times = [segment.solution.t for segment in result.segments if segment.solution.t.size]
    reached = f"at TIME = {times[-1][-1] / deck.units.time:.6g}" if times else "before its first output"
    where = f", in command {command.text or type(command).__name__.lower()}" if command.line else ""
    end = command.end if isinstance(command, Simulate) else None
    asked = f" of {end:.6g}" if times and end is not None else ""
    return (
        f"the simulation of {deck.file} was interrupted {reached}{asked}{where}; what was computed until then is kept"
    )


def _carry_out(command: Command, session: Session, result: AdamsResult) -> bool:
    """Carry out one command of a script; return whether the next may follow."""
    result.log.append((command, None))
    if isinstance(command, Change):
        change(session, command, session.allow_unsupported)
    elif isinstance(command, Switch):
        switch(session, command)
    elif isinstance(command, Linear):
        result.log[-1] = (command, linear(session, command))
    elif isinstance(command, Simulate):
        try:
            return simulate(session, command, result)
        except ModelError as error:
            # a routine of the user that only results ask for
            raise failed(session, command, None, error) from error
    return True


def _script(acf: str | Path | Script | None, end: float | None, steps: int | None, dtout: float | None) -> Script:
    if acf is not None and (end, steps, dtout) != (None, None, None):
        message = "a script has its own end times and steps; give either the script or end, steps and dtout"
        raise DeckError([Diagnostic(ERROR, message, "", 0)])
    if isinstance(acf, Script):
        return acf
    if acf is not None:
        return read_script(acf)
    if end is None:
        message = "there is no script and no end time; give an .acf file, or end= and steps= (or dtout=)"
        raise DeckError([Diagnostic(ERROR, message, "", 0)])
    if not end > 0.0 or (dtout is not None and not dtout > 0.0) or (steps is not None and steps < 1):
        message = f"end = {end}, steps = {steps}, dtout = {dtout}; they must be positive"
        raise DeckError([Diagnostic(ERROR, message, "", 0)])
    if steps is None and dtout is None:
        steps = 100
    return Script(commands=[Simulate(kind="DYNAMICS", end=end, steps=steps, dtout=dtout)])


# The linear plant of a deck in one call.


OPERATING_POINTS = ("initial", "equilibrium")


def linear_plant(
    adm: str | Path | Deck,
    acf: str | Path | Script | None = None,
    *,
    pinput: int | None = None,
    poutput: int | None = None,
    at: str = "initial",
    allow_unsupported: bool = False,
    routines: Mapping[str, Callable] | None = None,
) -> LinearPlant:
    """Return the linear plant between a deck's PINPUT and POUTPUT.

    Parameters
    ----------
    adm : path or Deck
    acf : path or Script, optional
        Commands after which the deck is linearised; default: at the start.
    pinput, poutput : int, optional
        Their ids, where a deck has several.
    at : {"initial", "equilibrium"}
        Whether an equilibrium is looked for first.
    allow_unsupported, routines
        As in :func:`gearmbs.adams.run_deck`.

    Returns
    -------
    LinearPlant
        Inputs and outputs in the deck's units, rates by its unit of time.

    Raises
    ------
    DeckError
        As :func:`gearmbs.adams.run_deck`, and if there is no such PINPUT or POUTPUT.
    """
    if at not in OPERATING_POINTS:
        raise DeckError([Diagnostic(ERROR, f"at = {at!r}; choose {' or '.join(OPERATING_POINTS)}", "", 0)])
    given = acf if isinstance(acf, Script) or acf is None else read_script(acf)
    commands: list[Command] = list(given.commands) if given is not None else []
    if at == "equilibrium":
        commands.append(Simulate(kind="STATICS"))
    commands.append(Linear(statemat=True, pinput=pinput, poutput=poutput, text="linear/statemat"))
    script = Script(commands=commands, file=given.file if given is not None else "<script>")
    result = run_deck(adm, script, allow_unsupported=allow_unsupported, routines=routines)
    if not result.plants:
        raise DeckError([Diagnostic(ERROR, "; ".join(result.messages) or "the script ended before", "", 0)])
    for message in result.messages:
        if "LINEAR: " in message:
            warnings.warn(message, stacklevel=2)
    return result.plants[-1]
