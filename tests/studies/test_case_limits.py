"""Settings that no record can be made of are refused before anything is simulated, with field, value and remedy."""

import subprocess
import sys

import numpy as np
import pytest

from gearmbs.studies import Case, CaseError, SimulationFailed, load_case, make_case, run_case, run_cases
from gearmbs.studies.case.limits import check_record, remarks
from gearmbs.studies.run.recorder import slip
from tests.says import says


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ({"fault": {"backlash": 0.1}}, says("fault.backlash = 0.1", "100 mm", "write '0.1 mm'")),
        ({"fault": {"backlash": "5 mm"}}, says("fault.backlash", "5 mm", "module", "3.06452 mm")),
        (
            {"gears": {"module": 3.0645}},
            says("gears.module = 3.0645", "3064.5 mm", "'3.0645 mm'"),
        ),
        ({"gears": {"face_width": 20}}, r"gears.face_width = 20: this is 20000 mm"),
        ({"gears": {"face_width": ["20 mm"]}}, says("1", "give", "both wheels")),
        ({"gears": {"density": 7.85}}, says("gears.density = 7.85", "7.85 kg/m", "3", "30000 kg/m", "give 10")),
        ({"gears": {"tip_radius": "40 mm"}}, says("tip_radius", "40.0000 mm")),
        ({"gears": {"tip_radius": "47 mm", "addendum": "3 mm"}}, says("tip_radius", "addendum")),
        ({"shafts": {"density": "7850 kg"}}, r"shafts.density = '7850 kg': '7850 kg' is in kg"),
        ({"fault": {"misalignment": 1}}, r"fault.misalignment = 1: this is 57.2958 deg; .*write '1 deg'"),
        ({"operation": {"speed": "1000"}}, says("operation.speed = '1000'", "'1000 rpm'", "write")),
        ({"operation": {"speed": True}}, says("operation.speed = True", "give a number")),
        ({"operation": {"torque": "1e9 N m"}}, r"operation.torque = '1e9 N m': this is 1e\+09 N m"),
        ({"contact": {"stiffness": "3 N/mm"}}, r"contact.stiffness: '3 N/mm' is in N / mm where"),
        ({"solver": {"tolerance": 1e-2}}, says("tolerance = 0.01", "5e-06", "give 1e-12")),
        ({"solver": {"tolerance": 1e-16}}, says("tolerance = 1e-16", "give 1e-12")),
        ({"solver": {"tolerance": 2e-6, "integrator": "IDA"}}, r"give 1e-12 to 1e-06 with IDA"),
        (
            {"solver": {"signal_rate": 12345.0, "output_rate": 51200.0}},
            says("signal_rate 12345 Hz", "output_rate = 61725"),
        ),
    ],
)
def test_values_out_of_range(data, words):
    with pytest.raises(CaseError, match=words) as caught:
        make_case(data)
    assert "value:" not in str(caught.value)


def test_material_and_sizes_of_each_wheel(tmp_path):
    """As text, per wheel, and in the masses: density times pi r_p^2 b."""
    path = tmp_path / "plastic.toml"
    path.write_text(
        '[gears]\nteeth = [20, 31]\nmodule = "2 mm"\nface_width = ["22 mm", "20 mm"]\n'
        'tip_radius = ["22 mm", "33 mm"]\nroot_radius = ["17.5 mm", "28.5 mm"]\n'
        'density = ["7.85 g/cm^3", 1400.0]\nyoungs_modulus = ["207 GPa", "3 GPa"]\npoisson_ratio = [0.29, 0.35]\n'
        '[shafts]\ndensity = "7850 kg/m^3"\n'
    )
    case = load_case(path)
    one, two = case.pair().wheels
    assert one.face_width == pytest.approx(0.022)
    assert two.addendum == pytest.approx(0.002)
    assert one.dedendum == pytest.approx(0.0025)
    assert two.material.youngs_modulus == pytest.approx(3e9)
    assert two.material.poisson_ratio == 0.35
    assert two.mass == pytest.approx(1400.0 * np.pi * 0.031**2 * 0.020)
    assert one.mass == pytest.approx(7850.0 * np.pi * 0.020**2 * 0.022)
    assert case.shafts.density == 7850.0
    assert make_case(case.model_dump()) == case


@pytest.mark.parametrize(
    ("data", "words"),
    [
        # (3 + 1/4 + 1/4) 29 n of 1000 rad/s is 16154 Hz, half of 38400 Hz is the first multiple of 6400 Hz above it
        (
            {"operation": {"speed": "1000 rad/s"}, "solver": {"signal_rate": 12800.0}},
            r"signal_rate = 12800 Hz: .*9549.3 rpm.* up to 16154.2 Hz.*signal_rate = 38400",
        ),
        # far too low a rate alone asks for no more samples of force than by default: 51.2 kHz or more, by doubling
        ({"solver": {"signal_rate": 100.0}}, "give signal_rate = 3400 and output_rate = 54400,"),
        ({"operation": {"duration": "5 ms"}}, r"operation.duration = 0.005 s: .*483.333 Hz needs .* at least 0.0084"),
        ({"operation": {"run_up": 0.004, "settling": 0.0}}, r"operation.settling = 0 s: .* needs 0.01 s before"),
        (
            {"contact": {"stiffness": "1e-3 N/mm^1.3"}},
            r"contact.stiffness = '1e-3 N/mm\^1.3': at operation.torque = 100",
        ),
    ],
)
def test_records_that_cannot_be_evaluated(data, words):
    """Refused by the run, by several runs, and by the check itself; a case for other uses can still be made."""
    case = make_case(data)
    for refuse in (check_record, run_case, lambda c: run_cases([c])):
        with pytest.raises(CaseError, match=words):
            refuse(case)


def test_the_shortest_record_that_is_accepted_is_long_enough():
    """At the length that the message names, the filters accept the record; the anti-alias filter fits in the edge."""
    from gearmbs.signals import gmf_rms, make_signal

    case = Case(operation={"speed": "1237 rpm"})
    with pytest.raises(CaseError) as caught:
        check_record(case.changed(operation={"duration": 0.01}), bands=True)
    need = float(str(caught.value).split("at least ")[1].split(" s")[0])
    for seconds, fits in ((need + 0.0005, True), (need - 0.001, False)):
        changed = case.changed(operation={"duration": seconds})
        assert fits == (_refusal(changed, bands=True) is None)
        # by orders alone there is no such limit
        assert _refusal(changed) is None
    count = round((need + 0.0005) * case.signal_rate)
    t = np.arange(count) / case.signal_rate
    signal = make_signal(np.cos(2 * np.pi * case.mesh_frequency * t), case.signal_rate, units="m/s^2")
    assert gmf_rms(signal, case.mesh_frequency)["band"].shape == (3, 1)
    slow = Case(solver={"signal_rate": 1600.0, "output_rate": 51200.0})
    # Kaiser's 100 dB over a tenth of the new rate: half the filter is 0.5 (100 - 7.95)/(2.285 2 pi 0.1 f) = 20 ms
    assert slow.edge == pytest.approx(0.5 * 92.05 / (2.285 * 2 * np.pi * 0.1 * 1600.0), rel=0.02)
    assert case.edge == 0.01


def _refusal(case, **how):
    try:
        check_record(case, **how)
    except CaseError as error:
        return str(error)
    return None


def test_wheels_that_slipped_past_each_other():
    """Half a base pitch: pi m cos(20 deg) / 2 = 4.523 mm."""
    case = Case()
    t = np.array([0.0, 0.1, 0.2])
    assert slip(case.pair(), t, np.array([0.0, 4.5e-3, 1e-5])) is None
    assert "t = 0.1 s the transmission error passes half a base pitch (4.523 mm)" in slip(
        case.pair(), t, np.array([0.0, -4.6e-3, 1e-5])
    )
    assert slip(case.pair(), t, np.array([0.0, np.nan, 1e-5])) is not None


def test_a_slipping_run_fails_and_keeps_what_it_computed(monkeypatch):
    """A contact far too soft, which the check before the run would have refused: the wheels pass each other."""
    case = Case(
        contact={"stiffness": "1e-3 N/mm^1.3", "damping": "1e-6 N s/mm"},
        operation={"run_up": "10 ms", "settling": "0 ms", "duration": "60 ms"},
    )
    monkeypatch.setattr("gearmbs.studies.run.simulation.check_record", lambda case: None)
    with pytest.raises(SimulationFailed, match=says("'case'", "contact.stiffness", "slipped past each")) as caught:
        run_case(case)
    partial = caught.value.partial()
    assert float(abs(partial.transmission_error).max()) > 4.5e-3
    assert partial.attrs["operation_torque_units"] == "N m"
    assert "acceleration" not in partial


def test_contact_ratio_below_one_is_remarked():
    assert remarks(Case()) == []
    assert "contact ratio 0.773 is below 1" in remarks(Case(fault={"centre_distance_error": "3 mm"}))[0]
    short = Case(gears={"addendum": "0.1 mm"})
    assert "below 1" in remarks(short)[0]


def test_loose_tolerances_of_ida_are_remarked():
    solver = {"integrator": "IDA", "tolerance": 1e-6}
    assert "off by up to 12 % at 1e-6" in remarks(Case(solver=solver))[0]
    assert remarks(Case(solver={**solver, "tolerance": 1e-7})) == []
    thick = {"radius": "30 mm", "length": "60 mm"}
    assert "kg of gear 1 and its shaft are counted twice: gears.bore_radius is 0 mm" in remarks(Case(shafts=thick))[0]
    assert remarks(Case(shafts=thick, gears={"bore_radius": "30 mm"})) == []


@pytest.mark.slow
def test_wrong_settings_are_found_without_compiling():
    """In a fresh interpreter: a typing error, an impossible pair and a band too high, and numba is not imported."""
    code = (
        "import sys\n"
        "from gearmbs.studies.case.case import CaseError, make_case\n"
        "from gearmbs.studies.case.limits import check_record\n"
        "high = {'operation': {'speed': '9549 rpm'}, 'solver': {'signal_rate': '12.8 kHz'}}\n"
        "for data in ({'operation': {'spead': 1}}, {'fault': {'backlash': '-1 mm'}}, high):\n"
        "    try:\n"
        "        check_record(make_case(data))\n"
        "    except CaseError:\n"
        "        continue\n"
        "    raise SystemExit(f'{data} was accepted')\n"
        "raise SystemExit('numba' in sys.modules)\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_random_plausible_pairs_are_not_refused_for_their_rates():
    """Pairs of 15 to 70 teeth at 100 to 6000 rpm: the rates follow the mesh frequency, also where it is high."""
    random = np.random.default_rng(60)
    refused: list[str] = []
    for _ in range(60):
        teeth, speed = random.integers(15, 71, 2).tolist(), random.uniform(100.0, 6000.0)
        data = {
            "gears": {"teeth": teeth, "module": "3 mm", "profile_shift": [0.3, 0.0]},
            "operation": {
                "speed": f"{speed} rpm",
                "torque": "50 N m",
                "duration": max(0.5, 600.0 / (teeth[0] * speed)),
            },
        }
        try:
            case = make_case(data)
        except CaseError as error:
            refused.append(str(error))
            continue
        check_record(case)
        assert 5.0 * case.mesh_frequency <= case.signal_rate / 2.56 + 1e-9
        assert case.signal_rate >= 12800.0
        assert case.output_rate % case.signal_rate == 0.0
    # wheels that cannot be, whatever their speed
    assert len(refused) <= 3
    assert all("rate" not in text for text in refused)


@pytest.mark.parametrize("duration", ["auto", 1.0])
def test_speeds_too_low_for_a_record_name_duration_and_speed(duration):
    case = Case(operation={"speed": "1 rpm", "duration": duration})
    with pytest.raises(CaseError, match=says("operation.duration", "8.276 s", "8.3 rpm or more")) as told:
        check_record(case)
    # the longest record at auto would be too short as well
    assert "or 'auto'" not in str(told.value)
    for twin in ({"speed": "8.3 rpm"}, {"duration": 8.276}):
        check_record(case.changed(operation=twin))
