"""Depth buffers drawn by OpenGL, as an engine draws them: a matrix, a format, glReadPixels."""

import ctypes
import ctypes.util

import numpy as np

from hybrid_rt_bench.kinds.peers.programs import opengl as gl

VERTEX = """
#version 450
in vec3 position;
uniform mat4 matrix;
void main() { gl_Position = matrix * vec4(position, 1.0); }
"""
FRAGMENT = """
#version 450
void main() { }
"""

# From the OpenGL registry: the format in memory, and what glReadPixels writes.
FORMATS = {
    "float32": (gl.DEPTH_COMPONENT32F, gl.FLOAT, np.float32),
    24: (0x81A6, 0x1405, np.uint32),
    16: (0x81A5, 0x1403, np.uint16),
}
NEGATIVE_ONE_TO_ONE = 0x935E


def view_matrix(camera):
    """Return the world seen from the camera, (4, 4): x right, y up, looking along -z."""
    axes = np.array([camera.right, camera.up, -np.array(camera.forward)])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = axes, -axes @ np.array(camera.eye)
    return view


def projection_matrix(camera, kind, far):
    """Return an engine's projection: z from -1 (near) to 1, or reversed from 1 to 0."""
    n = camera.near
    x, y = (2 * camera.focal_px / size for size in (camera.width, camera.height))
    if kind == "standard":
        a, b = (-1.0, -2.0 * n) if far is None else ((far + n) / (n - far), 2 * far * n / (n - far))
    else:
        a, b = (0.0, n) if far is None else (n / (far - n), far * n / (far - n))
    return np.array([[x, 0, 0, 0], [0, y, 0, 0], [0, 0, a, b], [0, 0, -1, 0]])


def opened():
    """Return a moderngl context over EGL and the functions that it lacks."""
    import moderngl

    libraries = {
        f"lib{name.lower()}": file
        for name in ("EGL", "GL")
        if (file := ctypes.util.find_library(name)) is not None
    }
    made = moderngl.create_context(standalone=True, backend="egl", require=450, **libraries)
    return made, gl.functions(libraries.get("libegl", "libEGL.so.1"))


def depth_buffer(scene, camera, kind, form, far):
    """Return the depth buffer of a view as glReadPixels gives it: row 0 is the bottom.

    In a context of its own, which takes everything with it that is made here.
    """
    import moderngl

    context, functions = opened()
    memory, read, dtype = FORMATS[form]
    width, height = camera.width, camera.height
    frame = context.framebuffer([context.texture((width, height), 4)])
    frame.use()
    depth = ctypes.c_uint()
    functions["glGenTextures"](1, ctypes.byref(depth))
    functions["glBindTexture"](gl.TEXTURE_2D, depth)
    functions["glTexStorage2D"](gl.TEXTURE_2D, 1, memory, width, height)
    functions["glFramebufferTexture2D"](
        gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depth, 0
    )
    reversed_ = kind == "reversed"
    functions["glClipControl"](gl.LOWER_LEFT, gl.ZERO_TO_ONE if reversed_ else NEGATIVE_ONE_TO_ONE)
    frame.depth_mask = True
    context.enable_only(moderngl.DEPTH_TEST)
    context.depth_func = ">" if reversed_ else "<"
    clear = (ctypes.c_float * 1)(0.0 if reversed_ else 1.0)
    functions["glClearBufferfv"](gl.DEPTH, 0, clear)
    program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
    whole = projection_matrix(camera, kind, far) @ view_matrix(camera)
    program["matrix"].write(np.ascontiguousarray(whole.T, np.float32).tobytes())
    vertices = context.buffer(np.ascontiguousarray(scene.vertices).tobytes())
    faces = context.buffer(np.ascontiguousarray(scene.faces).tobytes())
    mesh = context.vertex_array(program, [(vertices, "3f", "position")], faces)
    mesh.render(moderngl.TRIANGLES)
    context.finish()
    image = np.empty((height, width), dtype)
    functions["glReadPixels"](0, 0, width, height, gl.DEPTH_COMPONENT, read, image.ctypes.data)
    assert context.error == "GL_NO_ERROR"
    context.release()
    # Of 24 bits, glReadPixels makes 32 by repeating the upper ones in the lower.
    return image >> 8 if form == 24 else image
