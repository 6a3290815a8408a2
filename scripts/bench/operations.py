"""How many floating-point operations a function asks for, counted in its source, calls included.

Counted: + - * (flops), / (divisions), sqrt (roots), comparisons and `x if c else y` (selects). Loops over a constant count as
often as they run; `per` names the loop (by its range) whose body is the unit. Arithmetic of indices, in brackets, does not count.
"""

import ast
import inspect
import textwrap
from collections import Counter
from itertools import takewhile

KINDS = {ast.Add: "flops", ast.Sub: "flops", ast.Mult: "flops", ast.Div: "divisions"}


def operations(function, per="LANES", present=()):
    """Counter of flops, divisions, roots and selects of one pass through the loop over range(`per`).

    present: names of arguments that are effects and not None; tests of other arguments for None are taken as absent.
    """
    function = getattr(function, "py_func", function)
    tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    arguments = {a.arg for a in tree.args.args}
    return _count(tree.body, function.__globals__, per, arguments - set(present))


def _count(nodes, names, per, absent):
    found = Counter()
    for node in nodes:
        found += _one(node, names, per, absent)
    return found


def _one(node, names, per, absent):
    if isinstance(node, ast.Subscript):
        return Counter()
    if isinstance(node, ast.If) and _of_absent(node.test, absent) is not None:
        return _count(node.body if _of_absent(node.test, absent) else node.orelse, names, per, absent)
    found = Counter()
    if isinstance(node, ast.For):
        times = _times(node.iter, names, per)
        return Counter({kind: times * count for kind, count in _count(node.body, names, per, absent).items()})
    if isinstance(node, (ast.BinOp, ast.AugAssign)) and type(node.op) in KINDS:
        found[KINDS[type(node.op)]] += 1
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and not isinstance(node.operand, ast.Constant):
        found["flops"] += 1
    elif isinstance(node, (ast.Compare, ast.IfExp)):
        found["selects"] += 1
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        called = getattr(names.get(node.func.id), "py_func", names.get(node.func.id))
        if node.func.id == "sqrt":
            found["roots"] += 1
        elif inspect.isfunction(called):
            found += operations(called, per, _present(called, node.args, absent))
    return found + _count(ast.iter_child_nodes(node), names, per, absent)


def _present(called, given, absent):
    """Names of the arguments of a called function but those for which the caller gives what is absent itself."""
    plain = takewhile(lambda argument: not isinstance(argument, ast.Starred), given)
    pairs = zip(inspect.signature(called).parameters, plain, strict=False)
    missing = {name for name, argument in pairs if isinstance(argument, ast.Name) and argument.id in absent}
    return set(inspect.signature(called).parameters) - missing


def _of_absent(test, absent):
    """For `x is not None` / `x is None` of an argument: whether it holds; None for other tests."""
    if isinstance(test, ast.Compare) and isinstance(test.left, ast.Name) and isinstance(test.ops[0], (ast.Is, ast.IsNot)):
        return (test.left.id in absent) == isinstance(test.ops[0], ast.Is)
    return None


def _times(iterated, names, per):
    if isinstance(iterated, (ast.Tuple, ast.List)):
        return len(iterated.elts)
    if isinstance(iterated, ast.Call) and getattr(iterated.func, "id", "") == "range":
        length = iterated.args[-1]
        if isinstance(length, ast.Name) and length.id == per:
            return 1
        if isinstance(length, ast.Constant):
            return length.value
    return 1
