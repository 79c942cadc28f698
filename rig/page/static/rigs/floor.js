// The floor: several rigs, as recorded in a shared history. It decides nothing.

import { connected, followSections, isSilent, SIGNS, WORDS } from "./live.js";

const $ = (id) => document.getElementById(id);
const shown = {};
const RIG = "rig "; // the beginning of the name of a rig's section
const CONTROL = { in: "✓ in control", out: "✗ OUT OF CONTROL", "too few": "too few calibrations" };

const makeElement = (name, text, data = {}) => {
  const node = document.createElement(name);
  if (text !== undefined) node.textContent = text;
  Object.assign(node.dataset, data);
  return node;
};

function makeRow(cells, headings) {
  const node = makeElement("tr");
  node.append(...cells.map(([text, is], column) => makeElement("td", text, { label: headings[column], ...(is ? { is } : {}) })));
  return node;
}

const showRows = (id, list, listCells, textIfEmpty) => {
  const headings = [...$(id).closest("table").querySelectorAll("th")].map((heading) => heading.textContent);
  const empty = makeElement("tr");
  empty.append(Object.assign(makeElement("td", textIfEmpty), { colSpan: headings.length }));
  $(id).replaceChildren(...(list.length ? list.map((item) => makeRow(listCells(item), headings)) : [empty]));
};

function makeCard(section) {
  const node = makeElement("article", undefined, { state: section.state });
  node.className = "rig";
  const head = makeElement("h3");
  head.append(makeElement("span", section.rig), makeElement("span", WORDS[section.state] ?? section.state));
  const part = makeElement("p", section.part || "–");
  part.className = "part";
  const remaining = typeof section.left_s === "number" ? `, ${Math.round(section.left_s)} s left` : "";
  const doing = makeElement("p", `${section.doing ?? ""}${remaining}`);
  doing.className = "doing";
  const counts = Object.entries(section.counts ?? {}).map(([state, count]) => `${count} ${state}`).join(", ");
  const who = [section.operator, section.work_order && `order ${section.work_order}`, section.computer, section.at !== section.rig && `at ${section.at}`, section.simulated && "simulated"].filter(Boolean).join(" · ");
  const age = section.state === "dead" ? `last message ${section.age} · ` : "";
  const tray = makeElement("ul");
  tray.className = "tray";
  tray.append(...(section.parts ?? []).map(([serial, state], index) => {
    const cell = makeElement("li", SIGNS[state] ?? "·", { is: state });
    cell.title = `${serial}: ${state}`;
    cell.setAttribute("aria-label", `${index + 1}, ${serial}: ${state}`);
    return cell;
  }));
  node.append(head, part, doing, makeElement("small", `${age}${[counts, who].filter(Boolean).join(" · ")}`), tray);
  return node;
}

const SHOW = {
  history: ({ label }) => { $("history").textContent = label; },
  rigs({ count, more }) {
    $("no-rigs").hidden = count > 0;
    $("more-rigs").hidden = !more;
    $("more-rigs").textContent = `and ${more} more, whose last messages are older`;
  },
  unread(reason) {
    $("unread").hidden = !reason;
    $("unread").textContent = `The calibrations cannot be read: ${reason}`;
  },
  today: (list) => showRows("today", list, (item) => [
    [item.time], [item.rig], [item.serial], [item.sensor + (item.simulated ? " (simulated)" : "")], [item.verdict.toUpperCase(), item.verdict], [item.number],
  ], "Nothing was calibrated today."),
  standards: (list) => showRows("standards", list, (item) => [
    [item.rig], [CONTROL[item.control], item.control], [item.out.join(", ")], [item.standards.join(", ")],
  ], "No rig has a check standard."),
  recalls: (list) => showRows("recalls", list, (item) => [
    [item.day + (item.overdue ? " overdue" : ""), item.overdue ? "overdue" : ""], [item.serial], [item.sensor + (item.simulated ? " (simulated)" : "")], [item.parameter],
  ], "None."),
};

/** Insert or replace a rig's card in the order of the rigs; remove it if the content is null. */
function updateCard(name, section) {
  const number = Number(name.slice(RIG.length));
  while ($("rigs").children.length <= number) $("rigs").append(makeElement("div"));
  $("rigs").children[number].replaceWith(section === null ? makeElement("div") : makeCard(section));
}

function showConnection() {
  const historyFault = shown.history?.silent;
  const lost = isSilent() || (!connected && shown.history);
  $("stale").hidden = !historyFault && !lost;
  $("stale-words").textContent = lost ? "No news" : `The history does not answer (${historyFault})`;
}

followSections((section, content) => {
  shown[section] = content;
  if (section.startsWith(RIG)) updateCard(section, content);
  else SHOW[section]?.(content);
}, showConnection, () => false);
