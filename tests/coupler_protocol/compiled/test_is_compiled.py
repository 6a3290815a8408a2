"""What is known about machine code before a call: none, then in memory, then in the cache."""

import numpy as np

from coupler_protocol.compiled import cache_files
from coupler_protocol.compiled.lane import checksum, checksum_table


def test_a_kernel_is_compiled_for_the_types_it_was_called_with():
    words = np.zeros(4, dtype=np.uint32)
    checksum(checksum_table(), words, 0, 4)
    assert cache_files.is_compiled(checksum, (checksum_table(), words, 0, 4))
    assert not cache_files.is_compiled(checksum, (checksum_table(), np.zeros((2, 4, 2)), 0, 4))


def test_the_cache_is_asked_where_the_memory_has_nothing(monkeypatch):
    words = np.zeros(4, dtype=np.uint32)
    checksum(checksum_table(), words, 0, 4)
    if hasattr(checksum, "overloads"):
        monkeypatch.setattr(checksum, "overloads", {})
    assert cache_files.is_compiled(checksum, (checksum_table(), words, 0, 4))


def test_plain_functions_need_no_code():
    assert cache_files.is_compiled(len, ([],))
