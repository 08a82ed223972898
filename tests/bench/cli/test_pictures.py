"""Pictures of one view: their colours, their legends and their scales."""

import numpy as np
import pytest

import hybrid_rt as hrt
import hybrid_rt_scenes as hrs
from hybrid_rt_bench.cli import pictures
from hybrid_rt_bench.report import sheet
from hybrid_rt_bench.report.looks import STATUSES, rgb
from support.geometry import check

SIZE = (160, 90)


@pytest.fixture(scope="module")
def view():
    spec = hrs.get_scene("sphere")
    scene, camera = spec.load(), spec.camera("front", *SIZE)
    gbuffer = hrt.rasterize(scene, camera)
    rays = hrt.mirror_rays(gbuffer)
    return gbuffer, rays


def test_statuses_have_all_a_colour_and_words():
    assert set(STATUSES) == {status.name for status in hrt.MarchStatus} | {""}
    assert set(pictures.STATUS_WORDS) == set(hrt.MarchStatus)


def test_colours_of_statuses_are_those_of_their_legend_to_the_bit(view):
    gbuffer, rays = view
    status = (np.arange(len(rays)) % len(hrt.MarchStatus)).astype(np.uint8)
    image = pictures.status_image(gbuffer, rays, status)
    entries = pictures.status_entries(status)
    assert [colour for colour, _ in entries] == [STATUSES[s.name] for s in hrt.MarchStatus]
    figure = sheet.sheet([sheet.Picture(image, "x")], legend=entries)
    drawn = sheet.pixels(figure)
    assert (drawn[: SIZE[1]] == image).all()  # the picture itself, pixel for pixel
    assert {tuple(p) for p in image.reshape(-1, 3).tolist()} == {rgb(c) for c in STATUSES.values()}
    for (colour, label), handle in zip(entries, figure.legends[0].legend_handles, strict=True):
        box = handle.get_window_extent()
        x, y = round((box.x0 + box.x1) / 2), drawn.shape[0] - round((box.y0 + box.y1) / 2)
        assert tuple(drawn[y, x].tolist()) == rgb(colour), label


def test_each_pixel_has_the_colour_of_the_ray_that_starts_there(view):
    gbuffer, rays = view
    status = np.full(len(rays), hrt.MarchStatus.HIT, np.uint8)
    status[7] = hrt.MarchStatus.NEAR
    image = pictures.status_image(gbuffer, rays, status)
    x, y = rays.pixel[7]
    assert tuple(image[y, x].tolist()) == rgb(STATUSES["NEAR"])
    assert (image[gbuffer.prim_id < 0] == rgb(STATUSES[""])).all()


def test_a_depth_is_as_the_scale_beneath_it_says(view):
    gbuffer, _ = view
    image, _, scale = pictures.depth_picture(gbuffer)
    covered = gbuffer.prim_id >= 0
    z = gbuffer.camera.near / np.where(covered, gbuffer.depth.astype(float), 1)
    assert z[covered].min() <= scale.low < scale.high <= z[covered].max()
    for value in (scale.low, np.sqrt(scale.low * scale.high), scale.high):
        y, x = np.unravel_index(np.where(covered, np.abs(z - value), np.inf).argmin(), z.shape)
        assert (image[y, x] == scale.painted(z[y, x : x + 1])[0]).all()
    near, far = scale.painted(np.array([scale.low, scale.high])).astype(int)
    assert near.sum() > far.sum()  # near is bright
    figure = sheet.sheet([sheet.Picture(image, "", scale)])
    check(figure)
    bar = figure.axes[1]
    said = bar.get_xlabel().replace("\n", " ")
    assert said == "distance along the view axis, z, in the scene's units"
    ticks = [float(t.get_text()) for t in bar.get_xticklabels() if t.get_text()]
    assert len([t for t in ticks if scale.low <= t <= scale.high]) >= 2


def test_a_view_of_one_distance_has_a_scale_about_it():
    wall = hrt.Scene.from_arrays(
        [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]]
    )
    camera = hrt.Camera.look_at((0, 0, 4), (0, 0, 0), width=32, height=18, near=0.1)
    image, _, scale = pictures.depth_picture(hrt.rasterize(wall, camera))
    assert scale.low < 4 < scale.high
    check(sheet.sheet([sheet.Picture(image.repeat(8, 0).repeat(8, 1), "", scale)]))


def test_distances_of_parallel_sight_may_be_behind_the_eye():
    stairs = hrt.Scene.from_arrays(
        [[x, y, z] for z, x0 in ((-3, -2), (3, 0)) for x, y in ((x0, -2), (x0 + 2, -2), (x0, 2))],
        [[0, 1, 2], [3, 4, 5]],
    )
    camera = hrt.Camera.orthographic(
        (0, 0, 0), (0, 0, -1), view_height=4, near=-5, far=5, width=64, height=64
    )
    gbuffer = hrt.rasterize(stairs, camera)
    image, _, scale = pictures.depth_picture(gbuffer)
    assert (scale.low, scale.high) == pytest.approx((-3, 3), rel=1e-5)
    assert not scale.logarithmic
    near, far = (image[gbuffer.prim_id == k].mean(axis=0) for k in (1, 0))
    assert near.sum() > far.sum()
    check(sheet.sheet([sheet.Picture(image.repeat(4, 0).repeat(4, 1), "", scale)]))
    assert pictures.render(stairs, camera, "all").shape[1] == 2 * 64 + sheet.GAP


def test_a_view_of_nothing_has_no_scale():
    wall = hrt.Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    camera = hrt.Camera.look_at((0, 0, 4), (0, 0, 9), width=32, height=18, near=0.1)
    image, caption, scale = pictures.depth_picture(hrt.rasterize(wall, camera))
    assert scale is None
    assert "no surface" in caption
    assert (image == 255).all()


@pytest.mark.parametrize("size", [(64, 36), (320, 180), (1920, 1080)])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_sheets_are_whole_at_every_size(size, count):
    image = np.full((size[1], size[0], 3), 128, np.uint8)
    scale = sheet.Scale("distance along the view axis, z, in the scene's units", 0.3, 70.0, "gray")
    some = [
        sheet.Picture(
            image, f"a caption that is rather long for number {k}", scale if k % 2 else None
        )
        for k in range(count)
    ]
    legend = [(colour, words) for colour, words in zip(STATUSES.values(),
              pictures.STATUS_WORDS.values(), strict=False)]  # fmt: skip
    size_of_text = 8.0 if size[0] > 64 else 4.0
    figure = sheet.sheet(some, title="a title of a sheet", legend=legend, foot="what it is of",
                         points=size_of_text)  # fmt: skip
    check(figure)


@pytest.mark.parametrize("what", ["depth", "normals", "status", "all"])
def test_what_is_rendered_stands_over_what_explains_it(view, what):
    gbuffer, _ = view
    image = pictures.render(gbuffer.scene, gbuffer.camera, what)
    lines = 2 if what == "all" else 1
    assert image.shape[0] > lines * SIZE[1]
    assert image.shape[1] == (2 * SIZE[0] + sheet.GAP if what == "all" else SIZE[0])
