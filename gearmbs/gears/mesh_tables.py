"""Quasi-static tables of a mesh for programs that simulate no tooth contact: as CSV, and as a Modelica component.

A mesh without dynamics is one function F(phase, delta): the normal force in the transverse plane against the driver's
angle and the lag delta of the driven wheel behind the ratio, both at the base circles. It comes from the contact kernel
at rest, both flanks and the backlash between them included. Transmission error and stiffness under a torque T on the
driven wheel are its inverse, F(phase, delta) = T / r_b2, and its slope there.

With the wheels' angles phi_1 and phi_2 from the reference position, s = 1 of external and -1 of internal pairs and r
the sense of rotation,

    delta = r (r_b1 phi_1 + s r_b2 phi_2),   phase = r phi_1 z_1 / (2 pi),
    torque of the mesh on the driver -r r_b1 F, on the driven wheel -r s r_b2 F.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from gearmbs.files import whole_file
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.transmission import StaticMesh, load_of, loaded_transmission_error
from gearmbs.progress import waiting
from gearmbs.units import Quantity, to_si

ROOM = 1.25
"""Largest deflection of the table by that of the largest torque: dynamic forces exceed it, and further ones are
extrapolated."""
HALVINGS = 20
"""Of the search for where teeth touch: to a millionth of the backlash, far below the distance of two deflections."""
FEWEST_LAGS = 9
"""Least number of deflections of a flank: a table of fewer is no curve of contact that sets in."""
COLUMNS = ("torque (N.m)", "phase (pitches of the driver)", "driver angle (rad)", "transmission error (m)",
           "stiffness (N/m)")  # fmt: skip
"""Columns of the file of transmission error and stiffness."""
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
"""Names that every program takes."""


@dataclass(frozen=True, eq=False)
class MeshTables:
    """Transmission error and stiffness over angle and torque, and the force over angle and deflection.

    Attributes
    ----------
    phase : ndarray, shape (p,)
        Driver angle over the pitch angle; the tables repeat after ``cycles``.
    torques : ndarray, shape (k,)
        On the driven wheel, N m.
    error : ndarray, shape (k, p)
        Lag of the driven wheel behind the ratio at its base circle, m.
    stiffness : ndarray, shape (k, p)
        Tangent stiffness along the line of action in the transverse plane, N/m.
    deflection : ndarray, shape (n,)
        Lags of the table of forces, m; beyond the backlash, below zero, the other flanks touch.
    force : ndarray, shape (p, n)
        Torque on the driven wheel over its base radius, N; negative on the other flanks.
    teeth : tuple of int
    base_radii : tuple of float
        m.
    sign : int
        1 of external, -1 of internal pairs.
    rotation : int
        Sense in which the driver turns.
    cycles : int
        Mesh cycles after which the tables repeat.
    """

    phase: np.ndarray
    torques: np.ndarray
    error: np.ndarray
    stiffness: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    teeth: tuple[int, int]
    base_radii: tuple[float, float]
    sign: int
    rotation: int
    cycles: int = 1

    def to_csv(self, folder: str | Path, name: str = "mesh") -> list[Path]:
        """Write both tables; return the paths.

        ``<name>_transmission_error.csv`` has a row for each torque and phase (see `COLUMNS`);
        ``<name>_force.csv`` has a row for each phase and a column for each deflection, whose values are in its head.
        """
        _check_name(name)
        error, force = (Path(folder) / f"{name}_{what}.csv" for what in ("transmission_error", "force"))
        angle = self.phase * self.rotation * math.tau / self.teeth[0]
        with whole_file(error) as part, part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            for torque, errors, stiffnesses in zip(self.torques, self.error, self.stiffness, strict=True):
                writer.writerows(
                    [_shown(v) for v in row]
                    for row in zip(np.full(angle.size, torque), self.phase, angle, errors, stiffnesses, strict=True)
                )
        with whole_file(force) as part, part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["phase \\ deflection (m), force (N)", *map(_shown, self.deflection)])
            writer.writerows(
                [_shown(phase), *map(_shown, row)] for phase, row in zip(self.phase, self.force, strict=True)
            )
        return [error, force]

    def to_modelica(self, folder: str | Path, name: str = "GearMesh") -> Path:
        """Write a Modelica package with the tables and a component between two rotational flanges; return its path.

        The component `Mesh` of the package interpolates the force linearly (Modelica Standard Library 4,
        ``CombiTable2Ds``), extrapolates beyond the largest deflection, and has a damping coefficient of its own. It
        knows torques alone: bearing forces, axial forces of helical wheels and friction are not in it.
        """
        _check_name(name)
        path = Path(folder) / f"{name}.mo"
        # the first phase again at the end: the table is that of whole cycles
        phase = np.append(self.phase, self.cycles)
        forces = np.vstack([self.force, self.force[:1]])
        torque = np.concatenate([np.append(0.0, self.torques)[None], _headed(phase, self.error.T)])
        stiffness = np.concatenate([np.append(0.0, self.torques)[None], _headed(phase, self.stiffness.T)])
        force = np.concatenate([np.append(0.0, self.deflection)[None], np.column_stack([phase, forces])])
        tables = {"errorTable": torque, "stiffnessTable": stiffness, "forceTable": force}
        text = MODELICA.format(
            name=name,
            z1=self.teeth[0],
            z2=self.teeth[1],
            rb1=_shown(self.base_radii[0]),
            rb2=_shown(self.base_radii[1]),
            kind="external" if self.sign > 0 else "internal",
            sign=self.sign,
            rotation=self.rotation,
            cycles=self.cycles,
            least=_shown(self.deflection[0]),
            most=_shown(self.deflection[-1]),
            **{key: _matrix(table) for key, table in tables.items()},
        )
        with whole_file(path) as part:
            part.write_text(text, encoding="utf-8")
        return path


@waiting("tables of the mesh")
def mesh_tables(
    pair: Mesh,
    torques: Sequence[Quantity] | None = None,
    *,
    points: int = 100,
    lags: int = 33,
    cycles: int = 1,
    slices: int | None = None,
) -> MeshTables:
    """Return the quasi-static tables of a mesh.

    Parameters
    ----------
    pair : GearPair or Mesh
    torques : sequence of float or str, optional
        On the driven wheel, N m, increasing; default a tenth to twice that of the pair's operating point.
    points : int
        Phases over a mesh cycle.
    lags : int
        Deflections of each flank.
    cycles : int
        Mesh cycles; of faults of single teeth the teeth of the wheel for a turn.
    slices : int, optional
        As for `loaded_transmission_error`.

    Raises
    ------
    ValueError
        For torques that do not increase from above zero, or that no tooth carries.

    Examples
    --------
    >>> from gearmbs.gears import GearPair, mesh_tables
    >>> tables = mesh_tables(GearPair.paper(), ["50 N m", "100 N m"], points=20)
    >>> tables.error.shape, len(tables.force)
    ((2, 20), 20)
    """
    if lags < FEWEST_LAGS or lags != int(lags):
        raise ValueError(f"lags is {lags!r}; give a whole number from {FEWEST_LAGS} up")
    usual = pair.operating_point.torque
    given = [share * usual for share in (0.1, 0.25, 0.5, 1.0, 1.5, 2.0)] if torques is None else list(torques)
    loads = np.array([load_of(pair, one) for one in given])
    if loads.size == 0 or np.any(np.diff(loads) <= 0.0):
        raise ValueError(f"torques are {', '.join(map(str, given)) or 'none'}; give increasing ones from above zero")
    found = [loaded_transmission_error(pair, load, points, slices, cycles=cycles) for load in loads]
    geometry, phase = pair.geometry, found[0].phase
    mesh = StaticMesh(pair, slices)
    radius, side = geometry.driven.base_radius, mesh.turning
    yielding = ROOM * max(float(np.abs(one.error).max()) for one in found)

    def carried(step: float, lag: float) -> float:
        angle = step * mesh.rotation * math.tau / geometry.driver.teeth
        return -side * mesh.torque(angle, mesh.ideal_angle(angle) + side * lag / radius)[0] / radius

    apart = max(to_si(geometry.normal_backlash, "length", "backlash"), 0.0)
    lag = _lags(yielding, *_touching(carried, phase, yielding, apart), lags)
    force = np.array([[carried(step, one) for one in lag] for step in phase])
    return MeshTables(
        phase,
        loads,
        np.array([one.error for one in found]),
        np.array([one.stiffness for one in found]),
        lag,
        force,
        (geometry.driver.teeth, geometry.driven.teeth),
        (geometry.driver.base_radius, radius),
        int(geometry.sign),
        int(mesh.rotation),
        int(cycles),
    )


def _touching(
    carried: Callable[[float, float], float], phase: np.ndarray, yielding: float, apart: float
) -> tuple[float, float, float]:
    """Return the lag to which the other flanks are pressed, the largest at which they touch anywhere, and the least at
    which those at work do, m.

    Perfect teeth touch where the backlash `apart` ends; those that stand forward or back do so within it.
    """
    far, other, work = -apart - yielding, -apart, 0.0
    for step in phase:
        # the force rises with the lag: below zero, none, above zero
        at_step = partial(carried, float(step))
        if at_step(0.0) > 0.0:
            work = min(work, _edge(lambda force: force > 0.0, at_step, far, 0.0))
        if apart > 0.0 and at_step(-apart) < 0.0:
            other = max(other, _edge(lambda force: force >= 0.0, at_step, -apart, yielding))
    return far, other, work


def _edge(beyond: Callable[[float], bool], force: Callable[[float], float], low: float, high: float) -> float:
    """Return from where a force over the lag is beyond what is asked, by bisection."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if beyond(force(middle)) else (middle, high)
    return 0.5 * (low + high)


def _lags(yielding: float, far: float, other: float, work: float, count: int) -> np.ndarray:
    """Return deflections, m: into either flank from where the first tooth touches, what is between them free.

    Their squares, of an even row, so that torques far below the largest have many of them.
    """
    into = np.linspace(0.0, 1.0, count) ** 2
    if work <= other:
        # somewhere there is no room between the flanks, as of teeth without backlash at zero
        low = min(other, 0.0)
        return np.union1d(far * into, low + (yielding - low) * into)
    flanks = [other + (far - other) * into, work + (yielding - work) * into]
    return np.union1d(np.concatenate(flanks), [0.5 * (other + work), 0.0])


def _headed(phase: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return a table with the phases in front, its first row again at the end."""
    return np.column_stack([phase, np.vstack([columns, columns[:1]])])


def _check_name(name: str) -> None:
    if not NAME.fullmatch(name):
        raise ValueError(f"name is {name!r}; give letters, digits and underscores, a letter first")


def _shown(value: float) -> str:
    return f"{float(value):.9g}"


def _matrix(table: np.ndarray) -> str:
    """Return a matrix as Modelica writes it, a row a line."""
    return "[\n      " + ";\n      ".join(", ".join(map(_shown, row)) for row in table) + "]"


MODELICA = """within ;
package {name} "Quasi-static tooth contact of a pair of {z1} and {z2} teeth, made by gearmbs"
  extends Modelica.Icons.Package;
  constant Integer z[2] = {{{z1}, {z2}}} "Teeth of driver and driven wheel";
  constant Modelica.Units.SI.Length rb[2] = {{{rb1}, {rb2}}} "Base radii";
  constant Integer sign = {sign} "1: external, -1: internal; this pair is {kind}";
  constant Integer rotation = {rotation} "Sense in which the driver turns";
  constant Integer cycles = {cycles} "Mesh cycles after which the tables repeat";
  constant Real errorTable[:, :] =
    {errorTable}
    "Transmission error, m: rows over the phase in mesh cycles, columns over the torque on the driven wheel, N.m";
  constant Real stiffnessTable[:, :] =
    {stiffnessTable}
    "Mesh stiffness along the line of action, N/m, over the same";
  constant Real forceTable[:, :] =
    {forceTable}
    "Force along the line of action, N: rows over the phase, columns over the deflection, {least} to {most} m";

  model Mesh "Torques of the tooth contact between driver (flange_a) and driven wheel (flange_b)"
    extends Modelica.Mechanics.Rotational.Interfaces.PartialTwoFlanges;
    parameter Modelica.Units.SI.TranslationalDampingConstant d = 0 "Damping while teeth touch";
    Modelica.Units.SI.Length deflection "Lag of the driven wheel behind the ratio, at the base circles";
    Modelica.Units.SI.Force f "Along the line of action; negative on the other flanks";
    Real phase "Driver angle over its pitch angle";
  protected
    Modelica.Blocks.Tables.CombiTable2Ds table(
      table=forceTable,
      smoothness=Modelica.Blocks.Types.Smoothness.LinearSegments,
      extrapolation=Modelica.Blocks.Types.Extrapolation.LastTwoPoints);
  equation
    phase = rotation*flange_a.phi*z[1]/(2*Modelica.Constants.pi);
    deflection = rotation*(rb[1]*flange_a.phi + sign*rb[2]*flange_b.phi);
    table.u1 = noEvent(phase - cycles*floor(phase/cycles));
    table.u2 = deflection;
    f = table.y + (if noEvent(abs(table.y) > 0) then d*der(deflection) else 0);
    flange_a.tau = rotation*rb[1]*f;
    flange_b.tau = rotation*sign*rb[2]*f;
  end Mesh;
end {name};
"""
"""The package, with fields in braces."""
