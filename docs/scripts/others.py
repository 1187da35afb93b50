"""Numbers that other people have published or printed, each beside ours: the rows of the page "Against other people".

The models are those of the test suite, which asserts the same numbers with its own bounds.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from benchmarks import iftomm
from gearmbs.mechanism import linear_modes
from tests.adams import test_reference_numbers as joints
from tests.drivetrain import test_planetary_stages as turbines
from tests.flexible import test_large_motion as beams
from tests.flexible import test_modal_shaft as blades
from tests.flexible import test_published_crank as crank
from tests.flexible import test_rotor as rotors
from tests.gears import test_cylindrical_geometry as geometry
from tests.gears import test_planetary as planetary
from tests.gears import test_stiffness as stiffness

Row = tuple[str, float, float]
"""Quantity with its unit, their number, ours."""


def table(name: str) -> pd.DataFrame:
    """Return the rows of a source with the difference in parts of their number."""
    rows = [(what, f"{theirs:.6g}", f"{ours:.6g}", _apart(theirs, ours)) for what, theirs, ours in _rows(name)]
    return pd.DataFrame(rows, columns=["quantity", "theirs", "ours", "difference"]).set_index("quantity")


@functools.cache
def _rows(name: str) -> list[Row]:
    """Return the rows of a source; the page asks for them twice."""
    return list(SOURCES[name].rows())


def _apart(theirs: float, ours: float) -> str:
    """Return how far ours is from theirs, relatively; absolutely where theirs is 0."""
    return f"{(ours - theirs) / theirs:+.1e}" if theirs else f"{ours - theirs:+.1e} (absolute)"


def _modes_of_rotor() -> Iterator[Row]:
    """Example 5.9.1 of the book with its six elements; the last row by ROSS 2.3.0 with 48."""
    printed = {"0 rpm": (86.66, 274.31, 716.78), "4000 rpm": (85.39, 87.80, 251.78, 294.71, 600.18)}
    rotor = rotors.friswell(elements=6)
    at_rest = rotor.modes(0.0, 6).frequencies[::2]
    for number, (theirs, ours) in enumerate(zip(printed["0 rpm"], at_rest), 1):
        yield f"frequency {number} at rest, Hz", theirs, ours
    for number, (theirs, ours) in enumerate(zip(printed["4000 rpm"], rotor.modes("4000 rpm", 5).frequencies), 1):
        yield f"frequency {number} at 4000 rpm, Hz", theirs, ours


def _rotor_of_ross() -> Iterator[Row]:
    rotor = rotors.friswell()
    for number, (theirs, ours) in enumerate(zip((86.658, 274.307, 716.565), rotor.modes(0.0, 6).frequencies[::2]), 1):
        yield f"frequency {number} at rest, Hz", theirs, ours
    yield "first torsional frequency, Hz", 650.407, rotors.friswell("torsional").modes(0.0, 1).frequencies[0]


def _stiffness_of_ross() -> Iterator[Row]:
    pair = stiffness.ross_pair()
    yield "contact ratio", 1.78978, pair.contact_ratio
    yield "Hertzian stiffness, N/m", 3555868607.9093266, stiffness.hertz_stiffness(pair)
    yield "largest mesh stiffness, N/m", 4.0966e8, stiffness.mesh_stiffness(pair, sainsot=True).maximum


def _modes_of_planets() -> Iterator[Row]:
    """Rotational, translational and planet modes of the set with three and with five planets."""
    for count, (single, double, planets) in planetary.TABLE.items():
        found = linear_modes(planetary.published_mechanism(planetary.published_set(count))).frequencies
        for kind, values in (("rotational", single), ("translational", double), ("planet", planets)):
            for theirs in values:
                yield f"{count} planets, {kind} mode, Hz", theirs, found[np.abs(found - theirs).argmin()]


def _blade() -> Iterator[Row]:
    for spin, *theirs in blades.BLADE:
        for number, (value, ours) in enumerate(zip(theirs, blades.blade_frequencies(spin)), 1):
            yield f"speed {spin}, flapwise mode {number}", value, ours


def _princeton() -> Iterator[Row]:
    """A row of seven: the strip clamped at 45 degrees."""
    for force, columns in beams.PRINCETON.items():
        ours = beams.princeton(force, 45, 24, beams.SECTION_OF_FOUR_CELLS)
        for axis, column, value in zip(("stiff", "soft"), columns, ours):
            yield f"tip along the {axis} axis at {force} N and 45 deg, m", column[3], value


def _princeton_of_exudyn() -> Iterator[Row]:
    """Its torsion constant is 9 % less than that of the rows above; beams of 16 elements."""
    h, t = 12.3777e-3, 3.2024e-3
    ours = beams.princeton(13.345, 60, 24, 0.198 * (h * t**3 + t * h**3) / 12)
    for axis, theirs, value in zip(("stiff", "soft"), (0.0118996, 0.1817173), ours):
        yield f"tip along the {axis} axis at 13.345 N and 60 deg, m", theirs, value


def _spin_up() -> Iterator[Row]:
    m, tip = beams.spun_modes("root")
    yield "largest lag of the tip, m", -0.5737, float(beams.lag_of(m.simulate(9.0, rate=100, tol=1e-6), tip).min())


def _slider_crank() -> Iterator[Row]:
    found, *_ = crank.end_of_run()
    units = {"angle": "rad", "block": "m", "rod speed": "rad/s", "block speed": "m/s"}
    for what, theirs in crank.PUBLISHED.items():
        yield f"{what} at 0.1 s, {units[what]}", theirs, found[what]


def _mechanisms() -> Iterator[Row]:
    """Problems of the library of the technical committee; figures that were read have two digits."""
    for name in ("A01", "A02", "A04", "A05"):
        for published, ours in iftomm.run(name).published:
            yield f"{name} at {published.t:g} s, component {published.component + 1}", published.value, ours


def _joints_of_adams() -> Iterator[Row]:
    """The largest of three numbers of each table at its last time."""
    words = {"Pos": "position, m", "Vel": "velocity, m/s", "Acc": "acceleration, m/s2", "Force": "force, N"}
    for case, (deck, numbers) in joints.CASES.items():
        result = joints.run(joints.HEAD.format(name=case, **deck), 5.0, 500)
        last = {kind: second for kind, second in numbers if kind in words}
        for kind, second in last.items():
            theirs = numbers[kind, second]
            largest = int(np.abs(theirs).argmax())
            ours = result.request(joints.REQUESTS[kind])[round(100 * second), 1 + largest]
            yield f"{case}, {words[kind]}, at {second:g} s", theirs[largest], ours


def _helical_example() -> Iterator[Row]:
    pair = geometry.helical_example()
    yield "transverse pressure angle, deg", 20.7197, math.degrees(pair.driver.transverse_pressure_angle)
    yield "base helix angle, deg", 14.8245, math.degrees(pair.driver.base_helix_angle)
    yield "working pressure angle, deg", 21.0661, math.degrees(pair.working_pressure_angle)
    yield "transverse contact ratio", 1.54934, pair.contact_ratio
    yield "overlap ratio", 1.08337, pair.overlap_ratio


def _turbine() -> Iterator[Row]:
    table = turbines.published_turbine().kinematics
    yield "ratio of the gearbox", 96.354, abs(table.ratio("high", "rotor"))
    one = geometry.at_distance(geometry.SUN, geometry.PLANET, 0.863)
    two = geometry.at_distance(geometry.PLANET, geometry.RING, 0.863)
    yield "working pressure angle of sun and planet, deg", 28.1175, math.degrees(one.working_pressure_angle)
    yield "working pressure angle of planet and ring, deg", 17.1607, math.degrees(two.working_pressure_angle)
    yield "contact ratio of sun and planet", 1.1148, one.contact_ratio
    yield "contact ratio of planet and ring", 1.2785, two.contact_ratio


def _recordings() -> Iterator[Row]:
    """Races that were hurt in public recordings, named from one channel at the true speed."""
    rows = json.loads((Path(__file__).parents[1] / "data" / "public_bearings.json").read_text(encoding="utf-8"))
    for group in dict.fromkeys(row["group"] for row in rows):
        here = [row for row in rows if row["group"] == group]
        yield f"{group}: judged right", len(here), sum(row["+0.0"] == row["part"] for row in here)
        yield f"{group}: another part accused", 0, sum(row["+0.0"] not in (row["part"], None) for row in here)


class Source(NamedTuple):
    """Who published what, when, where it is found, and the rows."""

    who: str
    what: str
    year: int
    where: str
    rows: Callable[[], Iterator[Row]]


SOURCES: dict[str, Source] = {
    "adams": Source("MSC ADAMS, tables kept by Project Chrono", "joints, springs, distances: motion and forces", 2014,
                    "github.com/projectchrono/chrono, data/testing/joints", _joints_of_adams),
    "iftomm": Source("IFToMM's library of benchmark problems; OpenSim's submissions", "mechanisms A01 to A05", 2014,
                     "iftomm-multibody.org/benchmark", _mechanisms),
    "bari": Source("Test set for IVP solvers; Simeon", "flexible slider crank", 1996,
                   "archimede.uniba.it/~testset, slider crank", _slider_crank),
    "friswell": Source("Friswell, Penny, Garvey, Lees", "rotor with two discs", 2010,
                       "Dynamics of Rotating Machines, example 5.9.1", _modes_of_rotor),
    "ross": Source("ROSS 2.3.0", "the same rotor, 48 elements", 2025, "github.com/petrobras/ross", _rotor_of_ross),
    "ross stiffness": Source("ROSS 2.3.0, GearElementTVMS", "mesh stiffness by potential energy", 2025,
                             "github.com/petrobras/ross", _stiffness_of_ross),
    "wright": Source("Wright, Smith, Thresher, Wang", "turning blade", 1982,
                     "J. Appl. Mech. 49, 197-202", _blade),
    "ansys": Source("ANSYS, rows kept with Exudyn", "Princeton beam", 2022,
                    "github.com/jgerstmayr/EXUDYN", _princeton),
    "exudyn": Source("Exudyn", "Princeton beam, its own elements", 2022,
                     "github.com/jgerstmayr/EXUDYN", _princeton_of_exudyn),
    "simo": Source("Simo and Vu-Quoc; Kane, Ryan, Banerjee", "spin-up of a flexible beam", 1986,
                   "J. Appl. Mech. 53, 849-863", _spin_up),
    "lin": Source("Lin and Parker", "natural frequencies of planetary sets", 1999,
                  "J. Vib. Acoust. 121, 316-321", _modes_of_planets),
    "iso": Source("ISO/TR 6336-30, example 1", "geometry of a helical pair", 2017,
                  "iso.org", _helical_example),
    "nrel": Source("Nejad, Guo, Gao, Moan", "gearbox of a 5 MW turbine", 2016, "Wind Energy 19, 1089-1106", _turbine),
    "recordings": Source("Case Western Reserve University, MFPT society, SpectraQuest's rig", "recordings of bearings",
                         2012, "engineering.case.edu/bearingdatacenter; mfpt.org", _recordings),
}  # fmt: skip


def overview() -> pd.DataFrame:
    """Return a row a source with how many numbers are compared and the largest and the middle difference."""
    rows = []
    for name, source in SOURCES.items():
        if source.rows is _recordings:
            continue
        apart = [abs((ours - theirs) / (theirs or 1.0)) for _, theirs, ours in _rows(name)]
        spread = (len(apart), f"{np.median(apart):.1e}", f"{max(apart):.1e}")
        rows.append((source.who, source.what, source.year, *spread, source.where))
    columns = ["source", "what", "year", "numbers", "middle difference", "largest", "where"]
    pd.set_option("display.max_colwidth", None)
    return pd.DataFrame(rows, columns=columns).set_index("source")
