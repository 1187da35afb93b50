"""Figures, 3-D views, animations and geometry files.

Everything public is importable from here; a module, and matplotlib with it, is loaded when first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearmbs.view.bars import comparison_bars, gmf_bars
    from gearmbs.view.canvas import COLOURS, save_figure

_HOMES = {
    "COLOURS": "canvas",
    "comparison_bars": "bars",
    "gmf_bars": "bars",
    "save_figure": "canvas",
}

__all__ = ["COLOURS", "comparison_bars", "gmf_bars", "save_figure"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
