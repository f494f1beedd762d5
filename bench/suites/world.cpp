// SPDX-License-Identifier: Apache-2.0
// What encoding messages for other programs costs, CPU time of one thread: a grey and a colour picture of 640x480 as
// JPEG against libjpeg-turbo with a buffer that it keeps, a cloud of 60,000 points and a raw picture against a copy of
// as many bytes.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>

#include "bench/interleaved.hpp"
#include "bench/suite.hpp"
#include "graph/world/encoder.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/image.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/record/jpeg_compressor.hpp"

namespace takt::bench {

std::vector<Row> run_world(const Options& options);

namespace {

constexpr int kQuality = 75;
constexpr uint32_t kPoints = 60'000;

template <class T>
struct Message {
  explicit Message(const Capacity& capacity) : memory(aligned_bytes(MessageType::of<T>().bytes(capacity))) {
    MessageType::of<T>().place(memory.get(), capacity);
  }
  T* operator->() { return reinterpret_cast<T*>(memory.get()); }
  AlignedBytes memory;
};

/// Waves with noise: neither flat nor pure noise.
Message<Image> textured(int channels) {
  Message<Image> image({640, 480, static_cast<uint32_t>(channels)});
  image->width = 640, image->height = 480, image->channels = channels;
  image->pixels.resize(image->pixels.capacity);
  std::mt19937 random(1);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x)
      for (int c = 0; c < channels; ++c)
        image->view().at(x, y, c) = static_cast<uint8_t>(110 + 50 * std::sin(x * 0.07 + c) * std::cos(y * 0.05) +
                                                         static_cast<double>(random() % 32));
  return image;
}

Message<PointCloud> cloud() {
  Message<PointCloud> cloud({0, 0, 1, kPoints});
  std::mt19937 random(2);
  for (uint32_t i = 0; i < kPoints; ++i) {
    cloud->points.push_back({static_cast<float>(random() % 1000), static_cast<float>(i), 1});
    cloud->colours.push_back({static_cast<uint8_t>(i), 2, 3});
  }
  return cloud;
}

/// A row for the first form of a message.
template <class T, class Reference>
void measure(std::vector<Row>& rows, const Options& options, const std::string& what, Message<T> message,
             const world::Encoder& encoder, const std::string& reference, const Reference& plain) {
  size_t bytes = 0;
  const auto first = [](std::string_view topic) { return topic.empty(); };
  const auto encode = [&] {
    return cpu_ms([&] {
      bytes = encoder.forms(MessageType::of<T>(), message.memory.get(), "bench", 1, first).at(0).bytes.size();
    });
  };
  encode();
  Compared figures = compare(
      static_cast<size_t>(options.rounds_or(300)), [&] { return cpu_ms([&] { plain(message, bytes); }); }, encode);
  std::fprintf(stderr, "world: %s: %zu bytes\n", what.c_str(), bytes);
  add_pair(rows, {"world/" + what, "ms", 0, std::move(figures.changed), {}, {}, {}, "one thread"}, reference,
           figures.pairs);
}

}  // namespace

std::vector<Row> run_world(const Options& options) {
  std::vector<Row> rows;
  record::JpegCompressor kept(kQuality);
  const auto jpeg = [&](Message<Image>& image, size_t) { kept.compress(std::as_const(*image.operator->()).view()); };
  const std::vector<std::byte> from(1 << 20);
  const auto copy = [&](auto&, size_t bytes) {
    std::vector<std::byte> to(bytes);
    std::memcpy(to.data(), from.data(), bytes);
    asm volatile("" : : "r"(to.data()) : "memory");  // or nothing is copied
  };
  measure(rows, options, "jpeg_grey_640x480", textured(1), world::Encoder({.jpeg_quality = kQuality}),
          "libjpeg-turbo, quality 75, buffer kept", jpeg);
  measure(rows, options, "jpeg_colour_640x480", textured(3), world::Encoder({.jpeg_quality = kQuality}),
          "libjpeg-turbo, quality 75, buffer kept", jpeg);
  measure(rows, options, "raw_grey_640x480", textured(1), world::Encoder({.jpeg_quality = 0}),
          "a copy of as many bytes", copy);
  measure(rows, options, "cloud_60000", cloud(), world::Encoder(), "a copy of as many bytes", copy);
  return rows;
}

}  // namespace takt::bench
