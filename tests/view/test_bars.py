import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgb

from gearmbs.view import COLOURS, comparison_bars, gmf_bars, save_figure
from tests.says import says
from tests.view.looking import assert_readable


@pytest.fixture
def table():
    return xr.DataArray(
        [[0.3, 0.21, 0.1], [0.5, 12.6, 0.4], [0.9, 0.8, 0.7]],
        dims=("state", "harmonic"),
        coords={
            "state": ["healthy", "misaligned", "distance"],
            "harmonic": [1, 2, 3],
            "frequency": ("harmonic", [483.3, 966.7, 1450.0]),
            "fault_misalignment": ("state", [0.0, np.deg2rad(1.0), 0.0]),
            "fault_centre_distance_error": ("state", [0.0, 0.0, 3e-3]),
        },
        attrs={"units": "m/s^2", "long_name": "RMS, scaled"},
    )


def test_three_groups_of_three_bars_of_the_right_height(table):
    ax = gmf_bars(table, title="low load").axes[0]
    assert [len(c) for c in ax.containers if hasattr(c, "patches")] == [3, 3, 3]
    heights = [[p.get_height() for p in c] for c in ax.containers if hasattr(c, "patches")]
    np.testing.assert_array_equal(heights, table.values)
    assert "m/s²" in ax.get_ylabel()
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["healthy", "misaligned 1°", "distance +3 mm"]
    assert [t.get_text().split("\n")[0] for t in ax.get_xticklabels()] == ["1× GMF", "2× GMF", "3× GMF"]


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.slow
def test_bars_are_readable(table, log):
    assert_readable(gmf_bars(table, title="Model, low load (100 N m): RMS of the GMF harmonics", log=log))


def test_bars_are_drawn_into_given_axes_and_leave_the_settings_alone(table):
    import matplotlib
    from matplotlib.figure import Figure

    before = dict(matplotlib.rcParams)
    ax = Figure().subplots()
    assert gmf_bars(table, ax=ax) is ax.get_figure()
    assert dict(matplotlib.rcParams) == before


@pytest.mark.slow
def test_figures_need_no_pyplot():
    import subprocess
    import sys

    code = (
        "import sys, numpy as np, xarray as xr, gearmbs.view as v\n"
        "assert 'matplotlib' not in sys.modules\n"
        "coords = {'state': ['a', 'b'], 'harmonic': [1, 2, 3]}\n"
        "t = xr.DataArray(np.ones((2, 3)), dims=('state', 'harmonic'), coords=coords)\n"
        "v.gmf_bars(t)._repr_png_()\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_order_of_dimensions_does_not_matter(table):
    one = gmf_bars(table).axes[0].containers[0][1].get_height()
    two = gmf_bars(table.transpose("harmonic", "state")).axes[0].containers[0][1].get_height()
    assert one == two


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.isel(harmonic=0), "dims are"),
        (lambda t: t - 1.0, says("table", "-0.7", "'healthy'", "RMS")),
        (lambda t: t * np.inf, says("table", "inf", "'healthy'", "RMS")),
        (lambda t: t.values, "ndarray"),
        (lambda t: t.isel(state=[]), says("table", "(0, 3)", "empty")),
    ],
)
def test_wrong_tables_are_named(table, change, message):
    with pytest.raises(ValueError, match=message):
        gmf_bars(change(table))


def test_missing_values_are_said_to_be_missing(table):
    table[1, 1] = np.nan
    texts = [t.get_text() for t in gmf_bars(table).axes[0].texts]
    assert texts.count("no data") == 1


@pytest.mark.slow
def test_comparison_has_a_panel_for_each_load_and_side(table):
    loads = xr.concat([table, 2 * table], "load").assign_coords(load=["low", "high"])
    data = xr.Dataset({"experiment": loads, "model": 1.5 * loads}, attrs={"units": "m/s^2"})
    figure = comparison_bars(data, title="Experiment against model")
    assert [ax.get_title(loc="left") for ax in figure.axes] == [
        f"{side}, {load} load" for load in ("low", "high") for side in ("experiment", "model")
    ]
    # both panels of a row share the axis and hold the larger side: 1.5 x 12.6
    assert figure.axes[0].get_ylim() == figure.axes[1].get_ylim()
    assert figure.axes[0].get_ylim()[1] > 1.5 * 12.6
    assert_readable(figure)
    assert len(comparison_bars(data[["experiment"]]).axes) == 2
    with pytest.raises(ValueError, match=says("data", "'experiment'", "['model']", "pass")):
        comparison_bars(data[["model"]])


@pytest.mark.slow
def test_files_are_whole_or_not_there(table, tmp_path):
    paths = save_figure(gmf_bars(table), tmp_path / "deep" / "figure_5.v2")
    assert [p.name for p in paths] == ["figure_5.v2.png", "figure_5.v2.svg"]
    assert paths[0].read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert paths[1].read_text().rstrip().endswith("</svg>")
    first = paths[1].read_bytes()
    save_figure(gmf_bars(table), tmp_path / "deep" / "figure_5.v2")
    assert paths[1].read_bytes() == first

    class Broken:
        def savefig(self, path, **_):
            path.write_bytes(b"half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        save_figure(Broken(), tmp_path / "broken")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deep"]


def test_palette_is_apart_for_colour_blind_readers():
    # simulated protanopia and deuteranopia (Vienot et al. 1999, linear RGB): the first five stay apart
    protan = np.array([[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]])
    deutan = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]])
    linear = np.array([to_rgb(c) for c in COLOURS[:5]]) ** 2.2
    for matrix in (protan, deutan):
        seen = np.clip(linear @ matrix.T, 0.0, 1.0) ** (1 / 2.2)
        apart = np.linalg.norm(seen[:, None] - seen[None], axis=-1) + 10 * np.eye(5)
        assert apart.min() > 0.1
