// SPDX-License-Identifier: Apache-2.0
#include "hal/object_sensor/object_sensor_node.hpp"

namespace takt {

void ObjectSensorNode::setup(Setup& setup) {
  open_in_setup(setup);
  Capacity capacity;
  capacity.count = sensor_->most_objects();
  objects_.reserve(capacity);
}

void ObjectSensorNode::run(Job& job) {
  ObjectReports* message = running(job) ? objects_.loan() : nullptr;
  // Of damaged reports nothing is sent: an object that is missing would look as if it were gone.
  if (message == nullptr) return job.no_result();
  const ObjectReading reading = sensor_->read(*message, job.release_ns(), job.deadline_ns());
  if (accept(reading.status, job)) objects_.send(reading.stamp_ns);
}

}  // namespace takt
