// The readings of the last minute: keeps their points and draws a plot for each sensor and quantity.

import { signed } from "./arm.js";
import { plot } from "./plot.js";

const $ = (id) => document.getElementById(id);
const points = { first: 0, times: [], lines: {} };
const SHOWN_POINTS = 600;
const UNITS = { rate_rad_s: ["rate", "rad/s", 3], acceleration_m_s2: ["acceleration", "m/s²", 3], field_t: ["magnetic field", "µT", 1] };

let sensors = []; // as the rig has them
let past = ""; // how old the readings are, in words; "" while they are of now
let over = false; // the run has ended: the last reading is of a moment of its own, which no number beside the result should tell

/** Points that came with a frame. They are counted, so that none is taken twice; points that the rig has dropped are dropped. */
export function add(frame, news) {
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

let due = false;

/** Draw the plots, once for all that comes before the next picture: of these sensors, whose readings are so old, of a run that is `ended` or not. */
export function redraw(of, old, ended) {
  [sensors, past, over] = [of ?? [], old, ended];
  if (due) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    for (const name of Object.keys(points.lines).sort(inOrder)) draw(name, points.lines[name]);
  });
}

/** By sensor as the rig has them, then rate before acceleration before field. */
function inOrder(one, other) {
  const order = sensors.map((sensor) => sensor.name);
  const [a, b] = [one, other].map((name) => [order.indexOf(name.slice(0, name.lastIndexOf("."))), Object.keys(UNITS).indexOf(name.slice(name.lastIndexOf(".") + 1))]);
  return a[0] - b[0] || a[1] - b[1];
}

function draw(name, values) {
  const id = `plot-${name.replaceAll(/[^A-Za-z0-9_-]/g, "-")}`;
  const [sensor, quantity] = [name.slice(0, name.lastIndexOf(".")), name.slice(name.lastIndexOf(".") + 1)];
  const about = sensors.find((candidate) => candidate.name === sensor);
  const [title, unit, digits] = UNITS[quantity] ?? [...(about?.units?.[quantity] ?? [quantity, ""]), 2];
  if (!$(id)) $("readings").append(panel(id, sensor, title, unit));
  $(`${id}-about`).textContent = [about?.part, about?.mode === "calibrated" ? "corrected by the board" : ""].filter(Boolean).join(" · ");
  const last = values.findLast((value) => value);
  const canvas = $(`${id}-canvas`);
  const axes = last?.length === 1 ? [["x", ""]] : [..."xyz"].map((axis) => [axis, `${axis} `]); // what has no axes has no letter
  for (const [i, [axis, letter]] of axes.entries()) {
    $(`${id}-${axis}`).textContent = `${letter}${last ? signed(last[i], digits).padStart(digits + 4, "\u2007") : "–"}`;
  }
  if (over) canvas.setAttribute("aria-label", `${sensor}, ${title} over the last minute of the run`);
  else if (last) canvas.setAttribute("aria-label", `${sensor}, ${title} over the last minute; ${past || "now"} ${axes.map(([, letter], i) => `${letter}${last[i].toFixed(digits)}`).join(", ")} ${unit}`);
  plot(canvas, points.times, values, past ? "last" : "now");
}

function panel(id, sensor, title, unit) {
  const make = (tag, fields, ...children) => {
    const node = Object.assign(document.createElement(tag), fields);
    node.append(...children);
    return node;
  };
  const now = make("span", { className: "now" }, ...[..."xyz"].map((axis) => make("span", { id: `${id}-${axis}`, className: axis })), make("span", { className: "unit", textContent: unit }));
  const head = make("h2", {}, make("span", { textContent: `${sensor}, ${title}` }), make("small", { id: `${id}-about` }), make("small", { className: "age", textContent: past }), now);
  const canvas = make("canvas", { id: `${id}-canvas` });
  canvas.setAttribute("role", "img");
  return make("section", { id, className: "plot" }, head, canvas);
}
