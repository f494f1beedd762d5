// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "nodes/semantic/clock_generator.hpp"
#include "nodes/semantic/status_line.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace semantic;

class SemanticNode final : public Node {
 public:
  void setup(Setup& setup) override {
    offset_ns_ = setup.offset_ns;
    auto script = parse_script(script_());
    if (!script) throw SetupError("script: " + script.error());
    const auto idle = parse_node_list(idle_());
    if (!idle) throw SetupError("idle: " + idle.error());
    generator_ = ClockGenerator(std::move(*script), *idle, static_cast<uint8_t>(idle_every_()));
    requests_.reserve({0, 0, 1, static_cast<uint32_t>(std::max<size_t>(1, generator_.nodes()))});
    status_.reserve({0, 0, 1, kStatusCharacters});
  }

  void start(int64_t epoch_ns) override {
    if (requests_.handed_over()) first_ns_ = epoch_ns + offset_ns_;  // the script goes on, it does not begin anew
  }

  void run(Job& job) override {
    const int64_t now_ns = job.release_ns();
    if (!first_ns_) first_ns_ = now_ns;
    const bool stop_lost = stop_.connected() && (stop_.empty() || stop_.stale());
    const uint32_t stop_reasons = stop_.empty() ? 0 : stop_.newest()->reasons;
    generator_.update(now_ns - *first_ns_, stop_lost || stop_reasons != 0);

    Requests* requests = requests_.loan();
    TextStatus* status = status_.loan();
    if (!requests || !status) job.no_result();
    if (requests) {
      for (const Request& request : generator_.deviating()) requests->wanted.push_back(request);
      requests_.send(now_ns);
    }
    if (status) {
      status->text.resize(kStatusCharacters);
      status->text.resize(write_status(present(stop_reasons, stop_lost), status->text.items()).size());
      status_.send(now_ns);
    }
  }

 private:
  Status present(uint32_t stop_reasons, bool stop_lost) const {
    Status status{stop_reasons, stop_lost, generator_.deviating(), {}, {}, {}};
    if (!detections_.empty() && !detections_.stale()) status.objects = detections_.newest()->boxes.size;
    if (!obstacles_.empty() && !obstacles_.stale()) status.obstacle_m = way(*obstacles_.newest());
    if (!ground_.empty() && !ground_.stale()) status.ground_m = way(*ground_.newest());
    return status;
  }

  /// None where the message is not as large as it says.
  std::optional<double> way(const Grid& grid) const {
    if (grid.width < 0 || grid.height < 0 ||
        grid.cells.size != static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height))
      return std::nullopt;
    return free_way_m(grid, strip_);
  }

  static constexpr uint32_t kStatusCharacters = 240;

  Input<Detections> detections_{this, "detections", "objects seen", Need::optional};
  Input<Grid> ground_{this, "ground", "where the ground can be driven on; robot frame", Need::optional};
  Input<Grid> obstacles_{this, "obstacles", "obstacles around the robot; robot frame", Need::optional};
  Input<StopCommand> stop_{this, "stop", "while it says stop or is silent, the idle nodes are paced", Need::optional};
  Output<Requests> requests_{this, "requests", "nodes that are not to run at their full rate, with every job"};
  Output<TextStatus> status_{this, "status", "one line: what is stopped or paced, objects, way ahead"};
  Param<std::string> script_{this, "script", "", "",
                             "timed requests: \"5s stop object_detection; 10s pace ground_map 2\""};
  Param<std::string> idle_{this, "idle", "", "", "nodes that need not run at full rate while the robot is stopped"};
  Param<int> idle_every_{this,     "idle_every", 1,
                         {1, 255}, "",           "idle nodes run at every n-th release while the robot is stopped"};
  Param<double> strip_{this, "strip", 0.8, {0.1, 5.0}, "m", "width of the way ahead that the status tells of"};

  ClockGenerator generator_;
  int64_t offset_ns_ = 0;
  std::optional<int64_t> first_ns_;
};

}  // namespace

void register_semantic(NodeTypes& types) {
  types.add<SemanticNode>("semantic", Layer::processing, "Clock generator: starts, stops and paces the other nodes");
}

}  // namespace takt
