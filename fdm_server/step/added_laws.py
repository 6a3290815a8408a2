"""Kernels of laws that other distributions add (effects/added_laws.py). A step without such a law contains none of them.

Each law has a separate type, that of its Parameters. In a compiled step `corrected` is chosen by this type at compilation; in an
uncompiled step it is chosen by the same class at run time.
"""

from coupler_protocol.compiled.jit import by_type, jit
from fdm_server.effects.added_laws import histories, module_of
from fdm_server.step.blocks import LANES
from fdm_server.step.strain import T0, T1, T2, T3
from fdm_server.step.stress import SD, SM, XY, ZZ


def _values(law, m, i):
    """Parameters of the material of lane i, whose row is m, as a tuple of numbers."""
    return tuple(values[m, i] for values in law)


@by_type(_values)
def _compiled_values(law, m, i):
    if len(law) == 1:
        return lambda law, m, i: (law[0][m, i],)
    return lambda law, m, i: (law[0][m, i], *_values(law[1:], m, i))


def _corrected(law, memory, b, m, i, sm, zz, sd, xy):
    """Stresses [Pa] of a triangle of zone i in block b after the law, and the change of the zone's memory."""
    corrected, p = module_of(type(law)).corrected, type(law)(*_values(law, m, i))
    if memory is None:
        return *corrected(sm, zz, sd, xy, p), 0.0
    *stress, after = corrected(sm, zz, sd, xy, memory[b, i], p)
    return *stress, after - memory[b, i]


@by_type(_corrected)
def _compiled_corrected(law, memory, b, m, i, sm, zz, sd, xy):
    parameters = law.instance_class
    corrected = jit(module_of(parameters).corrected, package="fdm_server", forceinline=True)

    def without_memory(law, memory, b, m, i, sm, zz, sd, xy):
        sm, zz, sd, xy = corrected(sm, zz, sd, xy, parameters(*_values(law, m, i)))
        return sm, zz, sd, xy, 0.0

    def with_memory(law, memory, b, m, i, sm, zz, sd, xy):
        sm, zz, sd, xy, after = corrected(sm, zz, sd, xy, memory[b, i], parameters(*_values(law, m, i)))
        return sm, zz, sd, xy, after - memory[b, i]

    return with_memory if histories(parameters) else without_memory


@jit
def correct(b, m, share, law, memory, stress, k):
    """Corrects stresses of block b, and `memory` (B, 16) of its zones, by one law, whose parameters are in row m.

    sm, zz and memory belong to the zone: the changes of its triangles are averaged by area, `share` in row k.
    """
    for i in range(LANES):
        sm, zz = stress[b, SM + i], stress[b, ZZ + i]
        change_sm = change_zz = change = 0.0
        for o in (T0, T1, T2, T3):
            new_sm, new_zz, sd, xy, grown = _corrected(law, memory, b, m, i, sm, zz, stress[b, SD + o + i], stress[b, XY + o + i])
            stress[b, SD + o + i], stress[b, XY + o + i] = sd, xy
            weight = 0.5 * share[k, o + i]
            change_sm += weight * (new_sm - sm)
            change_zz += weight * (new_zz - zz)
            change += weight * grown
        stress[b, SM + i] = sm + change_sm
        stress[b, ZZ + i] = zz + change_zz
        if memory is not None:
            memory[b, i] += change


def correct_all(b, m, share, laws, memories, stress, k):
    """Corrects stresses of block b by all added laws in order; memories: of each law, an array or None."""
    for law, memory in zip(laws, memories, strict=True):
        correct(b, m, share, law, memory, stress, k)


@by_type(correct_all)
def _compiled_correct_all(b, m, share, laws, memories, stress, k):
    def last(b, m, share, laws, memories, stress, k):
        correct(b, m, share, laws[0], memories[0], stress, k)

    def first(b, m, share, laws, memories, stress, k):
        correct(b, m, share, laws[0], memories[0], stress, k)
        correct_all(b, m, share, laws[1:], memories[1:], stress, k)

    return last if len(laws) == 1 else first
