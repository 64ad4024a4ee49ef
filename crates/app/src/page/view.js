// ---- pictures to turn -------------------------------------------------------------------------------------------

/** Numbers of single precision from base64. */
function floats(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

/** Dark blue, green, yellow: even in lightness. Of it the part is used that stands out from the background. */
const MAP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** The part of the map for a theme: on white not the yellow end, on black not the blue one. */
const part = (dark) => (dark ? [0.28, 1] : [0, 0.72]);

/** Colour at a place of the map between 0 and 1. */
function mapped(t) {
  const s = 4 * t, i = Math.min(3, Math.floor(s));
  return `rgb(${MAP[i].map((x, k) => Math.round(x + (s - i) * (MAP[i + 1][k] - x))).join(",")})`;
}

/** Lines that are compared with a coloured surface: red is not in the map, and stands out from both backgrounds. */
const INK = (dark) => (dark ? [1, 0.36, 0.58] : [0.85, 0.08, 0.36]);

/** Colour of a value, worked out at vertices; lines and surfaces that span a range need it at pixels. */
const GLSL_MAP = `uniform vec2 part; vec3 colour(float t) {
  vec3 c[5]; ${MAP.map((c, i) => `c[${i}] = vec3(${c.map((x) => (x / 255).toFixed(4)).join(",")});`).join(" ")}
  float s = mix(part.x, part.y, clamp(t, 0.0, 1.0)) * 4.0; int i = int(min(floor(s), 3.0)); return mix(c[i], c[i + 1], s - float(i)); }`;

/** From the upper left, in front: (0.4, 0.6, 0.8) of length one. */
const LIGHT = "vec3(0.3714, 0.5571, 0.7428)";

/** A sphere is a square that faces the eye; each pixel works out where it meets the sphere. */
const SPHERES = [`#version 300 es
in vec2 corner; in vec4 sphere; in float value; uniform mat4 view; uniform mat4 project; uniform vec4 cut; uniform vec2 range; uniform float grow;
out vec2 at; flat out vec3 paint; flat out vec2 depth; ${GLSL_MAP}
void main() { at = corner; float radius = sphere.w * grow; paint = colour((value - range.x) / max(range.y - range.x, 1e-30));
  vec3 centre = (view * vec4(sphere.xyz, 1.0)).xyz; vec4 p = project * vec4(centre + vec3(corner * radius, 0.0), 1.0);
  depth = vec2(0.5 * p.z + 0.5, 0.5 * project[2][2] * radius);
  gl_Position = dot(cut.xyz, sphere.xyz) > cut.w ? vec4(2.0, 2.0, 2.0, 1.0) : p; }`,
`#version 300 es
precision highp float; in vec2 at; flat in vec3 paint; flat in vec2 depth; out vec4 pixel;
void main() { float s = 1.0 - dot(at, at); if (s < 0.0) discard; float z = sqrt(s); gl_FragDepth = depth.x + depth.y * z;
  pixel = vec4(paint * (0.35 + 0.65 * max(0.0, dot(vec3(at, z), ${LIGHT}))), 1.0); }`];

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
void main() { if (keep < 0.0) discard; vec3 m = normalize(n); if (!gl_FrontFacing) m = -m; pixel = vec4(colour(t) * (0.4 + 0.6 * max(0.0, dot(m, ${LIGHT}))), 1.0); }`];

/** Lines of one colour. */
const INKED = [`#version 300 es
in vec3 place; in float value; uniform mat4 view; uniform mat4 project; uniform vec4 cut; out float keep;
void main() { keep = cut.w - dot(cut.xyz, place) + 0.0 * value; gl_Position = project * view * vec4(place, 1.0); }`,
`#version 300 es
precision highp float; in float keep; uniform vec4 ink; out vec4 pixel;
void main() { if (keep < 0.0) discard; pixel = vec4(ink.rgb * ink.a, ink.a); }`];

function program(gl, [vertex, fragment]) {
  const p = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(p, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(p);
  if (!gl.getProgramParameter(p, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(p));
  return p;
}

/** Something drawn: attributes by name with their sizes, drawn as triangles, lines, or one square per instance; `values`
    has one array for each quantity that may colour it. */
function layer(gl, name, sources, attributes, values, mode, instanced = false) {
  const inked = sources === INKED;
  const p = program(gl, sources), vao = gl.createVertexArray(), buffers = [], count = values[0].length;
  gl.bindVertexArray(vao);
  const bind = (name, array, size, divisor) => {
    const at = gl.getAttribLocation(p, name), buffer = gl.createBuffer();
    buffers.push(buffer);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    gl.vertexAttribDivisor(at, divisor);
    return buffer;
  };
  if (instanced) bind("corner", new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), 2, 0);
  for (const [name, [array, size]] of Object.entries(attributes)) bind(name, array, size, instanced ? 1 : 0);
  const colours = bind("value", values[0], 1, instanced ? 1 : 0);
  const where = Object.fromEntries(["view", "project", "cut", "range", "grow", "part", "ink"].map((n) => [n, gl.getUniformLocation(p, n)]));
  return {
    name, count, visible: true,
    /** Whether a part of it will do while it moves. */
    thins: mode !== gl.TRIANGLES && !inked,
    /** Colours by another quantity. */
    paint(quantity) { gl.bindBuffer(gl.ARRAY_BUFFER, colours); gl.bufferData(gl.ARRAY_BUFFER, values[quantity], gl.STATIC_DRAW); },
    draw(view, project, cut, range, grow, share, dark) {
      const some = this.thins ? Math.min(count, 2 * Math.ceil(0.5 * share * count)) : count;
      gl.useProgram(p);
      gl.bindVertexArray(vao);
      gl.uniformMatrix4fv(where.view, false, view);
      gl.uniformMatrix4fv(where.project, false, project);
      gl.uniform4fv(where.cut, cut);
      gl.uniform2fv(where.range, range);
      gl.uniform1f(where.grow, grow);
      gl.uniform2fv(where.part, part(dark));
      if (instanced) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, some);
      else if (!inked) gl.drawArrays(mode, 0, some);
      else {
        // What lies behind something shines through.
        gl.depthFunc(gl.GREATER); gl.depthMask(false); gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        gl.uniform4fv(where.ink, [...INK(dark), 0.4]);
        gl.drawArrays(mode, 0, some);
        gl.depthFunc(gl.LESS); gl.depthMask(true); gl.disable(gl.BLEND);
        gl.uniform4fv(where.ink, [...INK(dark), 1]);
        gl.drawArrays(mode, 0, some);
      }
    },
    remove() { buffers.forEach((b) => gl.deleteBuffer(b)); gl.deleteVertexArray(vao); gl.deleteProgram(p); },
  };
}

/** While a picture moves, so many spheres or lines are drawn (they are shuffled); all of them once it rests. */
const MOST_MOVING = 12000;

/** Above so many, edges are not smoothed: four samples a pixel take longer than the spheres themselves. */
const MOST_SMOOTH = 20000;

/** Least and largest of many numbers, apart even if they are equal. */
function extent(values) {
  let low = Infinity, high = -Infinity;
  for (const v of values) { if (v < low) low = v; if (v > high) high = v; }
  if (!Number.isFinite(low)) return [0, 1];
  return high - low > 1e-6 * Math.abs(high) ? [low, high] : [low - 0.01 * Math.abs(low) - 1e-30, high + 0.01 * Math.abs(high) + 1e-30];
}

/** Pictures by their names: when new data are shown they stay turned as they are. */
const pictures = {};

/** Whether the background is dark. */
const isDark = () => getComputedStyle(document.documentElement).colorScheme === "dark";

/** Pixels of a picture on paper, where it is 16 × 9 cm: lines are one pixel wide. */
const PAPER = [1120, 630];
let printing = false;
const redrawAll = () => { for (const p of Object.values(pictures)) p.redraw(); };
// Paper is drawn for before its layout is known. A copy is printed: what WebGL draws appears only with the screen's next frame.
addEventListener("beforeprint", () => {
  printing = true;
  for (const p of Object.values(pictures)) {
    if (!p.canvas) continue;
    p.draw();
    const copy = make("canvas", { class: "paper", width: PAPER[0], height: PAPER[1] });
    copy.getContext("2d").drawImage(p.canvas, 0, 0);
    p.canvas.after(copy);
  }
});
addEventListener("afterprint", () => {
  printing = false;
  document.querySelectorAll(".paper").forEach((copy) => copy.remove());
  redrawAll();
});
addEventListener("theme", redrawAll);

/** Three axes in a corner, to be turned as the picture is. */
function triad() {
  const svg = make("svg", { viewBox: "-34 -34 68 68", class: "triad", "aria-hidden": "true" });
  const axes = ["x", "y", "z"].map((name) => { const axis = [make("line"), make("text", { "text-anchor": "middle" }, name)]; svg.append(...axis); return axis; });
  return { svg, turn([right, up]) { axes.forEach(([line, text], a) => {
    const [x, y] = [right[a], -up[a]];
    for (const [key, value] of Object.entries({ x1: 0, y1: 0, x2: 21 * x, y2: 21 * y })) line.setAttribute(key, value);
    text.setAttribute("x", 28 * x); text.setAttribute("y", 28 * y + 4);
  }); } };
}

/** A canvas that is turned by mouse, touch and keys. `content` has quantities (name, unit, range), layers, centre, radius. */
function picture(id, content) {
  const smooth = content.count <= MOST_SMOOTH;
  if (pictures[id]?.smooth !== smooth) pictures[id] = newPicture(smooth);
  pictures[id].set(content);
  return pictures[id].figure;
}

function newPicture(smooth) {
  const canvas = make("canvas", { tabindex: 0, role: "img" });
  const gl = canvas.getContext("webgl2", { antialias: smooth, preserveDrawingBuffer: true });
  if (!gl) return { smooth, figure: make("p", { class: "warning" }, "Pictures in three dimensions need a browser with WebGL 2."), set() {}, draw() {}, redraw() {} };
  const state = { yaw: 0.7, pitch: 0.45, zoom: 1, axis: "none", cut: 1 };
  let content = null, drawn = [], ranges = [], quantity = 0, share = 1, moving = false, rest = null, asked = false;
  const held = new Map(), chosen = new Map(), corner = triad();
  const normal = () => ({ x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] })[state.axis];
  function draw() {
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = printing ? PAPER : [canvas.clientWidth, canvas.clientHeight].map((x) => Math.round(x * ratio));
    if (!content || !w || !h) return;
    const { centre, radius } = content;
    const dark = !printing && isDark();
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
    for (const d of drawn) if (d.visible) d.draw(view, project, cut, ranges[quantity], s, moving && !printing ? share : 1, dark);
    corner.turn(r);
    const [from, to] = part(dark);
    bar.style.background = `linear-gradient(90deg, ${[0, 1, 2, 3, 4, 5, 6].map((k) => mapped(from + (k / 6) * (to - from))).join(",")})`;
    canvas.dataset.frames = String(Number(canvas.dataset.frames || 0) + 1);
  }
  // The pause before all is drawn begins when a frame is done, however long it took.
  const settle = () => { clearTimeout(rest); if (moving) rest = setTimeout(() => { moving = false; redraw(); }, 600); };
  const redraw = () => { if (!asked) { asked = true; requestAnimationFrame(() => { asked = false; draw(); settle(); }); } };
  const move = () => { moving = share < 1; clearTimeout(rest); redraw(); };
  const tilt = (pitch) => { state.pitch = Math.max(-1.57, Math.min(1.57, pitch)); };
  const zoom = (factor) => { state.zoom = Math.max(0.2, Math.min(40, state.zoom * factor)); };
  canvas.addEventListener("pointerdown", (e) => { held.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => { held.delete(e.pointerId); });
  // Of two fingers the distance zooms.
  const apart = () => { const [a, b] = [...held.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  canvas.addEventListener("pointermove", (e) => {
    const before = held.get(e.pointerId);
    if (!before) return;
    const far = held.size === 2 ? apart() : 0;
    held.set(e.pointerId, [e.clientX, e.clientY]);
    if (far) zoom(apart() / far);
    if (held.size === 1) {
      state.yaw -= (e.clientX - before[0]) * 0.008;
      tilt(state.pitch + (e.clientY - before[1]) * 0.008);
    }
    move();
  });
  for (const kind of ["touchstart", "touchmove"]) canvas.addEventListener(kind, (e) => { if (e.touches.length > 1) e.preventDefault(); }, { passive: false });
  canvas.addEventListener("wheel", (e) => {
    // The page scrolls on unless the picture was chosen.
    if (document.activeElement !== canvas) return;
    e.preventDefault();
    zoom(Math.exp(-0.001 * e.deltaY));
    move();
  }, { passive: false });
  const axes = make("select", { "aria-label": "Cut along", onchange: () => { state.axis = axes.value; redraw(); } }, ["none", "x", "y", "z"].map((a) => make("option", { value: a }, a === "none" ? "no cut" : `cut along ${a}`)));
  const depth = make("input", { type: "range", min: 0, max: 1, step: 0.01, value: 1, "aria-label": "Depth of the cut", oninput: () => { state.cut = Number(depth.value); move(); } });
  canvas.addEventListener("keydown", (e) => {
    // Those are the browser's.
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const turn = { ArrowLeft: 0.1, ArrowRight: -0.1 }[e.key], up = { ArrowUp: 0.1, ArrowDown: -0.1 }[e.key];
    if (turn) state.yaw += turn;
    else if (up) tilt(state.pitch + up);
    else if (e.key === "+" || e.key === "=") zoom(1.15);
    else if (e.key === "-") zoom(1 / 1.15);
    else if (e.key === "c" || e.key === "C") {
      axes.selectedIndex = (axes.selectedIndex + 1) % 4;
      state.axis = axes.value;
      if (state.cut === 1) { state.cut = 0.5; depth.value = 0.5; }
    } else return;
    e.preventDefault();
    move();
  });
  const end = (which, label) => make("input", { type: "number", step: "any", class: "end", "aria-label": label, onchange: (e) => {
    const typed = Number(e.target.value);
    if (e.target.value !== "" && Number.isFinite(typed)) ranges[quantity][which] = typed;
    redraw();
  } });
  const low = end(0, "Lowest value of the colours"), high = end(1, "Highest value of the colours");
  const bar = make("span", { class: "scale" });
  const names = make("select", { "aria-label": "Colour by", onchange: () => { quantity = names.selectedIndex; drawn.forEach((d) => d.paint(quantity)); ends(); redraw(); } });
  const parts = make("span", { class: "parts" }), caption = make("figcaption");
  const ends = () => { low.value = ranges[quantity][0].toPrecision(4); high.value = ranges[quantity][1].toPrecision(4); };
  new ResizeObserver(redraw).observe(canvas);
  const nearer = [["+", 1.3, "Nearer"], ["−", 1 / 1.3, "Farther"]].map(([sign, factor, label]) => make("button", { type: "button", "aria-label": label, onclick: () => { zoom(factor); move(); } }, sign));
  const figure = make("figure", { class: "view" }, make("div", { class: "canvas" }, canvas, corner.svg, make("span", { class: "nearer" }, nearer)), make("div", { class: "controls" }, make("span", {}, names, " ", low, " ", bar, " ", high), make("span", {}, axes, " ", depth), parts), caption);
  return {
    smooth, figure, canvas, draw, redraw,
    set(next) {
      const same = content?.radius === next.radius;
      drawn.forEach((d) => d.remove());
      content = next;
      drawn = next.layers(gl);
      ranges = next.quantities.map((q) => [...q.range]);
      quantity = Math.min(quantity, ranges.length - 1);
      if (quantity) drawn.forEach((d) => d.paint(quantity));
      names.replaceChildren(...next.quantities.map((q) => make("option", {}, q.unit ? `${q.name} (${q.unit})` : q.name)));
      names.selectedIndex = quantity;
      names.disabled = ranges.length < 2;
      ends();
      share = Math.min(1, MOST_MOVING / Math.max(1, ...drawn.map((d) => (d.thins ? d.count : 0))));
      if (!same) state.zoom = 1;
      for (const d of drawn) d.visible = chosen.get(d.name) ?? d.visible;
      parts.replaceChildren(...drawn.map((d) => {
        const box = make("input", { type: "checkbox", onchange: () => { d.visible = box.checked; chosen.set(d.name, d.visible); redraw(); } });
        box.checked = d.visible;
        return make("label", {}, box, ` ${d.name}`);
      }));
      canvas.setAttribute("aria-label", `${next.label}. Arrow keys turn, plus and minus zoom, C cuts.`);
      caption.textContent = `${next.help} Drag, or use the arrow keys, to turn; two fingers, + and −, or the wheel after a click, to zoom; C to cut.`;
      redraw();
    },
  };
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
    const size = values.length / count || 1, out = new Float32Array(values.length);
    order.forEach((from, to) => { for (let k = 0; k < size; k++) out[to * size + k] = values[from * size + k]; });
    return out;
  });
}

/** The neighbourhood or lattice. */
function scene() {
  const s = data.scene;
  if (!s) return;
  const all = s.quantities.map((q) => [floats(q.values), floats(q.line_values)]);
  const [spheres, ...values] = shuffled(all[0][0].length, floats(s.spheres), ...all.map((q) => q[0]));
  const [lines, ...ofLines] = shuffled(all[0][1].length, floats(s.lines), ...all.map((q) => q[1]));
  const low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
  for (let i = 0; i < spheres.length; i += 4) for (let a = 0; a < 3; a++) { low[a] = Math.min(low[a], spheres[i + a] - spheres[i + 3]); high[a] = Math.max(high[a], spheres[i + a] + spheres[i + 3]); }
  const centre = low.map((x, a) => 0.5 * (x + high[a])), away = (i) => Math.hypot(...centre.map((x, a) => spheres[i + a] - x)) + spheres[i + 3];
  let radius = 0;
  for (let i = 0; i < spheres.length; i += 4) radius = Math.max(radius, away(i));
  radius ||= 1;
  const layers = (gl) => {
    const nodes = layer(gl, "nodes", SPHERES, { sphere: [spheres, 4] }, values, 0, true);
    if (!ofLines[0].length) return [nodes];
    const both = ofLines.map((v) => { const out = new Float32Array(2 * v.length); v.forEach((x, i) => { out[2 * i] = out[2 * i + 1] = x; }); return out; });
    return [layer(gl, "bonds", LINES, { place: [lines, 3] }, both, gl.LINES), nodes];
  };
  const quantities = s.quantities.map((q, n) => ({ name: q.name, unit: q.unit, range: extent(ofLines[n].length ? ofLines[n] : values[n]) }));
  section("scene", s.title, picture("scene", { quantities, layers, centre, radius, count: values[0].length, label: s.title, help: s.help }));
}

