"""The peers' indexes, each with the question that it is asked and what it costs.

All times are processor times of the one thread. Some peers need so long for one question that other
programs interrupt it, and elapsed times would tell what else the machine does.
"""

from __future__ import annotations

import pickle
import time
from dataclasses import dataclass
from typing import Any, Callable, Iterator, Sequence

import faiss
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from grid import Floats

Codes = npt.NDArray[np.float32]
Winners = npt.NDArray[np.int64]

#: Neighbours of a node of HNSW (twice as many on the lowest level), and candidates while building.
HNSW_NEIGHBOURS = 32
HNSW_EF_CONSTRUCTION = 200


@dataclass(frozen=True)
class Measured:
    """What one way to find places did with all queries."""

    name: str
    winners: Winners
    #: Times of single questions [µs].
    times_us: Floats
    #: Mean time of one question when all are asked in one call [µs]: without Python between them.
    us_in_batch: float
    bytes_per_place: float
    build_s: float


def flat(codes: Codes, queries: Codes, patience_s: float) -> Measured:
    """FAISS, all vectors compared: the exact winner among these codes."""
    start = time.process_time()
    index = faiss.IndexFlatL2(codes.shape[1])
    index.add(codes)
    build_s = time.process_time() - start
    return _ask_faiss("FAISS flat", index, queries, patience_s, build_s)


def hnsw(
    codes: Codes, queries: Codes, ef_search: Sequence[int], patience_s: float
) -> Iterator[Measured]:
    """FAISS, a navigable graph: one index, asked with different numbers of candidates."""
    start = time.process_time()
    # Unit vectors: the least distance is the largest cosine.
    index = faiss.IndexHNSWFlat(codes.shape[1], HNSW_NEIGHBOURS)
    index.hnsw.efConstruction = HNSW_EF_CONSTRUCTION
    index.add(codes)
    build_s = time.process_time() - start
    for candidates in ef_search:
        index.hnsw.efSearch = candidates
        name = f"FAISS HNSW, ef {candidates}"
        yield _ask_faiss(name, index, queries, patience_s, build_s)


def tree(places: Floats, queries: Floats, patience_s: float) -> Measured:
    """scipy's k-d tree of the positions themselves: it is told what the others have to find out."""
    start = time.process_time()
    index = cKDTree(places)
    build_s = time.process_time() - start
    times_us = _times_us(lambda row: index.query(queries[row]), len(queries), patience_s)
    start = time.process_time()
    winners = index.query(queries)[1]
    us_in_batch = (time.process_time() - start) * 1e6 / len(queries)
    size = len(pickle.dumps(index, protocol=5))
    return Measured("k-d tree", winners, times_us, us_in_batch, size / len(places), build_s)


def faiss_call_us(dimensions: int) -> float:
    """What a question to FAISS costs before it looks at anything [µs]: the median time of one to an
    index of a single vector."""
    index = faiss.IndexFlatL2(dimensions)
    queries = np.zeros((1000, dimensions), np.float32)
    index.add(queries[:1])
    return float(np.median(_times_us(_single(index, queries), len(queries), 10.0)))


def tree_call_us() -> float:
    """The same of a k-d tree [µs]."""
    queries = np.zeros((1000, 3))
    index = cKDTree(queries[:1])
    return float(np.median(_times_us(lambda row: index.query(queries[row]), len(queries), 10.0)))


def _ask_faiss(
    name: str, index: Any, queries: Codes, patience_s: float, build_s: float
) -> Measured:
    times_us = _times_us(_single(index, queries), len(queries), patience_s)
    start = time.process_time()
    winners = index.search(queries, 1)[1][:, 0]
    us_in_batch = (time.process_time() - start) * 1e6 / len(queries)
    size = 0

    def count(data: bytes) -> int:
        nonlocal size
        size += len(data)
        return len(data)

    # Written to nowhere, and counted: a copy of a large index may not fit beside it.
    writer = faiss.PyCallbackIOWriter(count)  # type: ignore[attr-defined]
    faiss.write_index(index, writer)
    return Measured(name, winners, times_us, us_in_batch, size / index.ntotal, build_s)


def _single(index: Any, queries: Codes) -> Callable[[int], None]:
    """A question with one row of the queries: the C++ function, without what FAISS's own wrapper
    checks and allocates in Python."""
    distance = np.empty(1, np.float32)
    winner = np.empty(1, np.int64)
    outputs = (faiss.swig_ptr(distance), faiss.swig_ptr(winner))
    rows = [faiss.swig_ptr(query) for query in queries]

    def ask(row: int) -> None:
        index.search_c(1, rows[row], 1, *outputs)

    return ask


def _times_us(ask: Callable[[int], object], count: int, patience_s: float) -> Floats:
    """Times of single questions, one for each query, until patience ends."""
    times_ns = []
    end = time.perf_counter() + patience_s
    for row in range(count):
        start = time.thread_time_ns()
        ask(row)
        times_ns.append(time.thread_time_ns() - start)
        if time.perf_counter() > end:
            break
    return np.array(times_ns) / 1e3
