"""Mesa's llvmpipe through moderngl and EGL: OpenGL's raster on the processor."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

import hybrid_rt as hrt
from hybrid_rt_bench.kinds.peers.programs.base import (
    Drawing,
    Opened,
    PeerError,
    Picture,
)

VERTEX = """
#version 450
in vec3 position;
uniform vec3 eye, eye_rest, to_x, to_y, to_w;
uniform vec3 to_depth;
uniform vec4 at_eye;
void main() {
    vec3 q = (position - eye) - eye_rest;
    gl_Position = vec4(dot(to_x, q), dot(to_y, q), dot(to_depth, q), dot(to_w, q)) + at_eye;
}
"""
FRAGMENT = """
#version 450
layout(location = 0) out int prim;
void main() { prim = gl_PrimitiveID; }
"""

# From the OpenGL registry.
COLOR, DEPTH = 0x1800, 0x1801
TEXTURE_2D, FRAMEBUFFER, DEPTH_ATTACHMENT = 0x0DE1, 0x8D40, 0x8D00
DEPTH_COMPONENT, DEPTH_COMPONENT32F, RED_INTEGER = 0x1902, 0x8CAC, 0x8D94
INT, FLOAT, LOWER_LEFT, ZERO_TO_ONE = 0x1404, 0x1406, 0x8CA1, 0x935F

_U, _I, _P = ctypes.c_uint, ctypes.c_int, ctypes.c_void_p
_FUNCTIONS: dict[str, tuple[Any, ...]] = {
    "glGenTextures": (_I, _P),
    "glDeleteTextures": (_I, _P),
    "glBindTexture": (_U, _U),
    "glTexStorage2D": (_U, _I, _U, _I, _I),
    "glFramebufferTexture2D": (_U, _U, _U, _U, _I),
    "glClipControl": (_U, _U),
    "glClearBufferiv": (_U, _I, _P),
    "glClearBufferfv": (_U, _I, _P),
    "glReadPixels": (_I, _I, _I, _I, _U, _U, _P),
}
"""What moderngl does not offer: a depth buffer in float32, depths from 0 to 1, integer clears."""


class Llvmpipe(Opened):
    """Depth and gl_PrimitiveID of a camera, by llvmpipe.

    Depth is ours, see `hybrid_rt.project`, in a float32 depth buffer: nearest is largest, 0 is far
    away. The picture is drawn upside down, so that its first row in memory is the top one.

    ``LP_NUM_THREADS`` is set to `threads`. llvmpipe starts so many threads for its tiles of 64x64
    pixels; vertices, clipping and binning are the calling thread's, whatever the number.
    """

    def __init__(self, scene: hrt.Scene, threads: int) -> None:
        import moderngl

        os.environ["LP_NUM_THREADS"] = str(threads)
        os.environ["LIBGL_ALWAYS_SOFTWARE"] = "true"
        os.environ["GALLIUM_DRIVER"] = "llvmpipe"
        libraries: dict[str, Any] = {
            f"lib{name.lower()}": file
            for name in ("EGL", "GL")
            if (file := ctypes.util.find_library(name)) is not None
        }
        settings: dict[str, Any] = {"backend": "egl", **libraries}
        self._context = moderngl.create_context(standalone=True, require=450, **settings)
        renderer = self._context.info["GL_RENDERER"]
        if "llvmpipe" not in renderer:
            raise PeerError(f"expected Mesa's llvmpipe behind EGL, got {renderer}")
        self._gl = functions(libraries.get("libegl", "libEGL.so.1"))
        self.detail = f"{renderer}, {self._context.info['GL_VERSION']}"
        start = time.perf_counter()
        self._program = self._context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        vertices = self._context.buffer(np.ascontiguousarray(scene.vertices))
        faces = self._context.buffer(np.ascontiguousarray(scene.faces))
        self._mesh = self._context.vertex_array(
            self._program, [(vertices, "3f", "position")], faces
        )
        self._context.finish()
        self.build_seconds = time.perf_counter() - start
        self._triangles, self._depth_test = moderngl.TRIANGLES, moderngl.DEPTH_TEST
        self._frame: tuple[Any, Any, Any] | None = None
        self.threads = threads

    def draw(self, camera: hrt.Camera) -> Drawing:
        """Return the drawing of a camera: clear, one draw call, glFinish; then glReadPixels."""
        gl, context = self._gl, self._context
        width, height = camera.width, camera.height
        color = context.texture((width, height), 1, dtype="i4")
        frame = context.framebuffer([color])
        frame.use()
        self._release_frame()  # not sooner: moderngl binds again what was bound before
        depth = _U()
        self._frame = (frame, color, depth)
        gl["glGenTextures"](1, ctypes.byref(depth))
        gl["glBindTexture"](TEXTURE_2D, depth)
        gl["glTexStorage2D"](TEXTURE_2D, 1, DEPTH_COMPONENT32F, width, height)
        gl["glFramebufferTexture2D"](FRAMEBUFFER, DEPTH_ATTACHMENT, TEXTURE_2D, depth, 0)
        gl["glClipControl"](LOWER_LEFT, ZERO_TO_ONE)
        frame.depth_mask = True  # moderngl does not know of the depth buffer
        context.enable_only(self._depth_test)
        context.depth_func = ">"
        for name, value in _uniforms(camera).items():
            self._program[name] = value
        nothing, far = (_I * 4)(-1, -1, -1, -1), (ctypes.c_float * 1)(0.0)
        picture = Picture(
            np.empty((height, width), np.float32), np.empty((height, width), np.int32)
        )
        error = context.error  # asking for it clears it
        if error != "GL_NO_ERROR":
            raise PeerError(f"OpenGL refuses the frame buffer: {error}")

        def draw() -> None:
            frame.use()
            gl["glClearBufferiv"](COLOR, 0, nothing)
            gl["glClearBufferfv"](DEPTH, 0, far)
            self._mesh.render(self._triangles)
            context.finish()

        def read() -> Picture:
            for what, kind, array in (
                (RED_INTEGER, INT, picture.prim_id),
                (DEPTH_COMPONENT, FLOAT, picture.depth),
            ):
                gl["glReadPixels"](0, 0, width, height, what, kind, array.ctypes.data)
            return picture

        draw()
        started = _started_threads()
        if started is not None:
            self.detail = f"{self.detail.split('; ')[0]}; {started} threads for tiles"
        return Drawing(draw, read)

    def close(self) -> None:
        """Release the context and all that is in it."""
        self._release_frame()
        self._context.release()

    def _release_frame(self) -> None:
        if self._frame is not None:
            frame, color, depth = self._frame
            frame.release()
            color.release()
            self._gl["glDeleteTextures"](1, ctypes.byref(depth))
            self._frame = None


def functions(library: str) -> dict[str, Any]:
    """Return functions of OpenGL by name, as EGL finds them."""
    find = ctypes.CDLL(library).eglGetProcAddress
    find.restype, find.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    found = {}
    for name, arguments in _FUNCTIONS.items():
        address = find(name.encode())
        if not address:
            raise PeerError(f"this OpenGL has no {name}")
        found[name] = ctypes.CFUNCTYPE(None, *arguments)(address)
    return found


def _uniforms(camera: hrt.Camera) -> dict[str, Any]:
    """Return the camera for the shader.

    The eye comes as a float32 and the rest of it, so that what is near to it loses nothing.
    """
    eye = np.array(camera.eye)
    high = eye.astype(np.float32).astype(np.float64)
    m = camera.arrays.m
    # Clip space from -w to w, y down: twice a place over the size, less 1.
    x, y = 2.0 * m[0] / camera.width - m[2], 2.0 * m[1] / camera.height - m[2]
    return {
        "eye": tuple(high),
        "eye_rest": tuple(eye - high),
        "to_x": tuple(x[:3]),
        "to_y": tuple(y[:3]),
        "to_depth": tuple(m[3, :3]),
        "to_w": tuple(m[2, :3]),
        "at_eye": (x[3], y[3], m[3, 3], m[2, 3]),
    }


def _started_threads() -> int | None:
    """Return how many threads of llvmpipe this process has, None where that cannot be known."""
    tasks = Path("/proc/self/task")
    if not tasks.is_dir():
        return None
    names = []
    for task in tasks.iterdir():
        try:
            names.append((task / "comm").read_text())
        except OSError:  # a thread that has just ended
            continue
    return sum(name.startswith("llvmpipe-") for name in names)
