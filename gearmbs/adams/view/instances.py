"""Instances of View's own definitions: springs and motions by their variables; controllers' lists; others are named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearmbs.adams.view import machinery, tires
from gearmbs.adams.view.deckmaker import Deckmaker, translated
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import BLOCKS, DIRECTIONS, GENERAL_MOTION, Item
from gearmbs.adams.view.values import fixed
from gearmbs.adams.write.text import number


def _variable(m: Deckmaker, item: Item, name: str, default: Any = None) -> Any:
    found = m.db.items.get(f"{item.path}.{name}".lower())
    return default if found is None else m.values.variable(found)


def _pair(m: Deckmaker, item: Item) -> tuple[Item, Item]:
    found = [_variable(m, item, f"{side}_marker") for side in "ij"]
    for one in found:
        if not isinstance(one, Item) or one.kind != "marker":
            raise ViewError("i_marker and j_marker are missing")
    return found[0], found[1]


def _coefficient(m: Deckmaker, item: Item, what: str) -> float:
    mode = str(_variable(m, item, f"{what}_mode", "linear")).lower()
    if mode == "none":
        return 0.0
    if mode != "linear":
        raise ViewError(f"{what}_mode = {mode}; give linear, or a single_component_force with a spline")
    value = _variable(m, item, f"{what}_coefficient", 0.0)
    if not isinstance(value, (int, float)):
        raise ViewError(f"{what}_coefficient is no number")
    return float(value)


def _spring(turning: bool) -> Callable[[Deckmaker, Item], None]:
    """Return what makes the SFORCE of a translational or a torsion spring, as View's own decks have it."""

    def make(m: Deckmaker, item: Item) -> None:
        i, j = _pair(m, item)
        stiffness, damping = _coefficient(m, item, "stiffness"), _coefficient(m, item, "damping")
        what = "angle" if turning else "length"
        free = float(_variable(m, item, f"free_{what}", 0.0))
        if str(_variable(m, item, f"free_{what}_mode", f"design_{what}")).lower().startswith("design"):
            call = m.values.evaluate(("call", "AZ" if turning else "DM", (("value", i), ("value", j))))
            free = float(call)
        preload = float(_variable(m, item, "preload", 0.0))
        per = m.radian if turning else 1.0
        ends = f"{m.id(i)}, {m.id(j)}"
        place, speed = (f"AZ({ends})", f"WZ({ends}, {m.id(j)})") if turning else (f"DM({ends})", f"VR({ends})")
        m.add(
            item,
            f"SFORCE/{m.fresh('SFORCE')}",
            "ROTATIONAL" if turning else "TRANSLATIONAL",
            f"I = {m.id(i)}",
            f"J = {m.id(j)}",
            f"FUNCTION = -{number(stiffness / per)} * ({place} - ({number(free * per)})) "
            f"- {number(damping / per)} * {speed} + ({number(preload)})",
        )

    return make


LEVELS = {1: "DISPLACEMENT", 2: "VELOCITY", 3: "ACCELERATION"}


def _general_motion(m: Deckmaker, item: Item) -> None:
    """MOTION for each component that is not free."""
    i, j = _pair(m, item)
    for name, direction in DIRECTIONS.items():
        kind = int(_variable(m, item, f"{name}_type", 0))
        if kind == 0:
            continue
        if kind not in LEVELS:
            raise ViewError(f"{name}_type = {kind}; 0 is free, 1 to 3 are displacement, velocity and acceleration")
        text = str(_variable(m, item, f"{name}_func", "0 * time"))
        scale = m.radian if name.startswith("r") else 1.0
        start = [
            f"{keyword} = {number(float(_variable(m, item, f'{name}_{key}', 0.0)) * scale)}"
            for least, key, keyword in ((2, "ic_disp", "ICDISP"), (3, "ic_velo", "ICVEL"))
            if kind >= least
        ]
        own = m.db.items.get(f"{item.path}.motion_{name}".lower())
        m.add(
            item,
            f"MOTION/{m.fresh('MOTION') if own is None else m.id(own)}",
            f"I = {m.id(i)}",
            f"J = {m.id(j)}",
            direction,
            LEVELS[kind],
            *start,
            f"FUNCTION = {translated(m, text, item.line)}",
        )


def _block(m: Deckmaker, item: Item) -> None:
    """Functions of the state variables of a block of Controls, as in decks that View exported."""

    def own(ending: str) -> Item:
        return m.db.items[f"{item.path}.{item.name}{ending}".lower()]

    def value(ending: str) -> str:
        return f"VARVAL({own(ending).path})"

    def says(ending: str, text: str) -> None:
        own(ending).fields["function"] = fixed(text, line=item.line)

    def gain(name: str) -> str:
        found = _variable(m, item, name)
        if not isinstance(found, (int, float)):
            raise ViewError(f"its {name} is missing")
        return number(float(found))

    kind = m.values.definition(item).rpartition("_")[2]
    inputs = [ending for ending in BLOCKS[m.values.definition(item)] if ending]
    if kind == "input":
        says("", value("_input"))
        return
    given = _variable(m, item, "input_obj", [])
    sources = given if isinstance(given, list) else [given]
    for ending, source in zip(inputs, sources):
        output = m.db.items.get(f"{source.path}.{source.name}".lower()) if isinstance(source, Item) else None
        if output is None:
            raise ViewError("its input_obj is no block of Controls that is modelled")
        says(ending, f"VARVAL({output.path})")
    if len(sources) != len(inputs):
        raise ViewError(f"its input_obj has {len(sources)} blocks; {len(inputs)} are needed")
    if kind == "gain":
        says("", f"{gain('gain')} * {value('_input')}")
    elif kind == "sum":
        says("", f"{gain('gain1')} * {value('_input1')} + {gain('gain2')} * {value('_input2')}")
    else:
        says("_sys", value("_input"))
        own("_sys").fields["initial_condition"] = fixed(float(_variable(m, item, "initial_condition", 0.0)))
        parts = (gain("p_gain"), value("_input")), (gain("i_gain"), f"DIF({own('_sys').path})")
        says("", " + ".join(f"{k} * {x}" for k, x in (*parts, (gain("d_gain"), value("_input_d")))))


def _nothing(m: Deckmaker, item: Item) -> None:
    """Lists: inputs and outputs, which are PINPUT and POUTPUT, the gears of a set; a road, which its tires read."""


DEFINITIONS: dict[str, Callable[[Deckmaker, Item], None]] = {
    "forces.spring": _spring(turning=False),
    "forces.torsion_spring": _spring(turning=True),
    GENERAL_MOTION: _general_motion,
    "controls.controls_plant": _nothing,
    machinery.SET: _nothing,
    machinery.ELEMENT: machinery.make_wheel,
    machinery.FORCE: machinery.make_force,
    tires.ROAD: _nothing,
    tires.TIRE: tires.make_tire,
    **dict.fromkeys(BLOCKS, _block),
}
"""By the last two parts of a definition's name."""


def make_instance(m: Deckmaker, item: Item) -> None:
    """What an instance stands for.

    Raises
    ------
    ViewError
        If its definition is not known.
    """
    name = m.values.text(item, "definition_name") or ""
    make = DEFINITIONS.get(m.values.definition(item))
    if make is None:
        raise ViewError(
            f"instances of {name[:60]} are not modelled; write what it stands for: joints, forces, variables"
        )
    make(m, item)


MAKERS = {"ude": make_instance}
