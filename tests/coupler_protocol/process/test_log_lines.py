"""Lines of a log say where their process is, every one of them."""

import logging
import platform
import re
from types import SimpleNamespace

from coupler_protocol.process.log_lines import PlacedFormatter
from coupler_protocol.process.progress import Progress

HEAD = re.compile(
    r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} WARNING "
    r"\[run (?P<run>\S+), rank 2, (?P<host>.+), stage (?P<stage>\S+), step (?P<step>\d+)\] "
)


def lines(progress, text):
    record = logging.LogRecord("any", logging.WARNING, __file__, 1, text, None, None)
    return PlacedFormatter(progress).format(record).split("\n")


def test_before_the_handshake_the_run_has_no_number():
    (line,) = lines(Progress(2, "none"), "what")
    found = HEAD.match(line)
    assert found.groupdict() == {"run": "-", "host": platform.node(), "stage": "start", "step": "0"}
    assert line.endswith("] what")


def test_every_line_of_a_long_text_says_where():
    progress, side = Progress(2, "none"), SimpleNamespace(steps=400, time=400.0)
    progress.follow(side)
    progress.name_run(0x3F2A9C1E77B0)
    progress.begin(SimpleNamespace(name="couple", until=None), 400)
    side.steps = 1250
    for line, end in zip(lines(progress, "first\nsecond"), ("first", "second"), strict=True):
        found = HEAD.match(line)
        assert (found["run"], found["stage"], found["step"]) == ("3f2a9c1e77b0", "couple", "1250")
        assert line[found.end() :] == end
