"use strict";
// The page of a result: everything is drawn from the data in it; nothing is fetched.

const data = JSON.parse(document.getElementById("data").textContent);
const SVG = "http://www.w3.org/2000/svg";
const COLOURS = ["var(--accent)", "var(--second)", "var(--third)", "var(--quiet)"];

/** An element with attributes and children; text children are never parsed as markup. */
function make(tag, attributes = {}, ...children) {
  const svg = ["svg", "g", "path", "rect", "text", "line", "circle", "polyline", "title"].includes(tag);
  const element = svg ? document.createElementNS(SVG, tag) : document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else element.setAttribute(key, value);
  }
  element.append(...children.flat());
  return element;
}

/** A number as people read it. */
function shown(x) {
  if (typeof x !== "number") return String(x);
  if (x === 0 || !Number.isFinite(x)) return String(x);
  const size = Math.abs(x);
  if (size >= 1e6 || size < 1e-3) return x.toExponential(4).replace(/\.?0+e/, "e").replace("e+", "e");
  return String(Number(x.toPrecision(6)));
}

/** Pascals in a unit that fits the largest. */
function stressUnit(largest) {
  for (const [size, unit] of [[1e9, "GPa"], [1e6, "MPa"], [1e3, "kPa"]]) if (largest >= size) return [size, unit];
  return [1, "Pa"];
}

// ---- tensors ----------------------------------------------------------------------------------------------------

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

// ---- sections ---------------------------------------------------------------------------------------------------

function section(id, title, ...children) {
  const element = make("section", { id, "aria-labelledby": `${id}-title` }, make("h2", { id: `${id}-title` }, title), ...children);
  document.getElementById("main").append(element);
  document.getElementById("contents").append(make("a", { href: `#${id}` }, title));
  return element;
}

function factTable(facts) {
  return make("table", {}, make("tbody", {}, facts.map(([label, value]) => make("tr", {}, make("th", { scope: "row" }, label), make("td", {}, shown(value))))));
}

/** Red to blue around zero. */
function diverging(t) {
  const s = Math.max(-1, Math.min(1, t)), a = Math.abs(s) ** 0.7;
  return s < 0 ? `rgba(178, 80, 40, ${a})` : `rgba(40, 105, 175, ${a})`;
}

function heatMap(name, voigt, largest, [size, unit]) {
  const cell = 56, svg = make("svg", { viewBox: `0 0 ${6 * cell + 30} ${6 * cell + 24}`, role: "img", "aria-label": `${name} in ${unit}` });
  const names = PAIRS.map(([i, j]) => `${i + 1}${j + 1}`);
  for (let a = 0; a < 6; a++) {
    svg.append(make("text", { x: 30 + (a + 0.5) * cell, y: 14, "text-anchor": "middle", class: "quiet" }, names[a]));
    svg.append(make("text", { x: 22, y: 24 + (a + 0.58) * cell, "text-anchor": "end", class: "quiet" }, names[a]));
    for (let b = 0; b < 6; b++) {
      const x = 30 + b * cell, y = 20 + a * cell, value = voigt[a][b];
      svg.append(make("rect", { x, y, width: cell - 2, height: cell - 2, fill: diverging(value / largest), class: "axis" }));
      svg.append(make("text", { x: x + cell / 2 - 1, y: y + cell / 2 + 4, "text-anchor": "middle" }, Math.abs(value) < 1e-9 * largest ? "0" : String(Number((value / size).toPrecision(4)))));
    }
  }
  return make("figure", {}, svg, make("figcaption", {}, `${name} (${unit}, Voigt)`));
}

function tensors() {
  if (!data.tensors.length) return;
  const largest = Math.max(...data.tensors.flatMap((t) => t.voigt.flat().map(Math.abs)));
  const unit = stressUnit(largest);
  const maps = data.tensors.map((t) => heatMap(t.name, t.voigt, largest, unit));
  if (data.tensors.length > 1) {
    const [first, last] = [data.tensors[0], data.tensors[data.tensors.length - 1]];
    const difference = last.voigt.map((row, a) => row.map((x, b) => x - first.voigt[a][b]));
    const size = Math.max(...difference.flat().map(Math.abs));
    if (size > 1e-9 * largest) maps.push(heatMap(`${last.name} − ${first.name}`, difference, size, stressUnit(size)));
  }
  section("stiffness", "Stiffness", make("div", { class: "row" }, maps));
}

// ---- charts -----------------------------------------------------------------------------------------------------

function ticks(low, high) {
  const raw = (high - low) / 5 || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
  const out = [];
  for (let t = Math.ceil(low / step - 1e-9) * step; t <= high + 1e-9 * step; t += step) out.push(Math.abs(t) < 1e-9 * step ? 0 : t);
  return out;
}

function chart({ title, x, y, series }) {
  const points = series.flatMap((s) => s.points).filter((p) => p.every(Number.isFinite));
  if (!points.length) return make("p", {}, `${title}: no finite number`);
  const range = (k) => {
    const v = points.map((p) => p[k]);
    let low = v.reduce((a, b) => Math.min(a, b)), high = v.reduce((a, b) => Math.max(a, b));
    if (low === high) { low -= Math.abs(low) || 1; high += Math.abs(high) || 1; }
    return [low, high];
  };
  const [x0, x1] = range(0), [y0, y1] = range(1), W = 640, H = 320, L = 78, B = 44, T = 12, R = 12;
  const X = (v) => L + ((v - x0) / (x1 - x0)) * (W - L - R), Y = (v) => H - B - ((v - y0) / (y1 - y0)) * (H - B - T);
  const svg = make("svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": title });
  for (const t of ticks(x0, x1)) {
    svg.append(make("line", { x1: X(t), x2: X(t), y1: T, y2: H - B, class: "axis" }), make("text", { x: X(t), y: H - B + 16, "text-anchor": "middle" }, shown(t)));
  }
  for (const t of ticks(y0, y1)) {
    svg.append(make("line", { x1: L, x2: W - R, y1: Y(t), y2: Y(t), class: "axis" }), make("text", { x: L - 6, y: Y(t) + 4, "text-anchor": "end" }, shown(t)));
  }
  series.forEach((s, n) => {
    const line = s.points.filter((p) => p.every(Number.isFinite)).map((p) => `${X(p[0]).toFixed(1)},${Y(p[1]).toFixed(1)}`).join(" ");
    svg.append(make("polyline", { points: line, fill: "none", stroke: COLOURS[n % COLOURS.length], "stroke-width": 1.8, "stroke-dasharray": n < COLOURS.length ? "" : "5 3" }));
  });
  svg.append(make("text", { x: (L + W - R) / 2, y: H - 8, "text-anchor": "middle", class: "quiet" }, x), make("text", { x: 14, y: (H - B) / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${(H - B) / 2})`, class: "quiet" }, y));
  const legend = series.length > 1 ? make("div", { class: "controls" }, series.map((s, n) => make("span", {}, make("span", { style: `color:${COLOURS[n % COLOURS.length]}` }, n < COLOURS.length ? "━ " : "┅ "), s.name))) : "";
  return make("figure", {}, svg, legend, make("figcaption", {}, title));
}

function waves() {
  if (!data.tensors.length) return;
  const planes = [["x", "y", 0, 1], ["y", "z", 1, 2], ["x", "z", 0, 2]];
  const density = data.density || 1;
  const speeds = (voigt, n) => christoffel(voigt, n).map((g) => Math.sqrt(Math.max(0, g) / density));
  const last = data.tensors.length - 1, compared = last === 0 ? [0] : [0, last];
  let largest = 0;
  const curves = planes.map(([, , a, b]) => compared.map((t) => {
    const rows = [];
    for (let k = 0; k <= 180; k++) {
      const angle = (Math.PI * k) / 90, n = [0, 0, 0];
      n[a] = Math.cos(angle); n[b] = Math.sin(angle);
      const v = speeds(data.tensors[t].voigt, n);
      largest = Math.max(largest, v[2]);
      rows.push([angle, v]);
    }
    return rows;
  }));
  const figures = planes.map(([p, q], n) => {
    const svg = make("svg", { viewBox: "-130 -130 260 260", role: "img", "aria-label": `Wave speeds in the ${p}${q} plane` });
    for (const share of [0.5, 1]) {
      svg.append(make("circle", { cx: 0, cy: 0, r: 110 * share, class: "axis" }), make("text", { x: 3, y: -110 * share + 10, class: "quiet" }, shown(share * largest)));
    }
    svg.append(make("line", { x1: -118, x2: 118, y1: 0, y2: 0, class: "axis" }), make("line", { x1: 0, x2: 0, y1: -118, y2: 118, class: "axis" }));
    svg.append(make("text", { x: 120, y: 4 }, p), make("text", { x: -3, y: -120 }, q));
    curves[n].forEach((rows, t) => {
      for (let branch = 0; branch < 3; branch++) {
        const points = rows.map(([angle, v]) => `${((110 * v[branch] * Math.cos(angle)) / largest).toFixed(2)},${((-110 * v[branch] * Math.sin(angle)) / largest).toFixed(2)}`).join(" ");
        svg.append(make("polyline", { points, fill: "none", stroke: COLOURS[2 - branch], "stroke-width": 1.5, "stroke-dasharray": t === 0 && compared.length > 1 ? "4 3" : "" }));
      }
    });
    return make("figure", {}, svg, make("figcaption", {}, `${p}${q} plane`));
  });
  const what = compared.length > 1 ? `Dashed: ${data.tensors[0].name}; solid: ${data.tensors[last].name}. ` : "";
  const unit = data.density ? "m/s" : "√(Pa), that is √(C/ρ) for ρ = 1 kg/m³";
  section("waves", "Wave speeds", make("p", {}, `${what}Phase speeds of the three plane waves by direction (${unit}).`), make("div", { class: "row" }, figures));
}

// ---- pictures to turn -------------------------------------------------------------------------------------------

/** Numbers of single precision from base64. */
function floats(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

/** Dark blue, green, yellow: even in lightness. */
const MAP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
const GLSL_MAP = `vec3 colour(float t) {
  vec3 c[5]; ${MAP.map((c, i) => `c[${i}] = vec3(${c.map((x) => (x / 255).toFixed(4)).join(",")});`).join(" ")}
  float s = clamp(t, 0.0, 1.0) * 4.0; int i = int(min(floor(s), 3.0)); return mix(c[i], c[i + 1], s - float(i)); }`;

const SPHERES = [`#version 300 es
in vec2 corner; in vec4 sphere; in float value; uniform mat4 view; uniform mat4 project; uniform vec4 cut; uniform vec2 range; uniform float grow;
out vec2 at; out float t; out vec3 centre; out float radius;
void main() { at = corner; radius = sphere.w * grow; t = (value - range.x) / max(range.y - range.x, 1e-30);
  centre = (view * vec4(sphere.xyz, 1.0)).xyz;
  gl_Position = dot(cut.xyz, sphere.xyz) > cut.w ? vec4(2.0, 2.0, 2.0, 1.0) : project * vec4(centre + vec3(corner * radius, 0.0), 1.0); }`,
`#version 300 es
precision highp float; in vec2 at; in float t; in vec3 centre; in float radius; uniform mat4 project; out vec4 pixel; ${GLSL_MAP}
void main() { float s = dot(at, at); if (s > 1.0) discard; vec3 n = vec3(at, sqrt(1.0 - s)); vec4 p = project * vec4(centre + n * radius, 1.0);
  gl_FragDepth = 0.5 * p.z / p.w + 0.5; float light = 0.35 + 0.65 * max(0.0, dot(n, normalize(vec3(0.4, 0.6, 0.8)))); pixel = vec4(colour(t) * light, 1.0); }`];

const LINES = [`#version 300 es
in vec3 place; in float value; uniform mat4 view; uniform mat4 project; uniform vec4 cut; uniform vec2 range; out float t; out float keep;
void main() { t = (value - range.x) / max(range.y - range.x, 1e-30); keep = cut.w - dot(cut.xyz, place); gl_Position = project * view * vec4(place, 1.0); }`,
`#version 300 es
precision highp float; in float t; in float keep; out vec4 pixel; ${GLSL_MAP}
void main() { if (keep < 0.0) discard; pixel = vec4(colour(t), 1.0); }`];

const SURFACE = [`#version 300 es
in vec3 place; in vec3 normal; in float value; uniform mat4 view; uniform mat4 project; uniform vec4 cut; uniform vec2 range; out float t; out vec3 n; out float keep;
void main() { t = (value - range.x) / max(range.y - range.x, 1e-30); n = mat3(view) * normal; keep = cut.w - dot(cut.xyz, place); gl_Position = project * view * vec4(place, 1.0); }`,
`#version 300 es
precision highp float; in float t; in vec3 n; in float keep; out vec4 pixel; ${GLSL_MAP}
void main() { if (keep < 0.0) discard; vec3 m = normalize(n); if (!gl_FrontFacing) m = -m; float light = 0.4 + 0.6 * max(0.0, dot(m, normalize(vec3(0.4, 0.6, 0.8)))); pixel = vec4(colour(t) * light, 1.0); }`];

function program(gl, [vertex, fragment]) {
  const p = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(p, shader);
  }
  gl.linkProgram(p);
  if (!gl.getProgramParameter(p, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(p));
  return p;
}

/** Something drawn: attributes by name with their sizes, drawn as triangles, lines, or one quad per instance. */
function layer(gl, sources, attributes, mode, count, instanced = false) {
  const p = program(gl, sources), vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  if (instanced) attributes = { corner: [new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), 2, 0], ...attributes };
  for (const [name, [values, size, divisor]] of Object.entries(attributes)) {
    const at = gl.getAttribLocation(p, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    gl.vertexAttribDivisor(at, divisor ?? (instanced ? 1 : 0));
  }
  const where = (name) => gl.getUniformLocation(p, name);
  return { visible: true, count, draw(view, project, cut, range, grow, share) {
    const some = Math.min(count, 2 * Math.ceil(0.5 * share * count));
    gl.useProgram(p);
    gl.bindVertexArray(vao);
    gl.uniformMatrix4fv(where("view"), false, view);
    gl.uniformMatrix4fv(where("project"), false, project);
    gl.uniform4fv(where("cut"), cut);
    gl.uniform2fv(where("range"), range);
    gl.uniform1f(where("grow"), grow);
    if (instanced) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, some);
    else gl.drawArrays(mode, 0, mode === gl.TRIANGLES ? count : some);
  } };
}

/** A canvas that is turned by mouse, touch and keys. */
function viewer({ name, unit, layers, centre, radius, range, label, help }) {
  const canvas = make("canvas", { tabindex: 0, role: "img", "aria-label": `${label}. Arrow keys turn, plus and minus zoom, C cuts.` });
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return make("p", { class: "warning" }, `${label}: this browser has no WebGL 2.`);
  const drawn = layers(gl);
  const state = { yaw: 0.7, pitch: 0.45, zoom: 1, axis: "none", cut: 1, grow: 1 };
  // While it moves, so many of the spheres and lines are drawn (they are shuffled); all of them once it rests.
  const most = 12000, share = Math.min(1, most / Math.max(...drawn.map((d) => d.count)));
  let moving = false, rest = null;
  const normal = () => ({ x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] })[state.axis];
  function draw() {
    const ratio = window.devicePixelRatio || 1, w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [cy, sy, cp, sp] = [Math.cos(state.yaw), Math.sin(state.yaw), Math.cos(state.pitch), Math.sin(state.pitch)];
    // Rows: right, up, towards the eye; z is up at pitch 0.
    const r = [[-sy, cy, 0], [-sp * cy, -sp * sy, cp], [cp * cy, cp * sy, sp]], s = 1 / radius;
    const shift = r.map((row) => -s * (row[0] * centre[0] + row[1] * centre[1] + row[2] * centre[2]));
    const view = new Float32Array([s * r[0][0], s * r[1][0], s * r[2][0], 0, s * r[0][1], s * r[1][1], s * r[2][1], 0, s * r[0][2], s * r[1][2], s * r[2][2], 0, shift[0], shift[1], shift[2], 1]);
    const k = state.zoom / 1.1, aspect = w / h, px = aspect > 1 ? k / aspect : k, py = aspect > 1 ? k : k * aspect;
    const project = new Float32Array([px, 0, 0, 0, 0, py, 0, 0, 0, 0, -0.25, 0, 0, 0, 0, 1]);
    const n = normal(), cut = n ? [...n, n.reduce((a, x, i) => a + x * centre[i], 0) + radius * (2 * state.cut - 1)] : [0, 0, 0, 1];
    for (const d of drawn) if (d.visible) d.draw(view, project, cut, range, state.grow * s, moving ? share : 1);
    canvas.dataset.frames = String(Number(canvas.dataset.frames || 0) + 1);
  }
  let asked = false;
  const move = () => { moving = share < 1; clearTimeout(rest); if (moving) rest = setTimeout(() => { moving = false; redraw(); }, 600); redraw(); };
  const redraw = () => { if (!asked) { asked = true; requestAnimationFrame(() => { asked = false; draw(); }); } };
  let held = null;
  canvas.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("pointermove", (e) => {
    if (!held) return;
    state.yaw -= (e.clientX - held[0]) * 0.008;
    state.pitch = Math.max(-1.57, Math.min(1.57, state.pitch + (e.clientY - held[1]) * 0.008));
    held = [e.clientX, e.clientY];
    move();
  });
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); state.zoom = Math.max(0.2, Math.min(40, state.zoom * Math.exp(-0.001 * e.deltaY))); move(); }, { passive: false });
  const axes = make("select", { "aria-label": "Cut along", onchange: () => { state.axis = axes.value; redraw(); } }, ["none", "x", "y", "z"].map((a) => make("option", { value: a }, a === "none" ? "no cut" : `cut along ${a}`)));
  const depth = make("input", { type: "range", min: 0, max: 1, step: 0.01, value: 1, "aria-label": "Depth of the cut", oninput: () => { state.cut = Number(depth.value); move(); } });
  canvas.addEventListener("keydown", (e) => {
    const step = { ArrowLeft: ["yaw", 0.1], ArrowRight: ["yaw", -0.1], ArrowUp: ["pitch", 0.1], ArrowDown: ["pitch", -0.1] }[e.key];
    if (step) state[step[0]] += step[1];
    else if (e.key === "+" || e.key === "=") state.zoom *= 1.15;
    else if (e.key === "-") state.zoom /= 1.15;
    else if (e.key === "c" || e.key === "C") { axes.selectedIndex = (axes.selectedIndex + 1) % 4; state.axis = axes.value; if (state.cut === 1) { state.cut = 0.5; depth.value = 0.5; } }
    else return;
    state.pitch = Math.max(-1.57, Math.min(1.57, state.pitch));
    e.preventDefault();
    move();
  });
  const low = make("input", { type: "number", step: "any", value: range[0].toPrecision(4), "aria-label": "Lowest value of the colours", style: "width:8rem", onchange: () => { range[0] = Number(low.value); redraw(); } });
  const high = make("input", { type: "number", step: "any", value: range[1].toPrecision(4), "aria-label": "Highest value of the colours", style: "width:8rem", onchange: () => { range[1] = Number(high.value); redraw(); } });
  const bar = make("span", { class: "scale", style: `background:linear-gradient(90deg, ${MAP.map((c) => `rgb(${c.join(",")})`).join(",")})` });
  const layersShown = drawn.filter((d) => d.name).map((d) => {
    const box = make("input", { type: "checkbox", onchange: () => { d.visible = box.checked; redraw(); } });
    box.checked = d.visible;
    return make("label", {}, box, ` ${d.name}`);
  });
  new ResizeObserver(redraw).observe(canvas);
  matchMedia("print").addEventListener("change", redraw);
  return make("figure", { class: "view" }, canvas, make("div", { class: "controls" }, make("span", {}, `${name}${unit ? ` (${unit})` : ""} `, low, " ", bar, " ", high), axes, depth, layersShown), make("figcaption", {}, `${help} Drag or use the arrow keys to turn, the wheel or + and − to zoom, C to cut.`));
}

/** The directional surface of Young's modulus: the last tensor as a surface, the first as lines. */
function surfaces() {
  const compliances = data.tensors.map((t) => inverse(t.voigt));
  if (!compliances.length || compliances.some((c) => !c)) return;
  const last = compliances.length - 1, R = 72, C = 144, along = (i, j) => {
    const a = (Math.PI * i) / R, b = (2 * Math.PI * j) / C;
    return [Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a)];
  };
  const grid = (c) => { const out = []; for (let i = 0; i <= R; i++) for (let j = 0; j <= C; j++) { const n = along(i, j), e = young(c, n); out.push([n.map((x) => x * e), e]); } return out; };
  const reached = grid(compliances[last]), values = reached.map((p) => p[1]);
  if (!values.every((v) => Number.isFinite(v) && v > 0)) return;
  const largest = Math.max(...values), [size, unit] = stressUnit(largest);
  const at = (i, j) => reached[i * (C + 1) + j];
  const place = [], normal = [], value = [];
  const sub = (a, b) => a.map((x, k) => x - b[k]), cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const normalAt = (i, j) => {
    const u = sub(at(Math.min(i + 1, R), j)[0], at(Math.max(i - 1, 0), j)[0]), v = sub(at(i, (j + 1) % C)[0], at(i, (j + C - 1) % C)[0]), n = cross(u, v), l = Math.hypot(...n);
    return l > 0 ? n.map((x) => x / l) : along(i, j);
  };
  for (let i = 0; i < R; i++) for (let j = 0; j < C; j++)
    for (const [a, b] of [[i, j], [i + 1, j], [i + 1, j + 1], [i, j], [i + 1, j + 1], [i, j + 1]]) {
      place.push(...at(a, b)[0].map((x) => x / size)); normal.push(...normalAt(a, b)); value.push(at(a, b)[1] / size);
    }
  const layers = (gl) => {
    const out = [Object.assign(layer(gl, SURFACE, { place: [new Float32Array(place), 3], normal: [new Float32Array(normal), 3], value: [new Float32Array(value), 1] }, gl.TRIANGLES, value.length), { name: data.tensors[last].name })];
    if (last > 0) {
      const target = grid(compliances[0]), lines = [], of = [];
      const push = (p) => { lines.push(...p[0].map((x) => x / size)); of.push(p[1] / size); };
      for (let i = 0; i <= R; i += 6) for (let j = 0; j < C; j++) { push(target[i * (C + 1) + j]); push(target[i * (C + 1) + j + 1]); }
      for (let j = 0; j < C; j += 12) for (let i = 0; i < R; i++) { push(target[i * (C + 1) + j]); push(target[(i + 1) * (C + 1) + j]); }
      out.push(Object.assign(layer(gl, LINES, { place: [new Float32Array(lines), 3], value: [new Float32Array(of), 1] }, gl.LINES, of.length), { name: `${data.tensors[0].name} (lines)` }));
    }
    return out;
  };
  const range = [Math.min(...values) / size, largest / size];
  if (range[1] - range[0] < 1e-6 * range[1]) { range[0] *= 0.99; range[1] *= 1.01; }
  section("young", "Young’s modulus by direction", viewer({ name: "E", unit, layers, centre: [0, 0, 0], radius: largest / size, range, label: "Surface of Young's modulus by direction", help: "Distance from the centre is E along that direction." }));
}

/** Groups of numbers in a random order that is always the same. */
function shuffled(count, ...arrays) {
  const order = Uint32Array.from({ length: count }, (_, i) => i);
  let seed = 12345;
  for (let i = count - 1; i > 0; i--) {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    const j = seed % (i + 1);
    [order[i], order[j]] = [order[j], order[i]];
  }
  return arrays.map((values) => {
    const size = values.length / count, out = new Float32Array(values.length);
    order.forEach((from, to) => { for (let k = 0; k < size; k++) out[to * size + k] = values[from * size + k]; });
    return out;
  });
}

/** The neighbourhood or lattice. */
function scene() {
  const s = data.scene;
  if (!s) return;
  const number = floats(s.values).length, joined = floats(s.line_values).length;
  const [spheres, values] = shuffled(number, floats(s.spheres), floats(s.values));
  const [lines, lineValues] = shuffled(joined, floats(s.lines), floats(s.line_values));
  const all = lineValues.length ? lineValues : values;
  const range = [Infinity, -Infinity];
  for (const v of all) { if (v < range[0]) range[0] = v; if (v > range[1]) range[1] = v; }
  if (!(range[1] > range[0])) { const m = Number.isFinite(range[0]) ? range[0] : 0; range[0] = m - Math.abs(m) - 1e-30; range[1] = m + Math.abs(m) + 1e-30; }
  const low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
  for (let i = 0; i < spheres.length; i += 4) for (let a = 0; a < 3; a++) { low[a] = Math.min(low[a], spheres[i + a] - spheres[i + 3]); high[a] = Math.max(high[a], spheres[i + a] + spheres[i + 3]); }
  const centre = low.map((x, a) => 0.5 * (x + high[a])), radius = 0.5 * Math.hypot(...low.map((x, a) => high[a] - x)) || 1;
  const layers = (gl) => {
    const out = [];
    if (lineValues.length) {
      const both = new Float32Array(2 * lineValues.length);
      lineValues.forEach((v, i) => { both[2 * i] = both[2 * i + 1] = v; });
      out.push(Object.assign(layer(gl, LINES, { place: [lines, 3], value: [both, 1] }, gl.LINES, both.length), { name: "bonds" }));
    }
    out.push(Object.assign(layer(gl, SPHERES, { sphere: [spheres, 4], value: [values, 1] }, 0, values.length, true), { name: "nodes" }));
    return out;
  };
  section("scene", s.title, viewer({ name: s.quantity, unit: s.unit, layers, centre, radius, range, label: s.title, help: s.help }));
}

// ---- the page ---------------------------------------------------------------------------------------------------

document.title = `${data.title} – anisobond`;
document.getElementById("title").textContent = data.title;
document.getElementById("kind").textContent = data.kind;
document.getElementById("footer").textContent = `anisobond ${data.version}. This file needs no network.`;
const root = document.documentElement;
document.getElementById("theme").addEventListener("click", () => {
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
});
section("facts", "What was asked, what was reached", ...data.warnings.map((w) => make("p", { class: "warning" }, w)), make("div", { class: "row" }, data.facts.map(([title, facts]) => make("div", {}, make("h3", {}, title), factTable(facts)))));
tensors();
surfaces();
scene();
waves();
if (data.charts.length) section("charts", data.charts_title, make("div", { class: "row" }, data.charts.map(chart)));
if (data.pictures.length) section("pictures", "Pictures", make("div", { class: "row" }, data.pictures.map((p) => make("figure", {}, make("img", { src: p.data, alt: p.name }), make("figcaption", {}, p.name)))));
if (data.table) {
  const { columns, rows, all } = data.table;
  const note = rows.length < all ? `The first ${rows.length} of ${all} rows.` : `${all} rows.`;
  section("table", data.table.title, make("p", {}, note), make("div", { class: "scroll", tabindex: 0 }, make("table", {}, make("thead", {}, make("tr", {}, columns.map((c) => make("th", { scope: "col" }, c)))), make("tbody", {}, rows.map((r) => make("tr", {}, r.map((c) => make("td", {}, shown(c)))))))));
}
