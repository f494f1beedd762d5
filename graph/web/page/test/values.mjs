// SPDX-License-Identifier: Apache-2.0
// Messages as the server tells their fields, for ports looked at as `value`.
import { detections, robot_at } from "./world.mjs";

function chars(text, length) {
  const codes = [...Buffer.from(text)];
  return [...codes, ...Array(length - codes.length).fill(0)];
}

const kThings = [
  [
    "cup_1",
    "mug",
    -1.8,
    3.3,
    0.85,
    0.94,
    [
      ["level", "full"],
      ["colour", "red"],
    ],
  ],
  ["table_1", "table", -1.7, 3.4, 0.4, 0.88, []],
  ["carton_1", "carton", 1.35, 2.65, 0.55, 0.71, [["open", "no"]]],
];

const kByType = {
  object_reports: () => ({
    in_map: 1,
    names: { size: kThings.length, first: kThings.map(([name, type]) => [...chars(name, 32), ...chars(type, 32)]) },
    places: {
      size: kThings.length,
      first: kThings.map(([, , x, y, z, score, own]) => [x, y, z, 0, score, own.length]),
    },
    attributes: {
      size: 3,
      first: kThings.flatMap((thing) => thing[6]).map(([name, value]) => [...chars(name, 32), ...chars(value, 32)]),
    },
  }),
  detections: (at_s) => ({
    image_width: 640,
    image_height: 480,
    searched: 1,
    boxes: { size: 2, first: detections(at_s) },
  }),
  stop_command: () => ({ reasons: 0, nearest_m: 1.42, scan_age_s: 0.021 }),
  task: () => ({ number: 4, text: "goal cup_1.level=full" }),
  requests: () => ({ wanted: { size: 1, first: [[...chars("laser_fusion", 30), 0, 1]] } }),
};

const kTexts = {
  "robot_client.speech": "I am going to fetch the cup. Shall I go on?",
  "robot_client.status": "DRIVE to table_1, 1.8 m left",
  "robot_client.plan": "drive table_1 (4.4 s)\nfill cup_1 bottle_2 (4.0 s)\ndrive person (5.2 s)",
};

export function value_of(port, at_s) {
  if (port.type === "text_status") return { text: kTexts[port.name] ?? "ready" };
  const robot = robot_at(at_s);
  return (
    kByType[port.type]?.(at_s) ?? {
      x_m: robot.x,
      y_m: robot.y,
      theta_rad: robot.yaw + Math.PI / 2,
      speed_m_s: 0.2,
      samples: { size: 40, first: [1, 2, 3, 4, 5, 6, 7, 8] },
    }
  );
}
