"""From a trajectory or a measurement to orders, GMF bands, averages and indicators.

A signal is an `xarray.DataArray` with dimensions (time, channel); see `gearmbs.signals.signal.signal`.
"""

from gearmbs._lazy import late

__all__ = late(__name__)
