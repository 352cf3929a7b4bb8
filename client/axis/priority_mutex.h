#pragma once

#include <pthread.h>

namespace axlecast {

// A mutex whose owner inherits the priority of a thread that waits for it (PTHREAD_PRIO_INHERIT): a control thread waits for the
// receiving thread only while that holds the mutex, even if other threads would run before it.
class PriorityMutex {
 public:
  PriorityMutex() {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_init(&mutex_, &attributes);
    pthread_mutexattr_destroy(&attributes);
  }
  ~PriorityMutex() { pthread_mutex_destroy(&mutex_); }
  PriorityMutex(const PriorityMutex&) = delete;
  PriorityMutex& operator=(const PriorityMutex&) = delete;

  // NOLINTNEXTLINE(readability-identifier-naming): as std::lock_guard calls it
  void lock() { pthread_mutex_lock(&mutex_); }
  // NOLINTNEXTLINE(readability-identifier-naming)
  void unlock() { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_{};
};

}  // namespace axlecast
