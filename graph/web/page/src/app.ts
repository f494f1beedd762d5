// SPDX-License-Identifier: Apache-2.0
// What every view gets: the store, the link, and the way to another view.
import type { Link } from "./link.ts";
import type { Way } from "./protocol.ts";
import type { Store } from "./store.ts";

export interface App {
  store: Store;
  link: Link;
  /** Opens the robot view with this port. */
  look_at(port: string, way: Way): void;
  open(view: string): void;
}

/** One tab. `show` and `hide` are called when it comes to the front and leaves it. */
export interface View {
  name: string;
  title: string;
  root: HTMLElement;
  show(): void;
  hide(): void;
}

type Control = HTMLButtonElement | HTMLInputElement | HTMLSelectElement;

function apply(control: Control, why: string): void {
  control.disabled = why !== "";
  control.title = why === "" ? (control.dataset["title"] ?? "") : `Disabled: ${why}`;
}

/** Marks controls that change the run: they are disabled while that is not possible, and their tooltip says why. */
export function guard(store: Store, ...controls: Control[]): void {
  for (const control of controls) {
    control.dataset["changes"] = "";
    control.dataset["title"] = control.title;
    apply(control, store.why_not());
  }
}

/** Keeps all marked controls of the document up to date. Called once. */
export function keep_guards(store: Store): void {
  store.status.on(() => {
    const why = store.why_not();
    for (const control of document.querySelectorAll<Control>("[data-changes]")) apply(control, why);
    for (const reason of document.querySelectorAll("[data-why]"))
      reason.textContent = why === "" ? "" : `Read only: ${why}.`;
  });
}
