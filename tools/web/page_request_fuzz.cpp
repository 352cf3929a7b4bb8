#include <cstdlib>

#include "tools/web/client_stream.h"

// Any frame of a browser is refused with a reason, or is within its limits.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const axlecast::Result<axlecast::PageRequest> request =
      axlecast::ParsePageRequest(std::string_view(reinterpret_cast<const char*>(data), size));
  if (!request) {
    if (request.error().text.empty()) std::abort();
  } else if (const auto* subscribe = std::get_if<axlecast::SubscribeRequest>(&*request)) {
    if (subscribe->devices.size() > axlecast::kMaxSubscribed || !(subscribe->history_s >= 0)) std::abort();
  } else if (const auto* seek = std::get_if<axlecast::SeekRequest>(&*request)) {
    if (seek->utime < 0) std::abort();
  } else if (const auto* speed = std::get_if<axlecast::SpeedRequest>(&*request)) {
    if (!(speed->factor >= axlecast::kSlowestPlay && speed->factor <= axlecast::kFastestPlay)) std::abort();
  }
  return 0;
}
