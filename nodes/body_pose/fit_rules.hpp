// SPDX-License-Identifier: Apache-2.0
// What the fit asks of a link between two points: thesis Alg. 3.3 without its loops, the same for the fast way and the
// obvious one.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "nodes/body_pose/skeleton.hpp"
#include "rt/msg/point.hpp"

namespace takt::body_pose {

/// Shares are of the cluster's reference density or of a link's nominal length.
struct FitParameters {
  int rotations = 11;                           ///< of each typical pose about the vertical, evenly over a turn
  double search_m = 0.30;                       ///< a link ends at most so far from where the pose would have it
  double tube_m = 0.06;                         ///< points so near a link lie along it
  double density_min = 0.3, density_low = 0.6;  ///< along a link: below it is refused, penalised
  double length_min = 0.7, length_max = 1.3;
  double behind_m = 0.06;  ///< what is hidden lies at least so far behind what is seen
  double close_m = 0.15;   ///< points so near a fitted link are explained by it
  double limb_m = 0.25;    ///< a point counts once more for each such distance from the start's vertical
  double weight_distance = 0.3, weight_missing = 1, weight_unused = 6,
         weight_thin = 0.5;      ///< a1 (1/m) .. a4 of Eq. 3.10
  double weight_away = 0.7;      ///< of (1 - cos(angle between where the body faces and the sensor)) / 2
  double missing_penalty = 0.2;  ///< of a link, and once more for each that hangs on it
  double thin_penalty = 0.2;
  double sigma_length = 0.15;  ///< of length ratios: validation allows twice that from their mean
};

/// Points of one body, where its skeleton starts, and where it is seen from.
struct Cluster {
  std::span<const Point> points;
  Eigen::Vector3f start = Eigen::Vector3f::Zero();
  double density = 0;  ///< reference density, points a metre: reference_density() of them
  Eigen::Vector3f eye = Eigen::Vector3f::Zero();
};

/// Distance of points to a line between two others.
class Segment {
 public:
  Segment(const Eigen::Vector3f& from, const Eigen::Vector3f& to)
      : x_(from.x()), y_(from.y()), z_(from.z()), dx_(to.x() - x_), dy_(to.y() - y_), dz_(to.z() - z_) {
    const float squared = dx_ * dx_ + dy_ * dy_ + dz_ * dz_;
    per_squared_ = squared > 0 ? 1 / squared : 0;
  }
  float squared_distance(float px, float py, float pz) const {
    const float x = px - x_, y = py - y_, z = pz - z_;
    float along = (x * dx_ + y * dy_ + z * dz_) * per_squared_;
    along = along > 0 ? along : 0;
    along = along < 1 ? along : 1;
    const float ex = x - along * dx_, ey = y - along * dy_, ez = z - along * dz_;
    return ex * ex + ey * ey + ez * ez;
  }

 private:
  float x_, y_, z_, dx_, dy_, dz_, per_squared_;
};

/// One link to be fitted.
struct LinkTask {
  const Link* link = nullptr;
  Eigen::Vector3f start = Eigen::Vector3f::Zero(), aim = Eigen::Vector3f::Zero();  ///< where it would end in the pose
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();                             ///< from start to aim, unit
  Eigen::Matrix3f frame = Eigen::Matrix3f::Identity();                             ///< its angles are measured in
};

/// Median, over at most 256 points spread evenly over the list, of the points within `tube_m` of one, divided by
/// 2 tube_m: what the density along a link is where it lies in the middle of a limb. Points a metre; 0 for no points.
double reference_density(std::span<const Point> points, double tube_m);

/// Shortest rotation from the link's rest to a unit direction, both in the link's frame: a rotation vector, rad, which
/// is perpendicular to the rest.
Eigen::Vector3f swing(const Eigen::Vector3f& rest, const Eigen::Vector3f& direction);

/// Whether the link's angles allow a unit direction (of the world) in that frame. About each axis the swing must lie
/// within the degree of freedom, or within the slack if the link has none there.
bool angles_allow(const Skeleton& skeleton, const Link& link, const Eigen::Matrix3f& frame,
                  const Eigen::Vector3f& direction);

/// Frame of a link's followers: its own, turned by its swing.
Eigen::Matrix3f frame_of_followers(const Link& link, const Eigen::Matrix3f& frame, const Eigen::Vector3f& direction);

/// e2 of Alg. 3.3: |length / nominal - 1| + angle to the pose's direction / mean range of the link's degrees of freedom
/// (half a turn if it has none). Nothing if the length is out of its limits.
std::optional<double> shape_error(const FitParameters& p, const LinkTask& task, const Eigen::Vector3f& end);

/// e1 of Alg. 3.3 from the points along a link. Nothing if they are too few.
std::optional<double> density_error(const FitParameters& p, double reference, size_t points, double length_m);

/// Where a link may end that no point shows: behind a point on its line of sight, a nominal length from its start.
inline constexpr size_t kHidingStep = 4;  ///< every so many points are asked what they hide
struct HiddenEnds {
  std::array<Eigen::Vector3f, 2> ends;
  size_t count = 0;
};
HiddenEnds hidden_ends(const FitParameters& p, const LinkTask& task, const Eigen::Vector3f& eye,
                       const Eigen::Vector3f& point);
/// Whether points lie on, or before, all of a link that would end there: otherwise it would be seen if it were there.
bool is_covered(const FitParameters& p, const Cluster& cluster, const LinkTask& task, const Eigen::Vector3f& end);

/// The link from `start` in a pose: where `direction` (unit) leads, or opposite to its fitted partner.
LinkTask make_task(const Link& link, const Eigen::Vector3f& start, const Eigen::Matrix3f& frame,
                   const Eigen::Vector3f& direction);
LinkTask make_mirrored_task(const Link& link, const Eigen::Vector3f& start, const Eigen::Matrix3f& frame,
                            const Link& partner, const Eigen::Vector3f& partner_vector);

/// Angle of rotation number k of n about the vertical, rad.
double yaw_of(int k, int n);
/// From the body's frame to the world's.
Eigen::Matrix3f rotation_about_vertical(double yaw_rad);
/// The order in which n rotations are tried: the i-th of it. Far from one another, so that the first few say much.
int rotation_at(int i, int n);

/// How much a body at `start` that faces there looks away from the eye, seen from above: 0 not at all .. 1.
double away(const Eigen::Vector3f& start, const Eigen::Vector3f& eye, double yaw_rad);

/// Most that a point counts among the unused ones of Eq. 3.10.
inline constexpr uint32_t kMostWeight = 4;
/// How often it counts, 1 .. kMostWeight: the more, the farther it lies from the body's vertical. A limb that points at
/// the camera shows few points, all of them far from the trunk, which shows many.
uint32_t weight_of(const FitParameters& p, const Eigen::Vector3f& start, const Point& point);

/// What a pose costs (Eq. 3.10), summed up link by link.
struct PoseError {
  double distance_m = 0, missing = 0, thin = 0, away = 0;
  /// `used`, `all`: sums of the weights of explained points and of all.
  double total(const FitParameters& p, size_t used, size_t all) const;
};

/// A skeleton fitted to a cluster.
struct Fit {
  std::array<Eigen::Vector3f, kMostJoints> ends;  ///< of the links; ends[0] is the start
  std::array<bool, kMostJoints> fitted{};
  std::array<bool, kMostJoints> hidden{};  ///< fitted, but no point shows it: hidden_ends()
  double error = 0;
  size_t pose = 0;  ///< of the skeleton's poses
  double yaw_rad = 0;
  double searched = 0;  ///< share of the rotations tried
};

/// Whether a fit can be a body (Eq. 3.11): each length ratio within two sigma of their mean, all angles allowed.
bool is_valid(const Skeleton& skeleton, const FitParameters& p, const Fit& fit);

/// The fit as the thesis prints it (Alg. 3.3, E-10 repaired): every pose and rotation, every link of each anew, every
/// point of the cluster. Slow.
Fit fit_reference(const Skeleton& skeleton, const FitParameters& p, const Cluster& cluster);

}  // namespace takt::body_pose
