"""A lane between the two threads of a run in one process on which frames are lost, doubled, delayed, cut or changed."""

import contextlib
import socket
import threading
import time

from coupler_protocol.wire.frames import HEADER
from coupler_protocol.wire.link_inproc import Hatch

CLOSE = object()
PAYLOAD_BYTES = 7  # place in the header


class Meddler:
    """Both directions of the lanes of a run; the frame number `at` of `kind` becomes what treat(frame, the one before) gives.

    treat returns a list of bytes to send, seconds to wait, and CLOSE. Use `meddler.hatch` in place of link_inproc.Hatch.
    `done`: how often frames were treated.
    """

    def __init__(self, kind, at, treat):
        self.kind, self.at, self.treat = kind, at, treat
        self.done = 0
        self._threads = []

    def hatch(self, ways):
        """A Hatch whose two ends are connected through this meddler."""
        found = Hatch(ways)
        token = found.offer["token"]
        inner, outer = socket.socketpair()
        other, ways[token] = ways[token], inner
        for source, target in ((other, outer), (outer, other)):
            thread = threading.Thread(target=self._carry, args=(source, target), daemon=True)
            thread.start()
            self._threads.append(thread)
        return found

    def join(self):
        """Waits until both ends of all lanes are closed."""
        for thread in self._threads:
            thread.join(10.0)
            assert not thread.is_alive()

    def _carry(self, source, target):
        number, last = 0, b""
        with contextlib.suppress(OSError):
            while frame := self._frame(source):
                number += HEADER.unpack_from(frame)[2] == self.kind
                treated = HEADER.unpack_from(frame)[2] == self.kind and number == self.at
                self.done += treated
                for part in self.treat(frame, last) if treated else [frame]:
                    if part is CLOSE:
                        return self._end(source, target)
                    if isinstance(part, bytes):
                        target.sendall(part)
                    else:
                        time.sleep(part)
                last = frame
        return self._end(source, target)

    def _end(self, *ends):
        for end in ends:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def _frame(self, source):
        """The next whole frame; b"" at the end."""
        head = exactly(source, HEADER.size)
        return head and head + exactly(source, HEADER.unpack(head)[PAYLOAD_BYTES])


def exactly(source, size):
    """So many bytes of a stream, or b"" if it ends before."""
    found = b""
    while len(found) < size:
        part = source.recv(size - len(found))
        if not part:
            return b""
        found += part
    return found
