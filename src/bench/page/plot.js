// Error over time or samples, both axes logarithmic, as SVG.

function plot(scene, measure, axis) {
  // In the units of its text, so that it can be read on a narrow screen.
  const W = Math.min(720, Math.max(360, document.documentElement.clientWidth - 24)), H = W < 520 ? 320 : 400, L = 54, T = 14, B = 40;
  // Room for the names at the right; those of peers are long.
  const letter = 7.6, longest = Math.max(...scene.contenders.map(c => c.name.length)), R = Math.min(Math.max(104, letter * longest + 16), 0.34 * W);
  const half = Math.floor((R - 16) / letter / 2), short = name => name.length <= 2 * half ? name : `${name.slice(0, half)}…${name.slice(1 - half)}`;
  const of = p => measures[measure].floor(p);
  const curves = scene.contenders.map(c => c.runs.map(r => r.curve.filter(p => p[measure] > 0)));
  const points = curves.flat(2);
  if (points.length === 0) return h("p", { class: "note" }, "Nothing to plot.");
  const xs = points.map(p => p[axis]).filter(x => x > 0), ys = points.map(p => p[measure]);
  let [x0, x1] = [Math.min(...xs), Math.max(...xs)], [y0, y1] = [Math.min(...ys), Math.max(...ys)];
  if (x1 <= x0) [x0, x1] = [x0 / 2, x1 * 2];
  [y0, y1] = [y0 / 1.3, y1 * 1.3];
  const X = x => L + (W - L - R) * Math.log(x / x0) / Math.log(x1 / x0), Y = y => T + (H - T - B) * Math.log(y1 / y) / Math.log(y1 / y0);
  const svg = h("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `${measures[measure].name} over ${axis}` });
  for (const [low, high, line] of [[x0, x1, true], [y0, y1, false]]) {
    const ticks = [], decades = Math.log10(high / low);
    for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e++) {
      for (const m of decades > 2.5 ? [1] : decades > 1 ? [1, 3] : [1, 2, 5]) ticks.push(m * 10 ** e);
    }
    for (const t of ticks.filter(t => t >= low && t <= high)) {
      const [x, y] = [X(t), Y(t)];
      svg.append(line ? h("line", { class: "grid", x1: x, x2: x, y1: T, y2: H - B }) : h("line", { class: "grid", x1: L, x2: W - R, y1: y, y2: y }));
      svg.append(line ? h("text", { x, y: H - B + 18, "text-anchor": "middle" }, digits(t)) : h("text", { x: L - 8, y: y + 4, "text-anchor": "end" }, digits(t)));
    }
  }
  svg.append(h("text", { x: (L + W - R) / 2, y: H - 4, "text-anchor": "middle" }, axis === "seconds" ? "seconds" : "samples per pixel"));
  const floor = of(points.at(-1));
  if (floor > y0 && floor < y1) {
    svg.append(h("line", { class: "floor", x1: L, x2: W - R, y1: Y(floor), y2: Y(floor) }, h("title", {}, "what the noise of the reference adds")));
    svg.append(h("text", { x: L + 4, y: Y(floor) - 5 }, "noise of the reference"));
  }
  const ends = [];
  const path = line => line.map((p, i) => `${i ? "L" : "M"}${X(p[0]).toFixed(1)} ${Y(p[1]).toFixed(1)}`).join("");
  curves.forEach((runs, i) => {
    if (!runs.some(r => r.length)) return;
    const stroke = colour(i);
    for (const run of runs) svg.append(h("path", { class: "run", stroke, d: path(run.map(p => [p[axis], p[measure]])) }));
    const n = Math.max(...runs.map(r => r.length)), mean = [];
    for (let k = 0; k < n; k++) {
      // Runs may lack their first checkpoints; from the end they are alike.
      const at = runs.map(r => r[r.length - n + k]).filter(p => p);
      const geometric = key => Math.exp(at.reduce((s, p) => s + Math.log(p[key]), 0) / at.length);
      mean.push([geometric(axis), geometric(measure)]);
    }
    svg.append(h("path", { class: "mean", stroke, d: path(mean) }));
    for (const [x, y] of mean) {
      svg.append(h("circle", { cx: X(x), cy: Y(y), r: 3.2, fill: stroke }, h("title", {}, `${scene.contenders[i].name}: ${digits(y)} at ${digits(x)} ${axis}`)));
    }
    ends.push({ y: Y(mean.at(-1)[1]), x: X(mean.at(-1)[0]), i });
  });
  ends.sort((a, b) => a.y - b.y);
  ends.forEach((e, k) => { if (k && e.y < ends[k - 1].y + 15) e.y = ends[k - 1].y + 15; });
  for (const e of ends) svg.append(h("text", { x: W - R + 8, y: e.y + 4, style: `fill:${colour(e.i)};font-weight:600` }, short(scene.contenders[e.i].name), h("title", {}, scene.contenders[e.i].name)));
  return svg;
}

/** The plot with its choices. */
function plotPanel(scene) {
  const holder = h("div", {});
  const measure = h("select", { "aria-label": "Measure", change: draw }, Object.entries(measures).map(([k, m]) => h("option", { value: k }, m.name)));
  const axis = h("select", { "aria-label": "Horizontal axis", change: draw }, h("option", { value: "seconds" }, "over time"), h("option", { value: "samples" }, "over samples"));
  function draw() { holder.replaceChildren(plot(scene, measure.value, axis.value)); }
  draw();
  return h("div", { class: "plot" }, h("div", { class: "controls" }, measure, axis), holder,
    h("p", { class: "note" }, "Thin lines are runs, thick ones their geometric mean. An estimate without bias falls as 1/time in relMSE; a curve that levels off misses light, or has come down to the noise of the reference."));
}
