"""Kernels of the judge."""
