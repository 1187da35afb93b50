"""Variables, states, arrays and splines of a mechanism as statements."""

from __future__ import annotations

from gearmbs.adams.write.context import WriterContext
from gearmbs.adams.write.text import listed, number, upper
from gearmbs.dae.errors import ModelError


def data_statements(w: WriterContext) -> None:
    """Write variables, states, arrays, plant inputs and outputs, and splines."""
    m = w.mechanism
    for key, text in m.variables.items():
        if upper(key) in w.hidden:
            continue
        n = w.variables[upper(key)]
        w.statement(f"VARIABLE/{n}", [f"FUNCTION = {w.expression(text)}"], str(key))
    for key, state in w.all_states.items():
        if upper(key) in w.hidden:
            continue
        if state.algebraic:
            raise ModelError(f"state '{key}': an algebraic state cannot be written; use a variable")
        text = _times(w.expression(state.expression), w.units.time)
        arguments = [f"IC = {number(state.start)}", f"FUNCTION = {text}"]
        w.statement(f"DIFF/{w.states[upper(key)]}", arguments, str(key))
    for key, values in m.arrays.items():
        w.statement(f"ARRAY/{w.arrays[upper(key)]}", ["IC", f"NUMBERS = {listed(values)}"], str(key))
    for (kind, key), members in m.plants.items():
        ids = ", ".join(str(w.variables[upper(member)]) for member in members)
        w.statement(f"{kind.upper()}/{w.plants[kind, upper(key)]}", [f"VARIABLES = {ids}"], str(key))
    for key, data in m.splines.items():
        arguments = [f"X = {listed(data.x)}"]
        if data.z:
            arguments += [f"Y = {number(z)}, {listed(row)}" for z, row in zip(data.z, data.y)]
        else:
            arguments.append(f"Y = {listed(data.y[0])}")
        if data.linear_extrapolate:
            arguments.append("LINEAR_EXTRAPOLATE")
        w.statement(f"SPLINE/{w.splines[upper(key)]}", arguments, str(key))


def _times(text: str, factor: float) -> str:
    return text if factor == 1.0 else f"{number(factor)}*({text})"
