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
"""The newest release of numba that the own stages were tried with: a later one may move the private parts they use."""

STAND_INS = ("jit", "views", "lanes", "pointers")
"""Modules of which the plain mode has its own, in ``plain``."""

WITH_PRIVATE_PARTS = ("own.jit", "own.views", "own.lanes", "own.pointers")
"""Modules that show, when they are imported, whether numba has what the own stages use."""


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
    _warn(f"numba {found} is newer than {'.'.join(map(str, NEWEST_KNOWN))}, the newest that gearmbs was tried with")
    return True


def _warn(reason: str) -> None:
    warnings.warn(
        f"{reason}: kernels are compiled in the plain mode. The results are the same; the first run compiles for some "
        f"minutes, and each takes about twice the time. Set {COMPILER}=plain to leave out this remark, or "
        f"{COMPILER}=own to try the usual mode",
        stacklevel=3,
    )


def _numba() -> str:
    try:
        return version("numba")
    except PackageNotFoundError:
        # installed by other means than a package; what there is will be told when it is imported
        return ""


def _lacks_private_parts(chosen: str) -> bool:
    """Return whether numba has not what the own stages use, with a warning; what was imported of them is forgotten.

    It is asked where numba has been imported, and where the own stages have not yet been used with this version.

    Raises
    ------
    ImportError
        If the own stages were asked for, or numba cannot be imported at all.
    """
    try:
        cache = import_module(f"{__name__}.cache")
        if "numba" not in sys.modules and cache.known():
            return False
        for name in WITH_PRIVATE_PARTS:
            import_module(f"{__name__}.{name}")
        cache.know()
    except (ImportError, AttributeError) as error:
        reason = f"numba {_numba()} has not what the usual mode of gearmbs uses ({error})"
        if chosen:
            raise ImportError(f"{reason}: leave out {COMPILER}={chosen}, or set it to plain") from error
        import_module("numba")
        for name in [name for name in sys.modules if name.startswith(f"{__name__}.")]:
            del sys.modules[name]
        _warn(reason)
        return True
    return False


_chosen = os.environ.get(COMPILER, "")
PLAIN = is_plain(_chosen, _numba())
PLAIN = PLAIN or _lacks_private_parts(_chosen)
if PLAIN:
    # processes that this one starts need not say so again
    os.environ[COMPILER] = "plain"
    for _name in STAND_INS:
        sys.modules[f"{__name__}.{_name}"] = globals()[_name] = import_module(f"{__name__}.plain.{_name}")
