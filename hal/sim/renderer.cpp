// SPDX-License-Identifier: Apache-2.0
#include "hal/sim/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "hal/sim/random.hpp"

namespace takt::sim {
namespace {

constexpr double kNear = 0.05;  ///< m
constexpr int kMaxVertices = 8;

/// Clips a convex polygon against z >= kNear (Sutherland-Hodgman); returns the number of vertices.
int clip_near(const std::array<Vec3, 4>& in, std::array<Vec3, kMaxVertices>& out) {
  int count = 0;
  for (size_t i = 0; i < 4; ++i) {
    const Vec3& p = in[i];
    const Vec3& q = in[(i + 1) % 4];
    if (p.z() >= kNear) out[static_cast<size_t>(count++)] = p;
    if ((p.z() >= kNear) != (q.z() >= kNear)) {
      const double s = (kNear - p.z()) / (q.z() - p.z());
      out[static_cast<size_t>(count++)] = p + s * (q - p);
    }
  }
  return count;
}

/// Reduces a texture offset to one period, which keeps single precision exact to a thousandth of a texel.
double reduce(double texels, int size) { return texels - std::floor(texels / size) * size; }

}  // namespace

Renderer::Renderer(const Pinhole& camera) : camera_(camera) {
  const size_t row = static_cast<size_t>(camera.width) + kRowPadding;
  inverse_depth_.resize(row);
  gain_.resize(row);
  id_.resize(row);
  blue_.resize(row);
  green_.resize(row);
  red_.resize(row);
  surfaces_.reserve(512);
  rounds_.reserve(64);
}

void Renderer::texture_axes(Surface& s, const Vec3& u_axis, double u_offset, const Vec3& v_axis, double v_offset,
                            const CameraPose& pose) const {
  const double f = camera_.focal_px, scale = s.texture->texels_per_m;
  const auto set = [&](const Vec3& axis, double offset, double& a, double& b, double& c, double& constant) {
    const Vec3 local = scale * (pose.rotation.transpose() * axis);
    a = local.x() / f;
    b = local.y() / f;
    c = local.z() - a * camera_.cu_px - b * camera_.cv_px;
    constant = reduce(scale * (axis.dot(pose.position) + offset), s.texture->size);
  };
  set(u_axis, u_offset, s.ua, s.ub, s.uc, s.u0);
  set(v_axis, v_offset, s.va, s.vb, s.vc, s.v0);
}

void Renderer::prepare_quad(const Quad& quad, const Scene& scene, const CameraPose& pose) {
  const double distance = quad.normal.dot(quad.corner[0] - pose.position);
  if (distance >= 0) return;  // seen from behind
  std::array<Vec3, 4> corner;
  for (size_t i = 0; i < 4; ++i) corner[i] = pose.rotation.transpose() * (quad.corner[i] - pose.position);
  std::array<Vec3, kMaxVertices> vertex;
  const int count = clip_near(corner, vertex);
  if (count < 3) return;

  Surface s;
  s.y_first = 1e9;
  s.y_last = -1e9;
  double x_first = 1e9, x_last = -1e9;
  std::array<double, kMaxVertices> px, py;
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    px[i] = camera_.cu_px + camera_.focal_px * vertex[i].x() / vertex[i].z();
    py[i] = camera_.cv_px + camera_.focal_px * vertex[i].y() / vertex[i].z();
    s.y_first = std::min(s.y_first, py[i]);
    s.y_last = std::max(s.y_last, py[i]);
    x_first = std::min(x_first, px[i]);
    x_last = std::max(x_last, px[i]);
  }
  if (s.y_last < 0 || s.y_first > camera_.height - 1 || x_last < 0 || x_first > camera_.width - 1) return;
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    size_t p = i, q = (i + 1) % static_cast<size_t>(count);
    if (py[p] > py[q]) std::swap(p, q);
    if (py[p] == py[q]) continue;
    s.edge[s.edges++] = {py[p], py[q], px[p], (px[q] - px[p]) / (py[q] - py[p])};
  }
  // Plane n . P = d in camera coordinates: 1/z = n . ray / d.
  const Vec3 n = pose.rotation.transpose() * quad.normal / distance;
  s.iz_x = n.x() / camera_.focal_px;
  s.iz_y = n.y() / camera_.focal_px;
  s.iz_0 = n.z() - s.iz_x * camera_.cu_px - s.iz_y * camera_.cv_px;
  s.texture = quad.picture ? quad.picture.get() : &scene.textures->of(quad.material);
  s.gain = static_cast<float>(quad.gain);
  texture_axes(s, quad.u_axis, quad.u_offset, quad.v_axis, quad.v_offset, pose);
  surfaces_.push_back(s);
}

void Renderer::prepare_capsule(const Capsule& capsule, const Scene& scene, const CameraPose& pose) {
  Vec3 a = pose.rotation.transpose() * (capsule.a - pose.position);
  Vec3 b = pose.rotation.transpose() * (capsule.b - pose.position);
  const double nearest = std::min(a.z(), b.z()) - capsule.radius;
  if (std::max(a.z(), b.z()) + capsule.radius < kNear) return;
  Round r;
  r.whole_image = nearest < 0.2;
  double tangent2 = 0;
  for (int i = 0; i < 2; ++i) {
    const Vec3& p = i == 0 ? a : b;
    const double z = std::max(p.z(), 0.2);
    r.x[i] = camera_.cu_px + camera_.focal_px * p.x() / z;
    r.y[i] = camera_.cv_px + camera_.focal_px * p.y() / z;
    tangent2 = std::max(tangent2, (p.x() * p.x() + p.y() * p.y()) / (z * z));
  }
  // A sphere off the axis projects to an ellipse, stretched by at most 1 / cos^2 of its direction.
  r.radius = camera_.focal_px * capsule.radius / std::max(nearest, 0.2) * (1.0 + tangent2) + 1.0;
  if (!r.whole_image) {
    if (std::max(r.x[0], r.x[1]) + r.radius < 0 || std::min(r.x[0], r.x[1]) - r.radius > camera_.width) return;
    if (std::max(r.y[0], r.y[1]) + r.radius < 0 || std::min(r.y[0], r.y[1]) - r.radius > camera_.height) return;
  }
  static const Vec3 towards_light = Vec3(0.35, -0.5, 0.79).normalized();
  const Vec3 light = pose.rotation.transpose() * towards_light, axis = b - a;
  for (int i = 0; i < 3; ++i) {
    r.kernel.a[i] = static_cast<float>(a[i]);
    r.kernel.axis[i] = static_cast<float>(axis[i]);
    r.kernel.light[i] = static_cast<float>(light[i]);
  }
  r.kernel.radius = static_cast<float>(capsule.radius);
  r.kernel.axis_axis = static_cast<float>(axis.dot(axis));
  r.kernel.a_axis = static_cast<float>(-a.dot(axis));
  r.kernel.a_a = static_cast<float>(a.dot(a));
  r.surface.texture = &scene.textures->of(capsule.material);
  r.surface.iz_0 = 2.0 / (a.z() + b.z());  // mean depth: good enough to choose a mip level
  // Planar projection of the texture on two oblique horizontal directions and the height: attached to the body.
  texture_axes(r.surface, Vec3(0.8, 0.6, 0.15), 0.0, Vec3(-0.12, 0.09, 1.0), 0.0, pose);
  rounds_.push_back(r);
}

void Renderer::draw_row(int y) {
  const double row = y;
  int32_t id = 0;
  for (const Surface& s : surfaces_) {
    ++id;
    if (row < s.y_first || row > s.y_last) continue;
    double left = 1e9, right = -1e9;
    for (int e = 0; e < s.edges; ++e) {
      const Edge& edge = s.edge[e];
      if (row < edge.y0 || row > edge.y1) continue;
      const double x = edge.x0 + (row - edge.y0) * edge.slope;
      left = std::min(left, x);
      right = std::max(right, x);
    }
    if (right < 0 || left > camera_.width - 1) continue;
    PlaneSpan span;
    span.x0 = left <= 0 ? 0 : static_cast<int>(std::ceil(left));
    span.x1 = right >= camera_.width - 1 ? camera_.width : static_cast<int>(std::floor(right)) + 1;
    span.a = static_cast<float>(s.iz_x);
    span.row = static_cast<float>(s.iz_y * row + s.iz_0);
    span.id = id;
    if (span.x1 > span.x0) draw_plane(span, inverse_depth_.data(), id_.data());
  }
  for (const Round& r : rounds_) {
    ++id;
    double left = 0, right = camera_.width;
    if (!r.whole_image) {
      left = 1e9;
      right = -1e9;
      const auto cover = [&](double x) { left = std::min(left, x), right = std::max(right, x); };
      for (int i = 0; i < 2; ++i) {
        const double h2 = r.radius * r.radius - (row - r.y[i]) * (row - r.y[i]);
        if (h2 < 0) continue;
        cover(r.x[i] - std::sqrt(h2));
        cover(r.x[i] + std::sqrt(h2));
      }
      const double dx = r.x[1] - r.x[0], dy = r.y[1] - r.y[0], length = std::hypot(dx, dy);
      for (const double side : {-1.0, 1.0}) {
        if (length < 1e-6 || std::abs(dy) < 1e-6) continue;
        const double s = (row - (r.y[0] + side * r.radius * dx / length)) / dy;
        if (s >= 0 && s <= 1) cover(r.x[0] - side * r.radius * dy / length + s * dx);
      }
    }
    CapsuleSpan span;
    span.x0 = std::max(0, static_cast<int>(std::floor(std::max(left, -1.0))));
    span.x1 = std::min(camera_.width, static_cast<int>(std::ceil(std::min(right, 1e6))) + 1);
    if (span.x1 <= span.x0) continue;
    span.ray_x_step = static_cast<float>(1.0 / camera_.focal_px);
    span.ray_x_start = static_cast<float>(-camera_.cu_px / camera_.focal_px);
    span.ray_y = static_cast<float>((row - camera_.cv_px) / camera_.focal_px);
    span.id = id;
    draw_capsule(r.kernel, span, inverse_depth_.data(), id_.data(), gain_.data());
  }
}

/// Level whose texels are nearest to the footprint of pixel (x, y): the geometric mean of the two screen derivatives,
/// so that slanted surfaces are neither aliased nor blurred too much.
int Renderer::mip_level(const Surface& s, int x, int y) const {
  const double z = 1.0 / std::max(s.iz_x * x + s.iz_y * y + s.iz_0, 1e-3);
  const double lu = s.ua * x + s.ub * y + s.uc, lv = s.va * x + s.vb * y + s.vc;
  const double ux = z * (s.ua - z * s.iz_x * lu), uy = z * (s.ub - z * s.iz_y * lu);
  const double vx = z * (s.va - z * s.iz_x * lv), vy = z * (s.vb - z * s.iz_y * lv);
  const double footprint = std::sqrt((ux * ux + vx * vx) * (uy * uy + vy * vy));
  int level = 0;
  // Level l fits footprints around 2^l texels; 4 = 2^2 because footprint is squared.
  for (double limit = 2.0 * 2.0; footprint > limit && level < s.texture->levels - 1; limit *= 4.0) ++level;
  return level;
}

void Renderer::shade_row(int y, const SensorNoise& noise, uint32_t row_seed) {
  const int32_t planes = static_cast<int32_t>(surfaces_.size());
  int x = 0;
  while (x < camera_.width) {
    const int32_t id = id_[static_cast<size_t>(x)];
    int end = x + 1;
    while (end < camera_.width && id_[static_cast<size_t>(end)] == id) ++end;
    const bool round = id > planes;
    const Surface& s = id == 0 ? sky_
                       : round ? rounds_[static_cast<size_t>(id - planes - 1)].surface
                               : surfaces_[static_cast<size_t>(id - 1)];
    ShadeRun run;
    run.gain = s.gain;
    run.gain_row = round ? gain_.data() : nullptr;
    run.noise_seed = row_seed;
    run.read_noise = static_cast<float>(noise.read_sigma);
    run.photon_noise = static_cast<float>(noise.photon_variance);
    for (; x < end; x += run.count) {
      run.x0 = x;
      run.count = std::min(kShadeBlock, end - x);
      const int level = mip_level(s, x + run.count / 2, y);
      // Texel i of level l covers texels 2^l i ... of level 0: centres lie at (u / 2^l) - 1/2.
      const double scale = std::ldexp(1.0, -level);
      run.level = s.texture->texels.data() + s.texture->offset[static_cast<size_t>(level)];
      run.size = s.texture->size >> level;
      run.ua = static_cast<float>(scale * s.ua);
      run.ub = static_cast<float>(scale * (s.ub * y + s.uc));
      run.u0 = static_cast<float>(scale * s.u0 - 0.5);
      run.va = static_cast<float>(scale * s.va);
      run.vb = static_cast<float>(scale * (s.vb * y + s.vc));
      run.v0 = static_cast<float>(scale * s.v0 - 0.5);
      shade(run, inverse_depth_.data(), blue_.data(), green_.data(), red_.data());
    }
    x = end;
  }
}

void Renderer::render(const Scene& scene, const CameraPose& pose, const SensorNoise& noise, uint64_t noise_seed,
                      ImageView<uint8_t> image, float* depth) {
  surfaces_.clear();
  rounds_.clear();
  sky_ = Surface{};
  sky_.ua = sky_.ub = sky_.uc = sky_.u0 = sky_.va = sky_.vb = sky_.vc = sky_.v0 = 0;
  sky_.texture = &scene.textures->of(Material::sky);
  for (const Scene* part : {scene.fixed, &scene}) {
    if (part == nullptr) continue;
    for (const Quad& quad : part->quads) prepare_quad(quad, *part, pose);
    for (const Capsule& capsule : part->capsules) prepare_capsule(capsule, *part, pose);
  }
  for (int y = 0; y < camera_.height; ++y) {
    // A far away sky instead of nothing keeps the shading free of divisions by zero.
    std::fill(inverse_depth_.begin(), inverse_depth_.end(), 1e-6f);
    std::memset(id_.data(), 0, id_.size() * sizeof(id_[0]));
    draw_row(y);
    shade_row(y, noise, static_cast<uint32_t>(mix(noise_seed, static_cast<uint64_t>(y))));
    if (image.channels == 3) {
      store_bgr(blue_.data(), green_.data(), red_.data(), camera_.width, image.row(y));
    } else {
      store_grey(blue_.data(), green_.data(), red_.data(), camera_.width, image.row(y));
    }
    if (depth == nullptr) continue;
    float* out = depth + static_cast<ptrdiff_t>(y) * camera_.width;
    for (int x = 0; x < camera_.width; ++x) {
      out[x] = id_[static_cast<size_t>(x)] == 0 ? 0.0f : 1.0f / inverse_depth_[static_cast<size_t>(x)];
    }
  }
}

}  // namespace takt::sim
