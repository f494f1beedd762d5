// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "rt/msg/velocity_command.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

class CruiseNode final : public Node {
 public:
  void setup(Setup&) override {}
  void start(int64_t epoch_ns) override { epoch_ns_ = epoch_ns; }

  void run(Job& job) override {
    VelocityCommand* wanted = velocity_.loan();
    if (wanted == nullptr) return job.no_result();
    const int64_t since_ns = job.release_ns() - epoch_ns_;
    const bool drives = since_ns >= nanoseconds(from_()) && (until_() <= 0 || since_ns < nanoseconds(until_()));
    wanted->speed_m_s = drives ? speed_() : 0;
    wanted->turn_rad_s = drives ? turn_() : 0;
    velocity_.send(job.release_ns());
  }

  void remember(StateArchive&) override {}

 private:
  static int64_t nanoseconds(double seconds) { return std::llround(seconds * 1e9); }

  int64_t epoch_ns_ = 0;
  Output<VelocityCommand> velocity_{this, "velocity", "the wanted speeds, with every job; 0 0 while it does not drive"};
  Param<double> speed_{this, "speed", 0.4, {-1.4, 1.4}, "m/s", "along the driving direction"};
  Param<double> turn_{this, "turn", 0.0, {-2.0, 2.0}, "rad/s", "counter-clockwise from above"};
  Param<double> from_{this, "from", 0.0, {0.0, 86400.0}, "s", "drives from then on, since the epoch"};
  Param<double> until_{this, "until", 0.0, {0.0, 86400.0}, "s", "stands from then on; 0: never"};
};

}  // namespace

void register_cruise(NodeTypes& types) {
  types.add<CruiseNode>("cruise", Layer::storage, "Wants the same speeds all the time, whatever is in the way");
}

}  // namespace takt
