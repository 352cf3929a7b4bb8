#include "drivers/protocol/canopen/sdo_client.h"

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::canopen {
namespace {

using Kind = SdoResult::Kind;

// A server confirms a save when it is done (7.5.2.13); writing its memory takes some makers' encoders 400 ms and
// more.
constexpr MonoNs kSaveTime = 5 * kSecond;

// Every node answers or aborts a read of these.
constexpr std::array kFences = {kDeviceType, kVendor, kProduct, kRevision, kSerial};

bool Answers(const SdoAnswer& answer, const SdoRequest& request) {
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

}  // namespace

void SdoClient::Reset() {
  pending_.reset();
  abort_.reset();
  fence_.reset();
  silent_in_a_row_ = 0;
}

SdoClient::Evaluation SdoClient::On(const Event& event) {
  const bool own_request = event.id == kSdoRequestId + node_;
  if (event.kind == Event::Kind::kSent && own_request) OnSent(event);
  if (event.kind == Event::Kind::kNotSent && own_request) abort_.reset();
  Evaluation evaluation;
  if (event.kind == Event::Kind::kFrame && event.id == kSdoAnswerId + node_) evaluation = OnAnswer(event);
  if (pending_ && event.received.last >= due_) evaluation.result = TimeOut(event.received.last);
  return evaluation;
}

void SdoClient::OnSent(const Event& event) {
  abort_.reset();
  const std::optional<SdoRequest> request = ParseRequest(event.bytes);
  if (!request) return;
  pending_ = request;
  sent_ = event.received;
  due_ = sent_.last + (request->object == kStoreAll && request->write ? std::max(kSaveTime, timeout_) : timeout_);
}

SdoClient::Evaluation SdoClient::OnAnswer(const Event& event) {
  const SdoAnswer answer = ParseAnswer(event.bytes);
  if (TakeLate(answer.object, event.received.last) || !pending_ || !Answers(answer, *pending_)) {
    return {.result = {}, .unexpected_answer = true};
  }
  silent_in_a_row_ = 0;
  unanswered_.clear();
  if (fence_ == pending_->object) fence_.reset();
  Kind kind = Kind::kAborted;
  if (answer.kind == SdoAnswer::Kind::kValue) kind = Kind::kValue;
  if (answer.kind == SdoAnswer::Kind::kWritten) kind = Kind::kWritten;
  if (answer.kind == SdoAnswer::Kind::kSegmented) {
    kind = Kind::kSegmented;
    abort_ = AbortFrame(node_, pending_->object, AbortCode::kBadLength);
  }
  return {.result = End(kind, answer.value, event.received)};
}

SdoResult SdoClient::End(Kind kind, std::uint32_t value, Interval received) {
  const SdoRequest request = *std::exchange(pending_, std::nullopt);
  return {.kind = kind, .request = request, .value = value, .sent = sent_, .received = received};
}

SdoResult SdoClient::TimeOut(MonoNs now) {
  ++silent_in_a_row_;
  abort_ = AbortFrame(node_, pending_->object, AbortCode::kTimedOut);
  std::erase_if(unanswered_, [now](const Unanswered& request) { return request.until <= now; });
  unanswered_.push_back({pending_->object, sent_.last + late_});
  fence_ = Fence();
  return End(Kind::kTimedOut, 0, {now, now});
}

bool SdoClient::TakeLate(ObjectId object, MonoNs now) {
  std::erase_if(unanswered_, [now](const Unanswered& request) { return request.until <= now; });
  const auto found = std::find_if(unanswered_.begin(), unanswered_.end(),
                                  [object](const Unanswered& request) { return request.object == object; });
  if (found == unanswered_.end()) return false;
  unanswered_.erase(unanswered_.begin(), found + 1);  // answers come in the order of their requests
  return true;
}

ObjectId SdoClient::Fence() const {
  const auto is_free = [this](ObjectId object) {
    return std::none_of(unanswered_.begin(), unanswered_.end(),
                        [object](const Unanswered& request) { return request.object == object; });
  };
  const auto* found = std::find_if(kFences.begin(), kFences.end(), is_free);
  return found != kFences.end() ? *found : kFences.front();
}

}  // namespace axlecast::canopen
