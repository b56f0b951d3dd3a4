/** Types of the web interface's page. What the server answers has the shape of `answers.json`, which tests compare with it. */

type Answers = typeof import("./answers.json");
type State = Omit<Answers["state"], "recovery"> & { recovery: Recovery };
type Recovery = { resumed: number[]; completed: boolean; left: number; problem: Fault };
type Fault = { text: string; hint?: string; kinds?: string[] };
type Part = { part: string; name: string; label: string; side: string; tag: number };
type Row = Answers["row"] & { parts: Part[]; asks?: { part: string }[]; kept?: string[] };
type Picture = { event: number; layer: string; opacity?: number };
type PageLeaf = { part: string; prefix: string; failed: Fault; page_mm: number[]; page_px: number[]; dpi: number; layers: string[] };
type Finding = { name: string; value: number; unit: string; limits: number[]; level: string; less_is_worse: boolean; hint: string; same_as?: string; part?: string };
type Details = {
  leaves: PageLeaf[]; before: { event: number; leaves: PageLeaf[] }; checks: Finding[]; notes: { name: string; text: string }[];
  shots: unknown[]; events: { name: string; time: string; value: unknown }[]; files: { name: string; bytes: number }[];
};
type Run = { style: string; first: number; side: string; prefix: string; suffix: string; bracket: boolean; counted: boolean };
type SheetLeaf = {
  name: string; page: number; part: string; label: string; side: string; tag: number; left_out: boolean; missing: string[]; run: Run; same: string[];
  event: number; layer: string;
};
type ReviewLeaf = Omit<SheetLeaf, "run" | "same"> & {
  level: string; rank: number; width_mm: number; height_mm: number; sampling_ppi: number; dpi: number; checks: Finding[];
};
type Message = { key: string; text: string; page: number; at: string };
type Session = Answers["sessions"][number];
type JobResult = {
  valid: boolean; missing: string[]; files: number; bytes: number; folder: string; problems: (string | { path: string; text: string })[];
  set_aside: number | unknown[]; restored: number | unknown[]; report_url?: string;
};
type JobItem = { name: string; state: string; text: string };
type Job = {
  id: string; kind: string; state: string; stage: string; done: number; ended: string; error: Fault; result: JobResult; items: JobItem[];
  about: { session?: string; sessions?: string[]; format?: string };
};
type Setting = Omit<Answers["settings"][number]["settings"][number], "value" | "preset" | "choices"> & { value: unknown; preset: unknown; choices: unknown[] };
type Channels = { r: number[]; g: number[]; b: number[]; grey: number[] };
type Preview = Answers["preview"] & { histogram: Channels };
type Word = { text: string; x: number; y: number; w: number; h: number };
type Hit = { page: number; part: string; label: string; text: string; words: number[] };

/** Values of the fields of corrections by their paths, as `parts.left.turn`; and the table that holds them. */
type Fields = Record<string, any>;
type Edits = Record<string, any>;
type Source = { source: string; edits: Edits };
type PageEdits = Omit<Answers["edits"], "sources"> & { sources: Source[] };
type Layout = Answers["layout"];
type Shot = { key: string; width?: number; height?: number; dpi?: number; isScan?: boolean };

type Point = number[];
type Line = [Point[], string];
type Position = { x: number; y: number };
type Eye = { position: number[]; right: number[]; up: number[]; back: number[]; focal: number };
type Numbers = Float32Array | Uint32Array | Uint8Array | Uint16Array;
type Model = { texture?: string; strain_end?: number; arrays: Record<string, { values: any; shape: number[] }> };

type ElementOf<N> = N extends keyof HTMLElementTagNameMap ? HTMLElementTagNameMap[N]
  : N extends keyof SVGElementTagNameMap ? SVGElementTagNameMap[N] : Element;
type Events = GlobalEventHandlersEventMap & HTMLMediaElementEventMap;
type Listeners = { [E in keyof Events]?: (event: Events[E] & { currentTarget: HTMLElement; target: HTMLInputElement }) => unknown };
type Properties = { on?: Listeners; [name: string]: unknown };
type Content = Node | string | null | false | undefined | Content[];
type ButtonOptions = { icon?: string; key?: string; kind?: string; click?: (event: MouseEvent) => unknown; label?: string };
type DialogOptions = { ok?: string; send?: () => unknown; cancel?: string };
type Choice = [key: string, text: string, icon?: string];
type HeaderFields = Record<string, string>;
type ErrorAnswer = { key: string; text?: string; hint?: string; data?: any };
type StoreEvents = {
  state: State; rows: void; row: Row; selected: number; online: boolean; back: number; message: Message; preview: Preview; job: Job; sent: string;
  refused: import("../../station/console/page/js/api.js").ApiError;
};
type Mask = { what: string; polygon: Point[] };
type Offer = { path: string; value: any; isChosen?: boolean };
type Look = { uv?: Float32Array; image?: HTMLImageElement; colours?: Uint8Array; wire?: boolean };
