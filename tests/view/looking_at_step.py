"""STEP files looked at: entities, closed shells, and volumes in a CAD kernel where one is installed."""

import re

import pytest

from gearmbs.view import profile_area, write_step
from gearmbs.view.profile import bore_edges, profile_edges


def step_entities(path):
    return {int(n): body for n, body in re.findall(r"#(\d+)=(.*);", path.read_text())}


def check_shell(wheel, folder):
    entities = step_entities(write_step(wheel, folder / "wheel.step"))
    # each edge is used twice, once each way: the shell is closed and its faces agree on what is outside
    uses = {}
    for body in entities.values():
        match = re.match(r"ORIENTED_EDGE\('',\*,\*,#(\d+),\.([TF])\.\)", body)
        if match:
            uses.setdefault(int(match[1]), []).append(match[2])
    assert all(sorted(u) == ["F", "T"] for u in uses.values())
    edges = [n for n, body in entities.items() if body.startswith("EDGE_CURVE")]
    assert sorted(uses) == edges
    references = {int(n) for body in entities.values() for n in re.findall(r"#(\d+)", body)}
    assert references <= set(entities)
    walls = len(profile_edges(wheel)) + len(bore_edges(wheel))
    assert sum(body.startswith("ADVANCED_FACE") for body in entities.values()) == walls + 2


def check_volume(wheel, folder, rel=1e-8):
    pytest.importorskip("OCP", reason="the CAD kernel OCP (cadquery-ocp) is not installed")
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(write_step(wheel, folder / "wheel.step")))
    reader.TransferRoots()
    shape = reader.OneShape()
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    assert BRepCheck_Analyzer(shape).IsValid()
    assert found.Mass() * 1e-9 == pytest.approx(profile_area(wheel) * wheel.face_width, rel=rel)
