"""Signals of a campaign as variables of xarray, which are read when they are asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from gearmbs.campaigns.signals import Signals
from gearmbs.campaigns.subjects.base import SignalSpec


class _Lazy(BackendArray):
    """Signals as xarray asks for them."""

    def __init__(self, signals: Signals) -> None:
        self.signals, self.shape, self.dtype = signals, signals.shape, signals.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self.signals.read)


def signal_variable(spec: SignalSpec, signals: Signals) -> xr.Variable:
    """Return signals as a variable (case, channel, time) that is read when it is asked for."""
    attributes: dict[str, Any] = {"units": spec.units, "sampling_rate": spec.rate, "channels": list(spec.channels)}
    dimensions = ("case", f"{spec.name}_channel", f"{spec.name}_time")
    return xr.Variable(dimensions, indexing.LazilyIndexedArray(_Lazy(signals)), attributes)
