"""Screen-space ray marching in front of an exact tracer: raster, march, trace, judge."""

from hybrid_rt.camera.pinhole import Camera, project, unproject
from hybrid_rt.errors import (
    ArgumentError,
    EmbreeError,
    HybridRTError,
    MeshFileError,
    UnknownNameError,
)
from hybrid_rt.hybrid import HybridResult, OcclusionResult, occluded_hybrid, trace_hybrid
from hybrid_rt.judge.metrics import Judged, Verdict, alpha, by_status, judge, judge_occlusion, rates
from hybrid_rt.judge.rate import Rate
from hybrid_rt.judge.truth import Nearest, Truth
from hybrid_rt.raster.gbuffer import GBuffer
from hybrid_rt.raster.lists import PrimitiveLists
from hybrid_rt.raster.pyramid import DepthPyramid, build_depth_pyramid
from hybrid_rt.raster.rasterize import rasterize
from hybrid_rt.raster.slope_pyramid import SlopePyramid, build_slope_pyramid
from hybrid_rt.rays.hits import Hits
from hybrid_rt.rays.rays import Rays
from hybrid_rt.scene.io import load_scene, read_mesh
from hybrid_rt.scene.lights import AreaLight, DirectionalLight, Light, PointLight
from hybrid_rt.scene.mesh import Mesh, Scene
from hybrid_rt.secondary import (
    ambient_occlusion_rays,
    diffuse_rays,
    glossy_rays,
    mirror_rays,
    shadow_rays,
)
from hybrid_rt.techniques.march import march
from hybrid_rt.techniques.marched import Marched, MarchStatus, MarchWork
from hybrid_rt.techniques.modes import (
    DEFAULT_THICKNESS,
    Certified,
    HiZ,
    Linear,
    Mode,
    Paper,
    PixelDDA,
    SlopeAware,
)
from hybrid_rt.trace.embree import BruteForceTracer, EmbreeTracer, embree_info, packet_available

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
