// A session by hand: a drawing of the next motion, the present state of the hand, and a tone for every message.

const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const SIZE = { x: 1.5, y: 1.1, z: 0.7 }; // of the box that is drawn, so that its sides differ
const TONES = { rest: [[660, 0.12]], accepted: [[660, 0.1], [990, 0.18]], again: [[330, 0.18], [247, 0.3]] };

let audio = null; // a browser allows sound only after a tap on the page
let lastTone = null; // the number of the newest tone
let upperFace = null; // the side that is up

/** Return a text with true minus signs before the sides, at which no line breaks. */
const formatSides = (text) => text.replace(/-(?=[xyz]\b)/g, "−");

/** Show the section; hide it if there is no session. */
export function showHand(section) {
  $("hand").hidden = !section?.asked;
  if (!section?.asked) return;
  updateSound(section);
  upperFace = section.face ?? null;
  const { say, face, turns } = section.asked;
  const words = formatSides(section.asked.words);
  if ($("hand-line").textContent !== words) $("hand-line").textContent = words;
  const why = section.again ? `Again: ${formatSides(section.why)}` : "";
  $("hand-why").hidden = !why;
  if ($("hand-why").textContent !== why) $("hand-why").textContent = why;
  const key = [upperFace, say, face, turns].join();
  if ($("hand-drawing").dataset.key !== key) {
    $("hand-drawing").dataset.key = key;
    $("hand-drawing").replaceChildren(drawMotion(say, face, turns));
    $("hand-drawing").firstChild.setAttribute("aria-label", words);
  }
  showState(section);
}

function showState(section) {
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
    className: [done ? "done" : "", side === upperFace ? "up" : ""].join(" ").trim(),
    textContent: `${done ? "✓" : "○"} ${formatSides(side)}${side === upperFace ? " up" : ""}`,
  })));
  $("hand-wanted").textContent = section.wanted;
  $("hand-pairs").textContent = section.pairs.map((pair) => pair.map(formatSides).join("\u00a0↔\u00a0")).join(", ");
}

function updateSound({ tone, tones }) {
  if (tones === lastTone) return;
  const isFirst = lastTone === null;
  lastTone = tones ?? 0;
  if (!isFirst && tone) playTone(tone);
}

function playTone(tone) {
  if (!audio) return;
  let start_s = audio.currentTime;
  for (const [frequency_hz, duration_s] of TONES[tone]) {
    const [wave, volume] = [audio.createOscillator(), audio.createGain()];
    wave.frequency.value = frequency_hz;
    volume.gain.setValueAtTime(0.0001, start_s);
    volume.gain.exponentialRampToValueAtTime(0.4, start_s + 0.01);
    volume.gain.exponentialRampToValueAtTime(0.0001, start_s + duration_s);
    wave.connect(volume).connect(audio.destination);
    wave.start(start_s);
    wave.stop(start_s + duration_s);
    start_s += duration_s;
  }
}

$("hand-sound").addEventListener("click", async () => {
  if (audio) await audio.close();
  audio = audio ? null : new AudioContext();
  $("hand-sound").setAttribute("aria-pressed", audio ? "true" : "false");
  $("hand-sound").textContent = audio ? "Sound is on" : "Sound is off: tap for tones";
  playTone("rest");
});

// -- the drawing ------------------------------------------------------------------------------------------------

const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];
const dot = (one, other) => one.reduce((sum, value, i) => sum + value * other[i], 0);
const getAxis = (face) => [0, 1, 2].map((i) => ("xyz"[i] === face[1] ? (face[0] === "+" ? 1 : -1) : 0));
/** Return the room's components of a body direction; the rows are the body's axes in the room. */
const rotateToRoom = (rows, [a, b, c]) => [0, 1, 2].map((i) => rows[0][i] * a + rows[1][i] * b + rows[2][i] * c);
/** Project a point onto the screen: from above, the room's x axis to the front left and its y axis to the front right. */
const project = ([x, y, z]) => [(y - x) * 0.866, (x + y) * 0.5 - z];

/** Return the axes in the room of a body with one face up and, if it is perpendicular, another one to the front left. */
function placeUpright(face, frontFace = null) {
  const up = getAxis(face);
  const side = frontFace && frontFace[1] !== face[1] ? getAxis(frontFace) : getAxis(face[1] === "x" ? "+y" : "+x");
  const third = cross(up, side);
  return [0, 1, 2].map((i) => [side[i], third[i], up[i]]);
}

/** Return the body's axes after it was tipped over one edge, or over two, so that another side is up. */
function tipOver(rows, face) {
  const direction = rotateToRoom(rows, getAxis(face));
  const about = direction[2] < -0.5 ? [0, 1, 0] : cross(direction, [0, 0, 1]);
  const turnQuarter = (v) => { const parallel = dot(about, v); const turned = cross(about, v); return about.map((a, i) => a * parallel + turned[i]); };
  const once = rows.map(turnQuarter);
  return direction[2] < -0.5 ? once.map(turnQuarter) : once;
}

function makePart(name, attributes, words) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (words !== undefined) node.textContent = words;
  return node;
}

/** Draw a box with the names of its three visible sides; `scale` in pixels, its middle on the table at (x, y). */
function drawBox(rows, [x, y], scale, topFace) {
  const half = [0, 1, 2].map((i) => ["x", "y", "z"].reduce((sum, axis, j) => sum + Math.abs(rows[j][i]) * SIZE[axis] / 2, 0));
  const toPixels = (p) => { const [u, v] = project(p); return [x + scale * u, y + scale * v]; };
  const group = makePart("g", {});
  const [a, b, c] = half;
  const corners = {
    side0: [[a, -b, 0], [a, b, 0], [a, b, 2 * c], [a, -b, 2 * c]],
    side1: [[-a, b, 0], [a, b, 0], [a, b, 2 * c], [-a, b, 2 * c]],
    top: [[-a, -b, 2 * c], [a, -b, 2 * c], [a, b, 2 * c], [-a, b, 2 * c]],
  };
  const normals = { side0: [1, 0, 0], side1: [0, 1, 0], top: [0, 0, 1] };
  for (const [side, points] of Object.entries(corners)) {
    group.append(makePart("polygon", { class: `box ${side}`, points: points.map((p) => toPixels(p).map((n) => n.toFixed(1)).join(",")).join(" ") }));
    const cosines = rows.map((axis) => dot(axis, normals[side]));
    const axis = cosines.findIndex((cosine) => Math.abs(cosine) > 0.5);
    const name = `${cosines[axis] > 0 ? "+" : "-"}${"xyz"[axis]}`;
    const [u, v] = toPixels([0, 1, 2].map((i) => points.reduce((sum, p) => sum + p[i] / 4, 0)));
    const className = name !== topFace ? "named" : scale < 60 ? "named wanted small" : "named wanted";
    group.append(makePart("text", { class: className, x: u.toFixed(1), y: (v + 6).toFixed(1), "text-anchor": "middle" }, name.replace("-", "−")));
  }
  return { group, toPixels, half };
}

function drawMotion(say, face, turns) {
  const svg = makePart("svg", { viewBox: "0 0 440 280", role: "img" });
  svg.append(makePart("defs", {}));
  svg.firstChild.append(makeArrowHead());
  const makeCaption = (x, words) => makePart("text", { class: "said", x, y: 274, "text-anchor": "middle" }, words);
  if (say === "turn") {
    const { group, toPixels, half: [a, b, c] } = drawBox(placeUpright(face), [220, 190], 66, face);
    const [[x1, y1], [x2, y2]] = [toPixels([-a, -b - 0.5, 0]), toPixels([-a, b + 0.5, 0])];
    const ring = Array.from({ length: 33 }, (_, i) => { // counterclockwise, seen from above, where turns is positive
      const angle = 0.8 + Math.sign(turns) * (0.3 + (i / 32) * 5.2);
      return toPixels([Math.cos(angle), Math.sin(angle), 2 * c + 0.25]).map((n) => n.toFixed(1)).join(",");
    });
    svg.append(makePart("line", { class: "rule", x1, y1, x2, y2 }), group);
    svg.append(makePart("polyline", { class: "way", points: ring.join(" "), "marker-end": "url(#tip)" }));
    svg.append(makeCaption(220, `${Math.abs(turns)} × 360°, back against the rule`));
    return svg;
  }
  const up = `${formatSides(face)} up, let go`;
  if (!upperFace || upperFace === face) {
    svg.append(drawBox(placeUpright(face), [220, 190], 78, face).group, makeCaption(220, up));
    return svg;
  }
  const now = placeUpright(upperFace, face);
  const { group, toPixels, half: [a, b] } = drawBox(now, [90, 190], 54, face);
  const [[x1, y1], [x2, y2]] = [toPixels([-a, -b, 0]), toPixels([-a, b, 0])];
  svg.append(group, makePart("line", { class: "edge", x1, y1, x2, y2 }));
  svg.append(makePart("path", { class: "way", d: "M 150 95 Q 195 50 240 88", "marker-end": "url(#tip)" }));
  if (upperFace[1] === face[1]) svg.append(makePart("text", { class: "said", x: 195, y: 48, "text-anchor": "middle" }, "twice"));
  svg.append(drawBox(tipOver(now, face), [320, 190], 72, face).group, makeCaption(90, "now"), makeCaption(320, up));
  return svg;
}

function makeArrowHead() {
  const tip = makePart("marker", { id: "tip", viewBox: "0 0 10 10", refX: 7, refY: 5, markerWidth: 5, markerHeight: 5, orient: "auto" });
  tip.append(makePart("path", { class: "tip", d: "M 0 0 L 10 5 L 0 10 z" }));
  return tip;
}
