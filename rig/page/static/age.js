// How old what the page shows is, and whether it may be trusted. Times by this browser's own clock, ms.

const STALE_MS = 2000; // frames come ten times a second while something moves, a sign of life else
export const ENDED = ["passed", "failed", "refused", "fault", "stopped"];
const TELLING = ["moving", "measuring", "resting"]; // states in which the arm is seen all the time

const now = () => performance.now();
let heard = now(); // anything
let news = null; // the arm and its readings
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

/** A frame came: all of it, with the arm as it was seen `age_s` before (null: never), or what has changed. */
export function take(name, frame) {
  if (name !== "all") news = frame.arm?.q_rad ? now() : news;
  else news = typeof frame.age_s === "number" ? now() - 1000 * frame.age_s : null;
}

/** What to say of it all: `lost` seconds without news that should have come (0: none), the readings' age in words ("": now). */
export function age(shown) {
  const kind = shown.state?.kind;
  if (ENDED.includes(kind)) return { over: true, lost: 0, words: shown.about?.replayed ? "as recorded last" : ended(shown.ended) };
  const missed = [now() - heard];
  if (news !== null && TELLING.includes(kind) && !shown.about?.replayed) missed.push(now() - news);
  const silent = Math.max(...missed);
  const old = news === null ? 0 : now() - news;
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
