"""The only place where functions are compiled.

numba's disk cache detects an edit of the file that contains a function, but not an edit of another file whose function was
compiled into it: old physics would run silently. So the cache folder of each server carries a hash of every source file that its
kernels can be made of, including laws that other distributions declare. Any edit of one of these files starts a fresh folder. A
function of the project from a file outside this set is refused.
"""

import hashlib
import os
import sys
import threading
from collections.abc import Callable
from functools import cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numba
from numba.extending import overload

from coupler_protocol.compiled.cache_files import lock_cache

_ROOT = Path(__file__).resolve().parents[2]
_KERNEL_FILES = ("jit", "waiting_words", "system_calls", "lane", "pump", "thread_crew")
_SHARED = (
    *(_ROOT / "coupler_protocol" / "compiled" / f"{name}.py" for name in _KERNEL_FILES),
    _ROOT / "coupler_protocol" / "interface" / "mapping.py",
)
SETTINGS = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_ONE_FOLDER = threading.Lock()  # numba has one cache folder at a time, and two threads may import both servers

_OURS = ("colluvium", "coupler_protocol", "dem_server", "fdm_server")
_ADDED = {"fdm_server": "material."}  # laws that other distributions may add to the kernels of a package, by their places


def sources(package: str) -> list[Path]:
    """Files that kernels of `package` are made of: all of its own, the shared kernel files, and those of added laws."""
    return [*_SHARED, *sorted((_ROOT / package).rglob("*.py")), *_added(package)]


def _added(package: str) -> list[Path]:
    """Files of laws that other distributions add: the whole package of each law, because the law may import from it."""
    points = [point for point in entry_points(group="colluvium.effects") if point.name.startswith(_ADDED.get(package, "-"))]
    found: set[Path] = set()
    for name in {point.module.partition(".")[0] for point in points} - set(_OURS):
        spec = find_spec(name)
        for folder in (spec.submodule_search_locations or ()) if spec else ():
            found |= set(Path(folder).rglob("*.py"))
        if spec and spec.origin:
            found.add(Path(spec.origin))
    return sorted(found)


@cache
def cache_folder(package: str) -> str:
    """Folder of the compiled kernels of `package` for exactly these sources and this compiler.

    It is below NUMBA_CACHE_DIR if that is set, else below the user's cache folder.
    """
    digest = hashlib.sha256(f"{numba.__version__} {sys.version_info[:3]}".encode())
    for path in sources(package):
        if path.exists():
            name = path.relative_to(_ROOT) if path.is_relative_to(_ROOT) else path.name
            digest.update(str(name).encode())
            digest.update(path.read_bytes())
    base = os.environ.get("NUMBA_CACHE_DIR") or (Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "colluvium")
    return str(Path(base) / f"{package}-{digest.hexdigest()[:16]}")


def jit(function: Callable[..., Any] | None = None, *, package: str | None = None, borrows: bool = False, **options: Any) -> Any:
    """Compiles `function` with the project's settings: cached on disk, without the interpreter lock, IEEE arithmetic.

    `error_model="numpy"` (a division by zero gives inf, no exception) lets loops vectorise; fast-math stays off so that
    results have the same bits in every run. The entry for callers in C is left out: nobody calls it, and it takes a sixth of the
    compilation. Use as `kernel = jit(plain_function)` or as a decorator. `package` names the server whose cache folder takes the
    kernel; by default the package that contains the function. `borrows`: the function makes no arrays and keeps none, so
    references need not be counted; in loops over short blocks the counting costs more than the work.
    """
    if function is None:
        return lambda f: jit(f, package=package, borrows=borrows, **options)
    package = package or function.__module__.partition(".")[0]
    path = Path(function.__code__.co_filename).resolve()
    if path.is_relative_to(_ROOT / "coupler_protocol") and path not in _SHARED:
        raise ValueError(f"{path.name} holds a kernel but is not among the hashed files of coupler_protocol/compiled/jit.py")
    if borrows:
        options["_nrt"] = False
    with _ONE_FOLDER:
        numba.config.CACHE_DIR = cache_folder(package)  # type: ignore[attr-defined]  # set when numba is imported
        return lock_cache(numba.njit(**{**SETTINGS, **options})(function))


def by_type(stand_in: Callable[..., Any]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Gives the plain function `stand_in` a compiled form that depends on the types of its arguments.

    Used as a decorator of a function that gets these types (numba's) and returns the function to be compiled in place of
    `stand_in`. With NUMBA_DISABLE_JIT=1 `stand_in` itself runs. The compiled function becomes part of the kernel that calls it
    and is cached with that kernel, so it must be in a file of `sources`.
    """
    return overload(stand_in, jit_options={"error_model": "numpy"})
