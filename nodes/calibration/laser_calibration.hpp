// SPDX-License-Identifier: Apache-2.0
// Where the laser scanners of a robot are mounted (thesis Sec. 4.4.1): height and roll of each from an object of known
// height (Alg. 4.2, repaired: E-27), the rest of all but the first by genetic ICP of their sweeps.
#pragma once
#include <string>
#include <vector>

#include "nodes/calibration/laser_sweep.hpp"
#include "nodes/calibration/room_patches.hpp"
#include "nodes/laser_fusion/genetic_icp.hpp"
#include "nodes/laser_fusion/nearest_table.hpp"
#include "rt/msg/point.hpp"

namespace takt::calibration {

struct HeightParameters {
  double eps_m = 1e-4;                                ///< of the object's lower end and of its height
  double step_z_m = 0.01, step_roll_rad = 0.0174533;  ///< the first and largest ones
  int iterations = 200;                               ///< at most
};

struct HeightFit {
  double z_m = 0, roll_rad = 0;
  double bottom_m = 0, height_error_m = 0;  ///< what is left: the object's lower end; how much too high it is
  int iterations = 0;
  bool converged = false;
};

/// z and roll at which the object stands on the floor and has its height, all else as in `mount`; roll keeps its sign.
/// The object's ends are extrapolated from the 1 % and 3 % quantiles of its heights, and from 99 % and 97 %: noise and
/// a few returns beside it do not move them. A step is halved when its error changes sign, and doubled, up to the first
/// one, when it has not for four steps: each of the two moves the other's error. Throws std::invalid_argument if no
/// return is on the object.
HeightFit fit_height(const LaserSweep& sweep, const PoseParameters& mount, double object_height_m,
                     const HeightParameters& parameters);

/// How densely sweeps are compared.
struct SweepMatchParameters {
  size_t returns, room_points;  ///< every n-th takes part, so that these are the most
  double cut_m;                 ///< pairs are at most so far apart
};

/// Judges a mount by how near the sweep, laid out with it, comes to the room that another one has seen. The robot
/// turned meanwhile, so another mount does not move the sweep as a whole: what is moved is each return in its scanner's
/// frame, and what stays its partner in the room, turned back by the heading.
class SweepMatcher final : public laser_fusion::PoseJudge {
 public:
  SweepMatcher(const LaserSweep& room, const Rigid& room_mount, const LaserSweep& sweep,
               const SweepMatchParameters& parameters);

  laser_fusion::Quality evaluate(const Rigid& mount) override;
  const laser_fusion::PairSums& pairs() const override { return sums_; }
  size_t returns() const { return returns_.size(); }

 private:
  struct Turn {
    float cosine, sine;
  };
  laser_fusion::NearestTable room_;
  laser_fusion::QualityParameters quality_;
  std::vector<Point> returns_;  ///< in the scanner's frame
  std::vector<Turn> turns_;     ///< of the robot, at each return
  std::vector<Point> partners_;
  std::vector<laser_fusion::Nearest> nearest_;
  laser_fusion::PairSums sums_;
};

struct LaserCalibrationParameters {
  HeightParameters height;
  laser_fusion::GeneticParameters genetic{
      .generations = 4000, .mutation = {0.2, 0.2, 0, 0.3, 0.3, 0}, .locks = {false, false, true, false, false, true}};
  SweepMatchParameters search{1500, 10'000, 0.25};
  PatchFitParameters fine{};
  uint64_t seed = 1;
};

struct CalibratedScanner {
  std::string name;
  PoseParameters mount{};
  HeightFit height;
  double residual_m = 0;  ///< mean distance of its returns from flat pieces of the first one's room; 0 of the first
  double paired = 0;      ///< share of its returns that lie on such
  bool converged = false;
};

/// x, y, yaw and pitch of the first scanner are believed. Of the others these follow from z and roll, and z and roll,
/// as the object shows them, from the pitch: both stages are repeated until they agree.
std::vector<CalibratedScanner> calibrate_lasers(const LaserRecording& recording,
                                                const LaserCalibrationParameters& parameters);

}  // namespace takt::calibration
