// SPDX-License-Identifier: Apache-2.0
// From a laser sweep and a camera's cloud to their relative pose and coloured laser points, in portions.
#pragma once
#include "nodes/cloud/voxel_grid.hpp"
#include "nodes/laser_fusion/clusters.hpp"
#include "nodes/laser_fusion/fusion.hpp"
#include "nodes/laser_fusion/genetic_icp.hpp"
#include "nodes/laser_fusion/matcher.hpp"

namespace takt::laser_fusion {

struct LaserFusionParameters {
  size_t search_points = 1000;    ///< of each cloud in the search, at most
  size_t vision_points = 10'000;  ///< that lend their colours, at most
  double vision_voxel_m = 0.05;   ///< vision resolves about 10 cm: mean colours of smaller voxels lose nothing
  QualityParameters quality{};
  GeneticParameters genetic{};
  ClusterParameters clusters{};
  FusionParameters fusion{};
};

class LaserFusion {
 public:
  /// Takes the memory for clouds of so many points; nothing else allocates. Throws std::invalid_argument as GeneticIcp
  /// and cloud::VoxelGrid do.
  LaserFusion(size_t laser_points, size_t vision_points, const LaserFusionParameters& parameters);
  LaserFusion(const LaserFusion&) = delete;  // the search refers to the matcher beside it
  LaserFusion& operator=(const LaserFusion&) = delete;

  /// Takes a pair of clouds, both copied. Without colours the vision points are grey.
  void begin(std::span<const Point> laser, const cloud::CloudView& vision, const Rigid& vision_in_laser, uint64_t seed);

  /// Goes on with the search until it is done or `more` says no: it is asked before each portion, of some milliseconds
  /// at most. Returns done().
  template <class More>
  bool run(const More& more) {
    while (!done() && more()) {
      if (stage_ == Stage::search) {
        genetic_.run(more);
        if (genetic_.done()) stage_ = Stage::done;
      } else {
        prepare();
      }
    }
    return done();
  }
  bool idle() const { return stage_ == Stage::idle; }
  bool done() const { return stage_ == Stage::done || stage_ == Stage::idle; }
  bool searching() const { return stage_ == Stage::search || stage_ == Stage::done; }

  /// While searching(): the best so far.
  Rigid vision_in_laser() const { return genetic_.best(); }
  const Quality& quality() const { return genetic_.quality(); }
  double share() const;  ///< of the laser points of the search that have a partner
  uint32_t generation() const { return genetic_.generation(); }

  /// Once done(): fuse() of every laser point at the pose found; then idle() until the next pair.
  template <class Take>
  void finish(const Take& take) {
    vision_table_.build({vision_.data(), vision_count_}, farthest_match_m(parameters_.fusion), kFusionDivisions);
    fuse(laser_, vision_table_, vision_colours_, vision_in_laser(), parameters_.fusion, take);
    stage_ = Stage::idle;
  }

 private:
  enum class Stage : uint8_t { idle, thin_laser, build, search, done };
  static constexpr int kFusionDivisions = 2;  ///< many points close together: larger voxels are built sooner

  void prepare();

  LaserFusionParameters parameters_;
  Stage stage_ = Stage::idle;
  std::vector<Point> laser_, vision_, few_laser_, few_vision_;
  std::vector<Colour> vision_colours_;
  size_t vision_count_ = 0, few_laser_count_ = 0;
  Rigid start_;
  uint64_t seed_ = 0;
  cloud::VoxelGrid grid_;
  ClusterFilter clusters_;
  NearestTable vision_table_;
  Matcher matcher_;
  GeneticIcp genetic_;
};

}  // namespace takt::laser_fusion
