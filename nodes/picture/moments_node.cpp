// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>

#include "nodes/picture/image_file.hpp"
#include "nodes/picture/moment.hpp"
#include "nodes/semantic/reports.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace picture;
using semantic::text_in;

/// What stands in a page must not be read as its language.
std::string as_text(std::string_view words) {
  std::string out;
  for (const char c : words) {
    if (c == '<') out += "&lt;";
    else if (c == '&') out += "&amp;";
    else out += c;
  }
  return out;
}

class MomentsNode final : public Node {
 public:
  void setup(Setup& setup) override {
    output_ = setup.output;
    moments_.resize(static_cast<size_t>(most_()));
    for (Moment& moment : moments_)
      moment.reserve(size_of(pair_), detections_.connected() ? detections_.capacity().count : 0, size_of(grid_),
                     reports_.capacity().count, kMostCharacters);
    before_.reserve(reports_.capacity().count, reports_.capacity().count * 8);
  }

  void run(Job& job) override {
    const ObjectReports* reports = reports_.newest();
    if (reports != nullptr && reports->in_map == 0) reports = nullptr;
    const bool spoke = speech_.newest() != nullptr && speech_.is_new();
    const bool changed = reports != nullptr && reports_.is_new() && before_.take(*reports);
    if (!spoke && !changed) return;
    if (used_ == moments_.size()) {
      ++left_out_;
      return;
    }
    keep(job.release_ns(), reports, spoke, moments_[used_++]);
  }

  void finish() override {
    if (used_ == 0) return;
    const std::filesystem::path directory = output_ / directory_name_();
    std::error_code ignored;
    std::filesystem::create_directories(directory, ignored);  // what is written then says whether it worked
    std::ostringstream page;
    page << "<!doctype html><meta charset=\"utf-8\"><title>what the robot knew</title>\n"
            "<style>body{font:15px sans-serif;margin:2em}img{max-width:100%;border:1px solid #ccc}</style>\n"
            "<h1>What the robot knew</h1>\n<p>What its camera saw, its map, and the semantic network, whenever the "
            "robot said something or one of the objects had changed.</p>\n";
    for (size_t i = 0; i < used_; ++i) write(i, directory, page);
    if (left_out_ > 0)
      page << "<p>" << left_out_ << " more are not shown: the node keeps the first " << moments_.size()
           << " (parameter most).</p>\n";
    complain(write_file(directory / "index.html", page.str()));
  }

  /// The moments are left out: those of a replay are its own.
  void remember(StateArchive& archive) override { TAKT_STATE(archive, before_); }

 private:
  static constexpr size_t kMostCharacters = 2048;

  /// Names and attributes of the message before.
  class Before {
   public:
    void reserve(size_t objects, size_t attributes) { names_.reserve(objects), attributes_.reserve(attributes); }
    /// True if the message has other ones, which are kept.
    bool take(const ObjectReports& reports) {
      const auto names = reports.names.items();
      const auto attributes = reports.attributes.items();
      if (same(names, names_) && same(attributes, attributes_)) return false;
      copy(names, names_);
      copy(attributes, attributes_);
      return true;
    }
    void remember(StateArchive& archive) { TAKT_STATE(archive, names_, attributes_); }

   private:
    static bool equal(const ObjectName& a, const ObjectName& b) {
      return text_in(a.name) == text_in(b.name) && text_in(a.type) == text_in(b.type);
    }
    static bool equal(const ObjectAttribute& a, const ObjectAttribute& b) {
      return text_in(a.name) == text_in(b.name) && text_in(a.value) == text_in(b.value);
    }
    template <class T>
    static bool same(std::span<const T> a, const std::vector<T>& b) {
      return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const T& x, const T& y) { return equal(x, y); });
    }
    template <class T>
    static void copy(std::span<const T> from, std::vector<T>& to) {
      to.assign(from.begin(), from.begin() + static_cast<ptrdiff_t>(std::min(from.size(), to.capacity())));
    }
    std::vector<ObjectName> names_;
    std::vector<ObjectAttribute> attributes_;
  };

  static size_t size_of(const InputPort& port) {
    return port.connected() ? port.capacity().pixels() * port.capacity().channels : 0;
  }

  static void take(const TextStatus& status, std::string& into) {
    const auto words = status.text.items();
    into.assign(words.data(), std::min(words.size(), kMostCharacters));
  }

  void keep(int64_t now_ns, const ObjectReports* reports, bool spoke, Moment& into) {
    into.at_ns = now_ns;
    if (spoke) take(*speech_.newest(), into.said);
    if (const TextStatus* plan = plan_.newest()) take(*plan, into.plan);
    if (reports)
      semantic::for_each_report(*reports, [&](const semantic::Report& report) {
        if (into.objects.size() == into.objects.capacity() ||
            into.attributes.size() + report.attributes.size() > into.attributes.capacity())
          return;
        KnownObject& object = into.objects.emplace_back();
        semantic::set_text(report.name, object.name.name);
        semantic::set_text(report.type, object.name.type);
        object.x_m = report.place.x_m, object.y_m = report.place.y_m;
        into.attributes.insert(into.attributes.end(), report.attributes.begin(), report.attributes.end());
        object.attributes_end = into.attributes.size();
      });
    if (const Odometry* odometry = odometry_.newest())
      into.robot = PlanarPose{odometry->x_m, odometry->y_m, odometry->theta_rad};
    if (const Grid* grid = grid_.newest(); grid && into.cells.keep(grid->cells.items(), grid->width, grid->height)) {
      into.cell_m = grid->cell_m;
      into.origin_x_m = grid->origin_x_m + grid->grid_in_map.x;
      into.origin_y_m = grid->origin_y_m + grid->grid_in_map.y;
    }
    keep_left(into);
  }

  void keep_left(Moment& into) const {
    if (pair_.empty()) return;
    const ImageWithBoxes found = newest_with_boxes(pair_, detections_);
    const StereoPair& pair = pair_[found.image];
    if (into.left.keep(pair.left.items(), pair.width, pair.height, pair.channels) && found.boxes)
      keep_boxes(detections_[*found.boxes], into.boxes);
  }

  void write(size_t i, const std::filesystem::path& directory, std::ostream& page) const {
    const Moment& moment = moments_[i];
    const std::string file = (i < 9 ? "0" : "") + std::to_string(i + 1) + ".png";
    complain(write_image(directory / file, draw_moment(moment)));
    char at[32];
    std::snprintf(at, sizeof at, "%.1f s", static_cast<double>(moment.at_ns - moments_[0].at_ns) * 1e-9);
    page << "<h2>" << at << (moment.said.empty() ? "" : ": \"" + as_text(moment.said) + "\"") << "</h2>\n<img src=\""
         << file << "\" alt=\"camera image, map and network\">\n<pre>" << as_text(moment.plan) << "</pre>\n";
  }

  static void complain(const tl::expected<void, OutputFailure>& done) {
    if (!done)
      std::cerr << "moments: " << done.error().what << "; check that the folder exists, is writable and has room\n";
  }

  Input<ObjectReports> reports_{this, "reports", "what is known, in the map frame"};
  Input<TextStatus> speech_{this, "speech", "what the robot says", Need::optional};
  Input<TextStatus> plan_{this, "plan", "what it is about to do", Need::optional};
  Input<Odometry> odometry_{this, "odometry", "the robot in the map", Need::optional};
  Input<Grid> grid_{this, "grid", "axes of the map frame", Need::optional};
  Input<StereoPair> pair_{this, "pair", "what it sees; depth 4", Need::optional};
  Input<Detections> detections_{this, "detections", "boxes on the image of their stamp; depth 4", Need::optional};
  Param<std::string> directory_name_{this, "directory", "moments", "",
                                     "where to write, below the run's output directory"};
  Param<int> most_{this, "most", 24, {1, 1000}, "", "moments kept, the first ones", kSizesMemory};

  std::filesystem::path output_;
  std::vector<Moment> moments_;
  size_t used_ = 0, left_out_ = 0;
  Before before_;
};

}  // namespace

void register_moments(NodeTypes& types) {
  types.add<MomentsNode>(
      "moments", Layer::storage,
      "Sink: what the robot saw, its map and its semantic network whenever they change, as pictures in a page");
}

}  // namespace takt
