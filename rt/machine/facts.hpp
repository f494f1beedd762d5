// SPDX-License-Identifier: Apache-2.0
// What the kernel says of the machine. The checks see nothing else, so that tests bring a machine of their own.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace takt::machine {

class Facts {
 public:
  virtual ~Facts() = default;
  /// A small text file, unpacked if its name ends in .gz; nothing if it is not there or must not be read.
  virtual std::optional<std::string> text(const std::string& path) const = 0;
  /// Names in a folder, sorted; empty if it is not there.
  virtual std::vector<std::string> list(const std::string& folder) const = 0;
  /// CPUs that this process may use.
  virtual std::vector<int> allowed_cpus() const = 0;
  /// Soft limit of this process, e.g. of RLIMIT_NOFILE; nothing if it is unlimited.
  virtual std::optional<int64_t> limit(int resource) const = 0;
  virtual bool is_root() const = 0;
  virtual std::string user() const = 0;
  virtual std::string program() const = 0;  ///< path of the running program, for setcap
};

/// This machine, as the calling process sees it.
class SystemFacts final : public Facts {
 public:
  std::optional<std::string> text(const std::string& path) const override;
  std::vector<std::string> list(const std::string& folder) const override;
  std::vector<int> allowed_cpus() const override;
  std::optional<int64_t> limit(int resource) const override;
  bool is_root() const override;
  std::string user() const override;
  std::string program() const override;
};

/// Files up to this size are read whole; what is longer is cut.
inline constexpr size_t kLargestFact = 4 << 20;

}  // namespace takt::machine
