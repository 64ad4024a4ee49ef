// ---- tensors: heat maps, wave speeds, Young’s modulus by direction --------------------------------------------------

const PAIRS = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];
const INDEX = [[0, 5, 4], [5, 1, 3], [4, 3, 2]];

function inverse(matrix) {
  const n = matrix.length;
  const a = matrix.map((row, i) => [...row, ...row.map((_, j) => (i === j ? 1 : 0))]);
  for (let i = 0; i < n; i++) {
    let pivot = i;
    for (let r = i + 1; r < n; r++) if (Math.abs(a[r][i]) > Math.abs(a[pivot][i])) pivot = r;
    [a[i], a[pivot]] = [a[pivot], a[i]];
    if (!a[i][i]) return null;
    const d = a[i][i];
    a[i] = a[i].map((x) => x / d);
    for (let r = 0; r < n; r++) {
      if (r === i) continue;
      const f = a[r][i];
      a[r] = a[r].map((x, c) => x - f * a[i][c]);
    }
  }
  return a.map((row) => row.slice(n));
}

/** 1/E along n from the compliance in Voigt's notation. */
function young(compliance, n) {
  const v = PAIRS.map(([i, j]) => n[i] * n[j]);
  let sum = 0;
  for (let a = 0; a < 6; a++) for (let b = 0; b < 6; b++) sum += v[a] * compliance[a][b] * v[b];
  return 1 / sum;
}

/** The three eigenvalues of Γ_ik = C_ijkl n_j n_l, ascending. */
function christoffel(c, n) {
  const g = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  for (let i = 0; i < 3; i++)
    for (let k = 0; k < 3; k++)
      for (let j = 0; j < 3; j++) for (let l = 0; l < 3; l++) g[i][k] += c[INDEX[i][j]][INDEX[k][l]] * n[j] * n[l];
  const off = g[0][1] ** 2 + g[0][2] ** 2 + g[1][2] ** 2;
  const q = (g[0][0] + g[1][1] + g[2][2]) / 3;
  const p = Math.sqrt(((g[0][0] - q) ** 2 + (g[1][1] - q) ** 2 + (g[2][2] - q) ** 2 + 2 * off) / 6);
  if (p === 0) return [q, q, q];
  const b = g.map((row, i) => row.map((x, j) => (x - (i === j ? q : 0)) / p));
  const det = b[0][0] * (b[1][1] * b[2][2] - b[1][2] * b[2][1]) - b[0][1] * (b[1][0] * b[2][2] - b[1][2] * b[2][0]) + b[0][2] * (b[1][0] * b[2][1] - b[1][1] * b[2][0]);
  const phi = Math.acos(Math.max(-1, Math.min(1, det / 2))) / 3;
  const high = q + 2 * p * Math.cos(phi), low = q + 2 * p * Math.cos(phi + (2 * Math.PI) / 3);
  return [low, 3 * q - low - high, high];
}

/** Red to blue around zero. */
function diverging(t) {
  const s = Math.max(-1, Math.min(1, t)), a = Math.abs(s) ** 0.7;
  return s < 0 ? `rgba(178, 80, 40, ${a})` : `rgba(40, 105, 175, ${a})`;
}

/** Digits after the point: five digits in all where numbers are largest, three after the point at most. */
const decimals = (largest) => Math.max(0, Math.min(3, 4 - Math.floor(Math.log10(largest))));

function heatMap(name, voigt, largest, [size, unit]) {
  const cell = 56, svg = make("svg", { viewBox: `0 0 ${6 * cell + 30} ${6 * cell + 24}`, role: "img", "aria-label": `${name} in ${unit}` });
  const names = PAIRS.map(([i, j]) => `${i + 1}${j + 1}`), digits = decimals(largest / size);
  for (let a = 0; a < 6; a++) {
    svg.append(make("text", { x: 30 + (a + 0.5) * cell, y: 14, "text-anchor": "middle", class: "quiet" }, names[a]));
    svg.append(make("text", { x: 22, y: 24 + (a + 0.58) * cell, "text-anchor": "end", class: "quiet" }, names[a]));
    for (let b = 0; b < 6; b++) {
      const x = 30 + b * cell, y = 20 + a * cell, value = voigt[a][b], text = String(Number((value / size).toFixed(digits)) || 0);
      svg.append(make("rect", { x, y, width: cell - 2, height: cell - 2, fill: diverging(value / largest), class: "axis" }));
      svg.append(make("text", { x: x + cell / 2 - 1, y: y + cell / 2 + 4, "text-anchor": "middle", class: Math.abs(value) > 0.55 * largest ? "on-colour" : "" }, text.replace("-", "−")));
    }
  }
  return make("figure", {}, svg, make("figcaption", {}, `${name} (${unit}, Voigt)`));
}

/** Largest magnitude of components. */
const greatest = (voigts) => Math.max(...voigts.flat(2).map(Math.abs));

/** What is compared: first what was asked, last what was reached. */
const compared = () => data.tensors.filter((t) => !t.part);

function tensors() {
  if (!data.tensors.length) return;
  const all = compared(), first = all[0], largest = greatest(all.map((t) => t.voigt)), unit = stressUnit(largest);
  const maps = data.tensors.map((t) => heatMap(t.name, t.voigt, Math.max(largest, greatest([t.voigt])), unit));
  for (const other of all.slice(1)) {
    const difference = other.voigt.map((row, a) => row.map((x, b) => x - first.voigt[a][b])), size = greatest([difference]);
    if (size > 1e-9 * largest) maps.push(heatMap(`${other.name} − ${first.name}`, difference, size, stressUnit(size)));
  }
  section("stiffness", "Stiffness", make("div", { class: "row" }, maps));
}

function waves() {
  if (!data.tensors.length) return;
  const planes = [["x", "y", 0, 1], ["y", "z", 1, 2], ["x", "z", 0, 2]];
  const density = data.density || 1;
  const speeds = (voigt, n) => christoffel(voigt, n).map((g) => Math.sqrt(Math.max(0, g) / density));
  const all = compared(), ends = all.length > 1 ? [all[0], all[all.length - 1]] : [all[0]];
  let largest = 0;
  const curves = planes.map(([, , a, b]) => ends.map((t) => {
    const rows = [];
    for (let k = 0; k <= 180; k++) {
      const angle = (Math.PI * k) / 90, n = [0, 0, 0];
      n[a] = Math.cos(angle); n[b] = Math.sin(angle);
      const v = speeds(t.voigt, n);
      largest = Math.max(largest, v[2]);
      rows.push([angle, v]);
    }
    return rows;
  }));
  const [size, unit] = !data.density ? [1, "√Pa"] : largest >= 1000 ? [1000, "km/s"] : [1, "m/s"];
  const rings = ticks(0, largest).filter((v) => v > 0 && v <= largest);
  const figures = planes.map(([p, q], n) => {
    const svg = make("svg", { viewBox: "-130 -130 260 260", role: "img", "aria-label": `Wave speeds in the ${p}${q} plane` });
    for (const v of rings) svg.append(make("circle", { cx: 0, cy: 0, r: 110 * (v / largest), class: "axis" }));
    svg.append(make("line", { x1: -118, x2: 118, y1: 0, y2: 0, class: "axis" }), make("line", { x1: 0, x2: 0, y1: -118, y2: 118, class: "axis" }));
    svg.append(make("text", { x: 120, y: 3, class: "small" }, p), make("text", { x: -2, y: -121, class: "small" }, q));
    curves[n].forEach((rows, t) => {
      for (let branch = 0; branch < 3; branch++) {
        const points = rows.map(([angle, v]) => `${((110 * v[branch] * Math.cos(angle)) / largest).toFixed(2)},${((-110 * v[branch] * Math.sin(angle)) / largest).toFixed(2)}`).join(" ");
        svg.append(make("polyline", { points, fill: "none", stroke: COLOURS[2 - branch], "stroke-width": 1.5, "stroke-dasharray": t === 0 && ends.length > 1 ? "4 3" : "" }));
      }
    });
    return make("figure", {}, svg, make("figcaption", {}, `${p}${q} plane; rings every ${shown(rings[0] / size)} ${unit}`));
  });
  const names = ["fastest wave", "middle", "slowest"].map((name, n) => make("span", {}, key(COLOURS[n], ""), name));
  if (ends.length > 1) names.push(make("span", {}, key("var(--quiet)", ""), ends[1].name), make("span", {}, key("var(--quiet)", "4 3"), ends[0].name));
  const words = data.density ? ` at a density of ${shown(data.density)} kg/m³` : ": no density was given, these are √(C/ρ) for ρ = 1 kg/m³";
  section("waves", "Wave speeds", make("p", {}, `Phase speeds of the three plane waves by direction of travel (${unit})${words}.`), make("div", { class: "legend" }, names), make("div", { class: "row" }, figures));
}

/** The directional surface of Young's modulus: what was reached as surfaces, the last one shown, what was asked as lines. */
function surfaces() {
  if (!compared().length) return;
  const all = compared().filter((t) => t.positive), without = compared().filter((t) => !t.positive), title = "Young’s modulus by direction", notes = [];
  if (without.length) {
    notes.push(make("p", { class: "warning" }, `Not drawn: ${without.map((t) => `“${t.name}”`).join(" and ")} has a Kelvin modulus that is not positive, so that there is no compliance to take Young’s modulus from.`));
  }
  if (!all.length) { section("young", title, ...notes); return; }
  const R = 72, C = 144, along = (i, j) => {
    const a = (Math.PI * i) / R, b = (2 * Math.PI * j) / C;
    return [Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a)];
  };
  const grid = (t) => { const c = inverse(t.voigt), out = []; for (let i = 0; i <= R; i++) for (let j = 0; j <= C; j++) { const n = along(i, j), e = young(c, n); out.push([n.map((x) => x * e), e]); } return out; };
  const grids = all.map(grid), values = grids.flat().map((p) => p[1]), range = extent(values), [size, unit] = stressUnit(range[1]);
  const sub = (a, b) => a.map((x, k) => x - b[k]), cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const surface = (gl, name, points) => {
    const at = (i, j) => points[i * (C + 1) + j], place = [], normal = [], value = [];
    const normalAt = (i, j) => {
      const u = sub(at(Math.min(i + 1, R), j)[0], at(Math.max(i - 1, 0), j)[0]), v = sub(at(i, (j + 1) % C)[0], at(i, (j + C - 1) % C)[0]), n = cross(u, v), l = Math.hypot(...n);
      return l > 0 ? n.map((x) => x / l) : along(i, j);
    };
    for (let i = 0; i < R; i++) for (let j = 0; j < C; j++)
      for (const [a, b] of [[i, j], [i + 1, j], [i + 1, j + 1], [i, j], [i + 1, j + 1], [i, j + 1]]) {
        place.push(...at(a, b)[0].map((x) => x / size)); normal.push(...normalAt(a, b)); value.push(at(a, b)[1] / size);
      }
    const attributes = { place: [new Float32Array(place), 3], normal: [new Float32Array(normal), 3] };
    return layer(gl, name, SURFACE, attributes, [new Float32Array(value)], gl.TRIANGLES);
  };
  const mesh = (gl, name, points) => {
    const lines = [];
    // A little outside, so that equal surfaces do not hide them.
    const push = (p) => lines.push(...p[0].map((x) => (1.003 * x) / size));
    for (let i = 0; i <= R; i += 6) for (let j = 0; j < C; j++) { push(points[i * (C + 1) + j]); push(points[i * (C + 1) + j + 1]); }
    for (let j = 0; j < C; j += 12) for (let i = 0; i < R; i++) { push(points[i * (C + 1) + j]); push(points[(i + 1) * (C + 1) + j]); }
    return layer(gl, name, INKED, { place: [new Float32Array(lines), 3] }, [new Float32Array(lines.length / 3)], gl.LINES);
  };
  const layers = (gl) => {
    if (all.length === 1) return [surface(gl, all[0].name, grids[0])];
    const out = all.slice(1).map((t, k) => surface(gl, t.name, grids[k + 1]));
    out.slice(0, -1).forEach((other) => { other.visible = false; });
    return [...out, mesh(gl, `${all[0].name} (lines)`, grids[0])];
  };
  const lines = all.length > 1 ? ` Red lines: ${all[0].name}; fainter where they lie within.` : "";
  const quantities = [{ name: "E", unit, range: range.map((x) => x / size) }];
  section("young", title, ...notes, picture("young", { quantities, layers, centre: [0, 0, 0], radius: (1.003 * Math.max(...values)) / size, count: 0, label: "Surface of Young's modulus by direction", help: `Distance from the centre is E along that direction.${lines}` }));
}

