// What was found: a row for each sensor, its values ± U, a picture of them, and what they were the time before.

const SVG = "http://www.w3.org/2000/svg";
const WIDE = 84, LANE = 11; // of a picture, in CSS pixels; a lane for each axis
const LETTERS = "xyz";

function make(tag, fields = {}, ...children) {
  const made = Object.assign(document.createElement(tag), fields);
  made.append(...children);
  return made;
}

/** One row a sensor; all of it stands below where there is one sensor, and when a row is opened. */
export function outcome(box, rows, since) {
  const before = new Map([...box.children].map((each) => [each.dataset.name, each.open]));
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
function triad(what, found, unit, past, kind) {
  if (!found) return [make("span", { className: `numbers ${kind}`, textContent: "" }), make("span", { className: `picture ${kind}` })];
  const largest = found.expanded.indexOf(Math.max(...found.expanded));
  const words = make("span", { className: `numbers ${kind}` }, make("small", { textContent: `${what} ` }),
    ...found.texts.map((text) => make("b", { textContent: text })),
    make("span", { className: "u", textContent: `± ${found.u[largest]}${unit && ` ${unit}`}` }));
  return [words, make("span", { className: `picture ${kind}` }, picture(found, past, found.values.map((_, i) => i)))];
}

function table(row, past) {
  const heading = (of, unit) => (row[of] ? [`${of === "scale" ? "scale factor" : row.scale ? "bias" : "value"} ± U${unit}`, "", ...(past?.[of] ? ["before", "E_n"] : [])] : []);
  const cells = (of, i) => {
    const [found, then] = [row[of], past?.[of]];
    if (!found) return [];
    return [make("td", { textContent: `${found.texts[i]} ± ${found.u[i]}` }), make("td", {}, picture(found, then, [i])),
      ...(then ? [make("td", { textContent: then.values[i].toFixed(decimals(found.texts[i])).replace("-", "−") }),
        make("td", { textContent: then.normalised_error[i].toFixed(1), className: then.changed[i] ? "bad" : "" })] : [])];
  };
  const head = ["axis", ...heading("scale", ""), ...heading("bias", `, ${row.unit}`)].map((text) => make("th", { scope: "col", textContent: text }));
  const body = row.bias.values.map((_, i) => make("tr", {}, make("th", { scope: "row", textContent: row.labels[i] }), ...cells("scale", i), ...cells("bias", i)));
  return make("div", { className: "wide" }, make("table", {}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...body)));
}

const decimals = (text) => text.split(".")[1]?.length ?? 0;

/** Where values lie between what is allowed, from end to end: a dot with its U, a ring where it was before. */
function picture(found, past, axes) {
  const off = axes.map((i) => found.values[i] - found.nominal);
  const then = past ? axes.map((i) => past.values[i] - found.nominal) : [];
  const reach = 1.15 * (found.limit ?? Math.max(...found.values.map((each, i) => Math.abs(each - found.nominal) + found.expanded[i]), Number.MIN_VALUE));
  const across = (value) => (WIDE / 2) * (1 + Math.max(-0.97, Math.min(0.97, value / reach)));
  const height = LANE * axes.length;
  const svg = element("svg", { viewBox: `0 0 ${WIDE} ${height}`, width: WIDE, height, role: "img" });
  svg.setAttribute("aria-label", label(found, axes));
  svg.append(element("line", { x1: WIDE / 2, x2: WIDE / 2, y1: 0, y2: height, class: "nominal" }));
  if (found.limit) for (const side of [-1, 1]) svg.append(element("line", { x1: across(side * found.limit), x2: across(side * found.limit), y1: 0, y2: height, class: "limit" }));
  axes.forEach((i, lane) => {
    const y = LANE * (lane + 0.5), u = found.expanded[i];
    if (past) svg.append(element("circle", { cx: across(then[lane]), cy: y, r: 4.2, class: "before" }));
    svg.append(element("line", { x1: across(off[lane] - u), x2: across(off[lane] + u), y1: y, y2: y, class: `bar ${LETTERS[i]}` }));
    svg.append(element("circle", { cx: across(off[lane]), cy: y, r: 2.6, class: `dot ${LETTERS[i]}` }));
  });
  return svg;
}

function label(found, axes) {
  const from = found.nominal ? `from ${found.nominal}` : "from zero";
  const each = axes.map((i) => `${LETTERS[i]} ${(found.values[i] - found.nominal).toPrecision(3)}`).join(", ");
  return `${each} ${from}` + (found.limit ? `; ${found.limit.toPrecision(3)} is allowed` : "");
}

function element(tag, attributes) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}
