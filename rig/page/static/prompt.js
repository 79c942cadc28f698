// The question that the rig asks before anything moves, and whether this page may answer it.

import { token } from "./stream.js";

const $ = (id) => document.getElementById(id);

/** Show the question, or hide the box if there is none. With `mayAnswer` the rig accepts an answer from a page with its token. */
export function showPrompt(question, mayAnswer) {
  const box = $("prompt");
  const shownNumber = Number(box.dataset.number || 0);
  box.hidden = !question;
  if (!question) return;
  const answerable = mayAnswer && token !== "";
  $("prompt-words").replaceChildren(...question.announcement.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  $("prompt-tick").textContent = question.to_tick;
  $("yes").textContent = question.to_do.charAt(0).toUpperCase() + question.to_do.slice(1);
  $("prompt-answer").hidden = !answerable;
  $("prompt-elsewhere").hidden = answerable;
  $("prompt-elsewhere").textContent = mayAnswer
    ? "This address lacks its token: answer it on a page that has it." : "Answer it at the terminal, not here.";
  if (question.number !== shownNumber) {
    box.dataset.number = question.number;
    $("clear").checked = false;
    $("yes").disabled = true;
    $("prompt-title").focus();
  }
}

$("clear").addEventListener("change", () => { $("yes").disabled = !$("clear").checked; });
