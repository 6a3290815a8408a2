"""Messages as bytes: one frame each, a fixed header of 40 bytes and a payload.

Step messages carry raw little-endian float64, never narrowed: what arrives is bit-equal to what left. All others carry msgpack.
"""

import struct
import zlib

import msgpack
import numpy as np

from coupler_protocol import messages

MAGIC = b"CLVM"
HEADER = struct.Struct("<4sHHQIIQII")  # magic, version, kind, session, rank, flags, sequence, payload length, CRC-32
CRC_AT = HEADER.size - 4
AGAIN = 1  # flag: the same message sent once more
MAX_FRAME = 64 << 20


class WireError(ValueError):
    """A frame that must not be believed; the text says which part of it."""


class StepFrame:
    """A step message in one buffer that is used for every step: `scalars` and `values` are views into its payload."""

    def __init__(self, kind, session, rank, n_scalars, n_values):
        self.kind, self.session, self.rank = kind, session, rank
        self.buffer = bytearray(HEADER.size + 8 * (n_scalars + n_values))
        numbers = np.frombuffer(self.buffer, dtype="<f8", offset=HEADER.size)
        self.scalars, self.values = numbers[:n_scalars], numbers[n_scalars:]

    def seal(self, sequence):
        """Write header and checksum; returns the bytes to send."""
        return _seal(self.buffer, self.kind, self.session, self.rank, sequence)

    def accept(self, frame):
        """Take the payload of a received frame; raises WireError for another length or a number that is not finite."""
        if len(frame) != len(self.buffer):
            raise WireError(f"{messages.NAMES[self.kind]} has {len(frame)} bytes, {len(self.buffer)} were agreed")
        self.buffer[HEADER.size :] = frame[HEADER.size :]
        if not (np.isfinite(self.values).all() and np.isfinite(self.scalars).all()):
            raise WireError(f"{messages.NAMES[self.kind]} holds a number that is not finite")


def _seal(buffer, kind, session, rank, sequence, flags=0):
    size = len(buffer) - HEADER.size
    HEADER.pack_into(buffer, 0, MAGIC, messages.PROTOCOL_VERSION, kind, session, rank, flags, sequence, size, 0)
    struct.pack_into("<I", buffer, CRC_AT, zlib.crc32(buffer))
    return buffer


def control_frame(kind, session, rank, sequence, content):
    """A message other than a step, its content (dictionary of plain values and bytes) as msgpack."""
    return _seal(bytearray(HEADER.size) + msgpack.packb(content), kind, session, rank, sequence)


def sent_again(frame):
    """The same frame, marked as sent once more."""
    copy = bytearray(frame)
    _, _, kind, session, rank, _, sequence, _, _ = HEADER.unpack_from(copy)
    return _seal(copy, kind, session, rank, sequence, AGAIN)


def open_header(frame):
    """(kind, session, rank, flags, sequence) of a frame whose magic, version, length and checksum are right.

    Raises WireError otherwise.
    """
    if len(frame) < HEADER.size:
        raise WireError(f"a frame of {len(frame)} bytes is shorter than a header")
    magic, version, kind, session, rank, flags, sequence, length, crc = HEADER.unpack_from(frame)
    if magic != MAGIC:
        raise WireError("the frame is not one of ours (magic)")
    if version != messages.PROTOCOL_VERSION:
        raise WireError(f"protocol version {version}, this side speaks {messages.PROTOCOL_VERSION}")
    if length != len(frame) - HEADER.size:
        raise WireError(f"the frame announces {length} bytes and carries {len(frame) - HEADER.size}")
    check = zlib.crc32(frame[HEADER.size :], zlib.crc32(b"\0\0\0\0", zlib.crc32(frame[:CRC_AT])))
    if check != crc:
        raise WireError("the checksum does not fit the frame")
    if not 1 <= kind < len(messages.NAMES):
        raise WireError(f"unknown kind of message {kind}")
    return kind, session, rank, flags, sequence


def content_of(frame):
    """The msgpack content of a control frame; raises WireError for anything malformed."""
    try:
        content = msgpack.unpackb(frame[HEADER.size :], strict_map_key=True, max_ext_len=0)
    except (ValueError, msgpack.exceptions.UnpackException) as error:
        raise WireError(f"the content is not valid msgpack: {error}") from None
    if not isinstance(content, dict):
        raise WireError("the content is not a table")
    return content


def pack_array(array):
    """A float64 array as bytes for a control message."""
    return np.ascontiguousarray(array, dtype="<f8").tobytes()


def unpack_array(data, columns=None):
    """A float64 array from `pack_array`; raises WireError for a wrong size or numbers that are not finite."""
    if not isinstance(data, bytes) or len(data) % (8 * (columns or 1)):
        raise WireError("an array of another size was agreed")
    array = np.frombuffer(data, dtype="<f8").astype(np.float64)
    if not np.isfinite(array).all():
        raise WireError("an array holds a number that is not finite")
    return array.reshape(-1, columns) if columns else array
