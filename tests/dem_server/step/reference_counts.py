"""Counts reference counting inside loops of compiled kernels: a count in a loop made a kernel four times slower.

Code that comes from the disk cache cannot be inspected: see inspected_kernels.py.
"""

import re

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

COUNTED = re.compile(r"call void @NRT_(incref|decref)\b")
LABEL = re.compile(r'^("[^"]+"|[-\w.$]+):')
TARGET = re.compile(r'label %("[^"]+"|[-\w.$]+)')


def counts_in_loops(dispatcher):
    """Number of reference counts in blocks that can reach themselves again, over all signatures."""
    return sum(in_loops(text) for text in dispatcher.inspect_llvm().values())


def in_loops(text):
    """The same for one module in LLVM's language; wrappers for the interpreter, which count their arguments, have no loops."""
    return sum(_in_loops(body.splitlines()) for body in re.findall(r"^define [^\n]*\{\n(.*?)^\}", text, re.MULTILINE | re.DOTALL))


def _in_loops(lines):
    blocks, edges, counts = {"": 0}, [], [0]
    here = 0
    for line in lines:
        if label := LABEL.match(line):
            here = blocks.setdefault(label[1], len(blocks))
            counts += [0] * (len(blocks) - len(counts))
        elif COUNTED.search(line):
            counts[here] += 1
        for target in TARGET.findall(line) if "label %" in line else ():
            edges.append((here, blocks.setdefault(target, len(blocks))))
            counts += [0] * (len(blocks) - len(counts))
    if not edges:
        return 0
    a, b = np.array(edges).T
    number, component = connected_components(csr_array((np.ones(len(a)), (a, b)), shape=(len(blocks),) * 2), connection="strong")
    loops = np.bincount(component, minlength=number)[component] > 1
    loops[a[a == b]] = True
    return int(np.array(counts)[loops].sum())
