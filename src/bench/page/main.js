// The page from top to bottom.

/** A choice of contender or mark that redraws what follows. */
function choice(name, options, value, act) {
  const select = h("select", { "aria-label": name, change: e => act(e.target.value) }, options.map(([v, text]) => h("option", { value: v }, text)));
  select.value = value;
  return h("label", {}, name, select);
}

function figuresPanel(scene) {
  let mark = report.marks.at(-1), base = 0;
  const holder = h("div", {});
  const draw = () => holder.replaceChildren(summaryTable(scene, mark, base));
  draw();
  return h("div", {}, h("div", { class: "controls" },
    choice("relative to", scene.contenders.map((c, i) => [i, c.name]), 0, v => { base = +v; draw(); }),
    report.marks.length > 1 ? choice("after", report.marks.map(m => [m, m]), mark, v => { mark = v; draw(); }) : null), holder);
}

function scenePanel(scene, index) {
  const section = h("section", { id: `scene-${index}` }, h("h2", {}, scene.name));
  if (scene.failure) {
    section.append(h("p", { class: "alert" }, "This scene could not be run:"), h("pre", {}, scene.failure));
    return section;
  }
  const r = scene.reference, [w, hh] = scene.size;
  section.append(h("div", { class: "verdict" }, scene.verdict.map(v => h("p", {}, v))), figuresPanel(scene));
  const reference = [`${w} × ${hh} pixels. Reference: ${r.origin}`, r.error === null ? ", its noise is not known" : `, standard error ${digits(100 * r.error)} % (wanted ${digits(100 * r.wanted)} %)`];
  section.append(h("p", { class: "note" }, reference.join(""), ". Errors are means over runs with 95 % intervals, ratios come from pairs of runs; a ratio above 1 means more error. ", r.warning ?? ""));
  section.append(...scene.contenders.filter(c => c.remark).map(c => h("p", { class: "note" }, `${c.name}: ${c.remark}`)));
  section.append(h("details", {}, h("summary", {}, "Time, rays and memory"), workTable(scene)));
  section.append(h("h3", {}, "Error over time"), plotPanel(scene));
  section.append(...[classPanel(scene), pyramidPanel(scene), costPanel(scene)].filter(p => p));
  const images = h("div", { class: "images" }, h("p", { class: "note" }, "Decoding images …"));
  section.append(h("h3", {}, "Images"), images);
  imagesOf(index).then(all => {
    if (all.length === 0) return images.replaceChildren(h("p", { class: "note" }, "No image was finished."));
    const viewer = new Viewer(all);
    images.replaceChildren(viewer.root);
    if (all.length > 1) images.append(h("h3", {}, "Where they differ most"), cropGrid(viewer));
    if (all[0].width !== w) images.append(h("p", { class: "note" }, `Images are shown at ${all[0].width} × ${all[0].height} pixels to keep the page small.`));
    viewer.fit();
  }).catch(e => images.replaceChildren(h("p", { class: "alert" }, `The images cannot be decoded: ${e.message}`)));
  return section;
}

(function page() {
  const main = document.getElementById("main");
  document.getElementById("facts").textContent = `nephroid ${report.version}, ${report.threads} thread${report.threads === 1 ? "" : "s"}` +
    `${report.machine ? ` of ${report.machine}` : ""}; ${report.runs} run${report.runs === 1 ? "" : "s"} of each to ${report.marks.join(", ")}.`;
  document.getElementById("contents").append(...report.scenes.map((s, i) => h("a", { href: `#scene-${i}` }, s.name)));
  document.getElementById("command").append("Made by ", h("code", {}, report.command));
  main.replaceChildren();
  if (report.interrupted) main.append(h("p", { class: "alert" }, "Interrupted: this is what was done until then."));
  if (report.runs === 1) main.append(h("p", { class: "note" }, "One run of each: there are no intervals, hence no ratios. Use --runs 3."));
  const names = [...new Set(report.scenes.flatMap(s => s.contenders.map(c => c.name)))];
  if (report.scenes.length > 1 && names.length > 1) {
    const holder = h("div", {}), draw = base => holder.replaceChildren(overview(base));
    draw(names[0]);
    main.append(h("h3", {}, `relMSE without the worst 0.1 % of pixels at ${report.marks.at(-1)}`),
      h("div", { class: "controls" }, choice("relative to", names.map(n => [n, n]), names[0], draw)), holder);
  }
  main.append(...report.scenes.map(scenePanel));
})();
