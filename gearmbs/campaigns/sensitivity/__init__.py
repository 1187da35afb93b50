"""Which factors move a result: Sobol' indices, their bounds, and surrogates."""
