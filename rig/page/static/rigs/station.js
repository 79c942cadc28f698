// A station: the part in hand, the tray, and the question of the moment, which a scanner or a keyboard answers.

import { live, SIGNS, silent, up, WORDS } from "./live.js";
import { act, token } from "./stream.js";

const $ = (id) => document.getElementById(id);
// What may be typed, beside the buttons that type it. A number that is scanned too early is no answer to any of these.
const ANSWERS = {
  mount: [["", "It is mounted"], ["no", "Put it aside"]],
  go: [["go", "Go"], ["no", "Do not start"]],
  doubt: [["yes", "Continue anyway"], ["no", "No"]],
  again: [["yes", "Again"], ["no", "Put it aside"]],
};
let asked = null;
let over = false; // the station has ended, and with it the page's server

const element = (name, text, set = {}) => Object.assign(document.createElement(name), { textContent: text ?? "" }, set);

function now(of) {
  $("present").dataset.state = of.state;
  over = of.over;
  $("halt").hidden = over || !token;
  $("part").textContent = of.part || "–";
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
  const choices = ANSWERS[question.kind] ?? [];
  $("lines").replaceChildren(...question.lines.map((line) => element("li", line)));
  $("text").textContent = question.text;
  $("said").value = "";
  $("hint").textContent = "";
  $("clear").checked = false;
  $("agree").hidden = question.kind !== "go";
  $("buttons").replaceChildren(...choices.map(([text, words], at) => {
    const button = element("button", words, { type: "button", className: at ? "quiet" : "go" });
    button.addEventListener("click", () => say(text));
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
  const allowed = (ANSWERS[question.kind] ?? []).map(([answer]) => answer);
  if (allowed.length && !allowed.includes(text.toLowerCase())) {
    $("said").value = "";
    $("hint").textContent = `"${text}" answers nothing here: ${allowed.map((answer) => answer || "Enter").join(" or ")}`;
    return;
  }
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
