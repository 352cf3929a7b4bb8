#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
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

// A server confirms a save when it is done (7.5.2.13); writing its memory takes some makers' encoders 400 ms and
// more.
inline constexpr MonoNs kSaveTime = 5 * kSecond;

// Every node answers or aborts a read of these.
inline constexpr std::array kFences = {kDeviceType, kVendor, kProduct, kRevision, kSerial};

// Returns whether the answer may belong to the request.
inline bool Answers(const SdoAnswer& answer, const SdoRequest& request) {
  // Some servers abort without naming the object.
  if (answer.kind == SdoAnswer::Kind::kAborted && answer.object == ObjectId{}) return true;
  if (answer.object != request.object) return false;
  switch (answer.kind) {
    case SdoAnswer::Kind::kValue:
    case SdoAnswer::Kind::kSegmented:
      return !request.write;
    case SdoAnswer::Kind::kWritten:
      return request.write.has_value();
    case SdoAnswer::Kind::kAborted:
      return true;
    case SdoAnswer::Kind::kMalformed:
      break;
  }
  return false;
}

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
  void Reset() {
    pending_.reset();
    abort_.reset();
    fence_.reset();
    silent_in_a_row_ = 0;
  }

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
  [[nodiscard]] Evaluation On(const Event& event) {
    const bool own_request = event.id == kSdoRequestId + node_;
    if (event.kind == Event::Kind::kSent && own_request) OnSent(event);
    if (event.kind == Event::Kind::kNotSent && own_request) abort_.reset();
    Evaluation evaluation;
    if (event.kind == Event::Kind::kFrame && event.id == kSdoAnswerId + node_) evaluation = OnAnswer(event);
    if (pending_ && event.received.last >= due_) evaluation.result = TimeOut(event.received.last);
    return evaluation;
  }

 private:
  void OnSent(const Event& event) {
    abort_.reset();
    const std::optional<SdoRequest> request = ParseRequest(event.bytes);
    if (!request) return;
    pending_ = request;
    sent_ = event.received;
    due_ = sent_.last + (request->object == kStoreAll && request->write ? std::max(kSaveTime, timeout_) : timeout_);
  }
  [[nodiscard]] Evaluation OnAnswer(const Event& event) {
    const SdoAnswer answer = ParseAnswer(event.bytes);
    if (TakeLate(answer.object, event.received.last) || !pending_ || !Answers(answer, *pending_)) {
      return {.result = {}, .unexpected_answer = true};
    }
    silent_in_a_row_ = 0;
    unanswered_.clear();
    if (fence_ == pending_->object) fence_.reset();
    SdoResult::Kind kind = SdoResult::Kind::kAborted;
    if (answer.kind == SdoAnswer::Kind::kValue) kind = SdoResult::Kind::kValue;
    if (answer.kind == SdoAnswer::Kind::kWritten) kind = SdoResult::Kind::kWritten;
    if (answer.kind == SdoAnswer::Kind::kSegmented) {
      kind = SdoResult::Kind::kSegmented;
      abort_ = AbortFrame(node_, pending_->object, AbortCode::kBadLength);
    }
    return {.result = End(kind, answer.value, event.received)};
  }
  [[nodiscard]] SdoResult End(SdoResult::Kind kind, std::uint32_t value, Interval received) {
    const SdoRequest request = *std::exchange(pending_, std::nullopt);
    return {.kind = kind, .request = request, .value = value, .sent = sent_, .received = received};
  }
  [[nodiscard]] SdoResult TimeOut(MonoNs now) {
    ++silent_in_a_row_;
    abort_ = AbortFrame(node_, pending_->object, AbortCode::kTimedOut);
    std::erase_if(unanswered_, [now](const Unanswered& request) { return request.until <= now; });
    unanswered_.push_back({pending_->object, sent_.last + late_});
    fence_ = Fence();
    return End(SdoResult::Kind::kTimedOut, 0, {now, now});
  }
  // Returns whether the answer belongs to a request that timed out: the oldest of that object.
  [[nodiscard]] bool TakeLate(ObjectId object, MonoNs now) {
    std::erase_if(unanswered_, [now](const Unanswered& request) { return request.until <= now; });
    const auto found = std::find_if(unanswered_.begin(), unanswered_.end(),
                                    [object](const Unanswered& request) { return request.object == object; });
    if (found == unanswered_.end()) return false;
    unanswered_.erase(unanswered_.begin(), found + 1);  // answers come in the order of their requests
    return true;
  }
  // Returns an object of which no late answer can come, if there is one.
  [[nodiscard]] ObjectId Fence() const {
    const auto is_free = [this](ObjectId object) {
      return std::none_of(unanswered_.begin(), unanswered_.end(),
                          [object](const Unanswered& request) { return request.object == object; });
    };
    const auto* found = std::find_if(kFences.begin(), kFences.end(), is_free);
    return found != kFences.end() ? *found : kFences.front();
  }

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
