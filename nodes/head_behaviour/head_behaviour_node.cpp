// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <vector>

#include "nodes/head_behaviour/eyelids.hpp"
#include "nodes/head_behaviour/gaze.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/pose.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace head_behaviour;

class HeadBehaviourNode final : public Node {
 public:
  void setup(Setup& setup) override {
    if (!bodies_.connected() && !person_.connected())
      throw SetupError("connect `bodies` or `person`, or both: the robot looks at people");
    gaze_.emplace(GazeParameters{});
    blinker_ = Blinker({}, setup.seed);
    changed();
    faces_.reserve(bodies_.capacity().count + 1);
  }

  void changed() override {
    GazeParameters gaze;
    gaze.pan_max_rad = pan_max_;
    gaze.tilt_max_rad = tilt_max_;
    gaze.near_m = near_;
    gaze.leave_m = near_ + kLeave_m;
    gaze.hold_s = hold_;
    gaze_->tune(gaze);
    sun_.tune({confirm_, shut_, lift_});
    blinker_.tune({blink_every_, blink_});
  }

  void run(Job& job) override {
    const int64_t now_ns = job.release_ns();
    look_for_faces();
    if (faces_.empty()) gaze_->wait(now_ns);
    else gaze_->see(faces_, now_ns);
    const StereoPair* pair = pair_.newest();
    if (pair && pair_.is_new()) sun_.see((pair->health & image_health::saturated) != 0, pair_.stamp_ns(), now_ns);
    const bool lids_sent = send_lids(now_ns), command_sent = send_command(pair, now_ns);
    if (!lids_sent || !command_sent) job.no_result();
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, gaze_, sun_, blinker_, lid_levels_); }

 private:
  /// Who is followed first, so that he is the partner of two who are equally near.
  void look_for_faces() {
    faces_.clear();
    if (const Pose* person = person_.newest(); person && person_.is_new() && !person_.stale())
      faces_.push_back({person->transform.x, person->transform.y, face_height_});
    if (!bodies_.is_new() || bodies_.stale()) return;
    for (const Body& body : bodies_.newest()->bodies.items())
      if (body.joints[0].fitted > 0) faces_.push_back({body.joints[0].x, body.joints[0].y, body.joints[0].z});
  }

  bool send_command(const StereoPair* pair, int64_t now_ns) {
    if (!pair || !mapping_3d::is_known(pair->sensor_in_robot)) return false;
    HeadCommand* command = command_.loan();
    if (!command) return false;
    const mapping_3d::HeadAngles angles = gaze_->look(pair->sensor_in_robot);
    command->pan_rad = angles.pan_rad;
    command->tilt_rad = angles.tilt_rad;
    command_.send(now_ns);
    return true;
  }

  bool send_lids(int64_t now_ns) {
    DigitalState* lids = lids_.loan();
    if (!lids) return false;
    const bool blinks = blinker_.closed(blink_every_ > 0 && gaze_->partner().has_value(), now_ns);
    lids->levels = sun_.closed(now_ns) || blinks ? kBothLids : 0;
    lids->changed = lids->levels ^ lid_levels_;
    lid_levels_ = lids->levels;
    lids_.send(now_ns);
    return true;
  }

  static constexpr uint32_t kBothLids = 3;
  static constexpr double kLeave_m = 0.5;  ///< farther than who comes near, so that nobody comes and goes on a border

  Input<StereoPair> pair_{this, "pair",
                          "of the camera on the head, any stage: its mount, and whether the sun blinds it"};
  Input<BodyPoses> bodies_{this, "bodies", "people, robot frame", Need::optional};
  Input<Pose> person_{this, "person", "who is followed, robot frame", Need::optional};
  Output<HeadCommand> command_{this, "command", "pan and tilt towards the partner's face; straight ahead without one"};
  Output<DigitalState> lids_{this, "lids", "line 0: the left lid is to be closed, line 1: the right one"};
  Param<double> near_{this, "near", GazeParameters{}.near_m, {0.5, 10.0}, "m", "who comes so near becomes the partner"};
  Param<double> hold_{this, "hold", GazeParameters{}.hold_s, {0.0, 60.0}, "s", "the partner may be unseen for so long"};
  Param<double> face_height_{this, "face_height", 1.6, {0.3, 2.5}, "m", "of who is followed, where no body shows it"};
  Param<double> pan_max_{this, "pan_max", GazeParameters{}.pan_max_rad, {0.0, 3.2}, "rad", "limit to either side"};
  Param<double> tilt_max_{this, "tilt_max", GazeParameters{}.tilt_max_rad, {0.0, 1.6}, "rad", "limit up and down"};
  Param<int> confirm_{this,     "confirm", SunParameters{}.confirm,
                      {1, 100}, "",        "saturated images in a row close the lids"};
  Param<double> shut_{this, "shut", SunParameters{}.shut_s, {0.1, 600.0}, "s", "before they open to look again"};
  Param<double> lift_{this, "lift", SunParameters{}.lift_s, {0.0, 5.0}, "s", "that a lid takes to open"};
  Param<double> blink_every_{this,         "blink_every", BlinkParameters{}.every_s,
                             {0.0, 600.0}, "s",           "while there is a partner, on average; 0: never"};
  Param<double> blink_{this,        "blink", BlinkParameters{}.closed_s,
                       {0.05, 5.0}, "s",     "how long a blink commands the lid shut"};

  std::optional<Gaze> gaze_;
  SunGuard sun_;
  Blinker blinker_;
  std::vector<mapping_3d::Position> faces_;
  uint32_t lid_levels_ = 0;
};

}  // namespace

void register_head_behaviour(NodeTypes& types) {
  types.add<HeadBehaviourNode>("head_behaviour", Layer::processing,
                               "Looks at who deals with the robot, blinks, shuts the lids against the sun");
}

}  // namespace takt
