"""Screen-space ray marching in front of an exact tracer: raster, march, trace, judge."""

from hybrid_rt.camera import project, unproject
from hybrid_rt.errors import (
    ArgumentError,
    EmbreeError,
    HybridRTError,
    MeshFileError,
    UnknownNameError,
)
from hybrid_rt.hybrid import trace_hybrid
from hybrid_rt.io import read_mesh
from hybrid_rt.march import march
from hybrid_rt.metrics import Judged, Rate, Verdict, alpha, by_status, judge, rates
from hybrid_rt.modes import (
    DEFAULT_THICKNESS,
    Certified,
    HiZ,
    Linear,
    Mode,
    Paper,
    PixelDDA,
    SlopeAware,
)
from hybrid_rt.pyramid import build_depth_pyramid
from hybrid_rt.raster import rasterize
from hybrid_rt.rays import mirror_rays
from hybrid_rt.scene import load_scene
from hybrid_rt.slope_pyramid import build_slope_pyramid
from hybrid_rt.trace import BruteForceTracer, EmbreeTracer, embree_info, packet_available
from hybrid_rt.types import (
    Camera,
    DepthPyramid,
    GBuffer,
    Hits,
    HybridResult,
    Marched,
    MarchStatus,
    Mesh,
    PrimitiveLists,
    Rays,
    Scene,
    SlopePyramid,
)

__version__ = "0.1.0"

__all__ = [
    "DEFAULT_THICKNESS",
    "ArgumentError",
    "BruteForceTracer",
    "Camera",
    "Certified",
    "DepthPyramid",
    "EmbreeError",
    "EmbreeTracer",
    "GBuffer",
    "HiZ",
    "Hits",
    "HybridRTError",
    "HybridResult",
    "Judged",
    "Linear",
    "MarchStatus",
    "Marched",
    "Mesh",
    "MeshFileError",
    "Mode",
    "Paper",
    "PixelDDA",
    "PrimitiveLists",
    "Rate",
    "Rays",
    "Scene",
    "SlopeAware",
    "SlopePyramid",
    "UnknownNameError",
    "Verdict",
    "alpha",
    "build_depth_pyramid",
    "build_slope_pyramid",
    "by_status",
    "embree_info",
    "judge",
    "load_scene",
    "march",
    "mirror_rays",
    "packet_available",
    "project",
    "rasterize",
    "rates",
    "read_mesh",
    "trace_hybrid",
    "unproject",
]
