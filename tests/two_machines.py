"""Two machines on one: network namespaces with an address, a name, a folder and keys each, and a cable between them."""

import contextlib
import os
import shlex
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

ADDRESSES = {"grid": "192.168.7.10", "discs": "192.168.7.20"}
PROGRAMS = {"fdm-server": "fdm_server", "dem-server": "dem_server", "colluvium": "colluvium.cli"}
PATIENCE = 400.0  # [s] for a command, on a busy machine


def lacking():
    """Why there can be no namespaces here, or ""."""
    if os.name != "posix" or os.geteuid() != 0 or not shutil.which("ip") or not shutil.which("unshare"):
        return "network namespaces need root, ip and unshare"
    name = f"try-{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True)
    subprocess.run(["ip", "netns", "del", name], capture_output=True)
    return "" if made.returncode == 0 else f"no network namespace can be made: {made.stderr.decode().strip()}"


class Machine:
    """One machine: its folder is the working directory of all commands."""

    def __init__(self, name, folder):
        self.name, self.folder = name, Path(folder)
        self.folder.mkdir()
        self.namespace = f"{name}-{os.getpid()}"
        self.device = f"{name[0]}{os.getpid()}"
        self.environment = os.environ | {"COLLUVIUM_KEYS": str(self.folder / ".config" / "colluvium" / "keys"), "COLUMNS": "160"}

    def words(self, line):
        """Command line of a shell line on this machine; our programs are those of this checkout."""
        program, *rest = shlex.split(line)
        ours = [sys.executable, "-m", PROGRAMS[program]] if program in PROGRAMS else [program]
        inside = f"hostname {self.name}; exec {shlex.join([*ours, *rest])}"
        return ["ip", "netns", "exec", self.namespace, "unshare", "--uts", "sh", "-c", inside]

    def run(self, line):
        """The process of a line once it has ended; standard error and output as one text."""
        return subprocess.run(
            self.words(line), cwd=self.folder, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            timeout=PATIENCE,
        )  # fmt: skip

    def start(self, line):
        """A Running of a line."""
        return Running(
            subprocess.Popen(
                self.words(line),
                cwd=self.folder,
                env=self.environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
        )

    def ip(self, line):
        """Runs `ip LINE` on this machine."""
        subprocess.run(["ip", "-n", self.namespace, *shlex.split(line)], check=True)


class Running:
    """A process in the background and what it has printed."""

    def __init__(self, process):
        self.process, self.lines = process, []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))

    def kill(self):
        """Ends the process as a machine that loses its power does."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._reader.join(10.0)

    def code(self):
        """Exit code, once it has ended."""
        found = self.process.wait(PATIENCE)
        self._reader.join(10.0)
        return found


@contextlib.contextmanager
def two_machines(folder):
    """Machines {name: Machine} with a cable between them; everything is removed at the end."""
    machines = {name: Machine(name, Path(folder) / name) for name in ADDRESSES}
    grid, discs = machines.values()
    try:
        for machine in machines.values():
            subprocess.run(["ip", "netns", "add", machine.namespace], check=True)
        pair = ["ip", "link", "add", grid.device, "type", "veth", "peer", "name", discs.device]
        subprocess.run(pair, check=True)
        for name, machine in machines.items():
            subprocess.run(["ip", "link", "set", machine.device, "netns", machine.namespace], check=True)
            for line in (
                f"addr add {ADDRESSES[name]}/24 dev {machine.device}",
                f"link set {machine.device} up",
                "link set lo up",
            ):
                machine.ip(line)
        yield machines
    finally:
        for machine in machines.values():
            subprocess.run(["ip", "netns", "del", machine.namespace], capture_output=True)


def wait_until(condition, what):
    """Waits until a condition holds."""
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until, f"waited {PATIENCE:g} s for {what}"
        time.sleep(0.1)
