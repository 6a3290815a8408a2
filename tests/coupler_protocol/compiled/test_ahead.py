"""Kernels compiled before their first call, and the note of what was compiled."""

import contextlib
import os
import threading

import numpy as np
import pytest

from coupler_protocol.compiled import ahead, jit
from coupler_protocol.compiled.lane import checksum, checksum_table

interpreted = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled")


def kernel():
    """A function that no cache has."""

    def total(values):
        found = 0.0
        for value in values:
            found += value
        return found

    return jit.numba.njit(total)


@interpreted
def test_a_call_finds_what_was_compiled_for_its_types():
    texts, total = [], kernel()
    with ahead.watched(texts.append) as compiled:
        ahead.compile_for(total, (np.zeros(3),))
        assert texts == ["compiling total"]
        assert total(np.ones(4)) == 4.0
    assert texts == ["compiling total"]
    assert compiled.report()["compiled"]["functions"] == 1
    (row,) = compiled.report()["compiled"]["most_expensive"]
    assert row["function"].endswith("kernel.<locals>.total")
    assert row["specialisations"] == 1
    assert row["seconds"] > 0.0


@interpreted
def test_every_type_is_a_specialisation_and_other_threads_do_not_count():
    total, other = kernel(), kernel()
    with ahead.watched(lambda text: None) as compiled:
        total(np.ones(2))
        total(np.ones(2, dtype=np.int64))
        beside = threading.Thread(target=other, args=(np.ones(2),))
        beside.start()
        beside.join()
    assert compiled.report()["compiled"]["most_expensive"][0]["specialisations"] == 2
    total(np.ones(2, dtype=np.float32))  # nobody watches any more
    assert compiled.report()["compiled"]["most_expensive"][0]["specialisations"] == 2


def test_what_the_cache_has_is_not_reported():
    words = np.zeros(4, dtype=np.uint32)
    checksum(checksum_table(), words, 0, 4)
    with ahead.watched(lambda text: None) as compiled:
        checksum(checksum_table(), words, 0, 4)
    assert compiled.report() == {}


def test_plain_functions_need_nothing():
    ahead.compile_for(len, ([],))


@interpreted
def test_two_threads_give_their_kernels_each_to_its_own_folder(monkeypatch):
    """In one process both servers are imported at the same time, and numba has one folder for all."""
    both, seen = threading.Barrier(2, timeout=0.2), {}

    def njit(**settings):
        def made(function):
            with contextlib.suppress(threading.BrokenBarrierError):  # as it should be: the other thread is kept out
                both.wait()
            seen[function.__name__] = jit.numba.config.CACHE_DIR
            return function

        return made

    def of_grid():
        pass

    def of_discs():
        pass

    monkeypatch.setattr(jit.numba, "njit", njit)
    threads = [
        threading.Thread(target=jit.jit, args=(function,), kwargs={"package": package})
        for function, package in ((of_grid, "fdm_server"), (of_discs, "dem_server"))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert seen == {"of_grid": jit.cache_folder("fdm_server"), "of_discs": jit.cache_folder("dem_server")}
