"""How compiled code is made, kept, shipped and found: all that knows more of numba than its decorators.

The stages of this package go around parts of numba, and so fit the versions they were tried with. In the *plain mode*
modules of ``plain`` take the place of those of the same names here: they leave compiling, linking and keeping to
numba's documented interface. Results are the same to rounding; compiling takes longer, and runs some.

The environment variable `COMPILER` chooses: ``own``, ``plain``, or, if it is not set, the own stages unless numba is
newer than `NEWEST_KNOWN`.
"""

import os
import re
import sys
import warnings
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version

COMPILER = "GEARMBS_COMPILER"
NEWEST_KNOWN = (0, 68)
"""The newest release of numba that the own stages were tried with."""


def is_plain(chosen: str, found: str) -> bool:
    """Return whether the plain mode is to be taken; warn where that is because of the version of numba.

    Parameters
    ----------
    chosen : str
        Value of `COMPILER`, empty if it is not set.
    found : str
        Version of numba.

    Raises
    ------
    ValueError
        If the value is neither of the two.
    """
    if chosen not in ("", "own", "plain"):
        raise ValueError(f'{COMPILER} = {chosen!r}: set it to "plain" or "own", or leave it out')
    release = tuple(int(part) for part in re.findall(r"\d+", found)[:2])
    if chosen or release <= NEWEST_KNOWN:
        return chosen == "plain"
    newest = ".".join(map(str, NEWEST_KNOWN))
    warnings.warn(
        f"numba {found} is newer than {newest}, the newest that gearmbs compiles with in its own way: kernels are "
        f"compiled in the plain mode, which takes longer and has the same results; set {COMPILER}=plain to say that "
        f"this is meant, or {COMPILER}=own to try the own way",
        stacklevel=2,
    )
    return True


def _numba() -> str:
    try:
        return version("numba")
    except PackageNotFoundError:
        # installed by other means than a package; what there is will be told when it is imported
        return ""


PLAIN = is_plain(os.environ.get(COMPILER, ""), _numba())
STAND_INS = ("jit", "pointers")
"""Modules of which the plain mode has its own, in ``plain``."""

if PLAIN:
    for _name in STAND_INS:
        sys.modules[f"{__name__}.{_name}"] = globals()[_name] = import_module(f"{__name__}.plain.{_name}")
