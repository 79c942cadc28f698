// The drawing of the arm: its Denavit–Hartenberg frames seen from a corner of the room, drawn from back to front.

import { clearCanvas, FONT, readColours } from "./drawing.js";

const AZIMUTH = 0.75, ELEVATION = 0.33; // rad, of the viewer
const THICKNESS_M = [0.19, 0.17, 0.15, 0.12, 0.115, 0.1]; // the housings of an arm of six joints that has the length ARM_LENGTH_M
const ARM_LENGTH_M = 1.18425; // the links of a UR10e
const USUAL_THICKNESS_M = 0.12; // of other arms
const TURNING = 0.02; // rad/s

/** Draw `arm` (the section of that name in the rig's frames) on a canvas. */
export function drawArm(canvas, arm) {
  const { pen, width, height } = clearCanvas(canvas);
  const paint = readColours();
  const frames = computeFrames(arm.geometry, arm.q_rad ?? arm.geometry.theta_rad.map(() => 0));
  const relativeLength = (arm.long_m || ARM_LENGTH_M) / ARM_LENGTH_M;
  const size = Math.min(width / 2.2, height / 1.6) / relativeLength; // pixels per metre
  const project = ([x, y, z]) => {
    const right = x * Math.cos(AZIMUTH) + y * Math.sin(AZIMUTH);
    const away = -x * Math.sin(AZIMUTH) + y * Math.cos(AZIMUTH);
    return {
      pixel: [width / 2 + size * right, height * 0.82 - size * (z * Math.cos(ELEVATION) + away * Math.sin(ELEVATION))],
      depth: away * Math.cos(ELEVATION) - z * Math.sin(ELEVATION),
    };
  };
  drawFloor(pen, paint, project);
  if (!arm.q_rad) return;
  drawShadow(pen, paint, frames, project, size);
  const fastest = findFastestJoint(arm.qd_rad_s);
  const parts = [makePlinth(paint, project, size)];
  const joints = frames.length - 1;
  const getThickness = (joint) => (joints === THICKNESS_M.length ? THICKNESS_M[Math.min(joint, joints - 1)] : USUAL_THICKNESS_M);
  for (let joint = 0; joint < joints; joint += 1) {
    const [from, to] = [frames[joint].origin, frames[joint + 1].origin];
    const thickness = size * (getThickness(joint) + getThickness(joint + 1)) * 0.42;
    for (const [start, end] of splitLink(frames[joint], from, to)) parts.push(makeLimb(paint, project, start, end, thickness));
    parts.push(makeKnuckle(paint, project, from, frames[joint].z, size * getThickness(joint) * 0.58, joint === fastest));
  }
  parts.push(...makeBoard(paint, project, frames[joints]));
  parts.sort((a, b) => b.depth - a.depth);
  for (const part of parts) part.draw(pen);
  if (fastest !== null) {
    const { pixel } = project(frames[fastest].origin);
    const degrees = (arm.qd_rad_s[fastest] * 180) / Math.PI;
    drawLabel(pen, paint, pixel, `${arm.joints[fastest]} ${formatSigned(degrees)} °/s`, width);
  }
}

/** Return the frames of the base and after each joint: origin and axes x, y, z in the base's frame. */
export function computeFrames(geometry, q) {
  let frame = { origin: [0, 0, 0], x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
  const frames = [frame];
  for (let i = 0; i < q.length; i += 1) {
    const angle = q[i] + geometry.theta_rad[i], twist = geometry.alpha_rad[i];
    const x = sum(scale(frame.x, Math.cos(angle)), scale(frame.y, Math.sin(angle)));
    const across = sum(scale(frame.x, -Math.sin(angle)), scale(frame.y, Math.cos(angle)));
    const origin = sum(frame.origin, sum(scale(frame.z, geometry.d_m[i]), scale(x, geometry.a_m[i])));
    frame = {
      origin,
      x,
      y: sum(scale(across, Math.cos(twist)), scale(frame.z, Math.sin(twist))),
      z: sum(scale(frame.z, Math.cos(twist)), scale(across, -Math.sin(twist))),
    };
    frames.push(frame);
  }
  return frames;
}

/** Split the link between two origins as the arm is built: first parallel to the joint's axis, then across it. */
function splitLink(frame, from, to) {
  const link = sum(to, scale(from, -1));
  const corner = sum(from, scale(frame.z, dot(link, frame.z)));
  return [[from, corner], [corner, to]].filter(([a, b]) => Math.hypot(...sum(b, scale(a, -1))) > 1e-3);
}

function findFastestJoint(speeds) {
  if (!speeds?.length) return null;
  const magnitudes = speeds.map(Math.abs);
  const fastest = magnitudes.indexOf(Math.max(...magnitudes));
  return magnitudes[fastest] > TURNING ? fastest : null;
}

function drawFloor(pen, paint, project) {
  pen.strokeStyle = paint.floor;
  pen.lineWidth = 1;
  for (let i = -4; i <= 4; i += 1) {
    const offset = i * 0.25;
    for (const [a, b] of [[[offset, -1, 0], [offset, 1, 0]], [[-1, offset, 0], [1, offset, 0]]]) {
      pen.beginPath();
      pen.moveTo(...project(a).pixel);
      pen.lineTo(...project(b).pixel);
      pen.stroke();
    }
  }
}

function drawShadow(pen, paint, frames, project, size) {
  pen.strokeStyle = paint.floor;
  pen.lineCap = "round";
  pen.lineJoin = "round";
  pen.lineWidth = size * 0.1;
  pen.beginPath();
  for (const { origin: [x, y] } of frames) pen.lineTo(...project([x, y, 0]).pixel);
  pen.stroke();
}

function makePlinth(paint, project, size) {
  const { pixel, depth } = project([0, 0, 0]);
  return {
    depth: depth + 1,
    draw(pen) {
      pen.fillStyle = paint["steel-edge"];
      pen.beginPath();
      pen.ellipse(pixel[0], pixel[1] + size * 0.01, size * 0.13, size * 0.07, 0, 0, 2 * Math.PI);
      pen.fill();
    },
  };
}

/** Make a tube between two points: a dark edge, the body, a light streak. */
function makeLimb(paint, project, from, to, thickness) {
  const [a, b] = [project(from), project(to)];
  return {
    depth: (a.depth + b.depth) / 2,
    draw(pen) {
      pen.lineCap = "round";
      for (const [colour, width, alpha] of [[paint["steel-edge"], thickness, 1], [paint.steel, thickness - 3, 1], ["#ffffff", thickness * 0.28, 0.35]]) {
        pen.strokeStyle = colour;
        pen.globalAlpha = alpha;
        pen.lineWidth = Math.max(1, width);
        pen.beginPath();
        pen.moveTo(...a.pixel);
        pen.lineTo(...b.pixel);
        pen.stroke();
      }
      pen.globalAlpha = 1;
    },
  };
}

/** Make a joint's cap, a disc across its axis; that of the turning joint is filled and has a ring. */
function makeKnuckle(paint, project, origin, axis, radius, turning) {
  const { pixel, depth } = project(origin);
  const tip = project(sum(origin, scale(axis, 0.1))).pixel;
  const [dx, dy] = [tip[0] - pixel[0], tip[1] - pixel[1]];
  const facing = project(scale(axis, 1)).depth;
  const squeeze = Math.max(0.25, Math.min(1, Math.abs(facing)));
  return {
    depth: depth - 0.05,
    draw(pen) {
      pen.fillStyle = turning ? paint.move : paint.panel;
      pen.strokeStyle = turning ? paint.ink : paint["steel-edge"];
      pen.lineWidth = turning ? 3 : 2;
      pen.beginPath();
      pen.ellipse(pixel[0], pixel[1], radius, radius * squeeze, Math.atan2(dy, dx) + Math.PI / 2, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
    },
  };
}

/** Make the sensor board on the flange, and the flange's three axes. */
function makeBoard(paint, project, flange) {
  const half = 0.055;
  const corner = (i, j) =>
    project(sum(flange.origin, sum(scale(flange.x, i * half), sum(scale(flange.y, j * half), scale(flange.z, 0.02)))));
  const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
  const middle = project(flange.origin);
  const plate = {
    depth: middle.depth - 0.06,
    draw(pen) {
      pen.fillStyle = paint.good;
      pen.strokeStyle = paint.ink;
      pen.lineWidth = 1.5;
      pen.beginPath();
      for (const { pixel } of corners) pen.lineTo(...pixel);
      pen.closePath();
      pen.fill();
      pen.stroke();
    },
  };
  const axes = [..."xyz"].map((axis) => {
    const end = project(sum(flange.origin, scale(flange[axis], 0.24)));
    return {
      depth: Math.min(middle.depth, end.depth) - 0.07,
      draw(pen) {
        pen.strokeStyle = pen.fillStyle = paint[axis];
        pen.lineWidth = 3;
        pen.beginPath();
        pen.moveTo(...middle.pixel);
        pen.lineTo(...end.pixel);
        pen.stroke();
        pen.font = `bold 14px ${FONT}`;
        pen.textAlign = "center";
        pen.textBaseline = "middle";
        const length = Math.hypot(end.pixel[0] - middle.pixel[0], end.pixel[1] - middle.pixel[1]) || 1;
        pen.fillText(axis, end.pixel[0] + (10 * (end.pixel[0] - middle.pixel[0])) / length, end.pixel[1] + (10 * (end.pixel[1] - middle.pixel[1])) / length);
      },
    };
  });
  return [plate, ...axes];
}

function drawLabel(pen, paint, pixel, text, width) {
  pen.font = `bold 15px ${FONT}`;
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  const wide = pen.measureText(text).width;
  const x = Math.min(Math.max(8, pixel[0] - wide / 2), width - wide - 8);
  const y = 16;
  pen.fillStyle = paint.move;
  pen.fillText(text, x, y);
  pen.strokeStyle = paint.move;
  pen.lineWidth = 1;
  pen.beginPath();
  pen.moveTo(pixel[0], y + 12);
  pen.lineTo(...pixel);
  pen.stroke();
}

export const formatSigned = (value, digits = 0) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(digits)}`;
const scale = (v, s) => v.map((component) => component * s);
const sum = (a, b) => a.map((component, i) => component + b[i]);
const dot = (a, b) => a.reduce((total, component, i) => total + component * b[i], 0);
