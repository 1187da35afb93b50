"""Results of a run: requests, parts and forces over time, and the files .req, .res and .msg."""
