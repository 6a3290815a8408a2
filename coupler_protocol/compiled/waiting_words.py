"""Words of memory through which compiled threads communicate while they wait actively (numba has none for processors).

A value is stored after everything that was written before it (release); everything read after a value was loaded is at least as
new as the value (acquire). `give_way` yields the processor to another thread. All three functions also run uncompiled.
Source: LLVM Language Reference, "Atomic Memory Ordering Constraints"; IEEE Std 1003.1, sched_yield.
"""

import time

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

WORD = types.Array(types.int64, 1, "C")
ALIGNED = 8  # bytes


def address(context, builder, signature, arguments):
    """Pointer to a word of the array."""
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return cgutils.get_item_pointer(context, builder, signature.args[0], array, [arguments[1]], wraparound=False)


@intrinsic
def load(typing, words, number):
    """Returns words[number] as another thread stored it last; words (n,) int64."""

    def code(context, builder, signature, arguments):
        return builder.load_atomic(address(context, builder, signature, arguments), "acquire", ALIGNED)

    return types.int64(WORD, types.intp), code


@intrinsic
def store(typing, words, number, value):
    """Sets words[number] = value for the other threads."""

    def code(context, builder, signature, arguments):
        builder.store_atomic(arguments[2], address(context, builder, signature, arguments), "release", ALIGNED)
        return context.get_dummy_value()

    return types.void(WORD, types.intp, types.int64), code


@intrinsic
def give_way(typing):
    """Yields this processor to another thread that is ready."""

    def code(context, builder, signature, arguments):
        call = cgutils.get_or_insert_function(builder.module, ir.FunctionType(ir.IntType(32), []), "sched_yield")
        builder.call(call, [])
        return context.get_dummy_value()

    return types.void(), code


if numba.config.DISABLE_JIT:

    def load(words, number):
        """Returns words[number]."""
        return words[number]

    def store(words, number, value):
        """Sets words[number] = value."""
        words[number] = value

    def give_way():
        """Yields the interpreter to another thread."""
        time.sleep(0.0)  # os.sched_yield would keep it
