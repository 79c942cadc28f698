// Three components over the last minute. Each has a colour, a line pattern and its letter at the end.

import { clearCanvas, FONT, readColours } from "./drawing.js";

const SPAN_S = 60;
const DASHES = { x: [], y: [9, 4], z: [2, 3] };
const LEFT = 62, RIGHT = 26, TOP = 10, BOTTOM = 24;

/** Draw `values` ([x, y, z] or null) at `times` (s), the newest at the right edge, which is called `newest`. */
export function drawPlot(canvas, times, values, newest) {
  const { pen, width, height } = clearCanvas(canvas);
  const paint = readColours();
  const now = times.length ? times[times.length - 1] : 0;
  const [low, high, step] = chooseScale(values);
  const across = (time) => LEFT + (1 + (time - now) / SPAN_S) * (width - LEFT - RIGHT);
  const up = (value) => TOP + ((high - value) / (high - low)) * (height - TOP - BOTTOM);

  pen.font = `13px ${FONT}`;
  pen.lineWidth = 1;
  pen.textBaseline = "middle";
  for (let tick = Math.ceil(low / step) * step; tick <= high + step * 1e-6; tick += step) {
    const zero = Math.abs(tick) < step * 1e-6;
    pen.strokeStyle = zero ? paint.soft : paint.line;
    drawLine(pen, [LEFT, up(tick)], [width - RIGHT, up(tick)]);
    pen.fillStyle = paint.soft;
    pen.textAlign = "right";
    pen.fillText(formatTick(zero ? 0 : tick, step), LEFT - 7, up(tick));
  }
  pen.textBaseline = "alphabetic";
  for (let ago = SPAN_S; ago >= 0; ago -= 15) {
    const x = across(now - ago);
    pen.strokeStyle = paint.faint;
    drawLine(pen, [x, TOP], [x, height - BOTTOM]);
    pen.textAlign = ago === 0 ? "right" : "center";
    pen.fillText(ago === 0 ? newest : `−${ago} s`, x, height - 6);
  }

  pen.save();
  pen.beginPath();
  pen.rect(LEFT, 0, width - LEFT - RIGHT, height - BOTTOM + 2);
  pen.clip();
  pen.lineWidth = 2.2;
  pen.lineJoin = "round";
  for (const [component, axis] of [..."xyz"].entries()) {
    pen.strokeStyle = paint[axis];
    pen.setLineDash(DASHES[axis]);
    pen.beginPath();
    let drawing = false;
    for (let i = 0; i < times.length; i += 1) {
      const value = values[i]?.[component];
      if (typeof value !== "number") drawing = false;
      else {
        pen[drawing ? "lineTo" : "moveTo"](across(times[i]), up(value));
        drawing = true;
      }
    }
    pen.stroke();
  }
  pen.restore();
  pen.setLineDash([]);
  drawAxisLetters(pen, paint, values.findLast((value) => value), up, width, height);
}

/** Draw the letters of the axes at the right end, moved apart if they overlap. */
function drawAxisLetters(pen, paint, last, up, width, height) {
  if (!last || last.length === 1) return;
  const labels = [..."xyz"].map((axis, i) => ({ axis, y: up(last[i]) })).sort((a, b) => a.y - b.y);
  for (let i = 1; i < 3; i += 1) labels[i].y = Math.max(labels[i].y, labels[i - 1].y + 16);
  const overflow = Math.max(0, labels[2].y - (height - BOTTOM));
  pen.font = `bold 15px ${FONT}`;
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  for (const { axis, y } of labels) {
    pen.fillStyle = paint[axis];
    pen.fillText(axis, width - RIGHT + 8, y - overflow);
  }
}

function drawLine(pen, from, to) {
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
  pen.stroke();
}

/** Return the lowest and the highest value shown and the step between ticks: about four of them, at round numbers. */
function chooseScale(values) {
  let low = 0, high = 0;
  for (const value of values)
    for (const component of value ?? [])
      if (typeof component === "number") {
        low = Math.min(low, component);
        high = Math.max(high, component);
      }
  const span = Math.max(high - low, 1e-3);
  const rough = span / 4;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
  return [low - 0.08 * span, high + 0.08 * span, step];
}

function formatTick(value, step) {
  return value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9))).replace("-", "−");
}
