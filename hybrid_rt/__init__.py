"""Screen-space ray marching in front of an exact tracer: raster, march, trace, judge.

Names are loaded when they are first used, so that ``import hybrid_rt`` costs nothing: NumPy, Numba
and Embree come with the first name that needs them.
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
