// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>

#include "graph/attach/describe.hpp"
#include "graph/attach/endpoint.hpp"
#include "graph/attach/taps.hpp"

namespace takt::attach {

/// One who looks at a run for as long as he likes, over one connection in both directions. He says what he wants to
/// see,
///
///   {"add": "head_camera.pair", "every_ms": 60}    {"drop": "head_camera.pair"}    {"state_every_ms": 500}
///
/// and is sent the newest message of each such output, as a record packs it, and how the run stands:
///
///   {"message": "head_camera.pair", "sequence": 12, "stamp_ns": ..., "level": 0, "age_ms": 4.1, "bytes": 614437}
///   {"state": {...}, "epoch_ns": ..., "jobs": [...], "events": [...]}    {"error": "there is no output ..."}
///
/// What he does not read within a second ends the connection. On a thread of its own, which holds no lock of a job.
class Follow {
 public:
  Follow(const Subject& subject, Taps& taps, Connection& connection)
      : subject_(subject), taps_(taps), connection_(connection), jobs_(subject), events_(subject) {}
  /// Until the other side has gone, or `ending`.
  void run(const std::atomic<bool>& ending);

 private:
  struct Look {
    std::shared_ptr<Tap> tap;
    int64_t every_ns = 0, next_ns = 0;
    uint64_t seen = 0;
  };
  bool take_wish();
  bool add(const nlohmann::ordered_json& wish);
  bool send_messages(int64_t now_ns);
  bool send_state(int64_t now_ns);

  const Subject& subject_;
  Taps& taps_;
  Connection& connection_;
  JobsSince jobs_;
  EventsSince events_;
  std::map<size_t, Look> looks_;  ///< by port
  int64_t state_every_ns_ = 0, next_state_ns_ = 0;
};

/// Index of the output "NODE.PORT" in the plan, or why there is none.
tl::expected<size_t, std::string> find_port(const Plan& plan, const std::string& name);

}  // namespace takt::attach
