// The floor: several rigs, as a shared history records them. It decides nothing.

import { live, SIGNS, silent, up, WORDS } from "./live.js";

const $ = (id) => document.getElementById(id);
const shown = {};
const RIG = "rig "; // how the section of a rig begins
const CONTROL = { in: "✓ in control", out: "✗ OUT OF CONTROL", "too few": "too few calibrations" };

const element = (name, text, data = {}) => {
  const node = document.createElement(name);
  if (text !== undefined) node.textContent = text;
  Object.assign(node.dataset, data);
  return node;
};

function row(cells) {
  const node = element("tr");
  node.append(...cells.map(([text, is]) => element("td", text, is ? { is } : {})));
  return node;
}

const rows = (id, list, cells, none) => {
  const empty = element("tr");
  empty.append(element("td", none));
  $(id).replaceChildren(...(list.length ? list.map((item) => row(cells(item))) : [empty]));
};

function rig(of) {
  const node = element("article", undefined, { state: of.state });
  node.className = "rig";
  const head = element("h3");
  head.append(element("span", of.rig), element("span", WORDS[of.state] ?? of.state));
  const part = element("p", of.part || "–");
  part.className = "part";
  const left = typeof of.left_s === "number" ? `, ${Math.round(of.left_s)} s left` : "";
  const doing = element("p", `${of.doing ?? ""}${left}`);
  doing.className = "doing";
  const counts = Object.entries(of.counts ?? {}).map(([state, count]) => `${count} ${state}`).join(", ");
  const who = [of.operator, of.work_order && `order ${of.work_order}`, of.computer, of.at !== of.rig && `at ${of.at}`, of.simulated && "simulated"].filter(Boolean).join(" · ");
  const age = of.state === "dead" ? `last heard ${of.age} · ` : "";
  const tray = element("ul");
  tray.className = "tray";
  tray.append(...(of.parts ?? []).map(([serial, state], at) => {
    const cell = element("li", SIGNS[state] ?? "·", { is: state });
    cell.title = `${serial}: ${state}`;
    cell.setAttribute("aria-label", `${at + 1}, ${serial}: ${state}`);
    return cell;
  }));
  node.append(head, part, doing, element("small", `${age}${[counts, who].filter(Boolean).join(" · ")}`), tray);
  return node;
}

const SHOW = {
  history: ({ label }) => { $("history").textContent = label; },
  rigs({ count, more }) {
    $("no-rigs").hidden = count > 0;
    $("more-rigs").hidden = !more;
    $("more-rigs").textContent = `and ${more} more, heard from earlier than these`;
  },
  unread(why) {
    $("unread").hidden = !why;
    $("unread").textContent = `The calibrations cannot be read: ${why}`;
  },
  today: (list) => rows("today", list, (item) => [
    [item.time], [item.rig], [item.serial], [item.sensor + (item.simulated ? " (simulated)" : "")], [item.verdict.toUpperCase(), item.verdict], [item.number],
  ], "Nothing was calibrated today."),
  standards: (list) => rows("standards", list, (item) => [
    [item.rig], [CONTROL[item.control], item.control], [item.out.join(", ")], [item.standards.join(", ")],
  ], "No rig has a check standard."),
  recalls: (list) => rows("recalls", list, (item) => [
    [item.day + (item.overdue ? " overdue" : ""), item.overdue ? "overdue" : ""], [item.serial], [item.sensor + (item.simulated ? " (simulated)" : "")], [item.parameter],
  ], "None."),
};

/** Insert or replace a rig's card in the order of the rigs; remove it if the content is null. */
function updateCard(section, of) {
  const number = Number(section.slice(RIG.length));
  while ($("rigs").children.length <= number) $("rigs").append(element("div"));
  $("rigs").children[number].replaceWith(of === null ? element("div") : rig(of));
}

function tell() {
  const mute = shown.history?.silent;
  const lost = silent() || (!up && shown.history);
  $("stale").hidden = !mute && !lost;
  $("stale-words").textContent = lost ? "No news" : `The history does not answer (${mute})`;
}

live((section, content) => {
  shown[section] = content;
  if (section.startsWith(RIG)) updateCard(section, content);
  else SHOW[section]?.(content);
}, tell, () => false);
