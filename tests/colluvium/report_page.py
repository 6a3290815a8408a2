"""Reads report.html as a browser does."""

import base64
import json
import re
import zlib

import numpy as np


class Page:
    """A page and what it carries."""

    def __init__(self, path):
        self.text = path.read_text(encoding="utf-8")
        self.run = json.loads(self.part("description"))
        self.bytes = zlib.decompress(base64.b64decode(self.part("arrays")))

    def part(self, name):
        return re.search(f'<script type="application/[a-z-]+" id="{name}">(.*?)</script>', self.text, re.DOTALL)[1]

    def array(self, number):
        """Values of an array, decoded as the page's JavaScript does."""
        return decode(self.bytes, self.run["arrays"][number])

    def step(self, number):
        return self.run["arrays"][number][4]

    def agree(self, number, recorded):
        """Whether all values lie within half a step of the recorded ones."""
        np.testing.assert_allclose(self.array(number), recorded, rtol=1e-12, atol=0.5001 * self.step(number))


def decode(carried, entry):
    first, count, width, low, step, logarithmic = entry
    planes = np.frombuffer(carried, np.uint8, count * width, first).reshape(width, count)
    codes = sum(plane.astype(np.int64) << (8 * k) for k, plane in enumerate(planes))
    values = np.where(codes == 256**width - 1, np.nan, low + step * codes)
    return 10.0**values if logarithmic else values
