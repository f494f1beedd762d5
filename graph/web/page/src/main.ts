// SPDX-License-Identifier: Apache-2.0
// Takt's live view: makes store, link and views, and connects.
import { type App, keep_guards } from "./app.ts";
import "./counters.ts";
import { Devices } from "./devices.ts";
import { Link } from "./link.ts";
import { Log } from "./log.ts";
import { Overview } from "./overview.ts";
import { Parameters } from "./parameters.ts";
import { Records } from "./records.ts";
import { Robot } from "./robot.ts";
import { fragment, Shell } from "./shell.ts";
import { Store } from "./store.ts";
import { Timeline } from "./timeline.ts";
import { Touch } from "./touch.ts";

function start(): void {
  const store = new Store();
  const link = new Link(store, fragment().get("token") ?? "");
  const app: App = {
    store,
    link,
    open: (view) => void shell.open_named(view),
    look_at: (port, way) => {
      shell.open_named("robot");
      robot.open(port, way);
    },
  };
  const robot = new Robot(app);
  const views = [
    new Overview(app),
    new Timeline(app),
    robot,
    new Devices(app),
    new Parameters(app),
    new Records(app),
    new Log(app),
    new Touch(app),
  ];
  const shell = new Shell(app, views);
  keep_guards(store);
  if (!shell.open_named(fragment().get("view") ?? "")) shell.open(0, false);
  // Another token in the address is another reader: all begins anew.
  let token = fragment().get("token") ?? "";
  addEventListener("hashchange", () => {
    const now = fragment().get("token") ?? "";
    if (now !== token) location.reload();
    else shell.open_named(fragment().get("view") ?? "");
    token = now;
  });
  link.connect();
}

start();
