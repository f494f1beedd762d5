// SPDX-License-Identifier: Apache-2.0
// Makes elements. Text goes in as text nodes, never as HTML. Styles are set through element.style or classes, since the
// page's content policy forbids style attributes.
export type Child = Node | string | number | null | undefined | false;
type Attributes = Record<string, string | number | boolean | null | undefined | ((event: never) => void)>;

const kSvg = "http://www.w3.org/2000/svg";

function fill(element: Element, attributes: Attributes, children: Child[]): void {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name, value as EventListener);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    element.append(child instanceof Node ? child : String(child));
  }
}

/** h("button", {class: "small", click: () => ...}, "Stop"): function values are listeners. A button submits no form
 *  unless its type says so. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (tag === "button") element.setAttribute("type", "button");
  fill(element, attributes, children);
  return element;
}

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): SVGElementTagNameMap[K] {
  const element = document.createElementNS(kSvg, tag) as SVGElementTagNameMap[K];
  fill(element, attributes, children);
  return element;
}

/** Changes nothing if the text is the same: no layout, no announcement. */
export function set_text(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function set_class(element: Element, name: string): void {
  if (element.getAttribute("class") !== name) element.setAttribute("class", name);
}

export function set_attribute(element: Element, name: string, value: string): void {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

/** A section with a heading. */
export function card(title: string, ...children: Child[]): HTMLElement {
  const id = "card-" + title.toLowerCase().replace(/[^a-z]+/g, "-");
  return h("section", { class: "card", "aria-labelledby": id }, h("h2", { id }, title), ...children);
}

/** A table that scrolls sideways by itself where it has no room; then the keyboard reaches it. */
export function table_box(label: string, table: HTMLTableElement): HTMLElement {
  return h("div", { class: "table-box", tabindex: 0, role: "region", "aria-label": label }, table);
}

/** Columns whose title begins with ">" are aligned to the right, as numbers are. */
export function table(columns: string[], body: HTMLTableSectionElement): HTMLTableElement {
  const cells = columns.map((title) =>
    h("th", { scope: "col", class: title.startsWith(">") ? "num" : null }, title.replace(/^>/, "")),
  );
  return h("table", {}, h("thead", {}, h("tr", {}, ...cells)), body);
}
