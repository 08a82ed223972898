"""The threads that kernels run on: several callers at a time, forks, errors."""

import threading

import numpy as np
import pytest

from hybrid_rt.kernels import _team
from hybrid_rt.kernels._jit import parallel_kernel
from hybrid_rt.kernels._queue import part, take
from support.scripts import PYRAMID, run

THREADS = (
    PYRAMID
    + """
import threading
wanted, wrong = right(), []
assert pyramid() == wanted
def ask():
    for _ in range(200):
        if pyramid() != wanted:
            wrong.append(1)
askers = [threading.Thread(target=ask) for _ in range(6)]
for asker in askers:
    asker.start()
for asker in askers:
    asker.join()
print(len(wrong))
"""
)

FORK = (
    PYRAMID
    + """
import multiprocessing
wanted = right()
assert pyramid() == wanted
with multiprocessing.get_context("fork").Pool(3) as pool:
    found = pool.map(pyramid, [1, 2] * 20)
print(sum(each != wanted for each in found))
"""
)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("compiled")


@pytest.mark.parametrize("layer", ["omp", "workqueue"])
@pytest.mark.parametrize("script", [THREADS, FORK], ids=["threads", "fork"])
def test_right_answers_from(script, layer, cache):
    code, output, errors = run(script, cache, NUMBA_THREADING_LAYER=layer)
    assert (code, output) == (0, "0\n"), errors


@parallel_kernel
def who(share, by_part, by_take, workers):
    for i in part(share, len(by_part)):
        by_part[i] += 1
    first = take(share, 3)
    while first < len(by_take):
        by_take[first : first + 3] += 1
        first = take(share, 3)
    workers[share.worker] += share.workers


@pytest.mark.parametrize("n", [0, 1, 2, 5, 1000])
def test_every_piece_of_work_is_done_once(n):
    by_part, by_take, workers = np.zeros(n, int), np.zeros(n, int), np.zeros(64, int)
    who(by_part, by_take, workers)
    assert (by_part == 1).all()
    assert (by_take == 1).all()
    many = np.count_nonzero(workers)
    assert (workers[:many] == many).all()


def test_an_error_of_any_thread_is_raised():
    seen = []

    class Kernel:
        @staticmethod
        def py_func(share):
            """Fail in every thread but the first."""

        def __call__(self, share):
            seen.append(threading.current_thread())
            if share.worker > 0:
                raise ValueError(f"thread {share.worker}")

    def threads():
        return 3

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_team.numba, "get_num_threads", threads)
        with pytest.raises(ValueError, match="thread 1"):
            _team.on_all_threads(Kernel())()
    assert len(seen) == 3
