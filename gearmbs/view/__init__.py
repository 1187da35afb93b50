"""Figures, 3-D views, animations and geometry files.

Everything public is importable from here; a module, and matplotlib with it, is loaded when first asked for.
"""

from gearmbs._lazy import late

__all__ = late(__name__)
