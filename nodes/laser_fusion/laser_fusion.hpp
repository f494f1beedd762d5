// SPDX-License-Identifier: Apache-2.0
// From a laser sweep and a camera's cloud to their relative pose and coloured laser points, in portions.
#pragma once
#include "nodes/cloud/voxel_grid.hpp"
#include "nodes/laser_fusion/clusters.hpp"
#include "nodes/laser_fusion/fusion.hpp"
#include "nodes/laser_fusion/genetic_icp.hpp"
#include "nodes/laser_fusion/matcher.hpp"
#include "nodes/laser_fusion/thinning.hpp"
#include "rt/msg/point.hpp"
#include "rt/state_archive.hpp"

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

  /// From the next begin() on: a search is one thing. The numbers of points and the population stay as they were.
  /// Throws std::invalid_argument if all of the pose is locked.
  void tune(const LaserFusionParameters& parameters);
  /// Takes a pair of clouds, both copied. Without colours the vision points are grey. `coloured`: somebody wants the
  /// laser points with their colours; else all ends with the search.
  void begin(std::span<const Point> laser, const cloud::CloudView& vision, const Rigid& vision_in_laser, uint64_t seed,
             bool coloured = true);

  /// Goes on until all is done or `more` says no: it is asked before each portion. That is a pass over a cloud where it
  /// is thinned out, about a millisecond at most elsewhere. Returns done().
  template <class More>
  bool run(const More& more) {
    while (!done() && more()) go_on();
    return done();
  }
  bool idle() const { return stage_ == Stage::idle; }
  bool searching() const { return stage_ == Stage::search; }
  bool done() const { return stage_ == Stage::done || stage_ == Stage::idle; }

  bool has_pose() const { return stage_ >= Stage::search; }
  /// While has_pose(): the best so far.
  Rigid vision_in_laser() const { return genetic_.best(); }
  const Quality& quality() const { return genetic_.quality(); }
  double share() const;  ///< of the laser points of the search that have a partner
  /// Of the search for this pair.
  uint32_t generation() const { return has_pose() ? genetic_.generation() : 0; }

  /// Once done(): fuse() of every laser point at the pose found; then idle(), and these hold until the next pair.
  std::span<const FusedPoint> finish() {
    stage_ = Stage::idle;
    return fused_;
  }
  /// A search under way with both clouds as they came, up to 27 B a point; what is made of them is made again when it
  /// is loaded.
  void remember(StateArchive& archive);

 private:
  enum class Stage : uint8_t {
    idle,
    take_vision,
    thin_laser,
    thin_vision,
    drop_of_laser,
    drop_of_vision,
    build,
    search,
    build_colours,
    fuse,
    done
  };

  void go_on();
  void use(const LaserFusionParameters& parameters);
  void begin_again();
  void thin(Stage stage, std::span<const Point> points, std::vector<Point>& out);
  void drop_clusters(Stage stage, std::span<Point> points);
  void search_or_end();
  void begin_colours();
  void fuse_some();

  LaserFusionParameters parameters_, next_parameters_;  ///< of the pair in hand, and of the next one
  Stage stage_ = Stage::idle;
  std::array<uint32_t, 2> portions_{};  ///< of the pair so far: before the search, and after it
  std::vector<Point> laser_, all_vision_, vision_, few_laser_, few_vision_;
  std::vector<Colour> all_colours_, vision_colours_;
  std::vector<FusedPoint> fused_;
  size_t vision_count_ = 0, few_laser_count_ = 0, few_vision_count_ = 0;
  size_t next_ = 0;  ///< laser point to be fused
  Rigid start_;
  uint64_t seed_ = 0;
  bool coloured_ = true;
  cloud::VoxelGrid grid_;
  Thinning thinning_;
  ClusterFilter clusters_;
  NearestTable vision_table_;
  Matcher matcher_;
  GeneticIcp genetic_;
};

}  // namespace takt::laser_fusion
