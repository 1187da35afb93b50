"""The signal: an array of time and channel with units and what is known of its source."""
