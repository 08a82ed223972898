"""Screen-space ray marching in front of an exact tracer: raster, march, trace, judge."""

from hybrid_rt.camera import project, unproject
from hybrid_rt.errors import (
    ArgumentError,
    EmbreeError,
    HybridRTError,
    MeshFileError,
    UnknownNameError,
)
from hybrid_rt.hybrid import occluded_hybrid, trace_hybrid
from hybrid_rt.io import read_mesh
from hybrid_rt.lights import AreaLight, DirectionalLight, Light, PointLight
from hybrid_rt.march import march
from hybrid_rt.metrics import (
    Judged,
    Verdict,
    alpha,
    by_status,
    judge,
    judge_occlusion,
    rates,
)
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
from hybrid_rt.rate import Rate
from hybrid_rt.rays import (
    ambient_occlusion_rays,
    diffuse_rays,
    glossy_rays,
    mirror_rays,
    shadow_rays,
)
from hybrid_rt.scene import load_scene
from hybrid_rt.slope_pyramid import build_slope_pyramid
from hybrid_rt.trace import BruteForceTracer, EmbreeTracer, embree_info, packet_available
from hybrid_rt.truth import Nearest, Truth
from hybrid_rt.types import (
    Camera,
    DepthPyramid,
    GBuffer,
    Hits,
    HybridResult,
    Marched,
    MarchStatus,
    MarchWork,
    Mesh,
    OcclusionResult,
    PrimitiveLists,
    Rays,
    Scene,
    SlopePyramid,
)

__version__ = "0.1.0"

__all__ = [
    "DEFAULT_THICKNESS",
    "AreaLight",
    "ArgumentError",
    "BruteForceTracer",
    "Camera",
    "Certified",
    "DepthPyramid",
    "DirectionalLight",
    "EmbreeError",
    "EmbreeTracer",
    "GBuffer",
    "HiZ",
    "Hits",
    "HybridRTError",
    "HybridResult",
    "Judged",
    "Light",
    "Linear",
    "MarchStatus",
    "MarchWork",
    "Marched",
    "Mesh",
    "MeshFileError",
    "Mode",
    "Nearest",
    "OcclusionResult",
    "Paper",
    "PixelDDA",
    "PointLight",
    "PrimitiveLists",
    "Rate",
    "Rays",
    "Scene",
    "SlopeAware",
    "SlopePyramid",
    "Truth",
    "UnknownNameError",
    "Verdict",
    "alpha",
    "ambient_occlusion_rays",
    "build_depth_pyramid",
    "build_slope_pyramid",
    "by_status",
    "diffuse_rays",
    "embree_info",
    "glossy_rays",
    "judge",
    "judge_occlusion",
    "load_scene",
    "march",
    "mirror_rays",
    "occluded_hybrid",
    "packet_available",
    "project",
    "rasterize",
    "rates",
    "read_mesh",
    "shadow_rays",
    "trace_hybrid",
    "unproject",
]
