"""Vectors for Numba: each lane against NumPy, and what may not be touched.

The whole file runs again in processes that compile for narrower machines.
"""

import ctypes
import mmap
import os
import platform
import re
import subprocess
import sys
from typing import NamedTuple

import llvmlite.binding
import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from hybrid_rt.kernels import simd
from hybrid_rt.kernels.simd import (  # fmt: skip
    WIDTH,
    absolute,
    all_,
    any_,
    bits,
    bits_i32,
    bits_i64,
    compress,
    count,
    expand,
    extract,
    f32,
    f64,
    first,
    float_of_bits,
    floor,
    gather,
    i32,
    i64,
    insert,
    interleave,
    iota,
    load,
    load_masked,
    load_triples,
    mask,
    mask_of_bits,
    maximum,
    minimum,
    part,
    pull,
    push,
    reduce_add,
    reduce_min,
    root,
    rows_of,
    scatter,
    select,
    select_each,
    store,
    store_masked,
    store_triples,
    to_f32,
    to_f64,
    to_i32,
    to_i64,
)
from support.machines import MACHINES, machine

# Not cached: a cached kernel would not notice a change in the package under test.
compiled = njit(error_model="numpy")

FLOATS = (np.float32, np.float64)
INTS = (np.int32, np.int64)


def hard_floats(dtype):
    """Return all pairs of hard floats, a multiple of every width of them."""
    info = np.finfo(dtype)
    values = [0.0, 1.0, 1 / 3, 0.5, 2.5, info.max, info.tiny, info.smallest_subnormal, np.inf]
    values += [info.tiny / 2, 1e9, 1 + info.eps]
    values = np.array([*values, *np.negative(values), np.nan, -3.5, 7.25, 1e-5, 123.0, 0.1, -0.7])
    values = np.append(values, np.random.default_rng(1).normal(size=1)).astype(dtype)
    assert values.size == 32
    return np.repeat(values, 32), np.tile(values, 32)


def hard_ints(dtype):
    info = np.iinfo(dtype)
    values = [0, 1, -1, 2, -2, 7, info.min, info.max, info.min + 1, info.max - 1, 1 << 16]
    random = np.random.default_rng(2).integers(info.min, info.max, 21, dtype)
    values = np.append(np.array(values, dtype), random)
    assert values.size == 32
    return np.repeat(values, 32), np.tile(values, 32)


def masks():
    """Return masks of a vector: none, all, single lanes and random ones."""
    rng = np.random.default_rng(3)
    lanes = np.arange(WIDTH)
    chosen = [lanes < 0, lanes >= 0, lanes == 0, lanes == WIDTH - 1, lanes < WIDTH // 2]
    return chosen + [rng.random(WIDTH) < rng.random() for _ in range(40)]


def assert_same(got, wanted):
    """Assert equality of bits, any NaN being as good as another."""
    assert got.dtype == wanted.dtype
    if got.dtype.kind == "f":
        nan = np.isnan(wanted)
        np.testing.assert_array_equal(np.isnan(got), nan)
        kind = f"i{got.dtype.itemsize}"
        got, wanted = got[~nan].view(kind), wanted[~nan].view(kind)
    np.testing.assert_array_equal(got, wanted)


def test_the_width_is_that_of_the_features():
    features = llvmlite.binding.get_host_cpu_features()
    if forced := os.environ.get("HYBRID_RT_TEST_WIDTH"):
        assert int(forced) == WIDTH
    elif "NUMBA_CPU_NAME" not in os.environ and "NUMBA_CPU_FEATURES" not in os.environ:
        wide = all(features.get(f"avx512{f}") for f in ("f", "bw", "dq", "vl"))
        assert (16 if wide else 8 if features.get("avx2") else 4) == WIDTH


# Operators and functions of a lane


@pytest.mark.parametrize("dtype", FLOATS)
def test_float_arithmetic(dtype):
    @compiled
    def run(a, b, s, out):
        for i in range(0, a.size, WIDTH):
            x, y = load(a, i), load(b, i)
            store(out[0], i, x + y)
            store(out[1], i, x - y)
            store(out[2], i, x * y)
            store(out[3], i, x / y)
            store(out[4], i, -x)
            store(out[5], i, minimum(x, y))
            store(out[6], i, maximum(x, y))
            store(out[7], i, absolute(x))
            store(out[8], i, floor(x))
            store(out[9], i, x + s)
            store(out[10], i, s - x)
            store(out[11], i, x * 3)
            store(out[12], i, s / x)
            store(out[13], i, maximum(x, 0))
            store(out[14], i, x * y + s)  # stays two roundings
            store(out[15], i, root(x))

    a, b = hard_floats(dtype)
    s = 0.1
    out = np.empty((16, a.size), dtype)
    run(a, b, s, out)
    s = dtype(s)
    with np.errstate(all="ignore"):
        wanted = [
            a + b, a - b, a * b, a / b, -a, np.where(a < b, a, b), np.where(a > b, a, b),
            np.abs(a), np.floor(a), a + s, s - a, a * dtype(3), s / a,
            np.where(a > 0, a, dtype(0)), a * b + s, np.sqrt(a),
        ]  # fmt: skip
    for got, want in zip(out, wanted, strict=True):
        assert_same(got, want)


@pytest.mark.parametrize("dtype", INTS)
def test_integer_arithmetic(dtype):
    @compiled
    def run(a, b, s, out):
        for i in range(0, a.size, WIDTH):
            x, y = load(a, i), load(b, i)
            store(out[0], i, x + y)
            store(out[1], i, x - y)
            store(out[2], i, x * y)
            store(out[3], i, -x)
            store(out[4], i, ~x)
            store(out[5], i, x & y)
            store(out[6], i, x | y)
            store(out[7], i, x ^ y)
            store(out[8], i, minimum(x, y))
            store(out[9], i, maximum(x, y))
            store(out[10], i, absolute(x))
            store(out[11], i, x << y)
            store(out[12], i, x >> y)
            store(out[13], i, x << 3)
            store(out[14], i, x >> s)
            store(out[15], i, s - x)
            store(out[16], i, s << (y & 7))
            store(out[17], i, x * 5)

    a, b = hard_ints(dtype)
    s = 6
    out = np.empty((18, a.size), dtype)
    run(a, b, s, out)
    s = dtype(s)
    count = b & dtype(8 * a.itemsize - 1)
    with np.errstate(all="ignore"):
        wanted = [
            a + b, a - b, a * b, -a, ~a, a & b, a | b, a ^ b, np.minimum(a, b), np.maximum(a, b),
            np.abs(a), a << count, a >> count, a << dtype(3), a >> s, s - a, s << (b & dtype(7)),
            a * dtype(5),
        ]  # fmt: skip
    for got, want in zip(out, wanted, strict=True):
        assert_same(got, want)


@pytest.mark.parametrize("dtype", FLOATS + INTS)
def test_comparisons_and_select(dtype):
    @compiled
    def run(a, b, out, chosen):
        for i in range(0, a.size, WIDTH):
            x, y = load(a, i), load(b, i)
            store(out[0], i, x < y)
            store(out[1], i, x <= y)
            store(out[2], i, x > y)
            store(out[3], i, x >= y)
            store(out[4], i, x == y)
            store(out[5], i, x != y)
            store(out[6], i, x < 1)
            store(out[7], i, x > 1)
            store(chosen[0], i, select(x < y, x, y))
            store(chosen[1], i, select(x != y, x, -7))
            store(chosen[2], i, select(x >= y, 5, y))

    a, b = (hard_floats if dtype in FLOATS else hard_ints)(dtype)
    out = np.empty((8, a.size), bool)
    chosen = np.empty((3, a.size), dtype)
    run(a, b, out, chosen)
    wanted = [a < b, a <= b, a > b, a >= b, a == b, a != b, a < 1, a > 1]
    for got, want in zip(out, wanted, strict=True):
        assert_same(got, want)
    wanted = [np.where(a < b, a, b), np.where(a != b, a, dtype(-7)), np.where(a >= b, dtype(5), b)]
    for got, want in zip(chosen, wanted, strict=True):
        assert_same(got, want)


def test_masks():
    @compiled
    def run(a, b, flag, out, number):
        x, y = load(a, 0), load(b, 0)
        store(out[0], 0, x & y)
        store(out[1], 0, x | y)
        store(out[2], 0, x ^ y)
        store(out[3], 0, ~x)
        store(out[4], 0, x == y)
        store(out[5], 0, x != y)
        store(out[6], 0, x & flag)
        store(out[7], 0, mask(flag))
        store(out[8], 0, mask_of_bits(bits(x)))
        number[0] = any_(x)
        number[1] = all_(x)
        number[2] = count(x)
        number[3] = bits(x)

    for a in masks():
        for b in masks()[:8]:
            for flag in (False, True):
                out = np.empty((9, WIDTH), bool)
                number = np.empty(4, np.int64)
                run(a, b, flag, out, number)
                all_flag = np.full(WIDTH, flag)
                wanted = [a & b, a | b, a ^ b, ~a, a == b, a != b, a & flag, all_flag, a]
                np.testing.assert_array_equal(out, wanted)
                packed = sum(1 << k for k in range(WIDTH) if a[k])
                np.testing.assert_array_equal(number, [a.any(), a.all(), a.sum(), packed])


def test_the_first_lanes_and_their_numbers():
    @compiled
    def run(n, out, number):
        store(out, 0, first(n))
        store(number, 0, iota())

    out, number = np.empty(WIDTH, bool), np.empty(WIDTH, np.int32)
    for n in (*range(-2, WIDTH + 3), 1 << 40, (1 << 40) - 1, 1 - (1 << 40)):
        run(n, out, number)
        np.testing.assert_array_equal(out, np.arange(WIDTH) < n)
    np.testing.assert_array_equal(number, np.arange(WIDTH))


def test_splats_convert():
    @compiled
    def run(x, n, a, b, c, d):
        store(a, 0, f32(x))
        store(b, 0, f64(n))
        store(c, 0, i32(n))
        store(d, 0, i64(x))

    out = [np.empty(WIDTH, t) for t in (np.float32, np.float64, np.int32, np.int64)]
    run(-2.7, 5_000_000_000, *out)
    wanted = (np.float32(-2.7), 5e9, 5_000_000_000 - (1 << 32), -2)
    for got, want in zip(out, wanted, strict=True):
        assert_same(got, np.full(WIDTH, want, got.dtype))


def test_another_number_of_lanes():
    lanes = 2 * WIDTH

    @compiled
    def run(a, out):
        v = load(a, 0, lanes) + f32(1, lanes) * to_f32(iota(lanes))
        store(out, 0, select(first(lanes - 3, lanes), v, -1))
        return count(mask(True, lanes) & mask_of_bits(5, lanes))

    a = np.random.default_rng(4).random(lanes, np.float32)
    out = np.empty(lanes + 1, np.float32)
    out[-1] = 42
    assert run(a, out) == 2
    lane = np.arange(lanes, dtype=np.float32)
    assert_same(out, np.append(np.where(lane < lanes - 3, a + lane, -1), np.float32(42)))


# Conversions


@compiled
def convert(a, as_f32, as_f64, as_i32, as_i64):
    for i in range(0, a.size, WIDTH):
        v = load(a, i)
        store(as_f32, i, to_f32(v))
        store(as_f64, i, to_f64(v))
        store(as_i32, i, to_i32(v))
        store(as_i64, i, to_i64(v))


def converted(a):
    out = [np.empty(a.size, t) for t in (np.float32, np.float64, np.int32, np.int64)]
    convert(a, *out)
    return out


@pytest.mark.parametrize("dtype", [*INTS, bool])
def test_conversions_of_integers_and_masks(dtype):
    a = (np.arange(64) % 3 == 0) if dtype is bool else hard_ints(dtype)[1]
    for got in converted(a):
        assert_same(got, a.astype(got.dtype))


@pytest.mark.parametrize("dtype", FLOATS)
def test_conversions_of_floats(dtype):
    a = hard_floats(dtype)[1]
    as_f32, as_f64, as_i32, as_i64 = converted(a)
    with np.errstate(all="ignore"):
        assert_same(as_f32, a.astype(np.float32))
        assert_same(as_f64, a.astype(np.float64))
    # Out of range any integer may come, but the other lanes are right.
    for got in (as_i32, as_i64):
        fits = np.abs(a) < 2.0 ** (8 * got.itemsize - 1)
        assert 0 < fits.sum() < a.size
        assert_same(got[fits], a[fits].astype(got.dtype))


def test_the_limits_of_truncation():
    a = np.array([-(2.0**31), 2.0**31 - 1, -(2.0**31) - 0.5, 0.99, -0.99, 2.5, -2.5, 0] * 2)
    assert_same(converted(a)[2], np.trunc(a).astype(np.int32))
    a = np.array([-(2.0**63), 2.0**63 - 1024, 2.0**53 + 2, -0.0] * 4)
    assert_same(converted(a)[3], a.astype(np.int64))


@pytest.mark.parametrize(("dtype", "to_bits"), [(np.float32, bits_i32), (np.float64, bits_i64)])
def test_bits_go_there_and_back(dtype, to_bits):
    @compiled
    def run(a, number, back):
        for i in range(0, a.size, WIDTH):
            n = to_bits(load(a, i))
            store(number, i, n)
            store(back, i, float_of_bits(n))

    a = hard_floats(dtype)[1]
    kind = f"i{a.itemsize}"
    a.view(kind)[:2] = [-1, np.array(np.nan, dtype).view(kind) + 99]  # payloads
    number, back = np.empty(a.size, kind), np.empty(a.size, dtype)
    run(a, number, back)
    np.testing.assert_array_equal(number, a.view(kind))
    np.testing.assert_array_equal(back.view(kind), a.view(kind))


# Memory

ELEMENTS = {  # of an array, and what they are in a vector
    "float32": np.float32, "float64": np.float64, "int32": np.int32, "int64": np.int64,
    "uint8": np.int32, "bool": bool,
}  # fmt: skip


def elements(dtype, shape, seed):
    rng = np.random.default_rng(seed)
    if dtype == "bool":
        return rng.random(shape) < 0.5
    if dtype == "uint8":
        return rng.integers(0, 256, shape, np.uint8)
    return rng.integers(-1000, 1000, shape).astype(dtype)


@pytest.mark.parametrize("dtype", ELEMENTS)
def test_loads_and_stores_in_a_row(dtype):
    @compiled
    def run(a, i, out, wide, j):
        v = load(a, i)
        store(out, j, v)
        store(wide, 0, v)

    a = elements(dtype, (5, 7, 3), 5)
    a.flags.writeable = False
    for i in (0, 1, 13, a.size - WIDTH):
        out = elements(dtype, 3 * WIDTH, 6)
        wanted = out.copy()
        wide = np.empty(WIDTH, ELEMENTS[dtype])
        run(a, i, out, wide, 3)
        wanted[3 : 3 + WIDTH] = a.reshape(-1)[i : i + WIDTH]
        assert_same(out, wanted)
        assert_same(wide, a.reshape(-1)[i : i + WIDTH].astype(ELEMENTS[dtype]))


def test_a_narrowing_store_keeps_the_low_byte():
    @compiled
    def run(out):
        store(out, 0, iota() * 99 - 200)
        store_masked(out, WIDTH, iota() * 99 - 200, mask(True))
        scatter(out, iota() + 2 * WIDTH, iota() * 99 - 200, mask(True))

    out = np.empty(3 * WIDTH, np.uint8)
    run(out)
    wanted = (np.arange(WIDTH, dtype=np.int32) * 99 - 200).astype(np.uint8)
    assert_same(out, np.tile(wanted, 3))


@pytest.mark.parametrize("dtype", ELEMENTS)
def test_masked_loads_and_stores(dtype):
    @compiled
    def run(a, i, m, d, wide, out):
        live = load(m, 0)
        v = load_masked(a, i, live, load(d, 0))
        store(wide[0], 0, v)
        store(wide[1], 0, load_masked(a, i, live, d[0]))
        store_masked(out, 3, v, live)

    a = elements(dtype, 3 * WIDTH, 7)
    d = elements(dtype, WIDTH, 8).astype(ELEMENTS[dtype])
    if dtype == "uint8":
        d -= 1000  # what no byte holds is still a default
    for m in masks():
        out = elements(dtype, 2 * WIDTH, 9)
        wanted = out.copy()
        wide = np.empty((2, WIDTH), ELEMENTS[dtype])
        run(a, 5, m, d, wide, out)
        read = a[5 : 5 + WIDTH]
        assert_same(wide[0], np.where(m, read, d))
        assert_same(wide[1], np.where(m, read, d[0]))
        wanted[3 : 3 + WIDTH][m] = read[m]
        assert_same(out, wanted)


@pytest.mark.parametrize("index", INTS)
@pytest.mark.parametrize("dtype", ELEMENTS)
def test_gathers_and_scatters(dtype, index):
    @compiled
    def run(a, idx, m, d, wide, out, v):
        live, k = load(m, 0), load(idx, 0)
        store(wide[0], 0, gather(a, k, live, load(d, 0)))
        store(wide[1], 0, gather(a, k, live, d[0]))
        scatter(out, k, load(v, 0), live)

    a = elements(dtype, (40, 5), 10)
    a.flags.writeable = False
    d = elements(dtype, WIDTH, 11).astype(ELEMENTS[dtype])
    rng = np.random.default_rng(12)
    info = np.iinfo(index)
    for m in masks():
        idx = rng.integers(0, rng.choice([4, a.size]), WIDTH).astype(index)
        # Lanes outside the mask point where nothing is.
        idx[~m] = rng.choice([info.min, info.max, info.min // 8, info.max // 8], (~m).sum())
        out = elements(dtype, a.size, 13)
        wanted = out.copy()
        v = elements(dtype, WIDTH, 14).astype(ELEMENTS[dtype])
        wide = np.empty((2, WIDTH), ELEMENTS[dtype])
        run(a, idx, m, d, wide, out, v)
        read = a.reshape(-1)[np.where(m, idx, 0)]
        assert_same(wide[0], np.where(m, read, d))
        assert_same(wide[1], np.where(m, read, d[0]))
        for lane in np.flatnonzero(m):  # in order: the highest lane wins
            wanted[idx[lane]] = v[lane]
        assert_same(out, wanted)


@pytest.mark.parametrize("lanes", [4, 8, 16])
@pytest.mark.parametrize("dtype", FLOATS + INTS)
def test_triples(dtype, lanes):
    @compiled
    def run(a, i, n, columns, out, m):
        x, y, z = load_triples(a, i, n, lanes)
        store(columns, 0, x)
        store(columns, lanes, y)
        store(columns, 2 * lanes, z)
        store_triples(out, i, x, y, z, load(m, 0, lanes))

    a = elements(dtype, (lanes + 3, 3), 15)
    a.flags.writeable = False
    rng = np.random.default_rng(16)
    for n in (-1, 0, 1, 2, lanes // 2 + 1, lanes - 1, lanes, lanes + 1, 1 << 40):
        for i in (0, 4):
            columns = elements(dtype, 3 * lanes, 17)
            out = elements(dtype, a.size, 18)
            wanted, written = np.zeros((lanes, 3), dtype), out.copy()
            m = rng.random(lanes) < 0.7
            run(a, i, n, columns, out, m)
            read = min(max(n, 0), lanes)
            wanted[:read] = a.reshape(-1)[i : i + 3 * read].reshape(-1, 3)
            assert_same(columns.reshape(3, lanes), wanted.T)
            written[i : i + 3 * lanes].reshape(-1, 3)[m] = wanted[m]
            assert_same(out, written)


def before_a_closed_page(dtype):
    """Return an array that ends where a page begins that may not be touched."""
    page = mmap.PAGESIZE
    region = mmap.mmap(-1, 2 * page)
    libc = ctypes.CDLL(None, use_errno=True)
    start = ctypes.addressof(ctypes.c_char.from_buffer(region))
    assert libc.mprotect(ctypes.c_void_p(start + page), ctypes.c_size_t(page), 0) == 0
    a = np.frombuffer(region, dtype, page // np.dtype(dtype).itemsize)
    a[:] = elements(dtype, a.size, 15)
    return a


@pytest.mark.skipif(sys.platform != "linux", reason="pages are closed by Linux's mprotect")
@pytest.mark.parametrize("dtype", ELEMENTS)
def test_masked_lanes_do_not_touch_a_closed_page(dtype):
    # Zeros and other defaults take different instructions.
    zero = False if dtype == "bool" else 0
    one = True if dtype == "bool" else 1

    @compiled
    def run(a, i, n, out, ones):
        live = first(n)
        v = load_masked(a, i, live, zero)
        w = gather(a, iota() + i, live, zero)
        store(out, 0, v)
        store(ones, 0, load_masked(a, i, live, one))
        store_masked(a, i, v, live)
        scatter(a, iota() + i, w, live)

    a = before_a_closed_page(dtype)
    for n in range(WIDTH):
        out, ones = np.empty((2, WIDTH), ELEMENTS[dtype])
        before = a.copy()
        run(a, a.size - n, n, out, ones)
        assert_same(out[:n], a[a.size - n :].astype(out.dtype))
        assert not out[n:].any()
        assert_same(ones, np.append(out[:n], np.full(WIDTH - n, one, out.dtype)))
        assert_same(a, before)


@pytest.mark.skipif(sys.platform != "linux", reason="pages are closed by Linux's mprotect")
@pytest.mark.parametrize("dtype", FLOATS + INTS)
def test_triples_do_not_touch_a_closed_page(dtype):
    @compiled
    def run(a, i, n, out):
        x, y, z = load_triples(a, i, n)
        store(out, 0, x + y + z)
        store_triples(a, i, x, y, z, first(n))

    a = before_a_closed_page(dtype)
    for n in range(WIDTH):
        out, before = np.empty(WIDTH, dtype), a.copy()
        run(a, a.size - 3 * n, n, out)
        assert_same(out[:n], a[a.size - 3 * n :].reshape(n, 3).sum(axis=1, dtype=dtype))
        assert not out[n:].any()
        assert_same(a, before)


def test_an_empty_array_is_left_alone_by_an_empty_mask():
    @compiled
    def run(a, out):
        none = mask(False)
        store(out, 0, load_masked(a, 0, none, 3.0) + gather(a, iota(), none, 4.0))
        store_masked(a, 0, f32(1), none)
        scatter(a, iota(), f32(1), none)

    out = np.empty(WIDTH, np.float32)
    run(np.empty(0, np.float32), out)
    assert_same(out, np.full(WIDTH, 7, np.float32))


# Between lanes


@pytest.mark.parametrize("lanes", [2, WIDTH, 32])
@pytest.mark.parametrize("dtype", FLOATS + INTS)
def test_packing(dtype, lanes):
    @compiled
    def run(a, m, d, packed, spread, spread_on):
        v, live = load(a, 0, lanes), load(m, 0, lanes)
        store(packed, 0, compress(v, live))
        store(spread, 0, expand(v, live, load(d, 0, lanes)))
        store(spread_on, 0, expand(compress(v, live), live, -1))

    rng = np.random.default_rng(16)
    chosen = [np.zeros(lanes, bool), np.ones(lanes, bool)]
    chosen += [rng.random(lanes) < p for p in rng.random(200)]
    for m in chosen:
        a, d = rng.integers(1, 99, (2, lanes)).astype(dtype)
        packed, spread, spread_on = np.empty((3, lanes), dtype)
        run(a, m, d, packed, spread, spread_on)
        assert_same(packed, np.append(a[m], np.zeros(lanes - m.sum(), dtype)))
        wanted = d.copy()
        wanted[m] = a[: m.sum()]
        assert_same(spread, wanted)
        assert_same(spread_on, np.where(m, a, dtype(-1)))


class Inner(NamedTuple):
    number: object
    chosen: object


class Record(NamedTuple):
    near: object
    inner: Inner
    wide: object


@compiled
def choose_records(m, a, b, out_f, out_i, out_m, out_d):
    one = Record(load(a, 0), Inner(to_i32(load(a, 0)), load(a, 0) > 0.0), to_f64(load(a, 0)))
    two = Record(load(b, 0), Inner(to_i32(load(b, 0)), load(b, 0) > 0.0), to_f64(load(b, 0)))
    got = select_each(load(m, 0), one, two)
    store(out_f, 0, got.near)
    store(out_i, 0, got.inner.number)
    store(out_m, 0, got.inner.chosen)
    store(out_d, 0, got.wide)


@compiled
def queue_records(m, taken, a, b, memory, at, out_f, out_i, out_m, out_d):
    one = Record(load(a, 0), Inner(to_i32(load(a, 0)), load(a, 0) > 0.0), to_f64(load(a, 0)))
    two = Record(load(b, 0), Inner(to_i32(load(b, 0)), load(b, 0) > 0.0), to_f64(load(b, 0)))
    push(memory, at, one, load(m, 0))
    got = pull(memory, at, two, load(taken, 0))
    store(out_f, 0, got.near)
    store(out_i, 0, got.inner.number)
    store(out_m, 0, got.inner.chosen)
    store(out_d, 0, got.wide)
    return rows_of(one)


def outputs_of(values):
    """Return what `choose_records` and `queue_records` write for a record made of these values."""
    return values, values.astype(np.int32), values > 0, values.astype(np.float64)


def test_records_are_chosen_lane_by_lane():
    rng = np.random.default_rng(3)
    for m in masks():
        a, b = rng.normal(0, 9, (2, WIDTH)).astype(np.float32)
        found = [np.zeros(WIDTH, each.dtype) for each in outputs_of(a)]
        choose_records(m, a, b, *found)
        for got, wanted in zip(found, outputs_of(np.where(m, a, b)), strict=True):
            assert_same(got, wanted)


def test_records_wait_in_memory():
    rng = np.random.default_rng(4)
    for m in masks():
        a, b = rng.normal(0, 9, (2, WIDTH)).astype(np.float32)
        taken = rng.permutation(m)
        memory = np.full((4, 3 * WIDTH), -1, np.int64)
        found = [np.zeros(WIDTH, each.dtype) for each in outputs_of(a)]
        assert queue_records(m, taken, a, b, memory, 5, *found) == 4
        wanted = b.copy()
        wanted[taken] = a[m]
        for got, expected in zip(found, outputs_of(wanted), strict=True):
            assert_same(got, expected)
        # Rows lie apart, and nothing is written before the entry or a vector behind it.
        assert (memory[:, 5 + WIDTH :] == -1).all()
        assert (memory[3, :5] == -1).all()
        assert (memory[0].view(np.int32)[:5] == -1).all()


def test_records_that_differ_are_refused():
    @njit
    def mixed(m):
        return select_each(mask(m), (f32(1.0), i32(2)), (f32(1.0), f32(2.0)))

    @njit
    def scalars(m):
        return select_each(mask(m), (f32(1.0), 2), (f32(1.0), 2))

    for body in (mixed, scalars):
        with pytest.raises(TypingError, match="select_each"):
            body(True)


@pytest.mark.parametrize("dtype", FLOATS + INTS)
def test_reductions(dtype):
    @compiled
    def run(a, out):
        for i in range(0, a.size, WIDTH):
            v = load(a, i)
            out[0, i // WIDTH] = reduce_add(v)
            out[1, i // WIDTH] = reduce_min(v)

    a = (hard_floats if dtype in FLOATS else hard_ints)(dtype)[0].copy()
    np.random.default_rng(17).shuffle(a)
    out = np.empty((2, a.size // WIDTH), dtype)
    run(a, out)
    with np.errstate(all="ignore"):
        for got, combine in zip(out, (np.add, lambda x, y: np.where(x < y, x, y)), strict=True):
            left = a.reshape(-1, WIDTH)
            while left.shape[1] > 1:
                left = combine(*np.split(left, 2, axis=1))
            assert_same(got, left[:, 0])


@pytest.mark.parametrize("dtype", [*FLOATS, *INTS, bool])
def test_single_lanes(dtype):
    @compiled
    def run(a, k, x, out):
        v = load(a, 0)
        store(out, 0, insert(v, k, x))
        return extract(v, k)

    a = np.arange(WIDTH) % 2 == 0 if dtype is bool else np.arange(5, 5 + WIDTH).astype(dtype)
    x = True if dtype is bool else 77
    for k in (*range(WIDTH), -1, WIDTH + 1):
        out = np.empty(WIDTH, dtype)
        assert run(a, k, x, out) == a[k % WIDTH]
        wanted = a.copy()
        wanted[k % WIDTH] = x
        assert_same(out, wanted)


@pytest.mark.parametrize("dtype", [*FLOATS, *INTS])
@pytest.mark.parametrize("lanes", [2, 8, 32])
def test_interleaving_and_parts(dtype, lanes):
    @compiled
    def run(a, b, out):
        both = interleave(load(a, 0, lanes), load(b, 0, lanes))
        store(out, 0, both)
        store(out, 2 * lanes, part(both, 1, lanes))
        store(out, 3 * lanes, part(both, 0, lanes))

    a, b = np.arange(lanes).astype(dtype), np.arange(100, 100 + lanes).astype(dtype)
    out = np.empty(4 * lanes, dtype)
    run(a, b, out)
    wanted = np.stack([a, b], axis=1).reshape(-1)
    assert_same(out, np.concatenate([wanted, wanted[lanes:], wanted[:lanes]]))


# What does not compile


def refused(body, *arguments):
    with pytest.raises(TypingError) as caught:
        compiled(body)(*arguments)
    return str(caught.value)


def test_masks_are_not_conditions():
    assert "bool" in refused(lambda: 1 if mask(True) and mask(False) else 0)
    assert "bool" in refused(lambda: 1 if not mask(True) else 0)


def test_kinds_do_not_mix():
    assert "f32" in refused(lambda: any_(f32(1) < f64(2)))
    assert "i32" in refused(lambda: any_(i32(1) < 1.5))
    assert "lanes" in refused(lambda: any_(select(first(1, 2), f32(1), f32(2))))
    assert "kind mask" in refused(lambda: bits(i32(1)))


def test_arrays_that_do_not_fit_are_refused():
    a = np.zeros((4 * WIDTH, 4), np.float32)
    assert "C-contiguous" in refused(lambda a: any_(load(a, 0) < 1), a.T)
    assert "float16" in refused(lambda a: any_(load(a, 0) < 1), a.astype(np.float16))
    assert "kind f32" in refused(lambda a: store(a, 0, i32(1)), a)
    a.flags.writeable = False
    assert "writable" in refused(lambda a: store(a, 0, f32(1)), a)
    assert "writable" in refused(lambda a: scatter(a, iota(), f32(1), mask(True)), a)


def test_parts_are_constant_and_in_range():
    assert "from 0 to 1" in refused(lambda: part(f32(0, 8), 2, 4))
    assert "from 0 to 1" in refused(lambda k: part(f32(0, 8), k, 4), 1)


def test_lanes_are_a_constant_power_of_two():
    assert "constant" in refused(lambda n: bits(mask(True, n)), 4)
    assert "power of two" in refused(lambda: bits(mask(True, 12)))


# What it compiles to


def assembly(function, *arguments):
    function(*arguments)
    (text,) = function.inspect_asm().values()
    return text


@pytest.mark.skipif(not simd.AVX512, reason="needs a target with AVX-512")
def test_operations_are_single_instructions_of_whole_registers():
    @compiled
    def run(a, idx, out):
        k = load(idx, 0)
        v = gather(a, k, first(9), 0)
        v = minimum(v, load(a, 3))
        v = select(v < 1, compress(v, v < 1), expand(v, v < 2, 0))
        store(out, 0, v)
        store(idx, 0, to_i32(v))

    text = assembly(run, np.zeros(64, np.float32), np.zeros(16, np.int32), np.zeros(16, np.float32))
    for name, times in (
        ("vgatherdps", 1), ("vminps", 1), ("vcompressps", 1), ("vexpandps", 1), ("vcvttps2dq", 1),
    ):  # fmt: skip
        found = re.findall(rf"\b{name}\b.*", text)
        assert len(found) == times, name
        assert all("%zmm" in line for line in found)
    # To memory it is microcode.
    assert not re.search(r"compress\w+\s.*\(%", text)

    @compiled
    def run_wide(a, idx, out):
        store(out, 0, maximum(gather(a, load(idx, 0), mask(True), 0), 0))

    text = assembly(run_wide, np.zeros(64), np.zeros(16, np.int64), np.zeros(16))
    for name in ("vgatherqpd", "vmaxpd"):
        found = re.findall(rf"\b{name}\b.*", text)
        assert len(found) == 2, name
        assert all("%zmm" in line for line in found)


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names instructions of x86")
def test_products_and_sums_are_not_contracted():
    @compiled
    def run(a, out):
        store(out, 0, load(a, 0) * load(a, 1) + load(a, 2))

    text = assembly(run, np.zeros(2 * WIDTH, np.float32), np.zeros(WIDTH, np.float32))
    assert "mulps" in text
    assert "vfmadd" not in text


# Across functions, threads and processes

PROGRAM = """
import sys
import numpy as np
from hybrid_rt.kernels._jit import inlined, kernel, parallel_kernel
from hybrid_rt.kernels.simd import *
from hybrid_rt.kernels._queue import part  # simd has one too

@inlined
def both(x, y):
    return x + y, x < y

@kernel
def saxpy(a, x, y, out):
    for i in range(0, x.size, WIDTH):
        live = first(x.size - i)
        v, _ = both(a * load_masked(x, i, live, 0.0), load_masked(y, i, live, 0.0))
        store_masked(out, i, v, live)

@parallel_kernel
def collatz(share, start, steps):
    for chunk in part(share, (start.size + 63) // 64):
        for i in range(chunk * 64, min(start.size, chunk * 64 + 64), WIDTH):
            live = first(start.size - i)
            n = load_masked(start, i, live, 1)
            state = (n, i64(0))
            going = live & (n != 1)
            while any_(going):
                n, taken = state
                n = select((n & 1) == 0, n >> 1, 3 * n + 1)
                state = (select(going, n, state[0]), taken + select(going, i64(1), i64(0)))
                _, under = both(i64(1), state[0])
                going = going & under
            store_masked(steps, i, state[1], live)

x = np.arange(1000, dtype=np.float32) / 7
out = np.empty_like(x)
saxpy(np.float32(3), x, x[::-1].copy(), out)
assert (out == np.float32(3) * x + x[::-1]).all()
start = np.arange(1, 1001)
steps = np.empty_like(start)
collatz(start, steps)
def count(n):
    return 0 if n == 1 else 1 + count(n // 2 if n % 2 == 0 else 3 * n + 1)
assert steps.tolist() == [count(n) for n in range(1, 1001)]
hits = [sum(f.stats.cache_hits.values()) for f in (saxpy, collatz.kernel)]
print(WIDTH, *hits)
"""


@pytest.mark.slow
def test_code_cached_for_one_machine_serves_it_again_and_no_other(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)

    def run(env):
        env = env | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
        env["PYTHONPATH"] = os.pathsep.join(sys.path)
        done = subprocess.run(
            [sys.executable, str(program)], env=env, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return [int(word) for word in done.stdout.split()]

    other, width = machine("generic")
    assert run(dict(os.environ)) == [WIDTH, 0, 0]
    assert run(dict(os.environ)) == [WIDTH, 1, 1]
    if width != WIDTH:
        assert run(other) == [width, 0, 0]
        assert run(other) == [width, 1, 1]
        assert run(dict(os.environ)) == [WIDTH, 1, 1]


@pytest.mark.slow
@pytest.mark.skipif("HYBRID_RT_TEST_WIDTH" in os.environ, reason="this is the other machine")
@pytest.mark.parametrize("name", MACHINES)
def test_all_of_this_on_another_machine(name):
    env, _ = machine(name)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__],
        env=env, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    print(done.stdout)


@njit
def lowest_of(n):
    return simd.lowest(n)


@pytest.mark.parametrize("n", [1, 2, 12, 1 << 40, -1, -(2**63), 0])
def test_lowest_is_the_number_of_the_lowest_set_bit(n):
    assert lowest_of(n) == next((k for k in range(64) if n >> k & 1), 64)
