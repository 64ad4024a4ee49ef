// ---- the studio: a form, and a server on this computer that calibrates --------------------------------------------

const START = JSON.parse(document.getElementById("data").textContent);

/** Pause after the last key before anything is asked (ms). */
const PAUSE = 250;

const at = (id) => document.getElementById(id);
const constants = {};
let asked = 0, answered = 0, timer = null, current = null, result = null, lastKind = "name";

document.body.classList.add("studio");
at("title").textContent = "Studio";
at("kind").textContent = `anisobond ${START.version}`;
at("footer").textContent = "Served by this computer; nothing leaves it.";
for (const name of START.materials) at("builtins").append(make("option", { value: name }));
for (const name of START.classes) at("projection").append(make("option", { value: name }, `its closest ${name} tensor`));
if (START.folder) { at("save-line").hidden = false; at("save").textContent = `Save all in ${START.folder}`; }

const isChosen = (element, list) => element.dataset[list].split(" ");

/** What the form says of the tensor. */
function tensorForm() {
  const read = (id) => at(id).value;
  return { kind: read("kind-of-tensor"), class: read("class"), constants, matrix: read("matrix"), inverse: read("inverse"), order: read("order"), unit: read("unit"), name: read("name"), density: read("density") };
}

/** Shows the fields of the chosen forms only. */
function arrange() {
  const kind = at("kind-of-tensor").value;
  const table = kind === "engineering" ? ENGINEERING : CONSTANTS, chosen = at("class").value;
  if (kind === "text" && lastKind !== "text" && lastKind !== "name" && !at("text").value.trim()) at("text").value = materialText({ ...tensorForm(), kind: lastKind });
  lastKind = kind;
  if (at("class").dataset.kind !== kind) {
    at("class").dataset.kind = kind;
    at("class").replaceChildren(...Object.keys(table).map((name) => make("option", {}, name)));
    if (table[chosen]) at("class").value = chosen;
  }
  const keys = table[at("class").value];
  if (at("constants").dataset.keys !== keys.join()) {
    at("constants").dataset.keys = keys.join();
    at("constants").replaceChildren(...keys.map((k) => {
      const input = make("input", { "aria-label": k, spellcheck: "false", inputmode: "decimal", oninput: () => { constants[k] = input.value; } });
      input.value = constants[k] ?? "";
      return make("label", {}, k, " ", input);
    }));
  }
  for (const e of document.querySelectorAll("[data-for]")) e.hidden = !isChosen(e, "for").includes(kind);
  for (const e of document.querySelectorAll("[data-model]")) e.hidden = !isChosen(e, "model").includes(at("model").value);
  for (const e of document.querySelectorAll("[data-shape]")) e.hidden = !isChosen(e, "shape").includes(at("shape").value);
}

/** What is asked of the server. */
function request() {
  const form = tensorForm(), model = at("model").value, shape = at("shape").value, flags = { model, shape };
  const take = (flag, id) => { const text = at(id).value.trim(); if (text) flags[flag] = text; };
  for (const flag of ["horizon", "spacing", "influence"]) take(flag, flag);
  if (model === "central") { take("lower-bound", "lower-bound"); take("metric", "metric"); }
  if (model === "hybrid") take("form", "form-of-hybrid");
  if (model === "micropolar") take("promise", "promise");
  if (shape === "cuboid" || shape === "ellipsoid") take("semi-axes", "semi-axes");
  const rotate = at("rotate").value.split("·").map((r) => r.trim()).filter(Boolean);
  const material = form.kind === "name" ? { name: at("builtin").value } : { text: form.kind === "text" ? at("text").value : materialText(form) };
  return { material, class: at("projection").value, flags, rotate };
}

function report(message, wrong) {
  at("state").textContent = wrong ? "" : message;
  at("wrong").textContent = wrong ? message : "";
  at("wrong").hidden = !wrong;
  // What is shown belongs to an earlier question.
  document.body.classList.toggle("stale", wrong);
}

/** Asks for what stands in the form now. Only the newest question counts: older answers are thrown away. */
async function ask() {
  const number = ++asked;
  current?.abort();
  current = new AbortController();
  at("state").textContent = "calibrating …";
  let answer;
  try {
    const response = await fetch("calibrate", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(request()), signal: current.signal });
    answer = response.headers.get("Content-Type")?.includes("json") ? await response.json() : { error: await response.text() };
  } catch (error) {
    if (error.name === "AbortError") return;
    answer = { error: "the studio does not answer: it was ended, or its computer sleeps" };
  }
  if (number !== asked) return;
  if (answer.superseded) { later(); return; }
  answered = number;
  document.body.dataset.answered = String(answered);
  if (answer.error) report(answer.error, true);
  else take(answer);
}

function take(answer) {
  result = answer;
  const place = window.scrollY;
  show(answer.page);
  window.scrollTo(0, place);
  report(`calibrated in ${answer.seconds < 0.1 ? (1000 * answer.seconds).toFixed(0) + " ms" : answer.seconds.toFixed(1) + " s"}`, false);
  at("results").hidden = false;
  at("command").textContent = answer.command;
  at("files").replaceChildren(...answer.files.map(({ name, about }) => make("li", {}, make("a", { href: `file/${answer.id}/${name}`, download: name }, name), ` ${about}`)));
  at("no-case").textContent = answer.no_case ? `No case file: ${answer.no_case}.` : "";
  at("saved").textContent = "";
}

function later() {
  clearTimeout(timer);
  timer = setTimeout(ask, PAUSE);
}

at("form").addEventListener("input", () => { arrange(); at("state").textContent = "…"; later(); });
at("form").addEventListener("submit", (e) => { e.preventDefault(); clearTimeout(timer); ask(); });
at("save").addEventListener("click", async () => {
  if (!result) return;
  at("saved").textContent = "saving …";
  try {
    const save = async (replace) => {
      const body = JSON.stringify({ id: result.id, replace });
      const response = await fetch("save", { method: "POST", headers: { "Content-Type": "application/json" }, body });
      return response.json();
    };
    let answer = await save(false);
    if (answer.others && confirm(`${answer.error}\n\nReplace them?`)) answer = await save(true);
    at("saved").textContent = answer.error ?? `saved in ${answer.folder}`;
  } catch { at("saved").textContent = "the studio does not answer"; }
});
arrange();
ask();
