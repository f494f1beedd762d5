// SPDX-License-Identifier: Apache-2.0
#include "nodes/person_tracking/chessboard_finder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace takt::person_tracking {
namespace {

constexpr int kApart_px = 2;  // peaks are farther apart than this, across and down

Region cut(const Region& r, int width, int height) {
  const int x = std::clamp(r.x, 0, width), y = std::clamp(r.y, 0, height);
  return {x, y, std::clamp(r.x + r.width, x, width) - x, std::clamp(r.y + r.height, y, height) - y};
}

/// Where a parabola through three values, the middle one the largest, has its vertex.
float vertex(int before, int middle, int after) {
  const int bend = before - 2 * middle + after;
  return bend >= 0 ? 0 : 0.5f * static_cast<float>(before - after) / static_cast<float>(bend);
}

}  // namespace

ChessboardFinder::ChessboardFinder(int width, int height, int channels, const FinderParameters& parameters)
    : width_(width), height_(height), channels_(channels), p_(parameters) {
  const auto row = static_cast<size_t>(width + kRowSlack), rows = static_cast<size_t>(height);
  grey_.resize(row * rows);
  line_.resize(row);
  sums_.resize(row);
  response_.resize(row * rows);
  peaks_.reserve((static_cast<size_t>(width) / (kApart_px + 1) + 1) * (rows / (kApart_px + 1) + 1));
  corners_.reserve(kMostCorners);
  neighbour_.resize(4 * kMostCorners);
  parent_.resize(kMostCorners);
  lengths_.reserve(2 * kMostCorners);
  boards_.reserve(kMostBoards);
}

int ChessboardFinder::level_for(double square_px) {
  int level = 0;
  for (; level + 1 < kLevels && square_px >= 10; ++level) square_px /= 2;
  return level;
}

std::span<const Board> ChessboardFinder::find(ImageView<const uint8_t> image, const Region& wanted, int level) {
  const Region region = cut(wanted, std::min(width_, image.width), std::min(height_, image.height));
  boards_.clear();
  corners_.clear();
  shrink(image, region, level);
  find_peaks();
  const auto stronger = [](const Peak& a, const Peak& b) {
    return a.response != b.response ? a.response > b.response : a.y != b.y ? a.y < b.y : a.x < b.x;
  };
  if (peaks_.size() > kMostCorners) {
    std::nth_element(peaks_.begin(), peaks_.begin() + kMostCorners, peaks_.end(), stronger);
    peaks_.resize(kMostCorners);
    std::sort(peaks_.begin(), peaks_.end(),
              [](const Peak& a, const Peak& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; });
  }
  for (const Peak& peak : peaks_) corners_.push_back(refined(peak, region, level));
  const double scale = 1 << level;
  link(p_.square_max_px * scale);
  gather(scale);
  return boards_;
}

/// The region in grey, each pixel of the level the mean of its square in the image.
void ChessboardFinder::shrink(ImageView<const uint8_t> image, const Region& region, int level) {
  const int width = region.width >> level, height = region.height >> level, edge = 1 << level;
  level_ = {grey_.data(), width, height, 1, width + kRowSlack};
  for (int y = 0; y < height; ++y) {
    std::fill_n(sums_.begin(), width, uint16_t{0});
    for (int k = 0; k < edge; ++k) {
      const uint8_t* from = image.row(region.y + (y << level) + k) + ptrdiff_t{region.x} * image.channels;
      uint8_t* grey = level == 0 ? level_.row(y) : line_.data();
      if (image.channels == 3) grey_row(from, width << level, grey);
      else std::copy_n(from, width << level, grey);
      const auto add = [&](int x, int sum) {
        uint16_t& to = sums_[static_cast<size_t>(x)];
        to = static_cast<uint16_t>(to + sum);
      };
      if (level == 1)
        for (int x = 0; x < width; ++x) add(x, grey[2 * x] + grey[2 * x + 1]);
      if (level == 2)
        for (int x = 0; x < width; ++x) add(x, grey[4 * x] + grey[4 * x + 1] + grey[4 * x + 2] + grey[4 * x + 3]);
    }
    if (level > 0)
      for (int x = 0; x < width; ++x)
        level_.row(y)[x] = static_cast<uint8_t>(sums_[static_cast<size_t>(x)] >> (2 * level));
  }
}

/// Pixels whose response is the largest around them.
void ChessboardFinder::find_peaks() {
  peaks_.clear();
  const int first = kRingRadius + kApart_px, last_x = level_.width - first, last_y = level_.height - first;
  for (int y = kRingRadius; y < level_.height - kRingRadius; ++y)
    saddle_row(level_, y, response_.data() + y * level_.stride);
  for (int y = first; y < last_y; ++y) {
    const int16_t* row = response_.data() + y * level_.stride;
    for (int x = first; x < last_x; ++x)
      if (row[x] >= p_.response_min && is_peak(x, y)) peaks_.push_back({x, y, row[x]});
  }
}

/// Of equal ones the first counts, so that no two peaks are within kApart_px of each other.
bool ChessboardFinder::is_peak(int x, int y) const {
  const int16_t* middle = response_.data() + y * level_.stride + x;
  for (int dy = -kApart_px; dy <= kApart_px; ++dy)
    for (int dx = -kApart_px; dx <= kApart_px; ++dx) {
      const int16_t other = middle[dy * level_.stride + dx];
      if (other > *middle || (other == *middle && (dy < 0 || (dy == 0 && dx < 0)))) return false;
    }
  return true;
}

Corner ChessboardFinder::refined(const Peak& peak, const Region& region, int level) const {
  const int16_t* r = response_.data() + peak.y * level_.stride + peak.x;
  const ptrdiff_t down = level_.stride;
  const float x = static_cast<float>(peak.x) + vertex(r[-1], r[0], r[1]),
              y = static_cast<float>(peak.y) + vertex(r[-down], r[0], r[down]);
  // The ring's second harmonic: brightness over the angle goes round twice.
  constexpr float kHalf = 0.70710678f;
  constexpr float kCosine[8] = {1, kHalf, 0, -kHalf, -1, -kHalf, 0, kHalf},
                  kSine[8] = {0, kHalf, 1, kHalf, 0, -kHalf, -1, -kHalf};
  float cosine = 0, sine = 0;
  for (size_t n = 0; n < 16; ++n) {
    const auto v = static_cast<float>(level_.at(peak.x + kRing[n].x, peak.y + kRing[n].y));
    cosine += kCosine[n % 8] * v;
    sine += kSine[n % 8] * v;
  }
  const float length = std::max(1e-6f, std::hypot(cosine, sine)), scale = static_cast<float>(1 << level),
              middle = (scale - 1) / 2;
  return {static_cast<float>(region.x) + x * scale + middle, static_cast<float>(region.y) + y * scale + middle,
          cosine / length, sine / length, peak.response};
}

/// On which side of `from` the corner `to` lies, 0..3: along one of the two edges that meet there; -1: along none, or
/// it is no neighbour on a board.
int ChessboardFinder::side_of(size_t from, size_t to) const {
  const Corner &a = corners_[from], &b = corners_[to];
  if (a.polarity_x * b.polarity_x + a.polarity_y * b.polarity_y > static_cast<float>(p_.polarity_max)) return -1;
  // Edges lie 45 degrees beside the bright squares.
  const float angle = 0.5f * std::atan2(a.polarity_y, a.polarity_x) + 0.78539816f;
  const float x = b.x - a.x, y = b.y - a.y, s = std::sin(angle), c = std::cos(angle);
  const float along = s * x - c * y, across = c * x + s * y;
  const auto beside = static_cast<float>(p_.beside_max);
  if (std::abs(across) <= beside * std::abs(along)) return along > 0 ? 0 : 2;
  if (std::abs(along) <= beside * std::abs(across)) return across > 0 ? 1 : 3;
  return -1;
}

/// The nearest corner on each side of each.
void ChessboardFinder::link(double reach_px) {
  const size_t count = corners_.size();
  std::fill_n(neighbour_.begin(), 4 * count, kNone);
  const auto reach = static_cast<float>(reach_px);
  const auto squared = [&](size_t a, size_t b) {
    const float x = corners_[a].x - corners_[b].x, y = corners_[a].y - corners_[b].y;
    return x * x + y * y;
  };
  const auto offer = [&](size_t from, size_t to) {
    const int side = side_of(from, to);
    if (side < 0) return;
    int16_t& nearest = neighbour_[4 * from + static_cast<size_t>(side)];
    if (nearest == kNone || squared(from, to) < squared(from, static_cast<size_t>(nearest)))
      nearest = static_cast<int16_t>(to);
  };
  for (size_t a = 0; a < count; ++a)
    for (size_t b = a + 1; b < count && corners_[b].y - corners_[a].y <= reach + 1; ++b) {
      if (squared(a, b) > reach * reach) continue;
      offer(a, b);
      offer(b, a);
    }
}

size_t ChessboardFinder::root_of(size_t corner) {
  while (static_cast<size_t>(parent_[corner]) != corner) {
    parent_[corner] = parent_[static_cast<size_t>(parent_[corner])];
    corner = static_cast<size_t>(parent_[corner]);
  }
  return corner;
}

/// Boards: corners that are joined by links, which both of their ends must have chosen.
void ChessboardFinder::gather(double margin_px) {
  const size_t count = corners_.size();
  for (size_t i = 0; i < count; ++i) parent_[i] = static_cast<int16_t>(i);
  const auto linked = [&](size_t a, size_t side) {
    const int16_t b = neighbour_[4 * a + side];
    if (b == kNone) return false;
    const auto* sides = &neighbour_[4 * static_cast<size_t>(b)];
    return std::find(sides, sides + 4, static_cast<int16_t>(a)) != sides + 4;
  };
  for (size_t a = 0; a < count; ++a)
    for (size_t side = 0; side < 4; ++side)
      if (linked(a, side))
        parent_[root_of(a)] = static_cast<int16_t>(root_of(static_cast<size_t>(neighbour_[4 * a + side])));
  for (size_t root = 0; root < count; ++root) {
    if (root_of(root) != root) continue;
    Board board;
    constexpr float kFar = std::numeric_limits<float>::infinity();
    float left = kFar, top = kFar, right = -kFar, bottom = -kFar;
    size_t upright = 0;
    lengths_.clear();  // those of upright links first
    for (size_t a = 0; a < count; ++a) {
      if (root_of(a) != root) continue;
      const Corner& corner = corners_[a];
      if (board.corners < static_cast<int>(Board::kMostPlaces))
        board.places[static_cast<size_t>(board.corners)] = {corner.x, corner.y};
      ++board.corners;
      left = std::min(left, corner.x), right = std::max(right, corner.x);
      top = std::min(top, corner.y), bottom = std::max(bottom, corner.y);
      for (size_t side = 0; side < 4; ++side) {
        if (!linked(a, side) || static_cast<size_t>(neighbour_[4 * a + side]) < a) continue;
        const Corner& other = corners_[static_cast<size_t>(neighbour_[4 * a + side])];
        const float x = other.x - corner.x, y = other.y - corner.y;
        lengths_.push_back(std::hypot(x, y));
        if (std::abs(y) > std::abs(x)) std::swap(lengths_[upright++], lengths_.back());
      }
    }
    board.links = static_cast<int>(lengths_.size());
    if (board.corners < p_.corners_min || board.links < p_.links_per_corner * board.corners) continue;
    const auto used = static_cast<ptrdiff_t>(upright > 0 ? upright : lengths_.size());
    std::nth_element(lengths_.begin(), lengths_.begin() + used / 2, lengths_.begin() + used);
    board.square_px = lengths_[static_cast<size_t>(used / 2)];
    const double margin = std::max(margin_px, board.square_px);
    board.box = {static_cast<int>(std::lround(left - margin)), static_cast<int>(std::lround(top - margin)),
                 static_cast<int>(std::lround(right - left + 2 * margin)),
                 static_cast<int>(std::lround(bottom - top + 2 * margin))};
    if (boards_.size() < kMostBoards) boards_.push_back(board);
  }
  std::sort(boards_.begin(), boards_.end(), [](const Board& a, const Board& b) {
    return a.corners != b.corners ? a.corners > b.corners : a.box.y != b.box.y ? a.box.y < b.box.y : a.box.x < b.box.x;
  });
}

}  // namespace takt::person_tracking
