// SPDX-License-Identifier: Apache-2.0
#include "rt/sched/plan.hpp"

namespace takt {

std::string_view to_string(Policy policy) {
  switch (policy) {
    case Policy::deadline: return "deadline";
    case Policy::fixed: return "fixed";
    case Policy::cooperative: return "cooperative";
  }
  return "";
}

std::string_view to_string(Criticality criticality) { return criticality == Criticality::high ? "high" : "low"; }

std::string_view to_string(OnOverrun verb) {
  switch (verb) {
    case OnOverrun::proceed: return "continue";
    case OnOverrun::degrade: return "degrade";
    case OnOverrun::safe_stop: return "safe_stop";
  }
  return "";
}

std::string_view to_string(OnMiss verb) {
  switch (verb) {
    case OnMiss::proceed: return "continue";
    case OnMiss::skip: return "skip";
    case OnMiss::reuse_last: return "reuse_last";
    case OnMiss::safe_stop: return "safe_stop";
  }
  return "";
}

}  // namespace takt
