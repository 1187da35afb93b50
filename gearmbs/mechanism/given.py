"""What a modeller wrote with units, kept by the names of bodies, joints and forces, for showing it again."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Sequence
from typing import Any, TypeVar, cast

from gearmbs.units import NUMBER

F = TypeVar("F", bound=Callable)

QUANTITY = re.compile(rf"\s*(?>{NUMBER.pattern})\s*[A-Za-zµμ°]")
"""Beginning of a number with a unit; an expression such as ``10*TIME`` has an operator there."""


def keeps_given(method: F) -> F:
    """Let a method that adds something by name note in ``self.given`` which settings were texts with units."""
    signature = inspect.signature(method)

    @functools.wraps(method)
    def called(self: Any, *args: Any, **settings: Any) -> Any:
        made = method(self, *args, **settings)
        arguments = dict(signature.bind(self, *args, **settings).arguments)
        arguments |= arguments.pop("where", {})
        texts = {key: value for key, value in arguments.items() if key not in ("self", "name") and has_quantity(value)}
        if texts:
            self.given[str(arguments["name"])] = texts
        return made

    return cast(F, called)


def has_quantity(value: Any) -> bool:
    """Whether a setting is a number with a unit, or a vector that holds one."""
    if isinstance(value, str):
        return QUANTITY.match(value) is not None
    return isinstance(value, Sequence) and any(has_quantity(item) for item in value)
