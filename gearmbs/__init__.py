"""gearmbs: an open, ADAMS-style multibody DAE solver for gear dynamics."""

__version__ = "0.1.0"
