# SPDX-License-Identifier: Apache-2.0
# Parameters that are set in a run: each of each node has the effect that it has from the start, and a replay repeats it.
source "$(dirname "$0")/lib.sh" "$@"
walk=$3

echo "=== every live parameter of every node type: set before the first job, it is as if it had been so from the start"
records=()
record() { # FILE SECONDS OPTIONS: whether the scenario comes to its end does not matter here
  local name
  name=$(basename "$1" .yaml)
  "$takt" run "$source/$1" --clock virtual --isolate none --for "$2" --record "$work/$name.mcap" --record-port all \
    --output "$work/out" "${@:3}" >"$work/$name.txt" 2>&1
  [ -s "$work/$name.mcap" ] && grep -q "nothing lost" "$work/$name.txt" || { cat "$work/$name.txt"; fail "no record of $name"; }
  records+=("$work/$name.mcap")
}
record graph/ace.yaml 3s --set semantic.request=laser_fusion  # which has no jobs else
record graph/people.yaml 3s
record graph/yard.yaml 3s
for scenario in raw_cloud mission cup cup_seen; do record tests/scenarios/$scenario.yaml 3s; done
(cd "$work" && "$walk" "${records[@]}") || fail "the walk through the parameters"

echo "=== set while the graph runs, recorded, replayed"
sets=(
  body_pose.rotations=7 body_pose.floor=12cm ego_motion.brightness=false ego_motion.n_search=9 ego_motion.predict=constant_velocity
  ground_map.t_w=0.5 ground_map.mean_size=5 ground_map.trapezoid_height=0.15 ground_map.up=0.3 mapping_3d.z_floor=10cm
  mapping_3d.outlier_radius=0m mapping_3d.camera_tilt=0.1rad object_3d.d_max=3cm object_detection.min_score=0.5
  obstacle_stop.margin=15cm obstacle_stop.memory=1s person_tracking.confirm=2 robot_pose.gate=9 scan_matching.score_min=0.5
  semantic.idle=stereo semantic.strip=1.1m semantic_map.merge_min=0.8 stereo.min_confidence=0.4 stereo.cloud_step=4
  traffic_signs.confirm=1 traversability.slope=0.2rad laser_fusion.generations=500
)
start_run live --for 0s --record "$work/live.mcap"
for set in "${sets[@]}"; do expect 0 "" "$takt" set "${set%%=*}" "${set#*=}" --run $run; done
expect 2 "is fixed while the graph runs (sizes memory); give it in the graph's file or with --set" "$takt" set stereo.disparities 64 --run $run
expect 2 "is fixed while the graph runs (read at start)" "$takt" set object_detection.database objects --run $run
expect 2 "memory was taken for the points of 2 px" "$takt" set stereo.cloud_step 1 --run $run
expect 2 "must lie below range_max" "$takt" set mapping_3d.range_min 40m --run $run
expect 2 "must be odd" "$takt" set ground_map.mean_size 4 --run $run
expect 0 "" "$takt" get ground_map.mean_size --run $run
prints "ground_map.mean_size 5 (set at "
end_run 0 1
expect 0 "" "$takt" log info "$work/live.mcap"
for isolate in none subsystem; do
  tells 0 " 0 differ" "$takt" replay "$work/live.mcap" --compare --isolate $isolate --output "$work/out"
done
finish
