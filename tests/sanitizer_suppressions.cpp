// SPDX-License-Identifier: Apache-2.0
// What the sanitizers must overlook, linked into every program of their presets. Only names of third parties may stand
// here: none of these libraries is built with a sanitizer, so that their own synchronisation is invisible to it.
extern "C" const char* __tsan_default_suppressions();  // the sanitizers look for these names
extern "C" const char* __lsan_default_suppressions();

extern "C" const char* __tsan_default_suppressions() {
  return  // iceoryx: lock-free queues, the daemon's threads
      "race:iox::posix::PosixUser\n"
      "race:libiceoryx_hoofs.so\n"
      "race:libiceoryx_posh.so\n"
      "race:libiceoryx_posh_roudi.so\n"
      // OpenCV's thread pool
      "race:libopencv_core.so\n"
      // GDAL, which OpenCV's image reading brings, takes two locks of its own in either order when it is loaded
      "deadlock:libgdal.so\n";
}

extern "C" const char* __lsan_default_suppressions() {
  return  // sdbus-c++ 1.2 forgets the connection of a bus that it could not open
      "leak:sd_bus_new\n";
}
