// ---- animations: PNGs of one file, which the page shows one by one ---------------------------------------------------

/** A frame for so long (ms), and the last one for this many times. */
const FRAME = 90, REST = 8;

const CRC = Uint32Array.from({ length: 256 }, (_, n) => { for (let k = 0; k < 8; k++) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1; return n >>> 0; });

/** A chunk of a PNG: length, name, data and checksum. */
function chunk(name, body) {
  const out = new Uint8Array(body.length + 12), view = new DataView(out.buffer);
  view.setUint32(0, body.length);
  out.set([...name].map((c) => c.charCodeAt(0)), 4);
  out.set(body, 8);
  let crc = 0xffffffff;
  for (let i = 4; i < body.length + 8; i++) crc = CRC[(crc ^ out[i]) & 255] ^ (crc >>> 8);
  view.setUint32(body.length + 8, (crc ^ 0xffffffff) >>> 0);
  return out;
}

/** The frames of an animated PNG as PNGs of their own; one where it does not move. All frames here are whole pictures. */
function frames(dataUrl) {
  const bytes = Uint8Array.from(atob(dataUrl.split(",")[1]), (c) => c.charCodeAt(0)), view = new DataView(bytes.buffer);
  const head = [bytes.subarray(0, 8)], out = [];
  for (let at = 8; at + 12 <= bytes.length;) {
    const length = view.getUint32(at), name = String.fromCharCode(...bytes.subarray(at + 4, at + 8)), body = bytes.subarray(at + 8, at + 8 + length);
    if (name === "fcTL") out.push([]);
    else if (name === "fdAT") out[out.length - 1].push(chunk("IDAT", body.subarray(4)));
    else if (name === "IDAT") { if (!out.length) out.push([]); out[out.length - 1].push(bytes.subarray(at, at + length + 12)); }
    else if (name !== "acTL" && name !== "IEND" && !out.length) head.push(bytes.subarray(at, at + length + 12));
    at += length + 12;
  }
  return out.map((parts) => URL.createObjectURL(new Blob([...head, ...parts, chunk("IEND", new Uint8Array(0))], { type: "image/png" })));
}

/** A picture; if it moves, with a slider. It rests on its last frame where motion is unwanted, and on paper. */
function moving({ data: source, caption }) {
  const all = frames(source), last = all.length - 1, image = make("img", { src: all[last], alt: caption });
  if (!last) return make("figure", {}, image, make("figcaption", {}, caption));
  let at = last, timer = null;
  const slider = make("input", { type: "range", min: 0, max: last, step: 1, value: last, "aria-label": `Frame of ${caption}`, oninput: () => { stop(); go(Number(slider.value)); } });
  const count = make("span", { class: "quiet" }), button = make("button", { type: "button", onclick: () => (timer ? stop() : play()) });
  // Frames are decoded once, so that they follow each other without a gap.
  const kept = all.map((address) => { const i = new Image(); i.src = address; return i; });
  const go = (n) => { at = n; image.src = kept[n].src; slider.value = n; count.textContent = `frame ${n + 1} of ${last + 1}`; };
  const say = () => { button.textContent = timer ? "Pause" : "Play"; };
  const stop = () => { clearTimeout(timer); timer = null; say(); };
  const next = () => { go(at === last ? 0 : at + 1); timer = setTimeout(next, at === last ? REST * FRAME : FRAME); };
  const play = () => { timer = setTimeout(next, FRAME); say(); };
  addEventListener("beforeprint", () => { stop(); go(last); });
  go(last);
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) stop(); else play();
  return make("figure", {}, image, make("div", { class: "controls" }, button, slider, count), make("figcaption", {}, caption));
}

