// A station: the part in hand, the tray, and the question of the moment, which a scanner or a keyboard answers.

import { live, SIGNS, silent, up, WORDS } from "./live.js";
import { act, token } from "./stream.js";

const $ = (id) => document.getElementById(id);
let asked = null;
let over = false; // the station has ended, and with it the page's server

const element = (name, text, set = {}) => Object.assign(document.createElement(name), { textContent: text ?? "" }, set);

function now(of) {
  $("present").dataset.state = of.state;
  over = of.over;
  $("halt").hidden = over || !token;
  const verdict = !of.part && of.verdict; // it stands until the next part begins
  $("present").dataset.verdict = verdict ? verdict[1] : "";
  $("part").textContent = verdict ? verdict[0] : of.part || "–";
  $("verdict").hidden = !verdict;
  $("verdict").textContent = verdict ? `${SIGNS[verdict[1]] ?? "·"} ${verdict[1].toUpperCase()}` : "";
  $("why").textContent = verdict ? of.why : "";
  $("truth").hidden = !(verdict && of.truth);
  $("truth").textContent = of.truth;
  const running = typeof of.fraction === "number";
  $("run").hidden = !running;
  if (running) $("done").value = of.fraction;
  $("rates").textContent = running ? [`${Math.round(of.fraction * 100)} %`, `turning at ${of.turn_deg_s} °/s`,
    ...of.sensors.map(([name, samples, lost]) => `${name}: ${samples} samples, ${lost} lost`)].join(" · ") : "";
  $("state").textContent = WORDS[of.state] ?? of.state;
  $("doing").textContent = [of.doing, typeof of.left_s === "number" && `${Math.round(of.left_s)} s left`].filter(Boolean).join(", ");
  $("who").textContent = [of.operator, of.work_order && `order ${of.work_order}`].filter(Boolean).join(" · ");
  $("tags").replaceChildren(...(of.simulated ? [element("span", "simulated", { className: "tag" })] : []));
  $("counts").textContent = Object.entries(of.counts ?? {}).map(([state, count]) => `${count} ${state}`).join(", ");
  $("tray").replaceChildren(...(of.parts ?? []).map(([serial, state]) => {
    const cell = element("li");
    cell.dataset.is = state;
    cell.append(element("strong", SIGNS[state] ?? "·"), element("span", ` ${serial} `), element("small", state));
    return cell;
  }));
}

function ask(question) {
  asked = question;
  $("ask").hidden = !question;
  if (!question) return;
  $("lines").replaceChildren(...question.lines.map((line) => element("li", line)));
  $("text").textContent = question.text;
  $("said").value = "";
  $("hint").textContent = question.hint;
  $("clear").checked = false;
  $("agree").hidden = question.kind !== "go";
  $("buttons").replaceChildren(...question.choices.map(({ words, label }, at) => {
    const button = element("button", label, { type: "button", className: at ? "quiet" : "go" });
    button.addEventListener("click", () => say(words[0]));
    return button;
  }));
  ready();
  focus();
}

/** Whoever presses the button has ticked first; whoever types "go" has typed it. */
function ready() {
  const go = $("buttons").querySelector(".go");
  if (asked?.kind === "go" && go) go.disabled = !$("clear").checked;
}

async function say(text) {
  const question = asked;
  if (!question) return;
  const why = await act("say", { number: question.number, text });
  if (why && asked === question) $("hint").textContent = why;
}

/** A scanner types where the cursor is: it stays in the field. */
const focus = () => { if (asked) $("said").focus(); };

function tell() {
  $("stale").hidden = over || (up && !silent());
}

$("form").addEventListener("submit", (event) => {
  event.preventDefault();
  say($("said").value.trim());
});
$("clear").addEventListener("change", () => { ready(); focus(); });
document.addEventListener("keydown", (event) => {
  if (event.target === document.body && event.key.length === 1) focus();
});
window.addEventListener("focus", focus);
$("halt").hidden = !token;
$("halt").addEventListener("click", async () => {
  const why = await act("stop");
  if (why && !over) $("doing").textContent = why;
});

const SHOW = { now, asked: ask };
live((section, content) => SHOW[section]?.(content), tell, () => over);
