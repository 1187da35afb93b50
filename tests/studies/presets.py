"""The files of the presets beside what their functions make of the default settings."""

import pytest

from gearmbs.drivetrain import Drivetrain
from gearmbs.studies.trains import described, load_train


def agrees_with_its_file(name: str, train: Drivetrain) -> None:
    """Assert that a file describes a drivetrain; contact laws, which files may leave to defaults, by their pairs."""
    made = load_train(name).train
    assert (made.name, made.run_up, made.running) == (train.name, train.run_up, train.running)
    assert list(made.parts) == list(train.parts)
    for part in made.parts:
        agree(without_names(made.parts[part]), without_names(train.parts[part]), part)
    for mesh, pair in made.pairs.items():
        agree(described(pair), described(train.pairs[mesh]), mesh)


def without_names(part):
    """Return a part as tables without its contact and the names of what it consists of."""
    table = described(part)
    table.get("settings", {}).pop("contact", None)
    # shafts have modes, too, by their number
    for piece in (*table.get("mounts", ()), *(table.get("modes") or ())):
        del piece["name"]
    return table


def agree(one, other, where):
    """Compare nested tables: numbers to 1e-5, all else as it is."""
    if isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for key in one:
            agree(one[key], other[key], f"{where}.{key}")
    elif isinstance(one, list):
        assert len(one) == len(other), where
        for k, pair in enumerate(zip(one, other)):
            agree(*pair, f"{where}[{k}]")
    elif isinstance(one, float):
        assert one == pytest.approx(other, rel=1e-5, abs=1e-12), where
    else:
        assert one == other, where
