// The view as a picture for print: drawing, title, caption and keys. 2244 pixels are 190 mm at 300 dpi, 11 px are 7.5 pt there.

const PICTURE = { width: 2244, ratio: 2.84, font: 11, margin: 8 };

function font(ratio, weight = "") {
  return `${weight} ${PICTURE.font * ratio}px system-ui, "DejaVu Sans", sans-serif`.trim();
}

// The same part of the world as the canvas shows, for another width in pixels.
function viewFor(width, ratio) {
  const times = width / canvas.width;
  return { pixels: view.pixels * times, x: view.x * times, y: view.y * times, ratio, height: Math.round(canvas.height * times) };
}

function picture() {
  const { width, ratio, margin } = PICTURE, line = 1.5 * PICTURE.font * ratio;
  const drawing = document.createElement("canvas"), shown = viewFor(width, ratio);
  [drawing.width, drawing.height] = [width, shown.height];
  drawFrame(drawing.getContext("2d"), shown, state);
  const sheet = document.createElement("canvas"), pen = sheet.getContext("2d");
  const room = width - 2 * margin * ratio, boxes = legend(state, shown);
  pen.font = font(ratio);
  const head = [...wrapped(pen, document.title, room), ...wrapped(pen, caption(), room)];
  const top = line * (head.length + 0.5), heights = boxes.map((box) => heightOf(pen, box, room, line));
  sheet.width = width;
  sheet.height = Math.round(top + shown.height + heights.reduce((sum, height) => sum + height, line));
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.font = font(ratio);
  pen.fillStyle = INK;
  pen.textBaseline = "top";
  head.forEach((words, k) => pen.fillText(words, margin * ratio, line * (k + 0.25)));
  pen.drawImage(drawing, 0, top);
  let y = top + shown.height + 0.4 * line;
  boxes.forEach((box, k) => {
    paint(pen, box, margin * ratio, y, room, line);
    y += heights[k];
  });
  return sheet;
}

function wrapped(pen, words, room) {
  const lines = [""];
  for (const word of words.split(" ")) {
    const longer = lines.at(-1) ? `${lines.at(-1)} ${word}` : word;
    if (lines.at(-1) && pen.measureText(longer).width > room) lines.push(word);
    else lines[lines.length - 1] = longer;
  }
  return lines;
}

// Places of the signs of an entry in rows.
function arranged(pen, signs, room, line) {
  let x = 0, row = 0;
  return signs.map(([, , words]) => {
    const width = pen.measureText(words).width + 2.2 * line;
    if (x && x + width > room) [x, row] = [0, row + 1];
    x += width;
    return [x - width, row];
  });
}

function heightOf(pen, { name, signs }, room, line) {
  if (!signs) return 3 * line;
  return line * ((name ? 1 : 0) + arranged(pen, signs, room, line).at(-1)[1] + 1.3);
}

function paint(pen, { name, table, ticks, signs }, left, y, room, line) {
  pen.fillStyle = INK;
  pen.textAlign = "left";
  if (name) pen.fillText(name, left, y);
  const below = name ? y + line : y;
  if (!signs) {
    const width = Math.min(room, 24 * line), step = width / table.length;
    table.forEach((colour, i) => {
      pen.fillStyle = colour;
      pen.fillRect(left + i * step, below, step + 1, 0.7 * line);
    });
    pen.fillStyle = INK;
    for (const [place, words] of ticks) {
      pen.textAlign = place === 0 ? "left" : place === 1 ? "right" : "center";
      pen.fillText(words, left + place * width, below + 0.85 * line);
    }
    return;
  }
  arranged(pen, signs, room, line).forEach(([x, row], k) => {
    const [kind, colour, words, thick] = signs[k], middle = below + line * (row + 0.4);
    const side = kind === "dot" ? 0.25 * line : 0.7 * line, tall = thick ? thick * PICTURE.ratio : side;
    pen.fillStyle = colour;
    pen.fillRect(left + x, middle - tall / 2, side, tall);
    if (!kind) {
      pen.strokeStyle = "#999";
      pen.lineWidth = PICTURE.ratio / 2;
      pen.strokeRect(left + x, middle - side / 2, side, side);
    }
    pen.fillStyle = INK;
    pen.fillText(words, left + x + line, below + row * line);
  });
}

function fileName() {
  const words = [document.title, `frame ${state.frame + 1}`, state.zones, state.chains ? "chains" : ""];
  return `${words.filter(Boolean).join(" ").replace(/[^A-Za-z0-9]+/g, "_").slice(0, 100)}.png`;
}

function savePicture() {
  picture().toBlob((blob) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = fileName();
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  }, "image/png");
}
