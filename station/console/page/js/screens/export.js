// Delivery: a volume in one of the formats of archives, each checked by its validator.

import { get, post } from "../api.js";
import { field } from "../dialog.js";
import { able, button, h, icon, placeholder, set } from "../dom.js";
import { JobList } from "../parts/jobs.js";
import { attempt, on, store } from "../store.js";
import { t } from "../strings.js";

const FORMATS = [["bagit", "archive"], ["mets", "library-big"], ["iiif", "image"], ["pdf", "text-search"], ["tiff", "layers"], ["mesh", "box"]];

/** The screen, made once. */
export default function exportScreen() {
  let format = "bagit";
  const session = h("select", {});
  const url = h("input", { type: "url", placeholder: "https://…", maxlength: 500, autocomplete: "off" });
  const where = field(t("export.url"), url, t("export.url.hint"));
  const jobs = new JobList(["export"], on, () => placeholder("parcel", t("export.none"), t("export.none.text")));
  const cards = FORMATS.map(([name, picture]) => {
    const input = h("input", { type: "radio", name: "format", value: name, class: "unseen", on: { change: () => choose(name) } });
    return { name, input, card: h("label", { class: "format" }, input, icon(picture), h("span", {}, h("strong", { text: t(`format.${name}`) }), h("span", { class: "soft", text: t(`format.${name}.text`) }))) };
  });
  const choose = (/** @type {string} */ name) => {
    format = name;
    for (const { name: one, input, card } of cards) { input.checked = one === name; set(card, "data-chosen", one === name); }
    where.hidden = name !== "iiif";
  };
  const start = button(t("export.start"), { icon: "package-check", kind: "primary", click: async () => {
    if (!session.value || !url.reportValidity()) return;
    const job = await attempt(() => post("/api/export", { session: session.value, format, ...(format === "iiif" && url.value ? { url: url.value } : {}) }));
    if (job) jobs.put(job);
  } });
  const load = async () => {
    const sessions = ((await attempt(() => get("/api/sessions")))?.sessions ?? []).filter((/** @type {Session} */ one) => !one.problem && one.pages);
    const before = session.value || store.state?.session?.name;
    session.replaceChildren(...sessions.map((/** @type {Session} */ one) => h("option", { value: one.name, text: one.title || one.name })));
    if (sessions.some((/** @type {Session} */ one) => one.name === before)) session.value = before;
    able(start, sessions.length ? "" : t("export.empty"));
  };
  choose(format);
  return { enter: () => Promise.all([load(), jobs.load()]),
    element: h("div", { class: "screen plain-screen" },
      h("div", { class: "screen-head" }, h("div", {}, h("h1", { text: t("screen.export") }), h("p", { class: "soft", text: t("export.text") }))),
      h("div", { class: "split" },
        h("section", { class: "box", "aria-label": t("export.what") }, h("h2", { text: t("export.what") }), field(t("export.session"), session),
          h("fieldset", { class: "formats" }, h("legend", { text: t("export.format") }), cards.map(({ card }) => card)), where, start),
        h("div", {}, h("h2", { text: t("jobs") }), jobs.element))) };
}
