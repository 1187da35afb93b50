"""Between the study's files and the comparison with measurements: see `gearmbs.signals.simulated`."""

from gearmbs.signals.simulated import model_signals, parse_models, parse_states, read_any, record_signal

__all__ = ["model_signals", "parse_models", "parse_states", "read_any", "record_signal"]
