"""The report of a drivetrain for whoever decides: figures, then what it is, carries and does, and by which laws."""

from __future__ import annotations

import html
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gearmbs._display import readable, settings_of
from gearmbs.drivetrain import Drivetrain
from gearmbs.drivetrain.kinematics import RPM
from gearmbs.drivetrain.on_shafts import arrangement
from gearmbs.files import write_whole
from gearmbs.gears import GearPair
from gearmbs.gears.pattern import ContactPattern, contact_pattern
from gearmbs.gears.transmission import located
from gearmbs.signals.analysis.report import markdown_table
from gearmbs.signals.files.simulated import holds_speed
from gearmbs.studies.mode_names import mode_table, named_modes, ranked_crossings
from gearmbs.studies.same_train import check_record_of
from gearmbs.studies.train_bearings import BearingLife, bearing_lives
from gearmbs.studies.train_views import one_a_group, train_campbell, train_report, train_scene, train_spectrum

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODES, CROSSINGS = 20, 10
"""Rows of the tables of modes and of crossings: those of which a decision may be made come first."""
SHARES = {
    "rest": "the means of loaded positions of rest over the mesh cycle",
    "equal teeth": "those of equally stiff teeth without backlash, as no position of rest was found",
}
"""What the report says of torques in closed chains, by `gearmbs.drivetrain.static.flow.PowerFlow.shared_by`."""
STRAIGHT = 1e-9
"""Opening of flanks over their face under load, m, up to which axes count as parallel: far below any flank's form."""
ANGLE = (35.0, 25.0)
"""Azimuth and elevation from which the drivetrain is seen, degrees."""

SOURCES = (
    ("speeds, mesh and fault frequencies", "teeth and ratios; planets by Willis' equation", "docs/theory/planetary.md"),
    ("torques and power flow", "equilibrium of every shaft under the nominal loads, without losses; of branches of "
     "closed chains the mean of positions of rest",
     "docs/theory/drivetrains.md"),
    ("stiffness of teeth, where a law of the wheels is named", "mean over a mesh cycle, c_gamma b", "ISO 6336-1"),
    ("damping of teeth, where nothing else is given", "0.07 of critical of the bare wheels: a convention",
     "docs/theory/drivetrains.md"),
    ("contact patterns", "at rest under the nominal load, wheels tilted as shafts and bearings give; sections of the "
     "face are springs of their own",
     "docs/theory/gears.md"),
    ("bearing lives", "L10 = (C/P)^p, p = 3 of balls and 10/3 of rollers; a_1 = a_ISO = 1", "ISO 281"),
    ("axial load of a pair of tapered roller or angular contact bearings that are springs or joints",
     "the thrust that its radial load induces, F_r/2Y or e F_r, or its neighbour's with what pushes the shaft",
     "docs/theory/bearings.md"),
    ("modes, Campbell diagram", "linearised at rest under the nominal loads; no whirl", "docs/howto/gearboxes.md"),
)  # fmt: skip
"""What the report tells, the law behind it, and where that is stated."""


@dataclass(frozen=True, eq=False)
class TrainPage:
    """A drivetrain and what a run of it gave, as a page that stands alone.

    Save it by `gearmbs.save`, as ``.html`` with its figures or ``.md`` without them; a notebook shows it.

    Parameters
    ----------
    train : Drivetrain
    record : Dataset
        From `gearmbs.studies.run_train`.
    maximum : float
        Highest frequency of the Campbell diagram, Hz.
    """

    train: Drivetrain
    record: xr.Dataset
    maximum: float = 2000.0

    @cached_property
    def patterns(self) -> dict[str, ContactPattern]:
        """Contact pattern of each mesh under its share of the operating torque; planets of a stage are alike.

        The axes stand to each other as in the loaded position of rest; where there is none, as without load. Of faults
        on single teeth there are those teeth besides, each with the one that it meets first.
        """
        out = {}
        for name, (mesh, teeth) in self._followed.items():
            pair, spring = self.train.pairs[mesh], self.train.mesh_springs[mesh]
            standing = self._standing(mesh, pair)
            with warnings.catch_warnings():
                # teeth with faults have patterns of their own
                warnings.filterwarnings("ignore", "(?s).*does not pass the mesh")
                out[name] = contact_pattern(standing, spring.preload * pair.geometry.driven.base_radius, **teeth)
        return out

    @cached_property
    def _followed(self) -> dict[str, tuple[str, dict[str, Any]]]:
        """Mesh and tooth of each pattern, by what it is called."""
        pairs = {
            m: self.train.pairs[m.name] for m in self.train.meshings if self.train.mesh_springs[m.name].preload > 0.0
        }
        carried = {mesh: pair for mesh, pair in pairs.items() if isinstance(pair, GearPair)}
        groups = {mesh.name for mesh in one_a_group(self.train)}
        out: dict[str, tuple[str, dict[str, Any]]] = {m.group: (m.name, {}) for m in carried if m.name in groups}
        for mesh, pair in carried.items():
            for fault in pair.faults:
                for tooth in located(fault):
                    driver = fault.wheel == "driver"
                    wheel = pair.geometry.wheels[not driver]
                    told = f"{mesh.group}, tooth {tooth % wheel.teeth} of the {fault.wheel} wheel: {fault.label}"
                    out.setdefault(told, (mesh.name, {"tooth" if driver else "mate": tooth}))
        return out

    def _standing(self, mesh: str, pair: GearPair) -> GearPair:
        """Return a pair with its axes as they stand at rest under load."""
        rest = self.train.at_rest
        if abs(rest.openings.get(mesh, 0.0)) * pair.geometry.common_face_width < STRAIGHT:
            return pair
        apart = float(pair.centre_distance_error) + rest.apart[mesh]
        return replace(pair, misalignment=rest.skews[mesh], plane="skew", centre_distance_error=apart)

    @cached_property
    def campbell(self) -> xr.Dataset | None:
        """Modes against speed with the crossings; None where no mode lies that low."""
        from gearmbs.signals import SignalError

        try:
            return train_campbell(self.train, maximum=self.maximum)
        except SignalError:
            return None

    @cached_property
    def lives(self) -> list[BearingLife]:
        """Lives of the bearings in which parts roll, those of planets' pins behind the others."""
        return bearing_lives(self.train, self.record)

    def figures(self) -> Iterator[tuple[str, Figure]]:
        """Yield the figures with what they show, those first of which most is decided."""
        from gearmbs.view import campbell_plot, contact_pattern_plot

        train, record = self.train, self.record
        yield "The drivetrain at its start", train_scene(train).still(azimuth=ANGLE[0], elevation=ANGLE[1])
        if train.meshings and holds_speed(record):
            yield "Spectrum with its strongest lines named", train_spectrum(train, record)
        if self.campbell is not None:
            yield "Modes under load against speed, and what crosses them", campbell_plot(self.campbell)
        for name, pattern in self.patterns.items():
            yield f"Contact pattern of {name} under its nominal load", contact_pattern_plot(pattern, title=name)

    def to_markdown(self) -> str:
        """Return the text and all tables."""
        sections: tuple[Callable[[], list[str]], ...] = (
            self._input, self._power, self._static, self._life, self._pattern, self._modes,
        )  # fmt: skip
        told = ["\n".join(section()) for section in sections]
        # speeds, meshes, bearings, sensors, harmonics and cost stand in the report of the record
        measured = train_report(self.train, self.record).partition("\n")[2]
        return "\n".join([f"# {self.train.name}", "", *told, measured, *self._sources()])

    def to_html(self) -> str:
        """Return the page: figures, then text and tables."""
        from gearmbs.view.pages import page_of

        return page_of(self.train.name, self.figures(), self.to_markdown())

    def save(self, path: str | Path) -> Path:
        """Write the page as ``.html``, or its text as ``.md``.

        Raises
        ------
        ValueError
            For another ending.
        """
        ending = Path(path).suffix.lower()
        if ending not in (".html", ".md"):
            raise ValueError(f"path is {str(path)!r}; the page of a drivetrain is saved as .html or .md")
        return write_whole(path, self.to_html() if ending == ".html" else self.to_markdown())

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.to_html(), quote=True)}" style="width:100%;height:700px;border:0">'

    # --- sections -----------------------------------------------------------------------------------

    def _input(self) -> list[str]:
        rows = []
        for part in self.train.parts.values():
            settings = "; ".join(f"{key.replace('_', ' ')} {readable(v)}" for key, v in settings_of(part)[1:])
            rows.append([part.title, part.name, settings.replace("|", "/")])
        return ["## What it is", "", markdown_table(["part", "name", "settings"], rows), ""]

    def _power(self) -> list[str]:
        train, flow, rows = self.train, self.train.power, []

        def row(kind: str, name: str, shaft: str, torque: float) -> None:
            speed = train.speeds.get(shaft, 0.0)
            told = (f"{torque:.5g}", f"{speed * RPM:.5g}", f"{1e-3 * torque * speed:.5g}")
            rows.append([kind, name, shaft, *told])

        for drive in train.drives:
            if drive.name in flow.drive:
                row("drive", drive.name, drive.shaft, flow.drive[drive.name])
        for coupling in train.couplings:
            row("coupling", coupling.name, coupling.second, flow.torques[coupling.name][1])
        for mesh in train.meshes:
            driver, driven = train.wheels_of(mesh)
            for wheel, torque in zip((driver, driven), flow.torques[mesh.name]):
                row("mesh", f"{mesh.name} on {wheel.name}", wheel.shaft, torque)
        for stage in train.planetary_stages:
            for member, torque in flow.members[stage.name].items():
                row("planetary stage", f"{stage.name} on its {member}", getattr(stage, member), torque)
        for load in train.loads:
            speed = train.speeds[load.shaft]
            row("load", load.name, load.shaft, -np.copysign(load.nominal(abs(speed)), speed))
        header = ["", "name", "on", "torque about its axis, N m", "speed, rpm", "power into it, kW"]
        told = ["## Power flow", "", markdown_table(header, rows), ""]
        if flow.shared:
            told += [f"Equilibrium alone does not tell the torques of {', '.join(flow.shared)}, which close a chain: "
                     f"they are {SHARES[flow.shared_by]}.", ""]  # fmt: skip
        return told

    def _static(self) -> list[str]:
        rest, lines = self.train.at_rest, ["## Loads at rest", ""]
        if rest.trouble:
            return [*lines, f"No position of rest was found: {rest.trouble}.", ""]
        rows = []
        for bearing in self.train.bearings:
            along = rest.bearings[bearing.name]
            told = (np.hypot(along[0], along[1]), along[2], np.linalg.norm(along))
            rows.append([bearing.name, bearing.shaft, *(f"{value:.5g}" for value in told)])
        header = ["bearing", "shaft", "across its axis, N", "along it, N", "whole, N"]
        meshes = [[name, f"{force:.5g}"] for name, force in rest.forces.items()]
        lines += [markdown_table(header, rows), ""]
        return [*lines, markdown_table(["mesh", "normal force, N"], meshes), ""] if meshes else lines

    def _life(self) -> list[str]:
        header = ["bearing", "designation", "C, kN", "C of", "equivalent load of the record, N", "L10, 10^6 turns",
                  "L10, h", "note"]  # fmt: skip
        rows = [
            [one.name, one.designation, f"{1e-3 * one.rating:.4g}", one.source,
             *("-" if np.isnan(x) else f"{x:.4g}" for x in (one.load, 1e-6 * one.turns, one.hours)), one.note]
            for one in self.lives
        ]  # fmt: skip
        if any(np.isfinite(one.error) for one in self.lives):
            header.insert(-1, "numerical error of L10, %")
            for row, one in zip(rows, self.lives, strict=True):
                row.insert(-1, f"{100.0 * one.error:.2g}" if np.isfinite(one.error) else "-")
        told = markdown_table(header, rows) if rows else "No bearing says what rolls in it: give it `rolling`."
        pairs = [
            f"The one-sided bearings of shaft '{shaft.name}' stand {stand}."
            for shaft in self.train.shafts
            if (stand := arrangement(self.train, shaft.name))
        ]
        return ["## Bearing lives", "", told, "", *(line for pair in pairs for line in (pair, ""))]

    def _pattern(self) -> list[str]:
        rest, lines = self.train.at_rest, ["## Contact patterns", ""]
        rows = []
        for name, pattern in self.patterns.items():
            mesh = self._followed[name][0]
            width = self.train.pairs[mesh].geometry.common_face_width
            opening = rest.openings.get(mesh)
            rows.append([
                name,
                f"{1e-3 * pattern.pressure.max():.4g}",
                f"{pattern.face_load_factor:.3f}",
                f"{pattern.share.max():.3f}",
                "-" if opening is None else f"{1e6 * abs(opening) * width:.2f}",
            ])  # fmt: skip
        if not rows:
            return [*lines, "No teeth carry load that have a contact of their own.", ""]
        header = ["mesh", "largest load along the face, N/mm", "face load factor", "largest share of one tooth",
                  "flanks open over the face by tilts under load, um"]  # fmt: skip
        lines += [markdown_table(header, rows), ""]
        if rest.trouble:
            lines += [f"The patterns are of axes as without load: no position of rest was found ({rest.trouble}).", ""]
        return lines

    def _modes(self) -> list[str]:
        whole = mode_table(named_modes(self.train))
        table = whole.head(MODES)
        words = ("frequency_hz", "damping_ratio", "name", "other", "moves")
        shares = [name for name in table.columns if name not in words]
        rows = [
            [
                f"{row['frequency_hz']:.5g}",
                f"{row['damping_ratio']:.3g}",
                row["name"],
                row["moves"],
                *(f"{row[s]:.2f}" for s in shares),
            ]
            for _, row in table.iterrows()
        ]
        lines = ["## Modes under load", "", markdown_table(["Hz", "of critical damping", "largest part", "what moves",
                 *(f"share of {name}" for name in shares)], rows), ""]  # fmt: skip
        if len(whole) > MODES:
            lines += [f"The slowest {MODES} of {len(whole)}; `mode_table(named_modes(train))` has all.", ""]
        if self.campbell is None:
            return [*lines, f"No mode lies below {self.maximum:.5g} Hz.", ""]
        table = ranked_crossings(self.campbell)
        heard = "response" in table
        ranked = ranked_crossings(self.campbell, by="response") if heard else table
        found = [
            [f"{c.speed_rpm:.5g}", f"{c.frequency_hz:.5g}", c.order, c.name, f"{c.gain:.3g}",
             *([f"{c.response:.3g}"] if heard else [])]
            for c in ranked.head(CROSSINGS).itertuples()
        ]  # fmt: skip
        header = ["speed of the first drive, rpm", "Hz", "order", "mode", "gain"]
        header += ["m/s² of a seat for 1 µm"] if heard else []
        by = (
            f"Crossings, by {'how the housing answers' if heard else 'how far the mode is moved by'} the transmission "
            "error; the gain is of the mode alone. Friction of the teeth, which acts across the "
            "line of action and changes its way at the pitch point, moves modes as well: bending in that plane has a "
            "gain of nothing here, and may lead the spectrum all the same."
        )
        return [*lines, by, "", markdown_table(header, found), ""]

    def _sources(self) -> list[str]:
        return [
            "## Laws and where they are from",
            "",
            markdown_table(["what", "law", "source"], [list(row) for row in SOURCES]),
            "",
        ]


def train_page(train: Drivetrain, record: xr.Dataset, *, maximum: float = 2000.0) -> TrainPage:
    """Return the report of a drivetrain and a run of it for whoever decides, to be saved by `gearmbs.save`.

    Parameters
    ----------
    train : Drivetrain
    record : Dataset
        From `gearmbs.studies.run_train` of the same drivetrain.
    maximum : float
        Highest frequency of the Campbell diagram, Hz.

    Raises
    ------
    DrivetrainError
        For the record of another drivetrain.
    """
    check_record_of(train, record)
    return TrainPage(train, record, maximum)
