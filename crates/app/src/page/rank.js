
// ---- which materials which model carries ----------------------------------------------------------------------------

/** Columns of the table: key, title, whether it is a share. */
function rankColumns(models) {
  const own = models.flatMap((m) => [
    [`${m}.largest_energy_error`, `${m}: error of energy`, true],
    [`${m}.relative_error`, `${m}: error of the norm`, true],
    [`${m}.reaches_model_limit`, `${m}: its limit reached`, false],
  ]);
  return [
    ["id", "id", false], ["material", "material", false], ["carried_by", "carried by", false], ...own,
    ["cauchy_gap", "Cauchy gap", true], ["universal_anisotropy", "anisotropy A^U", false], ["poisson", "Poisson (Hill)", false],
  ];
}

const percent = (x) => (typeof x === "number" ? `${shown(100 * x)} %` : "");
const rankCell = (x, share) => (x === true ? "yes" : x === false ? "no" : x === null || x === undefined ? "" : share ? percent(x) : shown(x));

/** Rows in which every word or comparison of a text holds: "si central.relative_error<5%". */
function rankFilter(rows, text) {
  const tests = text.trim().split(/\s+/).filter(Boolean).map((word) => {
    const found = /^([\w.]+)(<=|>=|!=|<|>|=)(.+)$/.exec(word);
    if (!found) return (row) => Object.values(row).some((v) => String(v).toLowerCase().includes(word.toLowerCase()));
    const [, key, sign, value] = found, share = value.endsWith("%"), number = Number(share ? value.slice(0, -1) : value) * (share ? 0.01 : 1);
    return (row) => {
      const own = row[key];
      if (own === undefined || own === null) return false;
      const [a, b] = typeof own === "number" && Number.isFinite(number) ? [own, number] : [String(own), value];
      return { "<": a < b, ">": a > b, "<=": a <= b, ">=": a >= b, "=": a === b, "!=": a !== b }[sign];
    };
  });
  return rows.filter((row) => tests.every((test) => test(row)));
}

function rankSort(rows, key, down) {
  const value = (row) => (typeof row[key] === "boolean" ? Number(row[key]) : row[key]);
  const order = (a, b) => (a === b ? 0 : a === undefined || a === null ? 1 : b === undefined || b === null ? -1 : (a < b ? -1 : 1) * (down ? -1 : 1));
  return [...rows].sort((a, b) => order(value(a), value(b)));
}

/** How many rows have a share in each of some classes. */
function histogram(title, rows, key, colour, within) {
  const edges = [0, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, Infinity];
  const counts = edges.slice(1).map((high, n) => rows.filter((r) => typeof r[key] === "number" && r[key] >= edges[n] && r[key] < high).length);
  const most = Math.max(1, ...counts), w = 520, h = 200, left = 40, bottom = 34, step = (w - left - 10) / counts.length;
  const y = (n) => 12 + (h - bottom - 12) * (1 - n / most);
  const parts = [make("line", { class: "axis", x1: left, x2: w - 10, y1: y(0), y2: y(0) })];
  counts.forEach((n, k) => {
    const x = left + k * step;
    const bar = make("rect", { x: x + 1, y: y(n), width: step - 2, height: y(0) - y(n), fill: colour });
    bar.append(make("title", {}, `${n} of ${rows.length}: ${percent(edges[k])} to ${edges[k + 1] === Infinity ? "more" : percent(edges[k + 1])}`));
    parts.push(bar);
    if (n) parts.push(make("text", { x: x + step / 2, y: y(n) - 3, "text-anchor": "middle", class: "small" }, String(n)));
    parts.push(make("text", { x, y: h - 18, "text-anchor": "middle", class: "small quiet" }, shown(100 * edges[k])));
  });
  const at = edges.findIndex((e) => e >= within);
  if (at > 0) parts.push(make("line", { x1: left + at * step, x2: left + at * step, y1: 8, y2: y(0), stroke: "var(--text)", "stroke-dasharray": "3 3" }));
  parts.push(make("text", { x: (left + w) / 2, y: h - 3, "text-anchor": "middle", class: "quiet" }, "%"));
  const svg = make("svg", { class: "chart", viewBox: `0 0 ${w} ${h}`, role: "img", "aria-label": title }, parts);
  return make("figure", {}, make("h3", {}, title), svg);
}

/** The error in energy over that in the norm, both on scales of powers of ten. */
function errorsFigure(rows, models) {
  const w = 520, h = 340, left = 52, bottom = 40, low = -4, high = 1;
  const place = (x, from, to) => from + (to - from) * (Math.min(high, Math.max(low, Math.log10(Math.max(x, 1e-12)))) - low) / (high - low);
  const X = (x) => place(x, left, w - 12), Y = (y) => place(y, h - bottom, 10), parts = [];
  for (let e = low; e <= high; e += 1) {
    const x = X(10 ** e), y = Y(10 ** e), text = `${shown(100 * 10 ** e)} %`;
    parts.push(make("line", { class: "axis", x1: x, x2: x, y1: 10, y2: h - bottom }), make("line", { class: "axis", x1: left, x2: w - 12, y1: y, y2: y }));
    parts.push(make("text", { x, y: h - bottom + 14, "text-anchor": "middle", class: "small quiet" }, text), make("text", { x: left - 4, y: y + 3, "text-anchor": "end", class: "small quiet" }, text));
  }
  parts.push(make("line", { x1: X(10 ** low), y1: Y(10 ** low), x2: X(10 ** high), y2: Y(10 ** high), stroke: "var(--quiet)", "stroke-dasharray": "3 3" }));
  models.forEach((m, k) => rows.forEach((r) => {
    const [a, b] = [r[`${m}.relative_error`], r[`${m}.largest_energy_error`]];
    if (typeof a !== "number" || typeof b !== "number") return;
    const dot = k % 2 ? make("rect", { x: X(a) - 2.5, y: Y(b) - 2.5, width: 5, height: 5, fill: COLOURS[k], "fill-opacity": 0.7 }) : make("circle", { cx: X(a), cy: Y(b), r: 3, fill: COLOURS[k], "fill-opacity": 0.7 });
    dot.append(make("title", {}, `${r.id} ${r.material}, ${m}: norm ${percent(a)}, energy ${percent(b)}`));
    parts.push(dot);
  }));
  parts.push(make("text", { x: (left + w) / 2, y: h - 6, "text-anchor": "middle" }, "error of the norm"), make("text", { x: 12, y: h / 2, "text-anchor": "middle", transform: `rotate(-90 12 ${h / 2})` }, "largest error of energy"));
  const svg = make("svg", { class: "chart", viewBox: `0 0 ${w} ${h}`, role: "img", "aria-label": "Error of energy over error of the norm" }, parts);
  const legend = make("div", { class: "legend" }, models.map((m, k) => make("span", {}, make("span", { style: `color:${COLOURS[k]}` }, k % 2 ? "■ " : "● "), m)));
  return make("figure", {}, make("h3", {}, "What the norm hides: energy over norm"), svg, legend);
}

/** The page: its data are in it. */
function rankPage() {
  const page = JSON.parse(document.getElementById("data").textContent), { models, rows } = page, columns = rankColumns(models);
  document.title = `${page.title} – anisobond`;
  document.getElementById("title").textContent = page.title;
  document.getElementById("kind").textContent = page.kind;
  let key = page.order.replace(/^-/, ""), down = page.order.startsWith("-");
  const n = page.neighbourhood, said = make("p", {}), head = make("tr"), body = make("tbody"), figures = make("div", { class: "row charts" });
  const filter = make("input", { id: "filter", type: "search", spellcheck: "false", placeholder: `si carried_by=central ${models[0]}.relative_error<5%`, oninput: () => draw() });
  const counts = (some) => [...models, "hybrid"].map((m) => `${some.filter((r) => r.carried_by === m).length} by ${m} bonds`).join(", ");
  function draw() {
    const some = rankSort(rankFilter(rows, filter.value), key, down);
    said.textContent = `${some.length} of ${page.all} materials; carried ${counts(some)}.`;
    head.replaceChildren(...columns.map(([own, title]) => {
      const mark = own === key ? (down ? " ↓" : " ↑") : "";
      const press = () => { down = own === key && !down; key = own; draw(); };
      return make("th", { scope: "col", "aria-sort": own === key ? (down ? "descending" : "ascending") : "none" }, make("button", { type: "button", onclick: press }, title + mark));
    }));
    body.replaceChildren(...some.map((r) => make("tr", {}, columns.map(([own, , share]) => make("td", {}, rankCell(r[own], share))))));
    figures.replaceChildren(
      ...models.map((m, k) => histogram(`${m} bonds: largest error of energy (%)`, some, `${m}.largest_energy_error`, COLOURS[k], page.within)),
      histogram("Cauchy gap (%): least error of central bonds in the norm", some, "cauchy_gap", COLOURS[2], Infinity),
      errorsFigure(some, models),
    );
  }
  const about = `A model carries a material of which it misses the energy of no strain by more than ${percent(page.within)}; what none of them carries, hybrid bonds do, with a nodal term. ` +
    `${n.bonds} bonds: ${n.shape}, horizon ${shown(n.horizon)} Δ, influence ${n.influence}; central bonds closest by ${page.metric === "energy" ? "energy" : "the norm"}.`;
  const typed = page.command ? [make("p", {}, make("code", {}, page.command))] : [];
  const doubts = page.doubts.map(([id, words]) => make("p", { class: "warning" }, `${id}: ${words}`));
  section("facts", "What was asked", make("p", {}, about), ...typed, ...doubts);
  const label = make("label", { for: "filter" }, "Show where ");
  const table = make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Materials" }, make("table", {}, make("thead", {}, head), body));
  section("materials", "Materials", make("div", { class: "controls unprinted" }, label, filter), said, table);
  section("figures", "Figures of what is shown", figures);
  if (page.failed.length) section("failed", "Rows that failed", ...page.failed.map((f) => make("p", { class: "warning" }, `${f.id} (line ${f.line}): ${f.error}`)));
  document.getElementById("footer").textContent = `anisobond ${page.version}. This page needs no network.`;
  draw();
}
