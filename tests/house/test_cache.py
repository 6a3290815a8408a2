"""The cache folder of a server carries a hash of every file its kernels are made of: an edit of any starts a fresh folder."""

import ast
import importlib
import importlib.util
import shutil
import types

import pytest
from numba.core.dispatcher import Dispatcher

from coupler_protocol.compiled.jit import sources
from tests.house.tree import PACKAGES, ROOT, files

COMPILERS = {"jit", "njit", "generated_jit", "vectorize", "guvectorize", "stencil", "cfunc", "intrinsic", "overload"}
SERVERS = ("fdm_server", "dem_server")


def compiling(path):
    """Calls and decorations of a file that compile something, as nodes; empty for most files."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    used = [node.func for node in nodes if isinstance(node, ast.Call)]
    used += [one for node in nodes for one in getattr(node, "decorator_list", ()) if not isinstance(one, ast.Call)]
    return [one for one in used if (one.attr if isinstance(one, ast.Attribute) else getattr(one, "id", None)) in COMPILERS]


def python_files(folders, root=ROOT):
    """Python files below folders of the tree at `root`."""
    return [path for path in files(folders, root) if path.suffix == ".py"]


def outside(root, hashed):
    """Files of the packages at `root` that compile and are in no server's hash; hashed: paths by server."""
    everywhere = set.intersection(*map(set, hashed.values()))
    for path in python_files(PACKAGES, root):
        package = path.relative_to(root).parts[0]
        if compiling(path) and path not in hashed.get(package, everywhere):
            yield path.relative_to(root).as_posix()


def copied(folder):
    """A copy of the packages in a folder, and its own `coupler_protocol.compiled.jit`."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    spec = importlib.util.spec_from_file_location("jit_of_a_copy", folder / "coupler_protocol" / "compiled" / "jit.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def folders(jit):
    """The cache folder of each server, asked anew."""
    jit.cache_folder.cache_clear()
    return {package: jit.cache_folder(package) for package in SERVERS}


def test_every_file_that_compiles_is_in_the_hash():
    assert list(outside(ROOT, {package: sources(package) for package in SERVERS})) == []


def test_an_edit_of_any_file_that_compiles_changes_the_cache_folder(tmp_path):
    jit = copied(tmp_path)
    shared = 0
    for path in (path for path in python_files(PACKAGES, tmp_path) if compiling(path) or path.parent.name == "effects"):
        package = path.relative_to(tmp_path).parts[0]
        before = folders(jit)
        path.write_text(path.read_text(encoding="utf-8") + "# edited\n", encoding="utf-8")
        after = folders(jit)
        changed = {server for server in SERVERS if before[server] != after[server]}
        assert changed == ({package} if package in SERVERS else set(SERVERS)), path
        shared += package not in SERVERS
    assert shared >= 3  # jit.py, waiting_words.py, mapping.py


def test_a_planted_file_that_compiles_is_found(tmp_path):
    jit = copied(tmp_path)
    for place in ("coupler_protocol/criteria/planted.py", "colluvium/results/planted.py", "dem_server/step/planted.py"):
        (tmp_path / place).write_text("from coupler_protocol.compiled.jit import jit\n\nf = jit(abs)\n", encoding="utf-8")
    found = outside(tmp_path, {package: jit.sources(package) for package in SERVERS})
    assert list(found) == ["coupler_protocol/criteria/planted.py", "colluvium/results/planted.py"]


def test_a_kernel_from_a_file_outside_the_hash_is_refused(tmp_path):
    jit = copied(tmp_path)
    path = tmp_path / "coupler_protocol" / "criteria" / "planted.py"
    path.write_text("def f(x):\n    return x\n", encoding="utf-8")
    spec = importlib.util.spec_from_file_location("coupler_protocol.criteria.planted", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with pytest.raises(ValueError, match=r"planted\.py holds a kernel but is not among the hashed files"):
        jit.jit(module.f, package="dem_server")


def test_kernels_of_scripts_and_tests_name_the_server_whose_hash_they_carry():
    for path in python_files(("scripts", "tests")):
        if path.is_relative_to(ROOT / "tests" / "house"):
            continue
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        calls = [node for node in nodes if isinstance(node, ast.Call) and getattr(node.func, "id", None) == "jit"]
        ours = [one for one in compiling(path) if getattr(one, "id", None) == "jit"]  # numba's own keep nothing on disk there
        assert len(calls) == len(ours), f"{path}: @jit without a package"
        for call in calls:
            named = {word.arg: getattr(word.value, "value", None) for word in call.keywords}
            assert named.get("package") in SERVERS, f"{path}:{call.lineno}"


def constants_from_outside(function, hashed):
    """Global names in a kernel that come from a module of ours outside the hash: their values are frozen into the cache."""
    path = function.__code__.co_filename
    names, codes = set(), [function.__code__]
    while codes:
        code = codes.pop()
        names |= set(code.co_names)
        codes += [one for one in code.co_consts if isinstance(one, types.CodeType)]
    with open(path, encoding="utf-8") as file:
        nodes = list(ast.walk(ast.parse(file.read())))
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.module.partition(".")[0] in PACKAGES:
            for alias in node.names:
                if (alias.asname or alias.name) in names and importlib.util.find_spec(node.module).origin not in hashed:
                    yield f"{path}: {alias.name} of {node.module}"


def kernels(server):
    """Compiled functions of a server, those compiled from files of laws too."""
    for path in python_files([server]):
        if path.name != "__main__.py":
            module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"))
            yield from (one.py_func for one in vars(module).values() if isinstance(one, Dispatcher))


@pytest.mark.parametrize("server", SERVERS)
def test_no_kernel_uses_a_constant_of_a_file_outside_the_hash(server):
    hashed = set(map(str, sources(server)))
    functions = {(f.__code__.co_filename, f.__qualname__): f for f in kernels(server)}
    assert len(functions) > 20
    assert [fault for f in functions.values() for fault in constants_from_outside(f, hashed)] == []


def test_a_planted_constant_is_found():
    from coupler_protocol.criteria import shear_band_states

    found = list(constants_from_outside(shear_band_states.holds, hashed=set()))
    assert any("COUNTED of coupler_protocol.criteria.shear_band" in fault for fault in found)
