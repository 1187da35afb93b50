"""Every kind of element that is read can be written: all files of a run, whatever the deck holds."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
import xarray as xr

from gearmbs.adams import parse_deck, run_deck
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import specs_of
from gearmbs.adams.parse.statements import KINDS
from gearmbs.adams.results.res import NAMESPACE

from .requests import read_requests
from .test_run import model

PARTS = """\
MARKER/11,PART=1,QP=1,0,0
MARKER/12,PART=1,FLOATING
PART/2,MASS=1,CM=20,IP=1,1,1
MARKER/20,PART=2
MARKER/21,PART=2,QP=0.5,0,0
PART/3,MASS=1,CM=30,IP=1,1,1,QG=1,0,0
MARKER/30,PART=3
ACCGRAV/IGRAV=1,JGRAV=-2
REQUEST/1,FORCE,I=20,J=10
JOINT/1,REVOLUTE,I=20,J=10
JOINT/2,REVOLUTE,I=30,J=11
"""
ELEMENTS = {
    "joint": "JOINT/7,FIXED,I=30,J=11",
    "jprim": "JPRIM/7,INPLANE,I=21,J=10",
    "motion": "MOTION/7,JOINT=1,FUNCTION=SIN(TIME)",
    "coupler": "COUPLER/7,JOINTS=1,2,TYPE=R:R,SCALES=1,1",
    "gear": "MARKER/13,PART=1,QP=0.5,0,0,REULER=0,90D,0\nGEAR/7,JOINTS=1,2,CV=13",
    "gcon": "GCON/7,I=20,FUNCTION=DX(21,10)-0.5",
    "sforce": "SFORCE/7,ROTATIONAL,I=20,J=10,FUNCTION=SIN(TIME)",
    "vforce": "VFORCE/7,I=21,JFLOAT=12,RM=10,FX=1\\FY=TIME\\FZ=0",
    "vtorque": "VTORQUE/7,I=21,JFLOAT=12,RM=10,TX=1\\TY=TIME\\TZ=0",
    "gforce": "GFORCE/7,I=21,JFLOAT=12,RM=10,FX=1\\FY=2\\FZ=3\\TX=4\\TY=5\\TZ=6",
    "springdamper": "SPRINGDAMPER/7,TRANSLATION,I=21,J=30,K=5,C=1,LENGTH=0.5",
    "bushing": "BUSHING/7,I=20,J=11,K=1,2,3,C=1,1,1,KT=1,1,1,CT=1,1,1",
    "field": "FIELD/7,I=20,J=11,KMATRIX=1,0,0,0,0,0,0,1,0,0,0,0,0,0,1,0,0,0\n, 0,0,0,1,0,0,0,0,0,0,1,0,0,0,0,0,0,1",
    "beam": "BEAM/7,I=20,J=11,LENGTH=1,IXX=1,IYY=1,IZZ=1,AREA=1,EMODULUS=1,GMODULUS=1",
    "contact": "GRAPHICS/1,ELLIPSOID,CM=30,XSCALE=0.2,YSCALE=0.2,ZSCALE=0.2\nGRAPHICS/2,PLANE,RM=11\n"
    "CONTACT/7,IGEOM=1,JGEOM=2,IMPACT,STIFFNESS=1E4,DAMPING=10,DMAX=0.001,EXPONENT=1.5",
    "ptcv": "MATRIX/1,FULL=RORDER,ROWS=4,COLUMNS=3,VALUES=-1,0,0,0,0,0\n, 1,0,0,2,0,0\n"
    "CURVE/1,OPEN,CURVE_POINTS,MATRIX=1\nPTCV/7,I=21,CURVE=1,RM=10,JFLOAT=12",
    "cvcv": "MATRIX/1,FULL=RORDER,ROWS=5,COLUMNS=3,VALUES=-1,1,0,-0.5,0.25,0\n, 0,0,0,0.5,0.25,0,1,1,0\n"
    "MATRIX/2,FULL=RORDER,ROWS=5,COLUMNS=3,VALUES=-2,0,0,-1,0,0\n, 0,0,0,1,0,0,2,0,0\n"
    "CURVE/1,OPEN,CURVE_POINTS,MATRIX=1\nCURVE/2,OPEN,CURVE_POINTS,MATRIX=2\n"
    "CVCV/7,ICURVE=1,IRM=21,JCURVE=2,JRM=10",
    "friction": "FRICTION/7,JOINT=1,MU_STATIC=0.3,MU_DYNAMIC=0.2,PIN_RADIUS=0.1",
}


ENTITY_TYPES = {kind: cls.entity for cls, kind in KINDS.items()}


def test_every_kind_is_tried():
    assert set(ELEMENTS) == set(KINDS.values()) == set(ENTITY_TYPES)


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.slow
def test_files_hold_every_kind_of_element(kind, tmp_path):
    result = run_deck(parse_deck(model(PARTS + ELEMENTS[kind])), end=0.02, steps=2, out=tmp_path / "run")
    assert result.success, result.messages
    root = ET.parse(tmp_path / "run.res").getroot()
    entities = {(e.get("entType"), e.get("objectId")) for e in root.iterfind(f".//{{{NAMESPACE}}}Entity")}
    assert (ENTITY_TYPES[kind], "7") in entities
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        found = data[f"{kind}_7"].to_numpy()
        assert found.shape == (3, 6)
        assert np.all(np.isfinite(found))
    assert read_requests((tmp_path / "run.req").read_text())[1][1].shape == (3, 6)
    assert "End Simulation" in (tmp_path / "run.msg").read_text()


@pytest.mark.parametrize("kind", [*specs_of(st.Request)["type"].choices, "F2 = TIME"])
def test_every_type_of_request_is_evaluated_and_written(kind, tmp_path):
    """What the grammar takes, the run evaluates and every file holds, with its units."""
    text = model(PARTS.replace("REQUEST/1,FORCE", f"REQUEST/1,{kind}"))
    result = run_deck(parse_deck(text), end=0.02, steps=2, out=tmp_path / "run")
    assert result.success, result.messages
    assert np.all(np.isfinite(result.request(1)))
    assert len(result.request_units(1)) == 8
    times, kept = read_requests((tmp_path / "run.req").read_text())
    np.testing.assert_allclose(kept[1], result.request(1)[:, [1, 2, 3, 5, 6, 7]], rtol=1e-4, atol=1e-9)
    assert times.size == 3
