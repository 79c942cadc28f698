// The page: keeps what the rig tells and shows it. It decides nothing.

import { ENDED, age, hear, linked as lineIs, take as aged } from "./age.js";
import { act, follow, token } from "./stream.js";
import { drawArm } from "./arm.js";
import { hand } from "./hand.js";
import { outcome } from "./outcome.js";
import { prompt } from "./prompt.js";
import * as readings from "./readings.js";
import * as tables from "./tables.js";
import { colours, fresh } from "./drawing.js";

const $ = (id) => document.getElementById(id);
const shown = {};
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
    buttons();
    tell();
  },
  ended: tell,
  step(step) {
    if (!step) return;
    const over = ENDED.includes(shown.state?.kind);
    const counts = step.kind === "by_hand";
    const number = counts ? step.name : step.number ? `tep ${step.number} of ${step.count}` : `${step.count} steps`;
    $("left").textContent = clock(step.remaining_s);
    $("step-number").textContent = !step.number || counts ? number : over ? `It ended in s${number}` : `S${number}`;
    $("step-name").textContent = step.number && !counts && !["moving", "measuring", "resting"].includes(shown.state?.kind) ? step.name : "";
    const done = step.count ? (Math.max(0, step.number - 1) + (step.number ? step.fraction : 0)) / step.count : 0;
    const bar = $("bar");
    bar.setAttribute("aria-valuenow", Math.round(100 * done));
    bar.setAttribute("aria-valuetext", counts ? step.name : `step ${step.number} of ${step.count}, ${over ? "ended" : `${clock(step.remaining_s)} left`}`);
    drawBar(step);
  },
  arm(arm) {
    document.body.dataset.joints = arm.geometry.theta_rad.length; // a hand has none, and nothing of it is drawn
    if (!arm.geometry.theta_rad.length) return;
    $("arm-name").textContent = [arm.model, arm.serial_number, arm.host].filter(Boolean).join(" · ");
    $("missed").textContent = arm.missed ?? "not recorded";
    $("missed").className = arm.missed ? "odd-number" : "";
    if (!arm.q_rad) return;
    const current = arm.let_go || !past; // without news of an arm that moved, its present state is unknown
    const fast = Math.max(0, ...arm.qd_rad_s.map(Math.abs)) * 180 / Math.PI;
    const normal = (value, usual) => (current ? [value, value !== usual] : ["–", false]);
    const percentage = (value) => (current ? [`${Math.round(100 * value)} %`, value < 0.995] : ["–", false]);
    const ofController = arm.mode === undefined ? [] : [
      ["slider", percentage(arm.slider)], ["scaling", percentage(arm.scaling)], ["mode", normal(arm.mode, "running")],
      ["safety", normal(arm.safety, "normal")], ["program", [current ? arm.program : "–", arm.program === "paused"]],
    ];
    facts([["speed", [current ? `${fast.toFixed(1)} °/s` : "–", false]], ...ofController]);
    $("arm").parentElement.dataset.current = current ? "yes" : "no";
    tables.joints(arm, current);
    drawArm($("arm"), current ? arm : { ...arm, qd_rad_s: arm.q_rad.map(() => 0) });
  },
  sensors: tables.samples,
  observations: tables.observations,
  parameters: tables.parameters,
  checks(rows) {
    tables.checks(rows);
    failed(rows.filter((check) => !check.passed));
  },
  hand(section) {
    document.body.dataset.hand = section ? "yes" : "no";
    hand(section);
  },
  prompt: (asked) => prompt(asked, shown.about.may_answer),
  certificate: light,
  outcome: showOutcome,
  mounts: (lines) => $("mounts").replaceChildren(...lines.map((text) => Object.assign(document.createElement("li"), { textContent: text }))),
  since: showOutcome,
  next(step) {
    $("next").hidden = !step?.command;
    if (!step) return;
    $("next-words").textContent = step.words;
    $("next-command").textContent = step.command;
  },
  lines(lines) { // only what is new is added, for that is what a screen reader reads out
    const list = $("lines");
    const before = [...list.children];
    let gone = 0;
    while (before.slice(gone).some((item, i) => item.textContent !== lines[i])) gone += 1;
    for (const item of before.slice(0, gone)) item.remove();
    const added = lines.slice(before.length - gone);
    list.append(...added.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
    list.scrollTop = list.scrollHeight;
  },
};

const MENTIONED = 3; // failed checks in the first screen; the table has all

function failed(checks) {
  const more = checks.length > MENTIONED ? [`and ${checks.length - MENTIONED} more, below`] : [];
  const said = checks.slice(0, MENTIONED).map((c) => `✗ ${c.name} ${tables.plain(c.value)}, allowed ${tables.plain(c.limit)}${c.unit === "1" ? "" : ` ${c.unit}`}`);
  $("failed").replaceChildren(...[...said, ...more].map((text) => Object.assign(document.createElement("li"), { textContent: text })));
}

function showOutcome() {
  outcome($("found"), shown.outcome ?? [], shown.since);
  $("key").hidden = !shown.outcome?.length;
}

function facts(pairs) {
  $("arm-facts").replaceChildren(...pairs.map(([name, [text, odd]]) => {
    const pair = document.createElement("div");
    if (odd) pair.className = "odd";
    pair.append(Object.assign(document.createElement("dt"), { textContent: name }), Object.assign(document.createElement("dd"), { textContent: text }));
    return pair;
  }));
}

function clock(seconds) {
  const whole = Math.max(0, Math.ceil(seconds));
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60];
  const two = (number) => String(number).padStart(2, "0");
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

function drawBar({ number, count, fraction }) {
  const { pen, width, height } = fresh($("bar-canvas"));
  const paint = colours();
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

const ending = () => (!line.up ? "the run is over, and this is how it ended" : shown.ended && !shown.about?.replayed ? `the run ended at ${shown.ended.at}` : "the run is over");

let past = ""; // how old readings and arm are, in words; "" while they are of now

/** Who says in large what the run does: the rig, or, when the rig is silent, nobody. */
function tell() {
  const { lost, over, words } = age(shown);
  const kind = shown.state?.kind;
  if (shown.state) {
    const [word, sign] = lost ? ["No news", "⚠"] : WORDS[kind] ?? [kind, ""];
    const step = shown.step?.number && shown.step.kind !== "by_hand" && !over ? `, step ${shown.step.number} of ${shown.step.count}` : "";
    const text = lost ? `Heard last: ${WORDS[kind]?.[0] ?? kind}, ${shown.state.text}${step}` : shown.state.text;
    for (const [id, said] of [["state-word", word], ["sign", sign], ["state-text", text]]) if ($(id).textContent !== said) $(id).textContent = said;
    document.title = `${word} · ${shown.about?.procedure ?? "calibration rig"}`;
  }
  document.body.dataset.lost = lost ? "yes" : "no";
  $("stale").hidden = !lost;
  $("stale-for").textContent = lost ? ` for ${lost} s` : "";
  light();
  const was = past;
  past = lost && !words ? `${lost} s ago` : words;
  if (past === was) return;
  document.body.dataset.past = past ? "yes" : "no";
  for (const node of document.querySelectorAll(".age")) node.textContent = past;
  if (!past === !was) return;
  if (shown.arm) SHOW.arm(shown.arm);
  redraw();
}

const redraw = () => readings.redraw(shown.sensors, past, ENDED.includes(shown.state?.kind));

function take(name, news) {
  aged(news);
  readings.add(name, news.points);
  delete news.points;
  delete news.age_s;
  Object.assign(shown, news);
  tell();
  for (const [section, value] of Object.entries(news)) if (value !== undefined) SHOW[section]?.(value);
  if ("about" in news) buttons();
  redraw();
}

function buttons() {
  const over = ENDED.includes(document.body.dataset.kind);
  $("halt").hidden = over || token === "" || !shown.about || shown.about.replayed;
}

function say(text) {
  $("said").hidden = !text;
  $("said").textContent = text ?? "";
}

let line = { up: false, why: "connecting" };

function linked(up, why) {
  line = { up, why: up ? "connected" : why ?? "no connection: the values shown are old" };
  lineIs(up);
  if (!up && !shown.state) { // nothing has been shown that could be old
    $("sign").textContent = "⚠";
    $("state-word").textContent = "Not shown";
    $("state-text").textContent = why ?? "the rig does not answer";
  }
  if (up) $("halt").disabled = false;
  tell();
}

/** What is said of the line to the rig, in the header. */
function light() {
  const { lost, over } = age(shown);
  $("link").dataset.up = over ? "over" : line.up && !lost ? "yes" : "no";
  const words = over ? ending() : lost && line.up ? "no news" : line.why;
  if ($("link-words").textContent !== words) $("link-words").textContent = words;
  $("certificate").hidden = !shown.certificate || (over && !line.up); // which is served from there
  $("papers-path").textContent = shown.certificate ? `${shown.about?.folder}/certificate.html` : "";
  const any = shown.outcome?.length || shown.certificate || $("failed").children.length || !$("next").hidden;
  $("outcome").hidden = !over || !any;
}

$("halt").addEventListener("click", async () => {
  $("halt").disabled = true;
  say(await act("stop"));
  setTimeout(() => { $("halt").disabled = false; }, 3000);
});
for (const [id, agreed] of [["yes", true], ["no", false]]) {
  $(id).addEventListener("click", async () => say(await act("answer", { number: shown.prompt.number, agreed })));
}

const THEMES = ["as the system", "light", "dark"];
const system = window.matchMedia("(prefers-color-scheme: dark)");
let theme = 0;
function paint() {
  const dark = theme === 2 || (theme === 0 && system.matches);
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  $("theme-words").textContent = THEMES[theme];
  $("theme").setAttribute("aria-label", `Light or dark: ${THEMES[theme]}`);
  for (const section of ["arm", "step"]) if (shown[section]) SHOW[section](shown[section]);
  redraw();
}
$("theme").addEventListener("click", () => { theme = (theme + 1) % 3; paint(); });
system.addEventListener("change", paint);
window.addEventListener("resize", paint);
new ResizeObserver(redraw).observe($("readings"));
paint();
window.addEventListener("hashchange", () => window.location.reload()); // another run's token, in the same window
setInterval(tell, 250);
follow(take, linked, hear, () => ENDED.includes(document.body.dataset.kind));
