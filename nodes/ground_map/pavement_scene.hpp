// SPDX-License-Identifier: Apache-2.0
// Images of a pavement that the project makes itself, with ground truth: a robot drives along a pavement between grass
// and a kerb, obstacles stand on it, the light changes. Every pixel is a ray cast to the floor or to an upright box.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "nodes/ground_map/evaluate.hpp"
#include "nodes/ground_map/floor_projection.hpp"
#include "rt/msg/geometry.hpp"
#include "rt/msg/image_view.hpp"

namespace takt::ground_map {

/// What pavements are made of; each has a colour and a pattern of its own.
enum class Surface : uint8_t { bricks, slabs, asphalt, red_bricks };

/// A stretch of the pavement: from there on to the next.
struct PavementPart {
  double from_y_m = -1e9;
  double left_m = -1.6, right_m = 1.4;  ///< where it ends: at grass, at a kerb
  Surface surface = Surface::bricks;
  double turned_rad = 0;  ///< of the robot against its way
};

struct PavementOptions {
  uint64_t seed = 1;
  int frames = 60;
  int width = 640, height = 480;
  double frame_step_m = 0.16;              ///< 0.8 m/s at 5 Hz
  double obstacles_from_m = 2.2;           ///< least distance of two obstacles along the pavement; 2.4 m more at most
  double brightness = 1;                   ///< of the light
  double flicker = 0;                      ///< by which share of it it changes from image to image, to each side
  bool hard_shadows = false;               ///< as of trunks of trees, across the pavement
  bool glare = false;                      ///< the sun in wet ground: part of the sensor is flooded
  std::vector<PavementPart> parts = {{}};  ///< along the way, the first from behind the start
};

/// Map frame: y along the pavement, x to its right, z up, floor z = 0; the drive starts near the origin.
class PavementScene {
 public:
  explicit PavementScene(const PavementOptions& options);

  const CameraModel& camera() const { return camera_; }
  const Transform& camera_in_robot() const { return camera_in_robot_; }
  PlanarPose robot_in_map(int frame) const;
  /// Which of the parts the robot sees, from half a metre behind it to 4.5 m ahead; none: more than one.
  std::optional<size_t> part_seen(int frame) const;
  /// What the camera sees in that frame: BGR, and values of Truth. Equal for equal seeds, on every machine up to
  /// rounding of the mathematical library.
  void render(int frame, ImageView<uint8_t> bgr, ImageView<uint8_t> truth) const;
  /// Whether something stands there.
  bool occupied(const FloorPoint& point) const;
  /// Whether a point of the floor is pavement with nothing on it.
  bool drivable(const FloorPoint& point) const;

 private:
  struct Colour3 {
    double b, g, r;
  };
  struct Box {
    double x0, x1, y0, y1, height;
    Colour3 colour;
  };
  /// A pixel's ray has 1 as its part along the optical axis: distances along it are depths.
  struct Ray {
    double ox, oy, oz, dx, dy, dz;
  };
  struct Hit {
    Colour3 colour;
    Truth truth;
  };
  static Colour3 shade(const Colour3& c, double light) { return {c.b * light, c.g * light, c.r * light}; }
  static bool meets(const Ray& ray, const Box& box, double& distance, int& face);
  void add_obstacles();
  Hit trace(const Ray& ray, const std::vector<const Box*>& near) const;
  Hit ground(double x, double y, double z, double distance) const;
  const PavementPart& part_at(double y_m) const;
  Hit pavement(const PavementPart& part, double x, double y, double distance) const;
  bool in_shadow(double x, double y, double z, const std::vector<const Box*>& near) const;

  PavementOptions options_;
  CameraModel camera_;
  Transform camera_in_robot_;
  std::vector<Box> boxes_;
};

}  // namespace takt::ground_map
