// The results: a row for each sensor with its values ± U, a plot of them, and the values of the calibration before.

import { label } from "./tables.js";

const SVG = "http://www.w3.org/2000/svg";
const WIDE = 84, LANE = 11; // of a picture, in CSS pixels; a lane for each axis
const LETTERS = "xyz";

function make(tag, fields = {}, ...children) {
  const node = Object.assign(document.createElement(tag), fields);
  node.append(...children);
  return node;
}

/** Show one row per sensor; its details are open if it is the only sensor, or if the reader opened them. */
export function outcome(box, rows, since) {
  const before = new Map([...box.children].map((details) => [details.dataset.name, details.open]));
  box.replaceChildren(...rows.map((row) => {
    const past = since?.[row.name];
    const all = make("details", { open: before.get(row.name) ?? rows.length <= 2 }, summary(row, past, since), table(row, past));
    all.dataset.name = row.name;
    return all;
  }));
}

function summary(row, past, since) {
  return make("summary", {},
    make("span", { className: "of" }, make("strong", { textContent: row.name }), make("small", { textContent: row.part })),
    ...triad("scale factor", row.scale, "", past?.scale, "scale"),
    ...triad(row.scale ? "bias" : "value", row.bias, row.unit, past?.bias, "bias"),
    make("span", { className: `since ${past?.changed.length ? "bad" : ""}`, textContent: comparison(past, since) }));
}

function comparison(past, since) {
  if (!since) return "";
  if (!past) return "first calibration of this part";
  const when = `since no ${past.number}, ${past.day}`;
  const [name, error] = past.worst;
  if (past.changed.length) return `⚠ ${past.changed.join(", ")} changed ${when}`;
  return `nothing changed ${when} (${name}: E_n ${error.toFixed(1)})`;
}

/** Three numbers with the largest U of theirs, and their picture. */
function triad(what, result, unit, past, kind) {
  if (!result) return [make("span", { className: `numbers ${kind}`, textContent: "" }), make("span", { className: `picture ${kind}` })];
  const largest = result.expanded.indexOf(Math.max(...result.expanded));
  const words = make("span", { className: `numbers ${kind}` }, make("small", { textContent: `${what} ` }),
    ...result.texts.map((text) => make("b", { textContent: text })),
    make("span", { className: "u", textContent: `± ${result.u[largest]}${unit && ` ${unit}`}` }));
  return [words, make("span", { className: `picture ${kind}` }, picture(result, past, result.values.map((_, i) => i)))];
}

function table(row, past) {
  const heading = (of, unit) => (row[of] ? [`${of === "scale" ? "scale factor" : row.scale ? "bias" : "value"} ± U${unit}`, "", ...(past?.[of] ? ["before", "E_n"] : []), ...(row.truth?.[of] ? ["simulated truth", "(result − truth)/U"] : [])] : []);
  const cells = (of, i) => {
    const [result, then, truth] = [row[of], past?.[of], row.truth?.[of]];
    if (!result) return [];
    return [make("td", { textContent: `${result.texts[i]} ± ${result.u[i]}` }), make("td", {}, picture(result, then, [i])),
      ...(then ? [make("td", { textContent: then.values[i].toFixed(decimals(result.texts[i])).replace("-", "−") }),
        make("td", { textContent: then.normalised_error[i].toFixed(1), className: then.changed[i] ? "bad" : "" })] : []),
      ...(truth ? [make("td", { textContent: truth.texts[i] }), make("td", { textContent: signed(truth.deviations[i]) })] : [])];
  };
  const head = ["axis", ...heading("scale", ""), ...heading("bias", `, ${row.unit}`)].map((text) => make("th", { scope: "col", textContent: text }));
  const body = row.bias.values.map((_, i) => make("tr", {}, make("th", { scope: "row", textContent: row.labels[i] }), ...cells("scale", i), ...cells("bias", i)));
  const all = make("table", {}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...body));
  label(all);
  return make("div", { className: "wide" }, all);
}

const signed = (number) => `${number < 0 ? "−" : "+"}${Math.abs(number).toFixed(2)}`;
const decimals = (text) => text.split(".")[1]?.length ?? 0;

/** Where values lie between what is allowed, from end to end: a dot with its U, a ring where it was before. */
function picture(result, past, axes) {
  const deviations = axes.map((i) => result.values[i] - result.nominal);
  const then = past ? axes.map((i) => past.values[i] - result.nominal) : [];
  const reach = 1.15 * (result.limit ?? Math.max(...result.values.map((value, i) => Math.abs(value - result.nominal) + result.expanded[i]), Number.MIN_VALUE));
  const across = (value) => (WIDE / 2) * (1 + Math.max(-0.97, Math.min(0.97, value / reach)));
  const height = LANE * axes.length;
  const svg = element("svg", { viewBox: `0 0 ${WIDE} ${height}`, width: WIDE, height, role: "img" });
  svg.setAttribute("aria-label", described(result, axes));
  svg.append(element("line", { x1: WIDE / 2, x2: WIDE / 2, y1: 0, y2: height, class: "nominal" }));
  if (result.limit) for (const side of [-1, 1]) svg.append(element("line", { x1: across(side * result.limit), x2: across(side * result.limit), y1: 0, y2: height, class: "limit" }));
  axes.forEach((i, lane) => {
    const y = LANE * (lane + 0.5), u = result.expanded[i];
    if (past) svg.append(element("circle", { cx: across(then[lane]), cy: y, r: 4.2, class: "before" }));
    svg.append(element("line", { x1: across(deviations[lane] - u), x2: across(deviations[lane] + u), y1: y, y2: y, class: `bar ${LETTERS[i]}` }));
    svg.append(element("circle", { cx: across(deviations[lane]), cy: y, r: 2.6, class: `dot ${LETTERS[i]}` }));
  });
  return svg;
}

function described(result, axes) {
  const from = result.nominal ? `from ${result.nominal}` : "from zero";
  const each = axes.map((i) => `${LETTERS[i]} ${(result.values[i] - result.nominal).toPrecision(3)}`).join(", ");
  return `${each} ${from}` + (result.limit ? `; ${result.limit.toPrecision(3)} is allowed` : "");
}

function element(tag, attributes) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  return node;
}
