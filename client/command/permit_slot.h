#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/time.h"
#include "core/time/base_claim.h"

namespace axlecast {

// One writer's newest value for one reader. Neither waits for the other, and neither allocates: the three values keep their memory.
template <typename T>
class NewestValue {
 public:
  // The writer: fill back(), then publish it. It replaces a value that the reader has not taken.
  [[nodiscard]] T& back() { return values_[back_]; }
  void Publish() { back_ = middle_.exchange(back_ | kFresh) & kIndex; }

  // The reader: after Take has returned true, front() is the newest value, and stays until the next Take.
  bool Take() {
    if (!fresh()) return false;
    front_ = middle_.exchange(front_) & kIndex;
    return true;
  }
  [[nodiscard]] const T& front() const { return values_[front_]; }
  [[nodiscard]] bool fresh() const { return (middle_.load() & kFresh) != 0; }

 private:
  static constexpr std::size_t kIndex = 3;
  static constexpr std::size_t kFresh = 4;

  std::array<T, 3> values_{};
  std::size_t back_ = 0;
  std::size_t front_ = 1;
  std::atomic<std::size_t> middle_ = 2;
};

// The instant of a call, on every clock by which a driver may measure the age of the permit.
struct PermitInstant {
  MonoNs mono = 0;
  std::int64_t utime = 0;  // us, UNIX time
  BaseClaim base;          // base_id 0: not known
};

// What one call of Allow or Withdraw asks for.
struct PermitRequest {
  std::vector<std::string> operations;
  std::int32_t valid_ms = 0;  // from the call
  std::int64_t issue = 0;     // of the calls of one process, in their order
  PermitInstant called;
};

// Returns the validity of a permit that is sent at `now`, so that it ends valid_ms after the call; below 1: it has ended.
[[nodiscard]] std::int32_t RemainingMs(const PermitRequest& request, MonoNs now);

// The permits of one device between the callers, which ask, and the issuer's thread, which signs and sends. Every request is sent at
// most once: without further calls, nothing is renewed. Callers of one device wait for each other, but never for the thread.
class PermitSlot {
 public:
  explicit PermitSlot(std::string device) : device_(std::move(device)) {}

  [[nodiscard]] const std::string& device() const { return device_; }

  // -- callers
  enum class Asked : std::uint8_t {
    kRefused,  // the operations do not fit into a permit
    kStored,   // the thread looks at it by itself
    kWake,     // wake the thread
  };
  // Replaces what was asked before. `issue`: the newest of the process.
  [[nodiscard]] Asked Allow(const std::vector<std::string>& operations, std::int32_t valid_ms,
                            const PermitInstant& now, std::atomic<std::int64_t>& issue);
  // Returns the request that the caller has to send; nothing if nothing was allowed since the last one. What was asked before it
  // and is not sent is never sent.
  [[nodiscard]] std::optional<PermitRequest> Withdraw(const PermitInstant& now, std::atomic<std::int64_t>& issue);

  // -- the issuer's thread
  struct Step {
    const PermitRequest* send = nullptr;  // until the next call; null: nothing
    MonoNs next = kNever;                 // when to call again, if no caller wakes the thread before
  };
  // Another request than the one that was sent last is sent at once. A request that renews it is sent a quarter of its validity
  // later: of the calls in the meantime, the newest one counts.
  [[nodiscard]] Step Next(MonoNs now);
  // Returns true if what the request allows was withdrawn after Next had returned it. A driver refuses it in any case: its issue is
  // lower. A withdrawal, which allows nothing, is always sent: a later one of another caller does not make it wrong.
  [[nodiscard]] bool IsWithdrawn(const PermitRequest& request) const {
    return !request.operations.empty() && request.issue < withdrawn_;
  }

 private:
  const std::string device_;

  std::mutex callers_;  // of the next three
  bool allows_ = false;
  std::vector<std::string> operations_;
  std::int32_t valid_ms_ = 0;

  NewestValue<PermitRequest> requests_;
  std::atomic<bool> watched_ = false;  // the thread calls Next by itself
  std::atomic<std::int64_t> withdrawn_ = 0;

  bool unsent_ = false;  // the thread's, with what follows
  PermitRequest sent_;
  MonoNs due_ = 0;
};

}  // namespace axlecast
