"""Parameters of all effects of the contact law in one array, and the present effects, as arguments of kernels.

Rows are the columns of the effects' tables in acting order (`ROWS`), columns the kinds of pairs. Effects that are absent leave
their rows at zero; they are not among `present`, so that no kernel reads them.
"""

from typing import NamedTuple

import numpy as np

from dem_server.effects import TABLES, Law

ROWS = tuple(f"{effect}.{column}" for effect, table in TABLES.items() for column in table._fields)


_FLAGS = [(effect, bool | None) for effect in TABLES if effect != "spring"]
Parameters = NamedTuple("Parameters", [("values", np.ndarray), ("present", np.ndarray), *_FLAGS, ("alpha", float | None)])
Parameters.__doc__ = """Law as kernels take it: two arrays in the place of one for every parameter.

values (ROWS, kinds): parameters of each kind of pair; present (r,): numbers of the rows of effects that are there. Then for each
effect but the springs True if it is there, else None; alpha: of the local damping, or None.
"""


def rows_of(effect):
    """Numbers of the rows of an effect's table, in the order of its columns."""
    return tuple(np.uint64(number) for number, name in enumerate(ROWS) if name.partition(".")[0] == effect)


def parameters_of(law: Law):
    """Parameters of a Law."""
    there = {effect: getattr(law, effect) for effect in TABLES if getattr(law, effect) is not None}
    values = np.zeros((len(ROWS), len(law.spring.normal)))
    for effect, table in there.items():
        values[list(rows_of(effect))] = table
    present = np.array([row for effect in there for row in rows_of(effect)])
    flags = {effect: True if effect in there else None for effect, _ in _FLAGS}
    return Parameters(values, present, **flags, alpha=None if law.damping is None else law.damping.local)
