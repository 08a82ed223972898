"""Kernels that call tracers."""
