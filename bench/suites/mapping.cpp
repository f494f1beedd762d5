// SPDX-License-Identifier: Apache-2.0
// Matching a scan of 181 beams with the last twenty of a drive through a furnished room: the search against one that
// tries every candidate, the refinement against one that looks at every mapped point, both with equal results; the
// whole step, the map update, a measurement of the pose filter, late or not, and a sweep of the traversability grid.
#include <cstdio>
#include <stdexcept>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "nodes/robot_pose/pose_filter.hpp"
#include "nodes/scan_matching/drive.hpp"
#include "nodes/scan_matching/occupancy_map.hpp"
#include "nodes/scan_matching/scan_matcher.hpp"
#include "nodes/traversability/height_map.hpp"
#include "rt/time/clock.hpp"

namespace takt::bench {

std::vector<Row> run_mapping(const Options& options);

namespace {

using namespace scan_matching;

constexpr size_t kScans = 120;

template <class Work>
double used_ms(const Work& work) {
  const int64_t begin = thread_cpu_ns();
  work();
  return static_cast<double>(thread_cpu_ns() - begin) * 1e-6;
}

Row row(const char* name) {
  std::fprintf(stderr, "%s\n", name);
  return {name, "ms", 0, {}, {}, {}, {}, "one thread, CPU time"};
}

void must_agree(bool agree) {
  if (!agree) throw std::runtime_error("mapping: the fast result is not that of the reference");
}

/// The drive's last scan, as a step of a matcher would look for it.
void stages(std::vector<Row>& rows, const Drive& drive, const ScanMatcher& matcher, int rounds) {
  const Parameters p;
  const auto points = matcher.points();
  const PlanarPose truth = between(drive.scans.front().truth, drive.scans.back().truth);
  const Expected expected{{truth.x_m + 0.1, truth.y_m - 0.07, truth.theta_rad + 0.06}, 0.1, 0.05};
  CorrelativeSearch search(drive.beams, p.search, p.map.cell_m);
  const LocalMap& map = matcher.map();
  const Found found = search.find(map.field(), points, expected);
  must_agree(found == search.find_reference(map.field(), points, expected));
  const auto add = [&](const char* name, const char* reference, const auto& theirs, const auto& ours) {
    Row figures = row(name);
    Compared compared = compare(
        static_cast<size_t>(rounds), [&] { return used_ms(theirs); }, [&] { return used_ms(ours); });
    figures.samples = std::move(compared.changed);
    add_pair(rows, std::move(figures), reference, compared.pairs);
  };
  add(
      "mapping/scan_search", "every candidate", [&] { search.find_reference(map.field(), points, expected); },
      [&] { search.find(map.field(), points, expected); });
  const auto refined = [&](NearestPoint nearest) {
    return refine(map, points, expected, found.robot_in_map, p.refine, nearest);
  };
  must_agree(refined(&LocalMap::nearest).covariance == refined(&LocalMap::nearest_reference).covariance);
  add(
      "mapping/scan_refine", "every mapped point", [&] { refined(&LocalMap::nearest_reference); },
      [&] { refined(&LocalMap::nearest); });
}

/// A second of three sensors, the slow ones late; one sample a measurement.
Row filter_row() {
  Row out = row("mapping/pose_filter/measurement");
  robot_pose::PoseFilter filter({});
  const auto measured = [](robot_pose::Source source, int64_t from_ms, int64_t to_ms) {
    const double s = static_cast<double>(to_ms - from_ms) * 1e-3;
    return robot_pose::Measured{
        source, from_ms * 1'000'000, to_ms * 1'000'000, {0, 0.5 * s, 0.1 * s}, 1e-5 * Covariance::Identity()};
  };
  const auto add = [&](robot_pose::Source source, int64_t from_ms, int64_t to_ms) {
    out.samples.add(used_ms([&] { filter.add(measured(source, from_ms, to_ms)); }));
  };
  for (int64_t ms = 300; ms < 60'000; ms += 10) {
    if (ms % 70 == 0) add(robot_pose::Source::wheels, ms - 70, ms);
    if (ms % 100 == 0) add(robot_pose::Source::ego_motion, ms - 180, ms - 80);
    if (ms % 100 == 50) add(robot_pose::Source::scans, ms - 250, ms - 150);
  }
  out.value = out.samples.quantile(0.5).value_or(0);
  return out;
}

/// A sweep of 281 beams 2 m ahead and the judgement of the 12 x 12 m, once the floor behind is known.
Row traversability_row() {
  Row out = row("mapping/traversability/sweep");
  traversability::HeightMap map({});
  std::vector<int16_t> cells(static_cast<size_t>(map.side()) * static_cast<size_t>(map.side()));
  for (int sweep = 0; sweep < 500; ++sweep) {
    const double y_m = sweep / 30.0;
    std::vector<mapping_3d::Position> points;
    for (int beam = 0; beam < 281; ++beam) points.push_back({(beam - 140) * 0.01, y_m + 2, 0.001 * (beam % 5)});
    out.samples.add(used_ms([&] {
      map.centre(0, y_m);
      map.add(points, sweep);
      map.judge({cells.data(), map.side(), map.side()});
    }));
  }
  out.value = out.samples.quantile(0.5).value_or(0);
  return out;
}

}  // namespace

std::vector<Row> run_mapping(const Options& options) {
  const Drive drive = make_drive(furnished_room(1), rounds(kScans), {}, 1);
  Row step = row("mapping/scan_step"), update = row("mapping/occupancy_update");
  ScanMatcher matcher(drive.beams, {});
  for (int pass = 0; pass < options.rounds_or(10); ++pass) {
    matcher = ScanMatcher(drive.beams, {});
    OccupancyMap map({});
    for (size_t i = 0; i < drive.scans.size(); ++i) {
      const std::optional<PlanarPose> moved = i > 0 ? std::optional(drive.moved(i)) : std::nullopt;
      Match match;
      step.samples.add(used_ms([&] { match = matcher.step(drive.sweep(i), 0.2, moved); }));
      update.samples.add(used_ms([&] { map.add(match.robot_in_map, drive.sweep(i)); }));
    }
  }
  step.value = step.samples.quantile(0.5).value_or(0);
  update.value = update.samples.quantile(0.5).value_or(0);
  std::vector<Row> rows{step, update};
  stages(rows, drive, matcher, options.rounds_or(10));
  rows.push_back(filter_row());
  rows.push_back(traversability_row());
  return rows;
}

}  // namespace takt::bench
