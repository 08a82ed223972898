"""Every figure of every kind, on runs made up in several layouts: what it shows, what it hides."""

import re
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from hybrid_rt_bench.judged import bars
from hybrid_rt_bench.judged import figures as judged
from hybrid_rt_bench.judged import maps as judged_maps
from hybrid_rt_bench.judged.columns import EMBREE, MAP_CLASSES
from hybrid_rt_bench.kinds.frame import figures as frame
from hybrid_rt_bench.kinds.paper import figures as paper
from hybrid_rt_bench.kinds.paper import pictures as paper_pictures
from hybrid_rt_bench.kinds.peers import figures as peers
from hybrid_rt_bench.kinds.roofline import figures as roofline
from hybrid_rt_bench.kinds.scaling import figures as scaling
from hybrid_rt_bench.kinds.stability import figures as stability
from hybrid_rt_bench.report import style
from hybrid_rt_bench.report.alike import MISSING
from hybrid_rt_bench.report.looks import VERDICTS, looks, rgb
from support import made_runs
from support.geometry import check
from support.made_runs import LAYOUTS

KINDS = {
    "paper": (made_runs.paper_run, [paper.plots]),
    "judged": (made_runs.judged_run, [judged.plots]),
    "peers": (made_runs.peers_run, [peers.figures]),
    "stability": (made_runs.stability_run, [stability.figures]),
    "scaling": (made_runs.scaling_run, [scaling.plots]),
    "roofline": (made_runs.roofline_run, [roofline.plots]),
    "frames": (made_runs.frame_run, [frame.figures]),
    "maps of errors": (made_runs.judged_run, [judged_maps.figures]),
    "the paper's pictures": (made_runs.paper_run, [paper_pictures.figures]),
}
TWO = LAYOUTS["two scenes, three techniques"]


def drawn(monkeypatch, run, makers):
    """Return every figure that makers save of a run, by name, without writing it."""
    found = {}

    def keep(figure, stem, dpi=None):
        found[stem.name] = figure
        return [stem]

    for module in (style, judged_maps, paper_pictures, frame):
        monkeypatch.setattr(module, "save", keep)
    for make in makers:
        make(run, run.folder)
    return found


def words(figure):
    """Return all that is written in a figure."""
    return "\n".join(text.get_text() for text in figure.findobj(mpl.text.Text))


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=pytest.mark.slow) if name.startswith("many") else name
        for name in LAYOUTS
    ],
)
def layout(request):
    return LAYOUTS[request.param]


@pytest.mark.parametrize("kind", KINDS)
def test_every_text_is_whole_and_clear_and_says_what_was_measured(
    tmp_path, monkeypatch, layout, kind
):
    make, makers = KINDS[kind]
    run = make(tmp_path, layout)
    figures = drawn(monkeypatch, run, makers)
    assert figures
    for name, figure in figures.items():
        with mpl.rc_context(style.STYLE):
            check(figure)
        assert max(figure.get_figwidth() / 40, figure.get_figheight() / 60) < 1
        said = re.sub(r"\s+", "", words(figure))
        assert made_runs.MACHINE["cpu"].replace(" ", "") in said, name
        assert "thread" in said, name
        if kind in ("paper", "judged", "roofline"):
            assert "×" in said, name
            for scene in layout.scenes:
                assert scene.replace(" ", "") in said, name
            if made_runs.LONG in layout.scenes:  # which is not whole
                assert f"{made_runs.LONG}(partial)" in said, name
                assert "atenthofitstrianglesareabsent" in said, name
        if kind in ("paper", "judged", "stability", "peers", "maps of errors"):
            some = layout.techniques if kind != "maps of errors" else layout.techniques[:-1]
            for technique in some:
                assert technique in said, name
        if kind == "scaling" and name != "memory":
            for technique in layout.techniques:
                assert technique in said, name


@pytest.mark.parametrize("kind", ["paper", "judged", "paper's pictures"])
def test_runs_without_an_answer_or_an_error_are_drawn(tmp_path, monkeypatch, kind):
    make, makers = KINDS.get(kind, KINDS["the paper's pictures"])
    run = make(tmp_path, TWO, zeros=True)
    for figure in drawn(monkeypatch, run, makers).values():
        with mpl.rc_context(style.STYLE):
            check(figure)


def test_a_run_that_only_counted_shows_alpha_alone(tmp_path, monkeypatch):
    run = made_runs.judged_run(tmp_path, TWO, timed=False)
    figures = drawn(monkeypatch, run, [judged.plots])
    assert set(figures) == {"alpha-by-workload"}


def test_what_a_technique_lacks_is_pooled_into_no_bar(tmp_path):
    run = made_runs.judged_run(tmp_path, TWO)
    figure = bars.alpha_by_workload(run)
    (ax,) = figure.axes
    assert [text.get_text() for text in ax.texts] == [MISSING]  # of "mine", diffuse rays
    rows = run.results[(run.results.point == "default") & (run.results.technique != EMBREE)]
    expected = []
    for workload in ("mirror", "diffuse"):
        part = rows[rows.workload == workload]
        names = [n for n in TWO.techniques if (n, workload) != ("mine", "diffuse")]
        views = [
            set(part[part.technique == n][["scene", "camera", "width"]].itertuples(index=False))
            for n in names
        ]
        for name in names:
            mine = part[part.technique == name]
            cells = mine[["scene", "camera", "width"]].itertuples(index=False)
            kept = mine[[cell in set.intersection(*views) for cell in cells]]
            expected.append(kept.resolved.sum() / kept.rays.sum())
    heights = [bar.get_height() for bar in ax.patches if bar.get_hatch() != "////"]
    assert sorted(heights) == pytest.approx(sorted(expected))


def test_what_a_view_lacks_is_hatched_and_named(tmp_path):
    run = made_runs.paper_run(tmp_path, TWO)
    stages = paper.time_of_stages(run)
    assert [t.get_text() for ax in stages.axes for t in ax.texts] == [MISSING]
    for figure in (paper.alpha_by_camera(run), paper.errors_by_camera(run)):
        said = re.sub(r"\s+", " ", words(figure)).replace("- ", "-")
        assert f"Not measured: {TWO.scenes[-1]}, {TWO.cameras[0]}, mine." in said


def test_times_are_means_over_the_views_that_all_have(tmp_path):
    run = made_runs.paper_run(tmp_path, TWO)
    figure = paper.time_over_resolution(run)
    last = figure.axes[-1]
    rows = run.results[(run.results.scene == TWO.scenes[-1]) & (run.results.camera == "low")]
    lines = {line.get_label(): line.get_ydata() for line in last.lines}
    for technique in TWO.techniques:
        mine = rows[rows.technique == technique].sort_values("width")
        assert lines[f"{technique}: hybrid"] == pytest.approx(mine.hybrid_ms.to_numpy())


def test_figures_are_written_twice_and_the_same_each_time(tmp_path):
    run = made_runs.judged_run(tmp_path, LAYOUTS["one scene, two techniques"])
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder in folders:
        folder.mkdir()
        judged.plots(run, folder)
    for ending in ("png", "svg"):
        names = sorted(path.name for path in folders[0].glob(f"*.{ending}"))
        assert len(names) == 5
        for name in names:
            assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes()


def test_text_of_an_svg_stays_text_and_has_no_date(tmp_path):
    run = made_runs.stability_run(tmp_path, TWO)
    paths = stability.figures(run, tmp_path)
    assert [path.suffix for path in paths] == [".png", ".svg"]
    text = paths[1].read_text()
    tree = ElementTree.fromstring(text)
    written = {e.text for e in tree.iter("{http://www.w3.org/2000/svg}text")}
    assert {"certified", "pass"} <= written
    assert "dc:date" not in text


@pytest.mark.parametrize("kind", ["maps of errors", "the paper's pictures"])
def test_colours_of_maps_are_those_of_their_legend_to_the_bit(tmp_path, monkeypatch, kind):
    make, makers = KINDS[kind]
    run = make(tmp_path, LAYOUTS["one scene, one technique"])
    path = next(p for p in makers[0](run, tmp_path) if p.suffix == ".png")
    image = np.asarray(Image.open(path).convert("RGB"))
    (figure,) = drawn(monkeypatch, run, makers).values()
    FigureCanvasAgg(figure).draw()
    handles = figure.legends[0].legend_handles
    picture = figure.axes[-1].get_images()[0].get_array()
    seen = {tuple(pixel) for pixel in np.asarray(picture).reshape(-1, 3).tolist()}
    for handle in handles:
        colour = tuple(round(255 * c) for c in handle.get_facecolor()[:3])
        # In the drawing of the legend: the middle of the patch.
        box = handle.get_window_extent()
        x, y = round((box.x0 + box.x1) / 2), image.shape[0] - round((box.y0 + box.y1) / 2)
        assert tuple(image[y, x].tolist()) == colour
        if not handle.get_label().startswith("greys"):
            assert colour in seen, handle.get_label()
    # And nothing is in the picture that is neither a grey nor in the legend.
    legend = {tuple(round(255 * c) for c in h.get_facecolor()[:3]) for h in handles}
    assert all(pixel in legend or len(set(pixel)) == 1 for pixel in seen)


def test_a_map_has_the_pixels_of_its_classes(tmp_path):
    classes = np.arange(6, dtype=np.uint8).reshape(2, 3)
    image = judged_maps.error_map(np.full((2, 3), 128, np.uint8), classes)
    Image.fromarray(image).save(tmp_path / "x.png")
    read = np.asarray(Image.open(tmp_path / "x.png"))
    for name, number in MAP_CLASSES.items():
        (pixel,) = read[classes == number]
        if name == "right":
            assert len(set(pixel.tolist())) == 1
        else:
            assert tuple(pixel.tolist()) == rgb(VERDICTS[name])


def test_a_technique_looks_the_same_in_every_figure(tmp_path, monkeypatch):
    expected = looks(TWO.techniques)
    run = made_runs.judged_run(tmp_path / "a", TWO)
    figure = judged.speed_against_error(run)
    for line in figure.axes[0].lines:
        if line.get_label() in expected:
            assert line.get_color() == expected[line.get_label()].colour
            assert line.get_marker() == expected[line.get_label()].marker
    run = made_runs.paper_run(tmp_path / "b", TWO)
    figure = paper.alpha_by_camera(run)
    for line in figure.axes[0].lines:
        if line.get_label() in expected:
            assert line.get_color() == expected[line.get_label()].colour
            assert line.get_marker() == expected[line.get_label()].marker


def test_the_check_finds_what_is_cut_off_and_what_collides():
    def faulty(**change):
        figure = Figure(figsize=(4, 3), layout="constrained" if not change else None)
        ax = figure.add_subplot()
        ax.plot([0, 1], label="a line")
        ax.set_xlabel("an axis")
        return figure, ax

    check(faulty()[0])
    figure, ax = faulty(plain=True)
    figure.text(0.9, 0.5, "far too long for this")
    with pytest.raises(AssertionError, match="cut off"):
        check(figure)
    figure, ax = faulty()
    ax.text(0.5, 0.5, "one")
    ax.text(0.5, 0.52, "two")
    with pytest.raises(AssertionError, match="'one' over 'two'"):
        check(figure)
    figure, ax = faulty()
    ax.text(0.2, 0.5, "slanted text here", rotation=45)
    ax.text(0.55, 0.35, "beside it")  # inside of its upright box, outside of itself
    check(figure)
    figure, ax = faulty()
    ax.text(0.1, 0.9, "named")
    ax.legend(loc="upper left")
    with pytest.raises(AssertionError, match="the legend over 'named'"):
        check(figure)
    figure, ax = faulty(plain=True)
    figure.suptitle("much too low", y=0.7)
    with pytest.raises(AssertionError, match="over the panel"):
        check(figure)
    figure, ax = faulty(plain=True)
    figure.legend(bbox_to_anchor=(1.2, 0.5))
    with pytest.raises(AssertionError, match="the legend is cut off"):
        check(figure)
