"""A cluster of one node on this machine, of Debian's slurm-wlm and munge: runs a command there and prints what the cluster says.

    apt-get install slurm-wlm munge
    python scripts/one_node_slurm.py [--out DIR] [-- COMMAND ..]

Default command: a sweep of 4 points of configs/quick_slope.toml through `--cluster slurm`. Needs root. munged, slurmctld and
slurmd listen on 127.0.0.1 with free ports, keep all files in a folder of their own (DIR/slurm; a temporary one without --out),
and end with the script. The command sees SLURM_CONF and DASK_CONFIG, whose jobqueue.yaml is what docs/cluster.md explains.
"""

import argparse
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SWEEP = (
    *("sweep", str(ROOT / "configs" / "quick_slope.toml"), "--vary", "discs.soil.friction.coefficient=.3,.55", "--seeds", "2"),
    *("--of", "max_displacement", "--cluster", "slurm", "--no-pictures"),
)
PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "sinfo", "squeue")
ARRIVAL = 30.0  # [s] for the node to be idle
SLURM = """\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={daemon}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
JOBQUEUE = """\
jobqueue:
  slurm:
    cores: {cores}            # of a worker: a coupled run has two processes
    processes: 1
    memory: 2GiB
    walltime: "02:00:00"
    interface: lo             # the network between the nodes, such as ib0; here there is one node
    log-directory: {folder}/logs
    local-directory: {folder}/scratch
"""


def slurm_conf(folder, host, ports, cpus, memory):
    """Text of slurm.conf: one node with `cpus` and `memory` [MB], files in `folder`, ports (controller, daemon)."""
    controller, daemon = ports
    return SLURM.format(folder=folder, host=host, controller=controller, daemon=daemon, cpus=cpus, memory=memory)


def jobqueue_yaml(folder, cores):
    """Text of jobqueue.yaml for workers with `cores` cores."""
    return JOBQUEUE.format(folder=folder, cores=cores)


def free_ports(count):
    """Ports of 127.0.0.1 that nobody listens on."""
    with ExitStack() as stack:
        found = []
        for _ in range(count):
            one = stack.enter_context(socket.socket())
            one.bind(("127.0.0.1", 0))
            found.append(one.getsockname()[1])
        return found


def lacking():
    """Programs that are not installed."""
    return [name for name in PROGRAMS if shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin") is None]


@contextmanager
def process(name, *words, log, **more):
    """A daemon in the foreground, which ends with the block."""
    path = shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin")
    with log.open("w", encoding="utf-8") as output:
        running = subprocess.Popen([path, *map(str, words)], stdout=output, stderr=subprocess.STDOUT, **more)
    try:
        yield running
    finally:
        running.send_signal(signal.SIGTERM)
        try:
            running.wait(10.0)
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()


@contextmanager
def cluster(folder):
    """A cluster of one node with its files in `folder`; yields the environment of its commands."""
    for name in ("state", "spool", "logs", "scratch", "dask"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    folder.chmod(0o755)
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)
    cpus = len(os.sched_getaffinity(0))
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20
    conf = folder / "slurm.conf"
    conf.write_text(slurm_conf(folder, socket.gethostname(), free_ports(2), cpus, int(0.9 * memory)), encoding="utf-8")
    (folder / "dask" / "jobqueue.yaml").write_text(jobqueue_yaml(folder, cpus), encoding="utf-8")
    environment = os.environ | {"SLURM_CONF": str(conf), "DASK_CONFIG": str(folder / "dask")}
    munge = [f"--{name}={folder}/munge.{end}" for name, end in (("socket", "socket"), ("pid-file", "pid"), ("log-file", "log"))]
    munge += [f"--key-file={key}", f"--seed-file={folder}/munge.seed"]
    with ExitStack() as stack:
        stack.enter_context(process("munged", "--foreground", "--force", *munge, log=folder / "munged.out"))
        _wait(lambda: (folder / "munge.socket").exists(), "munged", folder)
        stack.enter_context(process("slurmctld", "-D", "-f", conf, log=folder / "slurmctld.out", env=environment))
        stack.enter_context(process("slurmd", "-D", "-f", conf, log=folder / "slurmd.out", env=environment))
        _wait(lambda: "idle" in said("sinfo", environment=environment, words=["-h", "-o", "%T"]), "slurmd", folder)
        yield environment


def said(name, *, environment, words=()):
    """What a command of Slurm prints; "" while it fails."""
    done = subprocess.run([name, *words], env=environment, capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else ""


def _wait(there, name, folder):
    until = time.monotonic() + ARRIVAL
    while not there():
        if time.monotonic() > until:
            raise SystemExit(f"{name} does not start: see {folder}/*.log and *.out")
        time.sleep(0.2)


def transcript(command, environment):
    """Runs a command on the cluster and prints it, the node, and the queue while it runs; returns its exit code."""
    print("$ sinfo\n" + said("sinfo", environment=environment))
    print("$ " + " ".join(Path(word).name if word == command[0] else word for word in command), flush=True)
    running = subprocess.Popen(command, env=environment)
    queue, active = "", ["-t", "R"]
    while running.poll() is None:
        time.sleep(0.5)
        if not queue and said("squeue", environment=environment, words=["-h", *active]):
            queue = said("squeue", environment=environment, words=active)
    print("\n$ squeue     (while it ran)\n" + queue)
    print("$ squeue     (after it)\n" + said("squeue", environment=environment))
    return running.returncode


def main(argv=None):
    """Runs the command on a cluster of its own; returns its exit code."""
    p = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    p.add_argument("--out", type=Path, metavar="DIR", help="folder of the sweep and of the cluster's files")
    p.add_argument("command", nargs="*", metavar="COMMAND", help="instead of the sweep")
    options = p.parse_args(argv)
    if names := lacking():
        print(f"not installed: {', '.join(names)}: apt-get install slurm-wlm munge", file=sys.stderr)
        return 3
    with tempfile.TemporaryDirectory() as scratch:
        folder = (options.out or Path(scratch)).resolve()
        own = [str(Path(sys.executable).with_name("colluvium")), *SWEEP, "--out", str(folder / "sweep")]
        with cluster(folder / "slurm") as environment:
            return transcript(options.command or own, environment)


if __name__ == "__main__":
    sys.exit(main())
