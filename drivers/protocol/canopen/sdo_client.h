#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/device/step.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::canopen {

// One transfer that is over.
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
  Interval received = {};  // arrival of the answer, or when it was missed

  [[nodiscard]] bool ok() const { return kind == Kind::kValue || kind == Kind::kWritten; }
};

// The client's side of one node's default SDO channel (CiA 301 7.2.4.3): one expedited transfer at a time. It
// follows from the events alone, whoever decided what was asked and why.
//
// An answer names its object but not its request. So after a time-out the next transfer must be a fence: of an object
// of which no answer may still come. A server answers in order, hence once the fence is answered no late answer is left.
// Until then an answer that names an object of an unanswered request is taken for that request's.
class SdoClient {
 public:
  // `late`: longest time from a request to its answer.
  SdoClient(std::uint8_t node, MonoNs timeout, MonoNs late) : node_(node), timeout_(timeout), late_(late) {}

  // The link or the node begins anew. Answers to what was asked before may still come.
  void Reset();

  // Nothing is under way and nothing must be sent first.
  [[nodiscard]] bool free() const { return !pending_ && !abort_; }
  // Ends the transfer that timed out or cannot be handled: to be sent before anything else.
  [[nodiscard]] const std::optional<CanFrame>& abort() const { return abort_; }
  // When the answer is to be missed; kNever when nothing is under way.
  [[nodiscard]] MonoNs due() const { return pending_ ? due_ : kNever; }
  // The object to be read before any other; nothing when no late answer can come.
  [[nodiscard]] std::optional<ObjectId> fence() const { return fence_; }
  // Transfers in a row that brought no answer.
  [[nodiscard]] int silent_in_a_row() const { return silent_in_a_row_; }

  // Any event of the bus. The result of the transfer that it ends. `foreign`: an answer came that belongs to none.
  [[nodiscard]] std::optional<SdoResult> On(const Event& event, bool& foreign);

 private:
  void OnSent(const Event& event);
  [[nodiscard]] std::optional<SdoResult> OnAnswer(const Event& event, bool& foreign);
  [[nodiscard]] SdoResult End(SdoResult::Kind kind, std::uint32_t value, Interval received);
  [[nodiscard]] SdoResult TimeOut(MonoNs now);
  [[nodiscard]] bool TakeLate(ObjectId object, MonoNs now);
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
