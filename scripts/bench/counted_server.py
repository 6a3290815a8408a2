"""One server of a run under callgrind, which counts the instructions of each of its stages that is named `counted ...`.

    valgrind --tool=callgrind --instr-atstart=no python scripts/bench/counted_server.py fdm_server|dem_server WORDS

WORDS: of the server. scripts/count_instructions.py starts this, also with the interpreter of an older tree, so this file imports
only what is in both. Waiting sides sleep at once: how often a side looks while it waits depends on the speed of the other one.
Compiled calls of many steps have no limit in time, which would divide them into more calls the slower this is.
"""

import contextlib
import ctypes
import importlib
import mmap
import platform
import sys

COUNTED = "counted"  # how the names of counted stages begin
DUMP_AT, START, STOP = (0x43540000 + n for n in (3, 4, 5))  # valgrind/callgrind.h: ('C' << 24 | 'T' << 16) + n
# valgrind/valgrind.h, amd64: rax has the address of six words (request, five arguments), rdx the answer without valgrind. The
# processor itself turns rdi once around and exchanges rbx with itself: nothing happens.
REQUEST = bytes.fromhex("4889f8 31d2 48c1c703 48c1c70d 48c1c73d 48c1c733 4887db 4889d0 c3")
FOREVER = 1 << 60  # frames, or [ns]
WATCHES = ("process.trace", "timing")  # modules of coupler_protocol, of this tree and of 6c21ebf
LINKS = ("wire.link_tcp", "link")


def first_of(names):
    """The first module of `names` in coupler_protocol that the tree has."""
    for name in names:
        with contextlib.suppress(ModuleNotFoundError):
            return importlib.import_module(f"coupler_protocol.{name}")
    raise SystemExit(f"the tree has none of {', '.join(names)}: it is older than 6c21ebf or newer than this script")


def asker():
    """Function (request, text) that asks valgrind for something; without valgrind, it does nothing."""
    if platform.machine() not in ("x86_64", "AMD64"):
        raise SystemExit(f"requests to valgrind are written for x86-64, this machine is {platform.machine()}")
    page = mmap.mmap(-1, mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)
    page.write(REQUEST)
    code = ctypes.c_char.from_buffer(page)  # keeps the page
    call = ctypes.CFUNCTYPE(ctypes.c_uint64, ctypes.c_void_p)(ctypes.addressof(code))

    def ask(request, text=None, code=code):
        address = ctypes.cast(ctypes.c_char_p(text), ctypes.c_void_p).value if text else 0
        return call((ctypes.c_uint64 * 6)(request, address, 0, 0, 0, 0))

    return ask


def count_stages(ask):
    """Counts from the start of a stage with such a name to the start of the next stage."""
    watch = first_of(WATCHES).Stopwatch
    begin = watch.begin

    def begin_and_count(self, name):
        if self.stages and self.stages[-1].name.startswith(COUNTED):
            ask(DUMP_AT, self.stages[-1].name.encode())  # also sets the counts to zero
            ask(STOP)
        begin(self, name)
        if name.startswith(COUNTED):
            ask(START)

    watch.begin = begin_and_count


def wait_asleep():
    """Lets both links and lanes wait in the kernel at once, and compiled calls last as long as they have steps."""
    first_of(LINKS).AWAKE = 0.0
    with contextlib.suppress(ModuleNotFoundError):  # no lanes in 6c21ebf
        of_lanes = importlib.import_module("coupler_protocol.wire.lanes")
        of_lanes.LONGEST, lanes = FOREVER, of_lanes.Lanes
        make = lanes.__init__

        def make_patient(self, *words):
            make(self, *words)
            self.wire.shared[0] = FOREVER

        lanes.__init__ = make_patient


def main():
    """Entry point; returns the exit code of the server."""
    server, *words = sys.argv[1:]
    sys.path.pop(0)  # the folder of this script
    wait_asleep()
    count_stages(asker())
    return importlib.import_module(f"{server}.__main__").main(words)


if __name__ == "__main__":
    sys.exit(main())
