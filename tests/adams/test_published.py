"""Numbers that ADAMS printed for a public deck that is not part of this package: a wind turbine of 73 parts.

Source: the certification tests of FAST, github.com/old-NWTC/FAST at 693f81f911726dabf5c22ef4a075d031fcb9680d,
CertTest/TstFiles/Test14_ADAMS_LIN.out (MSC.ADAMS/Solver 2008 r1), for CertTest/Test14_ADAMS.adm by
CertTest/Test14_ADAMS_LIN.acf. ``GEARMBS_TURBINE`` names a folder with these three files.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest

from gearmbs.adams import run_deck
from gearmbs.adams.parse.statements import Part

FOLDER = os.environ.get("GEARMBS_TURBINE")
FREQUENCIES = {
    1: 4.07831108e-01, 2: 4.09186514e-01, 3: 1.15074550e00, 10: 2.98463544e00, 25: 9.65238538e00, 50: 3.01278253e01,
    100: 6.50765300e01, 150: 1.22323458e02, 200: 1.88985595e02, 300: 4.76584577e02, 337: 1.00360958e03,
}  # fmt: skip
"""Imaginary parts of eigenvalues by their numbers, Hz."""
CENTRES = {
    1110: (0.0, 0.0, 78.2705), 2000: (-0.1449, 0.0, 83.779),
    10008: (-1.6702382402944, 0.16525324288605, 102.59131722767),
    35000: (-4.8126605575342, 30.310886578395, 66.854205741004),
}  # fmt: skip
"""Centres of mass at the start by their parts, m."""


def demand(call):
    """What the deck's own routine is taken to return: its last parameter, the pitch of a blade at the start."""
    return call.parameters[5] if len(call.parameters) == 6 else 0.0


ROUTINES = {
    "varsub": demand, "sensub": lambda call: 0.0, "reqsub": lambda call: [0.0] * 8,
    "gse_output": lambda call: [0.0], "gse_update": lambda call: [0.0],
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(FOLDER is None, reason="GEARMBS_TURBINE names no folder with the deck and ADAMS's print")
def test_a_wind_turbine_is_linearised_as_by_adams():
    """All 337 pairs of eigenvalues within 2e-6, all 72 centres of mass within 5e-5 m; those above are committed."""
    folder = Path(str(FOLDER))
    result = run_deck(folder / "Test14_ADAMS.adm", folder / "Test14_ADAMS_LIN.acf", routines=ROUTINES)
    assert result.success
    values = result.modes[-1].eigenvalues
    found = np.sort(values.imag[values.imag > 1e-6]) / (2.0 * np.pi)
    text = (folder / "Test14_ADAMS_LIN.out").read_text(encoding="latin-1")
    printed = np.array([float(row) for row in re.findall(r"^\s+\d+\s+\S+\s+\+/-\s+(\S+)", text, re.MULTILINE)])
    assert {k: printed[k - 1] for k in FREQUENCIES} == FREQUENCIES
    assert found.size == printed.size == 337
    np.testing.assert_allclose(found, np.sort(printed), rtol=2e-6)
    start = text.split("Translational Displacements")[1].split("Angular")[0]
    solution, names = result.segments[0].solution, {p.id: p.name for p in result.deck.of(Part).values()}
    for number, *place in re.findall(r"PART/\s*(\d+)\s+(\S+)\s+(\S+)\s+(\S+)", start):
        if number == "1":
            continue
        there = solution.com_position(str(names[int(number)]))[0]
        np.testing.assert_allclose(there, [float(v) for v in place], atol=5e-5)
        np.testing.assert_allclose(there, CENTRES.get(int(number), there), atol=5e-5)
