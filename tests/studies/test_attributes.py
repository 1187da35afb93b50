"""Units of what a study's files say about their settings."""

import numpy as np
import pytest

from gearmbs.studies import Case, paper_cases, run_paper
from gearmbs.studies.presets.paper import paper_report
from gearmbs.studies.run.record import attributes_of


def test_every_quantity_has_its_unit():
    attributes = attributes_of(Case(contact={"stiffness": 2.37e9}, gears={"face_width": ["22 mm", "20 mm"]}))
    assert attributes["operation_speed_units"] == "rad/s"
    assert attributes["contact_stiffness_units"] == "N/m^1.3"
    assert attributes["gears_face_width"] == [0.022, 0.020]
    assert attributes["gears_face_width_units"] == "m"
    assert attributes["gears_density_units"] == "kg/m^3"
    assert attributes["mesh_frequency_units"] == "Hz"
    # text carries its unit, defaults that follow from others have none
    text = attributes_of(Case())
    assert text["contact_stiffness"] == "2.9852e5 N/mm^1.3"
    assert "contact_stiffness_units" not in text
    assert text["gears_addendum"] == "default"
    assert "gears_addendum_units" not in text


@pytest.mark.slow
def test_the_study_keeps_units_and_remarks():
    study = run_paper(Case(operation={"run_up": 0.03, "settling": 0.01, "duration": 0.06}), workers=2)
    records = study.records
    assert records.fault_misalignment.attrs["units"] == "rad"
    assert records.fault_centre_distance_error.attrs["units"] == "m"
    assert "fault_misalignment_units" not in records.attrs
    np.testing.assert_allclose(records.contact_ratio, [1.6427, 1.6427, 0.7733], atol=2e-2)
    assert records.attrs["remarks"].startswith("distance: contact ratio 0.773 is below 1")
    lines = paper_report(study).splitlines()
    assert "| operation_speed | 104.72 rad/s |" in lines
    assert not any("_units" in line for line in lines)
    assert len(paper_cases()) == 6
    assert float(records.contact_ratio[2]) == pytest.approx(study.cases[2].pair().contact_ratio)
