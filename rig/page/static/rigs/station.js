// A station: the present part, the tray, and the present question, which a scanner or a keyboard answers.

import { connected, followSections, isSilent, SIGNS, WORDS } from "./live.js";
import { act, token } from "./stream.js";

const $ = (id) => document.getElementById(id);
let question = null; // the present one
let isOver = false; // the station has ended, and with it the page's server

const makeElement = (name, text, set = {}) => Object.assign(document.createElement(name), { textContent: text ?? "" }, set);

function showPresent(section) {
  $("present").dataset.state = section.state;
  isOver = section.over;
  $("halt").hidden = isOver || !token;
  const verdict = !section.part && section.verdict; // it is shown until the next part begins
  $("present").dataset.verdict = verdict ? verdict[1] : "";
  $("part").textContent = verdict ? verdict[0] : section.part || "–";
  $("verdict").hidden = !verdict;
  $("verdict").textContent = verdict ? `${SIGNS[verdict[1]] ?? "·"} ${verdict[1].toUpperCase()}` : "";
  $("why").textContent = verdict ? section.why : "";
  $("truth").hidden = !(verdict && section.truth);
  $("truth").textContent = section.truth;
  const running = typeof section.fraction === "number";
  $("run").hidden = !running;
  if (running) $("done").value = section.fraction;
  $("rates").replaceChildren(...(running ? listRates(section) : []).map(([name, text, isSensor]) => {
    const pair = makeElement("div");
    if (isSensor) pair.dataset.sensor = name;
    pair.append(makeElement("dt", name), makeElement("dd", text));
    return pair;
  }));
  $("state").textContent = WORDS[section.state] ?? section.state;
  $("doing").textContent = [section.doing, !running && typeof section.left_s === "number" && `${Math.round(section.left_s)} s left`].filter(Boolean).join(", ");
  $("who").textContent = [section.operator, section.work_order && `order ${section.work_order}`].filter(Boolean).join(" · ");
  $("tags").replaceChildren(...(section.simulated ? [makeElement("span", "simulated", { className: "tag" })] : []));
  $("counts").textContent = Object.entries(section.counts ?? {}).map(([state, count]) => `${count} ${state}`).join(", ");
  $("tray").replaceChildren(...(section.parts ?? []).map(([serial, state]) => {
    const cell = makeElement("li");
    cell.dataset.is = state;
    cell.append(makeElement("strong", SIGNS[state] ?? "·"), makeElement("span", ` ${serial} `), makeElement("small", state));
    return cell;
  }));
}

/** Return names and texts of what a run reports while it measures, and whether they are of a sensor. */
const listRates = ({ fraction, left_s: left, turn_deg_s: rate, sensors }) => [
  ["done", `${Math.round(fraction * 100)} %`], ...(typeof left === "number" ? [["left", `${Math.round(left)} s`]] : []),
  ["turning at", `${rate} °/s`], ...sensors.map(([name, samples, lost]) => [name, `${samples} samples, ${lost} lost`, true]),
];

function showQuestion(newQuestion) {
  question = newQuestion;
  $("ask").hidden = !question;
  if (!question) return;
  $("lines").replaceChildren(...question.lines.map((line) => makeElement("li", line)));
  $("text").textContent = question.text;
  $("said").value = "";
  $("hint").textContent = question.hint;
  $("clear").checked = false;
  $("agree").hidden = question.kind !== "go";
  $("buttons").replaceChildren(...question.choices.map(({ words, label }, index) => {
    const button = makeElement("button", label, { type: "button", className: index ? "quiet" : "go" });
    button.addEventListener("click", () => sendAnswer(words[0]));
    return button;
  }));
  enableGo();
  labelSend();
  focusField();
}

/** An empty answer to the question for a number ends the batch, so the button says that. */
function labelSend() {
  $("send").textContent = question?.kind === "number" && !$("said").value.trim() ? "End the batch" : "Enter";
}

/** Enable the button only after the tick; an operator who types "go" needs no tick. */
function enableGo() {
  const go = $("buttons").querySelector(".go");
  if (question?.kind === "go" && go) go.disabled = !$("clear").checked;
}

async function sendAnswer(text) {
  const answered = question;
  if (!answered) return;
  const reason = await act("say", { number: answered.number, text });
  if (reason && question === answered) $("hint").textContent = reason;
}

/** Keep the cursor in the field, because a scanner types at the cursor. */
const focusField = () => { if (question) $("said").focus(); };

function showConnection() {
  $("stale").hidden = isOver || (connected && !isSilent());
}

$("form").addEventListener("submit", (event) => {
  event.preventDefault();
  sendAnswer($("said").value.trim());
});
$("said").addEventListener("input", labelSend);
$("clear").addEventListener("change", () => { enableGo(); focusField(); });
document.addEventListener("keydown", (event) => {
  if (event.target === document.body && event.key.length === 1) focusField();
});
window.addEventListener("focus", focusField);
$("halt").hidden = !token;
$("halt").addEventListener("click", async () => {
  const reason = await act("stop");
  if (reason && !isOver) $("doing").textContent = reason;
});

const SHOW = { now: showPresent, asked: showQuestion };
followSections((section, content) => SHOW[section]?.(content), showConnection, () => isOver);
