// Keys of what the drawing shows, as elements of the page and painted into a picture.

// Entries: colour bars { name, table, ticks: [[place from 0 to 1, words]] }, or { name, signs: [[kind, colour, words, width]] }.
function legend(state, view) {
  const frame = run.frames[state.frame], found = [];
  const discs = frame.windows.length ? discQuantity(state) : null;
  if (quantities.has(state.zones)) found.push(barOf(state.zones, discs && discs !== state.zones ? "zones: " : "", state));
  if (discs && discs !== state.zones) found.push(barOf(discs, "discs: ", state));
  if (state.zones === "plastic") {
    const signs = run.plastic.states.map(([, words, colour]) => ["", colour, words]);
    signs.push(["", run.plastic.elastic, "never yielded"]);
    if (frame.windows.some((window) => window.contacts.bond !== undefined)) signs.push(["dot", INK, "broken bond, still in contact"]);
    found.push({ name: "", signs });
  }
  if (state.chains && frame.windows.length) found.push(chainsKey(state, view));
  return found;
}

function barOf(key, before, state) {
  const quantity = quantities.get(key), { low, high, factor, unit } = scaleOf(key, state), ticks = [];
  const count = quantity.logarithmic ? run.decades : 4;
  for (let i = 0; i <= count; i++) {
    const value = quantity.logarithmic ? high * 10 ** (i - count) : low + (i / count) * (high - low);
    ticks.push([i / count, Math.abs(value) < 1e-9 * high ? "0" : short(value * factor)]);
  }
  return { name: `${before}${quantity.name} [${unit}]`, table: quantity.table, ticks };
}

// Lines as wide as the drawing has them now.
function chainsKey(state, view) {
  const force = widestForce(state), scale = state.scale === "run" ? "one scale for all frames" : "scale of this frame";
  const radius = chainRadius(state);
  const signs = [1, 0.1, 0.01].map((part) => {
    const width = chainWidth(chainClass(force * part, force), radius, view) * (view.pixels / view.ratio);
    return ["line", run.chains.compression, forceWords(Number((force * part).toPrecision(2))), width];
  });
  signs.push(["line", run.chains.compression, "compression", 2], ["line", run.chains.tension, "tension in a bond", 2]);
  return { name: `normal contact force; width grows with its root, ${scale}`, signs };
}

function short(value) {
  const small = Math.abs(value) < 1e-3 || Math.abs(value) >= 1e5;
  return small ? value.toExponential(1).replace(".0e", "e") : String(Number(value.toPrecision(2)));
}

function asElement({ name, table, ticks, signs }) {
  const box = document.createElement("div");
  if (name) box.append(name);
  if (signs) {
    const list = document.createElement("div");
    list.className = "swatches";
    for (const [kind, colour, words, width] of signs) {
      const line = document.createElement("span"), sign = document.createElement("i");
      sign.className = kind;
      sign.style.background = colour;
      if (width) sign.style.height = `${Math.max(0.75, Math.min(40, width))}px`;
      line.append(sign, words);
      list.append(line);
    }
    box.append(list);
    return box;
  }
  const strip = document.createElement("canvas"), below = document.createElement("div");
  box.className = "bar";
  below.className = "ticks";
  [strip.width, strip.height] = [table.length, 1];
  const pen = strip.getContext("2d");
  table.forEach((colour, i) => {
    pen.fillStyle = colour;
    pen.fillRect(i, 0, 1, 1);
  });
  for (const [place, words] of ticks) {
    const tick = document.createElement("span");
    tick.textContent = words;
    tick.style.left = `${100 * place}%`;
    below.append(tick);
  }
  box.append(strip, below);
  return box;
}
