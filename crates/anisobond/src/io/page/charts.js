// ---- charts -----------------------------------------------------------------------------------------------------

/** A range smaller than this share of the numbers themselves is rounding. */
const ROUNDING = 1e-9;

function ticks(low, high) {
  const raw = (high - low) / 5 || 1, scale = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * scale).find((s) => s >= raw);
  const out = [];
  for (let t = Math.ceil(low / step - 1e-9) * step; t <= high + 1e-9 * step; t += step) out.push(Math.abs(t) < 1e-9 * step ? 0 : t);
  return out;
}

/** The power of ten that is taken out of an axis, and its title with it. */
function scaled(title, range) {
  const largest = Math.max(Math.abs(range[0]), Math.abs(range[1]));
  if (!largest || (largest >= 1e-2 && largest < 1e5)) return [0, title];
  const exponent = 3 * Math.floor(Math.log10(largest) / 3), unit = /^(.*) \(([^()]*)\)$/.exec(title);
  return [exponent, unit ? `${unit[1]} (${power(exponent)}${unit[2] === "–" ? "" : ` ${unit[2]}`})` : `${title} (${power(exponent)})`];
}

/** The unit of a title: "length (m)". */
const unitOf = (title) => (/\(([^()]*)\)$/.exec(title) ?? [, title])[1];

/** Charts side by side; what is rounding beside other quantities of its unit is drawn flat. */
function drawnCharts(charts) {
  const sizes = {};
  for (const { y, series } of charts)
    for (const { points } of series) for (const p of points) if (Number.isFinite(p[1])) sizes[unitOf(y)] = Math.max(sizes[unitOf(y)] || 0, Math.abs(p[1]));
  return charts.map((c) => chart(c, sizes[unitOf(c.y)] || 0));
}

function chart({ title, x, y, series }, scale) {
  const points = series.flatMap((s) => s.points).filter((p) => p.every(Number.isFinite));
  if (!points.length) return make("p", {}, `${title}: no finite number`);
  const extent = (k) => points.reduce(([low, high], p) => [Math.min(low, p[k]), Math.max(high, p[k])], [Infinity, -Infinity]);
  let [x0, x1] = extent(0), [y0, y1] = extent(1), note = "";
  if (x0 === x1) { x0 -= Math.abs(x0) || 1; x1 += Math.abs(x1) || 1; }
  const size = Math.max(Math.abs(y0), Math.abs(y1));
  if (size < ROUNDING * scale) { note = `: zero to rounding (below ${shown(size)})`; y0 = -scale; y1 = scale; }
  else if (y1 - y0 <= ROUNDING * size) { note = `: always ${shown(y1)}`; y0 -= 0.5 * size || 1; y1 += 0.5 * size || 1; }
  const W = 640, H = 320, L = 62, B = 44, T = 12, R = 14;
  const X = (v) => L + ((v - x0) / (x1 - x0)) * (W - L - R), Y = (v) => H - B - ((v - y0) / (y1 - y0)) * (H - B - T);
  const svg = make("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": title + note });
  const [ex, titleX] = scaled(x, [x0, x1]), [ey, titleY] = scaled(y, [y0, y1]);
  for (const t of ticks(x0, x1)) {
    svg.append(make("line", { x1: X(t), x2: X(t), y1: T, y2: H - B, class: "axis" }), make("text", { x: X(t), y: H - B + 16, "text-anchor": "middle" }, shown(t / 10 ** ex)));
  }
  for (const t of ticks(y0, y1)) {
    svg.append(make("line", { x1: L, x2: W - R, y1: Y(t), y2: Y(t), class: "axis" }), make("text", { x: L - 6, y: Y(t) + 4, "text-anchor": "end" }, shown(t / 10 ** ey)));
  }
  const dash = (n) => ["", "6 3", "2 2"][Math.min(2, Math.floor(n / COLOURS.length))];
  series.forEach((s, n) => {
    const line = s.points.filter((p) => p.every(Number.isFinite)).map((p) => `${X(p[0]).toFixed(1)},${Y(p[1]).toFixed(1)}`);
    const style = { stroke: COLOURS[n % COLOURS.length], "stroke-dasharray": dash(n) };
    svg.append(make("polyline", { points: line.join(" "), fill: "none", "stroke-width": 1.8, ...style }));
    if (line.length <= 30) for (const at of line) svg.append(make("circle", { cx: at.split(",")[0], cy: at.split(",")[1], r: 2.6, fill: style.stroke }));
  });
  svg.append(make("text", { x: (L + W - R) / 2, y: H - 8, "text-anchor": "middle", class: "quiet" }, titleX), make("text", { x: 14, y: (H - B) / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${(H - B) / 2})`, class: "quiet" }, titleY));
  const legend = series.length > 1 ? make("div", { class: "legend" }, series.map((s, n) => make("span", {}, key(COLOURS[n % COLOURS.length], dash(n)), s.name))) : "";
  return make("figure", {}, svg, legend, make("figcaption", {}, title + note));
}

/** A piece of a line, for legends. */
function key(stroke, dashes) {
  return make("svg", { viewBox: "0 0 24 8", class: "key", "aria-hidden": "true" }, make("line", { x1: 0, x2: 24, y1: 4, y2: 4, style: `stroke:${stroke}`, "stroke-width": 2, "stroke-dasharray": dashes }));
}

