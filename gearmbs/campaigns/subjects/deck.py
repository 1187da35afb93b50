"""An ADAMS deck with ``${parameters}`` as the subject of a campaign."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, ClassVar, TypedDict, Unpack

import numpy as np

from gearmbs.campaigns.settings import CampaignError, by_name
from gearmbs.campaigns.subjects.base import Kept, Subject, kept_by_functions

PLACE = re.compile(r"\$\{([A-Za-z_][A-Za-z0-9_]*)\}")


class DeckKeywords(TypedDict, total=False):
    """Keywords of `DeckSubject` that one of a file takes, too, for type checkers."""

    routines: str | Path | None
    skip_unsupported: bool


class DeckSubject(Subject):
    """A deck whose text holds ``${name}`` where a parameter goes, or whose constant VARIABLEs are parameters.

    Numbers are in the deck's own units.

    Keeps ``requests``: of every column of the requests the last, mean, RMS about the mean, least and largest value, as
    ``NAME.COLUMN.max``.

    Parameters
    ----------
    text : str
        The deck.
    parameters : dict of float
        Values of its places, and of VARIABLEs by "VARIABLE/3" or by their names in ADAMS/View; these must be constants.
    end : float, optional
        End of the analysis, in the deck's unit of time, without a script.
    steps : int
        Output steps.
    script : str, optional
        Text of a command script (.acf) to carry out instead, which may have places, too.
    routines : path, optional
        Python file with the routines that the deck's USER(...) call; what it holds is part of a case's key, with the
        modules beside it that it imports.
    skip_unsupported : bool
        Leave out what is not supported instead of refusing the deck.
    name : str
        File of the deck, for messages; beside it are the meshes and modal neutral files that it names.

    Raises
    ------
    CampaignError
        If places have no value, or a value has no place.
    """

    kind: ClassVar[str] = "deck"
    keeps: ClassVar[tuple[str, ...]] = ("requests",)

    def __init__(
        self,
        text: str,
        parameters: dict[str, float],
        *,
        end: float | None = None,
        steps: int = 100,
        script: str | None = None,
        routines: str | Path | None = None,
        skip_unsupported: bool = False,
        name: str = "model.adm",
    ) -> None:
        parameters = by_name(parameters, "parameters")
        places = set(PLACE.findall(text)) | set(PLACE.findall(script or ""))
        others = set(parameters) - places
        self.variables: dict[str, int] = {}
        if others and places <= set(parameters):
            filled = PLACE.sub(lambda match: f"{float(parameters[match[1]]):.17G}", text)
            self.variables = _constant_variables(filled, others)
        if not places <= set(parameters) or others - set(self.variables):
            raise CampaignError(
                f"deck: it has the places {', '.join(sorted(places)) or 'none'}, parameters are given for "
                f"{', '.join(sorted(parameters)) or 'none'}; give a value to each place ${{name}}, and else only to "
                "VARIABLEs whose FUNCTION is a number"
            )
        if (end is None) == (script is None):
            raise CampaignError("deck: give either the end of the analysis or a script")
        self.text, self.parameters = text, {k: float(v) for k, v in parameters.items()}
        self.end, self.steps, self.script = None if end is None else float(end), int(steps), script
        self.name, self.skip_unsupported = str(name), bool(skip_unsupported)
        self.routines = None if routines is None else Path(routines).resolve()
        if self.routines is not None:
            _routine_files(self.routines)

    @classmethod
    def from_file(
        cls,
        path: str | Path,
        parameters: dict[str, float],
        *,
        end: float | None = None,
        steps: int = 100,
        script: str | Path | None = None,
        **more: Unpack[DeckKeywords],
    ) -> DeckSubject:
        """Return the subject of a deck in a file, with a script in another; what else it takes goes on."""
        commands = None if script is None else _text_of(Path(script))
        path = Path(path)
        text = _text_of(path)
        return cls(text, parameters, end=end, steps=steps, script=commands, name=str(path.resolve()), **more)

    def settings(self) -> dict[str, Any]:
        """Return the text and the values."""
        found: dict[str, Any] = {"text": self.text, "parameters": self.parameters, "steps": self.steps}
        if self.name != "model.adm":
            found["name"] = self.name
        if self.routines is not None:
            found["routines"] = str(self.routines)
        if self.skip_unsupported:
            found["skip_unsupported"] = True
        return found | ({"end": self.end} if self.script is None else {"script": self.script})

    @classmethod
    def from_settings(cls, settings: dict[str, Any]) -> DeckSubject:
        """Return the subject of a plan, which holds the deck's text or names its file."""
        given = dict(settings)
        if "file" in given:
            return cls.from_file(given.pop("file"), **given)
        return cls(**given)

    def base(self) -> dict[str, Any]:
        """Return the parameters."""
        return dict(self.parameters)

    def unit_of(self, path: str) -> str:
        """Return "1": a deck's numbers are in its own units."""
        if path not in self.parameters:
            raise CampaignError(f"{path}: the deck has no place ${{{path}}}; known are {', '.join(self.parameters)}")
        return "1"

    def check(self, data: dict[str, Any], name: str) -> dict[str, Any]:
        """Return the deck, its text and script with the values in their places, and these; refuse impossible ones."""
        from gearmbs.adams import DeckError, parse_deck

        values = {key: float(value) for key, value in data.items()}
        text = PLACE.sub(lambda match: f"{values[match[1]]:.17G}", self.text)
        script = None if self.script is None else PLACE.sub(lambda match: f"{values[match[1]]:.17G}", self.script)
        try:
            deck = parse_deck(text, self.name)
        except DeckError as error:
            raise CampaignError(f"{name}: {error}") from error
        for variable, number in self.variables.items():
            set_variable(deck, number, values[variable])
        return {"deck": deck, "text": text, "script": script, "values": values}

    def canonical(self, thing: dict[str, Any]) -> dict[str, Any]:
        """Return the digest of the template, the values, the span, and digests of the files that it names."""
        digest = hashlib.sha256(self.text.encode()).hexdigest()
        found = {"deck": digest, "values": thing["values"], "end": self.end, "steps": self.steps}
        if self.script is not None:
            found["script"] = hashlib.sha256(self.script.encode()).hexdigest()
        if self.routines is not None:
            found["routines"] = _routine_files(self.routines)
        if self.skip_unsupported:
            found["skip_unsupported"] = True
        if files := _named_files(thing["deck"]):
            found["files"] = [digest for _, digest in files]
        if thing["script"] is not None and (commands := _included(thing["script"], self.name)):
            found["commands"] = commands
        return found

    @cached_property
    def _base_thing(self) -> dict[str, Any]:
        # which files it names is asked for twice a unit, and a large deck takes a while to read
        return self.check(self.base(), "deck")

    def files(self) -> dict[str, str]:
        """Return digests of the files that the deck names, of the commands that its script takes, of routines."""
        thing = self._base_thing
        found = dict(_named_files(thing["deck"]))
        if thing["script"] is not None and (commands := _included(thing["script"], self.name)):
            found["the commands of FILE/COMMAND"] = commands
        if self.routines is not None:
            found |= _routine_files(self.routines)
        return found

    def run(
        self, thing: dict[str, Any], progress: Callable[[float], None], keep: Sequence[str]
    ) -> dict[str, np.ndarray]:
        """Run the deck and return its requests: arrays by name and column."""
        from gearmbs.adams import load_routines, parse_script, run_deck

        if thing["script"] is not None:
            span: dict[str, Any] = {"acf": parse_script(thing["script"], str(Path(self.name).with_suffix(".acf")))}
        else:
            span = {"end": self.end, "steps": self.steps}
        routines = None if self.routines is None else load_routines(self.routines)
        result = run_deck(thing["deck"], allow_unsupported=self.skip_unsupported, routines=routines, **span)
        progress(1.0)
        if not result.success:
            raise RuntimeError("; ".join(str(m) for m in result.messages)[-2000:])
        return requests_of(result)

    def reduce(self, thing: dict[str, Any], record: dict[str, np.ndarray], keep: Sequence[str]) -> Kept:
        """Return numbers of every column of the requests."""
        kept = kept_by_functions(keep, record)
        if "requests" in keep:
            for name, values in record.items():
                x = np.asarray(values, dtype=float)
                found = {"last": x[-1], "mean": x.mean(), "rms": x.std(), "min": x.min(), "max": x.max()}
                kept.add({f"{name}.{what}": float(value) for what, value in found.items()}, "requests")
        return kept


def _text_of(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise CampaignError(f"deck: {path}: cannot be read ({error.strerror or error})") from error


@lru_cache(maxsize=256)
def _digest_as_written(path: Path, _written: tuple[int, int, int, int]) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _digest_now(path: Path) -> str:
    """Return the digest of a file, which is read again only if it was written since."""
    about = path.stat()
    return _digest_as_written(path, (about.st_mtime_ns, about.st_ctime_ns, about.st_size, about.st_ino))


def _named_files(deck: Any) -> list[tuple[str, str]]:
    """Return names and digests of the files that a deck reads, as modal neutral files and meshes, in its order."""
    from gearmbs.adams.parse.files import named_file

    found = []
    for statement in deck:
        name = getattr(statement, "mnf_file", None) or getattr(statement, "data_file", None)
        # what may not be read, or is not there, is refused where it is needed
        with suppress(ValueError, OSError):
            if name:
                found.append((name, _digest_now(named_file("FILE", name, deck.file))))
    return found


def _routine_files(path: Path) -> dict[str, str]:
    """Return names and digests of a file of routines and of the modules beside it that it imports."""
    from gearmbs.adams.builders.routines import files_of_routines

    try:
        return {file.relative_to(path.parent).as_posix(): _digest_now(file) for file in files_of_routines(path)}
    except OSError as error:
        raise CampaignError(f"deck: routines {path}: cannot be read ({error.strerror or error})") from error


def _included(script: str, name: str) -> str:
    """Return a digest of what a script does with the commands of other files, "" if it takes none."""
    from gearmbs.adams import parse_script
    from gearmbs.adams.parse.commands import FileCommand

    commands = parse_script(script, str(Path(name).with_suffix(".acf"))).commands
    if not any(isinstance(command, FileCommand) and command.command for command in commands):
        return ""
    return hashlib.sha256(repr(commands).encode()).hexdigest()


def _constant_variables(text: str, names: set[str]) -> dict[str, int]:
    """Return those names that stand for VARIABLEs with a number for their FUNCTION, with the ids."""
    from gearmbs.adams import DeckError, parse_deck

    try:
        deck = parse_deck(text, "model.adm")
    except DeckError as error:
        raise CampaignError(f"deck: {error}") from error
    found = {}
    for variable in variables_of(deck).values():
        for name in (variable.label(), variable.name):
            if name in names and variable.function is not None and _number(variable.function):
                found[name] = variable.id
    return found


def variables_of(deck: Any) -> dict[int, Any]:
    """Return the VARIABLE statements of a deck by id."""
    from gearmbs.adams.parse.statements import Variable

    return deck.of(Variable)


def set_variable(deck: Any, number: int, value: float) -> None:
    """Give a VARIABLE of a deck a constant value."""
    group = variables_of(deck)
    group[number] = replace(group[number], function=f"{value:.17G}")


def _number(text: str) -> bool:
    try:
        float(text.replace("D", "E").replace("d", "e"))
    except ValueError:
        return False
    return True


def requests_of(result: Any) -> dict[str, np.ndarray]:
    """Return the columns of the requests of a deck's result, by ``request_NUMBER.COLUMN``: those that are asked for,
    and others that are not zero throughout."""
    from gearmbs.adams.parse.statements import Request
    from gearmbs.adams.results.requests import request_texts

    data, requests = result.to_dataset(), result.deck.of(Request)
    found = {}
    for name in data.data_vars:
        if not str(name).startswith("request_"):
            continue
        asked = request_texts(requests[int(str(name).removeprefix("request_"))])
        for k, column in enumerate(data[f"{name}_column"].values):
            values = np.asarray(data[name].values[:, k], dtype=float)
            if asked[k] is not None or values.any():
                found[f"{name}.{column}"] = values
    return found
