// Requests to the server. Each carries the token, which stands behind # in the page's address and is never sent along with it.

/// What lets this page ask; each view has another.
export const token = location.hash.slice(1);
/// Tells this page from others at the same server.
export const client = Array.from(crypto.getRandomValues(new Uint8Array(8)), (b) => b.toString(16).padStart(2, "0")).join("");

/// What the server refused, in its own words.
export class Refused extends Error {
  constructor(status, words, key) {
    const named = !key || words.startsWith(key) || words.startsWith(key.replace(".", " "));
    super(named ? words : `${key}: ${words}`);
    this.status = status;
  }
}

/// Statuses of a view that has ended: no server, and one that knows another token.
export const GONE = 0, OTHER = 403;
const listeners = [];
/// When the server was last heard of, and who hears whether it is there: the status of each answer, 0 for none.
let heard = performance.now();
export const lastHeard = () => heard;
export const onAnswer = (listener) => listeners.push(listener);

/// The response to a request, if it is no refusal.
async function post(what, body, options = {}) {
  let response;
  try {
    response = await fetch(`/api/${what}`, {
      method: "POST",
      headers: { "Content-Type": "application/json", "X-Slicestack-Token": token },
      body: JSON.stringify(body),
      ...options,
    });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    listeners.forEach((listener) => listener(GONE));
    throw new Refused(GONE, "The view has ended: the command that started this page does not answer.");
  }
  heard = performance.now();
  listeners.forEach((listener) => listener(response.status));
  if (response.ok) return response;
  let told = {};
  try {
    told = await response.json();
  } catch {
    // No JSON: the status says it all.
  }
  if (response.status === OTHER) throw new Refused(OTHER, "This page belongs to an earlier view: open the new address, the whole line that the command printed.");
  throw new Refused(response.status, told.error ?? `the server answered with status ${response.status}`, told.key);
}

const json = async (what, body) => (await post(what, body)).json();

export const hasToken = token.length > 0;
export const open = () => json("open", {});
/// Asks whether the server is there, and nothing else.
export const here = () => post("here", {});
/// The scene with everything decided that `document` leaves open.
export async function resolve(document) {
  const found = await json("document", { document, trial: true });
  if (found.error) throw new Refused(400, found.error, found.key);
  return found;
}
export const preset = (document, name) => json("preset", { document, preset: name });
export const probe = (document, [width, height], [x, y]) => json("probe", { document, width, height, x, y });
export const command = (document, [width, height]) => json("command", { document, width, height });

/// A picture, and what the server says of it.
export async function frame(request, signal) {
  const response = await post("frame", { client, ...request }, { signal });
  const info = JSON.parse(response.headers.get("X-Frame") ?? "{}");
  return { blob: await response.blob(), info };
}

export async function thumbnail(document, name, size) {
  return (await post("thumbnail", { document, preset: name, size })).blob();
}

/// A file to keep: bytes, and the name that the server suggests.
export async function save(document, [width, height], format) {
  const response = await post("save", { document, width, height, format });
  return { blob: await response.blob(), name: response.headers.get("X-Name") ?? `slicestack.${format}` };
}

/// Tells that this page goes away.
export function close() {
  post("close", { client }, { keepalive: true }).catch(() => {});
}
