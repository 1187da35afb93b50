"""Natural frequencies of a drivetrain that are as accurate as asked: how many modes and elements its shafts need.

Bodies that deform have as many coordinates as shapes are kept of them, and these come from finite elements. Fewer of
either make a train stiffer: by the theorem of minimum and maximum the k-th frequency of an undamped train falls with
each shape that is added, and so does that of conforming elements. A train with `MODES_BY` times the modes and
`ELEMENTS_BY` times the elements tells what the given ones are good for, number by number.

Twice as many would not do. The slowest shapes are kept, which are bending ones; those along the shaft come late, and
until the first of them is there the frequencies of axial motions do not change at all: between 2 and 16 modes one stood
at 739.376 Hz, and with 40 modes fell to 739.288.

References
----------
.. [1] L. Meirovitch, "Principles and Techniques of Vibrations", Prentice Hall 1997, section 5.4 (inclusion principle).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.drivetrain import DrivetrainError, Housing, Shaft
from gearmbs.drivetrain.members.sources import ALL, MODES
from gearmbs.flexible import FiniteElementModel, ModalModel
from gearmbs.studies.run.accuracy import FLOOR, asked_accuracy, per_cent
from gearmbs.wording import warn

if TYPE_CHECKING:
    from collections.abc import Callable

    from gearmbs.dae.analyses.modes import Modes
    from gearmbs.drivetrain import Drivetrain
    from gearmbs.units import QuantityLike

HARMONICS = 3
"""Mesh harmonics up to which frequencies are judged by default: those of records."""
ATTEMPTS = 3
"""Pairs of models at most, each with twice the modes and elements of the one before."""
MODES_BY, ELEMENTS_BY = 8, 4
"""Modes and elements of the finer of two models, of the coarser one's."""
SHARE = 0.2
"""Part of the difference that is taken as the error of the finer one: elements leave a fifteenth of it, shapes that are
left out of eight times as many less than the ones between."""


def accurate_modes(
    modes_of: Callable[[Drivetrain], Modes], train: Drivetrain, accuracy: QuantityLike, below: float | None
) -> Modes:
    """Return the modes of a drivetrain whose frequencies below a limit are as accurate as asked.

    Parameters
    ----------
    modes_of : callable
        Returns the modes of a train.
    train : Drivetrain
    accuracy : float or str
        Of each frequency, as a part of it.
    below : float, optional
        Hz; default `HARMONICS` times the highest mesh frequency.

    Returns
    -------
    Modes
        With ``errors``, Hz: NaN above the limit, and of what does not oscillate.

    Raises
    ------
    DrivetrainError
        If no mesh turns and no limit is given.

    Warns
    -----
    UserWarning
        If the accuracy is not reached with all modes of the finite elements, or with those that files hold.
    """
    wanted = asked_accuracy(accuracy, "each frequency")
    if below is None:
        below = HARMONICS * max((abs(train.kinematics.mesh_frequency(m.name)) for m in train.meshings), default=0.0)
    if not below > 0.0:
        raise DrivetrainError(
            f"drivetrain '{train.name}': accuracy = {accuracy!r}: no mesh turns; give the frequency up to which modes "
            "are to be known, below = ... Hz"
        )
    coarse = train
    for attempt in range(ATTEMPTS):
        fine = _finer(coarse, MODES_BY, ELEMENTS_BY)
        before = modes_of(coarse)
        found = before if fine is None else modes_of(fine)
        errors = frequency_errors(found, before, below)
        chosen = np.isfinite(errors)
        worst = float((errors[chosen] / found.frequencies[chosen]).max(initial=0.0))
        following = _finer(coarse, 2, 2)
        if worst <= wanted or following is None or attempt == ATTEMPTS - 1:
            break
        coarse = following
    found.errors = errors
    if worst > wanted:
        warn(
            f"drivetrain '{train.name}': frequencies below {below:g} Hz are known to {per_cent(worst)}, "
            f"{per_cent(wanted)} was asked for; bodies with modes from files have no more of them, others take "
            f"modes = {ALL!r} and more elements"
        )
    return found


def frequency_errors(found: Modes, before: Modes, below: float) -> np.ndarray:
    """Return the errors of frequencies below a limit from those of a coarser model, Hz; NaN of others.

    What the coarser model has too much is what it lacks; the finer one lacks `SHARE` of it at most.
    """
    errors = np.full(len(found.frequencies), np.nan)
    places, others = found.oscillating, before.frequencies[before.oscillating]
    places = places[np.argsort(found.frequencies[places])]
    others = np.sort(others)
    for number, place in enumerate(places):
        frequency = found.frequencies[place]
        if frequency <= below:
            apart = abs(others[number] - frequency) if number < others.size else np.inf
            errors[place] = max(SHARE * apart, FLOOR * frequency)
    return errors


def _finer(train: Drivetrain, modes: int, elements: int) -> Drivetrain | None:
    """Return a train with so many times the modes and elements, None if nothing of it is made of these."""
    changed = train
    for shaft in train.shafts:
        if isinstance(shaft, Shaft) and isinstance(shaft.model, FiniteElementModel):
            if shaft.modes != ALL:
                changed = changed.changed(shaft.name, modes=modes * (shaft.modes or MODES))
        elif isinstance(shaft, Shaft) and shaft.model is None and shaft.modes is not None:
            more = ALL if shaft.modes == ALL else modes * shaft.modes
            changed = changed.changed(shaft.name, modes=more, elements=elements * shaft.elements)
    for housing in train.housings:
        counted = isinstance(housing, Housing) and housing.model is not None and housing.modes != ALL
        if counted and not isinstance(housing.model, ModalModel):
            changed = changed.changed(housing.name, modes=modes * (housing.modes or MODES))
    return None if changed is train else changed
