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
  element("keys").replaceChildren(...keys());
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
  const [factor, unit] = metres >= 0.5 ? [1, "m"] : metres >= 5e-4 ? [1e3, "mm"] : [1e6, "µm"];
  return `${Number((metres * factor).toPrecision(3))} ${unit}`;
}

// Colour bars and signs for what the canvas shows now.
function keys() {
  const frame = run.frames[state.frame], found = [];
  const discs = frame.windows.length ? discQuantity(state) : null;
  if (quantities.has(state.zones)) found.push(bar(state.zones, discs && discs !== state.zones ? "zones: " : ""));
  if (discs && discs !== state.zones) found.push(bar(discs, "discs: "));
  if (state.zones === "plastic") {
    const signs = run.plastic.states.map(([, words, colour]) => ["", colour, words]);
    signs.push(["", run.plastic.elastic, "never yielded"]);
    if (frame.windows.some((window) => window.contacts.bond !== undefined)) signs.push(["dot", INK, "broken bond, still in contact"]);
    found.push(swatches(signs));
  }
  if (state.chains && frame.windows.length) {
    const force = widestForce(state);
    const [factor, unit] = force >= 1e6 ? [1e-6, "MN"] : force >= 1e3 ? [1e-3, "kN"] : [1, "N"];
    const signs = [1, 0.1, 0.01].map((part) => {
      const words = `${Number((force * part * factor).toPrecision(2))} ${unit} per m`;
      return ["line", run.chains.compression, words, Math.max(1, 6 * Math.sqrt(part))];
    });
    found.push(swatches([...signs, ["line", run.chains.compression, "compression"], ["line", run.chains.tension, "tension in a bond"]]));
  }
  return found;
}

function bar(key, before) {
  const quantity = quantities.get(key), { low, high, factor, unit } = scaleOf(key, state);
  const box = document.createElement("div"), picture = document.createElement("canvas"), ticks = document.createElement("div");
  box.className = "bar";
  ticks.className = "ticks";
  picture.width = 256;
  picture.height = 1;
  const pen = picture.getContext("2d");
  quantity.table.forEach((colour, i) => {
    pen.fillStyle = colour;
    pen.fillRect(i, 0, 1, 1);
  });
  const count = quantity.logarithmic ? run.decades : 4;
  for (let i = 0; i <= count; i++) {
    const part = i / count;
    const value = quantity.logarithmic ? high * 10 ** (i - count) : low + part * (high - low);
    const tick = document.createElement("span");
    tick.textContent = Math.abs(value) < 1e-9 * high ? "0" : short(value * factor);
    tick.style.left = `${100 * part}%`;
    ticks.append(tick);
  }
  box.append(`${before}${quantity.name} [${unit}]`, picture, ticks);
  return box;
}

function short(value) {
  const small = Math.abs(value) < 1e-3 || Math.abs(value) >= 1e5;
  return small ? value.toExponential(1).replace(".0e", "e") : String(Number(value.toPrecision(2)));
}

function swatches(signs) {
  const box = document.createElement("div");
  box.className = "swatches";
  for (const [kind, colour, words, height] of signs) {
    const line = document.createElement("span"), sign = document.createElement("i");
    sign.className = kind;
    sign.style.background = colour;
    if (height) sign.style.height = `${height}px`;
    line.append(sign, words);
    box.append(line);
  }
  return box;
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
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
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
