"""Files of the disk cache of one kernel, written by one process at a time."""

import fcntl
from typing import Any

from numba.core.caching import IndexDataCacheFile


class LockedCacheFile(IndexDataCacheFile):
    """numba's index and data files of a function, saved under a lock.

    numba writes each file in one piece, but reads the index, takes the next free number and writes both files without a lock. If
    two processes compile one function for different arguments at the same moment, both can take the same number. From then on one
    kernel would be loaded in place of the other.
    """

    def save(self, key: Any, data: Any) -> None:
        """Adds the code `data` of the signature `key`."""
        with open(f"{self._index_path}.lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            super().save(key, data)


def is_compiled(kernel: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether `kernel` has machine code for arguments of these types, in memory or in its cache; plain functions need none."""
    if not hasattr(kernel, "overloads"):
        return True
    signature = tuple(kernel.typeof_pyval(argument) for argument in arguments)
    if signature in kernel.overloads:
        return True
    cache = kernel._cache
    file = getattr(cache, "_cache_file", None)
    return file is not None and cache._index_key(signature, kernel.targetctx.codegen()) in file._load_index()


def lock_cache(kernel: Any) -> None:
    """Makes the compiled function `kernel` save to its cache under the lock; plain functions (NUMBA_DISABLE_JIT=1) have none."""
    file = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
    if isinstance(file, IndexDataCacheFile):
        file.__class__ = LockedCacheFile
    return kernel
