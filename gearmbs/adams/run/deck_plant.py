"""The linear plant of a deck in one call: ``linear_plant``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from gearmbs.adams.errors import ERROR, DeckError, Diagnostic
from gearmbs.adams.parse.commands import Command, Linear, Script, Simulate, read_script
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.run.runner import run_deck
from gearmbs.dae.analyses.plant import LinearPlant

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
    return result.plants[-1]
