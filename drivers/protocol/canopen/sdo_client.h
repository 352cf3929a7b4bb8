#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/device/step.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::canopen {

// A transfer that has ended.
struct SdoResult {
  enum class Kind : std::uint8_t {
    kValue,      // read: `value`
    kWritten,    // written
    kAborted,    // the server refused: `value` is the abort code
    kSegmented,  // the object is longer than four bytes; the client has ended the transfer
    kTimedOut,   // no answer; the client has ended the transfer
  };
  Kind kind = Kind::kTimedOut;
  SdoRequest request = {};
  std::uint32_t value = 0;
  Interval sent = {};      // around the write of the request
  Interval received = {};  // arrival of the answer, or the time of the timeout
};

// The client's side of one node's default SDO channel (CiA 301 7.2.4.3): one expedited transfer at a time. Its state follows
// from the events alone, not from who selects the objects.
//
// An answer names its object but not its request. So after a timeout, the next transfer must be a fence: it reads an object
// of which no late answer can come. A server answers in order, hence no late answer is left once the fence is answered.
// Until then, an answer that names an object of an unanswered request is taken for that request's.
class SdoClient {
 public:
  // `late`: longest time from a request to its answer.
  SdoClient(std::uint8_t node, MonoNs timeout, MonoNs late) : node_(node), timeout_(timeout), late_(late) {}

  // The link or the node has restarted. Answers to earlier requests may still come.
  void Reset();

  // Returns whether no transfer is under way and no abort must be sent first.
  [[nodiscard]] bool free() const { return !pending_ && !abort_; }
  // Returns the frame that ends a transfer that timed out or cannot be handled. It must be sent before anything else.
  [[nodiscard]] const std::optional<CanFrame>& abort() const { return abort_; }
  // Returns when the pending transfer times out; kNever without one.
  [[nodiscard]] MonoNs due() const { return pending_ ? due_ : kNever; }
  // Returns the object that must be read before any other; nothing if no late answer can come.
  [[nodiscard]] std::optional<ObjectId> fence() const { return fence_; }
  // Returns the number of consecutive transfers without an answer.
  [[nodiscard]] int silent_in_a_row() const { return silent_in_a_row_; }

  // The effect of an event.
  struct Evaluation {
    std::optional<SdoResult> result;  // of the transfer that the event ended
    bool unexpected_answer = false;   // an answer that belongs to no pending transfer
  };
  // Receives any event of the bus.
  [[nodiscard]] Evaluation On(const Event& event);

 private:
  void OnSent(const Event& event);
  [[nodiscard]] Evaluation OnAnswer(const Event& event);
  [[nodiscard]] SdoResult End(SdoResult::Kind kind, std::uint32_t value, Interval received);
  [[nodiscard]] SdoResult TimeOut(MonoNs now);
  // Returns whether the answer belongs to a request that timed out: the oldest of that object.
  [[nodiscard]] bool TakeLate(ObjectId object, MonoNs now);
  // Returns an object of which no late answer can come, if there is one.
  [[nodiscard]] ObjectId Fence() const;

  // A request that timed out and may still be answered.
  struct Unanswered {
    ObjectId object;
    MonoNs until = 0;
  };

  const std::uint8_t node_;
  const MonoNs timeout_;
  const MonoNs late_;
  std::vector<Unanswered> unanswered_;  // the oldest first
  std::optional<SdoRequest> pending_;
  Interval sent_;
  MonoNs due_ = kNever;
  std::optional<CanFrame> abort_;
  std::optional<ObjectId> fence_;
  int silent_in_a_row_ = 0;
};

}  // namespace axlecast::canopen
