// SPDX-License-Identifier: Apache-2.0
#include "nodes/drive_arbiter/vision_state.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace drive_arbiter;

class DriveArbiterNode final : public Node {
 public:
  void setup(Setup&) override { state_.reserve({0, 0, 1, kCharacters}); }

  void run(Job& job) override {
    const VisionState state = present();
    const auto driver = driver_of(state);
    VelocityCommand* velocity = velocity_.loan();
    DigitalState* refused = refused_.loan();
    TextStatus* told = state_.loan();
    if (!velocity || !refused || !told) return job.no_result();
    int64_t stamp_ns = job.release_ns();
    for (size_t i = 0; i < kDrivers; ++i) {
      const Input<VelocityCommand>& asked = *drivers_[i];
      if (asked.empty() || asked.stale()) continue;
      const VelocityCommand& wanted = *asked.newest();
      if (driver && i == static_cast<size_t>(*driver)) {
        *velocity = wanted;
        stamp_ns = asked.stamp_ns();
      } else if (wanted.speed_m_s != 0 || wanted.turn_rad_s != 0) {
        refused->levels |= 1u << i;
      }
    }
    velocity_.send(stamp_ns);
    refused->changed = refused->levels ^ refused_levels_;
    refused_levels_ = refused->levels;
    refused_.send(job.release_ns());
    const std::string_view word = kVisionStates[static_cast<size_t>(state)];
    told->text.resize(word.size());
    word.copy(told->text.data(), word.size());
    state_.send(job.release_ns());
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, said_, refused_levels_); }

 private:
  /// The word that was last understood; the parameter's while nobody says one.
  VisionState present() {
    const auto given = static_cast<VisionState>(initial_());
    if (wanted_.empty() || wanted_.stale()) return said_ = given;
    const auto word = wanted_.newest()->text.items();
    if (const auto state = vision_state({word.data(), word.size()})) said_ = *state;
    return said_;
  }

  static constexpr uint32_t kCharacters = 16;

  Input<VelocityCommand> client_{this, "client", "of the robot client; give the edge a max_age", Need::optional};
  Input<VelocityCommand> tracking_{this, "tracking", "of person_tracking; give the edge a max_age", Need::optional};
  Input<TextStatus> wanted_{this, "wanted", "search, pose or tracking, repeated; another word changes nothing",
                            Need::optional};
  Output<VelocityCommand> velocity_{this, "velocity", "what the base is to do: the driver's command, else 0 0"};
  Output<DigitalState> refused_{this, "refused", "who asked for speeds in vain; line 0: client, line 1: tracking"};
  Output<TextStatus> state_{this, "state", "search, pose or tracking"};
  Choice initial_{this,
                  "state",
                  "search",
                  {kVisionStates.begin(), kVisionStates.end()},
                  "who drives while nobody says `wanted`: the client, nobody, or tracking"};

  const std::array<const Input<VelocityCommand>*, kDrivers> drivers_{&client_, &tracking_};  ///< as Driver counts
  VisionState said_ = VisionState::search;
  uint32_t refused_levels_ = 0;
};

}  // namespace

void register_drive_arbiter(NodeTypes& types) {
  types.add<DriveArbiterNode>("drive_arbiter", Layer::processing,
                              "Who drives: the robot client, nobody or tracking, as the state of vision says");
}

}  // namespace takt
