// Choices, keys, the colour bars and the clock. `#frame=28&zones=syy&chains=1` in the address chooses too.

const element = (id) => document.getElementById(id);
const canvas = element("stage"), context = canvas.getContext("2d");
const state = { frame: run.calm, zones: "", discs: "same", scale: "run", motion: run.motion, view: "all", chains: false, mesh: false };
const view = { pixels: 1, x: 0, y: 0, ratio: 1 };
const SECONDS = 0.125; // a frame is shown for
let clock = null;

function fillChoices() {
  const choices = run.quantities.map(({ key, name }) => [key, name.split(",")[0]]);
  if (run.frames.some((frame) => frame.grid && "plastic" in frame.grid.fields)) choices.push(["plastic", "plastic state"]);
  choices.push(["plain", "plain"]);
  for (const [key, name] of choices) element("zones").append(new Option(name, key));
  state.zones = choices[0][0];
  for (const [key, value] of new URLSearchParams(location.hash.slice(1))) {
    if (key === "frame") state.frame = Math.max(0, Math.min(run.frames.length - 1, Math.round(Number(value)) || 0));
    else if (key === "chains" || key === "mesh") state[key] = value === "1";
    else if (key in state && [...element(key).options].some((option) => option.value === value)) state[key] = value;
  }
}

// Bounds of what a view shows: everything at the start, or the windows of this frame.
function bounds() {
  const windows = run.frames[state.frame].windows.length ? run.frames[state.frame].windows : run.frames.at(-1).windows;
  if (state.view === "all" || !windows.length) return run.box;
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (const window of windows) {
    const { x, y } = places(window, 0);
    for (let i = 0; i < x.length; i++) {
      box[0] = Math.min(box[0], x[i]);
      box[1] = Math.min(box[1], y[i]);
      box[2] = Math.max(box[2], x[i]);
      box[3] = Math.max(box[3], y[i]);
    }
  }
  return box;
}

function fit() {
  view.ratio = globalThis.devicePixelRatio || 1;
  canvas.width = Math.round(canvas.clientWidth * view.ratio);
  canvas.height = Math.round(canvas.clientHeight * view.ratio);
  const [x0, y0, x1, y1] = bounds(), room = 34 * view.ratio;
  view.pixels = Math.min((canvas.width - 2 * room) / (x1 - x0), (canvas.height - 2 * room) / (y1 - y0));
  view.x = canvas.width / 2 - (view.pixels * (x0 + x1)) / 2;
  view.y = canvas.height / 2 + (view.pixels * (y0 + y1)) / 2;
}

function draw() {
  drawFrame(context, view, state);
  for (const id of ["zones", "discs", "scale", "motion", "view", "frame"]) element(id).value = state[id];
  for (const id of ["chains", "mesh"]) element(id).checked = state[id];
  const quantity = quantities.get(state.zones);
  element("log").checked = Boolean(quantity?.logarithmic);
  element("log").disabled = !quantity?.positive;
  element("play").textContent = clock ? "pause" : "play";
  element("caption").textContent = caption();
  element("keys").replaceChildren(...legend(state, view).map(asElement));
  for (const marker of document.querySelectorAll(".marker")) {
    const across = run.frames[state.frame].across * marker.dataset.inner;
    marker.setAttribute("transform", `translate(${across} 0)`);
  }
}

function caption() {
  const frame = run.frames[state.frame];
  const words = [
    `frame ${state.frame + 1} of ${run.frames.length}`,
    frame.stage,
    `step ${frame.step.toLocaleString("en")}`,
    `${Number(frame.gravity_factor.toPrecision(4))} g`,
    `largest displacement ${readableLength(frame.farthest)}`,
  ];
  const part = drawnPart(state);
  if (part < 1 && state.motion === "capped") words.push(`run-out: displacements drawn at ${Number(part.toPrecision(2))} of their length`);
  return words.join(" · ");
}

function readableLength(metres) {
  if (metres === null) return "beyond all numbers";
  const [factor, unit] = lengthUnit(metres);
  return `${Number((metres * factor).toPrecision(3))} ${unit}`;
}

// Words beside the pointer; none hide them.
function point(words, event) {
  const box = element("pointed");
  box.hidden = !words || !words.length;
  if (box.hidden) return;
  box.replaceChildren(...words.map((line) => Object.assign(document.createElement("div"), { textContent: line })));
  const { clientWidth, clientHeight } = document.documentElement, { width, height } = box.getBoundingClientRect();
  const beside = event.clientX + 16 + width < clientWidth ? event.clientX + 16 : Math.max(4, event.clientX - 16 - width);
  box.style.left = `${Math.max(4, Math.min(beside, clientWidth - width - 4))}px`;
  box.style.top = `${event.clientY + 16 + height < clientHeight ? event.clientY + 16 : Math.max(4, event.clientY - 16 - height)}px`;
}

function pointAtDrawing(event) {
  const { left, top } = canvas.getBoundingClientRect(), px = (event.clientX - left) * view.ratio, py = (event.clientY - top) * view.ratio;
  point(valuesAt((px - view.x) / view.pixels, (view.y - py) / view.pixels, state), event);
}

// Values of a plot under the pointer, with a spot on each line.
function pointAtPlot(box, plot, lines, event) {
  const svg = box.querySelector("svg"), { left, top, width } = svg.getBoundingClientRect();
  const times = svg.viewBox.baseVal.width / width;
  const { words, spots } = plotValuesAt(plot, lines, (event.clientX - left) * times, (event.clientY - top) * times);
  forgetSpots();
  for (const [x, y] of spots) {
    const spot = document.createElementNS(svg.namespaceURI, "circle");
    for (const [name, value] of Object.entries({ class: "spot", cx: x, cy: y, r: 3 })) spot.setAttribute(name, value);
    svg.append(spot);
  }
  point(words, event);
}

function forgetSpots() {
  for (const spot of document.querySelectorAll(".spot")) spot.remove();
}

function leave() {
  forgetSpots();
  point(null);
}

// The drawing on paper has the resolution and the letters of a saved picture.
function printed() {
  const shown = viewFor(PICTURE.width, PICTURE.ratio);
  [canvas.width, canvas.height] = [PICTURE.width, shown.height];
  drawFrame(context, shown, state);
}

function show(frame) {
  state.frame = Math.max(0, Math.min(run.frames.length - 1, frame));
  draw();
}

function play() {
  if (clock) {
    clearInterval(clock);
    clock = null;
  } else {
    if (state.frame === run.frames.length - 1) state.frame = 0;
    clock = setInterval(() => (state.frame === run.frames.length - 1 ? play() : show(state.frame + 1)), 1000 * SECONDS);
  }
  draw();
}

function listen() {
  element("frame").addEventListener("input", (event) => show(Number(event.target.value)));
  element("play").addEventListener("click", play);
  for (const id of ["zones", "discs", "scale", "motion", "view"])
    element(id).addEventListener("change", (event) => {
      state[id] = event.target.value;
      if (id === "view") fit();
      draw();
    });
  for (const id of ["chains", "mesh"])
    element(id).addEventListener("change", (event) => {
      state[id] = event.target.checked;
      draw();
    });
  document.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: -1, ArrowRight: 1, Home: -run.frames.length, End: run.frames.length };
    if (event.target.tagName === "SELECT" || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key in moves) show(state.frame + moves[event.key]);
    else if (event.key === " ") play();
    else return;
    event.preventDefault();
  });
  element("log").addEventListener("change", (event) => {
    quantities.get(state.zones).logarithmic = event.target.checked;
    draw();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const times = Math.exp(-0.0015 * event.deltaY), px = event.offsetX * view.ratio, py = event.offsetY * view.ratio;
    view.x = px + times * (view.x - px);
    view.y = py + times * (view.y - py);
    view.pixels *= times;
    draw();
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointAtDrawing(event);
  });
  canvas.addEventListener("pointerleave", leave);
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return pointAtDrawing(event);
    leave();
    view.x += event.movementX * view.ratio;
    view.y += event.movementY * view.ratio;
    draw();
  });
  const reset = () => {
    fit();
    draw();
  };
  canvas.addEventListener("dblclick", reset);
  addEventListener("resize", reset);
  addEventListener("scroll", leave, { passive: true });
  element("save").addEventListener("click", savePicture);
  document.querySelectorAll(".plot").forEach((box, number) => {
    const lines = [...box.querySelectorAll("polyline")].map((line) => pointsOf(line.getAttribute("points")));
    box.addEventListener("pointermove", (event) => pointAtPlot(box, run.plots[number], lines, event));
    box.addEventListener("pointerdown", (event) => pointAtPlot(box, run.plots[number], lines, event));
    box.addEventListener("pointerleave", leave);
  });
  addEventListener("beforeprint", printed);
  addEventListener("afterprint", reset);
}

async function start() {
  await data.open();
  fillChoices();
  fit();
  draw();
  listen();
}

const ready = start();
ready.catch((error) => {
  element("caption").textContent = `This page cannot be shown: ${error.message}`;
});
