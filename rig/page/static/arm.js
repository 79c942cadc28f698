// What turns the sensors from its joints: Denavit–Hartenberg frames seen from a corner of the room, drawn from back to front.

import { colours, fresh, FONT } from "./drawing.js";

const AZIMUTH = 0.75, ELEVATION = 0.33; // radians, of whoever looks
const THICK_M = [0.19, 0.17, 0.15, 0.12, 0.115, 0.1]; // of each joint's housing, of an arm of six that is this long:
const LONG_M = 1.18425; // the links of a UR10e
const USUAL_THICK_M = 0.12;
const TURNING = 0.02; // rad/s

/** Draw `arm` (as the rig tells it) on a canvas. */
export function drawArm(canvas, arm) {
  const { pen, width, height } = fresh(canvas);
  const paint = colours();
  const frames = framesOf(arm.geometry, arm.q_rad ?? arm.geometry.theta_rad.map(() => 0));
  const grown = (arm.long_m || LONG_M) / LONG_M;
  const size = Math.min(width / 2.2, height / 1.6) / grown; // pixels a metre
  const see = ([x, y, z]) => {
    const along = x * Math.cos(AZIMUTH) + y * Math.sin(AZIMUTH);
    const deep = -x * Math.sin(AZIMUTH) + y * Math.cos(AZIMUTH);
    return {
      at: [width / 2 + size * along, height * 0.82 - size * (z * Math.cos(ELEVATION) + deep * Math.sin(ELEVATION))],
      deep: deep * Math.cos(ELEVATION) - z * Math.sin(ELEVATION),
    };
  };
  floor(pen, paint, see);
  if (!arm.q_rad) return;
  shadow(pen, paint, frames, see, size);
  const fastest = fastestJoint(arm.qd_rad_s);
  const parts = [plinth(paint, see, size)];
  const joints = frames.length - 1;
  const thickOf = (joint) => (joints === THICK_M.length ? THICK_M[Math.min(joint, joints - 1)] : USUAL_THICK_M);
  for (let joint = 0; joint < joints; joint += 1) {
    const [from, to] = [frames[joint].origin, frames[joint + 1].origin];
    const thick = size * (thickOf(joint) + thickOf(joint + 1)) * 0.42;
    for (const [start, end] of bent(frames[joint], from, to)) parts.push(limb(paint, see, start, end, thick));
    parts.push(knuckle(paint, see, from, frames[joint].z, size * thickOf(joint) * 0.58, joint === fastest));
  }
  parts.push(...board(paint, see, frames[joints], size));
  parts.sort((a, b) => b.deep - a.deep);
  for (const part of parts) part.draw(pen);
  if (fastest !== null) {
    const { at } = see(frames[fastest].origin);
    const degrees = (arm.qd_rad_s[fastest] * 180) / Math.PI;
    label(pen, paint, at, `${arm.joints[fastest]} ${signed(degrees)} °/s`, width);
  }
}

/** Return the frames of the base and after each joint: origin and axes x, y, z in the base's frame. */
export function framesOf(geometry, q) {
  let frame = { origin: [0, 0, 0], x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
  const frames = [frame];
  for (let i = 0; i < q.length; i += 1) {
    const angle = q[i] + geometry.theta_rad[i], twist = geometry.alpha_rad[i];
    const x = sum(scaled(frame.x, Math.cos(angle)), scaled(frame.y, Math.sin(angle)));
    const across = sum(scaled(frame.x, -Math.sin(angle)), scaled(frame.y, Math.cos(angle)));
    const origin = sum(frame.origin, sum(scaled(frame.z, geometry.d_m[i]), scaled(x, geometry.a_m[i])));
    frame = {
      origin,
      x,
      y: sum(scaled(across, Math.cos(twist)), scaled(frame.z, Math.sin(twist))),
      z: sum(scaled(frame.z, Math.cos(twist)), scaled(across, -Math.sin(twist))),
    };
    frames.push(frame);
  }
  return frames;
}

/** From one origin to the next along the joint's axis first, then across it, as the arm is built. */
function bent(frame, from, to) {
  const way = sum(to, scaled(from, -1));
  const corner = sum(from, scaled(frame.z, dot(way, frame.z)));
  return [[from, corner], [corner, to]].filter(([a, b]) => Math.hypot(...sum(b, scaled(a, -1))) > 1e-3);
}

function fastestJoint(speeds) {
  if (!speeds?.length) return null;
  const sizes = speeds.map(Math.abs);
  const fastest = sizes.indexOf(Math.max(...sizes));
  return sizes[fastest] > TURNING ? fastest : null;
}

function floor(pen, paint, see) {
  pen.strokeStyle = paint.floor;
  pen.lineWidth = 1;
  for (let i = -4; i <= 4; i += 1) {
    const at = i * 0.25;
    for (const [a, b] of [[[at, -1, 0], [at, 1, 0]], [[-1, at, 0], [1, at, 0]]]) {
      pen.beginPath();
      pen.moveTo(...see(a).at);
      pen.lineTo(...see(b).at);
      pen.stroke();
    }
  }
}

function shadow(pen, paint, frames, see, size) {
  pen.strokeStyle = paint.floor;
  pen.lineCap = "round";
  pen.lineJoin = "round";
  pen.lineWidth = size * 0.1;
  pen.beginPath();
  for (const { origin: [x, y] } of frames) pen.lineTo(...see([x, y, 0]).at);
  pen.stroke();
}

function plinth(paint, see, size) {
  const { at, deep } = see([0, 0, 0]);
  return {
    deep: deep + 1,
    draw(pen) {
      pen.fillStyle = paint["steel-edge"];
      pen.beginPath();
      pen.ellipse(at[0], at[1] + size * 0.01, size * 0.13, size * 0.07, 0, 0, 2 * Math.PI);
      pen.fill();
    },
  };
}

/** A tube between two points: a dark edge, the body, a light streak. */
function limb(paint, see, from, to, thick) {
  const [a, b] = [see(from), see(to)];
  return {
    deep: (a.deep + b.deep) / 2,
    draw(pen) {
      pen.lineCap = "round";
      for (const [colour, width, alpha] of [[paint["steel-edge"], thick, 1], [paint.steel, thick - 3, 1], ["#ffffff", thick * 0.28, 0.35]]) {
        pen.strokeStyle = colour;
        pen.globalAlpha = alpha;
        pen.lineWidth = Math.max(1, width);
        pen.beginPath();
        pen.moveTo(...a.at);
        pen.lineTo(...b.at);
        pen.stroke();
      }
      pen.globalAlpha = 1;
    },
  };
}

/** A joint's cap, a disc across its axis; the one that turns is filled and ringed. */
function knuckle(paint, see, origin, axis, radius, turning) {
  const { at, deep } = see(origin);
  const tip = see(sum(origin, scaled(axis, 0.1))).at;
  const [dx, dy] = [tip[0] - at[0], tip[1] - at[1]];
  const facing = see(scaled(axis, 1)).deep;
  const squeeze = Math.max(0.25, Math.min(1, Math.abs(facing)));
  return {
    deep: deep - 0.05,
    draw(pen) {
      pen.fillStyle = turning ? paint.move : paint.panel;
      pen.strokeStyle = turning ? paint.ink : paint["steel-edge"];
      pen.lineWidth = turning ? 3 : 2;
      pen.beginPath();
      pen.ellipse(at[0], at[1], radius, radius * squeeze, Math.atan2(dy, dx) + Math.PI / 2, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
    },
  };
}

/** The sensor board on the flange, and the flange's three axes. */
function board(paint, see, flange, size) {
  const half = 0.055;
  const corner = (i, j) =>
    see(sum(flange.origin, sum(scaled(flange.x, i * half), sum(scaled(flange.y, j * half), scaled(flange.z, 0.02)))));
  const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
  const middle = see(flange.origin);
  const plate = {
    deep: middle.deep - 0.06,
    draw(pen) {
      pen.fillStyle = paint.good;
      pen.strokeStyle = paint.ink;
      pen.lineWidth = 1.5;
      pen.beginPath();
      for (const { at } of corners) pen.lineTo(...at);
      pen.closePath();
      pen.fill();
      pen.stroke();
    },
  };
  const axes = [..."xyz"].map((axis) => {
    const end = see(sum(flange.origin, scaled(flange[axis], 0.24)));
    return {
      deep: Math.min(middle.deep, end.deep) - 0.07,
      draw(pen) {
        pen.strokeStyle = pen.fillStyle = paint[axis];
        pen.lineWidth = 3;
        pen.beginPath();
        pen.moveTo(...middle.at);
        pen.lineTo(...end.at);
        pen.stroke();
        pen.font = `bold 14px ${FONT}`;
        pen.textAlign = "center";
        pen.textBaseline = "middle";
        const along = Math.hypot(end.at[0] - middle.at[0], end.at[1] - middle.at[1]) || 1;
        pen.fillText(axis, end.at[0] + (10 * (end.at[0] - middle.at[0])) / along, end.at[1] + (10 * (end.at[1] - middle.at[1])) / along);
      },
    };
  });
  return [plate, ...axes];
}

function label(pen, paint, at, text, width) {
  pen.font = `bold 15px ${FONT}`;
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  const wide = pen.measureText(text).width;
  const x = Math.min(Math.max(8, at[0] - wide / 2), width - wide - 8);
  const y = 16;
  pen.fillStyle = paint.move;
  pen.fillText(text, x, y);
  pen.strokeStyle = paint.move;
  pen.lineWidth = 1;
  pen.beginPath();
  pen.moveTo(at[0], y + 12);
  pen.lineTo(...at);
  pen.stroke();
}

export const signed = (value, digits = 0) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(digits)}`;
const scaled = (v, s) => v.map((component) => component * s);
const sum = (a, b) => a.map((component, i) => component + b[i]);
const dot = (a, b) => a.reduce((total, component, i) => total + component * b[i], 0);
