"""gearmbs: an open, ADAMS-style multibody DAE solver for gear dynamics."""

from gearmbs._kernel_cache import drop_stale

__version__ = "0.1.0"

drop_stale()
del drop_stale
