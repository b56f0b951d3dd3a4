// One page or two of an opened book: whole, split, or one leaf.

import { get } from "../api.js";
import { h, segmented, setText } from "../dom.js";
import { present, sourceText } from "../corrections.js";
import { number } from "../format.js";
import { CorrectionTool } from "./tool.js";
import { t } from "../strings.js";

const KEYS = { 0: "whole", 1: "left", 2: "split", 3: "right" };
const CHOICES = ["whole", "left", "split", "right", "auto"];

export class LayoutTool extends CorrectionTool {
  constructor(draft) {
    const choice = segmented(t("tool.spine"), CHOICES.map((name) => [name, t(`layout.${name}`)]), (name) => this.propose({ layout: name }));
    const found = h("p", { class: "soft" });
    super(draft, { name: "spine", fields: ["layout"], otherwise: "preset", body: [choice.element, found] });
    Object.assign(this, { choice, foundText: found });
    for (const [key, name] of Object.entries(KEYS)) this.keys[key] = () => this.propose({ layout: name });
  }

  given(sources) {
    const { preset_layout: preset } = this.draft.base;
    const giving = sources.filter(({ edits }) => edits.layout || edits.spine).at(-1);
    if (giving) return giving.edits.layout ?? "split"; // a spine that was drawn splits the page
    return preset === "single" ? "whole" : preset;
  }

  state() {
    const [, source] = [present(this.draft.base, "layout"), present(this.draft.base, "spine")].find(([value]) => value) ?? ["", ""];
    return [t(`layout.${this.given(this.draft.base.sources)}`), sourceText(source || "preset")];
  }

  async start(row, part) {
    super.start(row, part);
    if (this.asked === row.capture) return;
    this.asked = row.capture;
    setText(this.foundText, "");
    const layout = await get(`/api/pages/${row.page}/layout`).catch(() => null);
    if (this.row !== row || !layout) return;
    const [left, right] = layout.widths_mm ?? [];
    setText(this.foundText, left === undefined ? t("layout.none")
      : t("layout.found", { left: number(left, 1), right: number(right, 1), sigma: number(layout.sigma_mm ?? 0, 1) }));
  }

  shown() {
    this.choice.show(this.value("layout"));
  }
}
