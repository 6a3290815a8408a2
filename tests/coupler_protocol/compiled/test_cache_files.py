"""Two processes that save different code of one function at the same moment both find their own again."""

import contextlib
import os
import threading

import pytest
from numba.core.caching import IndexDataCacheFile

from coupler_protocol.compiled.cache_files import LockedCacheFile, lock_cache
from dem_server.step import contact_blocks


def saved_at_once(kind, folder):
    """What two savers find under their keys, each of which waits for the other between reading the index and writing it."""
    meeting = threading.Barrier(2, timeout=0.5)

    class Waiting(kind):
        def _save_index(self, overloads):
            with contextlib.suppress(threading.BrokenBarrierError):
                meeting.wait()
            super()._save_index(overloads)

    files = [Waiting(str(folder), "kernel", "stamp") for _ in range(2)]
    savers = [threading.Thread(target=file.save, args=(key, f"code of {key}")) for file, key in zip(files, "ab", strict=True)]
    for saver in savers:
        saver.start()
    for saver in savers:
        saver.join()
    return [files[0].load(key) for key in "ab"]


def test_each_finds_its_own_code(tmp_path):
    assert saved_at_once(LockedCacheFile, tmp_path) == ["code of a", "code of b"]


def test_without_the_lock_one_is_lost_or_taken_for_the_other(tmp_path):
    assert saved_at_once(IndexDataCacheFile, tmp_path) != ["code of a", "code of b"]


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled")
def test_every_kernel_saves_under_the_lock():
    assert isinstance(contact_blocks.add_parts._cache._cache_file, LockedCacheFile)


def test_plain_functions_stay_plain():
    assert lock_cache(len) is len
