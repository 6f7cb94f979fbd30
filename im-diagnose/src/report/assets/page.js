(() => {
  "use strict";
  const root = document.documentElement;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const theme = () => { if (!root.dataset.chosen) root.dataset.theme = dark.matches ? "dark" : "light"; };
  theme();
  dark.addEventListener("change", theme);
  let before;
  addEventListener("beforeprint", () => { before = root.dataset.theme; root.dataset.theme = "light"; });
  addEventListener("afterprint", () => { root.dataset.theme = before; });
  document.getElementById("theme")?.addEventListener("click", () => {
    root.dataset.chosen = "1";
    root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
  });

  // A heading sorts its table by that column: numbers by value, words by letter, empty last.
  for (const head of document.querySelectorAll(".sorts th")) {
    const sort = () => {
      const column = head.cellIndex, numeric = head.classList.contains("n"), up = head.ariaSort !== "ascending";
      for (const other of head.parentNode.children) other.ariaSort = null;
      head.ariaSort = up ? "ascending" : "descending";
      const key = (row) => row.cells[column].querySelector("data")?.value ?? row.cells[column].textContent;
      const body = head.closest("table").tBodies[0];
      body.append(...[...body.rows].sort((a, b) => {
        const [x, y] = [key(a), key(b)];
        if (x === "" || y === "") return (x === "") - (y === "");
        return (numeric ? x - y : x.localeCompare(y)) * (up ? 1 : -1);
      }));
    };
    head.tabIndex = 0;
    head.addEventListener("click", sort);
    head.addEventListener("keydown", (e) => { if (e.key === "Enter") sort(); });
  }

  const box = document.getElementById("zoom"), source = document.getElementById("recordings");
  if (!box || !source) return;
  const data = JSON.parse(source.textContent);
  const unpack = (s) => {
    const raw = atob(s.q), n = raw.length >> 1, out = new Float64Array(n);
    for (let i = 0; i < n; i++) {
      let v = raw.charCodeAt(2 * i) | (raw.charCodeAt(2 * i + 1) << 8);
      if (v > 32767) v -= 65536;
      out[i] = v === -32768 ? NaN : s.o + s.s * v;
    }
    return out;
  };
  // Unpacked when first looked at.
  const ready = (level) => {
    if (level.ready) return level;
    for (const c of level.channels) {
      c.m = unpack(c.m);
      c.p = c.p.map(unpack);
      c.e = c.e ? c.e.map(unpack) : c.p.map((p) => p.map((v, i) => c.m[i] - v));
      c.h = c.h && unpack(c.h);
    }
    level.drives = level.drives.map((lines) => lines.map(unpack));
    level.ready = true;
    return level;
  };
  const view = { run: data.worst.run, from: data.worst.from, to: data.worst.to };
  const end = () => data.runs[view.run].end;
  const level = () => {
    const all = data.runs[view.run].levels;
    return ready(all.find((l) => l.from <= view.from + 1e-9 && l.from + l.step * l.n >= view.to - 1e-9) || all[all.length - 1]);
  };
  const format = (v, digits) => {
    if (!isFinite(v)) return "–";
    if (v === 0) return "0";
    const d = Math.max(0, digits - 1 - Math.floor(Math.log10(Math.abs(v))));
    return (d > 8 ? v.toExponential(digits - 1) : v.toFixed(d)).replace("-", "−");
  };
  const ticks = (lo, hi, wanted) => {
    const rough = (hi - lo) / wanted, power = 10 ** Math.floor(Math.log10(rough));
    const step = [10, 5, 2, 1].map((k) => k * power).find((s) => s <= 1.4 * rough);
    const place = Math.floor(Math.log10(step) + 1e-9), most = Math.max(Math.abs(lo), Math.abs(hi)), powers = most >= 1e5 || (place < -4 && most < 1e-2);
    // Large and small numbers as powers, with the place in which neighbours differ.
    const words = (v) => powers ? v.toExponential(Math.max(0, Math.floor(Math.log10(Math.abs(v)) + 1e-9) - place)).replace("e+", "e") : v.toFixed(Math.max(0, -place));
    const out = [];
    for (let k = Math.ceil(lo / step - 1e-6) + 0; k * step <= hi + 1e-6 * step; k++) out.push([k * step, k ? words(k * step).replaceAll("-", "−") : "0"]);
    return out;
  };
  const LEFT = 48, RIGHT = 6, TOP = 20, BOTTOM = 32;
  // One [x, least, most] per pixel column, or per point where points are few.
  const columns = (l, series, width) => {
    const i0 = Math.max(0, Math.floor((view.from - l.from) / l.step) - 1);
    const i1 = Math.min(l.n - 1, Math.ceil((view.to - l.from) / l.step) + 1);
    const x = (i) => LEFT + ((l.from + i * l.step - view.from) / (view.to - view.from)) * width;
    const out = [];
    if (i1 - i0 <= 2 * width) {
      for (let i = i0; i <= i1; i++) out.push([x(i), series[i], series[i]]);
      return out;
    }
    const per = (i1 - i0) / width;
    for (let c = 0; c < width; c++) {
      let lo = Infinity, hi = -Infinity;
      for (let i = Math.floor(i0 + c * per); i < i0 + (c + 1) * per && i <= i1; i++) {
        const v = series[i];
        if (v < lo) lo = v;
        if (v > hi) hi = v;
      }
      if (lo <= hi) out.push([x(i0 + (c + 0.5) * per), lo, hi]);
    }
    return out;
  };
  const extent = (sets, lo, hi) => {
    for (const set of sets) for (const [, a, b] of set) { if (a < lo) lo = a; if (b > hi) hi = b; }
    // Without an extent that numbers can hold, one is made.
    if (!(hi - lo > 1e-9 * Math.max(Math.abs(lo), Math.abs(hi)))) { const least = Math.max(1, 1e-3 * Math.abs(hi)); lo -= least; hi += least; }
    const room = 0.05 * (hi - lo);
    return [lo - room, hi + room];
  };
  const n1 = (v) => Math.round(v * 10) / 10;
  const line = (set, y) => {
    let d = "", pen = false;
    for (const [x, a, b] of set) {
      if (!isFinite(a)) { pen = false; continue; }
      d += `${pen ? "L" : "M"}${n1(x)} ${n1(y(a))}`;
      if (b !== a) d += `L${n1(x)} ${n1(y(b))}`;
      pen = true;
    }
    return d;
  };
  const band = (set, y, half) => {
    const good = set.filter((p) => isFinite(p[1]));
    if (!good.length) return "";
    return "M" + good.map(([x, , b]) => `${n1(x)} ${n1(y(b + half(x)))}`).join("L") + "L" + good.reverse().map(([x, a]) => `${n1(x)} ${n1(y(a - half(x)))}`).join("L") + "Z";
  };
  let clip = 0;
  const panel = (label, height, width, [lo, hi], body) => {
    const y = (v) => TOP + (1 - (v - lo) / (hi - lo)) * (height - TOP - BOTTOM);
    const id = `clip${clip++}`;
    let s = `<svg viewBox="0 0 ${width} ${height}" width="${width}" height="${height}" role="img" aria-label="${label.replace(/<[^>]*>/g, "")}"><clipPath id="${id}"><rect x="${LEFT}" y="${TOP - 2}" width="${width - LEFT - RIGHT}" height="${height - TOP - BOTTOM + 4}"/></clipPath>`;
    s += `<text class="axis" x="2" y="12">${label}</text><text class="axis" x="${width - RIGHT}" y="${height - 3}" text-anchor="end">time, s</text>`;
    for (const [v, t] of ticks(lo, hi, Math.max(3, (height - TOP - BOTTOM) / 34))) s += `<path class="grid" d="M${LEFT} ${n1(y(v))}H${width - RIGHT}"/><text class="tick" x="${LEFT - 4}" y="${n1(y(v) + 4)}" text-anchor="end">${t}</text>`;
    for (const [v, t] of ticks(view.from, view.to, width / 90)) {
      const x = LEFT + ((v - view.from) / (view.to - view.from)) * (width - LEFT - RIGHT);
      s += `<path class="grid" d="M${n1(x)} ${TOP}V${height - BOTTOM}"/><text class="tick" x="${n1(Math.min(x, width - 3.6 * t.length))}" y="${height - BOTTOM + 14}" text-anchor="middle">${t}</text>`;
    }
    return s + `<g clip-path="url(#${id})">${body(y)}</g><path class="cursor" d=""/><rect class="select" y="${TOP}" height="${height - TOP - BOTTOM}" width="0"/></svg>`;
  };
  const classes = data.models.map((m) => m.class);
  const draw = () => {
    const width = Math.max(280, box.clientWidth), inner = width - LEFT - RIGHT, l = level();
    clip = 0;
    let html = "";
    l.channels.forEach((c, k) => {
      const info = data.runs[view.run].channels[k];
      const m = columns(l, c.m, inner), p = c.p.map((v) => columns(l, v, inner)), e = c.e.map((v) => columns(l, v, inner));
      // Half the width of the band at a pixel.
      const wide = new Map(c.h ? columns(l, c.h, inner).map(([x, , b]) => [x, b]) : []);
      const half = (x) => wide.get(x) ?? 2 * info.noise;
      const zero = p[p.length - 1].map(([x]) => [x, 0, 0]);
      html += `<h3>${info.name}</h3>`;
      html += panel(`measured and modelled, ${info.unit}`, 200, width, extent([m, ...p], Infinity, -Infinity), (y) =>
        `<path class="fill-band" d="${band(p[p.length - 1], y, half)}"/><path class="line measured" d="${line(m, y)}"/>` +
        p.map((v, i) => `<path class="line ${classes[i]}" d="${line(v, y)}"/>`).join(""));
      html += panel(`error (measured − model), ${info.unit}`, 130, width, extent(e, -3 * info.noise, 3 * info.noise), (y) =>
        `<path class="fill-band" d="${band(zero, y, half)}"/>` +
        e.map((v, i) => `<path class="line thin solid ${classes[i]}" d="${line(v, y)}"/>`).join(""));
    });
    data.runs[view.run].drives.forEach((drive, k) => {
      const lines = l.drives[k].map((v) => columns(l, v, inner));
      const key = drive.lines.length > 1 ? ` (${drive.lines.map((d) => `<tspan class="word ${d.class}">${d.name}</tspan>`).join(", ")})` : "";
      html += `<h3>${drive.name}</h3>`;
      html += panel(`${drive.name}${key}, ${drive.unit}`, 130, width, extent(lines, 0, 0), (y) =>
        lines.map((v, i) => `<path class="line ${drive.lines[i].class}" d="${line(v, y)}"/>`).join(""));
    });
    box.innerHTML = html;
    const place = Math.max(0, 2 - Math.floor(Math.log10(view.to - view.from) + 1e-9));
    document.getElementById("span").textContent = `${data.runs[view.run].name}, ${view.from.toFixed(place)} s to ${view.to.toFixed(place)} s` +
      (l.decimated ? " (extremes of short stretches; zoom in for every sample)" : "");
    document.querySelectorAll("[data-run]").forEach((b) => b.setAttribute("aria-pressed", String(+b.dataset.run === view.run)));
  };
  const show = (from, to) => {
    const least = 20 * data.runs[view.run].sample, span = Math.min(Math.max(to - from, least), end());
    view.from = Math.min(Math.max(0, (from + to - span) / 2), end() - span);
    view.to = view.from + span;
    unread();
    draw();
  };
  const scale = (f) => { const c = (view.from + view.to) / 2, h = ((view.to - view.from) / 2) * f; show(c - h, c + h); };
  const pan = (f) => { const d = (view.to - view.from) * f; show(view.from + d, view.to + d); };
  // The values at a time, in a box beside the pointer: on its left where the page ends on its right.
  const tip = document.getElementById("read");
  const read = (t, event) => {
    const l = level(), run = data.runs[view.run], i = Math.min(l.n - 1, Math.max(0, Math.round((t - l.from) / l.step)));
    const row = (name, values, unit) => `<tr><th>${name}${unit && ", " + unit}</th>${values.map((v) => `<td>${v}</td>`).join("")}</tr>`;
    const numbers = (values) => values.map((v) => format(v, 4));
    const head = row(`At ${format(l.from + i * l.step, 5)} s`, ["measured", ...data.models.map((m) => m.name)], "");
    const rows = l.channels.map((c, k) => row(run.channels[k].name, numbers([c.m[i], ...c.p.map((p) => p[i])]), run.channels[k].unit));
    run.drives.forEach((drive, k) => drive.lines.forEach((d, j) => rows.push(row(drive.lines.length > 1 ? `${drive.name} ${d.name}` : drive.name, numbers([l.drives[k][j][i]]), drive.unit))));
    tip.innerHTML = `<table>${head}${rows.join("")}</table>`;
    tip.hidden = false;
    const { width, height } = tip.getBoundingClientRect(), right = event.clientX + 18, below = event.clientY + 18;
    // On a narrow screen it would lie over the picture: there it stands at the far end of the window.
    const narrow = innerWidth < 2 * width, far = event.clientY > innerHeight / 2 ? 4 : innerHeight - height - 4;
    tip.style.left = `${narrow ? 4 : Math.max(4, right + width < innerWidth ? right : event.clientX - width - 18)}px`;
    tip.style.top = `${narrow ? far : Math.max(4, below + height < innerHeight ? below : event.clientY - height - 18)}px`;
  };
  const unread = () => { tip.hidden = true; box.querySelectorAll(".cursor").forEach((c) => c.setAttribute("d", "")); };
  const time = (event) => {
    const r = box.getBoundingClientRect();
    return view.from + ((event.clientX - r.left - LEFT) / (box.clientWidth - LEFT - RIGHT)) * (view.to - view.from);
  };
  let start = null;
  box.addEventListener("pointerdown", (e) => { start = e.clientX; box.setPointerCapture(e.pointerId); });
  box.addEventListener("pointermove", (e) => {
    const r = box.getBoundingClientRect(), x = e.clientX - r.left;
    read(time(e), e);
    box.querySelectorAll(".cursor").forEach((c) => c.setAttribute("d", `M${n1(x)} ${TOP}V${c.ownerSVGElement.viewBox.baseVal.height - BOTTOM}`));
    if (start !== null) box.querySelectorAll(".select").forEach((s) => { s.setAttribute("x", Math.min(start, e.clientX) - r.left); s.setAttribute("width", Math.abs(e.clientX - start)); });
  });
  const release = (e) => {
    if (start === null) return;
    const a = time({ clientX: start }), b = time(e), far = Math.abs(e.clientX - start) > 6;
    start = null;
    if (far) show(Math.min(a, b), Math.max(a, b));
  };
  box.addEventListener("pointerup", release);
  box.addEventListener("pointercancel", () => { start = null; draw(); });
  box.addEventListener("pointerleave", () => { if (start === null) unread(); });
  addEventListener("scroll", unread, { passive: true });
  box.addEventListener("dblclick", () => scale(3));
  box.addEventListener("keydown", (e) => {
    const act = { ArrowLeft: () => pan(-0.25), ArrowRight: () => pan(0.25), "+": () => scale(0.5), "-": () => scale(2), "0": () => show(0, end()) }[e.key];
    if (act) { act(); e.preventDefault(); }
  });
  const actions = {
    worst: () => { view.run = data.worst.run; show(data.worst.from, data.worst.to); },
    tenth: () => { view.run = data.worst.run; show(data.tenth.from, data.tenth.to); },
    all: () => show(0, end()), in: () => scale(0.4), out: () => scale(2.5), left: () => pan(-0.5), right: () => pan(0.5),
  };
  document.querySelectorAll("[data-zoom]").forEach((b) => b.addEventListener("click", () => actions[b.dataset.zoom]()));
  document.querySelectorAll("[data-run]").forEach((b) => b.addEventListener("click", () => { view.run = +b.dataset.run; show(0, end()); }));
  let width = 0;
  new ResizeObserver(() => { if (Math.abs(box.clientWidth - width) > 1) { width = box.clientWidth; draw(); } }).observe(box);
  draw();
})();
