#include "tools/convert/wire_frames.h"

#include <algorithm>

namespace axlecast {

bool VisitRecords(const wire_t& message, const WireVisitor& visit) {
  constexpr std::int64_t kNsPerUs = 1'000;
  constexpr std::int64_t kLatest = INT64_MAX / kNsPerUs / 2;
  const std::int64_t start = std::clamp(message.utime, std::int64_t{0}, kLatest) * kNsPerUs;
  return std::all_of(message.records.begin(), message.records.end(), [&](const wire_record_t& record) {
    return visit(std::max(std::int64_t{0}, start + record.dt_ns), message, record);
  });
}

std::optional<CanFrame> FrameOnBus(const wire_record_t& record) {
  switch (record.direction) {
    case wire_record_t::DIRECTION_RECEIVE:
    case wire_record_t::DIRECTION_STRAY:
    case wire_record_t::DIRECTION_CONFIRMED:
      break;
    default:
      return std::nullopt;
  }
  if (record.data.size() > kMaxCanData) return std::nullopt;
  return CanFrame{.id = static_cast<std::uint32_t>(record.id), .data = InlineBytes<kMaxCanData>(record.data)};
}

}  // namespace axlecast
