// Questions in front of the screen.

import { button, h } from "./dom.js";
import { t } from "./strings.js";

let count = 0;

/** Open a dialog with a title; `ok` with its text makes it a form, whose `send` closes it unless it gives false; `cancel`: the other button. @param {string} title @param {Content} content @param {DialogOptions} [options] */
export function openDialog(title, content, { ok, send, cancel = t(ok ? "cancel" : "close") } = {}) {
  count += 1;
  const name = `dialog-${count}`;
  const close = button(cancel, { click: () => dialog.close() });
  const form = h("form", { method: "dialog", on: { submit: async (event) => {
    event.preventDefault();
    if ((await send?.()) !== false) dialog.close();
  } } },
    h("h2", { id: name, text: title }), h("div", { class: "dialog-body" }, content),
    h("div", { class: "row end" }, close, ok ? h("button", { class: "button primary", type: "submit", text: ok }) : null));
  /** @type {HTMLDialogElement} */ const dialog = h("dialog", { "aria-labelledby": name, on: { close: () => dialog.remove() } }, form);
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}

/** A labelled field. @param {string} label @param {HTMLElement} input */
export function field(label, input, hint = "") {
  count += 1;
  input.id ||= `field-${count}`;
  const about = hint ? h("span", { class: "hint", id: `${input.id}-hint`, text: hint }) : null;
  if (about) input.setAttribute("aria-describedby", about.id);
  return h("div", { class: "field" }, h("label", { for: input.id, text: label }), input, about);
}
