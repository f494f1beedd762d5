// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <ctime>
#include <filesystem>
#include <string>

#include "graph/language/graph.hpp"
#include "hal/settings/json.hpp"

namespace takt::keys {

// What a folder of `takt keys` holds.
inline constexpr const char* kAuthority = "ca.pem";  ///< of the certificates, governance and permissions
inline constexpr const char* kCertificate = "certificate.pem";
inline constexpr const char* kPrivateKey = "key.pem";  ///< for its owner's eyes only
inline constexpr const char* kGovernance = "governance.p7s";
inline constexpr const char* kPermissions = "permissions.p7s";
inline constexpr const char* kNotes = "keys.json";  ///< KeyNotes

/// Whose keys they are, for messages: who is heard depends on the certificates alone.
struct KeyNotes {
  std::string graph, machine;  ///< no machine: those of the authority
  int domain = 0;
  std::time_t until = 0;
};
nlohmann::ordered_json to_json(const KeyNotes& notes);
/// Throws std::runtime_error with the file and what is wrong.
KeyNotes read_notes(const std::filesystem::path& folder);

/// The keys of one machine, looked at before its run begins.
///
///   const KeyCheck keys = check_keys("keys/robot", graph, std::time(nullptr));
///   if (!keys.problem.empty()) return refuse(keys.problem, kBadInput);
struct KeyCheck {
  std::string problem;  ///< with what to do; "": a run can use them
  std::string warning;  ///< they end soon
};
/// `graph`: the part of the machine that has them. Names the file at fault: missing, not to be read, readable for
/// others, of another machine, graph or domain, at an end.
KeyCheck check_keys(const std::filesystem::path& folder, const graph::GraphSpec& graph, std::time_t now);

}  // namespace takt::keys
