// The readings of the last minute: this module keeps them and draws a plot for every sensor and quantity.

import { formatSigned } from "./arm.js";
import { drawPlot } from "./plot.js";
import { withoutName } from "./tables.js";

const $ = (id) => document.getElementById(id);
const points = { first: 0, times: [], lines: {} };
const SHOWN_POINTS = 600;
const UNITS = { rate_rad_s: ["rate", "rad/s", 3], acceleration_m_s2: ["acceleration", "m/s²", 3], field_t: ["magnetic field", "µT", 1] };

let sensors = []; // in the rig's order
let ageText = ""; // the age of the readings in words; "" if they are current
let isOver = false; // after the run the last reading is older than the result, so its label has no number

/** Add the points of a frame. They are counted, so that none is added twice; points that the rig has dropped are dropped here too. */
export function addPoints(frame, news) {
  if (frame === "all") Object.assign(points, { first: news.first, times: [], lines: {} });
  const end = points.first + points.times.length;
  const skip = Math.max(0, end - news.from);
  if (news.from > end) Object.assign(points, { first: news.from, times: [], lines: {} });
  const before = points.times.length;
  const times = news.time_s.slice(skip);
  points.times.push(...times);
  for (const name of new Set([...Object.keys(points.lines), ...Object.keys(news.lines)])) {
    const line = (points.lines[name] ??= new Array(before).fill(null));
    line.push(...(news.lines[name]?.slice(skip) ?? new Array(times.length).fill(null)));
  }
  const drop = Math.max(news.first - points.first, points.times.length - SHOWN_POINTS, 0);
  if (drop > 0) {
    points.times.splice(0, drop);
    for (const line of Object.values(points.lines)) line.splice(0, drop);
    points.first += drop;
  }
}

let isScheduled = false;

/** Draw the plots once before the next repaint. `newAgeText` is the age of the readings in words, "" if they are current. */
export function redraw(newSensors, newAgeText, hasEnded) {
  [sensors, ageText, isOver] = [newSensors ?? [], newAgeText, hasEnded];
  if (isScheduled) return;
  isScheduled = true;
  requestAnimationFrame(() => {
    isScheduled = false;
    for (const name of Object.keys(points.lines).sort(compareNames)) drawReadings(name, points.lines[name]);
  });
}

/** Compare names of lines: by sensor in the rig's order, then rate before acceleration before field. */
function compareNames(one, other) {
  const order = sensors.map((sensor) => sensor.name);
  const [a, b] = [one, other].map((name) => [order.indexOf(name.slice(0, name.lastIndexOf("."))), Object.keys(UNITS).indexOf(name.slice(name.lastIndexOf(".") + 1))]);
  return a[0] - b[0] || a[1] - b[1];
}

function drawReadings(name, values) {
  const id = `plot-${name.replaceAll(/[^A-Za-z0-9_-]/g, "-")}`;
  const [sensor, quantity] = [name.slice(0, name.lastIndexOf(".")), name.slice(name.lastIndexOf(".") + 1)];
  const description = sensors.find((candidate) => candidate.name === sensor);
  const [title, unit, digits] = UNITS[quantity] ?? [...(description?.units?.[quantity] ?? [quantity, ""]), 2];
  if (!$(id)) $("readings").append(makePanel(id, sensor, title, unit));
  $(`${id}-about`).textContent = [withoutName(description?.part, sensor), description?.mode === "calibrated" ? "corrected by the board" : ""].filter(Boolean).join(" · ");
  const last = values.findLast((value) => value);
  const canvas = $(`${id}-canvas`);
  const axes = last?.length === 1 ? [["x", ""]] : [..."xyz"].map((axis) => [axis, `${axis} `]); // a quantity without axes has no letter
  for (const [i, [axis, letter]] of axes.entries()) {
    $(`${id}-${axis}`).textContent = `${letter}${last ? formatSigned(last[i], digits).padStart(digits + 4, "\u2007") : "–"}`;
  }
  if (isOver) canvas.setAttribute("aria-label", `${sensor}, ${title} over the last minute of the run`);
  else if (last) canvas.setAttribute("aria-label", `${sensor}, ${title} over the last minute; ${ageText || "now"} ${axes.map(([, letter], i) => `${letter}${last[i].toFixed(digits)}`).join(", ")} ${unit}`);
  drawPlot(canvas, points.times, values, ageText ? "last" : "now");
}

function makePanel(id, sensor, title, unit) {
  const make = (tag, fields, ...children) => {
    const node = Object.assign(document.createElement(tag), fields);
    node.append(...children);
    return node;
  };
  const now = make("span", { className: "now" }, ...[..."xyz"].map((axis) => make("span", { id: `${id}-${axis}`, className: axis })), make("span", { className: "unit", textContent: unit }));
  const head = make("h2", {}, make("span", { textContent: `${sensor}, ${title}` }), make("small", { id: `${id}-about` }), make("small", { className: "age", textContent: ageText }), now);
  const canvas = make("canvas", { id: `${id}-canvas` });
  canvas.setAttribute("role", "img");
  return make("section", { id, className: "plot" }, head, canvas);
}
