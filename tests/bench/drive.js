// Drives every element of a bench page once and says what came of it, as JSON in the element `driven`.
(async () => {
  const result = { checks: {}, driven: 0, errors: window.errors };
  const check = (name, ok) => { result.checks[name] = Boolean(ok); };
  const wait = ms => new Promise(r => setTimeout(r, ms));
  const all = selector => [...document.querySelectorAll(selector)];
  const fire = (e, event) => { e.dispatchEvent(event); result.driven++; };
  try {
    const scenes = report.scenes.filter(s => !s.failure).length;
    for (let i = 0; i < 200 && all(".viewer").length < scenes; i++) await wait(50);
    check("every scene has a viewer", all(".viewer").length === scenes);
    check("no image failed to be decoded", all(".images .alert").length === 0);
    for (const s of all("select")) {
      for (const o of s.options) { s.value = o.value; fire(s, new Event("change", { bubbles: true })); }
      s.selectedIndex = 0;
      fire(s, new Event("change", { bubbles: true }));
    }
    check("plots have a line for every contender", all(".plot svg").every((svg, i) => svg.querySelectorAll(".mean").length === report.scenes.filter(s => !s.failure)[i].contenders.length));
    for (const d of all("summary")) fire(d, new MouseEvent("click", { bubbles: true, cancelable: true }));
    check("details open", all("details").every(d => d.open));
    for (const a of all("nav a")) check(`there is ${a.hash}`, document.querySelector(a.hash));
    for (const [n, viewer] of all(".viewer").entries()) {
      const stage = viewer.querySelector(".stage"), canvas = stage.querySelector("canvas");
      const pixels = () => { const d = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data; let h = 0; for (let i = 0; i < d.length; i += 4) h = (h * 31 + d[i] + 7 * d[i + 1] + 13 * d[i + 2]) | 0; return h; };
      const changes = (name, act) => { const before = pixels(); act(); check(`viewer ${n}: ${name}`, pixels() !== before); };
      const same = (name, act) => { const before = pixels(); act(); check(`viewer ${n}: ${name}`, pixels() === before); };
      const key = k => fire(stage, new KeyboardEvent("keydown", { key: k, bubbles: true, cancelable: true }));
      const box = stage.getBoundingClientRect();
      const pointer = (type, x, y, id = 1, kind = "mouse") => fire(stage, new PointerEvent(type, { pointerId: id, pointerType: kind, isPrimary: id === 1, bubbles: true, clientX: box.left + x * box.width, clientY: box.top + y * box.height }));
      for (const b of viewer.querySelectorAll("button")) fire(b, new MouseEvent("click", { bubbles: true }));
      key("r");
      key("0");
      changes("another image by key", () => key("1"));
      same("space flips there and back", () => { key(" "); key(" "); });
      changes("a click flips", () => { pointer("pointerdown", .5, .5); pointer("pointerup", .5, .5); });
      same("arrows go through all", () => { for (let i = 0; i < viewer.querySelectorAll(".group")[0].children.length; i++) key("ArrowRight"); });
      changes("exposure by key", () => key("e"));
      same("exposure back", () => { key("e"); key("E"); });
      changes("gamma by key", () => key("g"));
      key("r");
      for (const range of viewer.querySelectorAll("input[type=range]")) {
        changes(`${range.dataset.key} by slider`, () => { range.value = range.dataset.key === "gamma" ? range.max : 1; fire(range, new Event("input", { bubbles: true })); });
        key("r");
      }
      changes("zoom by wheel", () => fire(stage, new WheelEvent("wheel", { deltaY: -300, clientX: box.left + box.width / 3, clientY: box.top + box.height / 3, cancelable: true })));
      changes("dragging moves", () => { pointer("pointerdown", .5, .5); pointer("pointermove", .6, .6); pointer("pointerup", .6, .6); });
      changes("two fingers zoom", () => { pointer("pointerdown", .4, .5, 1, "touch"); pointer("pointerdown", .6, .5, 2, "touch"); pointer("pointermove", .9, .5, 2, "touch"); pointer("pointerup", .9, .5, 2, "touch"); pointer("pointerup", .4, .5, 1, "touch"); });
      key("r");
      key("1");
      changes("difference", () => key("d"));
      changes("error map", () => key("f"));
      check(`viewer ${n}: the error map has a legend`, viewer.querySelector(".legend canvas"));
      // Slider: left the one image, right the other.
      key("o"); key("0");
      const of = x => canvas.getContext("2d").getImageData(Math.floor(x * canvas.width), Math.floor(canvas.height * .8), 1, 1).data.join();
      // Not on borders of pixels: 37 has no divisor in common with widths.
      const row = () => Array.from({ length: 37 }, (_, i) => of((i + .5) / 37));
      const reference = row();
      key("1");
      const image = row();
      key("s");
      pointer("pointerdown", .5, .5); pointer("pointermove", .5, .5); pointer("pointerup", .5, .5);
      const both = row();
      check(`viewer ${n}: slider`, both.every((c, i) => i === 18 || c === (i < 18 ? image : reference)[i]) && image.join() !== reference.join());
      changes("the slider moves", () => { pointer("pointerdown", .5, .5); pointer("pointermove", .2, .5); pointer("pointerup", .2, .5); });
      key("r"); key("0");
      // Numbers under the pointer are those of the reference.
      const e = expected[n];
      if (e) {
        pointer("pointermove", (e.x + .5) / e.width, (e.y + .5) / e.height);
        const line = viewer.querySelector(".readout").textContent.split("\n").find(l => l.startsWith("reference"));
        const found = line.slice("reference".length).trim().split(/\s+/).map(t => Number(t.replaceAll("−", "-")));
        check(`viewer ${n}: numbers of a pixel: ${found} for ${e.rgb}`, found.length === 3 && found.every((v, i) => Math.abs(v - e.rgb[i]) <= 0.006 * Math.abs(e.rgb[i]) + 1e-4));
      }
      const wide = pixels();
      for (let i = 0; i < 12; i++) key("+");
      check(`viewer ${n}: zoom to single pixels`, pixels() !== wide);
      key("r");
    }
    check("crops are there", all(".crops").length === scenes && all(".crops button").length > 0);
    for (const b of all(".crops button")) fire(b, new MouseEvent("click", { bubbles: true }));
    for (const b of all(".viewer button")) if (b.textContent === "reset") fire(b, new MouseEvent("click", { bubbles: true }));
    check("nothing is wider than the window", document.documentElement.scrollWidth <= window.innerWidth);
    check("nothing comes from elsewhere", performance.getEntriesByType("resource").every(r => /^(data|blob|file):/.test(r.name)));
  } catch (e) {
    result.errors.push(String(e && e.stack || e));
  }
  const out = document.createElement("pre");
  out.id = "driven";
  out.hidden = true;
  out.textContent = JSON.stringify(result);
  document.body.append(out);
})();
