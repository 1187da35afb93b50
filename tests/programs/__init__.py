"""Programs as users write them: `make types` checks them strictly, `tests/test_programs.py` runs them."""
