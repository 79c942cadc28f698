// The tables: observations, parameters, checks, samples, joints.

import { formatSigned } from "./arm.js";

/** Make a row of cells; a cell is a text or [text, class names]. The first is the row's heading. */
function makeRow(cells, kind = "") {
  const tr = document.createElement("tr");
  if (kind) tr.className = kind;
  cells.forEach((cell, i) => {
    const [text, name] = Array.isArray(cell) ? cell : [cell, ""];
    const td = document.createElement(i === 0 ? "th" : "td");
    if (i === 0) td.scope = "row";
    td.textContent = text;
    if (name) td.className = name;
    tr.append(td);
  });
  return tr;
}

const MANY = 12; // rows; a longer table is folded

function fillTable(id, rows) {
  const body = document.querySelector(`#${id} tbody`) ?? document.getElementById(id);
  const panel = body.closest("details");
  if (panel && !panel.dataset.folded && rows.length > MANY) {
    panel.open = false; // only once: a reader who opens it again wants to see it
    panel.dataset.folded = "yes";
  }
  body.replaceChildren(...rows);
  labelCells(body.closest("table"));
}

/** Give every cell the heading of its column, which a narrow screen shows next to it. */
export function labelCells(table) {
  const headings = [...table.tHead.rows[0].cells].map((cell) => cell.textContent);
  for (const { cells } of table.tBodies[0].rows)
    for (const cell of cells) if (cell.colSpan === 1) cell.dataset.label = headings[cell.cellIndex];
}

/** Return a part and its serial number, without the part if the sensor, or what is measured of it, is named after it. */
export function withoutName(part, name) {
  const [sensor] = name.split(",");
  return part?.startsWith(`${sensor} `) ? part.slice(sensor.length + 1) : part;
}

export const formatMinus = (text) => text.replace("-", "−");
const formatFixed = (value, digits) => (typeof value === "number" ? formatMinus(value.toFixed(digits)) : "–");
export const formatNumber = (value) => (typeof value === "number" ? formatMinus(String(Number(value.toPrecision(4)))) : "–");
const formatCount = (value) => (typeof value === "number" ? value.toLocaleString("en").replaceAll(",", "\u202f") : "–");

export function showSamples(sensors) {
  fillTable("samples", sensors.map((s) =>
    makeRow([s.name, formatCount(s.samples), [formatCount(s.lost) + (s.lost ? " ⚠" : ""), s.lost ? "odd-number" : ""], formatFixed(s.temperature_c, 1)])));
}

/** Show the joints' angles and, if they are `current`, speeds. */
export function showJoints(arm, current) {
  const fastest = Math.max(0, ...arm.qd_rad_s.map(Math.abs));
  fillTable("joints", arm.joints.map((name, i) => {
    const turning = current && fastest > 0.02 && Math.abs(arm.qd_rad_s[i]) === fastest;
    return makeRow(
      [(turning ? "▸ " : "") + name, formatMinus(((arm.q_rad[i] * 180) / Math.PI).toFixed(1)), current ? formatSigned((arm.qd_rad_s[i] * 180) / Math.PI, 1) : "–"],
      turning ? "turning" : "",
    );
  }));
}

export function showObservations(rows) {
  const sweeps = new Map();
  for (const row of rows) sweeps.set(row.sweep, { ...sweeps.get(row.sweep), ...(row.joint ? row : {}) });
  showDwells(rows.filter((row) => row.dwell !== undefined));
  const revolutions = rows.filter((row) => row.dwell === undefined);
  fillTable("observations", revolutions.map((o, i) => {
    const sweep = sweeps.get(o.sweep);
    const words = sweep?.joint ? `${sweep.joint} ${sweep.direction}` : "";
    const kind = i && revolutions[i - 1].sweep !== o.sweep ? "new-sensor" : "";
    if (o.refused) {
      const tr = makeRow([o.sweep, [o.sensor, "words"], [words, "words"], [`✗ refused: ${o.refused}`, "words bad"]], kind);
      tr.lastChild.colSpan = 6;
      return tr;
    }
    const rate = o.axis ? o.sign * o.mean_rad_s["xyz".indexOf(o.axis)] : findLargest(o.mean_rad_s);
    const expected = o.along && o.speed_rad_s * o.along; // of an oblique rotation an axis senses a component
    const uncertainty = o.std_rad_s ? ` ± ${(2 * o.std_rad_s).toFixed(5)}` : "";
    return makeRow([
      o.sweep, [o.sensor, "words"], [words + (o.axis ? `, ${o.sign > 0 ? "+" : "−"}${o.axis}` : ""), "words"],
      formatMinus(rate.toFixed(5)) + uncertainty, formatFixed(expected, 5), formatFixed(expected && rate / expected, 5),
      formatCount(o.samples), [formatCount(o.lost), o.lost ? "odd-number" : ""], o.by,
    ], kind);
  }));
}

/** Show the dwells: the magnitude of the reading, that of gravity or of the field, and the nearest axis. */
function showDwells(rows) {
  fillTable("dwells", rows.map((d, i) => {
    const kind = i && rows[i - 1].sweep !== d.sweep ? "new-sensor" : "";
    if (d.refused) return spanColumns(makeRow([d.sweep, [d.sensor, "words"], [`✗ refused: ${d.refused}`, "words bad"]], kind), 6);
    return makeRow([
      d.sweep, [d.sensor, "words"], [`${d.dwell}, ${d.towards}`, "words"],
      formatFixed(d.size, 4) + (d.std ? ` ± ${(2 * d.std).toFixed(4)}` : ""), formatFixed(d.expected, 4), d.unit,
      formatFixed(d.expected && d.size / d.expected, 5), formatCount(d.samples),
    ], kind);
  }));
}

const findLargest = (vector) => Math.max(...vector.map(Math.abs));

/** Return the decimals at which the smallest U has two digits; at least five. */
const countDecimals = (u) => (u ? Math.min(12, Math.max(5, ...u.filter((value) => value > 0).map((value) => 1 - Math.floor(Math.log10(value))))) : 5);

export function showParameters(rows) {
  fillTable("parameters", rows.flatMap((p) => {
    if (!p.scale && !p.bias) return [spanColumns(makeRow([p.sensor, [p.missing ?? "", "words"]], "new-sensor"), 7)];
    const digits = p.scale || p.missing ? countDecimals(p.bias_u) : 2;
    const axes = p.labels.map((axis, i) =>
      makeRow([
        i === 0 ? p.sensor : "", axis,
        p.scale ? formatFixed(p.scale[i], 5) : "–", [p.scale_u ? formatFixed(p.scale_u[i], 5) : "–", "u"],
        p.bias ? formatSigned(p.bias[i], digits) : "–", [p.bias_u ? formatFixed(p.bias_u[i], digits) : "–", "u"], p.unit, p.of,
      ], i === 0 ? "new-sensor" : ""));
    if (p.missing) axes.push(spanColumns(makeRow(["", [`no scale factors yet: ${p.missing}`, "words"]]), 7));
    return axes;
  }));
}

function spanColumns(tr, columns) {
  tr.lastChild.colSpan = columns;
  return tr;
}

export function showChecks(rows) {
  const passed = rows.filter((c) => c.passed).length;
  document.getElementById("checks-held").textContent = rows.length ? `${passed} of ${rows.length} passed` : "";
  fillTable("checks", [...rows].sort((a, b) => a.passed - b.passed).map((c) =>
    makeRow([c.name, formatNumber(c.value) + (c.uncertainty ? ` ± ${formatNumber(c.uncertainty)}` : ""), formatNumber(c.limit), c.unit, c.passed ? ["✓ passed", "good"] : ["✗ failed", "bad"]])));
}
