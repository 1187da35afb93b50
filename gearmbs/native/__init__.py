"""Models as shared libraries with a C header and as FMUs, which run without Python and without a compiler."""

from gearmbs._lazy import late

__all__ = late(__name__)
