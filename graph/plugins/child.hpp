// SPDX-License-Identifier: Apache-2.0
// A command in a child process, so that a plug-in may do there what it likes: graph/plugins/plugins.hpp.
#pragma once
#include <sys/types.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "graph/language/registry.hpp"

namespace takt::plugin {

/// Carries out `command` in a child process and returns its exit code. SIGINT, SIGTERM, SIGHUP and SIGQUIT are passed
/// on; where one of them ends the child, it ends this process as well. A child that crashes, ends in the middle of the
/// command, or comes to no end in the setup of a node is an error on stderr with that node and the names of the
/// `plugins`, and exit code 2. Nothing that the child started outlives it. This process has one thread.
int in_child(Registry& registry, const std::vector<std::string>& plugins, const std::function<int()>& command);

/// While it lives, this process inherits what its children leave behind. At the end of its life, all children that came
/// since are ended and waited for. The process has one thread.
class Orphans {
 public:
  Orphans();
  ~Orphans() { bury(); }
  Orphans(const Orphans&) = delete;
  Orphans& operator=(const Orphans&) = delete;

 private:
  void bury() const;

  int inherited_before_ = 0;
  std::set<pid_t> others_;
};

}  // namespace takt::plugin
