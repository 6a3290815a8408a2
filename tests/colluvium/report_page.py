"""Reads report.html as a browser does."""

import base64
import json
import re
import shutil
import subprocess
import zlib
from importlib import resources

import numpy as np
import pytest

from colluvium.html import player

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="no Node.js is installed")
IN_NODE = """
const given = JSON.parse(require("fs").readFileSync(0, "utf8"));
globalThis.document = { getElementById: (id) => ({ textContent: given[id] }) };
const evaluate = "globalThis.evaluate = async (words) => { await data.open(); return eval(words); };";
require("vm").runInThisContext(given.scripts + evaluate);
globalThis.evaluate(given.words).then((found) => process.stdout.write(JSON.stringify(found)));
"""


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
    if step == 0:
        return np.ascontiguousarray(planes.T).view("<f4").ravel().astype(float)
    codes = sum(plane.astype(np.int64) << (8 * k) for k, plane in enumerate(planes))
    values = np.where(codes == 256**width - 1, np.nan, low + step * codes)
    return 10.0**values if logarithmic else values


def in_node(page, words):
    """Value of JavaScript in a page without a screen: its data and functions, but nothing is drawn."""
    scripts = [resources.files("colluvium.html").joinpath(name).read_text(encoding="utf-8") for name in player.SCRIPTS[:-1]]
    given = {name: page.part(name) for name in ("description", "arrays")} | {"words": words, "scripts": "\n".join(scripts)}
    done = subprocess.run([NODE, "-e", IN_NODE], input=json.dumps(given), capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
