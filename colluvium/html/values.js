// Values at a point of the drawing or of a plot, in words.

const NEAR = 9; // distance within which a point of a curve is named, in units of the plot

// The disc of a window that covers a point [m], or -1.
function discAt(window, part, px, py) {
  const { x, y } = places(window, part), radius = data.array(window.radius);
  let found = -1, least = Infinity;
  for (let i = 0; i < radius.length; i++) {
    const away = Math.hypot(x[i] - px, y[i] - py);
    if (away <= radius[i] && away < least) [found, least] = [i, away];
  }
  return found;
}

// The zone in which a point [m] lies, or -1: an odd number of its edges is crossed on the way to the right.
function zoneAt(grid, part, px, py) {
  const { x, y } = places(grid, part), corners = grid.corners.map((number) => data.array(number));
  for (let zone = 0; zone < corners[0].length; zone++) {
    let inside = false;
    for (let k = 0; k < 4; k++) {
      const a = corners[k][zone], b = corners[(k + 1) % 4][zone];
      if (y[a] > py !== y[b] > py && px < x[a] + ((py - y[a]) / (y[b] - y[a])) * (x[b] - x[a])) inside = !inside;
    }
    if (inside) return zone;
  }
  return -1;
}

// A number with four digits, but none below the step between two stored values.
function digits(value, step = 0) {
  if (!Number.isFinite(value)) return "none";
  const size = Math.abs(value), known = step > 0 ? Math.floor(Math.log10(size)) - Math.floor(Math.log10(step)) + 1 : 4;
  if (step > 0 && known < 1) return `0 ± ${plain(Number(step.toPrecision(1)))}`;
  return plain(Number(value.toPrecision(Math.max(1, Math.min(4, known)))));
}

function plain(value) {
  const size = Math.abs(value);
  return value && (size >= 1e5 || size < 1e-3) ? value.toExponential() : String(value);
}

function stepOf(number) {
  const [, , , , step, logarithmic] = run.arrays[number];
  return logarithmic ? 0 : step;
}

// Name, value and unit of the quantity `key`; `step`: between two stored values.
function quantityWords(key, value, step, state) {
  const { factor, unit } = scaleOf(key, state), { name } = quantities.get(key);
  return `${name}: ${digits(value * factor, step * factor)}${Number.isFinite(value) && unit !== "-" ? ` ${unit}` : ""}`;
}

function zoneWords(grid, zone, state) {
  const lines = [`zone ${zone}`];
  if (state.zones === "plastic" && "plastic" in grid.fields) {
    const bits = data.array(grid.fields.plastic)[zone];
    const words = run.plastic.states.filter(([bit]) => bits & bit).map(([, text]) => text);
    lines.push(`plastic state: ${words.join(", ") || "never yielded"}`);
  }
  const key = state.zones in grid.fields && quantities.has(state.zones) ? state.zones : "displacement";
  const step = key === "displacement" ? stepOf(grid.displacement[0]) : stepOf(grid.fields[key]);
  lines.push(quantityWords(key, zoneValues(grid, key)[zone], step, state));
  return lines;
}

function discWords(window, disc, state) {
  const [factor, unit] = lengthUnit(data.array(window.radius)[disc]);
  const stone = window.stone === undefined ? -1 : data.array(window.stone)[disc];
  const lines = [`disc, radius ${digits(factor * data.array(window.radius)[disc])} ${unit}${stone < 0 ? "" : `, of stone ${stone}`}`];
  const key = discQuantity(state) || "displacement";
  const step = key === "displacement" ? stepOf(window.displacement[0]) : stepOf(window.fields[key]);
  const of = key === "displacement" ? "" : " (mean of its bin)";
  const words = quantityWords(key, discValues(window, key)[disc], step, state);
  lines.push(words.replace(", averaged at gridpoints", "") + of); // that concerns zones
  if (state.chains) {
    const [a, b] = window.contacts.ends.map((number) => data.array(number)), force = data.array(window.contacts.force);
    let largest = NaN;
    for (let i = 0; i < force.length; i++)
      if ((a[i] === disc || b[i] === disc) && !(Math.abs(force[i]) <= Math.abs(largest))) largest = force[i];
    lines.push(Number.isNaN(largest) ? "no contact" : `largest normal force: ${forceWords(largest, stepOf(window.contacts.force))}`);
  }
  return lines;
}

// What the drawing shows at a point [m]: lines of words, or null beside everything. Discs cover zones.
function valuesAt(px, py, state) {
  const frame = run.frames[state.frame], part = drawnPart(state);
  for (const window of frame.windows.toReversed()) {
    const disc = discAt(window, part, px, py);
    if (disc >= 0) return [`x ${px.toFixed(2)} m, y ${py.toFixed(2)} m`, ...discWords(window, disc, state)];
  }
  const zone = frame.grid ? zoneAt(frame.grid, part, px, py) : -1;
  return zone < 0 ? null : [`x ${px.toFixed(2)} m, y ${py.toFixed(2)} m`, ...zoneWords(frame.grid, zone, state)];
}

// Of the points of a line, "x,y x,y ..", the one nearest to a pointer: in x, or for curves in both.
function nearest(points, px, py, curve) {
  let found = { index: -1, away: Infinity };
  points.forEach(([x, y], index) => {
    const away = curve ? Math.hypot(x - px, y - py) : Math.abs(x - px);
    if (away < found.away) found = { index, away, x, y };
  });
  return found;
}

// Values of a plot at a pointer in its units: lines of words, and the points of the lines that they belong to.
function plotValuesAt(plot, lines, px, py) {
  const words = [], spots = [];
  lines.forEach((points, number) => {
    const { index, away, x, y } = nearest(points, px, py, plot.curve);
    if (index < 0 || (plot.curve && away > NEAR)) return;
    const [at, value] = plot.lines[number].map((array) => data.array(array)[index]);
    const where = plot.curve ? `${plot.x.name} ${digits(at)} ${plot.x.unit}: ` : `step ${at.toLocaleString("en")}${timeWords(x, plot)}: `;
    const unit = plot.unit === "-" ? "" : ` ${plot.unit}`;
    words.push(`${plot.lines.length > 1 ? `${plot.names[number]}, ` : ""}${where}${digits(value)}${unit}`);
    spots.push([x, y]);
  });
  return { words, spots };
}

// Time at a place of a time axis, where the stage there is in real time.
function timeWords(x, plot) {
  const place = (x - plot.left) / plot.inner;
  const part = run.time.find(({ end }) => place <= end) || run.time.at(-1);
  if (!part.real) return "";
  const time = part.first + ((place - part.start) / (part.end - part.start)) * (part.last - part.first);
  return ` (${digits(time)} s)`;
}

// Points of a line of a plot from its attribute "x,y x,y ..".
function pointsOf(words) {
  return words ? words.split(" ").map((pair) => pair.split(",").map(Number)) : [];
}
