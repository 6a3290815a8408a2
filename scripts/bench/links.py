"""What an exchange of a coupled step costs by the way that its messages go: seconds, sleeps, system calls, bytes.

Both ends are processes of their own (link_ends.py). Bytes and system calls come from `strace`, which slows a process down at
each of them: a side that waits awake then looks less often. So calls that carried bytes, whose number does not depend on that,
are counted apart from all others (waiting, waking threads, looking for bytes in vain).
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from bench.link_ends import MARKS, WAYS
from bench.timing_rows import row

ENDS = Path(__file__).parent / "link_ends.py"
SIZES = (50, 100, 500, 5000)  # nodes of a rim
TRIPS = {"raw asleep": 3000, "lane": 3000}  # of a repetition; 1000 of the others
TRACED = 200  # trips under strace
LONGEST = 300  # [s] for both ends
COMPLETE = re.compile(r"^(\d+) +(\w+)\((.*)$")
RESUMED = re.compile(r"^(\d+) +<\.\.\. (\w+) resumed>(.*)$")
SOCKET = re.compile(r"^\d+<(TCP|UNIX)")
RESULT = re.compile(r"= (-?\d+)")
SENDS = ("write", "writev", "sendto", "sendmsg")
TAKES = ("read", "readv", "recvfrom", "recvmsg")
WORDS = {
    "raw awake": "raw TCP, compiled, ends look until a frame is there",
    "raw asleep": "raw TCP, compiled, ends sleep in `read`",
    "lane": "lane, compiled, as in plain steps",
    "link": "ZeroMQ, Unix socket, as in `colluvium run`",
    "gated link": "ZeroMQ, gate and TCP, as on loopback",
    "encrypted link": "ZeroMQ, gate, TCP and CURVE, as between machines",
}


class Machines:
    """Where both ends run: words before the command line of each end, and the address of the continuum."""

    def __init__(self, continuum=(), discs=(), address="127.0.0.1"):
        self.continuum, self.discs, self.address = [*continuum], [*discs], address


HERE = Machines()


def exchanges(way, sizes, count, repeats, machines=HERE, traces=None):
    """Rows of both ends, {nodes: (row of the continuum, row of the discs)}; traces: folder for traces of their system calls."""
    with tempfile.TemporaryDirectory() as folder:
        words = [way, folder, ",".join(map(str, sizes)), str(count), str(repeats)]
        continuum = _started("continuum", machines.continuum, [machines.address, *words], traces)
        try:
            offer = continuum.stdout.readline().strip()
            discs = _started("discs", machines.discs, [offer, *words], traces)
            try:
                said = [end.communicate(timeout=LONGEST)[0] for end in (continuum, discs)]
            finally:
                _end(discs)
        finally:
            _end(continuum)
    if continuum.returncode or discs.returncode:
        raise SystemExit(f"the ends of {way} ended with {continuum.returncode} and {discs.returncode}")
    both = zip(*([json.loads(line) for line in text.splitlines()] for text in said), strict=True)
    return {one["nodes"]: (one, other) for one, other in both}


def _started(side, before, words, traces):
    traced = ["strace", "-f", "-yy", "-s", "64", "-o", str(traces / side)] if traces else []
    line = [*before, *traced, sys.executable, str(ENDS), side, *words]
    return subprocess.Popen(line, stdout=subprocess.PIPE, text=True)


def _end(process):
    process.kill()
    process.wait()
    process.stdout.close()


class Calls:
    """System calls of a process: number of those that carried bytes, of all others, and bytes sent to TCP and Unix sockets."""

    def __init__(self):
        self.carried = self.others = 0
        self.sent = {"TCP": 0, "UNIX": 0}

    def count(self, name, arguments, result):
        """Counts a call; arguments: as strace writes them, with the kind of each descriptor."""
        stream = SOCKET.match(arguments)
        if stream and name in SENDS + TAKES and result > 0:
            self.carried += 1
            self.sent[stream[1]] += result * (name in SENDS)
        else:
            self.others += 1


def calls_between(lines, begin, end):
    """The Calls in a trace by `strace -f -yy` between the marks `begin` and `end`."""
    calls, under_way, inside = Calls(), {}, False
    for line in lines:
        if begin in line:
            inside = True
        elif end in line:
            break
        elif complete := COMPLETE.match(line):
            thread, name, arguments = complete.groups()
            if arguments.rstrip().endswith("<unfinished ...>"):
                under_way[thread, name] = arguments
            elif inside:
                calls.count(name, arguments, _result(arguments))
        elif (resumed := RESUMED.match(line)) and inside:
            thread, name, rest = resumed.groups()
            calls.count(name, under_way.pop((thread, name), ""), _result(rest))
    return calls


def _result(text):
    found = RESULT.findall(text)
    return int(found[-1]) if found else 0


def traced(way, sizes, count=TRACED, machines=HERE):
    """{nodes: what an exchange needs} of system calls and bytes, both ends together; {} without strace."""
    if shutil.which("strace") is None:
        return {}
    with tempfile.TemporaryDirectory() as name:
        exchanges(way, sizes, count, 1, machines, Path(name))
        texts = [
            (Path(name) / side).read_text(encoding="utf-8", errors="replace").splitlines() for side in ("continuum", "discs")
        ]
    found = {}
    for nodes in sizes:
        ends = [calls_between(text, *(mark.format(nodes) for mark in MARKS.values())) for text in texts]
        sent = {kind: sum(end.sent[kind] for end in ends) for kind in ("TCP", "UNIX")}
        found[nodes] = {
            "carrying_calls": sum(end.carried for end in ends) / count,
            "other_calls": sum(end.others for end in ends) / count,
            "bytes": (sent["TCP"] or sent["UNIX"]) / count,
        }
    return found


def seconds_of_ways(ways, sizes, repeats, machines=HERE):
    """{(way, nodes): (seconds of an exchange, sleeps of both ends)}, `repeats` of each, all ways in turns."""
    found = {(way, nodes): ([], []) for way in ways for nodes in sizes}
    for _ in range(repeats):
        for way in ways:
            for nodes, ends in exchanges(way, sizes, TRIPS.get(way, 1000), 1, machines).items():
                found[way, nodes][0].append(ends[0]["seconds"][0])
                found[way, nodes][1].append(ends[0]["sleeps"] + ends[1]["sleeps"])
    return found


def rows_of_ways(repeats, sizes=SIZES, companion=None):
    """One row for each way and size."""
    timed, rows = seconds_of_ways(WAYS, sizes, repeats), []
    for way in WAYS:
        needs = traced(way, sizes)
        for nodes in sizes:
            seconds, sleeps = timed[way, nodes]
            base = median(timed["raw awake", nodes][0])
            more = {
                "over_raw": median(seconds) / base,
                "sleeps": median(sleeps),
                "frames": frame_bytes(nodes),
                **needs.get(nodes, {}),
            }
            rows.append(row(way, {"rim_nodes": nodes}, seconds, "s", companion or {}, f"exchange; {WORDS[way]}") | more)
    return rows


def frame_bytes(nodes):
    """Bytes of a FORCE and a VELOCITY for a rim of that many nodes."""
    from coupler_protocol.wire.lanes import step_size
    from coupler_protocol.wire.messages import FORCE, VELOCITY

    return step_size(FORCE, nodes) + step_size(VELOCITY, nodes)
