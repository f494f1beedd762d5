// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "nodes/ground_map/terrain.hpp"
#include "nodes/mapping_3d/head_at.hpp"
#include "nodes/semantic/insertion.hpp"
#include "nodes/semantic/network_file.hpp"
#include "nodes/semantic/reports.hpp"
#include "nodes/semantic/script.hpp"
#include "rt/msg/ace/head.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/objects_3d.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/node.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt {
namespace {

using namespace semantic;

/// What a measured object tells of its attributes, by their names.
struct Measured {
  const char* attribute;
  ValueKind kind;
  Value (*value)(const Object3d&);
};
constexpr Measured kMeasured[] = {
    {"colour", ValueKind::colour,
     [](const Object3d& o) -> Value {
       return Rgb{o.red / 255, o.green / 255, o.blue / 255};
     }},
    {"length", ValueKind::scalar, [](const Object3d& o) -> Value { return double{o.length_m}; }},
    {"width", ValueKind::scalar, [](const Object3d& o) -> Value { return double{o.width_m}; }},
    {"height", ValueKind::scalar, [](const Object3d& o) -> Value { return double{o.height_m}; }}};

class SemanticMapNode final : public Node {
 public:
  void setup(Setup& setup) override {
    if (!things_.connected() && !reports_.connected()) throw SetupError("connect `things` or `reports`, or both");
    MapParameters m;
    m.capacity = {static_cast<size_t>(capacity_()), 3 * static_cast<size_t>(capacity_())};
    map_.emplace(m);
    if (!network_().empty())
      if (const auto read = read_network(setup.directory / network_(), *map_); !read)
        throw SetupError(fmt::format("network: {}", fmt::join(read.error(), "\n")));
    find_types();
    for (size_t i = 0; i < std::size(kMeasured); ++i) {
      const NodeId node = map_->network().find(kMeasured[i].attribute);
      const bool usable = node != kNoNode && map_->network().kind(node) == Kind::attribute &&
                          map_->attribute(node).kind == kMeasured[i].kind;
      measured_[i] = usable ? node : kNoNode;
    }
    insertion_.emplace(*map_, parameters());
    reader_.emplace(*map_);
    objects_.reserve({0, 0, 1, static_cast<uint32_t>(capacity_())});
    known_.reserve({0, 0, 1, static_cast<uint32_t>(capacity_())});
    decisions_.reserve({0, 0, 1, kCharacters});
  }

  void changed() override { insertion_->tune(parameters()); }

  void start(int64_t) override {
    if (const ObjectReports* known = known_.handed_over()) restore(*known);
  }

  void run(Job& job) override {
    for (size_t i = 0; i < odometry_.size(); ++i)
      track_.insert(odometry_.stamp_ns(i), {mapping_3d::robot_in_odometry(odometry_[i]), {}});
    used_ = 0;
    looks_ = 0;
    TextStatus* decisions = decisions_.loan();
    Objects3d* objects = objects_.loan();
    ObjectReports* known = known_.loan();
    if (decisions) decisions->text.resize(kCharacters);
    text_ = decisions ? decisions->text.items() : std::span<char>();
    for (size_t i = 0; i < things_.size(); ++i) look(things_[i], things_.stamp_ns(i));
    for (size_t i = 0; i < reports_.size(); ++i) look(reports_[i], reports_.stamp_ns(i));
    for (size_t i = 0; i < terrain_.size(); ++i) keep(terrain_[i], terrain_.stamp_ns(i));
    if ((looks_ == 0 && used_ == 0) || !decisions || !objects || !known) return job.no_result();
    decisions->text.resize(static_cast<uint32_t>(used_));
    decisions_.send(std::max(newest_ns(), last_terrain_ns_));
    if (looks_ == 0) return;
    list_objects(*objects);
    objects_.send(newest_ns());
    write_reports(*map_, *known);
    known_.send(newest_ns());
  }

  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, map_, track_, last_things_ns_, last_reports_ns_, last_terrain_ns_, misfits_);
  }

 private:
  InsertionParameters parameters() const {
    InsertionParameters p;
    p.merge_min = merge_min_;
    p.similarity.distance_max_m = distance_max_;
    p.distinct_in_view = distinct_in_view_;
    p.misses = static_cast<uint32_t>(misses_());
    return p;
  }

  void find_types() {
    const auto names = parse_node_list(classes_());
    if (!names) throw SetupError("classes: " + names.error());
    for (const std::string& name : *names) {
      const auto type = map_->type_named(name);
      if (!type) throw SetupError("classes: `" + name + "`: " + std::string(to_string(type.error())));
      types_.push_back(*type);
    }
  }

  int64_t newest_ns() const { return std::max(last_things_ns_, last_reports_ns_); }

  /// In the map, for a message that has not counted yet; a message counts once the robot's pose is known at its stamp.
  std::optional<mapping_3d::Affine> robot_at(int64_t stamp_ns, int64_t& last_ns) {
    if (stamp_ns <= last_ns) return std::nullopt;
    const auto robot = track_.at(stamp_ns);
    if (!robot) return std::nullopt;
    last_ns = stamp_ns;
    ++looks_;
    return mapping_3d::to_affine(robot->transform);
  }

  void look(const Objects3d& things, int64_t stamp_ns) {
    const auto robot = robot_at(stamp_ns, last_things_ns_);
    if (!robot) return;
    for (const Object3d& thing : things.objects.items()) {
      const auto place = transformed(*robot, thing.x_m, thing.y_m, thing.z_m);
      see(thing, place.x_m, place.y_m, stamp_ns);
    }
    if (things.searched >= 1) forget(*robot, stamp_ns);  // what a job did not come to is not missed
  }

  void look(const ObjectReports& reports, int64_t stamp_ns) {
    const auto robot = robot_at(stamp_ns, last_reports_ns_);
    if (!robot) return;
    const mapping_3d::Affine to_map = reports.in_map ? mapping_3d::Affine{} : *robot;
    for_each_report(reports, [&](const Report& report) {
      const auto misfit = [&](Misfit what, const ObjectAttribute* attribute) { tell(report, what, attribute); };
      if (const auto observation = reader_->read(report, to_map, stamp_ns, misfit))
        tell(insertion_->insert(*observation));
    });
    forget(*robot, stamp_ns);
  }

  /// At the place where the robot was then; told where it is another than before.
  void keep(const takt::Terrain& seen, int64_t stamp_ns) {
    const auto robot = track_.at(stamp_ns);
    if (stamp_ns <= last_terrain_ns_ || !robot) return;
    last_terrain_ns_ = stamp_ns;
    if (seen.kind >= terrain_kind::unknown) return;
    const mapping_3d::Affine place = mapping_3d::to_affine(robot->transform);
    const auto terrain = static_cast<semantic::Terrain>(seen.kind + 1);  // 0: unknown
    const semantic::Terrain before = map_->terrain(place.t[0], place.t[1]);
    if (before == terrain || !map_->contains(place.t[0], place.t[1])) return;
    map_->set_terrain(place.t[0], place.t[1], terrain);
    line([&](std::span<char> into) {
      const auto written = fmt::format_to_n(into.data(), into.size(), "terrain at ({:.1f} m, {:.1f} m): {}, was {}",
                                            place.t[0], place.t[1], terrain_name(terrain), terrain_name(before));
      return into.first(std::min(into.size(), written.size));
    });
  }
  static std::string_view terrain_name(semantic::Terrain terrain) {
    return ground_map::kTerrainNames[terrain == 0 ? terrain_kind::unknown : terrain - size_t{1}];
  }

  /// Objects in view that the grid shows gone.
  void forget(const mapping_3d::Affine& robot, int64_t stamp_ns) {
    const auto head =
        head_.connected() ? mapping_3d::head_at(head_, stamp_ns, kLongestGap_ns) : mapping_3d::HeadAngles{};
    if (!head) return;  // nobody knows what it saw
    const Grid* grid = grid_.empty() || grid_.stale() ? nullptr : grid_.newest();
    if (!grid || !lies_in_map(*grid)) return;
    const navigation::OccupancyView seen{grid->view(), grid->cell_m, grid->origin_x_m + grid->grid_in_map.x,
                                         grid->origin_y_m + grid->grid_in_map.y};
    map_->take_over(seen);
    const double ahead_rad = std::atan2(robot.r[4], robot.r[1]);  // the robot drives along its y axis
    insertion_->forget({robot.t[0], robot.t[1], ahead_rad + head->pan_rad, view_() / 2, range_, stamp_ns}, seen,
                       [&](const Decision& decision) { tell(decision); });
  }

  /// Its axes are the map's, and it is as large as it says.
  static bool lies_in_map(const Grid& grid) {
    return grid.grid_in_map.qw == 1 && grid.width > 0 && grid.height > 0 && grid.cell_m > 0 &&
           grid.cells.size == static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height);
  }

  void see(const Object3d& thing, double x_m, double y_m, int64_t stamp_ns) {
    if (!(thing.class_id >= 0) || thing.class_id >= static_cast<float>(types_.size())) return;
    const NodeId type = types_[static_cast<size_t>(thing.class_id)];
    std::array<State, std::size(kMeasured)> states;
    size_t count = 0;
    for (size_t i = 0; i < std::size(kMeasured); ++i) {
      if (measured_[i] == kNoNode || !map_->network().connected(type, measured_[i])) continue;
      const Value value = kMeasured[i].value(thing);
      if (fits(map_->attribute(measured_[i]), value)) states[count++] = {measured_[i], value};
    }
    tell(insertion_->insert({type, x_m, y_m, thing.score, stamp_ns, std::span(states).first(count)}));
  }

  /// In the place of all objects that the network's file knows: what this node published last.
  void restore(const ObjectReports& known) {
    for (NodeId node = 0; node < map_->network().end(); ++node)
      if (map_->network().exists(node) && map_->network().kind(node) == Kind::object) map_->remove(node);
    for_each_report(known, [&](const Report& report) {
      const auto observation = reader_->read(report, {}, 0, [](Misfit, const ObjectAttribute*) {});
      if (observation) insertion_->insert(*observation);
    });
  }

  /// Writes another line, as much of it as there is room for.
  template <class Write>
  void line(Write write) {
    if (used_ > 0 && used_ < text_.size()) text_[used_++] = '\n';
    used_ += write(text_.subspan(used_)).size();
  }
  void tell(const Decision& decision) {
    line([&](std::span<char> into) { return explain(*map_, decision, insertion_->parameters(), into); });
  }
  void tell(const Report& report, Misfit misfit, const ObjectAttribute* attribute) {
    const uint64_t so_far = ++misfits_[static_cast<size_t>(misfit)];
    line([&](std::span<char> into) { return explain(report, misfit, attribute, so_far, into); });
  }

  void list_objects(Objects3d& out) const {
    out.searched = 1;
    for (size_t type = 0; type < types_.size(); ++type)
      for (const NodeId node : map_->network().omega(types_[type], Kind::object)) {
        const Object& object = map_->object(node);
        Object3d o{};
        o.class_id = static_cast<float>(type);
        o.score = static_cast<float>(object.confidence);
        o.x_m = static_cast<float>(object.x_m);
        o.y_m = static_cast<float>(object.y_m);
        o.on = o.beside = -1;
        for (size_t i = 0; i < std::size(kMeasured); ++i)
          if (measured_[i] != kNoNode) write(kMeasured[i], map_->state(node, measured_[i]), o);
        if (!out.objects.push_back(o)) return;
      }
  }
  static void write(const Measured& measured, const Value& value, Object3d& o) {
    if (const Rgb* c = std::get_if<Rgb>(&value)) o.red = 255 * c->r, o.green = 255 * c->g, o.blue = 255 * c->b;
    const double* number = std::get_if<double>(&value);
    if (!number) return;
    const std::string_view name = measured.attribute;
    (name == "length" ? o.length_m : name == "width" ? o.width_m : o.height_m) = static_cast<float>(*number);
  }

  static constexpr uint32_t kCharacters = 2000;
  static constexpr int64_t kLongestGap_ns = 500'000'000;  ///< between two poses of the odometry

  Input<Objects3d> things_{this, "things", "what is measured, robot frame; depth 4", Need::optional};
  Input<ObjectReports> reports_{this, "reports", "what is recognised, robot frame; depth 4", Need::optional};
  Input<Odometry> odometry_{this, "odometry", "the robot's poses in the map around the things' stamps; depth 16"};
  Input<Grid> grid_{this, "grid",
                    "what is free and what is not, axes of the map frame: objects whose place is seen free go",
                    Need::optional};
  Input<HeadState> head_{this, "head", "where it turns the camera; none: things are seen straight ahead; depth 16",
                         Need::optional};
  Input<takt::Terrain> terrain_{this, "terrain", "of the floor where the robot is: kept at the place; depth 4",
                                Need::optional};
  Output<Objects3d> objects_{this, "objects", "all objects of the map, map frame; class_id as `classes` counts"};
  Output<ObjectReports> known_{this, "reports", "the same by names with all states; what a restarted node begins with"};
  Output<TextStatus> decisions_{this, "decisions",
                                "what became of each thing and terrain seen, and why; one line each"};

  Param<std::string> network_{this, "network", "", kPath, "predefined network (YAML); empty: the classes alone"};
  Param<std::string> classes_{this, "classes", "", "", "types of `things` by class_id, joined by commas", kReadAtStart};
  Param<double> merge_min_{this, "merge_min", 0.75, {0.5, 1.0}, "", "p from which on two are one"};
  Param<double> distance_max_{this, "distance_max", 2.0, {0.1, 20.0}, "m", "farther apart places say two are not one"};
  Param<bool> distinct_in_view_{this, "distinct_in_view", false, "", "things of one message are never one object"};
  Param<int> misses_{this, "misses", 5, {1, 1000}, "", "looks in a row that see its place free before an object goes"};
  Param<double> view_{this, "view", 1.1519, {0.1, 6.2}, "rad", "angle in which things are seen, about straight ahead"};
  Param<double> range_{this, "range", 3.0, {0.2, 20.0}, "m", "up to which things are seen"};
  Param<int> capacity_{this,        "capacity", 2000, {50, 50000}, "", "nodes of the network, objects among them",
                       kSizesMemory};

  std::optional<SemanticMap> map_;
  std::optional<Insertion> insertion_;
  std::optional<ReportReader> reader_;
  std::vector<NodeId> types_;  ///< by class_id
  std::array<NodeId, std::size(kMeasured)> measured_{};
  PoseTrack track_{InputPort::kMaxDepth, kLongestGap_ns};
  /// Stamps of the newest that counted.
  int64_t last_things_ns_ = INT64_MIN, last_reports_ns_ = INT64_MIN, last_terrain_ns_ = INT64_MIN;
  size_t looks_ = 0;  ///< of the job
  std::array<uint64_t, kMisfits> misfits_{};
  std::span<char> text_;  ///< of the job's decisions
  size_t used_ = 0;
};

}  // namespace

void register_semantic_map(NodeTypes& types) {
  types.add<SemanticMapNode>("semantic_map", Layer::storage, "What is where, of which type, in which state");
}

}  // namespace takt
