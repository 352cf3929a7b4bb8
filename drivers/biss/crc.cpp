#include "drivers/biss/crc.h"

namespace axlecast::biss {
namespace {

constexpr unsigned kRegister = 16;
constexpr std::uint32_t kTop = 1U << (kRegister - 1);

// One bit, in the top of the register, is divided.
constexpr std::uint32_t Divide(std::uint32_t remainder, std::uint32_t polynomial) {
  return ((remainder & kTop) != 0 ? remainder << 1U ^ polynomial : remainder << 1U) & 0xFFFFU;
}

}  // namespace

Crc::Crc(const CrcRule& rule) : bits_(rule.bits), shift_(kRegister - static_cast<unsigned>(rule.bits)) {
  const std::uint32_t polynomial = rule.polynomial << shift_ & 0xFFFFU;  // its highest term is the bit that goes
  for (std::uint32_t byte = 0; byte < table_.size(); ++byte) {
    std::uint32_t remainder = byte << 8U;
    for (int i = 0; i < 8; ++i) remainder = Divide(remainder, polynomial);
    table_[byte] = static_cast<std::uint16_t>(remainder);
  }
  start_ = static_cast<std::uint16_t>(rule.start << shift_);
  inversion_ = rule.inverted ? (1U << static_cast<unsigned>(rule.bits)) - 1 : 0;
}

std::uint32_t Crc::Of(std::uint64_t value, int count) const {
  std::uint32_t remainder = start_;
  int left = count;
  // Bits that fill no byte come first: a table's step over fewer bits than 8 shifts by fewer.
  if (const auto odd = static_cast<unsigned>(left % 8); odd > 0) {
    left -= static_cast<int>(odd);
    const std::uint32_t first =
        (static_cast<std::uint32_t>(value >> static_cast<unsigned>(left)) & ((1U << odd) - 1));
    const std::uint32_t index = remainder >> (kRegister - odd) ^ first;
    remainder = (remainder << odd ^ table_[index & 0xFFU]) & 0xFFFFU;
  }
  while (left > 0) {
    left -= 8;
    const auto byte = static_cast<std::uint32_t>(value >> static_cast<unsigned>(left)) & 0xFFU;
    remainder = (remainder << 8U ^ table_[remainder >> 8U ^ byte]) & 0xFFFFU;
  }
  return remainder >> shift_ ^ inversion_;
}

}  // namespace axlecast::biss
