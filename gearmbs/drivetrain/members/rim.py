"""The ring of a planetary stage whose rim bends under the planets that pass.

The rim is a thin ring that bends in its plane, `gearmbs.gears.ElasticRim`, held by its bolts to what carries it: the
ground or a housing. All meshes of its planets are then one element, "<stage> ring meshes", whose states are the rim's
modes; what is told of each mesh is taken from it. What turning would add to the modes' inertia is not in it, so that
the ring of a shaft stays rigid.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.drivetrain.part import require
from gearmbs.gears.elastic_rim import DEPTHS, UNIT, ElasticRim, RimModes
from gearmbs.gears.ideal_mesh import IdealMesh
from gearmbs.schema.described import check_keys

if TYPE_CHECKING:
    from gearmbs.gears.planetary_set import PlanetarySet

KEYS = tuple(ElasticRim.__dataclass_fields__)


def rim_of(given: Any, gears: PlanetarySet) -> ElasticRim:
    """Return the rim that is given, or that a table of its fields describes.

    Raises
    ------
    ValueError
        For what is no rim, and for ideal meshes, which have no place on it.
    """
    if not isinstance(given, ElasticRim):
        if not isinstance(given, Mapping):
            raise ValueError(f"rim is {given!r}; give a table, or a gearmbs.gears.ElasticRim")
        table: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in given.items()
        }
        check_keys(table, KEYS, "", ValueError, form="unknown key rim.{}")
        given = ElasticRim(**table)
    if any(isinstance(mesh, IdealMesh) for mesh in gears.meshes("ring")):
        raise ValueError("rim is given beside ideal meshes; it needs teeth that touch: leave ideal or rim out")
    return given


def check_rim(label: str, ring: str, *, turns: bool) -> None:
    """Refuse a rim that bends of a ring that turns.

    Raises
    ------
    DrivetrainError
    """
    require(
        not turns,
        f"{label}: rim is given, and ring is on shaft '{ring}', which turns: its modes are those of a ring at rest; "
        "put the ring on 'ground' or a housing, or leave rim out",
    )


def placed(rim: ElasticRim | None, angle: float) -> ElasticRim | None:
    """Return a rim with its bolts in the axes of a ring that is turned by an angle, rad, so that its teeth mesh.

    Those of a stage count from the x axis of its shafts, which do not turn.
    """
    return None if rim is None else replace(rim, bolts=tuple(bolt - angle for bolt in rim.bolts))


def ring_meshes_of(stage: str) -> str:
    """Return the name of the element that stands for the meshes of a ring whose rim bends."""
    return f"{stage} ring meshes"


def rim_meshes(train: Any) -> dict[str, tuple[str, int]]:
    """Return the stage and the planet's number, from 1, of each mesh with a ring whose rim bends, by its name."""
    stages = [stage for stage in train.planetary_stages if stage.rim is not None]
    return {f"{stage.planet(k)}-ring": (stage.name, k) for stage in stages for k in range(1, stage.gears.planets + 1)}


def told_of_mesh(part: Any, stage: str, number: int) -> dict[str, np.ndarray]:
    """Return what a solution tells of the mesh of a planet, from 1, with a ring whose rim bends."""
    told = part.diagnostics(ring_meshes_of(stage))
    return {name: told[f"{name}_{number}"] for name in ("normal_force", *DEPTHS)}


def with_rims(train: Any, parts: Any, frequencies: np.ndarray) -> Any:
    """Return where the energy of modes is, a ring whose rim bends being one part with its meshes.

    The rim moves, too: with q its amplitudes and m their masses, of which bodies have the inertia 1, a mode's energies
    are 1 + q^H m q times as large, and what the rim has more is strain.

    Parameters
    ----------
    train : Drivetrain
    parts : ModeParts
        As of `gearmbs.dae.analyses`.
    frequencies : ndarray, shape (k,)
        |s| of the modes, rad/s.
    """
    names, energy, damping, more = list(parts.names), parts.energy.copy(), parts.damping.copy(), 1.0
    for stage in train.planetary_stages:
        if stage.rim is None:
            continue
        name, modes = ring_meshes_of(stage.name), RimModes.of(stage.rim, stage.gears.ring)
        # amplitudes come before their rates
        states = [row for label, row in parts.states.items() if label.startswith(f"{name}.q")]
        q = UNIT * np.array(states)
        moving = np.einsum("ik,i,ik->k", q.conj(), modes.mass, q).real
        lost = np.einsum("ik,ij,jk->k", q.conj(), modes.damping, q).real
        own = [k for k, label in enumerate(names) if label == name or label.startswith(f"{name}[")]
        energy[:, own[0]] = energy[:, own].sum(axis=1) + moving
        with np.errstate(divide="ignore", invalid="ignore"):
            damping[:, own[0]] = damping[:, own].sum(axis=1) + np.where(
                frequencies > 0.0, 0.5 * lost / frequencies, 0.0
            )
        kept = [k for k in range(len(names)) if k not in own[1:]]
        names, energy, damping = [names[k] for k in kept], energy[:, kept], damping[:, kept]
        more = more + moving
    share = np.reshape(1.0 / more, (-1, 1))
    strain = {name: one * share for name, one in parts.strain.items()}
    return replace(
        parts, names=names, energy=energy * share, damping=damping * share, kinetic=parts.kinetic * share, strain=strain
    )
