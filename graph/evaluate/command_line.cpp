// SPDX-License-Identifier: Apache-2.0
#include "graph/evaluate/command_line.hpp"

#include <CLI/CLI.hpp>
#include <exception>
#include <numbers>

#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/evaluate/ego_motion_sweep.hpp"

namespace takt::command {
namespace {

/// Has a task evaluate when it is asked for. What it throws is told: files or options are at fault.
template <class Options>
void call(CLI::App& task, Options& options, int& exit_code) {
  task.add_flag("--json", options.json, "one JSON object on stdout");
  task.callback([&exit_code, &options] {
    try {
      exit_code = evaluate(options);
    } catch (const std::exception& error) {
      exit_code = refuse(error);
    }
  });
}

void add_stereo(CLI::App& eval, EvalStereoOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("stereo", "bad pixels of dense stereo against ground truth, next to OpenCV");
  auto* scene = reads_folder(app->add_option(
      "--scene", o.scene, "folder with a pair and a laser's points as ground truth (data/clouds/laser_stereo)"));
  auto* left = reads_file(app->add_option("--left", o.left, "left rectified image"));
  auto* right = reads_file(app->add_option("--right", o.right, "right rectified image"))->needs(left);
  auto* truth =
      reads_file(app->add_option("--gt", o.truth, "ground truth of the left image, 0: unknown; an image, or PFM"))
          ->needs(right);
  left->needs(truth)->excludes(scene);
  app->add_option("--sweep", o.sweep, "on generated pairs: error against noise, or against the window's edge")
      ->check(CLI::IsMember({"noise", "window"}))
      ->excludes(left)
      ->excludes(scene);
  writes_file(app->add_option("--picture", o.picture, "PNG of the sweep's curves"))->needs("--sweep");
  app->add_option("--gt-scale", o.truth_scale, "disparity = value / scale (default 1)")->check(CLI::PositiveNumber);
  app->add_option("--disparities", o.disparities, "search range, px (default 64)")->check(CLI::Range(1, 512));
  app->add_option("--exposure", o.exposure, "of the right image, in that of the left one (default 1)")
      ->check(CLI::Range(0.05, 20.0))
      ->excludes("--sweep");
  app->add_option("--set", o.set, "parameter=value of the stereo node, repeatable");
  app->add_flag("--variants", o.variants, "every way of matching, too: costs, windows, selections");
  call(*app, o, exit_code);
}

void add_ego_motion(CLI::App& eval, EvalEgoMotionOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("ego_motion", "errors of stereo ego-motion against true poses");
  reads_folder(app->add_option("--data", o.data, "folder with image_l/, image_r/, calib.txt, poses.txt"));
  app->add_flag("--generated", o.generated, "drives through a room that is rendered, in several conditions");
  app->add_option("--scale", o.scale, "size of the recorded images (default 1)")->check(CLI::Range(0.1, 1.0));
  app->add_option("--disparities", o.disparities, "search range at scale 1, px (default 128)")
      ->check(CLI::Range(16, 512));
  app->add_option("--seed", o.seed, "seed of the generated drives (default 1)");
  app->add_option("--frames", o.frames, "of each generated drive (default 60)")->check(CLI::Range(3, 100000));
  app->add_option("--sweep", o.sweep, "parameter to try values of")->check(CLI::IsMember(sweep_names()));
  writes_file(
      app->add_option("--picture", o.picture, "PNG: matched corners of the middle frame, or the curves of a sweep"));
  call(*app, o, exit_code);
}

void add_objects(CLI::App& eval, EvalObjectsOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand(
      "objects",
      "histogram cascade on scenes with known objects: windows excluded, detections, misses, false positives");
  auto* database =
      reads_folder(app->add_option("--database", o.database, "folder with objects.txt (default graph/objects)"));
  reads_folder(app->add_option(
                   "--views", o.views,
                   "instead: folder with photographs objNUMBER__ANGLE.png; every 60 degrees one is learnt (COIL-100)"))
      ->excludes(database);
  reads_folder(app->add_option(
      "--scenes", o.scenes,
      "folder with photographs to put objects in, 640 x 480 PNG; every other one is learnt from instead "
      "(default: generated)"));
  reads_folder(app->add_option(
      "--negatives", o.negatives,
      "photographs without the objects, from which the stage layout learns instead of those of --scenes"));
  app->add_option("--bins", o.bins, "64x64x1 (default) | 64x32x2")->check(CLI::IsMember({"64x32x2", "64x64x1"}));
  app->add_option("--scales", o.scales, "of the image, for the cascade (default 1), such as 1+0.7+0.5");
  app->add_flag("--automatic", o.automatic, "all thresholds as if the database gave none");
  app->add_option("--size", o.size,
                  "least and most of the objects, of the cascade's, in their views' (default 0.8 1.3)")
      ->expected(2)
      ->check(CLI::Range(0.3, 4.0));
  app->add_option("--seed", o.seed, "seed of the scenes (default 1)");
  app->add_option("--frames", o.frames, "scenes for the exclusion by colour (default 100)")
      ->check(CLI::Range(1, 100000));
  app->add_option("--images", o.images, "scenes with one object for the cascade (default 500)")
      ->check(CLI::Range(1, 100000));
  app->add_option("--empty", o.empty, "scenes without (default 75)")->check(CLI::Range(0, 100000));
  app->add_option("--occlusion", o.occlusion, "largest share of an object that an occluder hides (default 0.6)")
      ->check(CLI::Range(0.0, 0.9));
  app->add_option("--budget", o.budget_ms, "ms of CPU time for each image of the cascade (default: no limit)")
      ->check(CLI::PositiveNumber);
  auto* study = app->add_flag("--study", o.study,
                              "instead: each stage by itself against bins, thresholds, references, on --frames scenes");
  writes_file(app->add_option("--picture", o.picture, "PNG of time, share excluded and contrast over the rows of bins"))
      ->needs(study);
  call(*app, o, exit_code);
}

void add_objects3d(CLI::App& eval, EvalObjects3dOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("objects3d", "attributes and classes of generated objects on a table");
  reads_folder(app->add_option("data", o.data, "folder with recorded scenes as mOSD has them: regions against labels"));
  app->add_option("--seed", o.seed, "seed of the scenes (default 1)");
  app->add_option("--samples", o.samples, "solids, samples of each class, scenes (default 60)")
      ->check(CLI::Range(2, 10000));
  app->add_option("--sigma", o.sigma_px, "noise of the disparity, px (default 0.2)")->check(CLI::Range(0.0, 2.0));
  writes_file(app->add_option("--write", o.write, "writes what the classifiers learnt from, for the node object_3d"));
  call(*app, o, exit_code);
}

void add_sift(CLI::App& eval, EvalSiftOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("sift", "SIFT as the baseline of object and sign recognition");
  reads_folder(app->add_option("data", o.data,
                               "folder CLASS/TRACK_FRAME.png (as traffic_signs/gtsrb) instead of generated scenes"));
  reads_folder(app->add_option("--database", o.database, "folder with objects.txt (default graph/objects)"));
  app->add_option("--seed", o.seed, "seed of the scenes (default 1)");
  app->add_option("--frames", o.frames, "number of scenes (default 30)")->check(CLI::Range(1, 100000));
  call(*app, o, exit_code);
}

void add_body_pose(CLI::App& eval, EvalBodyPoseOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("body_pose", "people found, where they point: generated, or in a depth image");
  app->alias("body");
  reads_file(
      app->add_option("--depth", o.depth, "depth image of a Kinect (16 bit, mm); without it people are generated"));
  reads_file(app->add_option("--rgb", o.colour, "colour image of the same size, for the picture"));
  reads_file(app->add_option("--skeleton", o.skeleton, "skeleton file (default graph/skeletons/human.txt)"));
  app->add_option("--seed", o.seed, "seed of the generated scenes (default 1)");
  app->add_option("--people", o.people, "number of scenes (default 150)")->check(CLI::Range(1, 100000));
  app->add_option("--noise", o.noise_px, "standard deviation of disparities, px (default 0.1)")
      ->check(CLI::Range(0.0, 5.0));
  app->add_option("--step", o.step_px, "of disparities, px: 1 as of stereo without subpixel (default 1/64)")
      ->check(CLI::Range(0.001, 4.0));
  app->add_option_function<double>(
         "--tilt", [&o](double degrees) { o.tilt_rad = degrees * std::numbers::pi / 180; },
         "of the camera, degrees: below 0 it looks down (default -5.7)")
      ->check(CLI::Range(-45.0, 45.0));
  app->add_option("--budget", o.budget_ms, "ms of CPU time for each scene, as the node has it (default: no limit)")
      ->check(CLI::Range(6.0, 10000.0));
  app->add_option("--search", o.search_m, "a link ends at most so far from where a pose has it, m (default 0.30)")
      ->check(CLI::Range(0.05, 2.0));
  writes_file(
      app->add_option("--picture", o.picture, "PNG with the skeletons over image and cloud (of the first scene)"));
  call(*app, o, exit_code);
}

void add_person_tracking(CLI::App& eval, EvalPersonTrackingOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("person_tracking", "a person in a chessboard T-shirt tracked on generated walks");
  app->add_option("--seed", o.seed, "of the walks (default 1)");
  app->add_option("--walks", o.walks, "default 6")->check(CLI::Range(1, 10000));
  app->add_option("--frames", o.frames, "of each walk, 15 a second (default 75)")->check(CLI::Range(1, 100000));
  writes_file(app->add_option("--picture", o.picture, "PNG of a frame with what is found in it"));
  call(*app, o, exit_code);
}

void add_registration(CLI::App& eval, EvalRegistrationOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("registration", "genetic ICP: the pose that brings one cloud to another");
  reads_file(app->add_option("--source", o.source, "cloud that is moved, PLY or PCD"));
  reads_file(app->add_option("--target", o.target, "cloud that stays"));
  reads_file(app->add_option("--reference", o.reference, "true pose, source to target: 4 x 4 numbers"));
  reads_folder(
      app->add_option("--scene", o.scene, "instead: a folder of KITTI's raw data, its stereo points to its laser's"));
  app->add_option("--displace", o.displace,
                  "m and deg: lays the source so far from its true place, about --seed's axes (default: as it came)")
      ->expected(2);
  app->add_option("--sweep", o.sweep,
                  "success (over offsets, and overlaps of generated pairs) | population (scores of a generated pair "
                  "over sizes and generations)")
      ->check(CLI::IsMember({"success", "population"}));
  app->add_option("--metric", o.metric, "what the search minimises: truncated | thesis (default truncated)")
      ->check(CLI::IsMember({"truncated", "thesis"}));
  app->add_option("--runs", o.runs, "of a sweep, for each of its settings (default 20)")->check(CLI::Range(1, 10000));
  app->add_option("--points", o.points, "of each cloud in the search, at most (default 1000)")
      ->check(CLI::Range(50, 100000));
  app->add_option("--cut", o.cut_m,
                  "pairs are at most so far apart, m (default: 0.25 in sweeps, else by the clouds' spacing)")
      ->check(CLI::PositiveNumber);
  app->add_option("--generations", o.generations, "default 25000")->check(CLI::Range(1, 10'000'000));
  app->add_option("--population", o.population, "default 100")->check(CLI::Range(2, 10'000));
  app->add_option("--patience", o.patience,
                  "generations without a gain after which a search begins anew; 0: never (default 1000)")
      ->check(CLI::Range(0, 10'000'000));
  app->add_option("--sigma", o.sigma_m, "of match probabilities, m (default 0.4 of the cut)")
      ->check(CLI::PositiveNumber);
  app->add_option("--seed", o.seed, "of the search, of generated pairs and of displacements (default 1)");
  writes_file(app->add_option("--out", o.out, "writes the target with the source's colours (.ply, .pcd)"))
      ->excludes("--sweep");
  writes_file(
      app->add_option("--picture", o.picture,
                      "PNG: before, after, match probability from red to green, colours; or the curves of a sweep"));
  call(*app, o, exit_code);
}

void add_ground(CLI::App& eval, EvalGroundOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("ground", "ground mask against labels, or on a pavement that is generated");
  reads_folder(app->add_option("--images", o.images, "folder with colour images"));
  reads_folder(
      app->add_option("--labels", o.labels, "folder with a PNG of class ids for each image, of the same name"));
  app->add_option("--drivable", o.drivable, "class ids that are ground, e.g. 3,4")
      ->delimiter(',')
      ->check(CLI::Range(0, 255));
  app->add_option("--ignore", o.ignore, "class ids that are not counted")->delimiter(',')->check(CLI::Range(0, 255));
  app->add_option("--learn", o.learn,
                  "images that teach instead, e.g. 'first*' (default: each its own, and next to it the other drives)");
  app->add_option("--set", o.set, "parameter=value of the ground_map node, repeatable");
  app->add_option("--seed", o.seed, "seed of the generated pavement (default 1)");
  app->add_option("--frames", o.frames, "images along the generated drive (default 60)")->check(CLI::Range(1, 100000));
  app->add_flag("--variants", o.variants, "the generated pavement in other light and of other stone, too");
  writes_file(app->add_option("--picture", o.picture, "PNG of the last generated image with its mask, and the grid"));
  call(*app, o, exit_code);
}

void add_terrain(CLI::App& eval, EvalTerrainOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("terrain", "kinds of terrain along generated drives, as a confusion matrix");
  reads_file(app->add_option("--maps", o.maps, "of each kind (default: the shipped graph/terrain.txt)"));
  app->add_option("--seed", o.seed, "of the first drive (default 2; the shipped maps were learnt with 1)");
  app->add_option("--drives", o.drives, "how many, each with the next seed (default 2)")->check(CLI::Range(1, 1000));
  writes_file(app->add_option("--picture", o.picture, "PNG of the four maps"));
  call(*app, o, exit_code);
}

void add_signs(CLI::App& eval, EvalSignsOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand(
      "signs", "traffic signs found: on crops, in photographs, or (without either) on generated scenes and passages");
  reads_folder(app->add_option("--signs", o.signs, "folder with signs.txt (default graph/signs)"));
  auto* crops = reads_folder(
      app->add_option("--crops", o.crops, "folder with images of one sign each, a border of 10 % around it"));
  auto* labels = reads_file(app->add_option(
      "--labels", o.labels, "CSV with columns file, name: of all crops; TRACK_FRAME.png is one image of a track"));
  auto* scenes = reads_folder(app->add_option("--scenes", o.scenes, "folder with photographs"));
  auto* boxes =
      reads_file(app->add_option("--boxes", o.boxes, "CSV with columns file, class, x, y, w, h: of all signs in them"));
  crops->needs(labels)->excludes(scenes);
  labels->needs(crops);
  scenes->needs(boxes);
  boxes->needs(scenes);
  app->add_option("--seed", o.seed, "of generated scenes and passages (default 1)");
  app->add_option("--count", o.count, "of generated scenes (default 150)")->check(CLI::Range(1, 100000));
  app->add_option("--passages", o.passages, "default 70")->check(CLI::Range(1, 100000));
  app->add_option("--budget", o.budget_ms, "ms for each image of a passage (default 36)")->check(CLI::PositiveNumber);
  app->add_option("--confirm", o.confirm, "images in a row until a sign of a passage counts (default 2)")
      ->check(CLI::Range(1, 12));
  call(*app, o, exit_code);
}

void add_scan_matching(CLI::App& eval, EvalScanMatchingOptions& o, int& exit_code) {
  CLI::App* app =
      eval.add_subcommand("scan_matching", "laser odometry against corrected poses, or in a generated room");
  reads_file(app->add_option("--log", o.log, "CARMEN log that a mapping program has corrected"));
  app->add_flag("--without-odometry", o.without_odometry, "matching expects the last motion to go on instead");
  app->add_option("--seed", o.seed, "seed of the generated drive (default 1)");
  writes_file(app->add_option("--picture", o.picture, "PNG of the map that the matched scans make, 10 cm a pixel"));
  call(*app, o, exit_code);
}

void add_lms200(CLI::App& eval, EvalLms200Options& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("lms200", "captured bytes of a SICK LMS 200 against the index of the capture");
  reads_file(app->add_option("--rx", o.rx, "bytes that the scanner sent"))->required();
  reads_file(app->add_option("--index", o.index, "CSV: time,direction,offset,length,command,ok|BAD"))->required();
  reads_file(app->add_option("--distances", o.distances, "CSV: time, then metres, a line for each scan"));
  call(*app, o, exit_code);
}

void add_semantic(CLI::App& eval, EvalSemanticOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("semantic",
                                      "generated rooms of objects seen with noise, and what a semantic map "
                                      "makes of them; or a network from a file, and a plan in it");
  app->add_option("--rooms", o.rooms, "default 10")->check(CLI::Range(1, 10000));
  app->add_option("--objects", o.objects, "in each room (default 30)")->check(CLI::Range(1, 100));
  app->add_option("--looks", o.looks, "of the robot in each room (default 300)")->check(CLI::Range(2, 100000));
  app->add_option("--noise", o.noise_m, "of a place, m (default 0.3)")->check(CLI::Range(0.0, 5.0));
  app->add_option("--merge-min", o.merge_min, "p_min (default 0.75)")->check(CLI::Range(0.5, 1.0));
  app->add_option("--distance-max", o.distance_max_m, "d_max, m (default 2)")->check(CLI::Range(0.1, 20.0));
  app->add_flag("--sweep", o.sweep, "over p_min and d_max");
  app->add_flag("--tell", o.tell, "one room: each decision and why");
  app->add_option("--seed", o.seed, "of the first room (default 1)");
  CLI::Option* network = reads_file(app->add_option("--network", o.network, "YAML file with a predefined network"));
  writes_file(app->add_option("--dot", o.dot, "writes that network for Graphviz"))->needs(network);
  writes_file(app->add_option("--graphml", o.graphml, "writes it as GraphML"))->needs(network);
  app->add_option("--goal", o.goals, "OBJECT.ATTRIBUTE=VALUE, repeatable: plans how it can come true")->needs(network);
  app->add_option("--at", o.at, "where the robot is then: x y, m (default 0 0)")->expected(2)->needs(network);
  app->add_flag("--recursive", o.recursive, "by the thesis's recursion instead of A*")->needs(network);
  call(*app, o, exit_code);
}

void add_obstacle_stop(CLI::App& eval, EvalObstacleStopOptions& o, int& exit_code) {
  CLI::App* app =
      eval.add_subcommand("obstacle_stop", "people step before a robot that drives through a simulated yard");
  app->add_option("--trials", o.trials, "of each kind of vision (default 1000)")->check(CLI::Range(1, 1'000'000));
  app->add_option("--seed", o.seed, "of the trials (default 1)");
  app->add_option("--vision", o.vision, "what else uses the CPUs: absent | overloaded | hanging | all (default)")
      ->check(CLI::IsMember({"absent", "overloaded", "hanging", "all"}));
  call(*app, o, exit_code);
}

void add_mapping(CLI::App& eval, EvalMappingOptions& o, int& exit_code) {
  CLI::App* app = eval.add_subcommand("mapping", "fused clouds, maps and obstacle grids against generated worlds");
  reads_folder(app->add_option(
      "--data", o.data, "recorded depth images and poses: depth/1.png .. and pose.txt, or a TUM RGB-D recording"));
  app->add_option("--minutes", o.minutes, "of the long drive (default 30; 0: none)")->check(CLI::Range(0.0, 600.0));
  app->add_option("--runs", o.runs, "generated windows and scenes of a kind (default 20)")
      ->check(CLI::Range(1, 10'000));
  app->add_option("--clouds", o.clouds, "of the walk around a room (default 80)")->check(CLI::Range(3, 100'000));
  app->add_option("--views", o.views, "that are fused (default 5)")->check(CLI::Range(1, 16));
  app->add_option("--seed", o.seed, "of everything generated (default 1)");
  writes_file(app->add_option("--out", o.out, "PLY or PCD file of the room's map"));
  writes_file(app->add_option("--grid", o.grid, "YAML file of the room's occupancy grid, its PNG next to it"));
  writes_file(app->add_option("--picture", o.picture, "PNG of the room's map, from above and from the side"));
  call(*app, o, exit_code);
}

}  // namespace

void add_evaluations(CLI::App& eval, Evaluations& o, int& exit_code) {
  eval.require_subcommand(1);
  add_stereo(eval, o.stereo, exit_code);
  add_ego_motion(eval, o.ego_motion, exit_code);
  add_objects(eval, o.objects, exit_code);
  add_objects3d(eval, o.objects3d, exit_code);
  add_sift(eval, o.sift, exit_code);
  add_body_pose(eval, o.body_pose, exit_code);
  add_person_tracking(eval, o.person_tracking, exit_code);
  add_registration(eval, o.registration, exit_code);
  add_ground(eval, o.ground, exit_code);
  add_terrain(eval, o.terrain, exit_code);
  add_signs(eval, o.signs, exit_code);
  add_scan_matching(eval, o.scan_matching, exit_code);
  add_lms200(eval, o.lms200, exit_code);
  add_semantic(eval, o.semantic, exit_code);
  add_obstacle_stop(eval, o.obstacle_stop, exit_code);
  add_mapping(eval, o.mapping, exit_code);
}

}  // namespace takt::command
