// What the page is about, how numbers are shown, and pixels out of their compressed form.
const report = JSON.parse(document.getElementById("report").textContent);

/** An element with attributes (functions are listeners) and children. */
function h(tag, attributes = {}, ...children) {
  const svg = ["svg", "g", "path", "line", "circle", "text", "rect", "title"].includes(tag);
  const e = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") e.addEventListener(name, value);
    else if (value !== null && value !== undefined && value !== false) e.setAttribute(name, value === true ? "" : value);
  }
  e.append(...children.flat().filter(c => c !== null && c !== undefined));
  return e;
}

/** A number in three digits. */
function digits(x) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  const a = Math.abs(x);
  if (a === 0) return "0";
  if (a >= 1e5 || a < 1e-3) return x.toExponential(1).replace("e+", "e").replace("-", "−").replace("e-", "e−");
  return String(Number(x.toPrecision(3))).replace("-", "−");
}

/** "value ± half" of an interval, the latter small. */
function withInterval(i, scale = 1, unit = "") {
  if (!i) return "–";
  const half = i.bounds ? (i.bounds[1] - i.bounds[0]) / 2 : null;
  return h("span", {}, digits(i.value * scale) + unit, half === null ? null : h("small", {}, ` ± ${digits(half * scale)}`));
}

/** Colour of a contender, as a CSS value; the reference has the colour of text. */
const colour = i => i < 0 ? "var(--ink)" : `var(--c${i % 8})`;

/** Every half float as a number. */
const halves = (() => {
  const out = new Float32Array(65536);
  for (let b = 0; b < 65536; b++) {
    const sign = b & 0x8000 ? -1 : 1, e = b >> 10 & 31, m = b & 1023;
    out[b] = sign * (e === 0 ? m * 2 ** -24 : e === 31 ? (m ? NaN : Infinity) : (1 + m / 1024) * 2 ** (e - 15));
  }
  return out;
})();

/** Pixels of an image element: { name, width, height, data } with three halves per pixel. */
async function decode(element) {
  const { name } = element.dataset, width = +element.dataset.width, height = +element.dataset.height;
  const packed = Uint8Array.from(atob(element.textContent), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const n = width * height, data = new Uint16Array(3 * n);
  const at = (plane, i) => bytes[2 * plane * n + i] << 8 | bytes[(2 * plane + 1) * n + i];
  let left = 0;
  for (let i = 0; i < n; i++) {
    if (i % width === 0) left = 0;
    const g = at(0, i) + left & 65535;
    data[3 * i] = at(1, i) + g;
    data[3 * i + 1] = g;
    data[3 * i + 2] = at(2, i) + g;
    left = g;
  }
  return { name, width, height, data };
}

/** All images of a scene, the reference first. */
async function imagesOf(scene) {
  const elements = [...document.querySelectorAll(`script.pixels[data-scene="${scene}"]`)];
  return Promise.all(elements.map(decode));
}
