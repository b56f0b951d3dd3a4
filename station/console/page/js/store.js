// What the server said last, and what this tab looks at. Screens listen; nothing else is kept.

import { ApiError, get, getOrNull, keyed, post, tabId } from "./api.js";

const KEPT_MESSAGES = 200;
const LOOK_MS = 1000; // between two looks whether anything was heard
const QUIET_MS = { shooting: 4000, idle: 20_000 }; // without an event, until the server is asked: progress comes often
const ANSWER_MS = 4000; // for that answer
const BRIEF_MS = 2000; // a break that is not worth a word
const bus = new EventTarget();

/**
 * state: of /api/state. rows: page → row. selected: page looked at, null: the one that the keys act on. chosen: leaves on the contact sheet, by their names.
 * @type {{state: State, rows: Map<number, Row>, order: number[], selected: number, worstFirst: boolean, online: boolean, entered: boolean,
 *   messages: Message[], preview: Preview, sent: string, chosen: string[]}}
 */
export const store = {
  state: null, rows: new Map(), order: [], selected: null, worstFirst: false, online: false, entered: true,
  messages: [], preview: null, sent: null, chosen: [],
};
const heardAt = { event: Date.now(), look: Date.now(), lost: /** @type {number} */ (null) }; // lost: since when the station is not heard
let asking = false;
let received = 0; // states that came as events
/** @type {Map<number, Row>} */ let late = null; // rows that came as events while all rows are being loaded: newer than that answer may be

/** Call `act` at every event of that name. @template {keyof StoreEvents} E @param {E} name @param {(detail: StoreEvents[E]) => unknown} act */
export function on(name, act) {
  bus.addEventListener(name, (event) => act(/** @type {CustomEvent} */ (event).detail));
}

/** @template {keyof StoreEvents} E @param {E} name @param {StoreEvents[E]} [detail] */
function emit(name, detail) {
  bus.dispatchEvent(new CustomEvent(name, { detail }));
}

/** The page that is looked at and that actions name. */
export function current() {
  return store.rows.get(store.selected ?? store.state?.session?.current ?? null) ?? null;
}

/** Look at a page; null: at the one that was shot or changed last. @param {number} page */
export function select(page) {
  store.selected = page;
  emit("selected", page);
}

/** Pages in the order of the volume, or the worst first. */
export function sortRows(worstFirst = store.worstFirst) {
  store.worstFirst = worstFirst;
  const rows = [...store.rows.values()];
  rows.sort(worstFirst ? (one, two) => two.rank - one.rank || one.order - two.order : (one, two) => one.order - two.order);
  store.order = rows.map((row) => row.page);
  emit("rows");
}

/** Why this tab may not act now, as a key of the strings; empty when it may. */
export function hindrance() {
  const { state, online } = store;
  if (!online || !state) return "why.offline";
  if (!state.session) return "why.session";
  if (state.session.read_only) return "why.held";
  if (state.control.tab && state.control.tab !== tabId()) return "why.tab";
  return state.failed ? "why.failed" : "";
}

/** Have the server do an action; a refusal is shown as a notice. Returns whether it was taken. @param {string} action */
export async function press(action, more = {}) {
  store.sent = action;
  emit("sent", action);
  return (await attempt(() => post("/api/press", { action, ...more }))) !== null;
}

/** Await a request; a refusal is shown as a notice and gives null. @template T @param {() => Promise<T>} act @returns {Promise<T>} */
export async function attempt(act) {
  try {
    return await act();
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    emit("refused", error);
    return null;
  } finally {
    store.sent = null;
    emit("sent", null);
  }
}

/** Take control of the scanner from the other tab. */
export function takeControl() {
  return attempt(async () => setState(await post("/api/control", { tab: tabId(), take: true })));
}

/** Take over a state that a request answered with. @param {State} state */
export function setState(state) {
  const before = store.state;
  store.state = state;
  const another = before?.session?.name !== state.session?.name;
  const shooting = state.scanner?.busy === "capture" && before?.scanner?.busy !== "capture";
  if (another || shooting) store.selected = null; // what was chosen stays chosen until then: a key acts on it
  emit("state", state);
  if (before?.session?.current !== state.session?.current) emit("selected", store.selected);
  if (another) loadRows();
}

async function loadRows() {
  const newer = /** @type {Map<number, Row>} */ (new Map());
  late = newer;
  const all = store.state?.session ? await getOrNull("/api/pages") : null;
  if (late !== newer) return; // they are being loaded once more
  late = null;
  store.rows = new Map([...(all?.pages ?? []).map((/** @type {Row} */ row) => [row.page, row]), ...newer]);
  sortRows();
}

/** @param {Row} row */
function setRow(row) {
  const before = store.rows.get(row.page);
  late?.set(row.page, row);
  store.rows.set(row.page, row);
  if (before && before.order === row.order && before.rank === row.rank) emit("row", row);
  else sortRows();
}

/** Ask for the state. One that came as an event meanwhile is newer than the answer may be, and stays. @param {AbortSignal} [signal] */
async function loadState(signal) {
  const before = received;
  const state = await get("/api/state", signal);
  if (received === before) setState(state);
}

async function loadAll() {
  await loadState();
  await loadRows();
  store.preview = await getOrNull("/api/preview");
  emit("preview", store.preview);
}

/** Load everything, then follow the server's events; the browser connects again by itself. */
export async function follow() {
  await loadAll().catch(refuseEntry);
  if (!store.entered) return;
  const source = new EventSource(keyed(`/api/events?tab=${encodeURIComponent(tabId())}`));
  const heard = (/** @type {string} */ name, /** @type {(data: any) => unknown} */ act) => source.addEventListener(name, (event) => { listened(); act(JSON.parse(event.data)); });
  /** @type {string} */ let boot = null;
  heard("hello", (hello) => {
    if (boot !== hello.boot) loadAll().catch(refuseEntry); // the first time too: what happened since came as no event
    boot = hello.boot;
    setOnline(true);
  });
  heard("reset", () => loadAll().catch(refuseEntry));
  heard("state", (state) => { received += 1; setState(state); });
  heard("page", ({ page }) => setRow(page));
  heard("pages", loadRows);
  heard("message", addMessage);
  heard("preview", (preview) => { store.preview = preview; emit("preview", preview); });
  heard("job", (job) => emit("job", job));
  source.onerror = () => lost(source);
}

// The lines below a verdict are its lights, and the first line of a shift its keys: both are on the screen.
/** @param {Message} message */
function addMessage(message) {
  if (message.key === "title" || message.text.startsWith(" ")) return;
  store.messages = [{ ...message, at: new Date().toISOString() }, ...store.messages].slice(0, KEPT_MESSAGES);
  emit("message", message);
}

// A server that started again has a new token: the browser gives up on 401, and the reason is asked for.
/** @param {EventSource} source */
async function lost(source) {
  setOnline(false);
  if (source.readyState !== EventSource.CLOSED) return;
  await get("/api/state").catch(refuseEntry);
  if (store.entered) setTimeout(follow, 1000);
}

/** @param {import("./api.js").ApiError} error */
function refuseEntry(error) {
  if (error.status === 401) store.entered = false;
  setOnline(false);
}

/** @param {boolean} online */
function setOnline(online) {
  heardAt.lost ??= Date.now();
  const silent = Date.now() - heardAt.lost;
  if (online) heardAt.lost = null;
  store.online = online;
  emit("online", online);
  if (online && silent > BRIEF_MS) emit("back", silent);
}

function listened() {
  heardAt.event = Date.now();
  if (!store.online || heardAt.lost) setOnline(true);
}

async function ask() {
  asking = true;
  try {
    await loadState(AbortSignal.timeout(ANSWER_MS));
    listened();
  } catch (error) {
    heardAt.lost ??= heardAt.event;
    refuseEntry(error);
  }
  asking = false;
}

/** A station that stands still keeps its connection: one that was not heard for long is asked whether it is there. */
function look() {
  const [now, { state }] = [Date.now(), store];
  const still = now - heardAt.look - LOOK_MS; // this computer slept, or the browser
  heardAt.look = now;
  if (!store.entered || asking || !state) return;
  if (still > QUIET_MS.shooting && !document.hidden) heardAt.lost ??= now - still;
  const quiet = now - heardAt.event > (state.scanner.busy ? QUIET_MS.shooting : QUIET_MS.idle);
  if (quiet || heardAt.lost) ask();
}

setInterval(look, LOOK_MS);
document.addEventListener("visibilitychange", () => { heardAt.look = Date.now(); }); // hidden windows look less often
addEventListener("offline", () => setOnline(false));
addEventListener("online", ask);
