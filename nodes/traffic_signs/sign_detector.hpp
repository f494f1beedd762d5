// SPDX-License-Identifier: Apache-2.0
// All cascades over one image, where signs may be and as far as time allows (R-5.2, C-11).
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "nodes/traffic_signs/colour_regions.hpp"
#include "nodes/traffic_signs/search.hpp"
#include "nodes/traffic_signs/sign_list.hpp"
#include "rt/state_archive.hpp"

namespace takt::traffic_signs {

/// A sign in an image.
struct Sighting {
  size_t sign = 0;  ///< index in the list
  Box box;          ///< of the sign, without the margin of its cascade's window
  int hits = 0;     ///< windows that passed there
};

struct SignDetectorParameters {
  double scale_factor = 1.15;
  int least_hits = 2;        ///< windows that must agree on a sign with a colour layout, which decides as well
  int least_hits_alone = 5;  ///< on one without
  double least_fit = 0.1;    ///< of a sighting to the sign's colour layout, -1..1
};

/// The image is searched in rows of windows, from the largest scale to the smallest, the rows of all cascades at one
/// height together. Memory is taken by the constructor; run() allocates nothing. One thread at a time.
class SignDetector {
 public:
  static constexpr size_t kMostHits = 512;  ///< windows that pass, for each sign; later ones are left out
  static constexpr size_t kMostSightings = 64;

  /// Throws std::invalid_argument if a cascade does not fit into the image.
  SignDetector(int width, int height, std::vector<SignModel> signs, const SignDetectorParameters& parameters);

  /// From the next run() on; the scales stay as they were.
  void tune(SignDetectorParameters parameters) {
    parameters.scale_factor = parameters_.scale_factor;
    parameters_ = parameters;
  }

  std::span<const SignModel> signs() const { return signs_; }

  /// Searches an 8-bit BGR image; false, and nothing changed, if it has not the size or the channels. `expected`: where
  /// signs are likely, searched first. `roi`: one channel, of any size, spread over the image; windows whose middle
  /// lies on a 0 are left out; without data: none. `may_go_on` is asked before each row of windows; the next image is
  /// searched from where this one was left, after a whole image from the top.
  template <class MayGoOn>
  bool run(ImageView<const uint8_t> bgr, std::span<const Sighting> expected, ImageView<const uint8_t> roi,
           MayGoOn may_go_on) {
    if (!begin(bgr, roi)) return false;
    focus(expected);
    focused_ = true;
    for (size_t i = 0; i < focus_.size() && focused_; ++i)
      for (int row = focus_[i].first_row; row <= focus_[i].last_row && focused_; ++row)
        if (focused_ = may_go_on(); focused_) search_focus(focus_[i], row);
    size_t done = 0;
    while (done < rows_.size() && may_go_on()) {
      search_row(rows_[next_]);
      next_ = (next_ + 1) % rows_.size();
      ++done;
    }
    if (done == rows_.size()) next_ = 0;
    searched_ = static_cast<float>(done) / static_cast<float>(rows_.size());
    end(bgr);
    return true;
  }
  /// Of the last run(), the strongest first; no two overlap by half.
  std::span<const Sighting> sightings() const { return sightings_; }
  /// Share of the rows of windows that was searched, 0..1.
  float searched() const { return searched_; }
  /// Whether all of what was expected was searched.
  bool focused() const { return focused_; }
  void remember(StateArchive& archive) { TAKT_STATE(archive, next_); }

 private:
  struct Row {
    int level, row;
  };
  /// Windows of one cascade that a sign is expected in; the general search leaves them out.
  struct Focus {
    size_t sign;
    int level, first_row, last_row, first_column, last_column;
  };
  bool begin(ImageView<const uint8_t> bgr, ImageView<const uint8_t> roi);
  void focus(std::span<const Sighting> expected);
  void search_focus(const Focus& focus, int row);
  void search_row(const Row& row);
  void build(int level);
  bool in_roi(const Box& window) const;
  /// Whether `area` holds as many pixels of the sign's colour as `window` must.
  bool has_colour(size_t sign, const Box& area, const Box& window) const;
  void take_passed(size_t sign, int level, int row, std::span<const uint8_t> passed);
  void end(ImageView<const uint8_t> bgr);

  std::vector<SignModel> signs_;
  SignDetectorParameters parameters_;
  Search search_;
  ColourRegions colours_;
  ImageView<const uint8_t> roi_;
  std::vector<uint8_t> grey_;
  std::vector<uint8_t> built_;  ///< levels of this image
  std::vector<Row> rows_;       ///< all, in order
  std::vector<Focus> focus_;
  std::vector<uint8_t> wanted_, passed_;
  std::vector<std::vector<Box>> hits_;  ///< sign by sign
  Grouping grouping_;
  std::vector<Sighting> sightings_;
  size_t next_ = 0;
  float searched_ = 0;
  bool focused_ = false;
};

}  // namespace takt::traffic_signs
