#include "drivers/runtime/process/duplicate_driver_detector.h"

#include <axlecast/driver_status_t.hpp>

#include "core/messages/message.h"

namespace axlecast {

void DuplicateDriverDetector::OnDriverStatus(Bytes message) {
  const auto status = DecodeMessage<driver_status_t>(message);
  if (!status || status->boot_id == boot_id_) return;
  const bool leaves = status->kind == driver_status_t::KIND_GOODBYE;
  present_until_.store(leaves ? 0 : clock_.Now() + kGoneAfter, std::memory_order_relaxed);
}

}  // namespace axlecast
