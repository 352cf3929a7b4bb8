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

}  // namespace

Exchange Requests::Read(const Block& block) const {
  if (block == kVersion) {
    const auto function = static_cast<std::uint8_t>(modbus::Function::kReportServerId);
    return {.request = modbus::Sealed({address_, function}), .reply_length = &VersionLength, .timeout = timeout_};
  }
  return {.request = modbus::Read(address_, block.read, block.first, block.count),
          .reply_length = &modbus::ReplyLength,
          .timeout = timeout_};
}

Exchange Requests::SetCoil(std::uint16_t coil) const {
  return {.request = modbus::WriteCoil(address_, coil, true),
          .reply_length = &modbus::ReplyLength,
          .timeout = timeout_};
}

Exchange Requests::Write(std::uint16_t first, std::span<const std::uint16_t> values) const {
  return {.request = values.size() == 1 ? modbus::WriteRegister(address_, first, values[0])
                                        : modbus::WriteRegisters(address_, first, values),
          .reply_length = &modbus::ReplyLength,
          .timeout = timeout_};
}

Exchange Requests::Secret(const Frame& request) const {
  return {
      .request = request, .reply_length = &modbus::ReplyLength, .timeout = timeout_, .pulse = {}, .secret = true};
}

bool IsLogin(Bytes request) {
  constexpr std::size_t kShortest = 6;
  return request.size() >= kShortest &&
         request[1] == static_cast<std::uint8_t>(modbus::Function::kWriteRegisters) &&
         ((request[2] << 8) | request[3]) == kLoginBlock.first;
}

}  // namespace axlecast::tsubaki_sc
