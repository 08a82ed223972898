"""Kernels of the marches."""
