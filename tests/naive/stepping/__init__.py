"""The marches that step, one ray at a time: what the lanes of the library must answer, bit by bit.

Scalar code with branches and early returns, compiled only because millions of rays go through it.
The float64 oracles `naive.march`, `naive.strict`, `naive.slabs` and `naive.walk` say what is right.
"""
