// A session by hand: a drawing of what is to be done, what the hand does now, and a tone for what was heard.

const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const SIZE = { x: 1.5, y: 1.1, z: 0.7 }; // of the box that is drawn, so that its sides differ
const TONES = { rest: [[660, 0.12]], taken: [[660, 0.1], [990, 0.18]], again: [[330, 0.18], [247, 0.3]] };

let audio = null; // a browser lets a page sound once somebody has tapped on it
let heard = null; // the number of the newest tone
let lying = null; // the side that is up

/** A text whose sides have a minus sign, at which no line is broken. */
const signed = (text) => text.replace(/-(?=[xyz]\b)/g, "−");

/** Show the section; hide it without a session. */
export function hand(section) {
  $("hand").hidden = !section?.asked;
  if (!section?.asked) return;
  sound(section);
  lying = section.face ?? null;
  const { say, face, turns } = section.asked;
  const words = signed(section.asked.words);
  if ($("hand-line").textContent !== words) $("hand-line").textContent = words;
  const why = section.again ? `Again: ${signed(section.why)}` : "";
  $("hand-why").hidden = !why;
  if ($("hand-why").textContent !== why) $("hand-why").textContent = why;
  const key = [lying, say, face, turns].join();
  if ($("hand-drawing").dataset.key !== key) {
    $("hand-drawing").dataset.key = key;
    $("hand-drawing").replaceChildren(drawing(say, face, turns));
    $("hand-drawing").firstChild.setAttribute("aria-label", words);
  }
  live(section);
}

function live(section) {
  if (section.doing === undefined) return;
  $("hand-doing").textContent = { starting: "listening", resting: "at rest", moving: "moving", held: "in the hand" }[section.doing] ?? section.doing;
  $("hand-since").textContent = `${section.since_s.toFixed(1)} s`;
  $("hand-turned").textContent = `${section.turned_deg.toFixed(0)}°`;
  const fast = section.range_deg_s > 0 && section.peak_deg_s > section.red_deg_s;
  $("hand-peak").textContent = `${section.peak_deg_s} of ${section.range_deg_s} °/s${fast ? " – too fast" : ""}`;
  $("hand-peak").className = fast ? "bad" : "";
  const fraction = section.range_deg_s ? Math.min(1, section.peak_deg_s / section.range_deg_s) : 0;
  $("hand-gauge-part").setAttribute("width", 300 * fraction);
  $("hand-gauge-part").setAttribute("class", fast ? "part over" : "part");
  const u = section.scale_u;
  $("hand-u").textContent = u === null || u === undefined ? "not yet" : u >= 0.001 ? `${(100 * u).toFixed(u < 0.01 ? 2 : 1)} %` : `${Math.round(1e6 * u)} ppm`;
  $("hand-sides").replaceChildren(...section.sides.map(([side, done]) => Object.assign(document.createElement("li"), {
    className: [done ? "done" : "", side === lying ? "up" : ""].join(" ").trim(),
    textContent: `${done ? "✓" : "○"} ${signed(side)}${side === lying ? " up" : ""}`,
  })));
  $("hand-wanted").textContent = section.wanted;
  $("hand-pairs").textContent = section.pairs.map((pair) => pair.map(signed).join("\u00a0↔\u00a0")).join(", ");
}

function sound({ tone, tones }) {
  if (tones === heard) return;
  const first = heard === null;
  heard = tones ?? 0;
  if (!first && tone) play(tone);
}

function play(tone) {
  if (!audio) return;
  let at = audio.currentTime;
  for (const [hertz, lasting] of TONES[tone]) {
    const [wave, loud] = [audio.createOscillator(), audio.createGain()];
    wave.frequency.value = hertz;
    loud.gain.setValueAtTime(0.0001, at);
    loud.gain.exponentialRampToValueAtTime(0.4, at + 0.01);
    loud.gain.exponentialRampToValueAtTime(0.0001, at + lasting);
    wave.connect(loud).connect(audio.destination);
    wave.start(at);
    wave.stop(at + lasting);
    at += lasting;
  }
}

$("hand-sound").addEventListener("click", async () => {
  if (audio) await audio.close();
  audio = audio ? null : new AudioContext();
  $("hand-sound").setAttribute("aria-pressed", audio ? "true" : "false");
  $("hand-sound").textContent = audio ? "Sound is on" : "Sound is off: tap for tones";
  play("rest");
});

// -- the drawing ------------------------------------------------------------------------------------------------

const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
const dot = (one, other) => one.reduce((sum, value, i) => sum + value * other[i], 0);
const axisOf = (face) => [0, 1, 2].map((i) => ("xyz"[i] === face[1] ? (face[0] === "+" ? 1 : -1) : 0));
/** Return the room's components of a body direction; the rows are the body's axes in the room. */
const inRoom = (rows, [a, b, c]) => [0, 1, 2].map((i) => rows[0][i] * a + rows[1][i] * b + rows[2][i] * c);
/** On the screen: seen from above, with the room's x axis to the left in front and its y axis to the right in front. */
const flat = ([x, y, z]) => [(y - x) * 0.866, (x + y) * 0.5 - z];

/** The body with a side up and another one (where it is at right angles) to the left in front: its axes in the room. */
function upright(face, left = null) {
  const up = axisOf(face);
  const side = left && left[1] !== face[1] ? axisOf(left) : axisOf(face[1] === "x" ? "+y" : "+x");
  const third = cross(up, side);
  return [0, 1, 2].map((i) => [side[i], third[i], up[i]]);
}

/** The body after it was tipped over an edge, or over two, so that another side comes up. */
function tipped(rows, face) {
  const direction = inRoom(rows, axisOf(face));
  const about = direction[2] < -0.5 ? [0, 1, 0] : cross(direction, [0, 0, 1]);
  const quarter = (v) => { const along = dot(about, v); const turned = cross(about, v); return about.map((a, i) => a * along + turned[i]); };
  const once = rows.map(quarter);
  return direction[2] < -0.5 ? once.map(quarter) : once;
}

function part(name, attributes, words) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (words !== undefined) node.textContent = words;
  return node;
}

/** A box as it lies, its three visible sides with their names; `scale` in pixels, its middle on the table at (x, y). */
function box(rows, [x, y], scale, topFace) {
  const half = [0, 1, 2].map((i) => ["x", "y", "z"].reduce((sum, axis, j) => sum + Math.abs(rows[j][i]) * SIZE[axis] / 2, 0));
  const at = (p) => { const [u, v] = flat(p); return [x + scale * u, y + scale * v]; };
  const group = part("g", {});
  const [a, b, c] = half;
  const corners = {
    side0: [[a, -b, 0], [a, b, 0], [a, b, 2 * c], [a, -b, 2 * c]],
    side1: [[-a, b, 0], [a, b, 0], [a, b, 2 * c], [-a, b, 2 * c]],
    top: [[-a, -b, 2 * c], [a, -b, 2 * c], [a, b, 2 * c], [-a, b, 2 * c]],
  };
  const outwards = { side0: [1, 0, 0], side1: [0, 1, 0], top: [0, 0, 1] };
  for (const [side, points] of Object.entries(corners)) {
    group.append(part("polygon", { class: `box ${side}`, points: points.map((p) => at(p).map((n) => n.toFixed(1)).join(",")).join(" ") }));
    const towards = rows.map((axis) => dot(axis, outwards[side]));
    const axis = towards.findIndex((cosine) => Math.abs(cosine) > 0.5);
    const name = `${towards[axis] > 0 ? "+" : "-"}${"xyz"[axis]}`;
    const [u, v] = at([0, 1, 2].map((i) => points.reduce((sum, p) => sum + p[i] / 4, 0)));
    const shown = name !== topFace ? "named" : scale < 60 ? "named wanted small" : "named wanted";
    group.append(part("text", { class: shown, x: u.toFixed(1), y: (v + 6).toFixed(1), "text-anchor": "middle" }, name.replace("-", "−")));
  }
  return { group, at, half };
}

function drawing(say, face, turns) {
  const svg = part("svg", { viewBox: "0 0 440 280", role: "img" });
  svg.append(part("defs", {}));
  svg.firstChild.append(marker());
  const below = (x, words) => part("text", { class: "said", x, y: 274, "text-anchor": "middle" }, words);
  if (say === "turn") {
    const { group, at, half: [a, b, c] } = box(upright(face), [220, 190], 66, face);
    const [[x1, y1], [x2, y2]] = [at([-a, -b - 0.5, 0]), at([-a, b + 0.5, 0])];
    const ring = Array.from({ length: 33 }, (_, i) => { // counterclockwise, seen from above, where turns is positive
      const angle = 0.8 + Math.sign(turns) * (0.3 + (i / 32) * 5.2);
      return at([Math.cos(angle), Math.sin(angle), 2 * c + 0.25]).map((n) => n.toFixed(1)).join(",");
    });
    svg.append(part("line", { class: "rule", x1, y1, x2, y2 }), group);
    svg.append(part("polyline", { class: "way", points: ring.join(" "), "marker-end": "url(#tip)" }));
    svg.append(below(220, `${Math.abs(turns)} × 360°, back against the rule`));
    return svg;
  }
  const up = `${signed(face)} up, let go`;
  if (!lying || lying === face) {
    svg.append(box(upright(face), [220, 190], 78, face).group, below(220, up));
    return svg;
  }
  const now = upright(lying, face);
  const { group, at, half: [a, b] } = box(now, [90, 190], 54, face);
  const [[x1, y1], [x2, y2]] = [at([-a, -b, 0]), at([-a, b, 0])];
  svg.append(group, part("line", { class: "edge", x1, y1, x2, y2 }));
  svg.append(part("path", { class: "way", d: "M 150 95 Q 195 50 240 88", "marker-end": "url(#tip)" }));
  if (lying[1] === face[1]) svg.append(part("text", { class: "said", x: 195, y: 48, "text-anchor": "middle" }, "twice"));
  svg.append(box(tipped(now, face), [320, 190], 72, face).group, below(90, "now"), below(320, up));
  return svg;
}

function marker() {
  const tip = part("marker", { id: "tip", viewBox: "0 0 10 10", refX: 7, refY: 5, markerWidth: 5, markerHeight: 5, orient: "auto" });
  tip.append(part("path", { class: "tip", d: "M 0 0 L 10 5 L 0 10 z" }));
  return tip;
}
