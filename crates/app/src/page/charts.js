// ---- charts -----------------------------------------------------------------------------------------------------

/** A range smaller than this share of the numbers themselves is rounding; so is what is smaller than others of its unit. */
const ROUNDING = 1e-9;

function ticks(low, high) {
  const raw = (high - low) / 5 || 1, scale = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * scale).find((s) => s >= raw);
  const out = [];
  for (let t = Math.ceil(low / step - 1e-9) * step; t <= high + 1e-9 * step; t += step) out.push(Math.abs(t) < 1e-9 * step ? 0 : t);
  return out;
}

/** Prefixes of SI by their power of ten, and the units that take them. */
const PREFIXES = { "-12": "p", "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T" };
const PREFIXED = ["Pa", "m", "s", "N", "J", "N/m"];

/** Title and unit of "length (m)". */
const parted = (title) => { const found = /^(.*) \(([^()]*)\)$/.exec(title); return found ? [found[1], found[2]] : [title, ""]; };
const unitOf = (title) => parted(title)[1] || title;

/** The power of ten that is taken out of an axis, and its title with it; `shared` is that of other charts of the unit. */
function scaled(title, largest, shared) {
  const [words, unit] = parted(title), power3 = (x) => 3 * Math.floor(Math.log10(x) / 3 + 1e-9);
  if (!largest) return [0, title];
  // What others of its unit have, unless that leaves it with zeros only.
  const exponent = shared && largest >= 1e-2 * 10 ** power3(shared) ? power3(shared) : power3(largest);
  if (PREFIXED.includes(unit) && exponent in PREFIXES) return [exponent, `${words} (${PREFIXES[exponent]}${unit})`];
  if (largest >= 1e-2 && largest < 1e5) return [0, title];
  return [exponent, `${words} (${power(exponent)}${unit && unit !== "–" ? ` ${unit}` : ""})`];
}

const finite = (points) => points.filter((p) => p.every(Number.isFinite));
const size = (points) => points.reduce((m, p) => Math.max(m, Math.abs(p[1])), 0);

/** Charts side by side, and in words what has nothing to draw: what is zero, or rounding beside others of its unit. */
function drawnCharts(charts, id) {
  const sizes = {}, flat = [], drawn = [], kind = (c) => `${c.panel} ${unitOf(c.y)}`;
  for (const c of charts) for (const s of c.series) sizes[kind(c)] = Math.max(sizes[kind(c)] || 0, size(finite(s.points)));
  for (const c of charts) {
    const scale = sizes[kind(c)] || 0;
    const zero = (s) => size(finite(s.points)) <= ROUNDING * scale, [lines, zeros] = [c.series.filter((s) => !zero(s)), c.series.filter(zero)];
    const whole = (c.panel ? `${c.panel}: ` : "") + parted(c.title)[0], name = (s) => (c.series.length > 1 ? `${whole}, ${s.name}` : whole);
    flat.push(...(lines.length ? zeros.map(name) : [whole]));
    if (lines.length) drawn.push(chart({ ...c, series: lines }, scale));
  }
  const parts = [make("div", { class: "row charts" }, drawn)];
  if (flat.length) parts.push(make("p", { class: "hint", id: `${id}-zero` }, `Always zero, or rounding: ${flat.join("; ")}.`));
  return parts;
}

function chart({ panel, title, x, y, series, note }, shared) {
  const points = series.flatMap((s) => finite(s.points));
  const extent = (k) => points.reduce(([low, high], p) => [Math.min(low, p[k]), Math.max(high, p[k])], [Infinity, -Infinity]);
  let [x0, x1] = extent(0), [y0, y1] = extent(1);
  if (x0 === x1) { x0 -= Math.abs(x0) || 1; x1 += Math.abs(x1) || 1; }
  const [ex, titleX] = scaled(x, Math.max(Math.abs(x0), Math.abs(x1))), [ey, titleY] = scaled(y, Math.max(Math.abs(y0), Math.abs(y1)), shared);
  const words = [...(panel ? [panel] : []), parted(title)[0]], steady = y1 - y0 <= ROUNDING * Math.max(Math.abs(y0), Math.abs(y1));
  if (steady) { words.push(`always ${shown(y1 / 10 ** ey)} ${unitOf(titleY)}`); y0 -= 0.5 * Math.abs(y0); y1 += 0.5 * Math.abs(y1); if (y0 > y1) [y0, y1] = [y1, y0]; }
  if (note) words.push(note);
  const W = 480, H = 290, L = 58, B = 44, T = 12, R = 14;
  const X = (v) => L + ((v - x0) / (x1 - x0)) * (W - L - R), Y = (v) => H - B - ((v - y0) / (y1 - y0)) * (H - B - T);
  const svg = make("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", class: "chart", "aria-label": words.join(": ") });
  for (const t of ticks(x0, x1)) {
    svg.append(make("line", { x1: X(t), x2: X(t), y1: T, y2: H - B, class: "axis" }), make("text", { x: X(t), y: H - B + 16, "text-anchor": "middle" }, shown(t / 10 ** ex)));
  }
  for (const t of ticks(y0, y1)) {
    svg.append(make("line", { x1: L, x2: W - R, y1: Y(t), y2: Y(t), class: "axis" }), make("text", { x: L - 6, y: Y(t) + 4, "text-anchor": "end" }, shown(t / 10 ** ey)));
  }
  series.forEach((s, n) => {
    const line = finite(s.points).map((p) => `${X(p[0]).toFixed(1)},${Y(p[1]).toFixed(1)}`);
    const style = { stroke: COLOURS[n % COLOURS.length], "stroke-dasharray": dashes(n) };
    svg.append(make("polyline", { points: line.join(" "), fill: "none", "stroke-width": 1.8, ...style }));
    if (line.length <= 30) for (const at of line) svg.append(make("circle", { cx: at.split(",")[0], cy: at.split(",")[1], r: 2.6, fill: style.stroke }));
  });
  svg.append(make("text", { x: (L + W - R) / 2, y: H - 8, "text-anchor": "middle", class: "quiet" }, titleX), make("text", { x: 12, y: (H - B) / 2, "text-anchor": "middle", transform: `rotate(-90 12 ${(H - B) / 2})`, class: "quiet" }, titleY));
  const legend = series.length > 1 ? make("div", { class: "legend" }, series.map((s, n) => make("span", {}, key(COLOURS[n % COLOURS.length], dashes(n)), s.name))) : "";
  return make("figure", {}, svg, legend, make("figcaption", {}, words.join(": ")));
}

/** Every line has dashes of its own as well as a colour, for those who do not tell the colours apart. */
const dashes = (n) => ["", "7 3", "2 3", "9 3 2 3", "14 4", "5 2 2 2 2 2"][n % 6];

/** A piece of a line, for legends. */
function key(stroke, dashes) {
  return make("svg", { viewBox: "0 0 24 8", class: "key", "aria-hidden": "true" }, make("line", { x1: 0, x2: 24, y1: 4, y2: 4, style: `stroke:${stroke}`, "stroke-width": 2, "stroke-dasharray": dashes }));
}

