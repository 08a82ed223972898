"""What a scene definition may say, and how it becomes triangles and cameras."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, model_validator

import hybrid_rt as hrt
from hybrid_rt_scenes.generators import GENERATORS
from hybrid_rt_scenes.places import DATA_VARIABLE, data_directories, find_file

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class MissingDataError(hrt.HybridRTError):
    """A scene needs a mesh file that is in none of the folders where such files are kept."""


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class CameraSpec(_Strict):
    """A view without a number of pixels.

    Attributes
    ----------
    eye, target, up : three float, world
    vfov_deg : float
        Vertical field of view in degrees.
    near : float
        Distance of the near plane, world units.
    """

    eye: Vector
    target: Vector
    up: Vector = (0.0, 1.0, 0.0)
    vfov_deg: Annotated[float, Field(gt=0, lt=180)] = 60.0
    near: Positive = 0.05

    @model_validator(mode="after")
    def _looks_somewhere(self) -> CameraSpec:
        self.sized(16, 9)  # refuses an eye at the target and an up along the view
        return self

    def sized(self, width: int, height: int) -> hrt.Camera:
        """Return the view as a camera of `width` by `height` pixels."""
        return hrt.Camera.look_at(
            self.eye,
            self.target,
            self.up,
            vfov_deg=self.vfov_deg,
            width=width,
            height=height,
            near=self.near,
        )


class LightsSpec(_Strict):
    """One light of each kind, for shadow rays.

    Attributes
    ----------
    sun : three float, world
        The way in which sunlight travels.
    point : three float, world
        Where a small lamp is.
    area : three times three float, world
        A corner of a large lamp and the two edges that leave it.
    """

    sun: Vector
    point: Vector
    area: tuple[Vector, Vector, Vector]

    @model_validator(mode="after")
    def _shine(self) -> LightsSpec:
        _ = self.directional_light, self.point_light, self.area_light  # refuse what cannot shine
        return self

    @property
    def directional_light(self) -> hrt.DirectionalLight:
        """The sun."""
        return hrt.DirectionalLight(self.sun)

    @property
    def point_light(self) -> hrt.PointLight:
        """The small lamp."""
        return hrt.PointLight(self.point)

    @property
    def area_light(self) -> hrt.AreaLight:
        """The large lamp."""
        return hrt.AreaLight(*self.area)


class MeshSpec(_Strict):
    """Where triangles come from: a file of a data directory, or a generator.

    Attributes
    ----------
    file : str, optional
    generator : str, optional
        A name in `hybrid_rt_scenes.generators.GENERATORS`.
    parameters : dict
        Keyword arguments of the generator.
    """

    file: str | None = None
    generator: str | None = None
    parameters: dict[str, int | float] = {}

    @model_validator(mode="after")
    def _one_source(self) -> MeshSpec:
        if (self.file is None) == (self.generator is None):
            raise ValueError("name either a file or a generator")
        if self.generator is not None:
            if self.generator not in GENERATORS:
                raise hrt.UnknownNameError("generator", self.generator, GENERATORS)
            for key in self.parameters:
                if key not in self._accepted():
                    kind = f"parameter of generator {self.generator!r}"
                    raise hrt.UnknownNameError(kind, key, self._accepted())
        elif self.parameters:
            raise ValueError("a file takes no parameters")
        return self

    def _accepted(self) -> list[str]:
        if self.generator is None:
            return []
        return list(inspect.signature(GENERATORS[self.generator]).parameters)

    @property
    def resizable(self) -> bool:
        """Whether the number of triangles can be chosen."""
        return "size" in self._accepted()

    def read(self, folders: tuple[Path, ...], size: int | None) -> hrt.Mesh:
        """Return the triangles; `size` overrides the generator's own if it has one."""
        if self.generator is None:
            name = str(self.file)
            return hrt.read_mesh(find_file(name, folders) or folders[0] / name)
        parameters: dict[str, Any] = dict(self.parameters)
        if size is not None and self.resizable:
            parameters["size"] = size
        return GENERATORS[self.generator](**parameters)


class SceneSpec(_Strict):
    """A scene by name: where its triangles come from, and the views worth measuring.

    Attributes
    ----------
    name, title, description : str
    needs : str
        What has to be supplied and where it comes from; empty for a scene generated from code.
    mark, note : str
        Where the triangles are not the model that the title names, or not all of it: a word or
        three that every report writes after the scene's name, and the sentence that says what
        they mean, without its full stop. Both empty for a scene that is whole.
    mesh : tuple of MeshSpec
        The meshes that make the scene, in the order of their `prim_id`.
    lights : LightsSpec, optional
        None stands for lights placed by the bounds, see `lights_of`.
    cameras : dict of CameraSpec
    """

    name: str
    title: str
    description: str
    needs: str = ""
    mark: Annotated[str, Field(max_length=24)] = ""
    note: str = ""
    mesh: Annotated[tuple[MeshSpec, ...], Field(min_length=1)]
    lights: LightsSpec | None = None
    cameras: Annotated[dict[str, CameraSpec], Field(min_length=1)]
    _loaded: hrt.Scene | None = PrivateAttr(default=None)

    @model_validator(mode="after")
    def _needs_fit(self) -> SceneSpec:
        if bool(self.needs) == self.builtin:
            raise ValueError("'needs' must say where mesh files come from, if there are any")
        return self

    @model_validator(mode="after")
    def _mark_fits(self) -> SceneSpec:
        if bool(self.mark) != bool(self.note):
            raise ValueError("'mark' and 'note' go together")
        return self

    @property
    def builtin(self) -> bool:
        """Whether the scene is generated from code and needs no file."""
        return all(mesh.file is None for mesh in self.mesh)

    @property
    def resizable(self) -> bool:
        """Whether `load` takes a `size`."""
        return any(mesh.resizable for mesh in self.mesh)

    def camera(self, name: str, width: int, height: int) -> hrt.Camera:
        """Return the view `name` as a camera of `width` by `height` pixels.

        Raises
        ------
        UnknownNameError
            No such camera; the message suggests the nearest name.
        """
        if name not in self.cameras:
            raise hrt.UnknownNameError(f"camera of scene {self.name!r}", name, self.cameras)
        return self.cameras[name].sized(width, height)

    def lights_of(self, scene: hrt.Scene) -> LightsSpec:
        """Return the lights of the loaded `scene`: those defined, else `automatic_lights`."""
        return automatic_lights(scene) if self.lights is None else self.lights

    def missing(self, data_dir: Path | None = None) -> str | None:
        """Return a sentence about the first file that is not there, or None when all are.

        Parameters
        ----------
        data_dir : Path, optional
            Where to look; default all of `data_directories`.
        """
        folders = _folders(data_dir)
        for mesh in self.mesh:
            if mesh.file is not None and find_file(mesh.file, folders) is None:
                looked = " nor in ".join(str(folder) for folder in folders)
                absent = "neither in" if len(folders) > 1 else "not in"
                return (
                    f"scene {self.name!r} needs {mesh.file}, which is {absent} {looked}. "
                    f"{self.needs} Bring it in with `hybrid-rt import FILE --name {self.name}` "
                    f"(docs/scenes.md says where to get it), or set {DATA_VARIABLE} to the folder "
                    f"that has {mesh.file}."
                )
        return None

    def load(self, size: int | None = None, data_dir: Path | None = None) -> hrt.Scene:
        """Return the triangles of the scene.

        Parameters
        ----------
        size : int, optional
            Number of triangles wanted, for a scene with a generator that can choose; default its
            own.
        data_dir : Path, optional
            Where mesh files are; default all of `data_directories`.

        Raises
        ------
        MissingDataError
            A mesh file is not there; the message is that of `missing`.
        MeshFileError
            A mesh file cannot be read.
        ArgumentError
            `size` for a scene that has only one, or out of its range.
        """
        if size is not None and not self.resizable:
            raise hrt.ArgumentError("size", f"None, since scene {self.name!r} has one", repr(size))
        if self._loaded is not None:
            return self._loaded
        said = self.missing(data_dir)
        if said is not None:
            raise MissingDataError(said)
        meshes = [mesh.read(_folders(data_dir), size) for mesh in self.mesh]
        return hrt.Scene.from_meshes(meshes, name=self.name)


def _folders(data_dir: Path | None) -> tuple[Path, ...]:
    return data_directories() if data_dir is None else (data_dir,)


def automatic_lights(scene: hrt.Scene) -> LightsSpec:
    """Return lights for a scene from its bounds alone, +Y up.

    The lamps hang between the centre and an upper corner, off by (0.2, 0.4, 0.3) of the extent:
    inside of a room, and outside of a ball. The large one is a square of a twentieth of the
    diagonal. The sun stands high.
    """
    low, high = scene.bounds
    lamp = (low + high) / 2 + np.array([0.2, 0.4, 0.3]) * (high - low)
    side = 0.05 * float(np.linalg.norm(high - low))
    corner = lamp - [side / 2, 0, side / 2]
    return LightsSpec(
        sun=(-0.35, -0.87, -0.34),
        point=tuple(lamp),
        area=(tuple(corner), (side, 0.0, 0.0), (0.0, 0.0, side)),
    )
