"""Measure screen-space marching in front of an exact tracer, and report what was measured."""
