// SPDX-License-Identifier: Apache-2.0
// `takt eval TASK`: quality against ground truth. evaluate() prints a table to stdout, or with `json` one object and
// nothing else, and returns the exit code of the command; it throws where files or options are at fault.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace takt::object_detection {
struct DatabaseObject;
}

namespace takt::command {

struct EvalStereoOptions {
  std::filesystem::path left, right, truth;
  std::filesystem::path scene;  ///< instead: a folder as in data/clouds/laser_stereo
  double truth_scale = 1;       ///< disparity = value / scale
  int disparities = 64;
  double exposure = 1;           ///< of the right image, in that of the left one
  std::vector<std::string> set;  ///< "param=value" of the stereo node
  bool variants = false;
  std::string sweep, picture;  ///< "noise" or "window"; PNG of its curves
  bool json = false;
};
/// Error and time on generated pairs against the sensor's noise, or the edge of the window.
int sweep_stereo(const EvalStereoOptions& options);
int evaluate(const EvalStereoOptions& options);

struct EvalEgoMotionOptions {
  std::filesystem::path data;  ///< image_l/, image_r/, calib.txt, poses.txt; empty: drives are generated
  bool generated = false;
  double scale = 1;  ///< of the images in `data`
  int disparities = 128;
  uint64_t seed = 1;
  int frames = 60;  ///< of each generated drive
  std::string sweep;
  std::string picture;
  bool json = false;
};
int evaluate(const EvalEgoMotionOptions& options);

struct EvalObjectsOptions {
  std::filesystem::path database;                ///< empty: graph/objects of the project
  std::filesystem::path views;                   ///< of a turntable, instead of a database; empty: none
  std::filesystem::path scenes;                  ///< photographs to put them in; empty: generated
  std::vector<std::filesystem::path> negatives;  ///< empty: every other one of `scenes`
  std::string bins = "64x64x1";
  std::string scales = "1";
  uint64_t seed = 1;
  int frames = 100;
  int images = 500, empty = 75;
  double occlusion = 0.6;
  double budget_ms = 0;                ///< of CPU time for an image; 0: none
  std::vector<double> size{0.8, 1.3};  ///< of the objects in the cascade's scenes, in that of their views
  bool automatic = false;              ///< thresholds, whatever the database says
  bool study = false;
  std::string picture;  ///< of the study
  bool json = false;
};
/// Time, share excluded and contrast of each stage against bins, thresholds and references (thesis Fig. 3.20).
void study_objects(const EvalObjectsOptions& options, std::span<const object_detection::DatabaseObject> database);
int evaluate(const EvalObjectsOptions& options);

struct EvalObjects3dOptions {
  std::filesystem::path data;   ///< recorded scenes; empty: none
  std::filesystem::path write;  ///< training data; empty: not written
  uint64_t seed = 1;
  size_t samples = 60;
  double sigma_px = 0.2;
  bool json = false;
};
int evaluate(const EvalObjects3dOptions& options);

struct EvalSiftOptions {
  std::filesystem::path data;      ///< pictures by class; empty: scenes are generated
  std::filesystem::path database;  ///< empty: graph/objects of the project
  uint64_t seed = 1;
  int frames = 30;
  bool json = false;
};
int evaluate(const EvalSiftOptions& options);

struct EvalBodyPoseOptions {
  std::filesystem::path depth, colour;  ///< of a Kinect; empty: people are generated
  std::filesystem::path skeleton;       ///< empty: the shipped human
  uint64_t seed = 1;
  int people = 150;
  double noise_px = 0.1, step_px = 1.0 / 64;  ///< of disparities
  double tilt_rad = -0.1;                     ///< of the camera
  double budget_ms = 0;                       ///< of CPU time for a scene; 0: none
  double search_m = 0.30;                     ///< of the fit
  std::string picture;
  bool json = false;
};
int evaluate(const EvalBodyPoseOptions& options);

struct EvalPersonTrackingOptions {
  uint64_t seed = 1;
  int walks = 6, frames = 75;  ///< of each walk
  std::string picture;
  bool json = false;
};
int evaluate(const EvalPersonTrackingOptions& options);

struct EvalRegistrationOptions {
  std::filesystem::path source, target, reference;  ///< all three, or a scene, or a sweep
  std::filesystem::path scene;                      ///< folder of KITTI's raw data
  std::vector<double> displace;                     ///< m, deg: away from the true pose; empty: as the clouds came
  std::string sweep, metric;                        ///< of the pair given, or of generated ones
  size_t runs = 20, points = 1000, population = 100;
  uint32_t generations = 25'000, patience = 1000;
  double cut_m = 0, sigma_m = 0;  ///< 0: chosen
  uint64_t seed = 1;
  std::filesystem::path out;  ///< fused cloud
  std::string picture;
  bool json = false;
};
int evaluate(const EvalRegistrationOptions& options);

struct EvalGroundOptions {
  std::filesystem::path images, labels;  ///< all three, or none: a pavement is generated
  std::vector<int> drivable;             ///< class ids
  std::vector<int> ignore;
  std::string learn;             ///< shell pattern of file names
  bool variants = false;         ///< the generated pavement in other light and of other stone, too
  std::vector<std::string> set;  ///< "param=value" of the ground_map node
  uint64_t seed = 1;
  int frames = 60;
  std::string picture;
  bool json = false;
};
int evaluate(const EvalGroundOptions& options);

struct EvalTerrainOptions {
  std::filesystem::path maps;  ///< empty: graph/terrain.txt of the project
  uint64_t seed = 2;
  int drives = 2;
  std::string picture;
  bool json = false;
};
int evaluate(const EvalTerrainOptions& options);

struct EvalSignsOptions {
  std::filesystem::path signs;          ///< empty: graph/signs of the project
  std::filesystem::path crops, labels;  ///< both, or
  std::filesystem::path scenes, boxes;  ///< both, or none of the four: scenes and passages are generated
  uint64_t seed = 1;
  int count = 150, passages = 70;
  double budget_ms = 36;
  int confirm = 2;  ///< images in a row until a track counts
  bool json = false;
};
int evaluate(const EvalSignsOptions& options);

struct EvalScanMatchingOptions {
  std::filesystem::path log;  ///< CARMEN log with corrected poses; empty: a drive is generated
  bool without_odometry = false;
  uint64_t seed = 1;
  std::string picture;
  bool json = false;
};
int evaluate(const EvalScanMatchingOptions& options);

struct EvalLms200Options {
  std::filesystem::path rx, index, distances;  ///< distances empty: not compared
  bool json = false;
};
int evaluate(const EvalLms200Options& options);

struct EvalSemanticOptions {
  size_t rooms = 10, objects = 30, looks = 300;
  double noise_m = 0.3, merge_min = 0.75, distance_max_m = 2;
  bool sweep = false, tell = false;
  uint64_t seed = 1;
  std::filesystem::path network, dot, graphml;  ///< instead of rooms; empty: none
  std::vector<std::string> goals;               ///< "OBJECT.ATTRIBUTE=VALUE"
  std::vector<double> at{0, 0};                 ///< the robot, m
  bool recursive = false;
  bool json = false;
};
int evaluate(const EvalSemanticOptions& options);

struct EvalObstacleStopOptions {
  int trials = 1000;  ///< of each kind of vision
  uint64_t seed = 1;
  std::string vision = "all";  ///< absent, overloaded, hanging
  bool json = false;
};
int evaluate(const EvalObstacleStopOptions& options);

struct EvalMappingOptions {
  std::filesystem::path data;  ///< depth/1.png .., pose.txt; empty: generated rooms alone
  double minutes = 30;         ///< of the long drive; 0: none
  size_t runs = 20, clouds = 80;
  size_t views = 5;
  uint64_t seed = 1;
  std::filesystem::path out, grid;  ///< the map of the room: PLY or PCD; YAML beside a PNG
  std::string picture;
  bool json = false;
};
int evaluate(const EvalMappingOptions& options);

}  // namespace takt::command
