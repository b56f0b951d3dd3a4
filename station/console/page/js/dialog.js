// Questions in front of the screen.

import { button, h } from "./dom.js";
import { t } from "./strings.js";

let count = 0;

/** Open a dialog with a title; `ok` with its text makes it a form, whose `send` closes it unless it gives false; `cancel`: the other button. */
export function openDialog(title, content, { ok, send, cancel = t(ok ? "cancel" : "close") } = {}) {
  const name = `dialog-${(count += 1)}`;
  const close = button(cancel, { click: () => dialog.close() });
  const form = h("form", { method: "dialog", on: { submit: async (event) => {
    event.preventDefault();
    if ((await send?.()) !== false) dialog.close();
  } } },
    h("h2", { id: name, text: title }), h("div", { class: "dialog-body" }, content),
    h("div", { class: "row end" }, close, ok ? h("button", { class: "button primary", type: "submit", text: ok }) : null));
  const dialog = h("dialog", { "aria-labelledby": name, on: { close: () => dialog.remove() } }, form);
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}

/** A labelled field: `make` gets its id. */
export function field(label, input, hint = "") {
  input.id ||= `field-${(count += 1)}`;
  const about = hint ? h("span", { class: "hint", id: `${input.id}-hint`, text: hint }) : null;
  if (about) input.setAttribute("aria-describedby", about.id);
  return h("div", { class: "field" }, h("label", { for: input.id, text: label }), input, about);
}
