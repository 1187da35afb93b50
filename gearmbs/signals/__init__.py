"""From a trajectory or a measurement to orders, GMF bands, averages and indicators.

A signal is an `xarray.DataArray` with dimensions (time, channel); see `gearmbs.signals.signal`.
"""

from .analysis import analyse, analyse_file
from .analysis_report import AnalysisReport
from .angular import angular_resample, order_spectrum, time_synchronous_average
from .bands import band_rms, gmf_rms, order_rms, rms
from .cepstrum import power_cepstrum
from .comparison import compare, compare_files
from .comparison_report import ComparisonReport
from .conversion import convert
from .envelope import envelope, envelope_spectrum, kurtogram, spectral_kurtosis
from .errors import MissingMetadataError, SignalError, SignalFileError
from .expectations import EXPECTED
from .filters import bandpass, decimate, resample
from .indicators import (
    INDICATORS,
    condition_indicators,
    crest_factor,
    energy_ratio,
    fm0,
    fm4,
    kurtosis,
    m6a,
    m8a,
    mesh_envelope,
    na4,
    nb4,
    peak_to_peak,
    sideband_index,
    sideband_level,
)
from .io import FORMATS, read_signal, write_signal
from .orders import harmonic_amplitudes
from .ordinal import level_distance, ordinal_agreement
from .phase import instantaneous_speed, phase_from_line, phase_from_speed, phase_from_tacho
from .scaling import dynamic_rms, remove_mean, rms_factor, scale, scale_states
from .sections import sections, trend, trend_table
from .sensors import (
    FrfPath,
    ModalPath,
    Mode,
    accelerometer,
    add_noise,
    joint_force,
    laser_vibrometer,
    measure,
    quantise,
    sample,
)
from .shaft_force import COMPONENTS, force_components, force_to_acceleration
from .signal import (
    as_signal,
    common_unit,
    make_signal,
    mesh_frequency,
    rate_of,
    require,
    trim,
    units_of,
    with_metadata,
)
from .spectra import spectrum
from .speed import SpeedEstimate, estimate_speed
from .tsa import difference_signal, regular_signal, remove_orders, residual_signal
from .uneven import even_signal

__all__ = [
    "COMPONENTS",
    "EXPECTED",
    "FORMATS",
    "INDICATORS",
    "AnalysisReport",
    "ComparisonReport",
    "FrfPath",
    "MissingMetadataError",
    "ModalPath",
    "Mode",
    "SignalError",
    "SignalFileError",
    "SpeedEstimate",
    "accelerometer",
    "add_noise",
    "analyse",
    "analyse_file",
    "angular_resample",
    "as_signal",
    "band_rms",
    "bandpass",
    "common_unit",
    "compare",
    "compare_files",
    "condition_indicators",
    "convert",
    "crest_factor",
    "decimate",
    "difference_signal",
    "dynamic_rms",
    "energy_ratio",
    "envelope",
    "envelope_spectrum",
    "estimate_speed",
    "even_signal",
    "fm0",
    "fm4",
    "force_components",
    "force_to_acceleration",
    "gmf_rms",
    "harmonic_amplitudes",
    "instantaneous_speed",
    "joint_force",
    "kurtogram",
    "kurtosis",
    "laser_vibrometer",
    "level_distance",
    "m6a",
    "m8a",
    "make_signal",
    "measure",
    "mesh_envelope",
    "mesh_frequency",
    "na4",
    "nb4",
    "order_rms",
    "order_spectrum",
    "ordinal_agreement",
    "peak_to_peak",
    "phase_from_line",
    "phase_from_speed",
    "phase_from_tacho",
    "power_cepstrum",
    "quantise",
    "rate_of",
    "read_signal",
    "regular_signal",
    "remove_mean",
    "remove_orders",
    "require",
    "resample",
    "residual_signal",
    "rms",
    "rms_factor",
    "sample",
    "scale",
    "scale_states",
    "sections",
    "sideband_index",
    "sideband_level",
    "spectral_kurtosis",
    "spectrum",
    "time_synchronous_average",
    "trend",
    "trend_table",
    "trim",
    "units_of",
    "with_metadata",
    "write_signal",
]
