"""Records know the drivetrain that they are of."""

import json

import numpy as np
import pytest
import xarray as xr

from gearmbs.drivetrain import DrivetrainError
from gearmbs.studies.same_train import check_record_of
from gearmbs.studies.trains import described
from tests.drivetrain.support import stage
from tests.says import says


def record_of(train, *, described_parts=True):
    """What of a record tells its drivetrain."""
    out = xr.Dataset(coords={
        "shaft": list(train.turning), "mesh": [m.name for m in train.meshings],
        "bearing": [b.name for b in train.bearings], "sensor": [],
        "nominal_frequency": ("mesh", [train.kinematics.mesh_frequency(m.name) for m in train.meshings]),
    })  # fmt: skip
    out.attrs["mesh_teeth"] = np.array([20, 60])
    if described_parts:
        out.attrs["train_json"] = json.dumps(described(dict(train.parts)))
    return out


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("brake", {"torque": "400 N m"}, ("torque", "'brake'", "300 N m", "400 N m")),
        ("motor", {"speed": "1000 rpm"}, ("speed", "'motor'")),
        ("pinion", {"station": "40 mm"}, ("station", "'pinion'", "null")),
        ("mesh", {"settings": {"backlash": "0.2 mm"}}, ("settings.backlash", "0.2 mm")),
    ],
)
def test_the_record_of_another_drivetrain_is_refused_with_what_differs(name, changes, said):
    record = record_of(stage())
    check_record_of(stage(), record)
    with pytest.raises(DrivetrainError, match=says("record", *said)):
        check_record_of(stage().changed(name, **changes), record)


def test_a_quantity_may_be_given_in_another_unit_or_none():
    record = record_of(stage())
    for name, changes in (("brake", {"torque": 300.0}), ("brake", {"torque": "300 N*m"}), ("motor", {"speed": "25 Hz"}),
                          ("mesh", {"settings": {"backlash": 1e-4}})):  # fmt: skip
        check_record_of(stage().changed(name, **changes), record)
    with pytest.raises(DrivetrainError, match=says("torque", "'brake'")):
        check_record_of(stage().changed("brake", torque=300.1), record)


def test_parts_that_one_of_them_has_alone_are_named():
    with pytest.raises(DrivetrainError, match=says("sensor names", "none")):
        check_record_of(stage(), record_of(stage()).assign_coords(sensor=["laser"]))


def test_what_one_version_does_not_know_and_places_in_memory_do_not_count():
    record = record_of(stage())
    parts = json.loads(record.attrs["train_json"])
    del parts["brake"]["station"]
    parts["motor"]["function"] = "<function curve at 0x7f00>"
    record.attrs["train_json"] = json.dumps(parts)
    check_record_of(stage(), record)


def test_records_without_a_description_are_compared_by_frequencies_and_teeth():
    record = record_of(stage(), described_parts=False)
    check_record_of(stage(), record)
    # a torque is not in such a record
    check_record_of(stage().changed("brake", torque=1.0), record)
    with pytest.raises(DrivetrainError, match=says("mesh 'mesh'", "500 Hz", "333.333 Hz")):
        check_record_of(stage().changed("motor", speed="1000 rpm"), record)
    record.attrs["mesh_teeth"] = np.array([20, 61])
    with pytest.raises(DrivetrainError, match=says("teeth", "[20, 61]")):
        check_record_of(stage(), record)
