// What the pages of a station and of the floor share: words and signs, the sections as they arrive, and whether any arrive, light or dark.

import { follow } from "./stream.js";

const STALE_MS = 3000; // the server sends something every second
const $ = (id) => document.getElementById(id);
let lastNews = performance.now();

export const WORDS = {
  waiting: "◌ waits for a part", checking: "◌ checks", asking: "? asks", running: "◉ runs", solving: "Σ solves", refused: "⊘ refused",
  fault: "⚠ fault", stopped: "■ stopped", ended: "■ the batch has ended", dead: "⚠ no sign of life", unread: "? sends a state that this page cannot read",
};
export const SIGNS = { pass: "✓", fail: "✗", fault: "⚠", refused: "⊘", open: "◉" };
export let connected = false;
const system = window.matchMedia("(prefers-color-scheme: dark)");
const applyTheme = () => { document.documentElement.dataset.theme = system.matches ? "dark" : "light"; };
export const isSilent = () => performance.now() - lastNews > STALE_MS;

/** Call `receive` for every section that arrives, and `showConnection` twice a second, until the page's run `isOver()`. */
export function followSections(receive, showConnection, isOver) {
  follow(
    (name, frame) => {
      for (const [section, content] of Object.entries(frame)) receive(section, content);
      showConnection();
    },
    (isConnected, reason) => {
      connected = isConnected;
      $("link").dataset.up = connected ? "yes" : isOver() ? "over" : "no";
      $("link-words").textContent = connected ? "connected" : isOver() ? "the page has ended" : reason ?? "not connected";
      showConnection();
    },
    () => { lastNews = performance.now(); showConnection(); },
    isOver,
  );
  applyTheme();
  system.addEventListener("change", applyTheme);
  setInterval(showConnection, 500);
}
