"""From a trajectory or a measurement to orders, GMF bands, averages and indicators.

A signal is an `xarray.DataArray` with dimensions (time, channel); see `gearmbs.signals.signal`.
"""

from .bands import band_rms, gmf_rms, order_rms, rms
from .errors import MissingMetadataError, SignalError, SignalFileError
from .filters import bandpass, decimate, resample
from .io import FORMATS, read_signal, write_signal
from .newton import COMPONENTS, force_components, force_to_acceleration
from .orders import harmonic_amplitudes
from .scaling import dynamic_rms, remove_mean, rms_factor, scale, scale_states
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

__all__ = [
    "COMPONENTS",
    "FORMATS",
    "MissingMetadataError",
    "SignalError",
    "SignalFileError",
    "as_signal",
    "band_rms",
    "bandpass",
    "common_unit",
    "decimate",
    "dynamic_rms",
    "force_components",
    "force_to_acceleration",
    "gmf_rms",
    "harmonic_amplitudes",
    "make_signal",
    "mesh_frequency",
    "order_rms",
    "rate_of",
    "read_signal",
    "remove_mean",
    "require",
    "resample",
    "rms",
    "rms_factor",
    "scale",
    "scale_states",
    "spectrum",
    "trim",
    "units_of",
    "with_metadata",
    "write_signal",
]
