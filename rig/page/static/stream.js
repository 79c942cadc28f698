// The event stream, read by fetch because EventSource cannot carry a token, and the requests that make the rig act.

const SILENT_MS = 15000; // the server sends something every second; after this silence the page connects again
const REASONS = {
  403: "the address lacks its token: use the one that the terminal shows",
  503: "too many browsers are connected: close one, or use the address that the terminal shows",
};

export const token = window.location.hash.slice(1);
const headers = token ? { Authorization: `Bearer ${token}` } : {};

/** Follow the event stream until the run `isOver()`: call `receive(name, document)` for every event, `recordSignOfLife()` for
 * everything that arrives, and `setConnected(isConnected, reason)` when the connection changes. */
export async function follow(receive, setConnected, recordSignOfLife, isOver) {
  while (!isOver()) {
    const silence = new AbortController();
    let timer = null;
    let status = null;
    const restartTimer = () => {
      clearTimeout(timer);
      timer = setTimeout(() => silence.abort(), SILENT_MS);
    };
    try {
      restartTimer();
      const answer = await fetch("events", { headers, signal: silence.signal, cache: "no-store" });
      status = answer.status;
      if (answer.ok) {
        setConnected(true);
        await readEvents(answer.body, receive, () => { restartTimer(); recordSignOfLife(); });
      }
    } catch {
      // The connection is down: reported below, then tried again.
    }
    clearTimeout(timer);
    setConnected(false, REASONS[status]);
    if (status === 403) return; // another token comes with another address, which loads the page again
    if (!isOver()) await new Promise((resolve) => setTimeout(resolve, 1000));
  }
}

async function readEvents(body, receive, recordArrival) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    recordArrival();
    rest += value;
    let end = rest.indexOf("\n\n");
    while (end >= 0) {
      const event = rest.slice(0, end).split("\n");
      rest = rest.slice(end + 2);
      const name = event.find((line) => line.startsWith("event: "));
      const data = event.find((line) => line.startsWith("data: "));
      if (name && data) receive(name.slice(7), JSON.parse(data.slice(6)));
      end = rest.indexOf("\n\n");
    }
  }
}

/** Request an action of the server. Resolve to null, or to the reason if the server refuses. */
export async function act(path, document) {
  try {
    const body = document === undefined ? undefined : JSON.stringify(document);
    const answer = await fetch(path, { method: "POST", headers, body });
    return answer.ok ? null : (await answer.text()).trim() || `the rig answers ${answer.status}`;
  } catch {
    return "the rig does not answer";
  }
}
