#include "drivers/saa_can/ending.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::saa_can {
namespace {

using Reason = command_status_t;

constexpr MonoNs kPatience = 2 * kSecond;
constexpr int kPatiencePeriods = 10;
// By which positions of a shaft at rest differ from each other.
constexpr std::int64_t kFlicker = 16;

}  // namespace

MonoNs Patience(const SaaCanSettings& settings) { return std::max(kPatience, kPatiencePeriods * settings.period); }

std::optional<Outcome> NotDelivered(const Delivery& delivery, const SaaCanSettings& settings) {
  if (delivery.state() == Delivery::State::kRefused) {
    return Final(
        CommandState::kFailed, Reason::REASON_NO_REPLY,
        "nothing was done: the controller's queue is full, because no node acknowledges what is sent: check "
        "cable, termination and bit rate");
  }
  if (delivery.state() != Delivery::State::kNotConfirmed) return std::nullopt;
  return Final(
      CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
      Text("no node acknowledged the frame in %lld ms: it may still wait in the controller's queue and act "
           "later; drop it with: sudo ip link set %s down",
           static_cast<long long>(Delivery::kConfirmWithin / kMillisecond), settings.iface.c_str()));
}

Outcome LinkLost(bool sent, const char* look) {
  if (!sent) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost before it");
  }
  return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
               std::string("the link was lost after the request and before its effect could be seen: ") + look +
                   " when it is back");
}

std::string PositionText(std::int64_t counts, int bits) {
  return Text("%.4f deg (counts %lld)", Degrees(counts, bits), static_cast<long long>(counts));
}

bool LooksLikeReply(std::int64_t counts, Command command, const SaaCanSettings& settings) {
  InlineBytes<kMaxCanData> reply{static_cast<std::uint8_t>(command), 0, 0, 0};
  const Position alike = ParsePosition(reply, settings.format);
  if (alike.error != PositionError::kNone) return false;
  return CircularDistance(counts, alike.counts, settings.counts_per_turn) <= kFlicker;
}

bool IsNearZero(std::int64_t counts, const SaaCanSettings& settings) {
  return CircularDistance(counts, 0, settings.counts_per_turn) <= ZeroToleranceCounts(settings.format.bits);
}

bool AtRest(const DeviceOutput& output, MonoNs now) {
  const Motion motion = output.MotionAt(now);
  return motion.known && motion.standstill;
}

std::string IpLinkLine(const std::string& iface, std::int64_t bitrate) {
  return Text("ip link set %s down; ip link set %s up type can bitrate %lld restart-ms 100", iface.c_str(),
              iface.c_str(), static_cast<long long>(bitrate));
}

}  // namespace axlecast::saa_can
