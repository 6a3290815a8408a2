"""Comparison of results bit for bit."""

import h5py


def bits(data):
    """Bits of a data set; an empty one (an effect that is absent) has none."""
    value = data[()]
    return b"" if isinstance(value, h5py.Empty) else value.tobytes()


def differing(a, b):
    """Names of data sets that are not the same bits in two HDF5 files."""
    names = []
    with h5py.File(a) as fa, h5py.File(b) as fb:

        def collect(name, item):
            if isinstance(item, h5py.Dataset):
                other = fb.get(name)
                if other is None or other.shape != item.shape or bits(other) != bits(item):
                    names.append(name)

        fa.visititems(collect)
        mine, theirs = [], []
        fa.visit(mine.append)
        fb.visit(theirs.append)
    return names + sorted(set(mine) ^ set(theirs))
