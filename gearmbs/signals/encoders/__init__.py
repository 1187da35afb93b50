"""Pulses of encoders and tachos: angle, torsional vibration, marks, transmission error of two shafts."""
