// SPDX-License-Identifier: Apache-2.0
// One question at a time in front of the page. Escape and Cancel close it; the focus goes back by itself.
import { type Child, h } from "./dom.ts";

/** Runs `act` on the button; a text that it gives is an error and stays in the dialog. */
export function ask_in_dialog(
  title: string,
  body: Child[],
  action: string,
  act: () => Promise<string>,
  kind = "",
): void {
  const error = h("p", { class: "error", role: "alert" });
  const go = h("button", { class: `main ${kind}`, type: "submit" }, action);
  const dialog = h("dialog", { "aria-labelledby": "dialog-title" });
  const cancel = h("button", { type: "button", click: () => dialog.close() }, "Cancel");
  const form = h(
    "form",
    {
      method: "dialog",
      submit: async (event: Event) => {
        event.preventDefault();
        go.disabled = true;
        const problem = await act();
        go.disabled = false;
        if (problem === "") dialog.close();
        error.textContent = problem;
      },
    },
    h("h2", { id: "dialog-title" }, title),
    ...body,
    error,
    h("div", { class: "buttons" }, cancel, go),
  );
  dialog.append(form);
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}
