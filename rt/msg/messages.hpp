// SPDX-License-Identifier: Apache-2.0
// The message types of the ACE graph. Units are SI unless a name says otherwise. Frames (thesis Fig. 4.11): robot frame
// x right, y forward, z up; camera frame x right, y down, z forward; map frame z up.
#pragma once
#include <array>

#include "rt/msg/field.hpp"
#include "rt/msg/image_view.hpp"

namespace takt {

/// Pinhole model of a rectified image; all zero while an image is not rectified.
struct CameraModel {
  double focal_px = 0, cu_px = 0, cv_px = 0;
  double baseline_m = 0;  ///< distance of the two optical centres of a rectified stereo pair
};

/// Rigid transform as translation and unit quaternion: p_parent = R(q) p_child + t.
struct Transform {
  double x = 0, y = 0, z = 0;
  double qw = 1, qx = 0, qy = 0, qz = 0;
};

/// What a camera driver found out about a frame at capture (bits of `health`).
namespace image_health {
constexpr uint32_t saturated = 1, dark = 2, blurred = 4, unchanging = 8, partial = 16;
}

/// One 8-bit image. Capacity: width, height, channels.
struct Image {
  static constexpr std::string_view type_name = "image";
  int32_t width = 0, height = 0, channels = 0;
  uint32_t health = 0;
  CameraModel camera;
  Array<uint8_t> pixels;  ///< interleaved, BGR if three channels

  ImageView<uint8_t> view() { return {pixels.data(), width, height, channels}; }
  ImageView<const uint8_t> view() const { return {pixels.data(), width, height, channels}; }
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) {
    a[0] = static_cast<uint32_t>(c.pixels() * c.channels);
  }
};

/// Two 8-bit images of one exposure. Raw from a camera, rectified (camera.focal_px > 0) from the stereo node.
/// Capacity: width, height, channels.
struct StereoPair {
  static constexpr std::string_view type_name = "stereo_pair";
  int32_t width = 0, height = 0, channels = 0;
  uint32_t health = 0;
  uint32_t frame_number = 0;  ///< counted by the device; a gap is a frame lost before the host saw it
  CameraModel camera;
  Transform sensor_in_robot;   ///< left camera, head at rest; identity: unknown
  Array<uint8_t> left, right;  ///< interleaved, BGR if three channels

  ImageView<uint8_t> left_view() { return {left.data(), width, height, channels}; }
  ImageView<uint8_t> right_view() { return {right.data(), width, height, channels}; }
  ImageView<const uint8_t> left_view() const { return {left.data(), width, height, channels}; }
  ImageView<const uint8_t> right_view() const { return {right.data(), width, height, channels}; }
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) {
    a[0] = a[1] = static_cast<uint32_t>(c.pixels() * c.channels);
  }
};

/// Dense disparity of the left rectified image. Capacity: width, height.
struct DisparityMap {
  static constexpr std::string_view type_name = "disparity";
  static constexpr int16_t invalid = -1;
  int32_t width = 0, height = 0;
  int32_t disparities = 0;  ///< search range: 0 .. disparities - 1
  CameraModel camera;
  Array<int16_t> disparity;   ///< px; left (x, y) is right (x - d, y); `invalid` where rejected
  Array<uint8_t> confidence;  ///< 0..255 for zeta 0..1 (thesis Eq. 3.6, corrected)
  Array<uint8_t> fraction;    ///< 1/64 px to add to the disparity, plus 32; empty: whole pixels only

  ImageView<int16_t> view() { return {disparity.data(), width, height}; }
  ImageView<const int16_t> view() const { return {disparity.data(), width, height}; }
  ImageView<uint8_t> confidence_view() { return {confidence.data(), width, height}; }
  ImageView<const uint8_t> confidence_view() const { return {confidence.data(), width, height}; }
  ImageView<uint8_t> fraction_view() { return {fraction.data(), width, height}; }
  ImageView<const uint8_t> fraction_view() const { return {fraction.data(), width, height}; }
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) {
    a[0] = a[1] = a[2] = static_cast<uint32_t>(c.pixels());
  }
};

struct Point {
  using scalar = float;
  float x, y, z;
};
struct Colour {
  using scalar = uint8_t;
  uint8_t b, g, r;
};

/// Coloured points in the frame of the sensor. Capacity: count.
struct PointCloud {
  static constexpr std::string_view type_name = "point_cloud";
  Transform sensor_in_robot;
  CameraModel camera;   ///< of the image the cloud was triangulated from; zero for other sensors
  int32_t step_px = 0;  ///< one point per step x step pixels of that image; 0 for other sensors
  Array<Point> points;
  Array<Colour> colours;  ///< same size as points, or empty
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = a[1] = c.count; }
};

/// One sweep of a laser scanner, in its own plane. Capacity: count (beams).
struct LaserScan {
  static constexpr std::string_view type_name = "laser_scan";
  double first_angle_rad = 0;  ///< of range 0, counter-clockwise from the sensor's forward axis
  double step_rad = 0;
  double max_range_m = 0;
  double sweep_s = 0;  ///< time from the first to the last beam
  uint32_t scan_number = 0;
  Transform sensor_in_robot;
  Array<float> range_m;  ///< 0: no return
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = c.count; }
};

/// State of the mobile base in its drifting odometry frame.
struct Odometry {
  static constexpr std::string_view type_name = "odometry";
  double x_m = 0, y_m = 0, theta_rad = 0;  ///< theta: driving direction from the x axis
  double speed_m_s = 0, turn_rad_s = 0;
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

/// A pose with its covariance (row-major, order x y z rx ry rz).
struct Pose {
  static constexpr std::string_view type_name = "pose";
  Transform transform;
  double covariance[36] = {};
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

/// Motion of the camera between two stamps: camera_in_previous maps current camera coordinates into the previous frame.
struct Motion {
  static constexpr std::string_view type_name = "motion";
  int64_t from_stamp_ns = 0;  ///< stamp of the previous frame; the message's own stamp is the current one
  Transform camera_in_previous;
  Transform pose;  ///< accumulated since start: current camera in the first camera frame
  double confidence = 0;
  double rms_px = 0;
  int32_t corners = 0, matched = 0, inliers = 0;
  uint8_t valid = 0;     ///< 0: confidence too low, the motion was predicted instead of measured
  uint8_t keyframe = 0;  ///< 1: first frame, nothing to compare with
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

struct Detection {
  using scalar = float;
  float class_id, x_px, y_px, width_px, height_px, score;
};

/// Boxes in an image. Capacity: count.
struct Detections {
  static constexpr std::string_view type_name = "detections";
  int32_t image_width = 0, image_height = 0;
  float searched = 1;  ///< share of the image, 0..1: less if the job's time ran out
  Array<Detection> boxes;
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = c.count; }
};

/// A thing as one view of it shows it, in the robot frame.
struct Object3d {
  using scalar = float;
  float class_id, score;               ///< class -1: unknown; score 0..1 of the best class
  float x_m, y_m, z_m;                 ///< middle of its box
  float yaw_rad;                       ///< of its length, from the x axis, -pi/2..pi/2
  float length_m, width_m, height_m;   ///< length >= width, both level
  float area_m2, volume_m3;            ///< from above; above its base
  float mass_x_m, mass_y_m, mass_z_m;  ///< centre of mass: mean of its points
  float centre_x_m, centre_y_m;        ///< centre of its area
  float shape_2, shape_3;              ///< eigenvalue ratios l2 / l1, l3 / l1
  float fill;                          ///< area / (length width)
  float blue, green, red;              ///< mean colour, 0..255
  float on, beside;                    ///< indices in the message; on: -1 the support, -2 nothing; beside: -1 nothing
};

/// Things found in a point cloud. Capacity: count.
struct Objects3d {
  static constexpr std::string_view type_name = "objects_3d";
  float searched = 1;                                  ///< share of the seeds, 0..1: less if the job's time ran out
  uint8_t supported = 0;                               ///< 1: a support was found
  double support_a = 0, support_b = 0, support_m = 0;  ///< z = a x + b y + support_m, robot frame
  Array<Object3d> objects;                             ///< in the order of their seeds
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = c.count; }
};

/// Where a joint of a body is. fitted 1: a point shows it; 0.5: it must be hidden behind one, and its limb has the
/// length that it should have; 0: it could not be found, and x, y, z are 0.
struct BodyJoint {
  float x, y, z, fitted;
};

/// From a joint along a limb, as from the shoulder through the wrist. dx, dy, dz a unit vector; 0 0 0: a joint of it is
/// missing.
struct PointingRay {
  float x, y, z, dx, dy, dz;
};

/// One body. Joints as the skeleton file numbers them, joint 0 its start; those beyond its joints are 0.
struct Body {
  using scalar = float;
  static constexpr size_t kMostJoints = 16, kMostPointers = 2;
  float error;    ///< of the fit (thesis Eq. 3.10), less is better
  float valid;    ///< 1: lengths and angles pass Eq. 3.11
  float yaw_rad;  ///< of its frame about the vertical, 0: faces along +y
  float top_m;    ///< height above the floor
  BodyJoint joints[kMostJoints];
  PointingRay pointing[kMostPointers];
};

/// Bodies and their joints in the robot frame, nearest first. Capacity: count.
struct BodyPoses {
  static constexpr std::string_view type_name = "body_poses";
  int32_t joints = 0;      ///< of the skeleton, its start included
  int32_t candidates = 0;  ///< clusters that could have been bodies
  float searched = 1;      ///< share of their poses tried, 0..1: less if the job's time ran out
  Array<Body> bodies;
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = c.count; }
};

/// Two-dimensional occupancy grid. Cell (column, row) covers origin + (column, row) * cell_m. Capacity: width, height.
struct Grid {
  static constexpr std::string_view type_name = "grid";
  static constexpr int16_t unknown = -1;
  int32_t width = 0, height = 0;
  double cell_m = 0;
  double origin_x_m = 0, origin_y_m = 0;
  Transform grid_in_map;
  Array<int16_t> cells;  ///< 0 free .. 1000 occupied, `unknown` = -1

  ImageView<int16_t> view() { return {cells.data(), width, height}; }
  ImageView<const int16_t> view() const { return {cells.data(), width, height}; }
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = static_cast<uint32_t>(c.pixels()); }
};

/// State of the camera head: pan about z (left positive), tilt about x (up positive).
struct HeadState {
  static constexpr std::string_view type_name = "head_state";
  double pan_rad = 0, tilt_rad = 0, roll_rad = 0;
  double pan_rad_s = 0, tilt_rad_s = 0;
  uint8_t moving = 0;
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

struct HeadCommand {
  static constexpr std::string_view type_name = "head_command";
  double pan_rad = 0, tilt_rad = 0;
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

struct VelocityCommand {
  static constexpr std::string_view type_name = "velocity_command";
  double speed_m_s = 0, turn_rad_s = 0;
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

/// Digital inputs, one bit a line (bit 0: line 0).
struct DigitalState {
  static constexpr std::string_view type_name = "digital_state";
  uint32_t levels = 0, changed = 0;
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

/// Why a stop is commanded (bits of StopCommand::reasons); 0: drive on.
namespace stop_reason {
constexpr uint32_t obstacle = 1, line = 2, scan_lost = 4, line_lost = 8, safe_stop = 16;
}

/// Stop or drive on, decided from lasers, lines and the mode alone; repeated every job, so that silence means stop.
struct StopCommand {
  static constexpr std::string_view type_name = "stop_command";
  uint32_t reasons = 0;   ///< bits of takt::stop_reason; 0: drive on
  double nearest_m = 0;   ///< of the returns in the protected area; 0: none
  double scan_age_s = 0;  ///< of the oldest scan used, at the job's release
  bool stop() const { return reasons != 0; }
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

/// What one node is asked to do: run at every n-th of its releases, or not at all.
struct Request {
  using scalar = uint8_t;
  char node[30] = {};  ///< id in the graph, ended by 0
  uint8_t run = 1;     ///< 0: stop
  uint8_t every = 1;   ///< pace; 1: each release
};

/// The whole of what a clock generator asks for at present; a node that is not named runs at its full rate. State and
/// not events, so that a message more or less changes nothing. Capacity: count.
struct Requests {
  static constexpr std::string_view type_name = "requests";
  Array<Request> wanted;
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = c.count; }
};

/// Human-readable state. Capacity: count (characters).
struct TextStatus {
  static constexpr std::string_view type_name = "text_status";
  Array<char> text;
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = c.count; }
};

/// What the floor around a robot is like; left: the robot is on its left side.
namespace terrain_kind {
constexpr uint8_t left = 0, right = 1, middle = 2, crossing = 3, unknown = 4;
}

/// Judged from an occupancy grid around the robot.
struct Terrain {
  static constexpr std::string_view type_name = "terrain";
  uint8_t kind = terrain_kind::unknown;  ///< the strongest hypothesis
  float hypotheses[5] = {};              ///< 0..1 for each terrain_kind
  float correlations[4] = {};            ///< -1..1 of the newest map with that of a kind; 0: too little is known
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

/// What an object is called and of which type it is, as the semantic network has it; ended by 0.
struct ObjectName {
  using scalar = char;
  char name[32] = {};  ///< empty: a thing just seen, which nobody has named yet
  char type[32] = {};
};
struct ObjectPlace {
  using scalar = float;
  float x_m, y_m, z_m, yaw_rad;
  float score;  ///< 0..1: how sure the type is
  float
      attributes;  ///< how many of ObjectReports::attributes are this object's; they follow those of the object before
};
struct ObjectAttribute {
  using scalar = char;
  char name[32] = {};
  char value[32] = {};  ///< as a network file writes it
};

/// Objects as the semantic network knows them, by names, so that ends with different networks understand each other.
/// names and places have one entry an object. Capacity: count (objects; eight times as many attributes).
struct ObjectReports {
  static constexpr std::string_view type_name = "object_reports";
  uint8_t in_map = 0;  ///< 0: places in the robot frame; 1: in the map frame
  Array<ObjectName> names;
  Array<ObjectPlace> places;
  Array<ObjectAttribute> attributes;
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) {
    a[0] = a[1] = c.count;
    a[2] = 8 * c.count;
  }
};

/// What somebody wants of the robot, such as a goal in words. State and not an event: repeated until another one comes.
/// Capacity: count (characters).
struct RobotTask {
  static constexpr std::string_view type_name = "task";
  uint32_t number = 0;  ///< 0: none yet; another number is another task, its text may be the same
  Array<char> text;
  static std::span<const Field> fields();
  static void capacities(const Capacity& c, std::span<uint32_t> a) { a[0] = c.count; }
};

/// An action of the semantic network to be carried out. State and not an event, as RobotTask.
struct ActionCommand {
  static constexpr std::string_view type_name = "action_command";
  uint32_t number = 0;       ///< 0: none yet
  char action[32] = {};      ///< ended by 0
  char objects[4][32] = {};  ///< names of the objects, in the order of the action's roles; empty: no such role
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

/// What became of an action (ActionOutcome::state).
namespace action_state {
constexpr uint8_t none = 0, under_way = 1, done = 2, refused = 3, failed = 4;
}

/// How far the action of the newest command is.
struct ActionOutcome {
  static constexpr std::string_view type_name = "action_outcome";
  uint32_t number = 0;  ///< of the command; 0: none yet
  uint8_t state = action_state::none;
  double duration_s = 0;  ///< so far, or of the whole
  char reason[128] = {};  ///< why it was refused or has failed; ended by 0
  static std::span<const Field> fields();
  static void capacities(const Capacity&, std::span<uint32_t>) {}
};

/// Every message type of this header, in the order above.
std::span<const MessageType* const> message_types();

}  // namespace takt
