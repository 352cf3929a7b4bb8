// For LD_PRELOAD: a disk that does not answer while the file $AXLECAST_DISK_STALLS exists: fsync and fdatasync return when
// it has gone.

#include <dlfcn.h>
#include <unistd.h>

#include <cstdlib>

namespace {

void Wait() {
  constexpr useconds_t kLookUs = 5'000;
  const char* const stalls = std::getenv("AXLECAST_DISK_STALLS");
  while (stalls != nullptr && access(stalls, F_OK) == 0) usleep(kLookUs);
}

int Synchronise(const char* name, int file) {
  Wait();
  return reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, name))(file);
}

}  // namespace

extern "C" {

int fsync(int file) { return Synchronise("fsync", file); }
int fdatasync(int file) { return Synchronise("fdatasync", file); }

}  // extern "C"
