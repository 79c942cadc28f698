// The stream of what is shown, read by fetch because EventSource can carry no token; and requests that act.

const SILENT_MS = 15000; // the server says something every second; after so long the line is made anew
const WHY = {
  403: "the address lacks its token: take the one the terminal shows",
  503: "too many browsers look on: close one, or take the address the terminal shows",
};

export const token = window.location.hash.slice(1);
const headers = token ? { Authorization: `Bearer ${token}` } : {};

/** Hand every event to `take(name, document)`, tell `hear()` of every sign of life, say to `linked(up, why)` whether the line
 * is up, until the run is `over()`. */
export async function follow(take, linked, hear, over) {
  while (!over()) {
    const silence = new AbortController();
    let timer = null;
    let status = null;
    const heard = () => {
      clearTimeout(timer);
      timer = setTimeout(() => silence.abort(), SILENT_MS);
    };
    try {
      heard();
      const answer = await fetch("events", { headers, signal: silence.signal, cache: "no-store" });
      status = answer.status;
      if (answer.ok) {
        linked(true);
        await read(answer.body, take, () => { heard(); hear(); });
      }
    } catch {
      // The line is down: said below, tried again.
    }
    clearTimeout(timer);
    linked(false, WHY[status]);
    if (status === 403) return; // another token comes with another address, and that loads the page anew
    if (!over()) await new Promise((again) => setTimeout(again, 1000));
  }
}

async function read(body, take, heard) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    heard();
    rest += value;
    let end = rest.indexOf("\n\n");
    while (end >= 0) {
      const event = rest.slice(0, end).split("\n");
      rest = rest.slice(end + 2);
      const name = event.find((line) => line.startsWith("event: "));
      const data = event.find((line) => line.startsWith("data: "));
      if (name && data) take(name.slice(7), JSON.parse(data.slice(6)));
      end = rest.indexOf("\n\n");
    }
  }
}

/** Ask the server to do something; resolves to null, or to why it did not. */
export async function act(path, document) {
  try {
    const body = document === undefined ? undefined : JSON.stringify(document);
    const answer = await fetch(path, { method: "POST", headers, body });
    return answer.ok ? null : (await answer.text()).trim() || `the rig answers ${answer.status}`;
  } catch {
    return "the rig does not answer";
  }
}
