// What the pages of a station and of the floor have in common: words and signs, sections as they come, and whether the line
// brings any.

import { follow } from "./stream.js";

const STALE_MS = 3000; // the server says something every second
const by = (id) => document.getElementById(id);
let heard = performance.now();

export const WORDS = {
  waiting: "◌ waits for a part", checking: "◌ checks", asking: "? asks", running: "◉ runs", solving: "Σ solves", refused: "⊘ refused",
  fault: "⚠ fault", stopped: "■ stopped", ended: "■ the batch has ended", dead: "⚠ no sign of life", unread: "? sends a state that this page cannot read",
};
export const SIGNS = { pass: "✓", fail: "✗", fault: "⚠", refused: "⊘", open: "◉" };
export let up = false;
export const silent = () => performance.now() - heard > STALE_MS;

/** Hand every section that comes to `take`, and `tell` of the line again and again, until it is `over()`. */
export function live(take, tell, over) {
  follow(
    (name, frame) => {
      for (const [section, content] of Object.entries(frame)) take(section, content);
      tell();
    },
    (is, why) => {
      up = is;
      by("link").dataset.up = is ? "yes" : over() ? "over" : "no";
      by("link-words").textContent = is ? "connected" : over() ? "the page has ended" : why ?? "not connected";
      tell();
    },
    () => { heard = performance.now(); tell(); },
    over,
  );
  setInterval(tell, 500);
}
