"""The message file (.msg): what was read, the degrees of freedom, and how each analysis went."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from gearmbs.adams.result import AdamsResult, Segment

RULE = "-" * 79
TITLES = {"KINEMATICS": "Kinematic", "STATICS": "Static", "INITIAL_CONDITIONS": "Initial Conditions"}
TABLE_HEAD = """\
   Simulation      Step        Function    Cumulative   Integration     CPU
      Time         Size       Evaluations  Steps Taken    Order        time
   ___________  ___________   ___________  ___________   _________    ________"""


def message_text(result: AdamsResult) -> str:
    """Return the content of the message file."""
    out = [RULE, f"|{'Model Title':^77}|", f"|{'=' * 77}|", f"|{result.deck.title[:75]:^77}|", RULE, ""]
    for d in (*result.deck.diagnostics, *result.script.diagnostics):
        severity = "ERROR" if d.severity == "unsupported" else "WARNING"
        out += [f"---- START: {severity} ----", str(d), f"---- END: {severity} ----", ""]
    for segment in result.segments:
        out += _segment(result, segment)
    for modes in result.modes:
        out += ["", "  E I G E N  A N A L Y S I S", "", *modes.table().splitlines(), ""]
    return "\n".join(out) + "\n"


def _segment(result: AdamsResult, segment: Segment) -> list[str]:
    s = segment.solution
    t = s.t / result.deck.units.time
    out = [f" command: {_echo(segment)}", ""]
    out += _initial_conditions(segment, t[0])
    options = segment.options
    name, form = options["integrator"].capitalize(), options["formulation"]
    title = {"KINEMATICS": "Kinematic", "STATICS": "Static", "INITIAL_CONDITIONS": "Initial Conditions"}.get(
        segment.kind, "Dynamic"
    )
    index = {"I3": "INDEX-3", "SI2": "stabilized INDEX-2", "SI1": "stabilized INDEX-1"}[form]
    out += [
        "",
        "  Begin Simulation",
        "",
        f"  ****** Performing {title} Simulation using {name} {form} Integrator ******",
        f"   The system is modelled with {index} DAEs.",
        f"   The integrator is {name.upper()}, CORRECTOR = {options.get('corrector', 'original')}",
        f"   Integration error =    {options['tol']:.6E}",
        "",
    ]
    if segment.note:
        out += ["---- START: WARNING ----", segment.note, "---- END: WARNING ----", ""]
    stats = s.stats.as_dict()
    out.append(TABLE_HEAD)
    step = (t[-1] - t[0]) / max(1, stats.get("steps", 1))
    out.append(_row(t[0], 0.0, 0, 0, 0, 0.0))
    seconds = float(stats.get("cpu_time", stats.get("time", 0.0)) or 0.0)
    out.append(_row(t[-1], step, stats.get("residuals", 0), stats.get("steps", 0), stats.get("order", 0), seconds))
    if not s.success:
        out += ["", "---- START: ERROR ----", s.message, "---- END: ERROR ----"]
    return [*out, "", "  End Simulation", ""]


def _row(time: float, step: float, evaluations: int, steps: int, order: int, cpu: float) -> str:
    return f"   {time:11.5E}  {step:11.5E}  {evaluations:>11d}  {steps:>11d}  {order:>6d}  {cpu:14.2f}"


def _echo(segment: Segment) -> str:
    """Return the command as it could have stood in the script."""
    c = segment.command
    words = [f"simulate/{segment.kind.lower()}"]
    for key in ("end", "duration", "dtout", "steps"):
        value = getattr(c, key)
        if value is not None:
            words.append(f"{key}={value:g}")
    return ", ".join(words)


def _initial_conditions(segment: Segment, time: float) -> list[str]:
    """Return the report of the initial conditions analysis: redundant rows and degrees of freedom."""
    report = segment.solution.system.report
    out = ["", "  Begin Displacement Initial Conditions", "", f"  Time T={time:.9E}."]
    if report is not None:
        if report.redundant:
            out.append("  Degree-of-freedom analysis identified redundant constraints in the model:")
            out.append("  " + "-" * 73)
            for name in report.redundant:
                joint, _, label = name.rpartition(": ")
                out.append(f"   -  deactivating constraint equation  {label} in {joint}")
        out.append(f"  The model has {report.degrees_of_freedom} degrees of freedom.")
        out.append(
            f"  Assembled in {report.position_iterations} iterations; largest correction "
            f"{report.largest_correction:.3E}, remaining violation {report.violation:.3E}."
        )
    out += ["", "  End Displacement Initial Conditions", ""]
    for what in ("Velocity", "Acceleration"):
        out += ["", f"  Begin {what} Initial Conditions", "", "", f"  End {what} Initial Conditions", ""]
    if np.any(~np.isfinite(segment.solution.acceleration(segment.solution.system.body_names[0])[0])):
        out.append("  The initial accelerations are not finite.")
    return out
