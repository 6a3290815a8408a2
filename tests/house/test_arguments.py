"""No compiled function has more arguments than a reader can keep apart: tuples by topic carry them."""

import ast
import importlib

import pytest
from numba.core.dispatcher import Dispatcher

from tests.house.tree import PACKAGES, ROOT, files

MOST = 16
MARKS = ("jit", "by_type", "intrinsic")  # decorators of functions that are compiled, or that a compiled form takes the place of


def compiled_functions(folders, root=ROOT):
    """Name and number of arguments of every function under a decorator that compiles, those inside functions too."""
    for path in (path for path in files(folders, root) if path.suffix == ".py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and any(map(compiles, node.decorator_list)):
                yield f"{path.relative_to(root).as_posix()}: {node.name}", arguments(node)


def compiles(mark):
    """Whether a decorator compiles: `jit`, `jit(...)`, `njit`, `numba.njit(...)`, ..."""
    function = mark.func if isinstance(mark, ast.Call) else mark
    name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    return any(name.endswith(one) for one in MARKS)


def arguments(node):
    """Number of arguments of a function, those by keyword too."""
    a = node.args
    return len(a.posonlyargs) + len(a.args) + len(a.kwonlyargs) + (a.vararg is not None) + (a.kwarg is not None)


def called_compilers(package):
    """Name and number of arguments of the functions of a package that `jit(function)` compiled: laws, from their own files."""
    for path in (path for path in files([package]) if path.suffix == ".py" and path.name != "__main__.py"):
        module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"))
        for one in vars(module).values():
            if isinstance(one, Dispatcher):
                code = one.py_func.__code__
                yield f"{one.py_func.__module__}: {one.py_func.__qualname__}", code.co_argcount + code.co_kwonlyargcount


def too_many(found):
    """Those of {name: number of arguments} beyond the limit."""
    return {name: count for name, count in found.items() if count > MOST}


def test_no_compiled_function_has_more_than_sixteen_arguments():
    found = dict(compiled_functions([*PACKAGES, "scripts"]))
    for known in (
        "coupler_protocol/interface/mapping.py: forces_to_nodes",
        "dem_server/step/cycle.py: cycle",
        "fdm_server/step/zone_pass.py: zones_kernel",
        "scripts/bench/scalar_disc.py: step_of_discs",
    ):
        assert known in found
    assert too_many(found) == {}


@pytest.mark.parametrize("server", ["fdm_server", "dem_server"])
def test_no_law_that_is_compiled_from_its_file_has_more(server):
    found = dict(called_compilers(server))
    assert any(".effects." in name for name in found)
    assert too_many(found) == {}


@pytest.mark.parametrize(
    "head",
    [
        "@jit\ndef planted({}):",
        "@jit(package='dem_server', borrows=True)\ndef planted({}):",
        "def outer():\n    @numba.njit\n    def planted({}):",
        "@by_type(stand_in)\ndef planted(*, {}):",
    ],
)
@pytest.mark.parametrize("count", [MOST, MOST + 1])
def test_a_planted_function_is_found(tmp_path, head, count):
    path = tmp_path / "scripts" / "bench" / "planted.py"
    path.parent.mkdir(parents=True)
    path.write_text(head.format(", ".join(f"a{i}" for i in range(count))) + " pass\n", encoding="utf-8")
    assert list(compiled_functions(["scripts"], tmp_path)) == [("scripts/bench/planted.py: planted", count)]
    assert len(too_many(dict(compiled_functions(["scripts"], tmp_path)))) == count - MOST
