#include "drivers/tformat/simulator_request.h"

#include <array>
#include <cassert>

namespace axlecast::tformat {
namespace {

// Spec 6.3.1, Table 1, bit by bit: cc0 to cc3 and the parity cc4; with the length of the request (Figures 1 to 3).
struct TableRow {
  std::uint8_t data_id;
  std::array<std::uint8_t, 5> code;
  std::size_t request_size;
};
constexpr std::array<TableRow, 9> kTable1 = {{
    {0x0, {0, 0, 0, 0, 0}, 1},
    {0x1, {1, 0, 0, 0, 1}, 1},
    {0x2, {0, 1, 0, 0, 1}, 1},
    {0x3, {1, 1, 0, 0, 0}, 1},
    {0x6, {0, 1, 1, 0, 0}, 4},  // CF ADF EDF CRC
    {0xD, {1, 0, 1, 1, 1}, 3},  // CF ADF CRC
    {0x7, {1, 1, 1, 0, 1}, 1},
    {0x8, {0, 0, 0, 1, 1}, 1},
    {0xC, {0, 0, 1, 1, 0}, 1},
}};
constexpr std::array<std::uint8_t, 3> kSinkCode = {0, 1, 0};
constexpr std::uint8_t kLastUserCell = 79;

std::uint8_t BitOf(std::uint8_t byte, std::size_t bit) {
  return static_cast<std::uint8_t>(unsigned{byte} >> bit & 1U);
}

const TableRow* FindRow(std::uint8_t data_id) {
  for (const TableRow& row : kTable1) {
    if (row.data_id == data_id) return &row;
  }
  return nullptr;
}

// Remainder of division by X^8 + 1, bit by bit (spec 6.3.4): the bit that leaves the register comes back at its
// end.
std::uint8_t Remainder(Bytes bytes) {
  std::uint8_t rest = 0;
  for (const std::uint8_t byte : bytes) {
    for (std::size_t bit = 0; bit < 8; ++bit) {
      rest = static_cast<std::uint8_t>((rest >> 1U | rest << 7U) ^ (BitOf(byte, bit) << 7U));
    }
  }
  return rest;
}

bool HasSinkCode(std::uint8_t field) {
  for (std::size_t bit = 0; bit < kSinkCode.size(); ++bit) {
    if (BitOf(field, bit) != kSinkCode.at(bit)) return false;
  }
  return true;
}

}  // namespace

std::uint8_t TableControlField(std::uint8_t data_id) {
  const TableRow* row = FindRow(data_id);
  assert(row != nullptr);
  unsigned field = 0;
  for (std::size_t bit = 0; bit < kSinkCode.size(); ++bit) field |= unsigned{kSinkCode.at(bit)} << bit;
  for (std::size_t bit = 0; bit < row->code.size(); ++bit) field |= unsigned{row->code.at(bit)} << (3 + bit);
  return static_cast<std::uint8_t>(field);
}

SimulatedRequest CheckRequest(Bytes bytes, bool complete) {
  using Verdict = SimulatedRequest::Verdict;
  SimulatedRequest request;
  const std::uint8_t field = bytes.front();
  request.field = field;
  request.size = 1;
  if (!HasSinkCode(field)) {
    request.verdict = Verdict::kNoSync;
    return request;
  }
  request.data_id = static_cast<std::uint8_t>(field >> 3U & 0x0FU);
  for (std::size_t bit = 3; bit < 8; ++bit) request.parity_error ^= BitOf(field, bit) != 0;
  const TableRow* row = FindRow(request.data_id);
  if (row == nullptr || request.parity_error) {
    // Its length is unknown: the frame ends where the bytes end (spec 7.2).
    request.verdict = Verdict::kAbnormal;
    request.size = bytes.size();
    return request;
  }
  if (bytes.size() < row->request_size) {
    request.verdict = complete ? Verdict::kAbnormal : Verdict::kIncomplete;
    request.size = bytes.size();
    return request;
  }
  request.size = row->request_size;
  request.verdict = Verdict::kGood;
  if (row->request_size == 1) return request;
  request.address = bytes[1];
  if (row->request_size == 4) request.data = bytes[2];
  // The busy bit of a request is 0 (Table 4); an address above 79 includes it.
  const bool crc_fits = Remainder(bytes.first(row->request_size - 1)) == bytes[row->request_size - 1];
  if (!crc_fits || request.address > kLastUserCell) request.verdict = Verdict::kAbnormal;
  return request;
}

}  // namespace axlecast::tformat
