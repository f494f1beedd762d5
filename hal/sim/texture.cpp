// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/texture.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "hal/sim/random.hpp"
#include "rt/file/input_file.hpp"

namespace takt::sim {
namespace {

/// How noise and rectangles colour a material.
enum class Paint : uint8_t {
  shaded,    ///< noise lightens and darkens the colour, which keeps its saturation; rectangles are grey
  colourful  ///< noise is added to each channel, so that saturation varies; rectangles have any colour
};

struct Recipe {
  std::string_view name;
  int size;
  double texels_per_m;
  std::array<double, 3> bgr;  ///< mean colour
  double contrast;            ///< of the luminance noise, levels
  double tint;                ///< of the colour noise, levels
  int rectangles;
  Paint paint = Paint::shaded;
  std::array<std::array<double, 3>, 3> bands{};  ///< colours in turn along v, heights 3 : 3 : 1, instead of the mean
  int band_period = 0;                           ///< texels of one turn, divides size; 0: no bands
};

// The floor is saturated (S = 255 (max - min) / max about 130) and what stands on it either pale (S below 85: plaster,
// wood, cardboard, cloth, and the asphalt of streets) or more saturated still (the stripes, S about 200): a ground
// detector that looks at saturation and value can tell them apart, although all of them are textured alike for stereo.
constexpr std::array<Recipe, kMaterials> kRecipes{{
    {"sky", 16, 1, {200, 190, 180}, 0, 0, 0},
    {"floor", 1024, 250, {62, 96, 128}, 28, 3, 0},
    {"plaster", 1024, 250, {158, 167, 172}, 40, 4, 120},
    {"ceiling", 512, 160, {190, 195, 195}, 30, 4, 0},
    {"wood", 512, 300, {120, 148, 168}, 40, 4, 0},
    {"cardboard", 512, 300, {112, 138, 156}, 44, 4, 30},
    {"poster", 512, 300, {120, 120, 120}, 22, 30, 160, Paint::colourful},
    {"cloth", 256, 250, {92, 80, 72}, 36, 4, 0},
    {"skin", 256, 250, {130, 155, 205}, 22, 6, 0, Paint::colourful},
    {"red_stripes", 256, 300, {}, 20, 4, 0, Paint::colourful, {{{40, 30, 190}, {220, 220, 225}, {40, 190, 215}}}, 64},
    {"blue_stripes", 256, 300, {}, 20, 4, 0, Paint::colourful, {{{185, 75, 25}, {35, 195, 225}, {40, 40, 45}}}, 64},
    {"green_stripes", 256, 300, {}, 20, 4, 0, Paint::colourful, {{{45, 150, 30}, {30, 115, 235}, {225, 225, 220}}}, 64},
    {"violet_stripes",
     256,
     300,
     {},
     20,
     4,
     0,
     Paint::colourful,
     {{{165, 35, 130}, {200, 190, 40}, {150, 60, 225}}},
     64},
    {"asphalt", 512, 250, {92, 88, 86}, 26, 4, 0},
    {"lime_stripes", 256, 300, {}, 20, 4, 0, Paint::colourful, {{{35, 205, 160}, {25, 70, 140}, {45, 40, 40}}}, 64},
}};

const std::array<double, 3>& colour_of_row(const Recipe& recipe, int row) {
  if (recipe.band_period == 0) return recipe.bgr;
  const int sevenths = 7 * (row % recipe.band_period) / recipe.band_period;
  return recipe.bands[sevenths < 3 ? 0 : sevenths < 6 ? 1 : 2];
}

/// Value noise of one octave with smooth interpolation; periodic with `cells`.
void add_octave(std::vector<float>& field, int size, int cells, uint64_t seed, float amplitude) {
  const int pitch = size / cells;
  std::vector<float> lattice(static_cast<size_t>(cells) * static_cast<size_t>(cells));
  for (size_t i = 0; i < lattice.size(); ++i)
    lattice[i] = static_cast<float>(uniform(mix(seed, i)) * 2.0 - 1.0) * amplitude;
  const auto at = [&](int x, int y) { return lattice[static_cast<size_t>((y % cells) * cells + x % cells)]; };
  std::vector<float> weight(static_cast<size_t>(pitch));
  for (int i = 0; i < pitch; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(pitch);
    weight[static_cast<size_t>(i)] = t * t * (3 - 2 * t);
  }
  float* out = field.data();
  for (int y = 0; y < size; ++y) {
    const int cy = y / pitch;
    const float wy = weight[static_cast<size_t>(y % pitch)];
    for (int cx = 0; cx < cells; ++cx) {
      const float a = at(cx, cy), b = at(cx + 1, cy), c = at(cx, cy + 1), d = at(cx + 1, cy + 1);
      for (const float wx : weight) {
        const float top = a + wx * (b - a), bottom = c + wx * (d - c);
        *out++ += top + wy * (bottom - top);
      }
    }
  }
}

std::vector<float> noise(int size, uint64_t seed, int coarsest_cells) {
  std::vector<float> field(static_cast<size_t>(size) * static_cast<size_t>(size), 0.0f);
  // Amplitudes fall slowly towards fine octaves: the camera sees other octaves at other distances, and each must do.
  float amplitude = 1.0f;
  for (int cells = coarsest_cells; cells <= size / 2; cells *= 2) {
    add_octave(field, size, cells, mix(seed, static_cast<uint64_t>(cells)), amplitude);
    amplitude *= 0.88f;
  }
  return field;
}

uint32_t pack(double b, double g, double r) {
  const auto byte = [](double v) { return static_cast<uint32_t>(std::clamp(std::lround(v), 0l, 255l)); };
  return byte(b) | byte(g) << 8 | byte(r) << 16;
}

/// Random rectangles: strong corners for feature trackers.
void add_rectangles(Texture& texture, const Recipe& recipe, uint64_t seed) {
  const int size = texture.size;
  for (int k = 0; k < recipe.rectangles; ++k) {
    const auto draw = [&](uint64_t what, int limit) {
      return static_cast<int>(mix(seed, static_cast<uint64_t>(k), what) % static_cast<uint64_t>(limit));
    };
    const int x0 = draw(1, size), y0 = draw(2, size), w = 8 + draw(3, size / 10), h = 8 + draw(4, size / 10);
    const uint32_t any = static_cast<uint32_t>(mix(seed, static_cast<uint64_t>(k), 5)) & 0xFFFFFF,
                   colour = recipe.paint == Paint::colourful ? any : (any & 0xFF) * 0x010101;
    for (int y = y0; y < y0 + h; ++y) {
      for (int x = x0; x < x0 + w; ++x) {
        uint32_t& texel = texture.texels[static_cast<size_t>((y % size) * size + x % size)];
        // Half the noise stays visible, so that the inside of a rectangle can still be matched.
        texel = ((texel & 0xFEFEFE) >> 1) + ((colour & 0xFEFEFE) >> 1);
      }
    }
  }
}

/// Appends the coarser levels, all row by row.
void build_levels(Texture& texture) {
  int size = texture.size;
  texture.levels = 1;
  for (; size > 4 && texture.levels < Texture::kMaxLevels; ++texture.levels) {
    const auto from = static_cast<size_t>(texture.offset[static_cast<size_t>(texture.levels - 1)]);
    const int next = size / 2;
    texture.offset[static_cast<size_t>(texture.levels)] = static_cast<int32_t>(texture.texels.size());
    for (int y = 0; y < next; ++y) {
      for (int x = 0; x < next; ++x) {
        uint32_t mean = 0;
        for (int channel = 0; channel < 24; channel += 8) {
          uint32_t sum = 2;
          for (int k = 0; k < 4; ++k) {
            sum += texture.texels[from + static_cast<size_t>((2 * y + (k >> 1)) * size + 2 * x + (k & 1))] >> channel &
                   255;
          }
          mean |= (sum / 4) << channel;
        }
        texture.texels.push_back(mean);
      }
    }
    size = next;
  }
}

/// Rows -> tiles, level by level.
void tile_levels(Texture& texture) {
  std::vector<uint32_t> rows;
  for (int level = 0; level < texture.levels; ++level) {
    const int size = texture.size >> level;
    uint32_t* texels = texture.texels.data() + texture.offset[static_cast<size_t>(level)];
    rows.assign(texels, texels + static_cast<size_t>(size) * static_cast<size_t>(size));
    for (int v = 0; v < size; ++v) {
      for (int u = 0; u < size; ++u) texels[Texture::tiled(size, u, v)] = rows[static_cast<size_t>(v * size + u)];
    }
  }
}

/// A colour made lighter by `levels` of its green, and warmer or colder by `tint` in proportion. Nothing gets so dark
/// that the camera's noise would decide its saturation.
uint32_t shade(const std::array<double, 3>& bgr, double levels, double tint) {
  const double light = std::max(0.25, 1 + levels / bgr[1]), warmth = tint / bgr[1];
  return pack(bgr[0] * light * (1 + warmth), bgr[1] * light, bgr[2] * light * (1 - warmth));
}

Texture make_texture(const Recipe& recipe, uint64_t seed) {
  Texture texture;
  texture.size = recipe.size;
  texture.texels_per_m = recipe.texels_per_m;
  const auto count = static_cast<size_t>(recipe.size) * static_cast<size_t>(recipe.size);
  texture.texels.reserve(count * 3 / 2);
  texture.texels.resize(count, pack(recipe.bgr[0], recipe.bgr[1], recipe.bgr[2]));
  if (recipe.contrast > 0) {
    const auto light = noise(recipe.size, mix(seed, 1), 8);
    const auto tint = noise(recipe.size, mix(seed, 2), 4);
    for (size_t i = 0; i < count; ++i) {
      const double l = recipe.contrast * static_cast<double>(light[i]);
      const double t = recipe.tint * static_cast<double>(tint[i]);
      const std::array<double, 3>& bgr = colour_of_row(recipe, static_cast<int>(i) / recipe.size);
      texture.texels[i] =
          recipe.paint == Paint::colourful ? pack(bgr[0] + l + t, bgr[1] + l, bgr[2] + l - t) : shade(bgr, l, t);
    }
    add_rectangles(texture, recipe, mix(seed, 3));
  }
  build_levels(texture);
  tile_levels(texture);
  return texture;
}

}  // namespace

bool material_from(std::string_view name, Material& material) {
  for (size_t i = 0; i < kRecipes.size(); ++i) {
    if (kRecipes[i].name != name) continue;
    material = static_cast<Material>(i);
    return true;
  }
  return false;
}

std::string_view material_names() {
  return "sky, floor, plaster, ceiling, wood, cardboard, poster, cloth, skin, red_stripes, blue_stripes, "
         "green_stripes, violet_stripes, asphalt, lime_stripes";
}

tl::expected<Texture, std::string> load_picture(const std::filesystem::path& file, double edge_m) {
  if (const std::string why = why_unreadable(file); !why.empty())
    return tl::unexpected("the picture " + file.string() + " " + why);
  std::ifstream in(file, std::ios::binary);
  std::string magic;
  int width = 0, height = 0, peak = 0;
  in >> magic >> width >> height >> peak;
  in.get();
  if (!in || magic != "P6" || width != height || width < 16 || width > 1024 || (width & (width - 1)) != 0 ||
      peak != 255)
    return tl::unexpected("the picture " + file.string() +
                          " is no PPM (P6, 8 bit, without comments) of 16, 32 ... 1024 pixels a side");
  Texture texture;
  texture.size = width;
  texture.texels_per_m = width / edge_m;
  std::vector<char> row(static_cast<size_t>(width) * 3);
  texture.texels.resize(static_cast<size_t>(width) * static_cast<size_t>(width));
  for (int v = width - 1; v >= 0; --v) {
    if (!in.read(row.data(), static_cast<std::streamsize>(row.size())))
      return tl::unexpected("the picture " + file.string() + " ends early");
    for (int u = 0; u < width; ++u) {
      const auto channel = [&](int c) { return static_cast<uint8_t>(row[static_cast<size_t>(3 * u + c)]); };
      texture.texels[static_cast<size_t>(v * width + u)] = pack(channel(2), channel(1), channel(0));
    }
  }
  build_levels(texture);
  tile_levels(texture);
  return texture;
}

void TextureSet::make() const {
  std::call_once(made_, [this] {
    for (size_t i = 0; i < kRecipes.size(); ++i) textures_[i] = make_texture(kRecipes[i], mix(seed_, i));
  });
}

std::shared_ptr<const TextureSet> textures_of(uint64_t seed) {
  static std::mutex mutex;
  static std::map<uint64_t, std::weak_ptr<const TextureSet>> sets;
  const std::lock_guard lock(mutex);
  std::weak_ptr<const TextureSet>& known = sets[seed];
  if (auto set = known.lock()) return set;
  auto set = std::make_shared<const TextureSet>(seed);
  known = set;
  return set;
}

}  // namespace takt::sim
