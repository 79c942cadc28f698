// The age of the values shown, and whether the rig still sends news. Times are of this browser's own clock, in ms.

const STALE_MS = 2000; // frames come ten times a second during motion, otherwise signs of life
export const ENDED = ["passed", "failed", "refused", "fault", "stopped"];
const ARM_IS_READ = ["moving", "measuring", "resting"]; // states in which the rig sends the arm's state continually

const now = () => performance.now();
let lastNews = now(); // of any kind
const newest = { arm: null, readings: null }; // the times of the newest values
let connected = false;

/** Record whether the page is connected to the rig. */
export function setConnected(isConnected) {
  connected = isConnected;
  if (isConnected) lastNews = now();
}

/** Record that the rig sent something, if only a sign of life. */
export function recordSignOfLife() {
  lastNews = now();
}

/** Record from a frame the ages of the newest state of the arm and of the newest readings, s; null if there are none. */
export function recordAges({ age_s: ages }) {
  for (const key of Object.keys(newest)) newest[key] = typeof ages[key] === "number" ? now() - 1000 * ages[key] : null;
}

/** Return `lost`, the seconds for which expected news is overdue (0: none), and `words`, the age of the values shown ("": current). */
export function assessAge(shown) {
  const kind = shown.state?.kind;
  if (ENDED.includes(kind)) return { over: true, lost: 0, words: shown.about?.replayed ? "at the end of the recording" : describeEnd(shown.ended) };
  const silences = [now() - lastNews];
  if (newest.arm !== null && ARM_IS_READ.includes(kind) && !shown.about?.replayed) silences.push(now() - newest.arm);
  const silence = Math.max(...silences);
  const oldest = Math.max(0, ...Object.values(newest).filter((time) => time !== null).map((time) => now() - time));
  return {
    over: false,
    lost: silence > STALE_MS || (!connected && shown.state) ? Math.max(1, Math.floor(silence / 1000)) : 0,
    words: oldest > STALE_MS ? `${formatDuration(oldest)} ago` : "",
  };
}

const describeEnd = (end) => (end?.seen_at ? `as at ${end.seen_at}` : ""); // without readings there is no age

function formatDuration(ms) {
  const s = Math.floor(ms / 1000);
  return s < 120 ? `${s} s` : `${Math.floor(s / 60)} min`;
}
