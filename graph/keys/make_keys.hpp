// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <ctime>
#include <filesystem>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/language/graph.hpp"

namespace takt::keys {

struct KeysFailure {
  std::string what;
  bool system = false;  ///< a program or the disk; else the input
};

/// Makes keys for all machines of a graph, with the program openssl:
///
///   const auto done = make_keys(graph, "keys", 1825, std::time(nullptr));
///
/// FOLDER/ca has the authority that all of them trust; whoever has its key can make more machines, so it stays where it
/// is made. FOLDER/MACHINE has what one machine needs, and goes to that machine only. What is there already stays as it
/// is: so a machine that is added gets keys that the others trust. Where the folder lies in a git tree, it gets a
/// .gitignore that keeps git from taking it. Returns a line for each thing that was done. Failure: no `machines`, keys
/// of another graph or domain are there, a machine name that is `ca`, openssl is missing or fails.
tl::expected<std::vector<std::string>, KeysFailure> make_keys(const graph::GraphSpec& graph,
                                                              const std::filesystem::path& folder, int days,
                                                              std::time_t now);

}  // namespace takt::keys
