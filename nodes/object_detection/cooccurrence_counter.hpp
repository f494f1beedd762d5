// SPDX-License-Identifier: Apache-2.0
// Pairs of pixels by their colours and their distance (thesis Sec. 3.4.2; ).
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace takt::object_detection {

constexpr int kMaxDistance = 25;

/// Bin of the unordered pair of colours a <= b at distance k = 1 .. distances among `colours`: each pair of pixels is
/// counted once. The ordered array of the thesis has each count twice, (a, b) and (b, a), or once more in (a, a);
/// errors over the reference's mass are the same.
constexpr size_t pair_bin(int a, int b, int k, int colours, int distances) {
  return static_cast<size_t>((a * (2 * colours - a + 1) / 2 + b - a) * distances + k - 1);
}
constexpr size_t pair_bins(int colours, int distances) {
  return static_cast<size_t>(colours * (colours + 1) / 2 * distances);
}

/// Co-occurrences inside a square of pixels, exactly: pairs that lie in it as a whole, k = round(sqrt(dx^2 + dy^2)).
///
/// A ring of distances is the difference of two discs, and a disc consists of one run of pixels in each row. For a
/// colour and each row the lengths of all runs are counted first (26 per pixel instead of 2,052 offsets); a disc of
/// radius k is then the sum of k runs, for a row of pixels at once in bytes: sums wrap, but no ring has more than 84
/// pixels in a half plane. Memory is taken by the constructor. One thread at a time.
class CooccurrenceCounter {
 public:
  static constexpr int kMaxColours = 32;

  /// `side` 1 .. 255 px, `distances` 1 .. kMaxDistance.
  CooccurrenceCounter(int side, int distances);

  /// `colour`: side x side indices, row by row; pixels of `colours` (1 .. kMaxColours) and above take part in no pair.
  /// `count`: pair_bins(colours, distances) numbers.
  void count(const uint8_t* colour, int colours, uint32_t* count);

 private:
  uint32_t load(const uint8_t* colour, int colours);
  void count_around(uint8_t b);

  int side_, distances_;
  size_t width_, stride_;          ///< of a row, padded; and with its margins
  std::vector<size_t> run_of_;     ///< for k = 1 .. distances and dy = 1 .. k: offset of the run from those of a row
  std::vector<uint8_t> colours_;   ///< in the margins there is no colour
  std::vector<uint8_t> runs_;      ///< per row: run_lengths of one colour
  std::vector<uint32_t> present_;  ///< per row: the colours there, one bit each
  std::vector<uint64_t> sums_;     ///< of add_rings
};

}  // namespace takt::object_detection
