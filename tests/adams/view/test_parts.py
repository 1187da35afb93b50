"""What a part of a command file says that the deck has no use for."""

import pytest

from gearmbs.adams import read_view

MODEL = """model create model_name = m
defaults units length = mm angle = deg force = newton mass = kg time = sec
part create rigid_body name_and_position part_name = .m.P location = 0, 0, 0 orientation = 0, 0, 0 {exact}
marker create marker_name = .m.P.cm location = 0, 0, 0 orientation = 0, 0, 0
part create rigid_body mass_properties part_name = .m.P mass = 2 center_of_mass_marker = .m.P.cm ixx = 1 iyy = 1 izz = 1
"""


@pytest.mark.parametrize(("exact", "told"), [("exact_coordinates = x, y, z", 1), ("", 0)])
def test_coordinates_that_are_to_be_exact_are_remarked(tmp_path, exact, told):
    """Parts that contradict their joints are moved, all alike: which of them was to stay has no effect."""
    path = tmp_path / "m.cmd"
    path.write_text(MODEL.format(exact=exact))
    remarks = [str(one) for one in read_view(path).deck.diagnostics]
    assert sum("exact_coordinates" in one for one in remarks) == told
