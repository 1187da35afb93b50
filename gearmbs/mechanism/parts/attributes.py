"""Objects with the attributes they are made with: a slip in a name is no setting that is lost, a value is one checked.

Whoever assigns to an attribute of what has been made is told if nothing would come of it, and has the value read as it
is where the object is made.
"""

from __future__ import annotations

from abc import ABCMeta
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from gearmbs.dae.problem import ModelError
from gearmbs.wording import did_you_mean

Reader = Callable[[Any, str], Any]
"""From a value that is given, and the name of its field for messages, to the one that is kept, or a ModelError."""


class Made(ABCMeta):
    """Metaclass that marks an object when its whole ``__init__`` has run, also that of a class derived by a user."""

    def __call__(cls, *args: Any, **options: Any) -> Any:
        made = super().__call__(*args, **options)
        vars(made)["_made"] = True
        return made


class OwnAttributes(metaclass=Made):
    """What a mechanism and its parts share: they take values of the attributes they have, and refuse others by name."""

    reads: ClassVar[Mapping[str, Reader]] = {}
    """How values are read that are assigned, by attribute."""
    settled: ClassVar[tuple[str, ...]] = ()
    """Attributes from which other parts have been made already: another value would leave those as they are."""

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute that there is; names with a leading underscore are a class's own affair.

        Raises
        ------
        ModelError
            For a name that is none, an attribute that is settled, and a value that cannot be one.
        """
        own, kind = vars(self), type(self)
        if "_made" in own and name[0] != "_":
            label = f"{kind.__name__} '{own.get('name', '')}'"
            if name not in own and not hasattr(kind, name):
                known = [key for key in own if key[0] != "_" and key not in kind.settled]
                raise ModelError(
                    f"{label}: it has no attribute '{name}', so that {name} = {value!r} would do nothing; "
                    + did_you_mean(name, known, otherwise=f"it has {', '.join(known)}")
                )
            if name in kind.settled:
                raise ModelError(
                    f"{label}: {name} = {value!r} would not reach what was made from it; make another one with it"
                )
            if name in kind.reads:
                value = kind.reads[name](value, f"{label}: {name}")
        super().__setattr__(name, value)
