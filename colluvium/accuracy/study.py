"""Settings of a study as runs in folders named by the hash of their scene, each computed once.

Settings computed beside each other give values; seconds count only where nothing else computed, with kernels from the cache. A
setting is computed once more, alone, where that was not so: its value must then be the same.
"""

import contextlib
import json
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from colluvium.accuracy import measured
from colluvium.accuracy.knobs import Setting
from colluvium.accuracy.quantity import Quantity, value_of
from colluvium.forecast.factor_of_safety import zone_size_of
from colluvium.running import processes, searches
from coupler_protocol import exits
from coupler_protocol.files import run_json
from coupler_protocol.problems import SceneError
from coupler_protocol.scene.reader import read_scene
from coupler_protocol.scene.stage_kinds import number_of

RESULTS = "results.json"
SIDES = ("continuum", "waiting", "recording")
DISCS = ("discrete", "waiting_discrete", "recording_discrete")


@dataclass(frozen=True)
class Result:
    """What a setting gave: its value with the half width of what is known of it, steps and seconds; or why it failed.

    seconds: of the stages or of the search, without start and compilation; None until it was measured alone.
    """

    name: str
    values: dict[str, Any]
    value: float | None = None
    half_width: float = 0.0
    steps: int = 0
    seconds: float | None = None
    failed: str = ""


class Study:
    """Settings of the scene at `path` with overrides `given`, computed into `out`."""

    def __init__(self, path: str, given: list[str], quantity: Quantity, out: Path, report: Callable[[str], None]) -> None:
        self.path, self.given, self.quantity, self.out, self.report = path, given, quantity, out, report
        self.stop = threading.Event()

    def compute(self, settings: list[Setting], at_once: int) -> list[Result]:
        """Results of settings, in their order; raises Interrupted after Ctrl-C, when all processes have ended."""
        pool = ThreadPoolExecutor(at_once)
        tasks = [pool.submit(self.result, setting, at_once == 1) for setting in settings]
        try:
            found = [task.result() for task in tasks]
        except KeyboardInterrupt:
            self.stop.set()
            raise exits.Interrupted("interrupted: the same command continues") from None
        finally:
            if not all(task.done() for task in tasks):
                self.stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
        return [self._timed(setting, one) for setting, one in zip(settings, found, strict=True)]

    def result(self, setting: Setting, alone: bool) -> Result:
        """The result of a setting, from its folder if it was computed before."""
        try:
            scene = read_scene(self.path, [*self.given, *setting.changes])
        except SceneError as error:
            return Result(setting.name, setting.values, failed=f"no scene: {error.problems[0]}")
        folder = self.folder(scene)
        kept = _kept(folder)
        if self.quantity.text in kept:
            return Result(**{**kept[self.quantity.text], "name": setting.name, "values": setting.values})
        known = [one["seconds"] for one in kept.values() if one["seconds"] is not None]
        found = self._computed(setting, scene, folder)
        if known:  # another quantity of the same run
            found = replace(found, seconds=known[0])
        elif not alone or _compiled(folder):
            found = replace(found, seconds=None)
        self._keep(folder, found)
        self.report(_line(found))
        return found

    def folder(self, scene: Any) -> Path:
        """Folder of a setting: of its scene, and of the quantity if that needs another computation than a run."""
        kind = "fos" if self.quantity.is_factor else "run"
        return self.out / "settings" / f"{kind}-{scene.digest()[:16]}"

    def _timed(self, setting: Setting, found: Result) -> Result:
        """A result with the seconds that it takes alone."""
        if found.failed or found.seconds is not None:
            return found
        scene = read_scene(self.path, [*self.given, *setting.changes])
        folder = self.folder(scene)
        again = self._computed(setting, scene, folder / "alone")
        if again.value != found.value:
            found = replace(found, failed=f"not repeatable: {found.value!r}, then {again.failed or repr(again.value)}")
        else:
            found = replace(found, seconds=again.seconds)
        self._keep(folder, found)
        self.report(f"alone: {_line(found)}")
        return found

    def _computed(self, setting: Setting, scene: Any, folder: Path) -> Result:
        """Runs a setting in a folder and reads the quantity."""
        plain = Result(setting.name, setting.values)
        if not _is_done(folder, scene, self.quantity.is_factor):
            code = self._run(scene, folder)
            if code == exits.INTERRUPTED:
                raise exits.Interrupted("interrupted: the same command continues")
            if code != exits.DONE and not (code == exits.PHYSICS and self.quantity.name == measured.FAILURE):
                return replace(plain, failed=f"exit code {code}: {exits.MEANING.get(code, '?')}")
        try:
            value, half_width = value_of(self.quantity, folder)
        except LookupError as error:
            return replace(plain, failed=str(error))
        return replace(plain, value=value, half_width=half_width, **_cost(folder, self.quantity.is_factor))

    def _run(self, scene: Any, folder: Path) -> int:
        """Computes a scene into a folder; returns the exit code."""
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "setting.toml"
        path.write_text(processes.as_toml(scene.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
        if self.quantity.is_factor:
            if number_of(scene.stage, couples=True) is not None:  # goes on with a search that was interrupted
                return searches.run(path, folder, self.stop.is_set)
            words: list[str | Path] = ["fdm_server.fos", path, "--out", folder, "--force"]
            words.append(f"--set=fos.zone_sizes=[{zone_size_of(scene.grid)}]")
            return processes.run_alone("fdm_server.fos", words, asked=self.stop.is_set)
        options = ["--quiet"] if _hash(folder) == scene.digest() else ["--quiet", "--force"]
        return processes.run_files(path, folder, processes.windows_of(scene), options, asked=self.stop.is_set)

    def _keep(self, folder: Path, found: Result) -> None:
        """Stores a result beside those of other quantities of the same run."""
        if folder.is_dir():
            text = json.dumps(_kept(folder) | {self.quantity.text: asdict(found)}, indent=1)
            (folder / RESULTS).write_text(text + "\n", encoding="utf-8")


def _kept(folder: Path) -> dict[str, Any]:
    """Results of a folder by their quantity."""
    with contextlib.suppress(OSError, ValueError):
        return dict(json.loads((folder / RESULTS).read_text(encoding="utf-8")))
    return {}


def _hash(folder: Path) -> str:
    """Hash of the scene of the run in a folder, "" where there is none."""
    with contextlib.suppress(OSError, ValueError, exits.RunEnded):
        return str(run_json.read(folder / run_json.NAME).get("scene_hash"))
    return ""


def _is_done(folder: Path, scene: Any, is_factor: bool) -> bool:
    """Whether a folder has the finished run of a scene, or its search (whose file is written at its end)."""
    if is_factor:
        return (folder / "fos.json").exists()
    with contextlib.suppress(OSError, ValueError, exits.RunEnded):
        info = run_json.read(folder / run_json.NAME)
        return bool(info.get("scene_hash") == scene.digest() and info.get("exit_code") == exits.DONE)
    return False


def _cost(folder: Path, is_factor: bool) -> dict[str, Any]:
    """Steps and seconds of a finished computation."""
    if is_factor:
        found = run_json.read_search(folder / "fos.json")
        parts = [found["meshes"][0], *([found["coupled"]] if "coupled" in found else [])]
        steps = sum(int(trial.get("steps", 0)) for part in parts for trial in part["trials"])
        return {"steps": steps, "seconds": sum(float(part["seconds"]) for part in parts)}
    stages = run_json.read(folder / run_json.NAME)["stages"]
    seconds = [max(sum(stage["seconds"][key] for key in keys) for keys in (SIDES, DISCS)) for stage in stages]
    return {"steps": sum(stage["steps"] for stage in stages), "seconds": float(sum(seconds))}


def _compiled(folder: Path) -> bool:
    """Whether kernels were compiled in a run."""
    with contextlib.suppress(OSError, ValueError, exits.RunEnded):
        info = run_json.read(folder / run_json.NAME)
        return any(part.get("compiled") for part in (info, *info.get("windows", [])))
    return False


def _line(found: Result) -> str:
    seconds = "" if found.seconds is None else f", {found.seconds:.3g} s"
    return f"{found.name}: {found.failed or f'{found.value:.6g}{seconds}'}"
