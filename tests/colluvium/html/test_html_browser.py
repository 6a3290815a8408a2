"""report.html in headless Chromium: opened from a file, every choice tried, no complaint, no request."""

import json
import re
import shutil
import subprocess

import numpy as np
import pytest

from colluvium.html import player
from colluvium.results.run import open_run
from tests.colluvium.report_page import Page

pytest.importorskip("cmcrameri")
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
LISTEN = """<script>
const complaints = [];
addEventListener("error", (event) => complaints.push(event.message));
addEventListener("unhandledrejection", (event) => complaints.push(String(event.reason)));
console.error = console.warn = (...words) => complaints.push(words.join(" "));
</script>"""
TRY = """<script>
function seen() {
  const { data, width, height } = context.getImageData(0, 0, canvas.width, canvas.height);
  let coloured = 0, sum = 0;
  for (let i = 0; i < data.length; i += 4) {
    const value = 65536 * data[i] + 256 * data[i + 1] + data[i + 2];
    if (value !== 0xffffff) coloured++;
    sum = (31 * sum + value) % 4294967291;
  }
  return { coloured: coloured / (width * height), sum, caption: element("caption").textContent };
}
function choose(id, value) {
  const box = element(id);
  if (box.type === "checkbox") box.checked = value;
  else box.value = value;
  box.dispatchEvent(new Event(box.type === "range" ? "input" : "change", { bubbles: true }));
  return seen();
}
function press(key) {
  document.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
  return state.frame;
}
const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));
(async () => {
  const found = {};
  await ready;
  found.first = state.frame;
  found.frames = run.frames.map((_, i) => choose("frame", String(i)));
  found.marker = document.querySelector(".marker").getAttribute("transform");
  found.zones = [...element("zones").options].map(({ value }) => [value, choose("zones", value).sum]);
  choose("zones", "syy");
  found.discs = ["same", "displacement", "plain"].map((value) => choose("discs", value).sum);
  found.chains = [false, true].map((value) => choose("chains", value).sum);
  found.mesh = [false, true].map((value) => choose("mesh", value).sum);
  found.scale = ["run", "frame"].map((value) => choose("scale", value).sum);
  found.view = ["all", "window"].map((value) => choose("view", value).sum);
  const before = seen().sum;
  canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -300, cancelable: true }));
  const zoomed = seen().sum;
  canvas.dispatchEvent(new MouseEvent("dblclick"));
  found.zoom = [before, zoomed, seen().sum];
  found.keys = ["Home", "ArrowRight", "ArrowRight", "ArrowLeft", "End"].map(press);
  press(" ");
  found.start = [state.frame, element("play").textContent];
  await pause(300);
  found.later = state.frame;
  await pause(2000);
  found.end = [state.frame, element("play").textContent];
  const { grid, windows: [window] } = run.frames.at(-1);
  const total = (values) => values.reduce((sum, value) => sum + value, 0);
  found.sums = {
    stress: total(zoneValues(grid, "syy")),
    displacement: total(lengths(window)),
    force: total(data.array(window.contacts.force)),
  };
  found.loaded = performance.getEntriesByType("resource").map(({ name }) => name);
  return found;
})().catch((error) => ({ error: String(error) })).then((found) => {
  const note = document.createElement("pre");
  note.id = "found";
  note.textContent = JSON.stringify({ ...found, complaints });
  document.body.append(note);
});
</script>"""


@pytest.fixture(scope="module")
def page(run_folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    with open_run(run_folder) as run:
        return Page(player.write(run, path))


def open_in_browser(text, folder):
    """Open a page from a file, move everything there is to move, return what was seen."""
    path = folder / "tried.html"
    path.write_text(text.replace("<style>", LISTEN + "<style>", 1).replace("</body>", TRY + "</body>"), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1366,768"]
    options += ["--virtual-time-budget=20000", f"--user-data-dir={folder / 'profile'}", "--dump-dom"]
    done = subprocess.run([BROWSER, *options, path.as_uri()], capture_output=True, text=True, timeout=60, check=True)
    note = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    assert note, done.stderr[-2000:]
    return json.loads(note[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))


def test_the_page_lives_in_a_browser(page, run_folder, tmp_path):
    found = open_in_browser(page.text, tmp_path)
    assert found.get("error") is None
    assert found["complaints"] == []
    assert found["loaded"] == []
    assert found["first"] == 5
    assert min(shown["coloured"] for shown in found["frames"]) > 0.2  # the slope fills a good part of the canvas
    assert len({shown["sum"] for shown in found["frames"][1:]}) == 5  # the first two frames are alike
    assert [shown["caption"].split(" · ")[0] for shown in found["frames"]] == [f"frame {k} of 6" for k in range(1, 7)]
    assert "9 g" in found["frames"][5]["caption"]
    assert float(re.search(r"translate\(([\d.]+)", found["marker"])[1]) > 300.0
    for choice in ("zones", "discs", "chains", "mesh", "scale", "view"):
        seen = [value[1] if choice == "zones" else value for value in found[choice]]
        assert len(set(seen)) == len(seen), choice
    assert [key for key, _ in found["zones"]] == [*(q["key"] for q in page.run["quantities"]), "plastic", "plain"]
    before, zoomed, back = found["zoom"]
    assert before == back != zoomed
    assert found["keys"] == [0, 1, 2, 1, 5]
    assert found["start"] == [0, "pause"]
    assert 0 < found["later"] < 5
    assert found["end"] == [5, "play"]
    with open_run(run_folder) as run:
        discs, force = run.discs(5), run.contacts(5).normal_force
        sums = {
            "stress": run.smoothed_stress(5)[:, 1].sum(),
            "displacement": np.hypot(*discs.displacement.T).sum(),
            "force": force.sum(),
        }
    assert found["sums"] == pytest.approx(sums, rel=1e-5)


def test_a_broken_page_is_noticed(page, tmp_path):
    """The test above can fail: an array that is not there, and nothing is drawn."""
    arrays = page.part("arrays")
    found = open_in_browser(page.text.replace(arrays, arrays[: len(arrays) // 8 * 4]), tmp_path)
    assert found["error"] or found["complaints"]
