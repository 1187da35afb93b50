"""Functions of a signal that take data of any shape, with its rate, and quantities as texts with units."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar, cast

from gearmbs.signals.errors import SignalError
from gearmbs.units import to_si

if TYPE_CHECKING:
    import xarray as xr

    from gearmbs.signals.signal.inputs import Units
    from gearmbs.signals.signal.units import Given

GIVEN = ("rate", "units", "channels", "gaps")
"""Keywords of `to_signal` that such functions have in addition to their own."""
FOR_CHECKERS = "_data"
"""How a function calls these where it has no other keywords that it hands on; it never gets any."""


class DataKeywords(TypedDict, total=False):
    """The same for type checkers."""

    rate: Given | None
    units: Units | None
    channels: Sequence[str] | None
    gaps: str | None


F = TypeVar("F", bound=Callable)


def takes_data(**dimensions: str) -> Callable[[F], F]:
    """Let a function's first argument be whatever `to_signal` makes a signal of.

    The function gets the keywords ``rate``, ``units``, ``channels`` and ``gaps`` of `to_signal`.

    Parameters
    ----------
    **dimensions
        Arguments that may be texts with a unit, or pairs of these, and the dimension of each: ``band="frequency"``.
    """

    def wider(function: F) -> F:
        own = inspect.signature(function)
        places = list(own.parameters)
        told = DataKeywords.__annotations__
        extra = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=told[name].__forward_arg__)
            for name in GIVEN
        ]
        shown = [p for p in own.parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
        rest = [
            p for p in own.parameters.values() if p.kind is inspect.Parameter.VAR_KEYWORD and p.name != FOR_CHECKERS
        ]
        known = None if FOR_CHECKERS not in own.parameters else {*places, *GIVEN} - {FOR_CHECKERS}

        @functools.wraps(function)
        def called(*args: Any, **settings: Any) -> Any:
            given = {name: settings.pop(name, None) for name in GIVEN}
            found = list(args)
            for k, value in enumerate(found[: len(places)]):
                if places[k] in dimensions:
                    found[k] = in_si(value, dimensions[places[k]], places[k])
            for name in dimensions.keys() & settings.keys():
                settings[name] = in_si(settings[name], dimensions[name], name)
            if found:
                found[0] = as_given(found[0], given)
            elif places[0] in settings:
                settings[places[0]] = as_given(settings[places[0]], given)
            if known is not None and not settings.keys() <= known:
                other = next(name for name in settings if name not in known)
                raise TypeError(f"{function.__name__}() got an unexpected keyword argument {other!r}")
            return function(*found, **settings)

        # what help and documentation show
        vars(called)["__signature__"] = own.replace(parameters=[*shown, *extra, *rest])
        return cast(F, called)

    return wider


def as_given(data: Any, given: dict[str, Any]) -> xr.DataArray:
    """Return data as a signal; a signal is left as it is."""
    import xarray as xr

    known = {name: value for name, value in given.items() if value is not None}
    if not known and isinstance(data, xr.DataArray) and "sampling_rate" in data.attrs:
        return data
    # readers of files are not loaded for signals
    from gearmbs.signals.signal.inputs import to_signal

    return to_signal(data, **known)


def in_si(value: Any, dimension: str, name: str) -> Any:
    """Return a text with a unit, or a pair of these, in SI; numbers as they are."""
    if isinstance(value, str):
        try:
            return to_si(value, dimension, name)
        except (TypeError, ValueError) as error:
            raise SignalError(str(error)) from None
    if isinstance(value, Sequence) and any(isinstance(part, str) for part in value):
        return tuple(in_si(part, dimension, name) for part in value)
    return value
