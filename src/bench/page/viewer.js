// All images of a scene in one place: exposure, flip, slider, differences, errors, zoom to the numbers.

/** Black, violet, red, yellow, white. */
function heat(t) {
  const stops = [[0, 0, 4], [87, 16, 110], [188, 55, 84], [249, 142, 9], [252, 255, 164]];
  const x = Math.min(Math.max(t, 0), 1) * 4, i = Math.min(Math.floor(x), 3);
  return stops[i].map((c, k) => c + (stops[i + 1][k] - c) * (x - i));
}
const HEAT = Array.from({ length: 256 }, (_, i) => heat(i / 255));
/** Decades of the relative error that the colours span. */
const ERROR_RANGE = [-2.5, 0.5];

/** Shown byte of every half at an exposure in stops; gamma 0 is the curve of sRGB. */
function toneTable(exposure, gamma) {
  const out = new Uint8ClampedArray(65536), scale = 2 ** exposure;
  for (let b = 0; b < 65536; b++) {
    const v = Math.min(Math.max(halves[b] * scale, 0), 1);
    out[b] = 255 * (gamma ? v ** (1 / gamma) : v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055) + 0.5;
  }
  return out;
}

function meanOf(image) {
  let sum = 0;
  for (const b of image.data) if (Number.isFinite(halves[b])) sum += halves[b];
  return sum / image.data.length;
}

/** |x − R| / (R + 0.1 mean R), mean over channels: the root of what relMSE sums. */
function relativeError(x, r, mean, i) {
  let sum = 0;
  for (let c = 3 * i; c < 3 * i + 3; c++) sum += Math.abs(halves[x.data[c]] - halves[r.data[c]]) / (Math.abs(halves[r.data[c]]) + 0.1 * mean);
  return sum / 3;
}

/** Fills ImageData bytes of a view. */
const painters = {
  one(bytes, { a, tone }) {
    for (let i = 0, o = 0; i < a.data.length; i += 3, o += 4) {
      bytes[o] = tone[a.data[i]]; bytes[o + 1] = tone[a.data[i + 1]]; bytes[o + 2] = tone[a.data[i + 2]]; bytes[o + 3] = 255;
    }
  },
  difference(bytes, { a, b, exposure }) {
    const scale = 127 * 2 ** exposure;
    for (let i = 0, o = 0; i < a.data.length; i += 3, o += 4) {
      for (let c = 0; c < 3; c++) bytes[o + c] = 128 + scale * (halves[a.data[i + c]] - halves[b.data[i + c]]);
      bytes[o + 3] = 255;
    }
  },
  error(bytes, { a, reference, mean }) {
    const [low, high] = ERROR_RANGE;
    for (let i = 0, o = 0; o < bytes.length; i++, o += 4) {
      const t = (Math.log10(relativeError(a, reference, mean, i) + 1e-9) - low) / (high - low);
      const colour = HEAT[Math.min(Math.max(Math.round(255 * t), 0), 255)];
      bytes[o] = colour[0]; bytes[o + 1] = colour[1]; bytes[o + 2] = colour[2]; bytes[o + 3] = 255;
    }
  },
};

/** Where images differ most in their errors: left upper corners of squares of `side` pixels. */
function differentRegions(images, side, count) {
  const [reference, ...others] = images, { width, height } = reference, mean = meanOf(reference);
  const step = Math.max(side >> 1, 1), columns = Math.floor(width / step), rows = Math.floor(height / step);
  const sums = new Float64Array(columns * rows);
  for (let y = 0; y < rows * step; y++) {
    for (let x = 0; x < columns * step; x++) {
      let low = others.length > 1 ? 1 : 0, high = 0;
      for (const other of others) {
        // Beyond 1 a pixel is wrong, and more of it is no more different.
        const e = Math.min(relativeError(other, reference, mean, y * width + x), 1);
        low = Math.min(low, e); high = Math.max(high, e);
      }
      sums[Math.floor(y / step) * columns + Math.floor(x / step)] += high - low;
    }
  }
  const places = [];
  for (let y = 0; y + 1 < rows || y === 0; y++) {
    for (let x = 0; x + 1 < columns || x === 0; x++) {
      const at = (dx, dy) => sums[Math.min(y + dy, rows - 1) * columns + Math.min(x + dx, columns - 1)] || 0;
      places.push({ x: x * step, y: y * step, worth: at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) });
    }
  }
  places.sort((a, b) => b.worth - a.worth);
  const chosen = [];
  for (const p of places) {
    if (chosen.length < count && chosen.every(c => Math.abs(c.x - p.x) >= side || Math.abs(c.y - p.y) >= side)) chosen.push(p);
  }
  return chosen;
}

class Viewer {
  constructor(images) {
    this.images = images;
    this.reference = images[0];
    this.mean = meanOf(this.reference);
    this.state = { a: Math.min(1, images.length - 1), b: 0, mode: "one", exposure: 0, gamma: 0, zoom: 1, x: 0.5, y: 0.5, split: 0.5 };
    this.pointers = new Map();
    this.layers = [document.createElement("canvas"), document.createElement("canvas")];
    for (const l of this.layers) [l.width, l.height] = [this.reference.width, this.reference.height];
    this.build();
    new ResizeObserver(() => this.fit()).observe(this.stage);
    this.select({});
  }

  build() {
    const button = (text, title, act) => h("button", { type: "button", title, click: act }, text);
    const range = (name, min, max, step, key) => h("input", { type: "range", min, max, step, "aria-label": name, "data-key": key, input: e => this.select({ [key]: +e.target.value }) });
    this.pick = this.images.map((im, i) => button(im.name, `key ${i}`, () => this.select({ a: i, b: this.state.a === i ? this.state.b : this.state.a })));
    this.modes = Object.entries({ one: ["one image", "key O"], slide: ["slider", "key S"], difference: ["difference", "key D"], error: ["error map", "key F"] })
      .map(([mode, [text, title]]) => h("button", { type: "button", title, "data-mode": mode, click: () => this.select({ mode }) }, text));
    this.other = h("select", { "aria-label": "Compared with", change: e => this.select({ b: +e.target.value }) }, this.images.map((im, i) => h("option", { value: i }, im.name)));
    this.exposure = range("Exposure in stops", -8, 8, 0.25, "exposure");
    this.gamma = range("Gamma, 0 for the curve of sRGB", 0, 3, 0.1, "gamma");
    this.shown = { exposure: h("output", {}), gamma: h("output", {}) };
    this.canvas = h("canvas", {});
    this.captions = [h("span", { class: "caption left" }), h("span", { class: "caption right" })];
    this.stage = h("div", { class: "stage", tabindex: "0", role: "img", "aria-label": "Rendered images; see the keys below",
      style: `aspect-ratio:${this.reference.width}/${this.reference.height};max-height:80vh;margin-inline:auto` }, this.canvas, this.captions);
    this.readout = h("div", { class: "readout", "aria-live": "off" });
    this.legend = h("div", { class: "legend" });
    this.listen();
    this.root = h("div", { class: "viewer" },
      h("div", { class: "controls" }, h("span", { class: "group", role: "group", "aria-label": "Image" }, this.pick),
        h("span", { class: "group", role: "group", "aria-label": "View" }, this.modes), h("label", {}, "with", this.other)),
      this.stage, this.readout, this.legend,
      h("div", { class: "controls" }, h("label", {}, "exposure", this.exposure, this.shown.exposure), h("label", {}, "gamma", this.gamma, this.shown.gamma),
        button("+", "key +", () => this.magnify(2)), button("−", "key −", () => this.magnify(0.5)), button("reset", "key 0 (zero) twice", () => this.reset())),
      h("details", {}, h("summary", {}, "Keys and fingers"), h("p", {}, "Digits choose an image (0 the reference), space or a click flips to the image before and back, arrows go through all. ",
        "E and shift-E change exposure, G the gamma; O one image, S slider, D difference, F error map; + and − or the wheel or two fingers zoom, dragging moves; ",
        "in the slider, dragging moves the edge. Zoom far enough to read the numbers of pixels. R resets.")));
  }

  /** Changes the state and shows it. */
  select(change) {
    Object.assign(this.state, change);
    const s = this.state;
    s.exposure = Math.min(Math.max(s.exposure, -8), 8);
    this.pick.forEach((b, i) => b.setAttribute("aria-pressed", i === s.a));
    this.modes.forEach(b => b.setAttribute("aria-pressed", b.dataset.mode === s.mode));
    this.other.value = s.b;
    this.exposure.value = s.exposure;
    this.gamma.value = s.gamma;
    this.shown.exposure.value = `${s.exposure > 0 ? "+" : ""}${s.exposure} EV`;
    this.shown.gamma.value = s.gamma ? s.gamma.toFixed(1) : "sRGB";
    this.paint();
  }

  reset() { this.select({ zoom: 1, x: 0.5, y: 0.5, exposure: 0, gamma: 0, split: 0.5, mode: "one" }); }

  magnify(factor, at = [0.5, 0.5]) {
    const s = this.state, zoom = Math.min(Math.max(s.zoom * factor, 1), this.reference.width / 4);
    // What is under the pointer stays there.
    const x = s.x + (at[0] - 0.5) * (1 / s.zoom - 1 / zoom), y = s.y + (at[1] - 0.5) * (1 / s.zoom - 1 / zoom);
    this.move(x, y, zoom);
  }

  move(x, y, zoom = this.state.zoom) {
    const half = 0.5 / zoom, inside = v => Math.min(Math.max(v, half), 1 - half);
    Object.assign(this.state, { zoom, x: inside(x), y: inside(y) });
    this.draw();
  }

  /** Pixels of the images anew. */
  paint() {
    const s = this.state, [a, b] = [this.images[s.a], this.images[s.b]], tone = toneTable(s.exposure, s.gamma);
    const fill = (layer, painter, view) => {
      const context = layer.getContext("2d"), data = context.createImageData(layer.width, layer.height);
      painter(data.data, { tone, exposure: s.exposure, reference: this.reference, mean: this.mean, b, ...view });
      context.putImageData(data, 0, 0);
    };
    fill(this.layers[0], painters[s.mode] ?? painters.one, { a });
    if (s.mode === "slide") fill(this.layers[1], painters.one, { a: b });
    this.captions[0].textContent = { one: a.name, slide: a.name, difference: `${a.name} − ${b.name}, grey is none`, error: `error of ${a.name}` }[s.mode];
    this.captions[1].textContent = s.mode === "slide" ? b.name : "";
    this.captions[1].hidden = s.mode !== "slide";
    this.showLegend();
    this.draw();
  }

  showLegend() {
    if (this.state.mode !== "error") return this.legend.replaceChildren();
    const bar = h("canvas", { width: 256, height: 1 }), context = bar.getContext("2d");
    HEAT.forEach((c, i) => { context.fillStyle = `rgb(${c.map(Math.round)})`; context.fillRect(i, 0, 1, 1); });
    const percent = e => `${digits(100 * 10 ** e)} %`;
    this.legend.replaceChildren(percent(ERROR_RANGE[0]), bar, percent(ERROR_RANGE[1]), " |image − reference| / (reference + 0.1 mean)");
  }

  fit() {
    const scale = window.devicePixelRatio || 1, { clientWidth, clientHeight } = this.stage;
    [this.canvas.width, this.canvas.height] = [Math.max(Math.round(clientWidth * scale), 1), Math.max(Math.round(clientHeight * scale), 1)];
    this.draw();
  }

  /** From image pixels to canvas: origin and size of a pixel. */
  geometry() {
    const { zoom, x, y } = this.state, { width } = this.reference, pixel = this.canvas.width * zoom / width;
    return { pixel, left: this.canvas.width * (0.5 - x * zoom), top: this.canvas.height * (0.5 - y * zoom) };
  }

  draw() {
    const context = this.canvas.getContext("2d"), { pixel, left, top } = this.geometry(), { width, height } = this.reference;
    context.fillStyle = "#000";
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    context.imageSmoothingEnabled = pixel < 1;
    const show = layer => context.drawImage(layer, left, top, width * pixel, height * pixel);
    show(this.layers[0]);
    if (this.state.mode === "slide") {
      const edge = this.state.split * this.canvas.width;
      context.save();
      context.beginPath();
      context.rect(edge, 0, this.canvas.width - edge, this.canvas.height);
      context.clip();
      show(this.layers[1]);
      context.restore();
      context.fillStyle = "#fff";
      context.fillRect(edge - 1, 0, 2, this.canvas.height);
    }
    const scale = window.devicePixelRatio || 1;
    if (pixel / scale >= 44) this.numbers(context, pixel, left, top, scale);
  }

  /** The numbers of every pixel in view, in its middle. */
  numbers(context, pixel, left, top, scale) {
    const s = this.state, { width, height } = this.reference;
    context.font = `${Math.round(10.5 * scale)}px ui-monospace, monospace`;
    context.textAlign = "center";
    context.lineWidth = 3 * scale;
    const from = v => Math.max(Math.floor(-v / pixel), 0), to = (v, size, all) => Math.min(Math.ceil((size - v) / pixel), all);
    for (let y = from(top); y < to(top, this.canvas.height, height); y++) {
      for (let x = from(left); x < to(left, this.canvas.width, width); x++) {
        const middle = left + (x + 0.5) * pixel;
        const image = this.images[s.mode === "slide" && middle > s.split * this.canvas.width ? s.b : s.a];
        for (let c = 0; c < 3; c++) {
          const text = digits(halves[image.data[3 * (y * width + x) + c]]), line = top + (y + 0.5) * pixel + (c - 0.7) * 12 * scale;
          context.strokeStyle = "#000";
          context.strokeText(text, middle, line);
          context.fillStyle = ["#ff9c9c", "#9dffa8", "#a9c6ff"][c];
          context.fillText(text, middle, line);
        }
      }
    }
  }

  /** Place of an event: share of the stage, and pixel. */
  place(event) {
    const box = this.stage.getBoundingClientRect(), at = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    const s = this.state, share = (v, k) => s[k] + (v - 0.5) / s.zoom;
    return { at, pixel: [Math.floor(share(at[0], "x") * this.reference.width), Math.floor(share(at[1], "y") * this.reference.height)] };
  }

  tell([x, y]) {
    const { width, height } = this.reference;
    if (x < 0 || y < 0 || x >= width || y >= height) return;
    const of = im => [0, 1, 2].map(c => digits(halves[im.data[3 * (y * width + x) + c]]).padStart(9)).join("");
    const longest = Math.max(...this.images.map(im => im.name.length));
    this.readout.textContent = [`pixel ${x}, ${y}`, ...this.images.map(im => `${im.name.padEnd(longest)} ${of(im)}`)].join("\n");
  }

  flip() { this.select({ a: this.state.b, b: this.state.a }); }

  listen() {
    const on = (name, act, options) => this.stage.addEventListener(name, act, options);
    on("pointerdown", e => {
      this.stage.focus({ preventScroll: true });
      try { this.stage.setPointerCapture(e.pointerId); } catch { /* a pointer that is gone already */ }
      this.pointers.set(e.pointerId, e);
      this.moved = 0;
    });
    on("pointermove", e => {
      this.tell(this.place(e).pixel);
      const before = this.pointers.get(e.pointerId);
      if (!before) return;
      const box = this.stage.getBoundingClientRect(), dx = e.clientX - before.clientX, dy = e.clientY - before.clientY;
      this.moved += Math.abs(dx) + Math.abs(dy);
      if (this.pointers.size === 2) {
        const other = [...this.pointers.values()].find(p => p.pointerId !== e.pointerId);
        const distance = p => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY);
        this.magnify(distance(e) / Math.max(distance(before), 1), this.place({ clientX: (e.clientX + other.clientX) / 2, clientY: (e.clientY + other.clientY) / 2 }).at);
      } else if (this.state.mode === "slide") {
        this.state.split = Math.min(Math.max(this.place(e).at[0], 0), 1);
        this.draw();
      } else {
        this.move(this.state.x - dx / box.width / this.state.zoom, this.state.y - dy / box.height / this.state.zoom);
      }
      this.pointers.set(e.pointerId, e);
    });
    const end = e => {
      const single = this.pointers.size === 1;
      if (this.pointers.delete(e.pointerId) && single && this.moved < 6 && e.type === "pointerup" && this.state.mode !== "slide") this.flip();
    };
    on("pointerup", end);
    on("pointercancel", end);
    on("wheel", e => { e.preventDefault(); this.magnify(Math.exp(-e.deltaY / 300), this.place(e).at); }, { passive: false });
    on("keydown", e => this.key(e));
  }

  key(e) {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const s = this.state, n = this.images.length, go = i => this.select({ a: i, b: s.a });
    const acts = {
      " ": () => this.flip(), ArrowRight: () => go((s.a + 1) % n), ArrowLeft: () => go((s.a + n - 1) % n),
      e: () => this.select({ exposure: s.exposure + 0.5 }), E: () => this.select({ exposure: s.exposure - 0.5 }),
      g: () => this.select({ gamma: s.gamma === 0 ? 2.2 : s.gamma === 2.2 ? 1 : 0 }),
      o: () => this.select({ mode: "one" }), s: () => this.select({ mode: "slide" }), d: () => this.select({ mode: "difference" }), f: () => this.select({ mode: "error" }),
      "+": () => this.magnify(2), "=": () => this.magnify(2), "-": () => this.magnify(0.5), r: () => this.reset(),
    };
    const digit = /^[0-9]$/.test(e.key) && +e.key < n ? () => go(+e.key) : null;
    const act = digit ?? acts[e.key];
    if (act) { e.preventDefault(); act(); }
  }

  /** Shows a square of the image. */
  focusOn(x, y, side) {
    const { width, height } = this.reference;
    this.move((x + side / 2) / width, (y + side / 2) / height, Math.max(width / side / 3, 1));
    this.stage.scrollIntoView({ block: "nearest" });
  }
}

/** The same squares of all images beside each other. */
function cropGrid(viewer) {
  const images = viewer.images, side = Math.max(Math.min(48, viewer.reference.width >> 2, viewer.reference.height >> 2), 4), tone = toneTable(0, 0);
  const regions = differentRegions(images, side, 4);
  const grid = h("div", { class: "crops", style: `grid-template-columns:repeat(${images.length},minmax(5.5rem,1fr))` }, images.map(im => h("div", {}, im.name)));
  for (const r of regions) {
    images.forEach((im, i) => {
      const canvas = h("canvas", { width: side, height: side }), context = canvas.getContext("2d"), data = context.createImageData(side, side);
      for (let y = 0; y < side; y++) {
        for (let x = 0; x < side; x++) {
          const from = 3 * (Math.min(r.y + y, im.height - 1) * im.width + Math.min(r.x + x, im.width - 1)), to = 4 * (y * side + x);
          for (let c = 0; c < 3; c++) data.data[to + c] = tone[im.data[from + c]];
          data.data[to + 3] = 255;
        }
      }
      context.putImageData(data, 0, 0);
      const show = () => { viewer.select({ a: i, b: i ? 0 : viewer.state.b, mode: "one" }); viewer.focusOn(r.x, r.y, side); };
      grid.append(h("button", { type: "button", title: `${im.name} around ${r.x}, ${r.y}`, "aria-label": `${im.name} around ${r.x}, ${r.y}`, click: show }, canvas));
    });
  }
  return grid;
}
