// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <string_view>
#include <vector>

namespace takt::bench {

/// What else the machine does while something is measured. `idle`: nothing.
enum class Load { idle, cpu, memory, disk };
std::string_view to_string(Load load);

/// Child processes under the default policy, two of a kind: cpu: never sleep. memory: copy 64 MB to and fro. disk:
/// write 16 MB into an unlinked file of the current folder and wait until the disk has it. They end with this object,
/// and with the thread that made it.
class Burden {
 public:
  /// Throws CannotRun if there can be no such processes. The calling process must have no other threads.
  explicit Burden(Load load);
  ~Burden();
  Burden(const Burden&) = delete;
  Burden& operator=(const Burden&) = delete;
  /// Throws CannotRun if one of them has ended, so that nothing is called a load that was none.
  void check() const;

 private:
  void end();

  std::vector<pid_t> pids_;
};

}  // namespace takt::bench
