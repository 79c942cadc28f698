// The page: it keeps the sections that the rig sends and shows them. It decides nothing.

import { assessAge, ENDED, recordAges, recordSignOfLife, setConnected } from "./age.js";
import { act, follow, token } from "./stream.js";
import { drawArm } from "./arm.js";
import { showHand } from "./hand.js";
import { showOutcome } from "./outcome.js";
import { showPrompt } from "./prompt.js";
import * as readings from "./readings.js";
import * as tables from "./tables.js";
import { clearCanvas, readColours } from "./drawing.js";

const $ = (id) => document.getElementById(id);
const shown = {}; // the newest content of every section
const WORDS = {
  connecting: ["Connecting", "…"], connected: ["Connected", "…"], ready: ["Ready", "■"], asking: ["Your answer is needed", "?"],
  moving: ["Moving", "➜"], measuring: ["Measuring", "◉"], resting: ["Resting", "‖"], by_hand: ["Your turn", "☞"], judging: ["Solving", "Σ"],
  passed: ["PASS", "✓"], failed: ["FAIL", "✗"], refused: ["Refused", "⊘"], fault: ["Fault", "⚠"], stopped: ["Stopped", "■"],
};

const SHOW = {
  about(about) {
    $("procedure").textContent = about.procedure;
    $("parts").textContent = [...new Set(Object.values(about.parts))].join(" · ");
    $("folder").textContent = about.folder;
    const tags = [about.replayed && "replay", about.simulated && "simulated"].filter(Boolean);
    $("tags").replaceChildren(...tags.map((text) => Object.assign(document.createElement("span"), { className: "tag", textContent: text })));
  },
  state({ kind }) {
    document.body.dataset.kind = kind;
    document.body.dataset.over = ENDED.includes(kind) ? "yes" : "no";
    if (shown.step) SHOW.step(shown.step);
    showButtons();
    showStatus();
  },
  ended: showStatus,
  step(step) {
    if (!step) return;
    const over = ENDED.includes(shown.state?.kind);
    const isByHand = step.kind === "by_hand";
    const number = isByHand ? step.name : step.number ? `tep ${step.number} of ${step.count}` : `${step.count} steps`;
    $("left").textContent = formatClock(step.remaining_s);
    $("step-number").textContent = !step.number || isByHand ? number : over ? `It ended in s${number}` : `S${number}`;
    $("step-name").textContent = step.number && !isByHand && !["moving", "measuring", "resting"].includes(shown.state?.kind) ? step.name : "";
    const done = step.count ? (Math.max(0, step.number - 1) + (step.number ? step.fraction : 0)) / step.count : 0;
    const bar = $("bar");
    bar.setAttribute("aria-valuenow", Math.round(100 * done));
    bar.setAttribute("aria-valuetext", isByHand ? step.name : `step ${step.number} of ${step.count}, ${over ? "ended" : `${formatClock(step.remaining_s)} left`}`);
    drawBar(step);
  },
  arm(arm) {
    document.body.dataset.joints = arm.geometry.theta_rad.length; // a hand has no joints, so nothing is drawn
    if (!arm.geometry.theta_rad.length) return;
    $("arm-name").textContent = [arm.model, arm.serial_number, arm.host].filter(Boolean).join(" · ");
    $("missed").textContent = arm.missed ?? "not recorded";
    $("missed").className = arm.missed ? "odd-number" : "";
    if (!arm.q_rad) return;
    const current = arm.let_go || !ageText; // without news of a moving arm its present state is unknown
    const speed_deg_s = Math.max(0, ...arm.qd_rad_s.map(Math.abs)) * 180 / Math.PI;
    const compareWith = (value, usual) => (current ? [value, value !== usual] : ["–", false]);
    const formatPercentage = (value) => (current ? [`${Math.round(100 * value)} %`, value < 0.995] : ["–", false]);
    const controllerFacts = arm.mode === undefined ? [] : [
      ["slider", formatPercentage(arm.slider)], ["scaling", formatPercentage(arm.scaling)], ["mode", compareWith(arm.mode, "running")],
      ["safety", compareWith(arm.safety, "normal")], ["program", [current ? arm.program : "–", arm.program === "paused"]],
    ];
    showArmFacts([["speed", [current ? `${speed_deg_s.toFixed(1)} °/s` : "–", false]], ...controllerFacts]);
    $("arm").parentElement.dataset.current = current ? "yes" : "no";
    tables.showJoints(arm, current);
    drawArm($("arm"), current ? arm : { ...arm, qd_rad_s: arm.q_rad.map(() => 0) });
  },
  sensors: tables.showSamples,
  observations: tables.showObservations,
  parameters: tables.showParameters,
  checks(rows) {
    tables.showChecks(rows);
    showFailedChecks(rows.filter((check) => !check.passed));
  },
  hand(section) {
    document.body.dataset.hand = section ? "yes" : "no";
    showHand(section);
  },
  prompt: (question) => showPrompt(question, shown.about.may_answer),
  certificate: showConnection,
  outcome: showResults,
  mounts: (lines) => $("mounts").replaceChildren(...lines.map((text) => Object.assign(document.createElement("li"), { textContent: text }))),
  since: showResults,
  next(step) {
    $("next").hidden = !step?.command;
    if (!step) return;
    $("next-words").textContent = step.words;
    $("next-command").textContent = step.command;
  },
  lines(lines) { // only new lines are added, because a screen reader reads out what is added
    const list = $("lines");
    const items = [...list.children];
    let dropped = 0;
    while (items.slice(dropped).some((item, i) => item.textContent !== lines[i])) dropped += 1;
    for (const item of items.slice(0, dropped)) item.remove();
    const added = lines.slice(items.length - dropped);
    list.append(...added.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
    list.scrollTop = list.scrollHeight;
  },
};

const MENTIONED = 3; // failed checks on the first screen; the table has all of them

function showFailedChecks(checks) {
  const more = checks.length > MENTIONED ? [`and ${checks.length - MENTIONED} more, below`] : [];
  const lines = checks.slice(0, MENTIONED).map((c) => `✗ ${c.name} ${tables.formatNumber(c.value)}, allowed ${tables.formatNumber(c.limit)}${c.unit === "1" ? "" : ` ${c.unit}`}`);
  $("failed").replaceChildren(...[...lines, ...more].map((text) => Object.assign(document.createElement("li"), { textContent: text })));
}

function showResults() {
  showOutcome($("found"), shown.outcome ?? [], shown.since);
  const models = [...new Set(shown.outcome?.map((row) => row.model).filter(Boolean))];
  $("models").textContent = models.length ? `${models.join("; ")}.` : "";
  $("key").hidden = !shown.outcome?.length;
}

function showArmFacts(pairs) {
  $("arm-facts").replaceChildren(...pairs.map(([name, [text, odd]]) => {
    const pair = document.createElement("div");
    if (odd) pair.className = "odd";
    pair.append(Object.assign(document.createElement("dt"), { textContent: name }), Object.assign(document.createElement("dd"), { textContent: text }));
    return pair;
  }));
}

function formatClock(seconds) {
  const total = Math.max(0, Math.ceil(seconds));
  const [hours, minutes] = [Math.floor(total / 3600), Math.floor(total / 60) % 60];
  const padTwo = (number) => String(number).padStart(2, "0");
  return hours ? `${hours}:${padTwo(minutes)}:${padTwo(total % 60)}` : `${minutes}:${padTwo(total % 60)}`;
}

function drawBar({ number, count, fraction }) {
  const { pen, width, height } = clearCanvas($("bar-canvas"));
  const paint = readColours();
  const wide = width / Math.max(1, count);
  const gap = wide > 8 ? 3 : 0;
  for (let i = 0; i < count; i += 1) {
    const part = i + 1 < number ? 1 : i + 1 === number ? fraction : 0;
    pen.fillStyle = paint.line;
    pen.fillRect(i * wide, 0, wide - gap, height);
    pen.fillStyle = paint.move;
    pen.fillRect(i * wide, 0, (wide - gap) * part, height);
  }
}

const describeEnd = () => (!connection.isUp ? "the run is over; this is its last state" : shown.ended && !shown.about?.replayed ? `the run ended at ${shown.ended.at}` : "the run is over");

let ageText = ""; // the age of the readings and the arm in words; "" while they are current

/** Show the state of the run in large letters, or that there is no news if the rig is silent. */
function showStatus() {
  const { lost, over, words } = assessAge(shown);
  const kind = shown.state?.kind;
  if (shown.state) {
    const [word, sign] = lost ? ["No news", "⚠"] : WORDS[kind] ?? [kind, ""];
    const step = shown.step?.number && shown.step.kind !== "by_hand" && !over ? `, step ${shown.step.number} of ${shown.step.count}` : "";
    const text = lost ? `Last message: ${WORDS[kind]?.[0] ?? kind}, ${shown.state.text}${step}` : shown.state.text;
    for (const [id, content] of [["state-word", word], ["sign", sign], ["state-text", text]]) if ($(id).textContent !== content) $(id).textContent = content;
    document.title = `${word} · ${shown.about?.procedure ?? "calibration rig"}`;
  }
  document.body.dataset.lost = lost ? "yes" : "no";
  $("stale").hidden = !lost;
  $("stale-for").textContent = lost ? ` for ${lost} s` : "";
  showConnection();
  const previous = ageText;
  ageText = lost && !words ? `${lost} s ago` : words;
  if (ageText === previous) return;
  document.body.dataset.past = ageText ? "yes" : "no";
  for (const node of document.querySelectorAll(".age")) node.textContent = ageText;
  if (!ageText === !previous) return;
  if (shown.arm) SHOW.arm(shown.arm);
  redraw();
}

const redraw = () => readings.redraw(shown.sensors, ageText, ENDED.includes(shown.state?.kind));

function receive(name, news) {
  recordAges(news);
  readings.addPoints(name, news.points);
  delete news.points;
  delete news.age_s;
  Object.assign(shown, news);
  showStatus();
  for (const [section, value] of Object.entries(news)) if (value !== undefined) SHOW[section]?.(value);
  if ("about" in news) showButtons();
  redraw();
}

function showButtons() {
  const over = ENDED.includes(document.body.dataset.kind);
  $("halt").hidden = over || token === "" || !shown.about || shown.about.replayed;
}

function showMessage(text) {
  $("said").hidden = !text;
  $("said").textContent = text ?? "";
}

let connection = { isUp: false, text: "connecting" };

function updateConnection(isUp, reason) {
  connection = { isUp, text: isUp ? "connected" : reason ?? "no connection: the values shown are old" };
  setConnected(isUp);
  if (!isUp && !shown.state) { // the page has not shown anything yet
    $("sign").textContent = "⚠";
    $("state-word").textContent = "Not shown";
    $("state-text").textContent = reason ?? "the rig does not answer";
  }
  if (isUp) $("halt").disabled = false;
  showStatus();
}

/** Show in the header the state of the connection to the rig. */
function showConnection() {
  const { lost, over } = assessAge(shown);
  $("link").dataset.up = over ? "over" : connection.isUp && !lost ? "yes" : "no";
  const words = over ? describeEnd() : lost && connection.isUp ? "no news" : connection.text;
  if ($("link-words").textContent !== words) $("link-words").textContent = words;
  $("certificate").hidden = !shown.certificate || (over && !connection.isUp); // the rig serves it
  $("papers-path").textContent = shown.certificate ? `${shown.about?.folder}/certificate.html` : "";
  const hasContent = shown.outcome?.length || shown.certificate || $("failed").children.length || !$("next").hidden;
  $("outcome").hidden = !over || !hasContent;
}

$("halt").addEventListener("click", async () => {
  $("halt").disabled = true;
  showMessage(await act("stop"));
  setTimeout(() => { $("halt").disabled = false; }, 3000);
});
for (const [id, agreed] of [["yes", true], ["no", false]]) {
  $(id).addEventListener("click", async () => showMessage(await act("answer", { number: shown.prompt.number, agreed })));
}

const THEMES = ["as the system", "light", "dark"];
const system = window.matchMedia("(prefers-color-scheme: dark)");
let theme = 0;
function applyTheme() {
  const dark = theme === 2 || (theme === 0 && system.matches);
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  $("theme-words").textContent = THEMES[theme];
  $("theme").setAttribute("aria-label", `Light or dark: ${THEMES[theme]}`);
  for (const section of ["arm", "step"]) if (shown[section]) SHOW[section](shown[section]);
  redraw();
}
$("theme").addEventListener("click", () => { theme = (theme + 1) % 3; applyTheme(); });
system.addEventListener("change", applyTheme);
window.addEventListener("resize", applyTheme);
new ResizeObserver(redraw).observe($("readings"));
applyTheme();
window.addEventListener("hashchange", () => window.location.reload()); // another run's token, in the same window
setInterval(showStatus, 250);
follow(receive, updateConnection, recordSignOfLife, () => ENDED.includes(document.body.dataset.kind));
