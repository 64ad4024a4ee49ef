// ---- a tensor in any form, as the text of a material file --------------------------------------------------------

/** The constants that determine a tensor of each class, in its own axes. */
const CONSTANTS = {
  isotropic: ["c11", "c12"],
  cubic: ["c11", "c12", "c44"],
  "transversely-isotropic": ["c11", "c33", "c12", "c13", "c44"],
  tetragonal: ["c11", "c33", "c12", "c13", "c44", "c66"],
  trigonal: ["c11", "c33", "c12", "c13", "c14", "c44"],
  orthotropic: ["c11", "c22", "c33", "c12", "c13", "c23", "c44", "c55", "c66"],
  monoclinic: ["c11", "c22", "c33", "c12", "c13", "c23", "c16", "c26", "c36", "c44", "c45", "c55", "c66"],
  triclinic: ["c11", "c12", "c13", "c14", "c15", "c16", "c22", "c23", "c24", "c25", "c26", "c33", "c34", "c35", "c36", "c44", "c45", "c46", "c55", "c56", "c66"],
};

/** Engineering constants of each class that has them. */
const ENGINEERING = {
  isotropic: ["e", "nu"],
  "transversely-isotropic": ["ex", "ez", "nu_xy", "nu_zx", "gyz"],
  orthotropic: ["ex", "ey", "ez", "nu_xy", "nu_yz", "nu_zx", "gyz", "gzx", "gxy"],
};

const NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$/;

const quoted = (text) => `"${text.replace(/[\\"]/g, "\\$&").replace(/[\u0000-\u001f\u007f]/g, " ")}"`;

/** A number as TOML has it; whatever is no number is left to the reader of the file to say so. */
function value(text) {
  const word = text.trim();
  if (!NUMBER.test(word)) return quoted(word);
  return word.replace(/^\+/, "").replace(/^(-?)\./, "$10.").replace(/\.(?=$|[eE])/, ".0").replace(/^(-?)0+(?=\d)/, "$1");
}

/** A pasted matrix: numbers between blanks, commas, semicolons, brackets and lines, row by row. */
function matrix(text) {
  const row = (line) => line.replace(/[[\](){};,|&]/g, " ").replace(/\\\\/g, " ").split(/\s+/).filter(Boolean).map(value);
  const rows = text.split(/\n|\]\s*,?\s*(?=\[)|;/).map(row).filter((r) => r.length);
  const shape = rows.map((r) => r.length).join();
  if (rows.length > 1 && (shape === "6,6,6,6,6,6" || shape === "6,5,4,3,2,1")) return `[\n${rows.map((r) => `  [${r.join(", ")}],`).join("\n")}\n]`;
  return `[${rows.flat().join(", ")}]`;
}

/** The text of a material file for what stands in the form. */
function materialText(form) {
  const lines = [];
  const add = (key, text) => { if (text.trim()) lines.push(`${key} = ${quoted(text.trim())}`); };
  add("name", form.name);
  add("density", form.density);
  add("unit", form.unit);
  const given = (keys) => keys.filter((k) => (form.constants[k] ?? "").trim()).map((k) => `${k} = ${value(form.constants[k])}`);
  if (form.kind === "matrix") {
    add("order", form.order);
    lines.push(`${form.inverse ? "compliance" : "stiffness"} = ${matrix(form.matrix)}`);
  } else if (form.kind === "components") {
    add("class", form.class);
    lines.push(...given(CONSTANTS[form.class]));
  } else {
    add("class", form.class);
    lines.push("", "[engineering]", ...given(ENGINEERING[form.class]));
  }
  return lines.join("\n") + "\n";
}

