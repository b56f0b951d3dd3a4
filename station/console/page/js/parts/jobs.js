// A job of the server: what it does, how far it is, what came out.

import { get, keyed, post } from "../api.js";
import { button, h, icon } from "../dom.js";
import { faultText } from "../faults.js";
import { bytes, number, percent, time } from "../format.js";
import { attempt } from "../store.js";
import { firstOf, t } from "../strings.js";

/** @type {Record<string, string>} */ const STATES = { waiting: "history", running: "refresh-cw", done: "circle-check", failed: "octagon-alert", cancelled: "x" };
/** @type {Record<string, string>} */ const LEVELS = { done: "green", failed: "red", cancelled: "amber" };

/** @param {Job} job */
function title(job) {
  const about = job.about ?? {};
  const sessions = [about.session ?? about.sessions ?? []].flat().join(", ");
  return [t(`job.${job.kind}`), about.format && t(`format.${about.format}`), sessions].filter(Boolean).join(" · ");
}

/** @param {Job} job @param {JobResult} result */
function exported(job, { valid, problems, missing, files, bytes: size, folder }) {
  const list = h("ul", { class: "downloads" });
  const load = async () => {
    const found = await attempt(() => get(`/api/jobs/${job.id}/files`));
    list.replaceChildren(...(found?.files ?? []).map((/** @type {{n: number, name: string, bytes: number}} */ file) => h("li", {},
      h("a", { class: "button", href: keyed(`/api/jobs/${job.id}/files/${file.n}`), download: file.name.split("/").pop() }, icon("download"),
        h("span", { class: "button-text", text: file.name })), h("span", { class: "soft", text: bytes(file.bytes) }))));
  };
  return [
    h("p", { class: "validated", "data-level": valid ? "green" : "red" }, icon(valid ? "package-check" : "octagon-alert"),
      h("strong", { text: t(valid ? "export.valid" : "export.invalid") }), h("span", { text: t("export.size", { n: number(files), size: bytes(size) }) })),
    h("p", { class: "soft path", text: folder }),
    problems?.length ? h("ul", { class: "problems" }, problems.map((one) => h("li", { text: one }))) : null,
    missing?.length ? h("p", {}, h("strong", { text: `${t("export.missing")} ` }), missing.join("; ")) : null,
    h("details", { on: { toggle: (event) => { if (/** @type {HTMLDetailsElement} */ (event.currentTarget).open && !list.firstChild) load(); } } }, h("summary", { text: t("export.files") }), list)];
}

/** @param {JobResult} result */
function verified({ files, problems }) {
  const level = problems.length ? "red" : "green";
  return [h("p", { class: "validated", "data-level": level }, icon(problems.length ? "octagon-alert" : "circle-check"),
    h("strong", { text: t(problems.length ? "verify.problems" : "verify.whole", { n: number(problems.length), files: number(files) }) })),
  problems.length ? h("ul", { class: "problems" }, problems.map((one) => h("li", { text: typeof one === "string" ? one : `${one.path}: ${one.text}` }))) : null];
}

/** @param {JobResult} result */
function restored(result) {
  const set = typeof result.set_aside === "number" ? result.set_aside : (result.set_aside ?? []).length;
  const good = typeof result.restored === "number" ? result.restored : (result.restored ?? []).length;
  return [h("p", { class: "validated", "data-level": set ? "amber" : "green" }, icon(set ? "triangle-alert" : "circle-check"),
    h("strong", { text: t("batch.result", { good: number(good), set: number(set) }) })),
  result.report_url ? h("a", { class: "button", href: keyed(result.report_url), target: "_blank" }, icon("download"), h("span", { class: "button-text", text: t("batch.report") })) : null];
}

/** @param {Job} job */
function outcome(job) {
  if (job.error) return [h("p", { class: "wrong" }, faultText(job.error))];
  if (!job.result) return [];
  if (job.kind === "export") return exported(job, job.result);
  if (job.kind === "verify") return verified(job.result);
  return job.kind === "batch" ? restored(job.result) : [];
}

/** @param {JobItem[]} items */
function queue(items) {
  /** @type {Record<string, number>} */ const order = { running: 0, failed: 1, waiting: 2, done: 3 };
  const sorted = [...items].sort((one, two) => (order[one.state] ?? 4) - (order[two.state] ?? 4));
  return h("details", { class: "queue", open: items.length < 12 }, h("summary", { text: t("batch.queue", { n: number(items.length) }) }),
    h("ul", {}, sorted.map((item) => h("li", { "data-state": item.state }, icon(STATES[item.state] ?? "history"),
      h("span", { text: item.name }), h("span", { class: "soft", text: item.text || firstOf([`state.${item.state}`], item.state) })))));
}

/** A card of a job; made anew when the job changes. @param {Job} job */
export function jobCard(job) {
  const busy = job.state === "running" || job.state === "waiting";
  const stage = job.stage ? firstOf([`stage.${job.stage}`], job.stage) : "";
  const words = [t(`state.${job.state}`), busy ? stage : "", busy && job.done !== null ? percent(job.done) : "", job.ended ? time(job.ended) : ""].filter(Boolean).join(" · ");
  const bar = busy ? h("progress", { max: 1, value: job.done ?? false, "aria-label": title(job) }) : null;
  return h("article", { class: "job", "data-job": job.id, "data-state": job.state },
    h("div", { class: "job-head", "data-level": LEVELS[job.state] }, icon(STATES[job.state]), h("div", {}, h("h3", { text: title(job) }), h("p", { class: "soft", text: words })),
      busy ? button(t("cancel"), { icon: "x", kind: "quiet", click: () => attempt(() => post(`/api/jobs/${job.id}/cancel`)) }) : null),
    bar, outcome(job), job.items?.length ? queue(job.items) : null);
}

/** The jobs of some kinds, newest first, and those that come; `element` follows the server by itself. */
export class JobList {
  /** @param {string[]} kinds @param {typeof import("../store.js").on} listen @param {() => HTMLElement} nothing */
  constructor(kinds, listen, nothing) {
    this.kinds = kinds;
    this.nothing = nothing;
    /** @type {Map<string, Job>} */ this.jobs = new Map();
    /** @type {Map<string, HTMLElement>} */ this.cards = new Map();
    this.element = h("section", { class: "jobs", "aria-label": t("jobs") });
    listen("job", (job) => this.put(job));
  }

  async load() {
    const found = await attempt(() => get("/api/jobs"));
    for (const job of [...(found?.jobs ?? [])].reverse()) this.put(job);
    if (!this.jobs.size) this.element.replaceChildren(this.nothing());
  }

  /** @param {Job} job */
  put(job) {
    if (!this.kinds.includes(job.kind)) return;
    if (!this.jobs.size) this.element.replaceChildren();
    const [before, card] = [this.cards.get(job.id), jobCard(job)];
    this.jobs.set(job.id, job);
    this.cards.set(job.id, card);
    if (before) before.replaceWith(card);
    else this.element.prepend(card);
  }
}
