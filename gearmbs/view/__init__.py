"""Figures, 3-D views, animations and geometry files.

Everything public is importable from here; a module, and matplotlib with it, is loaded when first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearmbs.view.bars import comparison_bars, gmf_bars
    from gearmbs.view.canvas import COLOURS, save_figure
    from gearmbs.view.maps import sensitivity_map
    from gearmbs.view.signals import order_plot, spectrum_plot, time_plot

_HOMES = {
    "COLOURS": "canvas",
    "comparison_bars": "bars",
    "gmf_bars": "bars",
    "order_plot": "signals",
    "save_figure": "canvas",
    "sensitivity_map": "maps",
    "spectrum_plot": "signals",
    "time_plot": "signals",
}

__all__ = [
    "COLOURS",
    "comparison_bars",
    "gmf_bars",
    "order_plot",
    "save_figure",
    "sensitivity_map",
    "spectrum_plot",
    "time_plot",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
