// Requests to the server, and the identity of this tab.

const TAB = "planish-tab";
const ENTRY = "planish-entry"; // kept for this address and port alone, where a cookie would go to every port
let tab = "";
let entry = { token: "", key: "" };

/** Take the token and the key that the link brought behind its `#`, or those that were kept. */
export function takeEntry() {
  const given = new URLSearchParams(location.hash.slice(1));
  if (given.has("token")) {
    localStorage.setItem(ENTRY, JSON.stringify({ token: given.get("token"), key: given.get("key") }));
    history.replaceState(null, "", location.pathname);
  }
  entry = JSON.parse(localStorage.getItem(ENTRY)) ?? entry;
}

/** An address with the key, for what a browser asks for by itself: pictures, files, the stream of events. @param {string} path */
export function keyed(path) {
  return `${path}${path.includes("?") ? "&" : "?"}key=${entry.key}`;
}

/** What went wrong with a request: `key` for the table of strings, `text` and `hint` as the server says them. */
export class ApiError extends Error {
  /** @param {number} status @param {ErrorAnswer} error */
  constructor(status, error) {
    super(error.text ?? error.key);
    this.status = status;
    this.key = error.key;
    this.text = error.text ?? "";
    this.hint = error.hint ?? "";
    this.data = error.data ?? {};
  }
}

/** The identity of this tab. */
export function tabId() {
  return tab;
}

/** Take an identity that no other tab has: a duplicated tab comes with a copy of its original's. */
export async function claimTab() {
  tab = sessionStorage.getItem(TAB) ?? crypto.randomUUID();
  while (!(await isMine(tab))) tab = crypto.randomUUID();
  sessionStorage.setItem(TAB, tab);
}

/** @param {string} id @returns {Promise<boolean>} */
function isMine(id) {
  if (!navigator.locks) return Promise.resolve(true);
  return new Promise((resolve) => {
    navigator.locks.request(`${TAB}-${id}`, { ifAvailable: true }, (lock) => {
      resolve(lock !== null);
      return lock ? new Promise(() => {}) : undefined; // held as long as the tab lives
    });
  });
}

/** @param {string} method @param {string} path @param {unknown} body @param {AbortSignal} signal @param {HeaderFields} more @returns {Promise<any>} */
async function request(method, path, body, signal, more = {}) {
  /** @type {HeaderFields} */ const headers = { ...more, "X-Planish-Tab": tab, Authorization: `Bearer ${entry.token}` };
  if (body !== undefined) headers["Content-Type"] = "application/json";
  let answer;
  try {
    answer = await fetch(path, { method, headers, body: body === undefined ? undefined : JSON.stringify(body), signal });
  } catch {
    throw new ApiError(0, { key: "offline" });
  }
  const found = await answer.json().catch(() => /** @type {any} */ (undefined)); // cut off: a connection that was lost, a wait that was over
  if (!answer.ok) throw new ApiError(answer.status, found?.error ?? { key: "fault" });
  if (found === undefined) throw new ApiError(0, { key: "offline" });
  return found;
}

export const get = (/** @type {string} */ path, /** @type {AbortSignal} */ signal = undefined) => request("GET", path, undefined, signal);
/** The same; null where the server refuses, or is not heard. @param {string} path */
export const getOrNull = (path) => get(path).catch(() => /** @type {any} */ (null));
export const post = (/** @type {string} */ path, /** @type {unknown} */ body = {}, /** @type {HeaderFields} */ headers = {}) => request("POST", path, body, undefined, headers);
export const put = (/** @type {string} */ path, /** @type {unknown} */ body, /** @type {HeaderFields} */ headers = {}) => request("PUT", path, body, undefined, headers);

/** The bytes of a file of the server. @param {string} path */
export async function getBytes(path) {
  const answer = await fetch(keyed(path)).catch(() => { throw new ApiError(0, { key: "offline" }); });
  if (!answer.ok) throw new ApiError(answer.status, (await answer.json().catch(() => ({}))).error ?? { key: "fault" });
  return answer.arrayBuffer();
}
