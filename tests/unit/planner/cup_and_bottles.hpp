// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace takt::test {

/// The thesis's Fig. 5.8 and 5.9 as a network: an empty cup, a full bottle that is closed and one that is open, each at
/// a place such as "[1m, 0m]".
inline std::string cup_and_bottles(const std::string& cup, const std::string& closed, const std::string& open) {
  return R"(
takt_network: 1
attributes: {level: {kind: enumerated, words: [empty, full]}, closed: {kind: boolean}}
types: {cup: {attributes: [level]}, bottle: {attributes: [level, closed]}}
actions:
  open: {roles: {b: bottle}, cost: 4s, requires: {b.closed: true}, results: {b.closed: false}}
  fill: {roles: {c: cup, b: bottle}, cost: 6s, requires: {c.level: empty, b.level: full, b.closed: false},
         results: {c.level: full, b.level: empty}}
objects:
  cup_1: {type: cup, at: )" +
         cup + ", states: {level: empty}}\n  bottle_1: {type: bottle, at: " + closed +
         ", states: {level: full, closed: true}}\n  bottle_2: {type: bottle, at: " + open +
         ", states: {level: full, closed: false}}\n";
}

}  // namespace takt::test
