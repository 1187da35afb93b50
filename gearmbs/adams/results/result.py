"""The result of running a deck, and the files it is written to: here the message file (.msg: what was read, the degrees
of freedom, how each analysis went) and the request file (.req); the results file (.res) in `gearmbs.adams.results.res`.
"""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import numpy as np

from gearmbs.adams.errors import folded, skipped_labels
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Command, Linear, Simulate
from gearmbs.adams.parse.deck import unit_names
from gearmbs.adams.results.record import NEWTON, RunRecord, Segment
from gearmbs.adams.results.remarks import row_text
from gearmbs.adams.results.res import results_text
from gearmbs.dae.analyses.plant import FORMATS, LinearPlant
from gearmbs.dae.methods import FORMULATIONS
from gearmbs.files import whole_file

RULE = "-" * 79
TITLES = {"KINEMATICS": "Kinematic", "STATICS": "Static", "INITIAL_CONDITIONS": "Initial Conditions"}
TABLE_HEAD = """\
   Simulation      Step        Function    Cumulative   Integration     CPU
      Time         Size       Evaluations  Steps Taken    Order        time
   ___________  ___________   ___________  ___________   _________    ________"""
KEPT = (1, 2, 3, 5, 6, 7)
"""Columns that are written."""
UNIT_CODES = {"MILLIMETER": "MM", "METER": "M", "CENTIMETER": "CM", "INCH": "IN", "FOOT": "FT"}


class AdamsResult(RunRecord):
    """All analyses of a run, one after the other.

    Attributes
    ----------
    deck : Deck
    script : Script
    log : list of (Command, Segment, Modes, LinearPlant or None)
        The commands that were carried out, with what they gave.
    errors : list of Diagnostic
        What ended the script.
    """

    def write(self, prefix: str | Path) -> list[Path]:
        """Write .req, .res, .msg and .nc files; the message file alone when no analysis was carried out.

        The plants of LINEAR/STATEMAT go to the .mat files that the commands name, or to PREFIX_plant1.mat and so on.
        Each file appears when it is whole. Results of a run that was interrupted, or in
        which a routine of the user failed, are named PREFIX.partial.

        Parameters
        ----------
        prefix : path
            File name without extension; its directory is made when it does not exist.

        Returns
        -------
        list of Path
        """
        files = self.files(prefix)
        for path, content in zip(files, (message_text, request_text, results_text)):
            with whole_file(path) as part:
                part.write_text(content(self), encoding="utf-8", newline="\n")
        if self.segments:
            # in memory first: the format's library ends the program where the disk is full
            data = self.to_dataset().to_netcdf(engine="h5netcdf")
            with whole_file(files[-1]) as part:
                part.write_bytes(data)
        return files + self._write_plants(Path(prefix))

    def files(self, prefix: str | Path) -> list[Path]:
        """Return the names of the message file and, if there are any, of the files of results."""
        prefix = Path(prefix)
        results = prefix.name + (".partial" if self.partial else "")
        endings = (".req", ".res", ".nc") if self.segments else ()
        return [prefix.with_name(f"{prefix.name}.msg"), *(prefix.with_name(results + ending) for ending in endings)]

    def _write_plants(self, prefix: Path) -> list[Path]:
        found = [(c, p) for c, p in self.log if isinstance(c, Linear) and isinstance(p, LinearPlant)]
        files = []
        for k, (command, plant) in enumerate(found, 1):
            name = re.split(r"[\\/]", command.data_file)[-1] if command.data_file else f"{prefix.name}_plant{k}"
            files.append(plant.save(prefix.with_name(name if name.endswith(FORMATS) else f"{name}.mat")))
        return files


def message_text(result: RunRecord) -> str:
    """Return the content of the message file: remarks on the model, then the commands in their order."""
    out = [RULE, f"|{'Model Title':^77}|", f"|{'=' * 77}|", f"|{result.deck.title[:75]:^77}|", RULE, ""]
    without = [label for label in skipped_labels(result.deck.diagnostics) if label.split("/")[0] not in st.MERELY_READ]
    if without:
        text = f"The model is run without {', '.join(without)}, or parts of these: its motion is not that of the deck."
        out += _block("ERROR", text)
    for d in folded((*result.deck.diagnostics, *result.script.diagnostics)):
        out += _block("ERROR" if d.severity == "unsupported" else "WARNING", str(d))
    for command, outcome in result.log:
        out += [f" command: {_echo(command)}", ""]
        if isinstance(outcome, Segment):
            out += _segment(result, outcome)
        elif isinstance(outcome, LinearPlant):
            out += ["", "  S T A T E  M A T R I C E S", "", *outcome.table().splitlines(), ""]
        elif outcome is not None:
            out += ["", "  E I G E N  A N A L Y S I S", "", *outcome.table().splitlines(), ""]
    for d in result.errors:
        out += _block("ERROR", str(d))
    if result.interrupted:
        out += [f"  {result.interrupted[0].upper()}{result.interrupted[1:]}.", ""]
    return "\n".join(out) + "\n"


def _block(severity: str, text: str) -> list[str]:
    return [f"---- START: {severity} ----", text, f"---- END: {severity} ----", ""]


def _segment(result: RunRecord, segment: Segment) -> list[str]:
    s = segment.solution
    t = s.t / result.deck.units.time
    out = _initial_conditions(result, segment, t[0])
    title = TITLES.get(segment.kind, "Dynamic")
    stats = s.stats.as_dict()
    out += ["", "  Begin Simulation", ""]
    if segment.options["integrator"] == NEWTON:
        out += [f"  ****** Performing {title} Simulation ******", *_solved(segment, t, stats)]
    else:
        out += _integrated(segment, title, t, stats)
    for remark in result.remarks(segment):
        out += ["", *_block("WARNING", remark)]
    if not s.success and not result.partial:
        out += ["", *_block("ERROR", s.message)]
    return [*out, "", "  End Simulation", ""]


def _solved(segment: Segment, t: np.ndarray, stats: dict) -> list[str]:
    """Return how an analysis went in which nothing is integrated."""
    if segment.kind == "INITIAL_CONDITIONS":
        return []
    what = "position" if t.size == 1 else f"{t.size} positions from {t[0]:.5E} to {t[-1]:.5E}"
    if segment.kind == "KINEMATICS":
        return [f"   All motion is prescribed: {what}, {stats.get('residuals', 0)} Newton iterations."]
    found = segment.equilibrium
    if found is None:
        return [f"   Equilibrium at {what}, {stats.get('steps', 0)} Newton iterations."]
    out = [f"   Equilibrium found in {found.iterations} Newton iterations; relative imbalance {found.residual:.3E}."]
    stability = {
        True: "The equilibrium is stable.",
        False: "The equilibrium is unstable.",
        None: "Whether the equilibrium is stable was not looked into: the model is large.",
    }
    out.append(f"   {stability[found.stable]}")
    if found.neutral:
        names = ", ".join(segment.model.sources[name].label() for name in found.neutral)
        out.append(f"   Nothing resists small displacements of {names}.")
    return out


def _integrated(segment: Segment, title: str, t: np.ndarray, stats: dict) -> list[str]:
    """Return how an integration went."""
    options = segment.options
    name, form = options["integrator"].capitalize(), options["formulation"]
    step = (t[-1] - t[0]) / max(1, stats.get("steps", 1))
    seconds = float(stats.get("cpu_time", stats.get("time", 0.0)) or 0.0)
    return [
        f"  ****** Performing {title} Simulation using {name} {form} Integrator ******",
        f"   The system is modelled with {FORMULATIONS[form].adams} DAEs.",
        f"   The integrator is {name.upper()}, CORRECTOR = {options.get('corrector', 'original')}",
        f"   Integration error =    {options['tol']:.6E}",
        "",
        TABLE_HEAD,
        _row(t[0], 0.0, 0, 0, 0, 0.0),
        _row(t[-1], step, stats.get("residuals", 0), stats.get("steps", 0), stats.get("order", 0), seconds),
    ]


def _row(time: float, step: float, evaluations: int, steps: int, order: int, cpu: float) -> str:
    return f"   {time:11.5E}  {step:11.5E}  {evaluations:>11d}  {steps:>11d}  {order:>6d}  {cpu:14.2f}"


def _echo(command: Command) -> str:
    """Return a command as its script has it, or could have it."""
    if command.text or not isinstance(command, Simulate):
        return command.text
    words = [f"simulate/{(command.kind or 'DYNAMICS').lower()}"]
    for key in ("end", "duration", "dtout", "steps"):
        value = getattr(command, key)
        if value is not None:
            words.append(f"{key}={value:g}")
    return ", ".join(words)


def _initial_conditions(result: RunRecord, segment: Segment, time: float) -> list[str]:
    """Return the report of the initial conditions analysis: redundant rows and degrees of freedom."""
    report = segment.solution.system.report
    out = ["", "  Begin Displacement Initial Conditions", "", f"  Time T={time:.9E}."]
    if report is not None:
        if report.redundant:
            out.append("  Degree-of-freedom analysis identified redundant constraints in the model:")
            out.append("  " + "-" * 73)
            out += [
                f"   -  deactivating constraint equation  {row_text(segment.model, name)}" for name in report.redundant
            ]
        out.append(f"  The model has {report.degrees_of_freedom} degrees of freedom.")
        moved = segment.assembly
        largest = ""
        if moved is not None and moved.distance + moved.angle > 0.0:
            largest = (
                f"; largest corrections {moved.distance:.3E} {result.unit('length')} ({moved.farthest}) and "
                f"{np.rad2deg(moved.angle):.3E} degrees ({moved.most_turned})"
            )
        out.append(f"  Assembled in {report.position_iterations} iterations{largest}.")
    out += ["", "  End Displacement Initial Conditions", ""]
    changed = segment.assembly
    for what in ("Velocity", "Acceleration"):
        out += ["", f"  Begin {what} Initial Conditions", ""]
        if what == "Velocity" and changed is not None and changed.speed + changed.spin > 0.0:
            both = (
                (changed.speed, result.unit("velocity"), changed.fastest),
                (changed.spin, result.unit("angular_velocity"), changed.most_spun),
            )
            largest = " and ".join(f"{size:.3E} {unit} ({part})" for size, unit, part in both if size > 0.0)
            out.append(f"  Largest changes of given velocities, which did not fit the constraints: {largest}.")
        out += ["", f"  End {what} Initial Conditions", ""]
    if np.any(~np.isfinite(segment.solution.com_acceleration(segment.solution.system.body_names[0])[0])):
        out.append("  The initial accelerations are not finite.")
    return out


# The request file (.req): a directory of the requests, then their values step by step.
#
# Header, title and unit line; for every request a line with id, type, I, J and the length of its comment,
# then the comment; for every output time a line with the time and one line of six values a request, the
# columns 2-4 and 6-8 (magnitudes are left out, as ADAMS does).


OF_EXPRESSIONS = 5
"""The type of a request by F1 to F8."""


def unit_line(result: RunRecord) -> tuple[str, float]:
    """Return the name of the deck's unit system and its consistency factor."""
    names = unit_names(result.deck.only(st.Units))
    length = UNIT_CODES.get(names["length"], names["length"][:2] or "NO")
    units = result.deck.units
    factor = units.force * units.time**2 / (units.mass * units.length)
    mass = {"KILOGRAM": "KG", "GRAM": "G"}.get(names["mass"], names["mass"][:2])
    return f"{length}{mass}{names['time'][:1]}_{names['force'][:1]}_RACA", factor


def request_text(result: RunRecord) -> str:
    """Return the content of the request file."""
    stamp = datetime.now().strftime("%Y-%m-%d %H:%M:%S")
    requests = result.deck.of(st.Request)
    name, factor = unit_line(result)
    lines = [f" A.R3    {stamp}               0         0  3D", f"{result.deck.title[:80]:<80}"]
    lines.append(f"{len(requests):>5}{name:>17} {factor:.15E}")
    for number, request in requests.items():
        comment = (request.comment or request.name or "")[:80]
        kind = st.REQUEST_TYPES[request.type].number if request.type else OF_EXPRESSIONS
        lines.append(f"{number:>10}{kind:>5}{request.i or 0:>10}{request.j or 0:>10}{len(comment):>5}")
        lines.append(comment)
    values = [result.request(number)[:, KEPT] for number in requests]
    for k, t in enumerate(result.t):
        lines.append(f"{t:14.5E}")
        lines.extend("".join(f"{v:14.5E}" for v in rows[k]) for rows in values)
    return "\n".join(lines) + "\n"
