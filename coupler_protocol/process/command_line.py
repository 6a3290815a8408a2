"""Common parts of the command lines of both servers: options, log file, and one exit code for each kind of end."""

import argparse
import atexit
import gc
import logging
import sys
import traceback
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupler_protocol import exits
from coupler_protocol.compiled import threads
from coupler_protocol.files.restart import Origin
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.process.log_lines import PlacedFormatter
from coupler_protocol.process.progress import Progress
from coupler_protocol.scene.named_files import paths_of

if TYPE_CHECKING:
    from coupler_protocol.process.plugin import Plugin


def common_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options of every command that computes a scene."""
    parser.add_argument("scene", metavar="SCENE", help="scene file (TOML)")
    parser.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the scene")
    process_options(parser)
    parser.add_argument("--force", action="store_true", help="remove the results in OUT and compute from the start")
    parser.add_argument(
        "--from",
        dest="origin",
        metavar="DIR@STAGE",
        type=origin,
        help="continue after the end of a stage of an earlier run; only later stages of the scene may differ",
    )


def process_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options of every command that starts processes which compute."""
    parser.add_argument("--quiet", action="store_true", help="no progress")
    parser.add_argument(
        "--checkpoint",
        metavar="SECONDS",
        type=not_negative,
        help="wall time between checkpoints inside of a stage, 0: none (default: record.checkpoint of the scene)",
    )
    parser.add_argument("--threads", metavar="N", type=positive, default=1, help="threads of each process (default 1)")


def positive(text: str) -> int:
    """Type of options for a whole number from 1; raises ArgumentTypeError."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 1")
    return int(text)


def not_negative(text: str) -> float:
    """Type of options for a number from 0; raises ArgumentTypeError."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 0")
    return value


def origin(text: str) -> Origin:
    """Type of options for an Origin; raises ArgumentTypeError."""
    try:
        return Origin.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def server_parser(name: str, description: str) -> argparse.ArgumentParser:
    """Parser of a server's command line."""
    parser = argparse.ArgumentParser(prog=name, description=description)
    common_options(parser)
    parser.add_argument("--out", metavar="DIR", required=True, help="run directory")
    parser.add_argument("--progress", choices=("plain", "json", "none"), default="plain", help="form of the progress")
    parser.add_argument("--tether", action="store_true", help="stop when standard input closes (used by the launcher)")
    parser.add_argument("--version", action="version", version=f"%(prog)s {version('colluvium')}")
    plugin_option(parser)
    return parser


def plugin_option(parser: argparse.ArgumentParser) -> None:
    """Adds the option for a plugin file of a user."""
    parser.add_argument("--plugin", metavar="FILE", help="Python file with on_step(moment) or on_stage(moment) (docs/plugins.md)")


def plugin(options: argparse.Namespace) -> "Plugin | None":
    """The Plugin of the options, or None."""
    from coupler_protocol.process.plugin import from_file

    return None if options.plugin is None else from_file(options.plugin)


def scene_file(path: str) -> str:
    """Path of a scene that the processes of a run can read, each for itself; raises SceneError for a pipe or a terminal."""
    found = Path(path).resolve() if Path(path).is_relative_to("/dev") else Path(path)  # /dev/stdin is another file in each
    if Path(path).exists() and not found.is_file() and not found.is_dir():
        why = "not a file: the processes of a run could not read it, one after the other"
        raise SceneError([Problem(path, None, "", why, "write the scene to a file")])
    return str(found)


def prepare_folder(path: str | Path, own_files: Sequence[str], force: bool, inputs: Iterable[str | Path] = ()) -> Path:
    """Makes the run directory; raises EnvironmentFailed if it contains results of this process and `force` is not given.

    With `force` these results, a report and exported frames are removed, but never one of the `inputs` of the run: then nothing
    is. Returns the path.
    """
    path = make_folder(path)
    there = [path / name for name in own_files if (path / name).exists()]
    if there and not force:
        raise exits.EnvironmentFailed(f"{path} holds results already ({there[0].name}): choose another --out or use --force")
    if force:
        doomed = [*there, *_derived(path)]
        wanted = {Path(name).resolve() for name in inputs}
        for own in doomed:
            if own.resolve() in wanted:
                why = f"{own} is an input of this run and belongs to the results in {path}, which --force would remove"
                raise exits.EnvironmentFailed(f"{why}: copy it to another folder, or choose another --out")
        try:
            for own in doomed:
                own.unlink(missing_ok=True)  # the other process of the run clears the same folder
        except OSError as error:
            raise exits.EnvironmentFailed(f"cannot write to {path}: {error}") from None
        remove_report(path)
    return path


def make_folder(path: str | Path) -> Path:
    """Makes a run directory; raises EnvironmentFailed where that is not possible."""
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise exits.EnvironmentFailed(f"cannot write to {path}: {error}") from None
    return path


def inputs_of(scene: Any, *others: str | Path | None) -> list[str | Path]:
    """Files that a run reads: those that its scene names, and `others`."""
    return [path for path in (*paths_of(scene).values(), *others) if path is not None]


def _derived(run_dir: Path) -> list[Path]:
    """Files that `colluvium report` and `colluvium export` wrote in a run directory."""
    kinds = (("report", ("*.png", "report.html")), ("export", ("*.vtu", "*.pvd", "*.csv")))
    return [path for name, patterns in kinds for pattern in patterns for path in (run_dir / name).glob(pattern)]


def remove_report(run_dir: Path) -> None:
    """Removes what `colluvium report` and `colluvium export` wrote in a run directory: it shows a run that is computed again."""
    for path in _derived(run_dir):
        path.unlink(missing_ok=True)
    for folder in (run_dir / "report", run_dir / "export"):
        with suppress(FileNotFoundError):  # the other process of the run clears the same folder
            if folder.is_dir() and not any(folder.iterdir()):
                folder.rmdir()


class _LogFile(logging.FileHandler):
    """A log that says nothing where its disk is full: whatever matters also goes to standard error."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 (a name of logging)
        if not isinstance(sys.exc_info()[1], OSError):
            super().handleError(record)


def log_to(path: str | Path, progress: Progress) -> None:
    """Writes the log of this process to a file; progress: where the process is, for every line."""
    handler = _LogFile(path, mode="a", encoding="utf-8")
    handler.setFormatter(PlacedFormatter(progress))
    root = logging.getLogger()
    root.addHandler(handler)
    root.setLevel(logging.INFO)


def show_warnings(name: str, of: str) -> None:
    """Also prints the warnings of the module `of` to standard error, under the name of this program."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter(f"{name}: %(message)s"))
    handler.setLevel(logging.WARNING)
    logging.getLogger(of).addHandler(handler)


def set_threads(count: int) -> None:
    """Sets the number of threads that share a step of this process; must be called before models are built."""
    threads.set_size(count)


def _into_log(name: str, text: str) -> None:
    """Writes an error to the log of this process; without a log, logging would print it to standard error a second time."""
    if logging.getLogger().hasHandlers():
        logging.getLogger(name).error("%s", text)


def exit_code_of(name: str, work: Callable[[], Any]) -> int:
    """Runs `work()`; returns the exit code of its end, and prints the error and whose fault it is to standard error."""
    atexit.register(gc.freeze)  # the process would look for garbage among all that numba has made, for .3 s
    try:
        work()
    except SceneError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return exits.SCENE
    except exits.RunEnded as error:
        _into_log(name, str(error))
        print(f"{name}: {error}", file=sys.stderr)
        return error.code
    except KeyboardInterrupt:
        print(f"{name}: interrupted twice, ended at once", file=sys.stderr)
        return exits.INTERRUPTED
    except OSError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return exits.ENVIRONMENT
    except Exception:
        text = traceback.format_exc()
        _into_log(name, text)
        print(f"{name}: a fault of this program, please report it\n{text}", file=sys.stderr)
        return exits.OURSELVES
    return exits.DONE
