#include "drivers/tsubaki_sc/requests.h"

namespace axlecast::tsubaki_sc {
namespace {

// Guideline 12: address, 11, version high and low, CRC: there is no byte count.
std::size_t VersionLength(Bytes so_far) {
  constexpr std::size_t kVersionReply = 6;
  constexpr std::size_t kExceptionReply = 5;
  if (so_far.size() < 2) return 0;
  return (so_far[1] & 0x80) != 0 ? kExceptionReply : kVersionReply;
}

// A reply to Report Slave ID has no byte count: the standard check does not know it.
ReplyMatch MatchVersion(Bytes request, Bytes reply) {
  constexpr std::size_t kSize = 6;
  if (reply.size() != kSize) return modbus::MatchReply(request, reply);
  const bool own = reply[0] == request[0] && reply[1] == request[1];
  if (!own) return ReplyMatch::kNo;
  return modbus::IsSealed(reply) ? ReplyMatch::kYes : ReplyMatch::kDamaged;
}

}  // namespace

Exchange Requests::Read(const Block& block) const {
  if (block == kVersion) {
    const auto function = static_cast<std::uint8_t>(modbus::Function::kReportServerId);
    Exchange exchange = Ask(modbus::Sealed({address_, function}));
    exchange.reply_length = &VersionLength;
    exchange.shape.match = &MatchVersion;
    return exchange;
  }
  Exchange exchange = Ask(modbus::Read(address_, block.read, block.first, block.count));
  // The mains frequency is the same whenever it is asked for: it is the fence.
  exchange.shape.interchangeable = block == kMains;
  return exchange;
}

// A stop is never held back; what it did is read afterwards.
Exchange Requests::SetCoil(std::uint16_t coil) const {
  Exchange exchange = Ask(modbus::WriteCoil(address_, coil, true));
  if (coil == kStopCoilAddress) {
    exchange.shape.interchangeable = true;
    exchange.shape.exact = false;
  }
  return exchange;
}

Exchange Requests::Write(std::uint16_t first, std::span<const std::uint16_t> values) const {
  return Ask(values.size() == 1 ? modbus::WriteRegister(address_, first, values[0])
                                : modbus::WriteRegisters(address_, first, values));
}

Exchange Requests::Secret(const Frame& request) const {
  Exchange exchange = Ask(request);
  exchange.secret = true;
  return exchange;
}

Exchange Requests::Ask(const Frame& request) const {
  Exchange exchange{.request = request, .reply_length = &modbus::ReplyLength, .timeout = timeout_};
  exchange.shape = modbus::ShapeOf(request);
  return exchange;
}

bool IsLogin(Bytes request) {
  constexpr std::size_t kShortest = 6;
  return request.size() >= kShortest &&
         request[1] == static_cast<std::uint8_t>(modbus::Function::kWriteRegisters) &&
         ((request[2] << 8) | request[3]) == kLoginBlock.first;
}

}  // namespace axlecast::tsubaki_sc
