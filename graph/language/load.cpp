// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <tuple>

#include "graph/language/loader.hpp"
#include "graph/language/schema.hpp"

namespace takt::graph {

std::string to_string(const Position& at) {
  return at.line > 0 ? at.file + ":" + std::to_string(at.line) + ":" + std::to_string(at.column) : at.file;
}

std::string to_string(const Problem& problem) {
  const std::string& use = problem.position.use;
  return to_string(problem.position) + ": error: " + problem.text + (use.empty() ? "" : " (" + use + ")");
}

Loaded Loader::load(const std::filesystem::path& file) {
  spec_.file = file.string();
  std::error_code ignored;
  spec_.directory = std::filesystem::absolute(file, ignored).parent_path();
  read_files(file);
  if (graph_.root.is_object()) {
    read_graph();
    make_instances();
    check_profile_ids();
    spec_.profile = choose_profile();
    read_profile_set();
    read_robot();
    read_kept();
    read_set();
    read_params();
    read_devices();
    read_schedule();
    read_machines();
    make_parts();
    check_edges();
    check_chains();
    check_schedule();
    check_modes();
    check_machines();
    read_expect();
    read_record();
    read_web();
    read_asked();
    apply_mode();
    tell_what_is_not_enforced();
    if (problems_.empty()) choose_machine();
  }
  // By file (the graph first), then by place; what two stages found alike is said once.
  const auto key = [&](const Problem& p) {
    return std::tuple(p.position.file != graph_.file, p.position.file, p.position.line, p.position.column, p.text,
                      p.position.use);
  };
  std::sort(problems_.begin(), problems_.end(), [&](const Problem& a, const Problem& b) { return key(a) < key(b); });
  problems_.erase(std::unique(problems_.begin(), problems_.end(),
                              [&](const Problem& a, const Problem& b) { return key(a) == key(b); }),
                  problems_.end());
  Loaded result;
  if (problems_.empty()) result.graph = std::move(spec_);
  result.problems = std::move(problems_);
  return result;
}

Loaded load(const std::filesystem::path& file, const LoadOptions& options, const NodeTypes& types,
            const DeviceCatalogue& devices) {
  try {
    return Loader(options, types, devices).load(file);
  } catch (const std::exception& error) {
    const Position at{file.string(), 1, 1};
    Problem bug{at, "the loader failed (a bug of Takt): "};
    bug.text += error.what();
    Loaded result;
    result.problems.push_back(std::move(bug));
    return result;
  }
}

}  // namespace takt::graph
