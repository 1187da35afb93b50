"""The files of the presets: drivetrains in TOML beside this module, which ``gearmbs run`` takes, too, and choices."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from gearmbs.drivetrain import Drivetrain, Housing
from gearmbs.drivetrain.description import read_description
from gearmbs.drivetrain.part import Part
from gearmbs.schema.described import read_toml

FOLDER = Path(__file__).parent
"""Where the files are."""
PRESETS = ("bench", "crank_slider", "gearbox", "grc_750kw", "nrel_5mw", "rattle", "resonance")


@cache
def preset_train(name: str) -> Drivetrain:
    """Return the drivetrain of ``<name>.toml``, as the file has it."""
    return read_description(FOLDER / f"{name}.toml").train


def with_values(train: Drivetrain, values: Mapping[str, Part | Mapping[str, Any]]) -> Drivetrain:
    """Return a drivetrain with other values of parts: by the name of a part some of its fields, or another part."""
    return train.with_parts(
        *(new if isinstance(new, Part) else replace(train.part(name), **new) for name, new in values.items())
    )


def on_mounts(housing: Housing, mass: float, stiffness: float, box: tuple[float, float, float]) -> Housing:
    """Return a housing that is a solid box on its mounts, at 5 % of critical damping.

    Parameters
    ----------
    housing : Housing
    mass : float
        kg.
    stiffness : float
        Of each mount, N/m.
    box : tuple of float
        Along x, y and z, m.
    """
    x, y, z = box
    inertia = mass * (y**2 + z**2) / 12.0, mass * (x**2 + z**2) / 12.0, mass * (x**2 + y**2) / 12.0
    count = len(housing.mounts)
    c = 2.0 * 0.05 * math.sqrt(count * stiffness * mass) / count
    # a file puts the housing's name before that of a mount
    mounts = [
        replace(m, name=m.name.removeprefix(f"{housing.name} "), stiffness=(stiffness,) * 3, damping=(c, c, c))
        for m in housing.mounts
    ]
    return replace(housing, mass=mass, inertia=inertia, mounts=tuple(mounts))


class BenchChoice(NamedTuple):
    """One choice of a preset.

    Attributes
    ----------
    what, chosen, why : str
    """

    what: str
    chosen: str
    why: str


def choices(name: str, values: Mapping[str, Any]) -> list[BenchChoice]:
    """Return the choices of a preset, a table of ``choices.toml``, with values filled in."""
    table = read_toml(FOLDER / "choices.toml")[name]
    return [BenchChoice(what, *(text.format_map(values) for text in texts)) for what, texts in table.items()]
