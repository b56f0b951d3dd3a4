// The sessions screen: today's and yesterday's volumes, a new one, and what was taken up after a crash.

import { get, post } from "../api.js";
import { field, openDialog } from "../dialog.js";
import { able, button, h, icon, placeholder, set, setText } from "../dom.js";
import { faultText } from "../faults.js";
import { day, number, time } from "../format.js";
import { errorText } from "../notices.js";
import { jobCard } from "../parts/jobs.js";
import { attempt, on, setState, store } from "../store.js";
import { t } from "../strings.js";

const NAME = "[A-Za-z0-9][A-Za-z0-9 ._\\-]{0,99}";

/** @param {string} screen */
function goTo(screen) {
  location.hash = `#/${screen}`;
}

/** @param {string} name */
async function open(name, more = {}) {
  goTo("sessions"); // what was recovered is shown here, until it has been read
  const state = await attempt(() => post(`/api/sessions/${encodeURIComponent(name)}/open`, more));
  if (!state) return;
  setState(state);
  if (!state.recovery) goTo("capture");
}

async function close() {
  const state = await attempt(() => post("/api/close"));
  if (state) setState(state);
}

/** A name for a folder out of a title: only what every file system takes. @param {string} title */
export function folderName(title) {
  return title.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase().replace(/ß/g, "ss").replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60);
}

/** @param {() => unknown} reload */
async function newSession(reload) {
  const found = await attempt(() => get("/api/presets"));
  if (!found) return;
  const title = h("input", { required: true, maxlength: 500, autocomplete: "off" });
  const name = h("input", { required: true, maxlength: 100, pattern: NAME, autocomplete: "off", spellcheck: "false" });
  const [project, organisation] = [h("input", { maxlength: 500 }), h("input", { maxlength: 500 })];
  const preset = h("select", {}, found.presets.map((/** @type {{name: string}} */ one) => h("option", { value: one.name, text: t(`preset.${one.name}`) })));
  let own = false;
  name.addEventListener("input", () => { own = true; });
  title.addEventListener("input", () => { if (!own) name.value = folderName(title.value); });
  const words = h("input", { type: "checkbox", id: "new-words", "aria-describedby": "new-words-hint" });
  const wrong = h("p", { class: "wrong", role: "alert" });
  openDialog(t("session.new"), [field(t("session.title"), title), field(t("session.name"), name, t("session.name.hint")),
    h("div", { class: "pair" }, field(t("session.project"), project), field(t("session.organisation"), organisation)),
    field(t("session.preset"), preset), h("label", { class: "check", for: "new-words" }, words, h("span", { text: t("session.words") })),
    h("p", { class: "hint", id: "new-words-hint", text: t("session.words.hint") }), wrong], { ok: t("session.create"), send: async () => {
    try {
      await post("/api/sessions", { name: name.value, title: title.value, project: project.value, organisation: organisation.value,
        preset: preset.value, words: words.checked });
    } catch (error) {
      setText(wrong, errorText(error));
      return false;
    }
    await open(name.value);
    reload();
    return true;
  } });
}

/** @param {Session} session @param {() => unknown} reload */
function row(session, reload) {
  const done = session.pages ? session.accepted / session.pages : 0;
  const actions = session.open
    ? [button(t("session.go"), { icon: "camera", kind: "primary", click: () => goTo("capture") }), button(t("session.close"), { icon: "x", click: async () => { await close(); reload(); } })]
    : session.problem ? [button(t("session.verify"), { icon: "list-checks", click: () => attempt(() => post(`/api/sessions/${encodeURIComponent(session.name)}/verify`)) })]
      : session.held_by ? [button(t("session.watch"), { icon: "eye", click: () => open(session.name, { read_only: true }) })]
        : [button(t("session.open"), { icon: "folder-open", click: () => open(session.name) }),
          button("", { icon: "list-checks", kind: "square quiet", label: t("session.verify"), click: () => attempt(() => post(`/api/sessions/${encodeURIComponent(session.name)}/verify`)) })];
  const state = session.open ? t("session.is.open") : session.held_by ? t("session.is.held", { who: session.held_by }) : "";
  return h("li", { class: "session", "data-open": session.open, "data-name": session.name },
    h("div", { class: "session-name" }, h("h3", { text: session.title || session.name }),
      h("p", { class: "soft", text: [session.project, session.name, t(`preset.${session.preset}`)].filter(Boolean).join(" · ") })),
    session.problem ? h("p", { class: "wrong" }, faultText(session.problem))
      : h("div", { class: "session-pages" }, h("p", {}, t("session.pages", { n: number(session.pages), accepted: number(session.accepted) })),
        h("progress", { max: 1, value: done, "aria-label": t("session.accepted") })),
    h("p", { class: "soft session-time" }, h("span", { text: time(session.changed) }), state ? h("span", { class: "tag", text: state }) : null),
    h("div", { class: "row end" }, actions));
}

/** @param {Session[]} sessions @param {() => unknown} reload */
function grouped(sessions, reload) {
  const days = new Map();
  for (const session of sessions) days.set(day(session.changed), [...(days.get(day(session.changed)) ?? []), session]);
  return [...days].map(([name, list]) => h("section", { class: "session-day" }, h("h2", { text: name }),
    h("ul", {}, list.map((/** @type {Session} */ session) => row(session, reload)))));
}

/** @param {Recovery} found @param {() => void} dismiss */
function recovery(found, dismiss) {
  const pages = found.resumed.join(", ");
  const lines = [
    ["circle-check", t("recovery.kept", { n: number(store.state.session?.pages ?? 0) })],
    ["circle-check", t(found.completed ? "recovery.completed" : "recovery.whole")],
    found.resumed.length ? [found.left ? "refresh-cw" : "circle-check", t(found.left ? "recovery.resumed" : "recovery.done", { pages, left: found.left })]
      : ["circle-check", t("recovery.nothing")]];
  const problem = found.problem ? h("li", {}, icon("octagon-alert"), h("span", {}, faultText(found.problem))) : null;
  return h("section", { class: "recovery", "aria-label": t("recovery.title") },
    h("img", { src: "/page/pictures/recovered.svg", alt: "", width: 168, height: 126 }),
    h("div", {}, h("h2", { text: t("recovery.title") }), h("p", { class: "soft", text: t("recovery.text") }),
      h("ul", {}, lines.map(([picture, text]) => h("li", {}, icon(picture), h("span", { text }))), problem),
      found.resumed.length ? h("progress", { max: found.resumed.length, value: found.resumed.length - found.left, "aria-label": t("recovery.progress") }) : null,
      h("div", { class: "row" }, button(t("recovery.go"), { icon: "camera", kind: "primary", click: () => { dismiss(); goTo("capture"); } }))));
}

/** The screen, made once. */
export default function sessionsScreen() {
  const [list, root] = [h("div", { class: "session-list" }), h("p", { class: "soft" })];
  const [recovered, checks] = [h("div"), h("div")];
  let dismissed = "";
  const key = () => `${store.state?.session?.name} ${JSON.stringify(store.state?.recovery?.resumed)}`;
  const showRecovery = () => {
    const found = store.state?.recovery;
    recovered.replaceChildren(found && dismissed !== key() ? recovery(found, () => { dismissed = key(); }) : "");
  };
  const load = async () => {
    const found = await attempt(() => get("/api/sessions"));
    if (!found) return;
    setText(root, found.root);
    list.replaceChildren(...(found.sessions.length ? grouped(found.sessions, load)
      : [placeholder("shelf", t("session.none"), t("session.none.text"), button(t("session.new"), { icon: "plus", kind: "primary", click: () => newSession(load) }))]));
  };
  const make = button(t("session.new"), { icon: "plus", kind: "primary", click: () => newSession(load) });
  const verified = new Map();
  on("job", (job) => {
    if (job.kind !== "verify") return;
    verified.set(job.id, job);
    checks.replaceChildren(...[...verified.values()].slice(-3).reverse().map(jobCard));
  });
  on("state", () => { showRecovery(); set(make, "aria-disabled", store.online ? null : "true"); });
  able(make, "");
  return { enter: () => { showRecovery(); return load(); },
    element: h("div", { class: "screen plain-screen" }, recovered,
      h("div", { class: "screen-head" }, h("div", {}, h("h1", { text: t("screen.sessions") }), root), make), checks, list) };
}
