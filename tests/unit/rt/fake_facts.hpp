// SPDX-License-Identifier: Apache-2.0
// A machine made of text, for the checks.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rt/machine/facts.hpp"

namespace takt::test {

struct FakeFacts final : machine::Facts {
  std::map<std::string, std::string> files;
  std::vector<int> cpus{0, 1};
  std::map<int, int64_t> limits;
  bool root = false;

  FakeFacts() { files["/sys/devices/system/cpu/online"] = "0-1\n"; }
  /// Adds files, or puts them in the place of those of the same path.
  void write(const std::map<std::string, std::string>& more) {
    for (const auto& [path, text] : more) files[path] = text;
  }
  std::optional<std::string> text(const std::string& path) const override {
    const auto it = files.find(path);
    return it == files.end() ? std::nullopt : std::optional(it->second);
  }
  std::vector<std::string> list(const std::string& folder) const override {
    const std::string prefix = folder.back() == '/' ? folder : folder + "/";
    std::vector<std::string> names;
    for (const auto& [path, unused] : files) {
      if (path.rfind(prefix, 0) != 0) continue;
      const std::string name = path.substr(prefix.size(), path.find('/', prefix.size()) - prefix.size());
      if (names.empty() || names.back() != name) names.push_back(name);
    }
    return names;
  }
  std::vector<int> allowed_cpus() const override { return cpus; }
  std::optional<int64_t> limit(int resource) const override {
    const auto it = limits.find(resource);
    return it == limits.end() ? std::nullopt : std::optional(it->second);
  }
  bool is_root() const override { return root; }
  std::string user() const override { return root ? "root" : "ada"; }
  std::string program() const override { return "/opt/takt"; }
};

}  // namespace takt::test
