// The tables: observations, parameters, checks, samples, joints.

import { signed } from "./arm.js";

/** A row of cells; a cell is a text or [text, class names]. The first is the row's heading. */
function row(cells, kind = "") {
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

const MANY = 12; // rows, more of which are shown on demand

function fill(id, rows) {
  const body = document.querySelector(`#${id} tbody`) ?? document.getElementById(id);
  const panel = body.closest("details");
  if (panel && !panel.dataset.folded && rows.length > MANY) {
    panel.open = false; // once: whoever opens it again wants to see it
    panel.dataset.folded = "yes";
  }
  body.replaceChildren(...rows);
  label(body.closest("table"));
}

/** Give each cell the heading of its column, which a narrow screen shows beside it. */
export function label(table) {
  const headings = [...table.tHead.rows[0].cells].map((cell) => cell.textContent);
  for (const { cells } of table.tBodies[0].rows)
    for (const cell of cells) if (cell.colSpan === 1) cell.dataset.label = headings[cell.cellIndex];
}

export const minus = (text) => text.replace("-", "−");
const fixed = (value, digits) => (typeof value === "number" ? minus(value.toFixed(digits)) : "–");
export const plain = (value) => (typeof value === "number" ? minus(String(Number(value.toPrecision(4)))) : "–");
const count = (value) => (typeof value === "number" ? value.toLocaleString("en").replaceAll(",", "\u202f") : "–");

export function samples(sensors) {
  fill("samples", sensors.map((s) =>
    row([s.name, count(s.samples), [count(s.lost) + (s.lost ? " ⚠" : ""), s.lost ? "odd-number" : ""], fixed(s.temperature_c, 1)])));
}

/** Show the joints' angles and, if they are `current`, speeds. */
export function joints(arm, current) {
  const fastest = Math.max(0, ...arm.qd_rad_s.map(Math.abs));
  fill("joints", arm.joints.map((name, i) => {
    const turning = current && fastest > 0.02 && Math.abs(arm.qd_rad_s[i]) === fastest;
    return row(
      [(turning ? "▸ " : "") + name, minus(((arm.q_rad[i] * 180) / Math.PI).toFixed(1)), current ? signed((arm.qd_rad_s[i] * 180) / Math.PI, 1) : "–"],
      turning ? "turning" : "",
    );
  }));
}

export function observations(rows) {
  const sweeps = new Map();
  for (const row of rows) sweeps.set(row.sweep, { ...sweeps.get(row.sweep), ...(row.joint ? row : {}) });
  dwells(rows.filter((row) => row.dwell !== undefined));
  const turns = rows.filter((row) => row.dwell === undefined);
  fill("observations", turns.map((o, i) => {
    const turn = sweeps.get(o.sweep);
    const words = turn?.joint ? `${turn.joint} ${turn.direction}` : "";
    const kind = i && turns[i - 1].sweep !== o.sweep ? "new-sensor" : "";
    if (o.refused) {
      const tr = row([o.sweep, [o.sensor, "words"], [words, "words"], [`✗ refused: ${o.refused}`, "words bad"]], kind);
      tr.lastChild.colSpan = 6;
      return tr;
    }
    const along = o.axis ? o.sign * o.mean_rad_s["xyz".indexOf(o.axis)] : largest(o.mean_rad_s);
    const expected = o.along && o.speed_rad_s * o.along; // of an oblique turn an axis feels a part
    const spread = o.std_rad_s ? ` ± ${(2 * o.std_rad_s).toFixed(5)}` : "";
    return row([
      o.sweep, [o.sensor, "words"], [words + (o.axis ? `, ${o.sign > 0 ? "+" : "−"}${o.axis}` : ""), "words"],
      minus(along.toFixed(5)) + spread, fixed(expected, 5), fixed(expected && along / expected, 5),
      count(o.samples), [count(o.lost), o.lost ? "odd-number" : ""], o.by,
    ], kind);
  }));
}

/** Show the dwells: the magnitude of the reading, that of gravity or of the field, and the nearest axis. */
function dwells(rows) {
  fill("dwells", rows.map((d, i) => {
    const kind = i && rows[i - 1].sweep !== d.sweep ? "new-sensor" : "";
    if (d.refused) return spanning(row([d.sweep, [d.sensor, "words"], [`✗ refused: ${d.refused}`, "words bad"]], kind), 6);
    return row([
      d.sweep, [d.sensor, "words"], [`${d.dwell}, ${d.towards}`, "words"],
      fixed(d.size, 4) + (d.std ? ` ± ${(2 * d.std).toFixed(4)}` : ""), fixed(d.expected, 4), d.unit,
      fixed(d.expected && d.size / d.expected, 5), count(d.samples),
    ], kind);
  }));
}

const largest = (vector) => Math.max(...vector.map(Math.abs));

/** As many decimals as the smallest U warrants, which is shown with two digits; five at least. */
const warranted = (u) => (u ? Math.min(12, Math.max(5, ...u.filter((value) => value > 0).map((value) => 1 - Math.floor(Math.log10(value))))) : 5);

export function parameters(rows) {
  fill("parameters", rows.flatMap((p) => {
    if (!p.scale && !p.bias) return [spanning(row([p.sensor, [p.missing ?? "", "words"]], "new-sensor"), 7)];
    const digits = p.scale || p.missing ? warranted(p.bias_u) : 2;
    const axes = p.labels.map((axis, i) =>
      row([
        i === 0 ? p.sensor : "", axis,
        p.scale ? fixed(p.scale[i], 5) : "–", [p.scale_u ? fixed(p.scale_u[i], 5) : "–", "u"],
        p.bias ? signed(p.bias[i], digits) : "–", [p.bias_u ? fixed(p.bias_u[i], digits) : "–", "u"], p.unit, p.of,
      ], i === 0 ? "new-sensor" : ""));
    if (p.missing) axes.push(spanning(row(["", [`no scale factors yet: ${p.missing}`, "words"]]), 7));
    return axes;
  }));
}

function spanning(tr, columns) {
  tr.lastChild.colSpan = columns;
  return tr;
}

export function checks(rows) {
  const passed = rows.filter((c) => c.passed).length;
  document.getElementById("checks-held").textContent = rows.length ? `${passed} of ${rows.length} passed` : "";
  fill("checks", [...rows].sort((a, b) => a.passed - b.passed).map((c) =>
    row([c.name, plain(c.value) + (c.uncertainty ? ` ± ${plain(c.uncertainty)}` : ""), plain(c.limit), c.unit, c.passed ? ["✓ passed", "good"] : ["✗ failed", "bad"]])));
}
