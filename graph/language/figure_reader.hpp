// SPDX-License-Identifier: Apache-2.0
// Reads what the figures of a run must be: alike in a graph's `expect` and in that of a fault scenario.
#pragma once
#include "graph/language/document.hpp"

namespace takt::graph {

/// The time at `pointer`, in ns, as it was written; nothing if it is absent or none (then reported, as `key`).
std::optional<int64_t> read_duration(const Document& document, const std::string& pointer, std::string_view key,
                                     std::vector<Problem>& problems);

/// What is wrong is appended to the problems; what the schema has reported is passed over. All of it outlives the
/// reader.
class FigureReader {
 public:
  /// What may be named.
  struct Names {
    std::string graph;
    std::vector<std::string> nodes, chains, modes;
  };
  FigureReader(const Document& document, const Names& names, std::vector<Problem>& problems)
      : document_(document), names_(names), problems_(problems) {}

  /// Of the map `expect`, which stands at /expect.
  void read(const nlohmann::json& expect, FigureExpectations& figures);
  /// The map `name` of it, by id. `bare` is the side that a number alone stands for; null: both. `what` are the ids.
  void read_bounds(const nlohmann::json& expect, const char* name, const std::vector<std::string>& valid,
                   const char* what, std::optional<double> Bound::*bare, std::map<std::string, Bound>& bounds);
  /// `time`: in ns.
  Bound read_bound(const nlohmann::json& value, const std::string& pointer, std::optional<double> Bound::*bare,
                   bool time = false);

 private:
  void read_modes(const nlohmann::json& expect, FigureExpectations& figures);
  void problem(const Position& at, std::string text) { problems_.push_back({at, std::move(text)}); }

  const Document& document_;
  const Names& names_;
  std::vector<Problem>& problems_;
};

}  // namespace takt::graph
