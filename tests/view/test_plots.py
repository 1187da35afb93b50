import warnings

import numpy as np
import pytest
import xarray as xr

from gearmbs import signals
from gearmbs.gears import GearPair, GearSpec, loaded_transmission_error
from gearmbs.gears.pattern import contact_pattern
from gearmbs.view import (
    average_plot,
    contact_pattern_plot,
    load_sharing_plot,
    named_lines_plot,
    order_plot,
    sensitivity_map,
    spectrum_plot,
    stiffness_plot,
    time_plot,
    transmission_error_plot,
)
from gearmbs.view.figures.mesh_cycle import path_ends
from gearmbs.view.figures.records import thinned
from tests.generators import cases, seed
from tests.says import says
from tests.view.looking import assert_readable

GMF = 483.3333


@pytest.fixture(scope="module")
def signal():
    t = np.arange(12800) / 12800
    x = np.sin(2 * np.pi * GMF * t) * (1 + 0.3 * np.cos(2 * np.pi * t * GMF / 29)) + 0.2 * np.sin(4 * np.pi * GMF * t)
    data = {"line_of_action": x, "tangential": 0.5 * x**2}
    return signals.make_signal(data, 12800, units="m/s^2", speed=2 * np.pi * GMF / 29, teeth=(29, 29))


def test_time_plot_shows_the_span_with_units(signal):
    figure = time_plot(signal, start=0.1, stop=0.2, title="Acceleration of gear 2")
    assert len(figure.axes) == 2
    line = figure.axes[0].lines[0]
    assert line.get_xdata()[0] == pytest.approx(0.1)
    assert line.get_xdata().size == 1280
    assert figure.axes[0].get_ylabel() == "acceleration, m/s²"
    assert figure.axes[1].get_xlabel() == "time, s"
    assert_readable(figure)


@pytest.mark.slow
def test_spectrum_marks_the_mesh_lines_and_sidebands(signal):
    figure = spectrum_plot(signals.spectrum(signal), gmf=GMF, sideband=GMF / 29, maximum=2000.0)
    ax = figure.axes[0]
    marks = [line.get_xdata()[0] for line in ax.lines[1:]]
    np.testing.assert_allclose(marks, [GMF, 2 * GMF, 3 * GMF])
    assert [t.get_text() for t in ax.texts] == ["1× GMF", "2× GMF", "3× GMF"]
    assert ax.get_xlim() == (0.0, 2000.0)
    assert_readable(figure)
    # lines beyond the shown band are left out
    assert len(spectrum_plot(signals.spectrum(signal), gmf=GMF, maximum=600.0).axes[0].texts) == 1


@pytest.mark.slow
def test_order_plot_marks_the_mesh_orders(signal):
    phase = signals.phase_from_speed(signal, signal.attrs["speed"])
    spectrum = signals.order_spectrum(signals.angular_resample(signal, phase))
    figure = order_plot(spectrum, teeth=29, maximum=100.0, title="Order spectrum")
    assert [line.get_xdata()[0] for line in figure.axes[0].lines[1:]] == [29, 58, 87]
    assert_readable(figure)


@pytest.mark.slow
def test_averages_share_their_axes_and_count_teeth(signal):
    phase = signals.phase_from_speed(signal, signal.attrs["speed"])
    average = signals.time_synchronous_average(signal, phase)[:, [0]]
    figure = average_plot(
        {"healthy": average, "chipped": average.copy(data=2.0 * average.values)}, teeth=29, title="One revolution"
    )
    one, two = figure.axes
    assert one.get_ylim() == two.get_ylim()
    assert one.get_ylabel() == "acceleration, m/s²"
    assert two.get_xlabel() == "pitches from the record's first sample, 29 teeth"
    # the last sample lies one step before the full turn
    assert two.lines[0].get_xdata()[-1] == pytest.approx(29 * (1 - 1 / average.sizes["angle"]))
    assert abs(two.lines[0].get_ydata().mean()) < 1e-12
    assert_readable(figure)
    assert average_plot(average).axes[0].get_xlabel() == "revolution, from the record's first sample"


@pytest.mark.slow
def test_teeth_that_an_average_does_not_have_are_told(signal):
    average = signals.time_synchronous_average(signal, signals.phase_from_speed(signal, signal.attrs["speed"]))[:, [0]]
    unknown = average.copy()
    unknown.attrs = {k: v for k, v in average.attrs.items() if k != "teeth"}
    turn = average["angle"].values
    mesh = unknown.copy(data=(np.cos(29 * 2 * np.pi * turn) + 0.3 * np.cos(2 * np.pi * turn))[:, None])
    with pytest.warns(UserWarning, match=says("teeth=31", "29", "periods a revolution")):
        average_plot({"a": mesh}, teeth=31)
    with pytest.warns(UserWarning, match=says("teeth=31", "average", "29", "47 teeth")):
        average_plot(mesh.assign_attrs(teeth=(29, 47)), teeth=31)
    with pytest.warns(UserWarning, match=says("teeth=47", "29")):
        average_plot(mesh.assign_attrs(teeth=(29, 47)), teeth=47)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        average_plot(mesh, teeth=29)
        average_plot(mesh.assign_attrs(teeth=(47, 29)), teeth=29)
        # a line of the shaft, a second harmonic alone, and one click a turn speak against no number of teeth
        average_plot(unknown.copy(data=np.cos(2 * np.pi * 2 * turn)[:, None]), teeth=31)
        average_plot(unknown.copy(data=np.cos(2 * np.pi * 62 * turn)[:, None]), teeth=31)
        average_plot(unknown.copy(data=np.exp(-(((turn - 0.5) / 0.01) ** 2))[:, None]), teeth=31)
    for wrong in (29.5, 0, True):
        with pytest.raises(ValueError, match=says("teeth", "whole number")):
            average_plot(mesh, teeth=wrong)


@pytest.mark.parametrize("case", range(cases(12)))
def test_the_axis_of_an_average_has_the_numbers_of_the_teeth(case):
    """A click whenever one tooth is on the line of centres: wherever the phase begins, the axis shows the tooth."""
    rng = np.random.default_rng((seed(), case))
    teeth = tuple(int(z) for z in rng.choice(np.arange(12, 70), 2, replace=False))
    wheel = int(rng.integers(2))
    tooth, count = int(rng.integers(teeth[wheel])), teeth[wheel]
    turn, t_ref, numbers = rng.uniform(5.0, 30.0), rng.uniform(0.0, 1.0), rng.uniform(0.0, 12.0, 2)
    steps = rng.choice([-1.0, 1.0], 2)
    rate = 200.0 * count * turn * teeth[0] / count
    own_turn = turn * teeth[0] / count
    t = t_ref + np.arange(int(6.5 / own_turn * rate)) / rate
    at = (numbers[wheel] + steps[wheel] * count * own_turn * (t - t_ref) - tooth + count / 2) % count - count / 2
    made = signals.make_signal(
        np.exp(-((at / 0.2) ** 2)), rate, units="m/s^2", t0=t_ref, speed=2 * np.pi * turn, teeth=teeth,
        attrs={"teeth_in_mesh": (t_ref, numbers[0], steps[0], numbers[1], steps[1])},
    )  # fmt: skip
    # cut anywhere; angles by the speed, or that of a tacho, which begins later and anywhere
    part = made[int(rng.integers(0, made.sizes["time"] // 8)) :]
    phase = signals.phase_from_speed(part, 2 * np.pi * own_turn)
    if rng.random() < 0.5:
        phase = (phase + rng.uniform(0.0, 6.0))[int(rng.integers(0, rate / own_turn)) :]
    average = signals.time_synchronous_average(part, phase)
    panel = average_plot(average, teeth=count).axes[0]
    assert panel.get_xlabel() == f"tooth of the {('driver', 'driven wheel')[wheel]} in mesh, 0 to {count - 1}"
    x, y = panel.lines[0].get_data()
    assert abs((x[np.argmax(y)] - tooth + count / 2) % count - count / 2) < 0.1
    assert panel.xaxis_inverted() == (steps[wheel] < 0)
    # of a wheel with other teeth, or of one whose speed is none of the pair's, nothing is known
    assert average_plot(average, teeth=count + 1).axes[0].get_xlabel().startswith("pitches from")
    other = signals.time_synchronous_average(part, signals.phase_from_speed(part, 1.31 * 2 * np.pi * turn))
    assert "tooth_numbers" not in other.attrs or abs(1.31 / (teeth[0] / teeth[1]) - 1) < 0.01


@pytest.mark.parametrize("case", range(cases(4)))
def test_the_path_in_a_pattern_leans_with_the_helix(case):
    """Helix, hand, sense, ring or not, either flank: what bears without load to speak of lies between the lines."""
    rng = np.random.default_rng((seed(), case))
    hand, rotation, ring = str(rng.choice(["right", "left"])), int(rng.choice([-1, 1])), bool(rng.random() < 0.3)
    side, settings = str(rng.choice(["drive", "coast"])), {"helix_angle": rng.uniform(0.05, 0.4), "face_width": "20 mm"}
    one = GearSpec(int(rng.integers(20, 30)), "2 mm", hand=hand, **settings)
    if ring:
        two = GearSpec.ring(int(rng.integers(80, 95)), "2 mm", hand=hand, addendum="1.4 mm", **settings)
    else:
        two = GearSpec(int(rng.integers(20, 50)), "2 mm", hand={"right": "left", "left": "right"}[hand], **settings)
    # a tilt as small as jams the coast flanks: they bear only then
    jam = {"misalignment": "0.3 deg", "backlash": "0.01 mm"} if side == "coast" else {"backlash": "0.1 mm"}
    pair = GearPair(one, two, rotation=rotation, **jam)
    pattern = contact_pattern(pair, 0.05, points=61, sections=9, side=side)
    ends, loaded = path_ends(pattern, pair), pattern.pressure > 0.0
    # lines lean by the transverse lead: z tan(beta) / r on the pitch circle
    lean = np.diff(ends, axis=1) / np.diff(pattern.section)
    expected = np.tan(one.helix_angle) / one.pitch_radius
    np.testing.assert_allclose(np.abs(lean), expected, rtol=1e-9)
    if side == "coast":
        return
    step, roll = np.diff(pattern.roll_angle)[0], pattern.roll_angle[:, None]
    assert not np.any(loaded & ((roll < ends[0] - 2 * step) | (roll > ends[1] + 2 * step)))
    assert np.all(loaded[(roll > ends[0] + 2 * step) & (roll < ends[1] - 2 * step)])


def test_thinning_keeps_the_extremes():
    y = np.random.default_rng(5).standard_normal(1_000_003)
    x, z = thinned(np.arange(y.size) * 1.0, y, 10_000)
    assert z.size <= 10_200
    assert (z.max(), z.min()) == (y.max(), y.min())
    assert (np.diff(x) >= 0).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: time_plot(s, start=5.0), "spans 0 to"),
        (lambda s: spectrum_plot(s), says("data", "'frequency'", "('time', 'channel')")),
        (lambda s: spectrum_plot(signals.spectrum(s), gmf=-1.0), says("gmf", "-1.0", "give a positive")),
        (lambda s: time_plot(s[:1]), "at least 2"),
        (lambda s: time_plot(s.values), "ndarray"),
        (lambda s: order_plot(signals.spectrum(s), teeth=29), says("data", "'order'", "('frequency', 'channel')")),
        (lambda s: average_plot(s), says("averages", "'angle'", "('time', 'channel')")),
        (lambda s: average_plot({}), says("averages", "empty", "average")),
        (lambda s: average_plot(signals.angular_resample(s, signals.phase_from_speed(s, 100.0))), "several channels"),
    ],
)
def test_wrong_signals_are_named(signal, call, message):
    with pytest.raises(ValueError, match=message):
        call(signal)


@pytest.fixture
def ratios():
    values = np.exp(np.random.default_rng(1).standard_normal((2, 4, 5)))
    values[1, 2, 3] = np.nan
    depth = ("depth", [1e-5, 3e-5, 1e-4, 1e-3], {"units": "m", "long_name": "penetration depth d"})
    backlash = ("backlash", [0, 5e-5, 1e-4, 2e-4, 4e-4], {"units": "m", "long_name": "normal backlash"})
    return xr.DataArray(
        values,
        dims=("plane", "depth", "backlash"),
        coords={"plane": ["skew", "inclination"], "depth": depth, "backlash": backlash},
        attrs={"long_name": "misaligned / healthy at 2× GMF", "units": "1"},
    )


@pytest.mark.slow
def test_map_names_axes_in_drawing_units_and_marks_failed_runs(ratios):
    figure = sensitivity_map(ratios, centre=1.0, log=True, title="Does misalignment raise the 2nd harmonic?")
    left, right, bar = figure.axes
    assert left.get_xlabel() == "normal backlash, mm"
    assert left.get_ylabel() == "penetration depth d, mm"
    assert [t.get_text() for t in left.get_yticklabels()] == ["0.01", "0.03", "0.1", "1"]
    assert right.get_title(loc="left") == "plane: inclination"
    assert [t.get_text() for t in right.texts].count("no\nresult") == 1
    assert bar.get_ylabel() == "misaligned / healthy at 2× GMF"
    assert_readable(figure)
    # "no change" is the middle of the colours
    assert left.collections[0].norm(1.0) == pytest.approx(0.5)


@pytest.mark.slow
def test_map_axes_can_be_exchanged(ratios):
    figure = sensitivity_map(ratios[0], x="depth", title="one plane")
    assert figure.axes[0].get_xlabel() == "penetration depth d, mm"
    assert_readable(figure)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda t: sensitivity_map(t, x="speed"), says("x", "'speed'", "plane", "depth", "backlash")),
        (lambda t: sensitivity_map(t, x="depth", y="depth"), "two dimensions"),
        (lambda t: sensitivity_map(t[0, 0]), says("three dimensions")),
        (lambda t: sensitivity_map(t - 10.0, log=True), says("log", "-9.93354", "positive")),
        (lambda t: sensitivity_map(t * np.nan), "no finite value"),
    ],
)
def test_wrong_maps_are_named(ratios, call, message):
    with pytest.raises(ValueError, match=message):
        call(ratios)


@pytest.fixture(scope="module")
def pair():
    return GearPair.paper(backlash="0.1 mm")


@pytest.mark.slow
def test_transmission_error_and_stiffness_over_cycles(pair):
    errors = {
        "healthy": loaded_transmission_error(pair, points=40),
        "+3 mm": loaded_transmission_error(pair.with_changes(centre_distance_error=3e-3), points=40),
    }
    figure = transmission_error_plot(errors, title="Loaded transmission error, 100 N m")
    line = figure.axes[0].lines[0]
    assert line.get_ydata().size == 80
    np.testing.assert_allclose(line.get_ydata()[:40], errors["healthy"].error * 1e6)
    assert figure.axes[0].get_ylabel() == "transmission error, µm"
    assert_readable(figure)
    stiff = stiffness_plot(errors["healthy"])
    assert stiff.axes[0].get_ylim()[0] == 0.0
    assert_readable(stiff)
    with pytest.raises(ValueError, match=says("cycles", "0", "give 1 or more")):
        transmission_error_plot(errors, cycles=0)
    with pytest.raises(ValueError, match=says("errors", "empty", "curve")):
        stiffness_plot({})


@pytest.mark.slow
def test_long_names_of_curves_stay_in_the_figure(pair):
    error = loaded_transmission_error(pair, torque=100.0)
    names = {f"centre distance +{k} mm, contact ratio 1.{k}4": error for k in range(3)}
    assert_readable(transmission_error_plot(names))


@pytest.mark.slow
def test_load_sharing_and_contact_pattern(pair):
    tilted = pair.with_changes(misalignment=np.deg2rad(1.0))
    patterns = {n: contact_pattern(p, points=21, sections=11) for n, p in (("healthy", pair), ("misaligned", tilted))}
    assert_readable(load_sharing_plot(patterns, title="Load sharing"))
    figure = contact_pattern_plot(patterns["misaligned"], pair=tilted, title="Contact pattern")
    drawn = figure.axes[0].collections[0].get_array()
    # N/m to N/mm, and nothing drawn where nothing bears
    assert drawn.max() == pytest.approx(patterns["misaligned"].pressure.max() * 1e-3)
    assert np.ma.getmaskarray(drawn).sum() == (patterns["misaligned"].pressure == 0).sum()
    assert_readable(figure)
    empty = contact_pattern(pair, points=5, sections=3, side="coast")
    assert "no load" in contact_pattern_plot(empty).axes[0].texts[0].get_text()


def test_lines_at_one_frequency_are_all_named():
    """Of a tone on a bin the figure says both lines it can be, and what is not known it does not name."""
    t = np.arange(8000) / 8000.0
    tones = np.sin(2 * np.pi * 600.0 * t) + 0.5 * np.sin(2 * np.pi * 950.0 * t)
    found = signals.spectrum(signals.make_signal(tones[:, None], 8000.0, units="N"))
    known = {"mesh one": {"2 x one": 600.0}, "mesh two": {"3 x two": 600.0}, "shaft in": {"1 x in": 0.5}}
    figure = named_lines_plot(found, known, maximum=2000.0)
    upper, lower = figure.axes
    assert upper.texts[-1].get_text() == " 1  600 Hz  2 x one or 3 x two"
    assert [text.get_text() for text in lower.get_yticklabels()] == ["mesh one", "mesh two"]
    with pytest.raises(ValueError, match="no line between"):
        named_lines_plot(found, {"shaft in": {"1 x in": 9000.0}})
    with pytest.raises(ValueError, match=says("spectrum", "no channels", "sel(channel=[...])")):
        named_lines_plot(found.isel(channel=0, drop=True), known)
