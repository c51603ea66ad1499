// Figures as tables.

const measures = {
  relmse_trimmed: { name: "relMSE without the worst 0.1 % of pixels", floor: p => p.noise.relmse_trimmed },
  relmse: { name: "relMSE", floor: p => p.noise.relmse },
  rmse: { name: "RMSE", floor: p => Math.sqrt(p.noise.mse) },
  flip: { name: "FLIP", floor: () => 0 },
};

/** `above` are cells of a row over the head. */
function table(head, rows, above = null) {
  const cells = (row, tag) => row.map(c => c instanceof Node && ["TD", "TH"].includes(c.nodeName) ? c : h(tag, {}, c));
  return h("div", { class: "scroll", tabindex: "0" }, h("table", {},
    h("thead", {}, above && h("tr", {}, cells(above, "th")), h("tr", {}, cells(head, "th"))), h("tbody", {}, rows.map(r => h("tr", {}, cells(r, "td"))))));
}

const label = (c, i) => h("span", {}, h("span", { class: "swatch", style: `background:${colour(i)}` }), c.name);

/** Error of `a` over that of `b` as a cell: how many times better or worse, with its interval, or why there is none. */
function ratioCell(scene, a, b, measure, mark) {
  const r = scene.ratios.find(r => r.a === a && r.b === b && r.measure === measure && r.mark === mark);
  if (a === b) return h("td", {}, h("small", {}, "1"));
  if (!r || !r.ratio) return h("td", {}, h("small", {}, r ? r.why_not : "–"));
  const [low, high] = r.ratio.bounds;
  const kind = !r.significant ? "" : r.ratio.value < 1 ? "good" : "bad";
  return h("td", { class: kind, title: r.significant ? "" : "no more than chance explains" },
    digits(r.ratio.value), h("small", {}, ` (${digits(low)} … ${digits(high)})`));
}

/** All contenders of a scene at a mark, errors relative to contender `base`. */
function summaryTable(scene, mark, base) {
  const at = c => c.summary?.errors.find(e => e.mark === mark);
  const last = mark === report.marks.at(-1);
  const least = Math.min(...scene.contenders.map(c => at(c)?.relmse_trimmed?.value ?? Infinity));
  const times = `× ${scene.contenders[base]?.name}`;
  const head = ["", "relMSE trimmed", times, "relMSE", "FLIP", ...(last ? ["variance · time", times] : []), "slope", "light found"];
  const rows = scene.contenders.map((c, i) => {
    const e = at(c), s = c.summary;
    if (!e) return [label(c, i), h("td", { colspan: 4, class: "alert" }, c.failure ?? "no run was finished")];
    const trimmed = h("td", { class: e.relmse_trimmed?.value === least ? "best" : "" }, withInterval(e.relmse_trimmed));
    const cost = s.efficiency && { value: 1 / s.efficiency.value, bounds: s.efficiency.bounds && [1 / s.efficiency.bounds[1], 1 / s.efficiency.bounds[0]] };
    const bias = s.energy?.bounds && (s.energy.bounds[0] > 1 || s.energy.bounds[1] < 1);
    return [label(c, i), trimmed, ratioCell(scene, i, base, "relmse_trimmed", mark),
      h("td", {}, withInterval(e.relmse), e.below_reference ? h("small", {}, " ≲ reference") : null), withInterval(e.flip),
      ...(last ? [withInterval(cost), ratioCell(scene, i, base, "cost", mark)] : []),
      withInterval(s.slope), h("td", { class: bias ? "bad" : "" }, withInterval(s.energy, 100, " %"))];
  });
  return table(head, rows);
}

/** Rays, memory, samples. */
function workTable(scene) {
  const rows = scene.contenders.filter(c => c.summary).map(c => {
    const s = c.summary, runs = c.runs, rays = k => runs[0].rays ? digits(runs.reduce((t, r) => t + r.rays[k], 0) / runs.length / s.seconds / 1e6) : "–";
    return [label(c, scene.contenders.indexOf(c)), digits(s.seconds), digits(s.samples), withInterval(s.rate), rays("gather"), rays("shoot"),
      rays("shadow"), s.memory ? digits(s.memory / 1e6) : "–", withInterval(s.errors.at(-1).rmse), withInterval(s.variance), String(runs.length)];
  });
  return table(["", "seconds", "samples per pixel", "per second", "gathering Mrays/s", "shooting", "shadow", "memory MB", "RMSE", "variance", "runs"], rows);
}

/** Over all scenes: error relative to the base, in one look. */
function overview(base) {
  const names = [...new Set(report.scenes.flatMap(s => s.contenders.map(c => c.name)))];
  const mark = report.marks.at(-1);
  const rows = report.scenes.map((s, i) => {
    const link = h("a", { href: `#scene-${i}` }, s.name);
    if (s.failure) return [link, h("td", { colspan: names.length, class: "alert" }, "failed")];
    const b = s.contenders.findIndex(c => c.name === base);
    return [link, ...names.map(n => {
      const a = s.contenders.findIndex(c => c.name === n);
      return a < 0 || b < 0 ? "–" : ratioCell(s, a, b, "relmse_trimmed", mark);
    })];
  });
  return table(["", ...names], rows);
}

const CLASSES = [["E L", "lamps seen directly"], ["E S+ L", "lamps in mirrors and through glass"], ["E D L", "direct light"],
  ["E D D+ L", "indirect light between matt surfaces"], ["E D .* S L", "caustics"], ["E D .* S .* D L", "light by way of mirrors and glass"],
  ["E S .* D L", "lit surfaces in mirrors and through glass"], ["E S .* D .* S L", "caustics in mirrors and through glass"]];

const percent = x => Number.isFinite(x) ? x === 0 ? "–" : x < 0.0005 ? "<0.1" : (100 * x).toFixed(1) : "–";

/** A cell whose ground says how much. */
const shade = (x, text) => h("td", { style: `background:color-mix(in srgb, var(--accent) ${Math.round(60 * Math.min(Math.max(x, 0), 1))}%, transparent)` }, text);

/** Joins by length: share of the light and of the noise of one estimator. */
function pyramid(c, key) {
  const all = c.layers.techniques, total = all.flatMap(t => t[1]).reduce((s, x) => s + x[key], 0);
  const lengths = all[0][1].map((_, k) => k).filter(k => all.some(t => t[1][k].energy > 0));
  const rows = all.map(([name, shares]) => {
    const sum = shares.reduce((s, x) => s + x[key], 0) / total;
    return [name, ...lengths.map(k => shade(Math.sqrt(shares[k][key] / total), percent(shares[k][key] / total))), h("td", { class: "best" }, percent(sum))];
  });
  return table(["", ...lengths.map(k => k + 1 === all[0][1].length ? `${k + 1}+` : String(k + 1)), "all"], rows);
}

function pyramidPanel(scene) {
  const known = scene.contenders.filter(c => c.layers?.techniques.length);
  if (!known.length) return null;
  let chosen = known.find(c => c.name === "bidirectional") ?? known[0], key = "energy";
  const holder = h("div", {}), draw = () => holder.replaceChildren(pyramid(chosen, key));
  draw();
  return h("div", {}, h("h3", {}, "Which join finds what"), h("div", { class: "controls" },
    choice("estimator", known.map(c => [c.name, c.name]), chosen.name, v => { chosen = known.find(c => c.name === v); draw(); }),
    choice("share of", [["energy", "the light, %"], ["noise", "the noise, %"]], key, v => { key = v; draw(); })), holder,
    h("p", { class: "note" }, "Columns are lengths of paths in edges: 1 is a lamp seen directly, 2 direct light."));
}

/** Classes of paths: what each estimator finds of the reference, and how efficiently. */
function classPanel(scene) {
  const known = scene.contenders.filter(c => c.layers);
  if (!known.length) return null;
  const efficiency = (c, k) => 1 / (c.layers.classes[k].noise * c.summary.seconds / c.summary.samples);
  const above = ["", ...known.map(c => h("th", { colspan: 3 }, label(c, scene.contenders.indexOf(c))))];
  const head = ["", ...known.flatMap(() => ["light %", "noise %", "efficiency"])];
  const rows = CLASSES.map(([paths, what], k) => [k, paths, what]).filter(([k]) => known.some(c => c.layers.classes[k].energy > 0)).map(([k, paths, what]) => {
    const found = Math.max(...known.map(c => c.layers.classes[k].energy));
    const best = Math.max(...known.filter(c => c.layers.classes[k].energy > 0.9 * found).map(c => efficiency(c, k)).filter(Number.isFinite));
    return [h("span", {}, what, h("br"), h("small", {}, paths)), ...known.flatMap(c => {
      const s = c.layers.classes[k], noise = c.layers.classes.reduce((t, x) => t + x.noise, 0), e = efficiency(c, k);
      return [h("td", { class: s.energy < 0.5 * found ? "bad" : "" }, percent(s.energy)), percent(s.noise / noise),
        h("td", { class: e === best ? "best good" : "" }, s.energy > 0 && Number.isFinite(e) ? digits(e) : "–")];
    })];
  });
  return h("div", {}, h("h3", {}, "Classes of paths"), table(head, rows, above),
    h("p", { class: "note" }, "Light is relative to that of the reference, noise to that of the estimator; efficiency is 1 / (variance · time) for this class. E is the eye, L the light, D a matt or glossy event, S a mirror or smooth glass."));
}

/** No coupling, some, all. */
function costPanel(scene) {
  if (!scene.cost.length) return null;
  const rows = scene.cost.map(c => [h("span", {}, c.coupling, " ", h("small", {}, c.estimator)), withInterval(c.seconds, 1000), digits(c.samples),
    withInterval(c.relmse), withInterval(c.missing, 100, " %")]);
  return h("div", {}, h("h3", {}, "What coupling costs"), table(["coupling", "ms per sample of all pixels", "samples", "relMSE then", "light missing"], rows));
}
