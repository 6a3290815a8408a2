"""No compiled function has more arguments than a reader can keep apart: tuples by topic carry them."""

import ast
from pathlib import Path

MOST = 16


def compiled_functions():
    """Names and numbers of arguments of all functions under @jit in dem_server."""
    for path in sorted(Path(__file__).parents[3].glob("dem_server/**/*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and any("jit" in ast.unparse(mark) for mark in node.decorator_list):
                yield f"{path.stem}.{node.name}", len(node.args.args)


def test_no_compiled_function_has_more_than_sixteen_arguments():
    found = dict(compiled_functions())
    assert {"cycle.cycle", "contact_blocks.add_parts", "pair_work.pair_losses"} <= found.keys()
    assert {name: count for name, count in found.items() if count > MOST} == {}
