// SPDX-License-Identifier: Apache-2.0
// Internal: what the plug-in takt-cuda can do, as a table of functions. C++17, as the compilers of CUDA know it: the
// host is built with another one.
//
//   const Table& cuda = load_component<Table>("libtakt_cuda.so", "takt_cuda", fix);
//   char why[kWhyBytes];
//   StereoOnCard* stereo = cuda.make_stereo(&shape, 0, why);         // null: `why` says what is wrong
//   if (cuda.match(stereo, &call, 1'000'000) != Outcome::done) ...   // the CPU does it
#pragma once
#include <cstddef>
#include <cstdint>

namespace takt::cuda {

constexpr size_t kWhyBytes = 256;

/// Of one matcher; the numbers are those of stereo::MatcherParameters, which problem() has not objected to.
struct StereoShape {
  int32_t width, height, channels;
  int32_t disparities;
  int32_t cost;  ///< 0 gradient, 1 ssd, 2 sad, 3 census
  int32_t c_max, n_square, n_min, uniqueness;
  int32_t subpixel, median, left_right_check;
  int32_t semi_global;  ///< selection of the census cost with n_square 1; else winner
};

/// One pair. Strides in elements. Memory that was not registered costs a copy by the CPU.
struct StereoCall {
  const uint8_t *left, *right;
  ptrdiff_t left_stride, right_stride;
  int16_t* disparity;
  uint8_t *confidence, *fraction;  ///< `fraction` may be null
  ptrdiff_t disparity_stride, confidence_stride, fraction_stride;
  int32_t disparities, min_confidence;
  int32_t p1, p2;  ///< semi_global
};

enum class Outcome : int32_t {
  done,
  late,   ///< not within the time that it was given; nothing is written
  failed  ///< CUDA says so, or it stands still while it writes: the card is not asked again
};

/// An object of a co-occurrence stage (nodes/object_detection): the histograms of its views over the colours that any
/// of them has.
struct CooccurrenceObject {
  int32_t colours, views;
  const uint8_t* colour_of_slot;  ///< rising
  const uint32_t* rows;           ///< of a view, in the order of pair_bin() of its slots
  ptrdiff_t row_stride;
};
struct CooccurrenceShape {
  int32_t width, height;  ///< of images with three channels
  int32_t side;           ///< of a window, px
  int32_t colours, distances;
  int32_t windows;  ///< most in a call, each with all objects
  int32_t objects;
  const CooccurrenceObject* of_object;
};
struct CardWindow {
  int32_t x, y;
};
struct CardQuestion {
  int32_t window, object;
};
struct CooccurrenceCall {
  const uint8_t* bgr;
  ptrdiff_t stride;
  const CardWindow* windows;
  int32_t windows_count;
  const CardQuestion* questions;
  int32_t questions_count;
  uint32_t* missing;  ///< questions x most views of an object
};

struct StereoOnCard;
struct CooccurrencesOnCard;

/// Functions of one StereoOnCard or CooccurrencesOnCard: one thread at a time. All others: any thread. `why` has
/// kWhyBytes.
struct Table {
  const char* abi;  ///< kAbi of the plug-in (load_component)
  /// How many cards there are; negative: CUDA's error, in words in `why`.
  int32_t (*cards)(char* why);
  void (*card_name)(int32_t card, char* name);
  /// Takes memory, captures the work and does it twenty times: 0.2 s and more. Null: `why`.
  StereoOnCard* (*make_stereo)(const StereoShape* shape, int32_t card, char* why);
  /// Waits up to `bound_ns`, and 20 ms more for one that writes already, without an allocation or a call that the
  /// driver may block.
  Outcome (*match)(StereoOnCard* stereo, const StereoCall* call, int64_t bound_ns);
  void (*free_stereo)(StereoOnCard* stereo);
  /// As the three above.
  CooccurrencesOnCard* (*make_cooccurrences)(const CooccurrenceShape* shape, int32_t card, char* why);
  Outcome (*find_missing)(CooccurrencesOnCard* cooccurrences, const CooccurrenceCall* call, int64_t bound_ns);
  void (*free_cooccurrences)(CooccurrencesOnCard* cooccurrences);
  /// Pages that cards may read and write from now on. False: CUDA refuses.
  bool (*register_memory)(void* memory, size_t bytes);
  void (*forget_memory)(void* memory);
};

}  // namespace takt::cuda
