// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/on_card.cuh"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "nodes/object_detection/on_card_kernels.cuh"

namespace takt::cuda {
namespace {

constexpr unsigned kBlocks = 264;  // of the kernels that do little

struct Offset {
  int dx, dy;
};

/// By distance k = round(sqrt(dx^2 + dy^2)) = 1 .. distances: the offsets of half a ring, those of few rows first.
std::vector<std::vector<Offset>> half_rings(int distances) {
  std::vector<std::vector<Offset>> rings(static_cast<size_t>(distances) + 1);
  for (int dy = 0; dy <= distances; ++dy)
    for (int dx = dy == 0 ? 1 : -distances; dx <= distances; ++dx) {
      int k = 0;
      while (dx * dx + dy * dy > k * k + k) ++k;
      if (k <= distances) rings[static_cast<size_t>(k)].push_back({dx, dy});
    }
  return rings;
}

struct Piece {
  size_t ring, first, count;  ///< of its offsets
};
using Lanes = std::array<std::vector<Piece>, kLanes>;

/// The rings spread over the lanes, at most `most` offsets and two pieces in each; false: they do not fit.
bool spread(const std::vector<std::vector<Offset>>& rings, size_t most, Lanes& lanes) {
  lanes = {};
  std::vector<Piece> rests;
  size_t used = 0;
  for (size_t k = 1; k < rings.size(); ++k) {
    size_t first = 0;
    for (; rings[k].size() - first >= most; first += most) {
      if (used == lanes.size()) return false;
      lanes[used++].push_back({k, first, most});
    }
    if (first < rings[k].size()) rests.push_back({k, first, rings[k].size() - first});
  }
  std::sort(rests.begin(), rests.end(), [](const Piece& a, const Piece& b) { return a.count > b.count; });
  for (const Piece& rest : rests) {
    const auto fits = [&](const auto& lane) {
      return lane.empty() || (lane.size() == 1 && lane[0].count + rest.count <= most);
    };
    const auto lane = std::find_if(lanes.begin(), lanes.end(), fits);
    if (lane == lanes.end()) return false;
    lane->push_back(rest);
  }
  return true;
}

template <class T>
T* on_card(Memory& memory, const std::vector<T>& values) {
  T* at = memory.take<T>(std::max<size_t>(values.size(), 1));
  check(cudaMemcpy(at, values.data(), values.size() * sizeof(T), cudaMemcpyHostToDevice), "cudaMemcpy");
  return at;
}

}  // namespace

CooccurrencesOnCard::CooccurrencesOnCard(const CooccurrenceShape& shape, int card) : captured_(card) {
  work_.width = shape.width;
  work_.height = shape.height;
  work_.side = shape.side;
  work_.colours = shape.colours;
  work_.distances = shape.distances;
  work_.bins = object_detection::pair_bins(shape.colours, shape.distances);
  work_.pitch = (shape.side + 3) / 4 * 4 + 2 * kReach;
  take_references(shape);
  take_offsets(shape.distances);
  share_out(card);
  const auto pixels = static_cast<size_t>(shape.width) * static_cast<size_t>(shape.height),
             windows = static_cast<size_t>(shape.windows), questions = windows * static_cast<size_t>(shape.objects);
  work_.colour = card_memory_.take<uint8_t>(pixels);
  work_.counts = card_memory_.take<uint32_t>(windows * work_.bins);
  work_.found = card_memory_.take<uint32_t>(questions * static_cast<size_t>(work_.most_views));
  call_ = shared_memory_.take<CooccurrenceCall>(1);
  windows_ = shared_memory_.take<CardWindow>(windows);
  questions_ = shared_memory_.take<CardQuestion>(questions);
  missing_ = shared_memory_.take<uint32_t>(questions * static_cast<size_t>(work_.most_views));
  staged_image_ = shared_memory_.take<uint8_t>(3 * pixels);
  work_.call = call_;
  work_.withdrawn = captured_.withdrawn();
  captured_.capture([&](cudaStream_t stream) { enqueue(stream); },
                    [&](cudaStream_t stream) { write_missing<<<kBlocks, kComparingThreads, 0, stream>>>(work_); });
  // As much as there can be: a wait spins for what the longest of these takes.
  for (size_t i = 0; i < questions; ++i)
    questions_[i] = {static_cast<int32_t>(i % windows), static_cast<int32_t>(i / windows)};
  *call_ = {staged_image_, 3 * ptrdiff_t{shape.width},      windows_, shape.windows,
            questions_,    static_cast<int32_t>(questions), missing_};
  captured_.rehearse();
}

void CooccurrencesOnCard::take_references(const CooccurrenceShape& shape) {
  std::vector<CardReferences> objects;
  for (int i = 0; i < shape.objects; ++i) {
    const CooccurrenceObject& object = shape.of_object[i];
    CardReferences references{object.colours, object.views,
                              object_detection::pair_bins(object.colours, shape.distances), nullptr, nullptr};
    references.colour_of_slot =
        on_card(card_memory_, std::vector<uint8_t>(object.colour_of_slot, object.colour_of_slot + object.colours));
    std::vector<uint32_t> rows;
    for (int view = 0; view < object.views; ++view) {
      const uint32_t* row = object.rows + view * object.row_stride;
      rows.insert(rows.end(), row, row + references.bins);
    }
    references.rows = on_card(card_memory_, rows);
    objects.push_back(references);
    work_.most_views = std::max(work_.most_views, object.views);
  }
  work_.objects = on_card(card_memory_, objects);
}

void CooccurrencesOnCard::take_offsets(int distances) {
  const auto rings = half_rings(distances);
  Lanes lanes;
  size_t most = 1;
  while (!spread(rings, most, lanes)) ++most;
  work_.steps = static_cast<int>(most);
  std::vector<CardOffset> offsets(most * kLanes, {0, kNoOffset, 0});
  std::vector<std::vector<CardShare>> shares(rings.size());
  for (size_t lane = 0; lane < lanes.size(); ++lane) {
    std::vector<CardOffset> own;
    for (size_t half = 0; half < lanes[lane].size(); ++half) {
      const Piece& piece = lanes[lane][half];
      shares[piece.ring].push_back({static_cast<uint8_t>(lane), static_cast<uint8_t>(half)});
      for (size_t i = piece.first; i < piece.first + piece.count; ++i) {
        const Offset& offset = rings[piece.ring][i];
        own.push_back({static_cast<int16_t>(offset.dy * work_.pitch + offset.dx), static_cast<uint8_t>(offset.dy),
                       static_cast<uint8_t>(half)});
      }
      longest_piece_ = std::max(longest_piece_, static_cast<int>(piece.count));
    }
    std::sort(own.begin(), own.end(), [](const CardOffset& a, const CardOffset& b) { return a.below < b.below; });
    for (size_t step = 0; step < own.size(); ++step) offsets[step * kLanes + lane] = own[step];
  }
  std::vector<CardShare> all;
  std::vector<uint8_t> first;
  for (size_t k = 1; k < rings.size(); ++k) {
    first.push_back(static_cast<uint8_t>(all.size()));
    all.insert(all.end(), shares[k].begin(), shares[k].end());
  }
  first.push_back(static_cast<uint8_t>(all.size()));
  work_.offsets = on_card(card_memory_, offsets);
  work_.shares = on_card(card_memory_, all);
  work_.first_share = on_card(card_memory_, first);
}

/// As many rows of a window at once as a block of this card has memory for, and as many blocks as run at once.
void CooccurrencesOnCard::share_out(int card) {
  int most = 0, multiprocessors = 0, at_once = 0;
  check(cudaDeviceGetAttribute(&most, cudaDevAttrMaxSharedMemoryPerBlockOptin, card), "cudaDeviceGetAttribute");
  check(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, card), "cudaDeviceGetAttribute");
  const auto needs = [&](int rows) {
    const auto colours = static_cast<size_t>(work_.colours) + 1;
    return colours * colours * kLanes * sizeof(uint32_t) +
           static_cast<size_t>(1 + rows + work_.distances) * static_cast<size_t>(work_.pitch);
  };
  // Half a bin holds what its piece of a ring counts in so many rows.
  work_.rows = std::clamp(0xFFFF / (work_.side * longest_piece_), 1, work_.side);
  while (work_.rows > 1 && needs(work_.rows) > static_cast<size_t>(most)) --work_.rows;
  if (needs(work_.rows) > static_cast<size_t>(most))
    throw CardError("co-occurrences of " + std::to_string(work_.colours) + " colours need " +
                    std::to_string(needs(work_.rows)) + " bytes of shared memory; there are " + std::to_string(most));
  counting_bytes_ = needs(work_.rows);
  // The same for all that there are: it is one for the whole process.
  check(cudaFuncSetAttribute(count_pairs, cudaFuncAttributeMaxDynamicSharedMemorySize, most), "cudaFuncSetAttribute");
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&at_once, count_pairs, kCountingThreads, counting_bytes_),
        "cudaOccupancyMaxActiveBlocksPerMultiprocessor");
  counting_blocks_ = static_cast<unsigned>(std::max(1, multiprocessors * at_once));
}

void CooccurrencesOnCard::enqueue(cudaStream_t stream) const {
  colour_pixels<<<4 * kBlocks, kComparingThreads, 0, stream>>>(work_);
  count_pairs<<<counting_blocks_, kCountingThreads, counting_bytes_, stream>>>(work_);
  compare<<<kBlocks, kComparingThreads, work_.bins * sizeof(uint32_t), stream>>>(work_);
}

Outcome CooccurrencesOnCard::find(const CooccurrenceCall& asked, int64_t bound_ns) {
  const int64_t until_ns = Captured::now_ns() + bound_ns;
  if (const Outcome before = captured_.settle(until_ns); before != Outcome::done) return before;
  const size_t row = 3 * static_cast<size_t>(work_.width);
  const ImageOnCard image = seen_by_card({asked.bgr, asked.stride}, row, work_.height, staged_image_);
  std::copy_n(asked.windows, asked.windows_count, windows_);
  std::copy_n(asked.questions, asked.questions_count, questions_);
  *call_ = {image.pixels, image.stride, windows_, asked.windows_count, questions_, asked.questions_count, missing_};
  if (const Outcome outcome = captured_.run(until_ns); outcome != Outcome::done) return outcome;
  const auto most_views = static_cast<size_t>(work_.most_views);
  std::copy_n(missing_, static_cast<size_t>(asked.questions_count) * most_views, asked.missing);
  return Outcome::done;
}

}  // namespace takt::cuda
