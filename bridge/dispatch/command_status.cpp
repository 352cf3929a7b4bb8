#include "bridge/dispatch/command_status.h"

#include <algorithm>

#include "core/base/text.h"

namespace axlecast {

using S = command_status_t;

command_status_t StatusOf(const command_body_t& body, std::int64_t digest) {
  command_status_t status{};
  std::copy(std::begin(body.id), std::end(body.id), std::begin(status.id));
  status.body_digest = digest;
  status.device = CappedText(body.device, kNameBytes);
  status.operation = CappedText(body.operation, kNameBytes);
  status.epoch_after = -1;
  return status;
}

S Refused(S status, const Refusal& refusal, Timestamp now) {
  const bool late = refusal.reason == S::REASON_DEADLINE;
  status.state = late ? S::STATE_EXPIRED : S::STATE_REJECTED;
  status.is_final = 1;
  status.reason_code = refusal.reason;
  status.text = CappedText(refusal.text, kTextBytes);
  status.finished_utime = now.utime;
  return status;
}

}  // namespace axlecast
