"""Kernels that draw a view and reduce it."""
