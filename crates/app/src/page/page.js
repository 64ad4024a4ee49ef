"use strict";
// The page of a result: everything is drawn from its data; nothing is fetched.

const SVG = "http://www.w3.org/2000/svg";
/** Told apart by those who do not see red or green too; charts add dashes. */
const COLOURS = ["var(--accent)", "var(--second)", "var(--third)", "var(--fourth)", "var(--fifth)", "var(--quiet)"];

/** What is shown. */
let data = null;

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

/** A power of ten in words. */
function power(exponent) {
  return `10${[...String(exponent)].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("")}`;
}

/** Pascals in a unit that fits the largest. */
function stressUnit(largest) {
  for (const [size, unit] of [[1e9, "GPa"], [1e6, "MPa"], [1e3, "kPa"]]) if (largest >= size) return [size, unit];
  return [1, "Pa"];
}

function section(id, title, ...children) {
  const element = make("section", { id, "aria-labelledby": `${id}-title` }, make("h2", { id: `${id}-title` }, title), ...children);
  document.getElementById("main").append(element);
  document.getElementById("contents").append(make("a", { href: `#${id}` }, title));
  return element;
}

function factTable(facts) {
  return make("table", {}, make("tbody", {}, facts.map(([label, value]) => make("tr", {}, make("th", { scope: "row" }, label), make("td", {}, shown(value))))));
}

/** Rows and columns of a table that are printed. */
const PRINTED = [40, 12];

function tableSection({ title, columns, rows, all, without }) {
  const note = [rows.length < all ? `The first ${rows.length} of ${all} rows.` : `${all} rows.`];
  if (without) note.push(`${without} columns that are the same in every row, or are told elsewhere, are left out.`);
  const [most, widest] = PRINTED, unprinted = (n) => (n >= widest ? { class: "unprinted" } : {});
  const head = make("thead", {}, make("tr", {}, columns.map((c, n) => make("th", { scope: "col", ...unprinted(n) }, c))));
  // Of many rows some from all of the table are printed.
  const step = Math.ceil(rows.length / most);
  const body = make("tbody", {}, rows.map((r, k) => make("tr", k % step ? { class: "unprinted" } : {}, r.map((c, n) => make("td", unprinted(n), shown(c))))));
  const paper = [];
  if (step > 1) paper.push(`One row of ${step} is printed.`);
  if (columns.length > widest) paper.push(`The first ${widest} of ${columns.length} columns are printed.`);
  note.push(make("span", { class: "printed" }, ` ${paper.join(" ")}`));
  section("table", title, make("p", {}, note[0], " ", ...note.slice(1)), make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": title }, make("table", {}, head, body)));
}

/** Everything that the data hold, in place of what was shown before. */
function show(page) {
  data = page;
  document.title = `${data.title} – anisobond`;
  document.getElementById("title").textContent = data.title;
  document.getElementById("kind").textContent = data.kind;
  document.getElementById("main").replaceChildren();
  document.getElementById("contents").replaceChildren();
  const pictures = () => { surfaces(); scene(); };
  // Beside a form the pictures are what is looked at.
  const first = document.body.classList.contains("studio");
  if (first) pictures();
  const facts = data.facts.map(([title, facts]) => make("div", {}, make("h3", {}, title), factTable(facts)));
  const warnings = data.warnings.map((w) => make("p", { class: "warning" }, w));
  const typed = data.command && !first ? [make("p", {}, make("code", {}, data.command))] : [];
  if (facts.length || warnings.length) section("facts", "What was asked, what was reached", ...warnings, ...typed, make("div", { class: "facts" }, facts));
  tensors();
  if (!first) pictures();
  waves();
  if (data.charts.length || data.charts_note) section("charts", data.charts_title, ...(data.charts_note ? [make("p", {}, data.charts_note)] : []), ...drawnCharts(data.charts, "charts"));
  if (data.cracks.length) section("cracks", "Cracks", ...drawnCharts(data.cracks, "cracks"));
  if (data.pictures.length) section("pictures", "Pictures", make("div", { class: "row charts" }, data.pictures.map(moving)));
  if (data.table) tableSection(data.table);
  document.getElementById("footer").textContent = `anisobond ${data.version}. This page needs no network.`;
}

/** The page of a folder: its data are in it. */
function showPage() {
  show(JSON.parse(document.getElementById("data").textContent));
}

// Pictures are drawn anew when the background changes.
const themeChanged = () => dispatchEvent(new Event("theme"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", themeChanged);
document.getElementById("theme").addEventListener("click", () => {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
  themeChanged();
});

