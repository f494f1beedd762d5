// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "hal/sim/render_kernels.hpp"
#include "hal/sim/scene.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::sim {

/// Ideal pinhole camera. Pixel centres have integer coordinates; the ray of pixel (x, y) is
/// ((x - cu) / f, (y - cv) / f, 1) in the camera frame (x right, y down, z forward).
struct Pinhole {
  int width = 0, height = 0;
  double focal_px = 0, cu_px = 0, cv_px = 0;
};

/// Pose of a camera: p_map = rotation * p_camera + position.
struct CameraPose {
  Mat3 rotation = Mat3::Identity();
  Vec3 position = Vec3::Zero();
};

struct SensorNoise {
  double read_sigma = 1.0;        ///< levels, in darkness
  double photon_variance = 0.01;  ///< variance per level of brightness
};

/// Renders one image of a scene by scan conversion with an inverse-depth buffer (1/z of a plane is linear in the image,
/// so depth is exact, and every texture coordinate is one multiplication with z away from linear). Texturing is
/// bilinear in the mip level nearest to the pixel's footprint. Not thread-safe; allocates nothing after construction
/// unless the scene grows. Equal inputs give equal bytes on every machine.
class Renderer {
 public:
  explicit Renderer(const Pinhole& camera);

  /// `image` is width x height, 1 or 3 channels. `noise_seed` picks this exposure's noise. `depth` (m along the optical
  /// axis, 0 where nothing is hit) may be null.
  void render(const Scene& scene, const CameraPose& pose, const SensorNoise& noise, uint64_t noise_seed,
              ImageView<uint8_t> image, float* depth = nullptr);

 private:
  struct Edge {
    double y0, y1, x0, slope;
  };
  struct Surface {
    double iz_x = 0, iz_y = 0, iz_0 = 0;    ///< 1/z = iz_x x + iz_y y + iz_0
    double ua, ub, uc, u0, va, vb, vc, v0;  ///< texels of level 0: u = u0 + z (ua x + ub y + uc)
    double y_first = 0, y_last = 0;
    int edges = 0;
    Edge edge[8];
    const Texture* texture = nullptr;
    float gain = 1;
  };
  struct Round {
    CameraCapsule kernel;
    Surface surface;
    double x[2], y[2], radius;  ///< stadium in the image that contains it
    bool whole_image = false;
  };

  void prepare_quad(const Quad& quad, const Scene& scene, const CameraPose& pose);
  void prepare_capsule(const Capsule& capsule, const Scene& scene, const CameraPose& pose);
  void texture_axes(Surface& surface, const Vec3& u_axis, double u_offset, const Vec3& v_axis, double v_offset,
                    const CameraPose& pose) const;
  void draw_row(int y);
  void shade_row(int y, const SensorNoise& noise, uint32_t row_seed);
  int mip_level(const Surface& surface, int x, int y) const;

  Pinhole camera_;
  std::vector<Surface> surfaces_;  ///< id - 1
  std::vector<Round> rounds_;      ///< id - 1 - surfaces_.size()
  Surface sky_;
  std::vector<float> inverse_depth_, gain_;
  std::vector<int32_t> id_;
  std::vector<uint8_t> blue_, green_, red_;
};

}  // namespace takt::sim
