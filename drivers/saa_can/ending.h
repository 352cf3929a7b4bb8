#pragma once

#include <optional>
#include <string>

#include "core/device/device.h"
#include "drivers/saa_can/delivery.h"
#include "drivers/saa_can/settings.h"

// Words and judgements that the procedures share.
namespace axlecast::saa_can {

// For a position: several periods of a slow encoder, or several requests in vain.
[[nodiscard]] MonoNs Patience(const SaaCanSettings& settings);

// How the order ends when its frame did not come onto the bus; nothing while it may, or when it did.
[[nodiscard]] std::optional<Outcome> NotDelivered(const Delivery& delivery, const SaaCanSettings& settings);

// The link is gone. `sent`: the frame that changes something may have gone out.
[[nodiscard]] Outcome LinkLost(bool sent, const char* look);

// "14.0625 deg (counts 640)"
[[nodiscard]] std::string PositionText(std::int64_t counts, int bits);

// The shaft stands where a position has the bytes of the reply to this command.
[[nodiscard]] bool LooksLikeReply(std::int64_t counts, Command command, const SaaCanSettings& settings);

// Whether a position is what an encoder that was just cleared to zero may read.
[[nodiscard]] bool IsNearZero(std::int64_t counts, const SaaCanSettings& settings);

[[nodiscard]] bool AtRest(const DeviceOutput& output, MonoNs now);

// How root brings the interface up at this rate, in one line.
[[nodiscard]] std::string IpLinkLine(const std::string& iface, std::int64_t bitrate);

}  // namespace axlecast::saa_can
