// One frame on the canvas. World coordinates in metres; `view` holds pixels a metre and where the origin is.

const INK = "#1a1a1a", PLAIN = "#e4e0da", DARK = "#b3a993", GROUND = "#f4f4f2";
const quantities = new Map(run.quantities.map((quantity) => [quantity.key, quantity]));
for (const quantity of run.quantities) quantity.table = quantity.colours.match(/.{6}/g).map((colour) => "#" + colour);

function scaleOf(key, state) {
  const quantity = quantities.get(key);
  return (state.scale === "frame" && quantity.frames[state.frame]) || quantity.run || quantity.frames[state.frame];
}

// A function from value to colour; values without a number are plain.
function colouring(key, state) {
  const quantity = quantities.get(key);
  let { low, high } = scaleOf(key, state);
  let number = (value) => value;
  if (quantity.logarithmic) {
    high = Math.log10(high);
    low = high - run.decades;
    number = Math.log10;
  }
  return (value) => {
    if (Number.isNaN(value)) return PLAIN;
    const place = Math.floor((256 * (number(value) - low)) / (high - low));
    return quantity.table[Math.max(0, Math.min(255, place))];
  };
}

function plasticColour(bits) {
  const state = run.plastic.states.find(([bit]) => bits & bit);
  return state ? state[2] : run.plastic.elastic;
}

function drawnPart(state) {
  return { capped: run.frames[state.frame].drawn, true: 1, none: 0 }[state.motion];
}

function drawFrame(context, view, state) {
  const frame = run.frames[state.frame], part = drawnPart(state);
  const { width, height } = context.canvas;
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.fillStyle = "#fff";
  context.fillRect(0, 0, width, height);
  context.setTransform(view.pixels, 0, 0, -view.pixels, view.x, view.y);
  if (frame.grid) drawGrid(context, frame.grid, part, view, state);
  for (const window of frame.windows) drawWindow(context, window, part, view, state);
  if (frame.grid) drawBorder(context, frame.grid, part, view);
  drawWalls(context, frame.walls, view);
  context.setTransform(1, 0, 0, 1, 0, 0);
  drawAxes(context, view);
}

function drawGrid(context, grid, part, view, state) {
  const { x, y } = places(grid, part);
  const corners = grid.corners.map((number) => data.array(number));
  const key = state.zones in grid.fields || state.zones === "displacement" ? state.zones : null;
  const values = key && zoneValues(grid, key);
  const colour = key === "plastic" ? plasticColour : key ? colouring(key, state) : () => GROUND;
  context.lineWidth = view.ratio / view.pixels;
  for (let zone = 0; zone < corners[0].length; zone++) {
    context.beginPath();
    for (const corner of corners) context.lineTo(x[corner[zone]], y[corner[zone]]);
    context.closePath();
    context.fillStyle = colour(key ? values[zone] : NaN);
    context.strokeStyle = state.mesh ? "rgba(0,0,0,0.22)" : context.fillStyle; // else seams show
    context.fill();
    context.stroke();
  }
}

// The border of the mesh and of its holes, on top of the discs that cover it.
function drawBorder(context, grid, part, view) {
  const { x, y } = places(grid, part);
  const [from, to] = grid.border.map((number) => data.array(number));
  context.beginPath();
  for (let edge = 0; edge < from.length; edge++) {
    context.moveTo(x[from[edge]], y[from[edge]]);
    context.lineTo(x[to[edge]], y[to[edge]]);
  }
  context.lineWidth = (1.1 * view.ratio) / view.pixels;
  context.strokeStyle = INK;
  context.stroke();
}

// Walls of discs alone, at their places in this frame.
function drawWalls(context, walls, view) {
  context.beginPath();
  for (const [x0, y0, x1, y1] of walls) {
    context.moveTo(x0, y0);
    context.lineTo(x1, y1);
  }
  context.lineWidth = (2.2 * view.ratio) / view.pixels;
  context.lineCap = "butt";
  context.strokeStyle = run.wall;
  context.stroke();
}

// What the discs show: a quantity, or null where they are plain.
function discQuantity(state) {
  const key = state.discs === "same" ? state.zones : state.discs;
  return quantities.has(key) ? key : null;
}

function drawWindow(context, window, part, view, state) {
  const { x, y } = places(window, part), radius = data.array(window.radius);
  const key = discQuantity(state);
  const values = key && discValues(window, key), colour = key && colouring(key, state);
  const stone = window.stone === undefined ? null : data.array(window.stone);
  if (window.stones) {
    stonePath(context, window.stones, part);
    context.fillStyle = DARK;
    context.fill();
  }
  const more = (0.3 * view.ratio) / view.pixels; // gaps between small discs would make their colours pale
  for (let i = 0; i < radius.length; i++) {
    context.fillStyle = key ? colour(values[i]) : stone && stone[i] >= 0 ? DARK : PLAIN;
    context.beginPath();
    context.arc(x[i], y[i], radius[i] + more, 0, 2 * Math.PI);
    context.fill();
  }
  if (state.chains) drawChains(context, window, x, y, radius, view, state);
  if (window.stones) {
    stonePath(context, window.stones, part);
    context.lineWidth = (Math.max(0.5, Math.min(1.2, (0.012 * view.pixels) / view.ratio)) * view.ratio) / view.pixels;
    context.strokeStyle = INK;
    context.stroke();
  }
  if (state.zones === "plastic") drawBroken(context, window, x, y, view);
}

function stonePath(context, stones, part) {
  const { x, y } = places(stones, part);
  let first = 0;
  context.beginPath();
  for (const count of data.array(stones.corners)) {
    context.moveTo(x[first], y[first]);
    for (let i = first + 1; i < first + count; i++) context.lineTo(x[i], y[i]);
    context.closePath();
    first += count;
  }
}

// Factor and unit with which a length [m] or a force [N per m thickness] has few digits.
function lengthUnit(metres) {
  return metres >= 0.5 ? [1, "m"] : metres >= 5e-4 ? [1e3, "mm"] : [1e6, "µm"];
}

function forceWords(force, step = 0) {
  const size = Math.abs(force), [factor, unit] = size >= 1e6 ? [1e-6, "MN"] : size >= 1e3 ? [1e-3, "kN"] : [1, "N"];
  return `${digits(force * factor, step * factor)} ${unit} per m`;
}

// The force that is drawn widest.
function widestForce(state) {
  if (state.scale === "run") return run.chains.run;
  return Math.max(...run.frames[state.frame].windows.map((window) => window.contacts.widest));
}

// Contacts are lines in classes of width. The widest line is as wide as a disc's radius; the width grows with the root of the force,
// so that frames with low forces are not empty on the scale of the run.
const CLASSES = 12;

function chainClass(force, strongest) {
  return Math.min(CLASSES - 1, Math.floor(CLASSES * Math.sqrt(Math.abs(force) / strongest)));
}

function chainWidth(rank, widest, view) {
  return Math.max((widest * (rank + 0.5)) / CLASSES, (0.3 * view.ratio) / view.pixels);
}

// Of the window with the largest discs: lines of equal force have one width in all windows.
function chainRadius(state) {
  return Math.max(...run.frames[state.frame].windows.map(middleRadius));
}

function middleRadius(window) {
  const radius = data.array(window.radius);
  return radius[Math.floor(radius.length / 2)] || 0;
}

// The strongest contacts are on top.
function drawChains(context, window, x, y, radius, view, state) {
  const [a, b] = window.contacts.ends.map((number) => data.array(number));
  const force = data.array(window.contacts.force);
  const strongest = widestForce(state);
  const widest = chainRadius(state), members = Array.from({ length: 2 * CLASSES }, () => []);
  for (let i = 0; i < force.length; i++) members[2 * chainClass(force[i], strongest) + (force[i] < 0 ? 1 : 0)].push(i);
  context.lineCap = "round";
  members.forEach((contacts, number) => {
    context.beginPath();
    for (const i of contacts) {
      const reach = 2 * (radius[a[i]] + radius[b[i]]); // discs that ran apart where the drawn motion is capped
      if (Math.hypot(x[a[i]] - x[b[i]], y[a[i]] - y[b[i]]) > reach) continue;
      context.moveTo(x[a[i]], y[a[i]]);
      context.lineTo(x[b[i]], y[b[i]]);
    }
    context.lineWidth = chainWidth(Math.floor(number / 2), widest, view);
    context.strokeStyle = number % 2 ? run.chains.tension : run.chains.compression;
    context.stroke();
  });
}

function drawBroken(context, window, x, y, view) {
  if (window.contacts.bond === undefined) return;
  const [a, b] = window.contacts.ends.map((number) => data.array(number));
  const size = (1.6 * view.ratio) / view.pixels;
  context.fillStyle = INK;
  data.array(window.contacts.bond).forEach((bond, i) => {
    if (bond < 2) return;
    context.fillRect((x[a[i]] + x[b[i]] - size) / 2, (y[a[i]] + y[b[i]] - size) / 2, size, size);
  });
}

// A round step of ticks, of which about `count` fit into `span`.
function roundStep(span, count) {
  const size = 10 ** Math.floor(Math.log10(span / count));
  return size * [1, 2, 5, 10].find((times) => size * times >= 0.999 * (span / count));
}

function drawAxes(context, view) {
  const { width, height } = context.canvas, ratio = view.ratio;
  const step = roundStep(width / view.pixels, width / ratio / 65);
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  context.font = `${11 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
  context.fillStyle = "#444";
  context.lineJoin = "round";
  context.textAlign = "center";
  context.textBaseline = "bottom";
  const label = (value) => (Math.abs(value) < step / 2 ? 0 : value).toFixed(digits);
  const write = (words, px, py) => { // readable on any colour
    context.lineWidth = 3 * ratio;
    context.strokeStyle = "rgba(255,255,255,0.85)";
    context.strokeText(words, px, py);
    context.fillText(words, px, py);
  };
  for (let x = Math.ceil(-view.x / view.pixels / step) * step; view.x + view.pixels * x < width - 55 * ratio; x += step) {
    const px = view.x + view.pixels * x;
    if (px < 40 * ratio) continue;
    context.fillRect(px - ratio / 2, height - 4 * ratio, ratio, 4 * ratio);
    write(label(x), px, height - 5 * ratio);
  }
  write("x [m]", width - 20 * ratio, height - 5 * ratio);
  context.textAlign = "left";
  context.textBaseline = "middle";
  for (let y = Math.ceil((view.y - height) / view.pixels / step) * step; view.y - view.pixels * y > 30 * ratio; y += step) {
    const py = view.y - view.pixels * y;
    if (py > height - 30 * ratio) continue;
    context.fillRect(0, py - ratio / 2, 4 * ratio, ratio);
    write(label(y), 7 * ratio, py);
  }
  write("y [m]", 7 * ratio, 12 * ratio);
}
