// The question before anything moves: what is asked, and whether it may be answered on this page.

import { token } from "./stream.js";

const $ = (id) => document.getElementById(id);

/** Show the question, or hide the box without one; a rig that `mayAnswer` takes an answer from a page with its token. */
export function prompt(asked, mayAnswer) {
  const box = $("prompt");
  const before = Number(box.dataset.number || 0);
  box.hidden = !asked;
  if (!asked) return;
  const answerable = mayAnswer && token !== "";
  $("prompt-words").replaceChildren(...asked.announcement.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  $("prompt-tick").textContent = asked.to_tick;
  $("yes").textContent = asked.to_do.charAt(0).toUpperCase() + asked.to_do.slice(1);
  $("prompt-answer").hidden = !answerable;
  $("prompt-elsewhere").hidden = answerable;
  $("prompt-elsewhere").textContent = mayAnswer
    ? "This address lacks its token: answer it on a page that has it." : "Answer it at the terminal, not here.";
  if (asked.number !== before) {
    box.dataset.number = asked.number;
    $("clear").checked = false;
    $("yes").disabled = true;
    $("prompt-title").focus();
  }
}

$("clear").addEventListener("change", () => { $("yes").disabled = !$("clear").checked; });
