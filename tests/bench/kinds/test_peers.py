"""Other programs beside ours: rows of peers that cannot run, agreement, timing, report."""

import dataclasses
import importlib
import json
import math
import re
import sys
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import hybrid_rt as hrt
from hybrid_rt_bench import cli
from hybrid_rt_bench.experiments import load_experiment, parse_experiment
from hybrid_rt_bench.kinds.peers import agreement, trial
from hybrid_rt_bench.kinds.peers import cell as peers_cell
from hybrid_rt_bench.kinds.peers import figures as peers_figures
from hybrid_rt_bench.kinds.peers import programs as peers
from hybrid_rt_bench.kinds.peers import run as peers_run
from hybrid_rt_bench.kinds.peers.cell import Contender
from hybrid_rt_bench.kinds.peers.columns import SCHEMA, TIMES
from hybrid_rt_bench.kinds.peers.programs.base import (
    Answers,
    Opened,
    Peer,
    PeerError,
    Picture,
    Query,
    View,
)
from hybrid_rt_bench.kinds.peers.programs.ours import Embree
from hybrid_rt_bench.results import folder as results
from hybrid_rt_bench.runs import read_run, render_run
from hybrid_rt_scenes import get_scene
from support.bench_rows import ENVIRONMENT

TEXT = """
schema = 1
kind = "peers"
name = "peers"
title = "Peers"
peers = {names}
resolutions = ["48x36"]
rounds = 2
cameras = 1
selection_rays = 1024
sample_seconds = 0.05
patience_seconds = 60.0
[[scenes]]
name = "cornell"
"""

REAL = {
    "open3d": ("open3d",),
    "mitsuba": ("mitsuba", "drjit"),
    "trimesh-rtree": ("rtree",),
    "llvmpipe": ("moderngl",),
    "trimesh": ("trimesh",),
    "trimesh-first": ("trimesh",),
    "embreex": ("embreex",),
    "embreex-threads": ("embreex",),
}
"""What each real peer imports."""


@pytest.fixture(scope="module")
def cornell():
    spec = get_scene("cornell")
    scene = spec.load()
    camera = spec.camera(next(iter(spec.cameras)), 64, 48)
    return scene, camera, hrt.rasterize(scene, camera)


class Fake(Opened):
    """A peer that answers as robust Embree does, but for what `change` makes of the answers."""

    build_seconds, threads = 0.25, 3

    def __init__(self, scene, threads, change=lambda answers: answers):
        self.tracer, self.change = hrt.EmbreeTracer(scene, threads=threads), change
        self.asked, self.closed = [], False

    def load(self, view):
        self.asked.append(len(view.rays))

        def answers(hits):
            return self.change(Answers(hits.t.copy(), hits.prim_id.copy()))

        return Query(lambda: self.tracer.intersect(view.rays), answers, "as it is")

    def close(self):
        self.closed = True


def fake_peer(make=Fake, name="fake", **more):
    return Peer(name, "a fake", ("numpy",), make, alone=False, **more)


def measured(cornell, *contenders, rounds=2):
    scene, camera, gbuffer = cornell
    return peers_cell.measure_cell(
        contenders, Embree(scene, 1), camera, gbuffer, rounds, 1024, sample_seconds=0.05
    )


def row_of(record, name, workload="mirror"):
    (row,) = (r for r in record.results if r["technique"] == name and r["workload"] == workload)
    return row


def run(monkeypatch, tmp_path, *chosen):
    """Run the experiment over these peers by the command line; return its code and its folder."""
    known = {peer.name: peer for peer in chosen}
    monkeypatch.setattr(peers_run, "get_peer", known.__getitem__)
    path = tmp_path / "peers.toml"
    path.write_text(TEXT.format(names=json.dumps(list(known))))
    out = tmp_path / "out"
    arguments = ["hybrid-rt", "run", str(path), "--out", str(out), "--threads", "1"]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    (folder,) = out.iterdir()
    return stopped.value.code, folder


def cells_of(table, first):
    return next(dict(zip(table.columns, row, strict=True)) for row in table.rows if row[0] == first)


@pytest.mark.parametrize("quick", [False, True])
def test_the_experiment_of_the_package_asks_for_peers_that_are_known(quick):
    experiment = load_experiment("peers", quick=quick)
    assert [peers.get_peer(name).name for name in experiment.peers] == experiment.peers
    assert set(experiment.peers) == set(peers.PEERS)
    with pytest.raises(hrt.UnknownNameError, match="did you mean 'mitsuba'"):
        peers.get_peer("mitsuba3")


def test_a_bad_setting_is_refused():
    text = TEXT.format(names='["embree"]').replace("rounds = 2", "rounds = 0")
    with pytest.raises(hrt.ArgumentError, match="rounds"):
        parse_experiment(text, source="x.toml")


@pytest.mark.slow
def test_a_peer_that_cannot_be_imported_has_a_row_with_the_reason(monkeypatch, tmp_path, capsys):
    def absent(scene, threads):
        importlib.import_module("no_such_ray_tracer")

    code, folder = run(
        monkeypatch, tmp_path, peers.PEERS["embree"], fake_peer(absent, "absent"), fake_peer()
    )
    said = capsys.readouterr()
    assert code == 0, said.err
    assert "absent does not run: ModuleNotFoundError: No module named" in said.err
    found = pd.read_parquet(folder / "results.parquet")
    rows = found[found.technique == "absent"]
    assert list(rows.workload) == ["mirror", "primary"]
    assert (rows.state == "absent").all()
    assert rows.reason.str.contains("No module named 'no_such_ray_tracer'").all()
    assert rows.ms.isna().all()
    others = found[found.technique != "absent"]
    assert (others.state == "ok").all()
    assert (others.ms > 0).all()
    text = (folder / "tables.md").read_text()
    assert re.search(r"\| absent +\| +not run \|", text)
    assert "No module named 'no_such_ray_tracer'" in " ".join(text.split())
    assert (folder / "figures" / "rays-by-program.png").stat().st_size > 5000
    (folder / "tables.md").unlink()
    render_run(read_run(folder))
    assert (folder / "tables.md").read_text() == text


def test_a_peer_that_raises_has_a_row_with_the_reason_and_the_others_go_on(cornell):
    class Raises(Fake):
        def load(self, view):
            def trace():
                raise ValueError(f"no {view.workload} rays today")

            return Query(trace, lambda found: found)

    scene = cornell[0]
    record = measured(
        cornell,
        Contender(fake_peer(Raises, "raises"), Raises(scene, 1)),
        Contender(fake_peer(), Fake(scene, 1)),
    )
    for workload in ("mirror", "primary"):
        row = row_of(record, "raises", workload)
        assert row["state"] == "error"
        assert row["reason"].startswith(f"ValueError: no {workload} rays today")
        assert math.isnan(row["ms"])
        assert row_of(record, "fake", workload)["state"] == "ok"
    assert {s["technique"] for s in record.samples} == {"fake"}


def test_a_peer_that_raises_in_a_later_round_keeps_none_of_its_times(cornell):
    class Tires(Fake):
        calls = 0

        def load(self, view):
            query = super().load(view)

            def trace():
                self.calls += 1
                if self.calls == 3:
                    raise RuntimeError("tired")
                return query.run()

            return dataclasses.replace(query, run=trace)

    record = measured(cornell, Contender(fake_peer(Tires, "tires"), Tires(cornell[0], 1)))
    row = row_of(record, "tires")  # its third call is the second round
    assert (row["state"], row["reason"].split(" (")[0]) == ("error", "RuntimeError: tired")
    assert math.isnan(row["ms"])
    assert not [s for s in record.samples if s["workload"] == "mirror"]
    assert row_of(record, "tires", "primary")["state"] == "ok"


def test_every_sample_is_paired_and_gives_its_row(cornell):
    record = measured(cornell, Contender(fake_peer(), Fake(cornell[0], 1)), rounds=3)
    mine = [s for s in record.samples if s["workload"] == "mirror"]
    row = row_of(record, "fake")
    assert [s["round"] for s in mine] == [0, 1, 2]
    assert row["ms"] == pytest.approx(1e3 * np.median([s["seconds"] for s in mine]))
    ratios = [s["seconds"] / s["beside"] for s in mine]  # of the same rays
    assert row["ratio"] == pytest.approx(np.median(ratios))
    assert (row["threads"], row["build_seconds"], row["label"]) == (3, 0.25, "as it is")
    assert (row["same"], row["different"], row["t_max"]) == (1.0, 0, 0.0)


def test_a_sampled_peer_gets_as_many_rays_as_the_time_allows_and_its_ratio_is_a_ray(
    cornell, monkeypatch
):
    """Its clock says that a ray takes a hundredth of the time it may have."""

    class Slow(Fake):
        def load(self, view):
            query = super().load(view)

            def trace():
                clock.now += 5e-4 * len(view.rays)
                return query.run()

            return dataclasses.replace(query, run=trace)

    class Clock:
        now = 0.0

        def perf_counter(self):
            self.now += 1e-9
            return self.now

        def process_time(self):
            return self.now

    clock = Clock()
    monkeypatch.setattr(peers_cell, "time", clock)
    opened = Slow(cornell[0], 1)
    contender = Contender(fake_peer(sampled=True), opened)
    record = measured(cornell, contender, rounds=1)
    row = row_of(record, "fake")
    assert opened.asked[:5] == [1, 4, 16, 64, row["rays"]]  # 64 take 0.032 s of 0.05 s
    assert row["rays"] == pytest.approx(100, abs=1)
    assert row["sampled"]
    assert row["same"] == 1.0
    (sample,) = (s for s in record.samples if s["workload"] == "mirror")
    a_ray = sample["beside"] / record.details["mirror_rays"]
    assert row["ratio"] == pytest.approx(sample["seconds"] / row["rays"] / a_ray)


def test_a_sample_of_a_peer_that_is_far_too_slow_is_one_ray(cornell, monkeypatch):
    class Slower(Fake):
        def load(self, view):
            query = super().load(view)

            def trace():
                clock[0] += 10.0 * len(view.rays)
                return query.run()

            return dataclasses.replace(query, run=trace)

    clock = [0.0]
    opened = Slower(cornell[0], 1)
    view = View("mirror", hrt.mirror_rays(cornell[2]), cornell[2])
    monkeypatch.setattr(peers_cell, "time", SimpleNamespace(perf_counter=lambda: clock[0]))
    (index,) = peers_cell._sample(opened, view, 1.0)
    assert 0 < index < len(view.rays)
    assert opened.asked == [1]


def hits_at(t, prim_id):
    n = len(t)
    zero = np.zeros(n, np.float32)
    t, prim_id = np.array(t, np.float32), np.array(prim_id, np.int32)
    return hrt.Hits(t, prim_id, zero, zero, np.zeros((n, 3), np.float32))


def test_agreement_counts_each_way_to_differ():
    inf = np.inf
    reference = hits_at([1, 2, 4, 1, inf, 5, 8], [0, 1, 2, 3, -1, 5, 6])
    rays = hrt.Rays.from_arrays(
        np.zeros((7, 3)), np.ones((7, 3)), None, np.full(7, 0.25, np.float32)
    )
    answers = Answers(
        #        same   t off  same place      early  too much  missed  same
        np.array([1.0, 2.002, 4 * (1 + 1e-6), 0.125, 3.0, inf, 8.0]),
        np.array([0, 1, 7, 8, 9, -1, 6]),
    )
    found = agreement.of_rays(answers, reference, rays)
    assert found["different"] == 4
    assert found["same"] == pytest.approx(3 / 7)
    assert found["same_place"] == pytest.approx(1 / 7)
    assert found["early"] == pytest.approx(1 / 7)
    assert found["t_max"] == pytest.approx(1e-3)


def test_agreement_of_a_peer_that_says_no_distances_is_that_of_its_primitives():
    reference = hits_at([1, np.inf], [4, -1])
    rays = hrt.Rays.from_arrays(np.zeros((2, 3)), np.ones((2, 3)))
    found = agreement.of_rays(Answers(np.full(2, np.nan), np.array([4, 3])), reference, rays)
    assert found["same"] == 0.5
    assert math.isnan(found["t_max"])
    with pytest.raises(PeerError, match="expected 2 answers"):
        agreement.of_rays(Answers(np.zeros(3), np.zeros(3, int)), reference, rays)


def test_agreement_with_nothing_the_same():
    rays = hrt.Rays.from_arrays(np.zeros((1, 3)), np.ones((1, 3)))
    found = agreement.of_rays(Answers(np.array([np.inf]), np.array([-1])), hits_at([1], [0]), rays)
    assert (found["same"], found["early"]) == (0.0, 0.0)
    assert math.isnan(found["t_max"])


def test_wrong_answers_show_in_the_row(cornell):
    def half_missed(answers):
        answers.prim_id[::2] = -1
        answers.t[::2] = np.inf
        return answers

    scene = cornell[0]
    opened = Fake(scene, 1, half_missed)
    row = row_of(measured(cornell, Contender(fake_peer(), opened), rounds=1), "fake")
    truth = hrt.EmbreeTracer(scene).intersect(hrt.mirror_rays(cornell[2])).prim_id
    assert row["different"] == (truth[::2] >= 0).sum() > 100
    assert row["t_max"] == 0


def test_pictures_are_compared_pixel_by_pixel(cornell):
    gbuffer = cornell[2]
    covered = np.argwhere(gbuffer.prim_id >= 0)
    (a, b), (c, d) = covered[0], covered[len(covered) // 2]
    prim_id, depth = gbuffer.prim_id.copy(), gbuffer.depth.copy()
    prim_id[a, b], depth[a, b] = -1, 0
    depth[c, d] *= np.float32(1.25)
    found = agreement.of_pictures(Picture(depth, prim_id), gbuffer)
    pixels = prim_id.size
    assert found["different"] == 1
    assert found["same"] == pytest.approx(1 - 1 / pixels)
    assert found["only_ours"] == pytest.approx(1 / pixels)
    assert (found["only_here"], found["depth_p50"]) == (0.0, 0.0)
    assert found["depth_max"] == pytest.approx(0.25)
    with pytest.raises(PeerError, match="shape"):
        agreement.of_pictures(Picture(depth[1:], prim_id[1:]), gbuffer)


@pytest.mark.parametrize(
    ("code", "seconds", "reason"),
    [
        ("import os; os.kill(os.getpid(), 11)", 60, "its process was ended by SIGSEGV"),
        ("import sys; sys.exit('out of luck')", 60, "its process ended with code 1: out of luck"),
        ("import time; time.sleep(60)", 0.2, "given up: not ready after 0.2 s"),
    ],
)
def test_a_process_that_ends_badly_is_a_reason(code, seconds, reason):
    assert trial.run_alone(code, [], seconds).reason == reason


@pytest.mark.slow
def test_a_trial_tells_memory_or_the_reason(cornell):
    found = trial.attempt(peers.PEERS["embree"], cornell[0], 1, 120)
    assert found.reason == ""
    if sys.platform.startswith("linux"):
        assert 1 < found.peak_mib < 4096
    unknown = trial.attempt(fake_peer(name="embre"), cornell[0], 1, 120)
    assert "did you mean 'embree'" in unknown.reason


def test_what_a_trial_finds_keeps_a_peer_from_this_process(monkeypatch, tmp_path, capsys):
    def never(scene, threads):
        raise AssertionError("opened all the same")

    monkeypatch.setattr(peers_run, "attempt", lambda *_: trial.Trial("it crashes"))
    crashing = dataclasses.replace(fake_peer(never, "crashing"), alone=True)
    code, folder = run(monkeypatch, tmp_path, crashing, fake_peer())
    assert code == 0, capsys.readouterr().err
    rows = pd.read_parquet(folder / "results.parquet").set_index("technique")
    assert set(rows.loc["crashing"].reason) == {"it crashes"}
    assert set(rows.loc["fake"].state) == {"ok"}


def test_a_scene_is_closed_when_it_is_done(monkeypatch, tmp_path):
    made = []

    def make(scene, threads):
        made.append(Fake(scene, threads))
        return made[-1]

    run(monkeypatch, tmp_path, fake_peer(make))
    assert [opened.closed for opened in made] == [True]


def write_run(out):
    """Write a run of known figures: two scenes, a peer twice as fast and one that is absent."""
    meta = {
        "kind": "peers", "command": [], "notes": [], "warnings": [],
        "spec": {"title": "Peers", "rounds": 2},
        "scenes": [{"name": name, "triangles": 1046} for name in ("hall", "yard")],
        "peers": [
            {"name": "embree", "version": "embreex 1", "detail": "", "description": "ours"},
            {"name": "quick", "version": "quick 2", "detail": "so", "description": "theirs"},
        ],
    }  # fmt: skip
    writer = results.create_run(out, "peers", SCHEMA, meta)
    writer.meta["environment"] = ENVIRONMENT
    absent = Contender(fake_peer(name="absent"), None, "ImportError: libgone.so: no such file")
    drawing = Contender(fake_peer(name="pipe", raster=True), Opened())
    for scene in ("hall", "yard"):
        rows, samples = [], []
        for workload, rays in (("mirror", 1000), ("primary", 2000)):
            for name, ms in (("embree", 10.0), ("quick", 5.0)):
                timing = dict.fromkeys((column.name for column in TIMES), 1.5)
                timing |= {"ms": ms, "ms_low": ms, "ms_high": ms}
                opened = Opened()
                opened.build_seconds, opened.threads = 0.5, 2
                row = Contender(fake_peer(name=name), opened, peak_mib=64.0).row(
                    workload, rays=rays, convert_ms=1.0, first_ms=9.0, same=0.75,
                    different=rays // 4, same_place=0.1, early=0.2, t_p99=1e-7, t_max=1e-6,
                    **timing,
                )  # fmt: skip
                rows.append(row)
                for number in range(2):
                    samples.append(
                        {
                            "technique": name, "workload": workload, "round": number,
                            "seconds": ms / 1e3, "cpu_seconds": ms / 1e3, "read_seconds": np.nan,
                            "beside": 0.01, "beside_rays": rays,
                        }
                    )  # fmt: skip
            rows.append(absent.row(workload))
        timing = dict.fromkeys((column.name for column in TIMES), 1.5) | {"ms": 20.0}
        rows.append(
            drawing.row(
                "raster", rays=1000, read_ms=3.0, first_ms=40.0, same=0.999, different=1,
                depth_p50=0.0, depth_p99=1e-6, depth_max=1e-3, **timing,
            )
        )  # fmt: skip
        samples.append({**samples[0], "technique": "pipe", "workload": "raster", "seconds": 0.02})
        cell = {"scene": scene, "camera": "front", "width": 40, "height": 25}
        writer.add_cell(cell, samples, rows, [])
    writer.finish()
    return writer.folder


def test_the_report_is_made_of_the_files_alone(tmp_path):
    run = read_run(write_run(tmp_path))
    tables, written = render_run(run)
    by_title = {table.title: table for table in tables}
    traced = by_title["The same rays through other programs"]
    quick = cells_of(traced, "quick")
    assert quick["mirror, Mrays/s"] == "0.200"  # 1000 rays in 5 ms
    assert quick["primary, Mrays/s"] == "0.400"
    assert quick["time / strongest Embree's, mirror"] == "0.500 [0.500, 0.500]"
    assert quick["same primitive, % of rays"] == "75.0000"
    assert (quick["build, s"], quick["peak memory, MiB"]) == ("0.500", "64.0")
    assert cells_of(traced, "absent")["mirror, Mrays/s"] == "not run"
    assert traced.notes[-1] == (
        "absent was not run on hall and yard: ImportError: libgone.so: no such file."
    )
    drawn = cells_of(by_title["The same picture by OpenGL on the processor"], "pipe")
    assert (drawn["draw, ms"], drawn["read back, ms"]) == ("20.0", "3.00")
    assert (drawn["same primitive, % of pixels"], drawn["depth off, largest"]) == (
        "99.9000",
        "1.0e-03",
    )
    assert "not run" not in drawn.values()
    assert [path.name for path in written] == [
        "tables.md", "rays-by-program.png", "rays-by-program.svg"
    ]  # fmt: skip


def test_the_figure_has_a_panel_a_scene_and_says_what_did_not_run(tmp_path):
    figure = peers_figures.rates(read_run(write_run(tmp_path)))
    assert [ax.get_title() for ax in figure.axes] == [
        "hall, 1046 triangles", "yard, 1046 triangles"
    ]  # fmt: skip
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert names == ["embree, 2 t", "quick, 2 t", "absent"]
    for ax in figure.axes:
        texts = [text.get_text() for text in ax.texts]
        assert texts.count("not run") == 1
        assert sorted(t for t in texts if t != "not run") == ["0.100", "0.200", "0.200", "0.400"]


def test_our_own_rows_are_what_they_say(cornell):
    scene, _, gbuffer = cornell
    names = ("embree", "hybrid", "embreex-threads", "raster")
    contenders = [Contender(peers.PEERS[n], peers.PEERS[n].open(scene, 1)) for n in names]
    record = measured(cornell, *contenders, rounds=1)
    assert all(row["state"] == "ok" for row in record.results), record.results
    traced = [(r["technique"], r["workload"]) for r in record.results if r["same"] > 0.98]
    assert traced == [
        ("embree", "mirror"), ("hybrid", "mirror"), ("embreex-threads", "mirror"),
        ("embree", "primary"), ("embreex-threads", "primary"), ("raster", "raster"),
    ]  # fmt: skip
    raster = row_of(record, "raster", "raster")
    assert (raster["same"], raster["depth_max"]) == (1.0, 0.0)
    assert raster["rays"] == gbuffer.depth.size


@pytest.mark.slow
@pytest.mark.parametrize("name", REAL)
def test_a_real_peer_agrees_with_ours(name, cornell):
    """In a process of its own first, as in a run: some crash where their libraries are missing."""
    for module in REAL[name]:
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed (pip install '.[peers]')")
    scene, camera, gbuffer = cornell
    peer = peers.get_peer(name)
    tried = trial.attempt(peer, scene, 1, 120)
    if tried.reason:
        pytest.skip(f"{name} does not run on this machine: {tried.reason}")
    opened = peer.open(scene, 1)
    try:
        assert opened.build_seconds > 0
        record = measured(cornell, Contender(peer, opened), rounds=1)
        if peer.raster:
            row = row_of(record, name, "raster")
            assert row["state"] == "ok", row["reason"]
            assert row["same"] > 0.998
            assert row["depth_p99"] < 1e-5
            assert row["read_ms"] > 0
            other = dataclasses.replace(camera, width=80, height=40)  # after the first
            shifted = dataclasses.replace(camera, aspect=0.6, shift_px=(9.5, -4.0))
            middle = scene.bounds.mean(axis=0)
            flat = hrt.Camera.orthographic(
                camera.eye, middle, view_height=3.0, width=64, height=48, near=0.5, far=9.0
            )
            for view in (other, shifted, flat):
                drawing = opened.draw(view)
                drawing.draw()
                found = agreement.of_pictures(drawing.read(), hrt.rasterize(scene, view))
                assert found["same"] > 0.998
                assert found["depth_p99"] < 1e-5
            return
        for workload in ("mirror", "primary"):
            row = row_of(record, name, workload)
            assert row["state"] == "ok", row["reason"]
            # Its views are symmetric, so some rays run along shared edges.
            if name != "trimesh-first":  # which cannot say that it has met a ray's own surface
                assert row["same"] + row["early"] > 0.98
                assert row["t_max"] < 1e-2
        query = opened.load(View("mirror", hrt.mirror_rays(gbuffer), gbuffer))
        answers = query.answers(query.run())
        assert len(answers.t) == len(answers.prim_id) == len(hrt.mirror_rays(gbuffer))
        assert (answers.prim_id >= 0).mean() > 0.5
        outside = scene.bounds[1:] + scene.diagonal
        none = opened.load(View("none", hrt.Rays.from_arrays(outside, outside - scene.bounds[:1])))
        missed = none.answers(none.run())
        assert missed.prim_id.tolist() == [-1]
        assert missed.t[0] == np.inf or name == "trimesh-first"
    finally:
        opened.close()
