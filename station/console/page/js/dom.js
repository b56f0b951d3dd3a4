// Elements without markup strings: nothing that comes from a session can become HTML.

const SVG = "http://www.w3.org/2000/svg";
const DRAWN = new Set(["svg", "g", "path", "rect", "line", "circle", "text", "use", "polyline", "polygon", "title"]);

/**
 * An element: `on` has its listeners, `class`, `text` and attributes as they are named; false, null: left out.
 * @template {string} N
 * @param {N} name @param {Properties} [properties] @param {Content[]} children @returns {ElementOf<N>}
 */
export function h(name, properties = {}, ...children) {
  const element = DRAWN.has(name) ? document.createElementNS(SVG, name) : document.createElement(name);
  for (const [key, value] of Object.entries(properties)) set(element, key, value);
  const nodes = /** @type {(Node | string)[]} */ (children.flat(2).filter((child) => child !== null && child !== undefined && child !== false));
  element.append(...nodes);
  return /** @type {ElementOf<N>} */ (element);
}

/** Set one property of an element as `h` does. @param {Element} element @param {string} key @param {unknown} value */
export function set(element, key, value) {
  if (key === "on") for (const [event, act] of Object.entries(/** @type {object} */ (value))) element.addEventListener(event, act);
  else if (key === "text") setText(element, value);
  else if (value === false || value === null || value === undefined) element.removeAttribute(key);
  else element.setAttribute(key, value === true ? "" : String(value));
}

/** Change the text of an element, only when it differs: a live region speaks at every change. @param {Node} element @param {unknown} text */
export function setText(element, text) {
  if (element.textContent !== String(text)) element.textContent = String(text);
}

/** An icon of the set, for the eye only. @param {string} name */
export function icon(name) {
  return h("svg", { class: "icon", "aria-hidden": "true", focusable: "false", viewBox: "0 0 24 24" },
    h("use", { href: `/page/vendor/icons.svg#${name}` }));
}

/** Show another icon in an element made by `icon`. @param {Element} element @param {string} name */
export function setIcon(element, name) {
  set(element.firstElementChild, "href", `/page/vendor/icons.svg#${name}`);
}

/** A button with an icon, its text and the key that does the same. @param {string} text @param {ButtonOptions} [options] */
export function button(text, { icon: name, key, kind = "", click, label } = {}) {
  const element = h("button", { class: `button ${kind}`, type: "button", "aria-label": label, title: label,
    on: { click: releasing(click) } },
    name ? icon(name) : null, text ? h("span", { class: "button-text", text }) : null,
    key ? h("kbd", { text: key, "aria-hidden": "true" }) : null);
  if (key) element.setAttribute("aria-keyshortcuts", key === "␣" ? "Space" : key === "↵" ? "Enter" : key);
  return element;
}

/** After a click by hand nothing keeps the focus: the foot-switch's blank is to shoot, not to press this once more. @param {(event: MouseEvent) => unknown} act */
export function releasing(act) {
  return (/** @type {MouseEvent} */ event) => {
    if (event.detail > 0) /** @type {HTMLElement} */ (event.currentTarget).blur();
    act?.(event);
  };
}

/** Enable a button or say why it is off; it stays in the order of the Tab key. @param {Element} element @param {string} reason */
export function able(element, reason) {
  set(element, "aria-disabled", reason ? "true" : null);
  set(element, "title", reason || element.getAttribute("aria-label"));
}

/** A group of buttons of which one is pressed. `pick` gets the chosen key. @param {string} label @param {Choice[]} choices @param {(key: string) => unknown} pick */
export function segmented(label, choices, pick) {
  const buttons = new Map(choices.map(([key, text, name]) => [key, h("button", { class: "segment", type: "button", title: name && text,
    on: { click: releasing(() => pick(key)) } }, name ? icon(name) : null, h("span", { text }))]));
  return {
    element: h("div", { class: "segments", role: "group", "aria-label": label }, [...buttons.values()]),
    show(/** @type {string} */ key) { for (const [one, element] of buttons) element.setAttribute("aria-pressed", String(one === key)); },
    offer(/** @type {string[]} */ keys) { for (const [one, element] of buttons) element.hidden = !keys.includes(one); },
  };
}

/** A picture of the console's own, drawn for an empty or a failed place, with what to do: a text, or elements. @param {string} picture @param {string} title @param {Content} text @param {Content[]} actions */
export function placeholder(picture, title, text, ...actions) {
  return h("div", { class: "placeholder" },
    h("img", { src: `/page/pictures/${picture}.svg`, alt: "", width: 168, height: 126 }),
    h("h2", { text: title }), text ? h("p", {}, text) : null,
    actions.length ? h("div", { class: "row" }, actions) : null);
}
