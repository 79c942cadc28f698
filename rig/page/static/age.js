// How old what the page shows is, and whether it may be trusted. Times by this browser's own clock, ms.

const STALE_MS = 2000; // frames come ten times a second while something moves, a sign of life else
export const ENDED = ["passed", "failed", "refused", "fault", "stopped"];
const TELLING = ["moving", "measuring", "resting"]; // states in which the arm is seen all the time

const now = () => performance.now();
let heard = now(); // anything
const came = { arm: null, readings: null }; // when the newest did
let up = false;

/** The line is up or down. */
export function linked(is) {
  up = is;
  if (is) heard = now();
}

/** Something came, if only a sign of life. */
export function hear() {
  heard = now();
}

/** Take from a frame the ages of the newest state of the arm and of the newest readings, s, null without any. */
export function take({ age_s: ages }) {
  for (const what of Object.keys(came)) came[what] = typeof ages[what] === "number" ? now() - 1000 * ages[what] : null;
}

/** What to say of it all: `lost` seconds without news that should have come (0: none), in words how old what is shown is ("": of now). */
export function age(shown) {
  const kind = shown.state?.kind;
  if (ENDED.includes(kind)) return { over: true, lost: 0, words: shown.about?.replayed ? "as recorded last" : ended(shown.ended) };
  const missed = [now() - heard];
  if (came.arm !== null && TELLING.includes(kind) && !shown.about?.replayed) missed.push(now() - came.arm);
  const silent = Math.max(...missed);
  const old = Math.max(0, ...Object.values(came).filter((when) => when !== null).map((when) => now() - when));
  return {
    over: false,
    lost: silent > STALE_MS || (!up && shown.state) ? Math.max(1, Math.floor(silent / 1000)) : 0,
    words: old > STALE_MS ? `${duration(old)} ago` : "",
  };
}

const ended = (when) => (when?.seen_at ? `as at ${when.seen_at}` : ""); // of nothing seen there is no age

function duration(ms) {
  const s = Math.floor(ms / 1000);
  return s < 120 ? `${s} s` : `${Math.floor(s / 60)} min`;
}
