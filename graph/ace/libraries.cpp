// SPDX-License-Identifier: Apache-2.0
#include <hwy/highway.h>

#include <opencv2/core/utility.hpp>

#include "graph/ace/ace_registry.hpp"

namespace takt {
namespace {

std::vector<std::string> vector_targets() {
  std::vector<std::string> names;  // a lower bit is a better target
  for (int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1)
    names.emplace_back(hwy::TargetName(left & -left));
  return names;
}

void leave_out_targets(size_t count) {
  for (; count > 0; --count) hwy::DisableTargets(hwy::SupportedTargets() & -hwy::SupportedTargets());
}

}  // namespace

void register_libraries(Registry& registry) {
  registry.vectors = {vector_targets, leave_out_targets};
  registry.before_jobs.push_back([] { cv::setNumThreads(1); });
}

}  // namespace takt
