// What the pages of a station and of the floor have in common: sections as they come, and whether the line brings any.

import { follow } from "./stream.js";

const STALE_MS = 3000; // the server says something every second
const by = (id) => document.getElementById(id);
let heard = performance.now();

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
      by("link").dataset.up = is ? "yes" : "no";
      by("link-words").textContent = is ? "connected" : why ?? "not connected";
      tell();
    },
    () => { heard = performance.now(); tell(); },
    over,
  );
  setInterval(tell, 500);
}
