// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace takt::sim {

/// A square, periodic colour texture with its mip levels (each the 2 x 2 box mean of the one before), one BGR texel in
/// the low three bytes of a word. Texels lie in tiles of 4 x 4, so that a step in any direction mostly stays in a cache
/// line: texel (u, v) of a level of size s is at (v / 4) * 4 s + (u / 4) * 16 + (v % 4) * 4 + u % 4.
struct Texture {
  static constexpr int kMaxLevels = 8;
  int size = 0;  ///< of level 0, a power of two
  double texels_per_m = 0;
  int levels = 0;
  std::array<int32_t, kMaxLevels> offset{};
  std::vector<uint32_t> texels;
  static size_t tiled(int size, int u, int v) {
    return static_cast<size_t>((v >> 2) * 4 * size + (u >> 2) * 16 + (v & 3) * 4 + (u & 3));
  }
};

enum class Material : uint8_t {
  sky,
  floor,
  plaster,
  ceiling,
  wood,
  cardboard,
  poster,
  cloth,
  skin,
  red_stripes,
  blue_stripes,
  green_stripes,
  violet_stripes,
  asphalt,
  lime_stripes
};
constexpr int kMaterials = 15;
/// "wood" and the like; false if the name is unknown.
bool material_from(std::string_view name, Material& material);
std::string_view material_names();

/// All materials of one seed, made when the first of them is asked for (0.15 s): multi-octave hash noise (and random
/// rectangles on posters), rich at every scale that a 640 x 480 camera resolves between 0.3 m and 15 m, so that a
/// window of 15 px has texture to match. The striped ones carry bands of saturated colours: what stands out for a
/// detector that looks at colours. Any thread.
class TextureSet {
 public:
  explicit TextureSet(uint64_t seed) : seed_(seed) {}
  /// Who is to look in a job asks for it before.
  void make() const;
  const Texture& of(Material material) const {
    make();
    return textures_[static_cast<size_t>(material)];
  }

 private:
  uint64_t seed_;
  mutable std::once_flag made_;
  mutable std::array<Texture, kMaterials> textures_;
};
/// Worlds of one seed share one set while any of them lives. Any thread.
std::shared_ptr<const TextureSet> textures_of(uint64_t seed);

/// A picture that is `edge_m` wide and high, from a colour PPM (P6, 8 bit) of 16, 32 ... 1024 pixels a side; v grows
/// upwards. The error says what is wrong with the file.
tl::expected<Texture, std::string> load_picture(const std::filesystem::path& file, double edge_m);

}  // namespace takt::sim
