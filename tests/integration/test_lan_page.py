"""docs/lan.md: its commands run on two machines (network namespaces) as they are printed, and print what the page says.

A line of the page is found again if it is equal apart from numbers and times; `...` stands for the rest of a line, or for any
lines. Comments of the page between the blocks say what happens beside the commands.
"""

import re
import shutil
import time
from pathlib import Path

import pytest

from tests.two_machines import lacking, two_machines, wait_until

PAGE = Path(__file__).parents[2] / "docs" / "lan.md"
PARTS = re.compile(r"^<!-- (?P<order>.*?) -->$|^```(?P<kind>\w*)\n(?P<block>.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"\b[0-9a-f]{12}\b|[-+]?\d[\d.,:]*(?:e[-+]?\d+)?")
MOCKED = """
import importlib.metadata, time
real_version, real_time = importlib.metadata.version, time.time
importlib.metadata.version = lambda name: {version!r} or real_version(name) if name == "colluvium" else real_version(name)
time.time = lambda: real_time() + {seconds}
"""


def normal(line):
    """A line without its numbers."""
    return " ".join(NUMBER.sub("#", line).split())


def same(expected, line):
    """Whether a line is that of the page."""
    head, dots, _ = expected.partition("...")
    return normal(line).startswith(normal(head)) if dots else normal(line) == normal(expected)


def missing(expected, lines):
    """The first line of the page that does not follow in the lines; or None. Lines without `...` between are neighbours."""
    at, loose = 0, False
    for wanted in expected:
        if wanted == "...":
            loose = True
            continue
        found = next((n for n in range(at, len(lines)) if same(wanted, lines[n])), None)
        if found is None or (found > at and not loose):
            return wanted
        at, loose = found + 1, False
    return None


def test_lines_are_compared_apart_from_numbers():
    assert missing(["step 5 of 7", "...", "done 0.5 s"], ["step 12 of 9", "other", "done 3e-5 s"]) is None
    assert missing(["step 5", "done"], ["step 5", "other", "done"]) == "done"
    assert missing(["run 3f2a9c1e77b0: a ..."], ["run 0c51d07be9a1: a slope"]) is None
    assert missing(["a dog"], ["a cat"]) == "a dog"


def commands(block):
    """(machine, line, printed lines) of the commands of a block."""
    found = []
    for line in block.splitlines():
        if prompt := re.match(r"(grid|discs)\$ (.*)", line):
            found.append((prompt[1], prompt[2], []))
        else:
            found[-1][2].append(line)
    return found


class Reader:
    """Reads the page and does what it says on two machines."""

    def __init__(self, machines):
        self.machines, self.running = machines, {}
        self.code, self.next_start, self.seen = 0, "", 0

    def order(self, word, *rest):
        """An order in a comment."""
        getattr(self, f"order_{word}")(*rest)

    def order_copy(self, source, target):
        source, target = (self.machines[path.split("/")[0]].folder / path.partition("/")[2] for path in (source, target))
        (shutil.copytree if source.is_dir() else shutil.copy2)(source, target)

    def order_start(self, name):
        self.next_start = name

    def order_exit(self, code):
        self.code = int(code)

    def order_kill(self, name):
        machine = self.machines["grid" if name == "fdm" else "discs"]
        self.running.pop(name).kill()
        assert list((machine.folder / machine.name).glob("*.lock")), "a machine that loses its power leaves its lock"

    def order_end(self, name, code):
        assert self.running[name].code() == int(code), "\n".join(self.running[name].lines)

    def order_waits(self, name):
        wait_until(
            lambda: '"state": "waiting"' in (self.machines["grid"].folder / "grid" / f"{name}.rank0.now.json").read_text(), name
        )

    def order_until(self, stage):
        for name in self.running:
            wait_until(lambda name=name: self.steps_of(name, stage) >= 3, f"steps of {stage} on both sides")
        for machine in self.machines.values():
            folder = machine.folder / machine.name
            wait_until(lambda folder=folder: list(folder.glob(f"*.{stage}@*.h5")), f"a checkpoint inside of {stage}")
        time.sleep(2.5)  # one status more

    def steps_of(self, name, stage):
        return sum(f" {stage} " in line and "ratio" in line for line in self.running[name].lines)

    def order_ip(self, machine, *words):
        found = self.machines[machine]
        found.ip(" ".join(words).replace("GRID", found.device))

    def order_version(self, machine, version=""):
        self.mock(machine, version, 0)

    def order_clock(self, machine, seconds):
        self.mock(machine, "", int(seconds))

    def mock(self, machine, version, seconds):
        """Gives the Python of a machine another version of colluvium, or another time."""
        found = self.machines[machine]
        folder = found.folder / "mocked"
        folder.mkdir(exist_ok=True)
        (folder / "sitecustomize.py").write_text(MOCKED.format(version=version, seconds=seconds))
        found.environment["PYTHONPATH"] = str(folder)

    def order_printed(self, name):
        self.next_start = f"printed {name}"

    def block(self, kind, text):
        """A block of the page."""
        name, self.next_start = self.next_start, ""
        if name.startswith("printed "):
            for line in text.splitlines():
                wait_until(lambda line=line: any(same(line, other) for other in self.running[name.split()[1]].lines), line)
        elif kind == "console" and name:
            ((machine, line, printed),) = commands(text)
            self.running[name] = running = self.machines[machine].start(line)
            wait_until(lambda: missing(printed, running.lines) is None or running.process.poll() is not None, line)
            assert missing(printed, running.lines) is None, "\n".join(running.lines)
        elif kind == "console":
            for machine, line, printed in commands(text):
                done = self.machines[machine].run(line)
                folder = f"{self.machines[machine].folder}/"
                lines = [told.replace(folder, "").rstrip() for told in done.stdout.splitlines()]
                assert done.returncode == self.code, f"{line}\n{done.stdout}"
                assert missing(printed, lines) is None, f"{line}\n{missing(printed, lines)}\n" + "\n".join(lines)
                assert "Traceback" not in done.stdout
            self.code = 0


@pytest.mark.trial
@pytest.mark.long
def test_every_command_of_the_page_prints_what_the_page_says(tmp_path):
    if why := lacking():
        pytest.skip(why)
    with two_machines(tmp_path) as machines:
        reader = Reader(machines)
        try:
            for part in PARTS.finditer(PAGE.read_text(encoding="utf-8")):
                if part["order"]:
                    reader.order(*part["order"].split())
                else:
                    reader.block(part["kind"], part["block"])
        finally:
            for running in reader.running.values():
                running.kill()
    grid, discs = (machines[name].folder for name in ("grid", "discs"))
    secrets = [re.findall(r'(?:secret|gate) = "(.*)"', path.read_text()) for path in discs.glob("*.key")]
    told = "".join(path.read_text() for folder in (grid, discs) for path in folder.rglob("*.log"))
    assert len(secrets) == 3
    assert not [value for values in secrets for value in values if value in told]
