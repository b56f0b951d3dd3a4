// The batch: whole volumes restored again while no one shoots, and their queue.

import { get, post } from "../api.js";
import { field } from "../dialog.js";
import { able, button, h, placeholder, setText } from "../dom.js";
import { number } from "../format.js";
import { JobList } from "../parts/jobs.js";
import { attempt, on, store } from "../store.js";
import { t } from "../strings.js";

/** The screen, made once. */
export default function batchScreen() {
  const chosen = new Set();
  const list = h("ul", { class: "choices" });
  const workers = h("input", { type: "number", min: 1, max: 64, step: 1, placeholder: t("batch.workers.auto"), inputmode: "numeric" });
  const count = h("p", { class: "soft", role: "status" });
  const jobs = new JobList(["batch"], on, () => placeholder("queue", t("batch.none"), t("batch.none.text")));
  const start = button(t("batch.start"), { icon: "play", kind: "primary", click: async () => {
    if (!chosen.size) return;
    const wanted = { sessions: [...chosen], ...(workers.value ? { workers: Number(workers.value) } : {}) };
    const job = await attempt(() => post("/api/batch", wanted));
    if (job) jobs.put(job);
  } });
  const showCount = () => {
    setText(count, t("batch.chosen", { n: number(chosen.size) }));
    able(start, chosen.size ? "" : t("batch.choose"));
  };
  const choice = (/** @type {Session} */ session) => {
    const open = session.name === store.state?.session?.name;
    const input = h("input", { type: "checkbox", id: `batch-${session.name}`, disabled: open || Boolean(session.problem), on: { change: () => {
      if (input.checked) chosen.add(session.name);
      else chosen.delete(session.name);
      showCount();
    } } });
    input.checked = chosen.has(session.name);
    return h("li", {}, h("label", { class: "check", for: input.id }, input, h("span", {}, h("strong", { text: session.title || session.name }),
      h("span", { class: "soft", text: ` ${t("session.pages.short", { n: number(session.pages) })}${open ? ` · ${t("batch.open")}` : ""}` }))));
  };
  const load = async () => {
    const sessions = (await attempt(() => get("/api/sessions")))?.sessions ?? [];
    for (const name of chosen) if (!sessions.some((/** @type {Session} */ one) => one.name === name)) chosen.delete(name);
    list.replaceChildren(...(sessions.length ? sessions.map(choice) : [h("li", { class: "soft", text: t("session.none") })]));
    showCount();
  };
  return { enter: () => Promise.all([load(), jobs.load()]),
    element: h("div", { class: "screen plain-screen" },
      h("div", { class: "screen-head" }, h("div", {}, h("h1", { text: t("screen.batch") }), h("p", { class: "soft", text: t("batch.text") }))),
      h("div", { class: "split" },
        h("section", { class: "box", "aria-label": t("batch.choose") }, h("h2", { text: t("batch.choose") }), list, field(t("batch.workers"), workers, t("batch.workers.hint")), count, start),
        h("div", {}, h("h2", { text: t("jobs") }), jobs.element))) };
}
