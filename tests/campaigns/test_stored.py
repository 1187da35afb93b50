"""What a worker writes without the whole of the libraries that define it is what these would write."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest

from gearmbs.campaigns import signals
from gearmbs.campaigns.subjects.base import SignalSpec
from gearmbs.files import arrow_column
from tests.campaigns.support import small


@pytest.mark.parametrize(("cases", "channels", "samples"), [(1, 1, 1), (7, 3, 40), (16, 1, 200), (5, 2, 3000)])
def test_a_shard_is_what_zarr_writes(cases, channels, samples):
    """To the last byte, with cases that failed, and zarr reads it back."""
    block = np.random.default_rng(samples).standard_normal((cases, channels, samples)).astype(np.float32)
    block[cases // 2] = np.nan
    block[0, 0, samples // 2 :] = 0.0
    spec = SignalSpec("wave", tuple(f"c{k}" for k in range(channels)), samples, 10.0, "m")
    array, files = signals._in_memory(spec, cases, 1)
    array[:] = block
    own = signals.encoded(block)
    assert own == files["wave/c/0/0/0"].to_bytes()
    again, files = signals._in_memory(spec, cases, 1)
    files["wave/c/0/0/0"] = files["wave/zarr.json"].from_bytes(own)
    assert again[:].tobytes() == block.tobytes()


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ([1.5, math.nan, None, -0.0], None), ([0.5] * 9 + [None], pa.float64()), ([1, 2, None], None),
        ([2**63 - 1, -(2**63)], None), ([True, False], None), ([1, 2.5], None), ([1, 2], pa.float64()),
        (["a", None, "ü€", ""], None), ([None, None], None), ([None], pa.float64()), ([], None),
        (np.arange(3.0), None), (np.arange(6.0)[::2], None), (np.arange(3), None), (np.array(["a", "bé"]), None),
        (np.array(["a", None], dtype=object), None), (np.array([1.5, None], dtype=object), None),
        (np.arange(3, dtype=np.float32), None), (np.array([True]), None), (np.array([1, 2], dtype=object), None),
    ],
)  # fmt: skip
def test_a_column_is_what_arrow_makes(values, kind):
    found, wanted = arrow_column(values, kind), pa.array(values, type=kind)
    found.validate(full=True)
    assert found.type == wanted.type
    assert repr(found.to_pylist()) == repr(wanted.to_pylist())


@pytest.mark.parametrize("values", [[2**63], ["a\ud800"], [1, "a"]])
def test_what_arrow_refuses_is_no_column(values):
    with pytest.raises((OverflowError, UnicodeEncodeError, pa.ArrowException)) as own:
        arrow_column(values)
    with pytest.raises(own.type):
        pa.array(values)


@pytest.mark.slow
def test_a_worker_loads_what_it_needs(tmp_path):
    """Cases of a function load neither what reads tables nor zarr's arrays."""
    campaign = small(tmp_path / "c")
    heavy = ("pandas", "xarray", "zarr", "scipy.stats", "matplotlib", "pint")
    text = (
        "import sys\nfrom gearmbs.campaigns.work import work_unit\n"
        f"assert work_unit({str(campaign.path)!r}, False, 0)\n"
        f"print([name for name in {heavy} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert campaign.status().units_done == 1
