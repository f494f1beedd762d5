// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <string_view>
#include <vector>

namespace takt::bench {

/// What else the machine does while something is measured.
enum class Load { idle, cpu, memory, disk };
std::string_view to_string(Load load);

/// Child processes under the default policy, two of a kind: cpu: never sleep. memory: copy 64 MB to and fro. disk:
/// write 16 MB into an unlinked file of the current folder and wait until the disk has it. They end with this object.
class Burden {
 public:
  explicit Burden(Load load);
  ~Burden();
  Burden(const Burden&) = delete;
  Burden& operator=(const Burden&) = delete;
  /// Throws CannotRun if one of them has ended, so that nothing is called a load that was none.
  void check() const;

 private:
  std::vector<pid_t> pids_;
};

}  // namespace takt::bench
