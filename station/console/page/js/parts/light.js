// Light and shadow of one part: kept as the scanner saw them, or removed.

import { segmented } from "../dom.js";
import { CorrectionTool } from "./tool.js";
import { t } from "../strings.js";

const KEYS = { 1: "keep", 2: "remove" };

export class LightTool extends CorrectionTool {
  /** @param {import("../draft.js").Draft} draft */
  constructor(draft) {
    const choice = segmented(t("tool.light"), Object.entries(KEYS).map(([key, name]) => [name, `${t(`light.${name}`)} (${key})`]),
      (name) => this.choose(name));
    super(draft, { name: "light", fields: ["part.settings.shading"], otherwise: "preset", body: [choice.element] });
    this.choice = choice;
    for (const [key, name] of Object.entries(KEYS)) this.keys[key] = () => this.choose(name);
  }

  /** @param {Source[]} sources @param {string} path */
  given(sources, path) {
    return super.given(sources, path) ?? this.draft.base.preset_shading;
  }

  /** @param {string} path */
  state(path) {
    const [, source] = super.state(path);
    return [t(`light.${this.given(this.draft.base.sources, path)}`), source];
  }

  /** @param {string} name */
  choose(name) {
    this.propose({ [this.paths[0]]: name });
  }

  /** @param {string} path @param {any} value */
  isSaved(path, value) {
    return super.isSaved(path, value) || (value !== null && value === this.given(this.draft.base.sources, path));
  }

  shown() {
    this.choice.show(this.value(this.paths[0]));
  }
}
