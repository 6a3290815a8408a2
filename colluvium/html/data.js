"use strict";
// The arrays of the page. value = low + step * code, codes in byte planes, lowest bytes first; the largest code is "no number".
// With step 0 the codes are float32.

const run = JSON.parse(document.getElementById("description").textContent);

const data = {
  bytes: null,
  read: new Map(),

  async open() {
    const text = document.getElementById("arrays").textContent;
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    this.bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  },

  array(number) {
    if (!this.read.has(number)) this.read.set(number, this.decode(...run.arrays[number]));
    return this.read.get(number);
  },

  decode(first, count, width, low, step, logarithmic) {
    const values = new Float64Array(count), bits = new DataView(new ArrayBuffer(4));
    const nothing = 256 ** width - 1;
    for (let i = 0; i < count; i++) {
      let code = 0;
      for (let plane = width - 1; plane >= 0; plane--) code = 256 * code + this.bytes[first + plane * count + i];
      if (step === 0) {
        bits.setUint32(0, code);
        values[i] = bits.getFloat32(0);
        continue;
      }
      const value = code === nothing ? NaN : low + step * code;
      values[i] = logarithmic ? 10 ** value : value;
    }
    return values;
  },
};

// Where the points of a body are: start + drawn part of the displacement.
function places(body, part) {
  const [x, y] = body.start.map((number) => data.array(number));
  const [u, v] = body.displacement.map((number) => data.array(number));
  return { x: x.map((value, i) => value + part * u[i]), y: y.map((value, i) => value + part * v[i]) };
}

function lengths(body) {
  const [u, v] = body.displacement.map((number) => data.array(number));
  return u.map((value, i) => Math.hypot(value, v[i]));
}

// What a zone or disc shows of a quantity: zones the mean of their corners' displacement, discs the mean of their bin.
function zoneValues(grid, key) {
  if (key !== "displacement") return data.array(grid.fields[key]);
  const size = lengths(grid);
  const [a, b, c, d] = grid.corners.map((number) => data.array(number));
  return a.map((_, i) => (size[a[i]] + size[b[i]] + size[c[i]] + size[d[i]]) / 4);
}

function discValues(window, key) {
  if (key === "displacement") return lengths(window);
  const values = data.array(window.fields[key]);
  return data.array(window.bin).map((bin) => values[bin]);
}
