// The results: one row per sensor with its values ± U, a plot of them, and the values of the previous calibration.

import { labelCells, withoutName } from "./tables.js";

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 84, LANE = 11; // of a picture, in CSS pixels; one lane per axis
const LETTERS = "xyz";

function make(tag, fields = {}, ...children) {
  const node = Object.assign(document.createElement(tag), fields);
  node.append(...children);
  return node;
}

/** Show one row per sensor; its details are open if it is the only sensor, or if the reader opened them. */
export function showOutcome(box, rows, since) {
  const wasOpen = new Map([...box.children].map((details) => [details.dataset.name, details.open]));
  box.replaceChildren(...rows.map((row) => {
    const past = since?.[row.name];
    const details = make("details", { open: wasOpen.get(row.name) ?? rows.length <= 2 }, makeSummary(row, past, since), makeTables(row, past));
    details.dataset.name = row.name;
    return details;
  }));
}

function makeSummary(row, past, since) {
  return make("summary", {},
    make("span", { className: "of" }, make("strong", { textContent: row.name }), make("small", { textContent: withoutName(row.part, row.name) })),
    ...makeTriad("scale factor", row.scale, "", past?.scale, "scale"),
    ...makeTriad(row.scale ? "bias" : "value", row.bias, row.unit, past?.bias, "bias"),
    make("span", { className: `since ${past?.changed.length ? "bad" : ""}` }, ...describeComparison(past, since)));
}

/** Return the comparison with the previous calibration as texts and nodes. */
function describeComparison(past, since) {
  if (!since) return [];
  if (!past) return ["first calibration of this part"];
  const day = make("span", { className: "day", textContent: past.day });
  const [name, error] = past.worst;
  if (past.changed.length) return [`⚠ ${past.changed.join(", ")} changed since no ${past.number}, `, day];
  return [`nothing changed since no ${past.number}, `, day, ` (${name}: E_n ${error.toFixed(1)})`];
}

/** Make three numbers with their largest U, and their picture. */
function makeTriad(name, result, unit, past, kind) {
  if (!result) return [make("span", { className: `numbers ${kind}`, textContent: "" }), make("span", { className: `picture ${kind}` })];
  const largest = result.expanded.indexOf(Math.max(...result.expanded));
  const words = make("span", { className: `numbers ${kind}` }, make("small", { textContent: `${name} ` }),
    ...result.texts.map((text) => make("b", { textContent: text })),
    make("wbr"), make("span", { className: "u", textContent: `± ${result.u[largest]}${unit && ` ${unit}`}` }));
  return [words, make("span", { className: `picture ${kind}` }, drawPicture(result, past, result.values.map((_, i) => i)))];
}

/** Make the tables of scale factors and of biases: side by side, or below one another where the screen is narrow. */
function makeTables(row, past) {
  return make("div", { className: "wide" }, ...["scale", "bias"].filter((key) => row[key]).map((key) => makeTable(row, past, key)));
}

function makeTable(row, past, key) {
  const [result, previous, truth] = [row[key], past?.[key], row.truth?.[key]];
  const name = key === "scale" ? "scale factor ± U" : `${row.scale ? "bias" : "value"} ± U, ${row.unit}`;
  const headings = ["axis", name, "", ...(previous ? ["before", "E_n"] : []), ...(truth ? ["simulated truth", "(result − truth)/U"] : [])];
  const makeCells = (i) => [make("td", { textContent: `${result.texts[i]} ± ${result.u[i]}` }), make("td", {}, drawPicture(result, previous, [i])),
    ...(previous ? [make("td", { textContent: previous.values[i].toFixed(countDecimals(result.texts[i])).replace("-", "−") }),
      make("td", { textContent: previous.normalised_error[i].toFixed(1), className: previous.changed[i] ? "bad" : "" })] : []),
    ...(truth ? [make("td", { textContent: truth.texts[i] }), make("td", { textContent: formatSigned(truth.deviations[i]) })] : [])];
  const head = headings.map((text) => make("th", { scope: "col", textContent: text }));
  const body = row.labels.map((label, i) => make("tr", {}, make("th", { scope: "row", textContent: label }), ...makeCells(i)));
  const table = make("table", {}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...body));
  labelCells(table);
  return table;
}

const formatSigned = (number) => `${number < 0 ? "−" : "+"}${Math.abs(number).toFixed(2)}`;
const countDecimals = (text) => text.split(".")[1]?.length ?? 0;

/** Draw values between their limits: a dot with its U, and a ring at the value of the previous calibration. */
function drawPicture(result, past, axes) {
  const deviations = axes.map((i) => result.values[i] - result.nominal);
  const previous = past ? axes.map((i) => past.values[i] - result.nominal) : [];
  const reach = 1.15 * (result.limit ?? Math.max(...result.values.map((value, i) => Math.abs(value - result.nominal) + result.expanded[i]), Number.MIN_VALUE));
  const across = (value) => (WIDTH / 2) * (1 + Math.max(-0.97, Math.min(0.97, value / reach)));
  const height = LANE * axes.length;
  const svg = makeElement("svg", { viewBox: `0 0 ${WIDTH} ${height}`, width: WIDTH, height, role: "img" });
  svg.setAttribute("aria-label", describe(result, axes));
  svg.append(makeElement("line", { x1: WIDTH / 2, x2: WIDTH / 2, y1: 0, y2: height, class: "nominal" }));
  if (result.limit) for (const side of [-1, 1]) svg.append(makeElement("line", { x1: across(side * result.limit), x2: across(side * result.limit), y1: 0, y2: height, class: "limit" }));
  axes.forEach((i, lane) => {
    const y = LANE * (lane + 0.5), u = result.expanded[i];
    if (past) svg.append(makeElement("circle", { cx: across(previous[lane]), cy: y, r: 4.2, class: "before" }));
    svg.append(makeElement("line", { x1: across(deviations[lane] - u), x2: across(deviations[lane] + u), y1: y, y2: y, class: `bar ${LETTERS[i]}` }));
    svg.append(makeElement("circle", { cx: across(deviations[lane]), cy: y, r: 2.6, class: `dot ${LETTERS[i]}` }));
  });
  return svg;
}

function describe(result, axes) {
  const from = result.nominal ? `from ${result.nominal}` : "from zero";
  const deviations = axes.map((i) => `${LETTERS[i]} ${(result.values[i] - result.nominal).toPrecision(3)}`).join(", ");
  return `${deviations} ${from}` + (result.limit ? `; ${result.limit.toPrecision(3)} is allowed` : "");
}

function makeElement(tag, attributes) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  return node;
}
