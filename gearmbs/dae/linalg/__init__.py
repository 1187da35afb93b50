"""Sparse LU factorisation with pivots chosen once and replayed in compiled code."""
