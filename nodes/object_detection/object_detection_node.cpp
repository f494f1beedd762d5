// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "nodes/cuda/accelerator.hpp"
#include "nodes/object_detection/reloader.hpp"
#include "nodes/object_detection/revisions.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/image.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace object_detection;

class ObjectDetectionNode final : public Node {
 public:
  void setup(Setup& setup) override {
    const Capacity& images = pair_.capacity();
    if (images.channels != 3)
      throw SetupError("`pair` has " + std::to_string(images.channels) +
                       " channel(s), must have three: objects are found by their colour");
    DetectorParameters p;
    p.last = static_cast<Stage>(stages_());
    p.bins = static_cast<ColourBins>(bins_());
    p.orientations = std::array{8, 32, 180, 360}[orientations_()];
    p.pairs = std::array<PairBins, 4>{{{5, 5}, {20, 5}, {5, 25}, {20, 25}}}[pairs_()];
    p.window_px = window_;
    p.smallest = smallest_;
    p.tolerance = tolerance_;
    p.threshold_scale = threshold_scale_;
    try {
      p.scales = parse_scales(scales_);
      const auto make = [p, width = static_cast<int>(images.width), height = static_cast<int>(images.height)](
                            const std::vector<DatabaseObject>& database, const std::vector<Photograph>& backgrounds) {
        return std::make_unique<Detector>(width, height, database, p, backgrounds);
      };
      const auto folder = setup.directory / database_();
      const auto database = read_database(folder, reference_, TestViews::skip);
      const auto backgrounds = read_backgrounds(folder);
      detector_ = make(database, backgrounds);
      const auto card = accelerator_.take([&](const cuda::CardUse& use) { detector_->use(use); },
                                          [&] { return detector_->card_is_quicker(setup.clock); });
      if (!card) detector_->leave_card("");
      build_ = [make, folder, database, backgrounds, known = ClassIds(database), card,
                side_px = reference_()](const std::string& revision) mutable {
        if (revision.empty()) return on_card(card, make(database, backgrounds));
        const auto changed = read_revision(folder, revision, side_px);
        auto detector = make(changed, read_backgrounds(revision_folder(folder, revision)));
        detector->set_class_ids(known.of(changed));
        return on_card(card, std::move(detector));
      };
    } catch (const DatabaseError& error) {
      throw SetupError(error.what());
    } catch (const std::invalid_argument& error) {
      throw SetupError(error.what());
    }
    for (std::string* name : {&in_use_, &asked_, &refused_}) name->reserve(Reloader::kLongestRevision);
    taken_.reserve(kHistory);
    virtual_time_ = setup.clock.is_virtual();
    may(bit(JobCall::sleep), "in virtual time and in a replay a job waits for the database that it changes to");
    mask_sums_.emplace(mask_.connected() ? mask_.capacity().pixels() : 0);
    detections_.reserve({0, 0, 1, static_cast<uint32_t>(max_detections_())});
    const SearchGrid& grid = detector_->grid();
    roi_.reserve({static_cast<uint32_t>(grid.columns), static_cast<uint32_t>(grid.rows), 1, 0});
  }

  void start(int64_t) override { reloader_.emplace(build_); }

  void run(Job& job) override {
    follow_revision(job);
    const StereoPair* pair = pair_.newest();
    if (!pair || !pair_.is_new()) return job.no_result();
    const auto time_left_ns = [&] { return job.time_left_ns(); };
    if (!detector_->run_within(pair->left_view(), take_mask(), time_left_ns, static_cast<int64_t>(reserve_() * 1e9)))
      return job.no_result();
    accelerator_.tell(job, "counts co-occurrences", detector_->trouble());
    Detections* found = detections_.connected() ? detections_.loan() : nullptr;
    if (found != nullptr) {
      found->image_width = pair->width;
      found->image_height = pair->height;
      found->searched = detector_->searched();
      found->boxes.resize(static_cast<size_t>(max_detections_()));
      found->boxes.resize(detector_->detections(min_score_, found->boxes.items()));
      detections_.send(pair_.stamp_ns());
    }
    Image* roi = roi_.connected() ? roi_.loan() : nullptr;
    if (roi != nullptr) {
      roi->width = detector_->grid().columns;
      roi->height = detector_->grid().rows;
      roi->channels = 1;
      roi->health = pair->health;
      roi->pixels.resize(static_cast<size_t>(detector_->grid().windows()));
      detector_->region_of_interest(roi->view());
      roi_.send(pair_.stamp_ns());
    }
    if ((detections_.connected() && found == nullptr) || (roi_.connected() && roi == nullptr)) job.no_result();
  }

  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, in_use_, asked_, refused_, taken_, rest_, building_);
    if (archive.loads() && !archive.failed() && !take_up_again()) archive.fail();
    if (!archive.failed()) TAKT_STATE(archive, detector_);
  }

 private:
  /// A card may have less memory left than at the start.
  static std::unique_ptr<Detector> on_card(const std::optional<cuda::CardUse>& card,
                                           std::unique_ptr<Detector> detector) {
    if (!card) return detector;
    try {
      detector->use(*card);
    } catch (const std::runtime_error& error) {
      detector->leave_card(error.what());
    }
    return detector;
  }

  /// Detector and class ids are those that all revisions so far lead to. False: one of them cannot be read any more.
  bool take_up_again() {
    try {
      std::istringstream lines(taken_);
      std::string revision;
      for (std::string line; std::getline(lines, line);) detector_ = build_(revision = line);
      if (revision != in_use_) detector_ = build_(in_use_);
    } catch (const std::exception&) {
      return false;
    }
    reloader_.emplace(build_);
    if (building_) reloader_->ask(asked_);
    return true;
  }

  /// The database changes between two images: once the new one is complete, in one step. One that cannot be used is
  /// asked for again now and then: it may have been wanted before it was published.
  void follow_revision(Job& job) {
    if (!reloader_) return;
    const auto wanted = std::string_view(revision_()).substr(0, Reloader::kLongestRevision);
    if (wanted != refused_) rest_ = 0;
    if (rest_ > 0) --rest_;
    if (!building_ && wanted != in_use_ && rest_ == 0) {
      asked_.assign(wanted);
      reloader_->ask(asked_);
      building_ = true;
    }
    if (!building_ || !job.is_done(virtual_time_ || reloader_->built())) return;
    reloader_->wait();
    building_ = false;
    if (reloader_->exchange(detector_)) {
      in_use_.assign(asked_);
      if (!in_use_.empty() && taken_.size() + in_use_.size() < taken_.capacity()) (taken_ += in_use_) += '\n';
      refused_.clear();
    } else {
      if (refused_ != asked_) job.results_doubtful(reloader_->error());
      refused_.assign(asked_);
      rest_ = kRest;
    }
  }

  /// Null if there is none for the pair: all of the image is searched.
  const MaskSums* take_mask() {
    const Image* mask = mask_.newest();
    if (mask == nullptr || mask_.stamp_ns() != pair_.stamp_ns() || mask->channels != 1 || mask->pixels.size == 0)
      return nullptr;
    mask_sums_->take(mask->view());
    return &*mask_sums_;
  }

  Input<StereoPair> pair_{this, "pair", "the left image is searched; three channels"};
  Input<Image> mask_{this, "mask", "one channel, same stamp, any size: only windows with a pixel that is not 0",
                     Need::optional};
  Output<Detections> detections_{this, "detections",
                                 "class_id: index of the object in the database as it was at the start; best first"};
  Output<Image> roi_{
      this, "roi",
      "one pixel per search window of the first scale, 255 where it passed, or one of another scale around its middle"};

  static constexpr Fixed kLearntAtStart{"learnt at start"};
  Param<std::string> database_{this, "database", "objects", kPath,
                               "folder with objects.txt and the reference views it names"};
  Param<std::string> scales_{this,
                             "scales",
                             "1",
                             "1",
                             "of the image at which windows are searched, such as 1+0.7+0.5; falling, 0.5 or more",
                             kSizesMemory};
  Param<std::string> revision_{this, "revision", "", "",
                               "of the database, as `takt objects publish` names it; empty: as it was at the start"};
  Choice stages_{this,
                 "stages",
                 "ch+hog+cch",
                 {"ch", "ch+hog", "ch+hog+cch", "ch+hog+cch+layout"},
                 "colours, oriented gradients, colour co-occurrences, and where these are; each looks at what passed "
                 "the one before",
                 kLearntAtStart};
  Choice bins_{this, "bins", "64x64x1", {"64x32x2", "64x64x1"}, "bins of hue x saturation x value", kLearntAtStart};
  Choice orientations_{
      this, "orientations", "360", {"8", "32", "180", "360"}, "bins of the gradient's orientation", kLearntAtStart};
  Choice pairs_{
      this,          "pairs", "20x25", {"5x5", "20x5", "5x25", "20x25"}, "colours x distances of co-occurrences",
      kLearntAtStart};
  Param<int> reference_{this, "reference", 48, {4, 254}, "px", "edge of the reference views", kLearntAtStart};
  Param<int> window_{this,        "window", 64,
                     {5, 255},    "px",     "edge of a search window; neighbours overlap by the reference's edge",
                     kSizesMemory};
  Param<double> smallest_{
      this,          "smallest",
      0.7,           {0.5, 1.0},
      "1",           "size, of the views' edge, down to which objects are found: views are compared with at that size",
      kLearntAtStart};
  Param<double> tolerance_{this,          "tolerance",
                           0.4,           {0.0, 0.75},
                           "1",           "share of an object that may be hidden; added to automatic thresholds",
                           kLearntAtStart};
  Param<double> threshold_scale_{
      this, "threshold_scale", 1.0, {0.05, 4.0}, "1", "factor on the thresholds of the database", kLearntAtStart};
  Param<double> min_score_{this,       "min_score", 0.3,
                           {0.0, 1.0}, "1",         "smallest score (1 - error) of a detection; roi is not affected"};
  Param<double> reserve_{this,       "reserve", 0.001,
                         {0.0, 1.0}, "s",       "with less time left than this the search ends and its best is sent"};
  Param<int> max_detections_{this, "max_detections", 32, {1, 1000}, "", "the best are kept", kSizesMemory};

  cuda::Accelerator accelerator_{this};

  std::function<std::unique_ptr<Detector>(const std::string&)> build_;
  std::unique_ptr<Detector> detector_;
  static constexpr size_t kHistory = 16'384;  ///< characters
  static constexpr int kRest = 16;            ///< jobs until what could not be used is asked for again
  std::string in_use_, asked_, refused_;      ///< revisions; refused: the last that could not be used, said once
  std::string taken_;  ///< all that were in use but that of the start, a line each, as far as there is room
  int rest_ = 0;
  bool building_ = false, virtual_time_ = false;
  std::optional<MaskSums> mask_sums_;
  std::optional<Reloader> reloader_;  ///< last: its thread uses the rest
};

}  // namespace

void register_object_detection(NodeTypes& types) {
  types.add<ObjectDetectionNode>("object_detection", Layer::perception,
                                 "Known objects by a cascade of histograms on a grid of windows");
}

}  // namespace takt
