"""Whether the numbers of a modal neutral file fit each other: a file may be whole and yet lie."""

from __future__ import annotations

import warnings

import numpy as np

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.fe_model import MassProperties
from gearmbs.flexible.mnf_content import ModalNeutralFile

SAME_MASS = 1e-3
"""Relative difference of the sum of nodal masses from the body's."""
SAME_CENTRE = 1e-2
"""Distance of their centre from the body's, against its size."""
SAME_NUMBERS = 1e-6
"""Relative differences of numbers that a block has twice, in other units."""
LUMPED = 10.0
"""Factor between a generalised mass and that of the nodal masses: consistent masses, lumped, change that of the
fastest modes; other units or nodes change it by thousands."""


def check_numbers(found: ModalNeutralFile, label: str) -> None:
    """Refuse a file whose blocks contradict each other, and warn if its units hardly are those of its numbers.

    Parameters
    ----------
    found : ModalNeutralFile
    label : str
        Name of the file.

    Raises
    ------
    FlexibleError
        With the block that does not fit, and a remedy.
    """
    unit = found.in_si()
    if not found.mass > 0.0:
        raise FlexibleError(f"{label}: mass = {found.mass}; it must be positive")
    total = found.nodal_masses.sum()
    if abs(total - found.mass) > SAME_MASS * found.mass:
        raise FlexibleError(
            f"{label}: nodal masses sum to {total:.6g}, the body has {found.mass:.6g}; the blocks belong to different "
            "bodies or units, write the file anew"
        )
    centre = found.nodal_masses @ found.positions / total
    size = np.ptp(found.positions, axis=0).max()
    if np.abs(centre - found.centre).max() > SAME_CENTRE * size:
        raise FlexibleError(
            f"{label}: the centre of the nodal masses is {centre}, that of the body {found.centre}; coordinates or "
            "masses are in other units, or in another order"
        )
    _check_eigenvalues(found, label)
    _check_shapes(found, label)
    diagonal = float(np.linalg.norm(np.ptp(found.positions, axis=0))) * unit["length"]
    scaled = MassProperties(found.mass * unit["mass"], found.centre * unit["length"], found.inertia)
    for doubt in scaled.doubts(diagonal):
        warnings.warn(f"{label}: {doubt}; the file names {', '.join(found.units)}", stacklevel=4)


def _check_eigenvalues(found: ModalNeutralFile, label: str) -> None:
    """Refuse frequencies, eigenvalues and generalised stiffness that do not say the same."""
    value, hertz, root, mass, stiffness = found.eigenvalues.T
    turning = 2.0 * np.pi * hertz
    if np.any(np.abs(root - turning) > SAME_NUMBERS * np.maximum(turning, 1.0)):
        raise FlexibleError(f"{label}: frequencies in Hz and rad/s do not agree; the block of eigenvalues is not one")
    # rigid motions have rounding errors of either sign
    small = SAME_NUMBERS * np.abs(value).max(initial=0.0)
    wrong = np.abs(value - root**2) > SAME_NUMBERS * root**2 + small
    wrong |= np.abs(stiffness - mass * value) > 1e3 * SAME_NUMBERS * np.abs(stiffness) + small * np.abs(mass)
    if wrong.any():
        k = int(np.argmax(wrong))
        raise FlexibleError(
            f"{label}: mode {found.mode_ids[k]}: eigenvalue {value[k]:.6g}, frequency {hertz[k]:.6g}, generalised mass "
            f"{mass[k]:.6g} and stiffness {stiffness[k]:.6g} do not fit each other; the block of eigenvalues is damaged"
        )


def _check_shapes(found: ModalNeutralFile, label: str) -> None:
    """Refuse shapes whose mass is far from the generalised one; without nodal inertias it may be less."""
    moved, turned = found.shapes[:, :, :3], found.shapes[:, :, 3:]
    with np.errstate(over="ignore"):
        own = (moved**2).sum(axis=2) @ found.nodal_masses
        own += np.einsum("npi,pij,npj->n", turned, found.inertias(), turned, optimize=True)
    general = found.eigenvalues[:, 3]
    wrong = ~(own <= LUMPED * general)
    if found.nodal_inertias is not None:
        wrong |= own * LUMPED < general
    if wrong.any():
        k = int(np.argmax(wrong))
        raise FlexibleError(
            f"{label}: mode {found.mode_ids[k]}: its shape has the mass {own[k]:.6g} with the nodal masses, its "
            f"generalised mass is {general[k]:.6g}; shapes or masses are in other units, of other nodes, or damaged"
        )
