"""Standard problems with reference solutions, as generic DAEs with exact sparse Jacobians."""
